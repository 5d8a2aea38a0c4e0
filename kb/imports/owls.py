"""OWL-S 1.1 and 1.2 -> processes of ours ([RoboEarth] 3.4.3; W3C submission "OWL-S: Semantic Markup for Web Services").

One file comes of a process file and of what it imports from beside it. The report names all that is not the
same: what our model has no place for, what it needs and OWL-S does not say.
"""

from __future__ import annotations

from pathlib import Path

from rdflib import OWL, RDF, RDFS
from rdflib.term import Node

from kb.imports.draft import Draft
from kb.imports.names import local
from kb.imports.owls_composites import Composites
from kb.imports.owls_conditions import Conditions
from kb.imports.owls_groundings import DURATION_S, TIMEOUT_S, write_grounding
from kb.imports.owls_terms import EXPRESSION, PROCESS, SERVICE, canonical, is_vocabulary
from kb.imports.owls_types import Slots, processes_of
from kb.imports.report import Fate, Imported, NotImportable, in_order
from kb.imports.source import Source, texts
from kb.vocabulary import CORE_IRI, Kind, Property

_BECAUSE = "there is no place for it in our model"
_NOT_NEEDED = (PROCESS.invocable, SERVICE.describes, PROCESS.hasClient, PROCESS.performedBy)


def import_owls(path: Path, iri: str) -> Imported:
    """Read OWL-S processes.

    Args:
        path: The process file.
        iri: Of the ontology to make.

    Raises:
        NotImportable: The file does not parse, or has no process in it.
    """
    source = Source(path, is_vocabulary=is_vocabulary, canonical=canonical)
    if not processes_of(source):
        raise NotImportable(path, 0, "has no OWL-S process (AtomicProcess, CompositeProcess or SimpleProcess) in it")
    draft = Draft(iri)
    for process in processes_of(source):
        draft.names.of(str(process), local(str(process)))
    slots = Slots(source, draft)
    conditions = Conditions(source, draft, slots)
    _Processes(source, draft, slots, conditions).write()
    source.tell_unread(_BECAUSE)
    return Imported(
        iri=iri,
        entities=tuple(draft.entities.values()),
        imports=(CORE_IRI,),
        comments=(f"Imported from the OWL-S file {path.name}, ontology <{source.iri}>.",),
        label=local(source.iri).removesuffix(".owl"),
        notes=in_order(source.notes),
    )


