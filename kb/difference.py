"""What is different between two revisions: entities by file, processes, robots' capabilities, tasks.

Individuals have no blank nodes of their own, so that the difference of their triples is exact. Anonymous classes are
compared by what they say, whatever their blank nodes are called.
"""

from __future__ import annotations

import difflib
from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, TypeAlias

from rdflib import OWL, RDF, RDFS, BNode, Graph, Literal, URIRef
from rdflib.collection import Collection
from rdflib.term import Node

from kb.files import local_name
from kb.revisions import Revision, within
from kb.terms import Struct, Term, render
from kb.vocabulary import Property

_WIDTH = 100


class Change(StrEnum):
    """What has become of something."""

    ADDED = "added"
    REMOVED = "removed"
    CHANGED = "changed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Values:
    """The values of one property that are there no more, and those that are new."""

    prop: str
    removed: tuple[str, ...]
    added: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class EntityChange:
    """A class, individual or property that one file describes otherwise than before.

    Attributes:
        file: Its path within the folder of ontologies.
        sort: What it is: class, individual, property, ontology; axiom for what has no name, such as a rule.
    """

    file: str
    sort: str
    entity: str
    change: Change
    values: tuple[Values, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessChange:
    """What the planner is told otherwise of a process.

    Attributes:
        program: Lines of a difference between its Golog programs, `-` and `+`; empty if that is the same.
        removed: Other facts that hold no more: preconditions, effects, durations, what it requires.
        added: And those that hold from now on.
    """

    process: str
    program: tuple[str, ...]
    removed: tuple[str, ...]
    added: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CapabilityChange:
    """Classes which processes require that a robot belongs to no more, or from now on."""

    robot: str
    gained: tuple[str, ...]
    lost: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """All that is different.

    Attributes:
        tasks_added: Processes that can be asked for from now on.
        tasks_removed: And those that cannot be any more.
        groundings: Processes that are executed otherwise.
        individuals_removed: Robots, rooms, places and things that are not known any more.
    """

    entities: tuple[EntityChange, ...]
    processes: tuple[ProcessChange, ...]
    capabilities: tuple[CapabilityChange, ...]
    tasks_added: tuple[str, ...]
    tasks_removed: tuple[str, ...]
    groundings: tuple[str, ...]
    individuals_removed: tuple[str, ...]

    @property
    def is_empty(self) -> bool:
        """Whether both say the same."""
        return not any(asdict(self).values())

    @property
    def lines(self) -> tuple[str, ...]:
        """For people: a line for each change, details indented."""
        return tuple(_lines(self))

    @property
    def summary(self) -> str:
        """In one clause: `2 individuals changed, task Fetch added`."""
        counts: dict[tuple[str, str], int] = {}
        for e in self.entities:
            counts[e.sort, e.change] = counts.get((e.sort, e.change), 0) + 1
        told = [f"{n} {_plural(sort, n)} {change}" for (sort, change), n in sorted(counts.items())]
        told += [f"program of {p.process} changed" for p in self.processes if p.program]
        told += [f"task {t} added" for t in self.tasks_added] + [f"task {t} removed" for t in self.tasks_removed]
        told += [f"{c.robot} gains {', '.join(c.gained)}" for c in self.capabilities if c.gained]
        told += [f"{c.robot} loses {', '.join(c.lost)}" for c in self.capabilities if c.lost]
        return ", ".join(told) or "nothing is different"

    def as_data(self) -> dict[str, Any]:
        """As what JSON can hold."""
        return asdict(self)


def difference(old: Revision, new: Revision) -> Difference:
    """Compare two revisions of one site."""
    gone, come = _facts_apart(old, new)
    both = sorted(old.processes.keys() & new.processes.keys())
    return Difference(
        entities=tuple(_entities(old, new)),
        processes=tuple(p for name in both if (p := _process(name, old, new, gone, come)) is not None),
        capabilities=tuple(_capabilities(old, new)),
        tasks_added=tuple(sorted(new.processes.keys() - old.processes.keys())),
        tasks_removed=tuple(sorted(old.processes.keys() - new.processes.keys())),
        groundings=tuple(n for n in both if old.executed(n) != new.executed(n)),
        individuals_removed=tuple(sorted(old.things - new.things)),
    )


def _lines(d: Difference) -> Iterator[str]:
    for e in d.entities:
        yield f"{e.file}: {e.sort} {e.entity} {e.change}"
        if e.change is Change.CHANGED or e.sort == "axiom":
            for v in e.values:
                yield from (f"  - {v.prop} {value}" for value in v.removed)
                yield from (f"  + {v.prop} {value}" for value in v.added)
    for task in d.tasks_added:
        yield f"task {task} can be asked for"
    for task in d.tasks_removed:
        yield f"task {task} cannot be asked for any more"
    for p in d.processes:
        yield f"process {p.process} " + ("has another program" if p.program else "is told otherwise to the planner")
        yield from (f"  {line}" for line in p.program)
        yield from (f"  - {text}" for text in p.removed)
        yield from (f"  + {text}" for text in p.added)
    for name in d.groundings:
        yield f"process {name} is executed otherwise"
    for c in d.capabilities:
        yield from (f"robot {c.robot} becomes a {kind}" for kind in c.gained)
        yield from (f"robot {c.robot} is no {kind} any more" for kind in c.lost)


def _plural(sort: str, count: int) -> str:
    if count == 1:
        return sort
    return {"class": "classes", "property": "properties", "ontology": "ontologies"}.get(sort, f"{sort}s")


# Entities, by file

_Described: TypeAlias = Mapping[str, frozenset[tuple[str, str]]]
"""(property, value) pairs by entity."""


def _entities(old: Revision, new: Revision) -> Iterator[EntityChange]:
    before, after = _by_file(old, new), _by_file(new, old)
    for name in sorted(before.keys() | after.keys()):
        was, now = before.get(name, (Graph(), {})), after.get(name, (Graph(), {}))
        for entity in sorted(was[1].keys() | now[1].keys()):
            gone, come = was[1].get(entity, frozenset()), now[1].get(entity, frozenset())
            if gone == come:
                continue
            graph, change = now[0], Change.CHANGED
            if not come:
                graph, change = was[0], Change.REMOVED
            elif not gone:
                change = Change.ADDED
            lost, won = sorted(gone - come), sorted(come - gone)
            values = tuple(
                Values(
                    prop=prop,
                    removed=tuple(v for p, v in lost if p == prop),
                    added=tuple(v for p, v in won if p == prop),
                )
                for prop in sorted({p for p, _ in [*lost, *won]})
            )
            sort = _sort(graph, entity)
            yield EntityChange(file=name, sort=sort, entity=local_name(entity), change=change, values=values)


def _by_file(revision: Revision, other: Revision) -> dict[str, tuple[Graph, _Described]]:
    """What the files of a revision describe, but for those that are the same in the other one."""
    described: dict[str, tuple[Graph, _Described]] = {}
    same = {(within(f.path, other.folder), f.content) for f in other.ontology.files.files}
    for file in revision.ontology.files.files:
        if (within(file.path, revision.folder), file.content) in same:
            continue
        graph, found = file.graph, dict[str, set[tuple[str, str]]]()
        inner = {o for o in graph.objects() if isinstance(o, BNode)}
        for subject, prop, value in graph:
            if isinstance(subject, URIRef):
                found.setdefault(str(subject), set()).add((_name(prop), _text(graph, value)))
        for subject in {s for s in graph.subjects() if isinstance(s, BNode) and s not in inner}:
            found.setdefault(_axiom(graph, subject), set()).add(("says", _text(graph, subject)))
        described[within(file.path, revision.folder)] = (
            graph,
            {entity: frozenset(pairs) for entity, pairs in found.items()},
        )
    return described


def _axiom(graph: Graph, node: Node) -> str:
    """What an axiom without a name is called: its label, or what sort it is."""
    label = graph.value(node, RDFS.label)
    return str(label) if label is not None else _name(graph.value(node, RDF.type))


def _sort(graph: Graph, entity: str) -> str:
    kinds = set(graph.objects(URIRef(entity), RDF.type))
    if not kinds:
        return "entity" if ":" in entity else "axiom"
    if OWL.NamedIndividual in kinds:
        return "individual"
    for kind, sort in ((OWL.Class, "class"), (OWL.Ontology, "ontology")):
        if kind in kinds:
            return sort
    properties = {OWL.ObjectProperty, OWL.DatatypeProperty, OWL.AnnotationProperty}
    return "property" if kinds & properties else "individual"


def _name(node: Node | None) -> str:
    return "axiom" if node is None else local_name(str(node)).rsplit("/", 1)[-1]


def _text(graph: Graph, node: Node) -> str:
    """A node as people read it; an anonymous one by what it says, in Manchester syntax where that is common."""
    if isinstance(node, Literal):
        language = f"@{node.language}" if node.language else ""
        return f'"{node}"{language}' if node.datatype is None else str(node)
    if not isinstance(node, BNode):
        return local_name(str(node))
    if graph.value(node, RDF.first) is not None:
        return f"({', '.join(_text(graph, item) for item in Collection(graph, node))})"
    parts = {(p, _text(graph, o)) for p, o in graph.predicate_objects(node) if o != node}
    known = dict(parts)
    prop = known.get(OWL.onProperty)
    for marker, word in ((OWL.someValuesFrom, "some"), (OWL.allValuesFrom, "only"), (OWL.hasValue, "value")):
        if prop is not None and marker in known:
            return f"{prop} {word} {known[marker]}"
    return "{" + ", ".join(sorted(f"{_name(p)} {text}" for p, text in parts)) + "}"


# What the planner is told


def _facts_apart(old: Revision, new: Revision) -> tuple[list[Struct], list[Struct]]:
    """Facts that only the old revision has, and those that only the new one has; without their revisions, in order."""
    before, after = _plain(old), _plain(new)
    gone = [before[key] for key in before.keys() - after.keys()]
    come = [after[key] for key in after.keys() - before.keys()]
    return sorted(gone, key=render), sorted(come, key=render)


def _plain(revision: Revision) -> dict[Hashable, Struct]:
    """The facts without their revision, by what tells them apart."""
    plain = [Struct(f.functor, f.args[1:]) for f in revision.facts if isinstance(f, Struct)]
    return {_told_apart(fact): fact for fact in plain}


def _told_apart(fact: Struct) -> Hashable:
    if fact.functor in _OF_INDIVIDUALS:  # most are such, and flat
        return fact.functor, fact.args, tuple(map(type, fact.args))
    return render(fact)


_OF_INDIVIDUALS = frozenset({"kind", "value", "fluent"})


def _process_of(fact: Struct) -> str | None:
    """The process that a fact is about, if it is about one."""
    if fact.functor in _OF_INDIVIDUALS:
        return None
    head = fact.args[0]
    return head.functor if isinstance(head, Struct) else head if isinstance(head, str) else None


def _process(
    name: str, old: Revision, new: Revision, gone: Iterable[Struct], come: Iterable[Struct]
) -> ProcessChange | None:
    def others(facts: Iterable[Struct]) -> tuple[str, ...]:
        return tuple(sorted(render(f) for f in facts if _process_of(f) == name and f.functor != "definition"))

    program = _program_change(_own_program(old, name), _own_program(new, name))
    removed, added = others(gone), others(come)
    if not program and not removed and not added:
        return None
    return ProcessChange(process=name, program=program, removed=removed, added=added)


def _own_program(revision: Revision, name: str) -> list[str]:
    process = revision.processes[name]
    definitions = () if process.is_atomic else revision.compiler.program(name).definitions[:1]
    return [line for definition in definitions for line in _pretty(definition, "")]


def _program_change(before: list[str], after: list[str]) -> tuple[str, ...]:
    if before == after:
        return ()
    return tuple(
        line for line in difflib.unified_diff(before, after, lineterm="", n=1) if line[:3] not in ("---", "+++")
    )


def _pretty(term: Term, indent: str) -> Iterator[str]:
    """A term in lines that are not too long."""
    text = render(term)
    if len(indent) + len(text) <= _WIDTH or not isinstance(term, Struct | list):
        yield indent + text
        return
    opening, closing, parts = ("[", "]", term) if isinstance(term, list) else (f"{term.functor}(", ")", list(term.args))
    yield indent + opening
    for part in parts:
        yield from _pretty(part, indent + "  ")
    yield indent + closing


def _capabilities(old: Revision, new: Revision) -> Iterator[CapabilityChange]:
    asked = {str(f.args[2]) for r in (old, new) for f in r.facts if isinstance(f, Struct) and f.functor == "requires"}
    robots = set(old.ontology.individuals("Robot")) & set(new.ontology.individuals("Robot"))
    for robot in sorted(robots):
        before, after = old.ontology.kinds[robot] & asked, new.ontology.kinds[robot] & asked
        if before != after:
            yield CapabilityChange(
                robot=robot, gained=tuple(sorted(after - before)), lost=tuple(sorted(before - after))
            )


# What a task rests on


def program_changed(task: str, old: Revision, new: Revision) -> str:
    """The process of a task type, itself or one that it comes to, whose program is another one; empty if none."""
    if task not in new.processes:
        return task
    names = _comes_to(task, old)
    for name in sorted(names):
        was, now = old.processes.get(name), new.processes.get(name)
        if was is None or now is None or was.parameters != now.parameters or was.is_atomic != now.is_atomic:
            return name
    mine, its = old.compiler.program(task), new.compiler.program(task)
    texts = {render(d) for d in its.definitions}
    for definition in mine.definitions:
        if render(definition) not in texts:
            head = definition.args[0] if isinstance(definition, Struct) else definition
            return head.functor if isinstance(head, Struct) else str(head)
    return ""


def concerned(task: str, old: Revision, new: Revision, carried: Iterable[tuple[str, str]]) -> str:
    """The first thing that has changed of what plans for a task rest on; empty if nothing has.

    That is: facts of the processes that it comes to; individuals of the classes, and values of the properties, that
    their programs and conditions name; what travel times depend on.

    Args:
        carried: The (property, individual) pairs whose values are others now.
    """
    names = _comes_to(task, old)
    gone, come = _facts_apart(old, new)
    words = set(names) | _ALWAYS
    for definition in old.compiler.program(task).definitions:
        words |= _words(definition)
    for fact in old.facts:
        if isinstance(fact, Struct) and _process_of(Struct(fact.functor, fact.args[1:])) in names:
            words |= _words(fact)
    words |= {f.of_property for r in (old, new) for e in r.travel_estimates for f in e.request if f.of_property}
    for sign, facts in (("no more", gone), ("from now on", come)):
        for fact in facts:
            process = _process_of(fact)
            matters = process in names if process is not None else fact.functor != "fluent" and _matters(fact, words)
            if matters:
                return f"{render(fact)} holds {sign}"
    for prop, subject in sorted(carried):
        if prop in words:
            return f"{prop}({subject}) has another value"
    changed = [n for n in sorted(names) if old.executed(n) != new.executed(n)]
    if changed:
        return f"{changed[0]} is executed otherwise"
    return "travel times are estimated otherwise" if _traveling(old) != _traveling(new) else ""


def _traveling(revision: Revision) -> list[tuple[str, str, tuple[str, ...]]]:
    """How travel times are estimated, wherever the folder is."""
    told = []
    for estimate in revision.travel_estimates:
        files = [within(f.file, revision.folder) for f in estimate.request if f.file is not None]
        fields = tuple(
            f"{f.name} {f.of_property} {f.file and within(f.file, revision.folder)}" for f in estimate.request
        )
        told.append((estimate.service, " ".join(fields), tuple(revision.data[file] for file in files)))
    return told


_ALWAYS = frozenset(
    {
        "Robot",
        Property.LOCATED_AT,
        Property.POSE_X_M,
        Property.POSE_Y_M,
        Property.POSE_YAW_RAD,
        Property.ENERGY_J,
        Property.POWER_W,
        Property.CAPACITY,
        Property.TRAVEL_FACTOR,
    }
)
"""What the planner looks at whatever the program is."""


def _matters(fact: Struct, words: set[str]) -> bool:
    if fact.functor == "kind":
        return fact.args[1] in words or fact.args[0] in words
    return fact.args[0] in words


def _comes_to(task: str, revision: Revision) -> frozenset[str]:
    """The processes that a program may perform, itself included."""
    names = {task}
    for definition in revision.compiler.program(task).definitions:
        names |= _words(definition)
    return frozenset(names & revision.processes.keys())


def _words(term: Term) -> set[str]:
    """All atoms and functors of a term."""
    match term:
        case Struct(functor, arguments):
            return {functor}.union(*map(_words, arguments))
        case list():
            return set[str]().union(*map(_words, term))
        case str():
            return {term}
        case _:
            return set()
