"""Parameters of OWL-S processes, and what their values are to us.

OWL-S gives a parameter a datatype or a class. Datatypes become text, numbers and truth values. A class that
some process makes members of becomes data: a text that only services understand, as no planner can reckon
with individuals that do not exist yet. A class that no process makes members of stays a class, whose members
are the individuals that a site declares.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from rdflib import RDF, RDFS, XSD, URIRef
from rdflib.term import Node

from kb.imports.draft import Draft
from kb.imports.names import local, parameter_name
from kb.imports.owls_terms import PROCESS
from kb.imports.report import Fate
from kb.imports.source import Source, texts
from kb.vocabulary import CORE, Property

_NUMBERS = {XSD.float, XSD.double, XSD.decimal}
_INTEGERS = {XSD[n] for n in ("integer", "int", "long", "short", "byte", "nonNegativeInteger", "positiveInteger")} | {
    XSD[n] for n in ("unsignedInt", "unsignedLong", "unsignedShort", "unsignedByte", "negativeInteger")
}
_ROLES = ((PROCESS.hasInput, "Input"), (PROCESS.hasOutput, "Output"))
_PROCESSES = (PROCESS.AtomicProcess, PROCESS.CompositeProcess, PROCESS.SimpleProcess)


@dataclass(frozen=True, slots=True, kw_only=True)
class Type:
    """What the values of a parameter are.

    Attributes:
        kind: IRI of the class.
        message: ROS type of the field that carries one.
    """

    kind: str
    message: str
    is_datum: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Slot:
    """A parameter of a process in our form.

    Attributes:
        source: Its node in the source; one that was added has a name of its own.
        name: Of its individual.
        parameter: Its name within the process.
        role: Class of the individual: Input, Output or Local.
    """

    source: Node
    name: str
    parameter: str
    role: str
    type: Type


TRUTH = Type(kind=CORE + "TruthValue", message="bool", is_datum=True)
TEXT = Type(kind=CORE + "Text", message="string", is_datum=True)


class Slots:
    """The parameters of all processes of a source."""

    def __init__(self, source: Source, draft: Draft) -> None:
        self._source, self._draft = source, draft
        self._made = self._classes_made()
        self._types: dict[str, Type] = {}
        self.of: dict[Node, list[Slot]] = {}
        for process in processes_of(source):
            self.of[process] = []
            for prop, role in _ROLES:
                for node in source.values(process, prop):
                    self.add(process, node, local(str(node)), role, self.type_of(node))

    def add(self, process: Node, node: Node, wanted: str, role: str, kind: Type) -> Slot:
        """Give a process a parameter."""
        own = self._draft.names.of(str(process), local(str(process)))
        stem = wanted.removeprefix(f"{local(str(process))}_")
        taken = {slot.parameter for slot in self.of[process]}
        name = parameter_name(stem)
        name = next(n for n in (name, *(f"{name}_{i}" for i in range(2, 10_000))) if n not in taken)
        entity = self._draft.names.fresh(f"{own}_{name}")
        slot = Slot(source=node, name=entity, parameter=name, role=role, type=kind)
        self.of[process].append(slot)
        return slot

    def find(self, process: Node, node: Node) -> Slot | None:
        """The parameter that a node of the source became."""
        return next((s for s in self.of.get(process, ()) if s.source == node), None)

    def drop(self, process: Node, slot: Slot) -> None:
        """Take a parameter away again."""
        self.of[process].remove(slot)

    def write(self, process: Node) -> Iterator[tuple[Property, str]]:
        """Add the parameters of a process to the draft, and tell how the process names them."""
        props = {"Input": Property.HAS_INPUT, "Output": Property.HAS_OUTPUT, "Local": Property.HAS_LOCAL}
        for number, slot in enumerate(self.of[process], start=1):
            remarks = self._remarks(slot.source)
            self._draft.individual(
                slot.name,
                slot.role,
                [(Property.PARAMETER_TYPE, slot.type.kind)],
                [(Property.PARAMETER_NAME, slot.parameter), (Property.PARAMETER_NUMBER, 10 * number)],
                comments=remarks[1],
                label=remarks[0],
            )
            yield props[slot.role], slot.name

    def _remarks(self, node: Node) -> tuple[str, list[str]]:
        """Label and comments of an entity that is carried over."""
        self._source.types(node)
        labels = list(texts(self._source.values(node, RDFS.label)))
        return labels[0] if labels else "", list(texts(self._source.values(node, RDFS.comment)))

    # Types

    def type_of(self, parameter: Node) -> Type:
        """What the values of a parameter of the source are to us."""
        stated = self._stated(parameter)
        if not stated:
            self._source.note(parameter, Fate.ASSUMED, "has no parameterType; its values are taken for texts")
            return TEXT
        if stated not in self._types:
            self._types[stated] = self._new_type(parameter, stated)
        return self._types[stated]

    def _stated(self, parameter: Node) -> str:
        return str(self._source.value(parameter, PROCESS.parameterType) or "").strip()

    def _new_type(self, parameter: Node, stated: str) -> Type:
        iri = URIRef(stated)
        if iri in _NUMBERS:
            return Type(kind=CORE + "Number", message="float64", is_datum=True)
        if iri in _INTEGERS:
            return Type(kind=CORE + "Number", message="int64", is_datum=True)
        if iri == XSD.boolean:
            return TRUTH
        if stated.startswith(str(XSD)):
            if iri != XSD.string:
                self._source.note(parameter, Fate.CHANGED, f"its values, xsd:{local(stated)}, are carried as texts")
            return TEXT
        if self._source.is_a(iri, RDFS.Datatype):
            self._source.note(parameter, Fate.CHANGED, f"its values, {local(stated)}, are carried as texts")
            return TEXT
        return self._class(parameter, stated)

    def _class(self, parameter: Node, stated: str) -> Type:
        name = self._draft.names.of(stated, local(stated))
        label, comments = self._remarks(URIRef(stated))
        comments = [*comments, f"Stands for <{stated}>."]
        if stated in self._made:
            told = f"{local(stated)}, whose members processes make, became data: a text that services write and read"
            self._source.note(parameter, Fate.CHANGED, told)
            kind = self._draft.kind(name, [CORE + "Text"], comments=comments, label=label)
            return Type(kind=kind, message="string", is_datum=True)
        kind = self._draft.kind(name, comments=comments, label=label)
        members = self._source.of_type(URIRef(stated))
        for member in members:
            self.member(member, kind)
        if not members:
            told = f"{local(stated)} has no member; declare individuals of it in the site that uses these processes"
            self._source.note(parameter, Fate.ASSUMED, told)
        return Type(kind=kind, message="string", is_datum=False)

    def member(self, node: Node, kind: str) -> str:
        """An individual of the source that is a value, as a member of a class of ours."""
        name = self._draft.names.of(str(node), local(str(node)))
        return self._draft.individual(name, kind, label=self._remarks(node)[0])

    def _classes_made(self) -> frozenset[str]:
        """Classes of outputs, and those that bindings connect with them."""
        made = {
            self._stated(output)
            for process in processes_of(self._source)
            for output in self._source.values(process, PROCESS.hasOutput)
        }
        pairs = [(self._stated(to), self._stated(of)) for to, of in self._connected()]
        before = -1
        while before != len(made):
            before = len(made)
            for pair in pairs:
                if made & set(pair):
                    made |= set(pair)
        return frozenset(made)

    def _connected(self) -> Iterator[tuple[Node, Node]]:
        graph = self._source.graph
        for binding, to in graph.subject_objects(PROCESS.toVar):
            for source in graph.objects(binding, PROCESS.valueSource):
                for of in graph.objects(source, PROCESS.theVar):
                    yield to, of


def processes_of(source: Source) -> list[Node]:
    """All processes of a source, in order."""
    return [p for kind in _PROCESSES for p in source.of_type(kind) if (p, RDF.type, kind) in source.graph]