class _Processes:
    def __init__(self, source: Source, draft: Draft, slots: Slots, conditions: Conditions) -> None:
        self._source, self._draft, self._slots, self._conditions = source, draft, slots, conditions
        self._composites = Composites(source, draft, slots, conditions)

    def write(self) -> None:
        found = processes_of(self._source)
        atomic = [p for p in found if self._source.is_a(p, PROCESS.AtomicProcess)]
        for process in found:
            if self._source.is_a(process, PROCESS.CompositeProcess):
                self._composites.convert(process)
        for process in atomic:
            name = self._name(process)
            write_grounding(self._source, self._draft, process, name, self._slots.of[process])
            self._write(process, Kind.ATOMIC_PROCESS, [])
        if atomic:
            told = f"duration_s {DURATION_S:g} and timeout_s {TIMEOUT_S:g} of {len(atomic)} atomic processes"
            self._source.note(self._source.iri, Fate.ASSUMED, f"{told}, as OWL-S gives none; correct them")
        for process in found:
            if process in self._composites.bodies:
                self._write(process, Kind.COMPOSITE_PROCESS, [(Property.COMPOSED_OF, self._composites.bodies[process])])
            elif self._source.is_a(process, PROCESS.SimpleProcess):
                self._write(process, Kind.SIMPLE_PROCESS, [])

    def _name(self, process: Node) -> str:
        return self._draft.names.of(str(process), local(str(process)))

    def _write(self, process: Node, kind: Kind, links: list[tuple[Property, str]]) -> None:
        source, name = self._source, self._name(process)
        links = [*links, *self._realized(process, name), *self._slots.write(process)]
        expressions = source.values(process, PROCESS.hasPrecondition)
        results, effects = self._results(process)
        for text in self._conditions.preconditions(process, [*expressions, *results], name):
            links.append((Property.HAS_PRECONDITION, text))
        for text in self._conditions.effects(process, effects, name):
            links.append((Property.HAS_EFFECT, text))
        source.values(process, *_NOT_NEEDED)
        labels = list(texts(source.values(process, RDFS.label, PROCESS.name)))
        comments = [*texts(source.values(process, RDFS.comment)), f"Stands for <{process}>."]
        values = [(Property.DURATION_S, DURATION_S)] if kind is Kind.ATOMIC_PROCESS else []
        self._draft.individual(name, kind, links, values, comments=comments, label=labels[0] if labels else "")

    def _realized(self, process: Node, name: str) -> list[tuple[Property, str]]:
        """Task types that a process is a recipe of; their parameters must have the same names."""
        source = self._source
        tasks = source.values(process, PROCESS.realizes, PROCESS.collapsesTo)
        tasks += source.subjects(PROCESS.realizedBy, process) + source.subjects(PROCESS.expandsTo, process)
        return [(Property.REALIZES, self._name(task)) for task in dict.fromkeys(tasks) if task in self._slots.of]

    def _results(self, process: Node) -> tuple[list[Node], list[Node]]:
        """Conditions and effects of the one result that our model can have: what a process is done for.

        A process of ours does what its effects say, or fails. Of results with conditions, the one whose conditions
        are about parameters alone is kept, and its conditions become preconditions: with them it is certain.
        """
        source = self._source
        results = source.values(process, PROCESS.hasResult)
        conditional: list[Node] = []
        kept: list[Node] = []
        for result in results:
            source.is_a(result, PROCESS.Result)
            asked = [c for c in source.values(result, PROCESS.inCondition) if c != EXPRESSION.AlwaysTrue]
            (conditional if asked else kept).append(result)
        plain = [r for r in conditional if not source.values(r, PROCESS.hasResultVar)]
        if len(plain) == 1 and not kept:
            told = f"the conditions of its result {_of(plain[0])}became preconditions: otherwise it does not do that"
            source.note(process, Fate.CHANGED, told)
            kept = plain
        for result in conditional:
            if result not in kept:
                told = f"its result {_of(result)}has conditions; a process of ours has the one outcome that it is for"
                source.note(process, Fate.LEFT_OUT, f"{told}: let the service fail instead")
                self._forget(result)
        conditions = [c for r in kept for c in source.values(r, PROCESS.inCondition) if c != EXPRESSION.AlwaysTrue]
        for result in kept:
            self._tell_constants(process, result)
        return conditions, [e for r in kept for e in source.values(r, PROCESS.hasEffect)]

    def _tell_constants(self, process: Node, result: Node) -> None:
        if self._source.is_a(process, PROCESS.AtomicProcess):
            for binding in self._source.values(result, PROCESS.withOutput):
                to, data = (self._source.value(binding, p) for p in (PROCESS.toVar, PROCESS.valueData))
                self._source.is_a(binding, PROCESS.OutputBinding)
                told = f"that the output {local(str(to))} is then {data}: what the service replies is believed"
                self._source.note(process, Fate.LEFT_OUT, told)

    def _forget(self, node: Node) -> None:
        """A part that has been told of as a whole is not told of again, statement by statement."""
        graph, todo = self._source.graph, [node]
        for part in todo:
            for prop, value in graph.predicate_objects(part):
                self._source.values(part, prop)  # type: ignore[arg-type]
                if value != RDF.nil and value not in todo and (value, RDF.type, OWL.Class) not in graph:
                    own = {s for s, p in graph.subject_predicates(value) if s not in todo}
                    if not own:
                        todo.append(value)


def _of(result: Node) -> str:
    """The name of a result for a sentence; nothing for an anonymous one."""
    text = str(result)
    return f"{local(text)} " if "#" in text else ""
