"""Conditions and effects of OWL-S, lists of SWRL atoms, -> our condition and effect individuals.

What an atom asks of an individual becomes a condition that the planner reckons with. What it asks of data, or
of something that we have no term for, only a service can answer: see `Test`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from xml.sax import SAXException

from rdflib import OWL, RDF, RDFS, XSD, Graph, Literal, URIRef
from rdflib.exceptions import ParserError
from rdflib.term import Node

from kb.imports.draft import Draft
from kb.imports.names import local, parameter_name
from kb.imports.owls_terms import EXPRESSION, FIRST, PROCESS, REST, SWRL
from kb.imports.owls_types import Slot, Slots
from kb.imports.report import Fate
from kb.imports.source import Source
from kb.vocabulary import Kind, Property
from kb.writing import Literal as Value
from kb.writing import Sort

_COMPARISONS = {
    "lessThan": "less",
    "lessThanOrEqual": "at most",
    "greaterThan": "more",
    "greaterThanOrEqual": "at least",
    "equal": "equal",
}
_RANGES: dict[type, str] = {bool: "boolean", int: "integer", float: "double", str: "string"}
_BODIES = (EXPRESSION.expressionObject, EXPRESSION.expressionBody, EXPRESSION.expressionData)
_ATOMS = (SWRL.ClassAtom, SWRL.IndividualPropertyAtom, SWRL.DatavaluedPropertyAtom, SWRL.BuiltinAtom)


@dataclass(frozen=True, slots=True, kw_only=True)
class Operand:
    """One side of a comparison: a number, a parameter, or a property of a parameter.

    Attributes:
        prop: IRI of the property in the source; empty for the parameter itself.
    """

    slot: Slot | None = None
    prop: str = ""
    number: int | float = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Test:
    """A condition that only a service can answer.

    Attributes:
        slots: The parameters that it asks about.
        sides: What it compares, where it is one comparison; else the service knows what to ask.
        says: The condition, for people.
    """

    slots: tuple[Slot, ...]
    sides: tuple[Operand, str, Operand] | None
    says: str


class _CannotSay(Exception):
    """An atom that our conditions cannot express; the text tells why."""


class Conditions:
    """Reads the conditions and effects of one source."""

    def __init__(self, source: Source, draft: Draft, slots: Slots) -> None:
        self._source, self._draft, self._slots = source, draft, slots

    def preconditions(self, process: Node, expressions: Iterable[Node], owner: str) -> list[str]:
        """Conditions that must hold before a process, by name; those that cannot be expressed are told of."""
        names = []
        for expression in expressions:
            for atom in self._atoms(expression):
                if self._defines(process, atom) is not None:
                    continue  # names a value that other conditions use; asks for nothing
                try:
                    names.append(self._holds(process, atom, f"{owner}_pre"))
                except _CannotSay as why:
                    told = f"the precondition {self._text(atom)} of {owner}: {why}"
                    self._source.note(expression, Fate.LEFT_OUT, told)
        return names

    def effects(self, process: Node, expressions: Iterable[Node], owner: str) -> list[str]:
        """Effects of a process, by name; those that cannot be expressed are told of."""
        names = []
        for expression in expressions:
            for atom in self._atoms(expression):
                try:
                    names.append(self._effect(process, atom, f"{owner}_effect"))
                except _CannotSay as why:
                    told = f"the effect {self._text(atom)} of {owner}: {why}"
                    self._source.note(expression, Fate.LEFT_OUT, told)
        return names

    def decision(self, process: Node, expression: Node, owner: str) -> str | Test | None:
        """The condition of a construct: a condition of ours by name, or a test; None if it always holds."""
        atoms = self._atoms(expression)
        if not atoms:
            if self._always(expression):
                return None
            return Test(slots=self._readable(process), sides=None, says=self._quoted(expression))
        kept = [a for a in atoms if self._defines(process, a) is None]
        try:
            names = [self._holds(process, atom, f"{owner}_condition") for atom in kept]
        except _CannotSay:
            return self._test(process, kept or atoms)
        if len(names) == 1:
            return names[0]
        whole = self._draft.names.fresh(f"{owner}_condition")
        return self._draft.individual(whole, Kind.ALL_OF, [(Property.OPERAND, n) for n in names])

    def _readable(self, process: Node) -> tuple[Slot, ...]:
        return tuple(s for s in self._slots.of[process] if s.role == "Input")

    def _test(self, process: Node, atoms: list[Node]) -> Test:
        says = " and ".join(map(self._text, atoms))
        if len(atoms) == 1 and self._source.is_a(atoms[0], SWRL.BuiltinAtom):
            try:
                left, comparison, right = self._sides(process, atoms[0])
            except _CannotSay:
                pass
            else:
                asked = tuple(dict.fromkeys(s.slot for s in (left, right) if s.slot is not None))
                return Test(slots=asked, sides=(left, comparison, right), says=says)
        asked = tuple(dict.fromkeys(s for a in atoms for s in self._mentioned(process, a)))
        return Test(slots=asked or self._readable(process), sides=None, says=says)

    def _mentioned(self, process: Node, atom: Node) -> list[Slot]:
        found = []
        for argument in self._arguments(atom):
            defined = self._definition(process, argument)
            slot = self._slots.find(process, argument) or (defined[1] if defined else None)
            if slot is not None:
                found.append(slot)
        return found

    # Reading expressions

    def _always(self, expression: Node) -> bool:
        return expression == EXPRESSION.AlwaysTrue

    def _quoted(self, expression: Node) -> str:
        body = self._source.value(expression, *_BODIES)
        return " ".join(str(body).split())[:200] if isinstance(body, Literal) else "an expression without a body"

    def _atoms(self, expression: Node) -> list[Node]:
        """The atoms of an expression; none if it is always true, or written in something that is no SWRL."""
        self._source.values(expression, RDF.type, RDFS.label, RDFS.comment, EXPRESSION.expressionLanguage)
        body = self._source.value(expression, *_BODIES)
        if isinstance(body, Literal):
            body = self._unquoted(str(body))
        if body is None:
            return []
        return self._source.items(body, FIRST, REST)

    def _unquoted(self, text: str) -> Node | None:
        """The list of atoms in a quoted text, as OWL-S 1.1 writes them; None if there is none."""
        if "AtomList" not in text or "<!" in text:
            return None
        head = f'<rdf:RDF xmlns:rdf="{RDF}" xmlns:swrl="{SWRL}" xml:base="{self._source.iri}">'
        whole = text if "rdf:RDF" in text else f"{head}{text}</rdf:RDF>"
        graph = Graph()
        try:
            graph.parse(data=whole, format="xml", publicID=self._source.iri)
        except (SAXException, ParserError, ValueError):
            return None
        self._source.graph += graph
        heads = set(graph.subjects(RDF.type, SWRL.AtomList)) - set(graph.objects(None, RDF.rest))
        return next(iter(heads), None)

    def _arguments(self, atom: Node) -> list[Node]:
        found = self._source.values(atom, SWRL.argument1) + self._source.values(atom, SWRL.argument2)
        several = self._source.value(atom, SWRL.arguments)
        return found + (self._source.items(several, FIRST, REST) if several is not None else [])

    def _predicate(self, atom: Node) -> str:
        for kind in _ATOMS:
            self._source.is_a(atom, kind)
        return str(self._source.value(atom, SWRL.classPredicate, SWRL.propertyPredicate, SWRL.builtin) or "")

    def _text(self, atom: Node) -> str:
        """An atom for people: `hasPassword(AcctName, Password)`."""
        said = self._predicate(atom)
        if not said:
            kinds = self._source.values(atom, RDF.type)
            said = local(str(kinds[0])).removesuffix("Atom") if kinds else "?"
        return f"{local(said)}({', '.join(local(str(a)) for a in self._arguments(atom))})"

    # What an atom says

    def _defines(self, process: Node, atom: Node) -> tuple[Node, str, Slot] | None:
        """Of an atom that gives a property's value a name: the name, the property and whose it is."""
        if not self._source.is_a(atom, SWRL.DatavaluedPropertyAtom):
            return None
        arguments = self._arguments(atom)
        if len(arguments) != 2 or isinstance(arguments[1], Literal):
            return None
        whose = self._slots.find(process, arguments[0])
        if whose is None or self._slots.find(process, arguments[1]) is not None:
            return None
        return arguments[1], self._predicate(atom), whose

    def _definition(self, process: Node, variable: Node) -> tuple[str, Slot] | None:
        for expression in self._source.values(process, PROCESS.hasPrecondition):
            for atom in self._atoms(expression):
                defined = self._defines(process, atom)
                if defined is not None and defined[0] == variable:
                    return defined[1], defined[2]
        return None

    def _subject(self, process: Node, node: Node) -> Slot:
        slot = self._slots.find(process, node)
        if slot is None:
            raise _CannotSay(f"{local(str(node))} is no parameter of the process")
        if slot.type.is_datum:
            raise _CannotSay(f"{local(str(node))} is data, which the planner cannot look into")
        return slot

    def _said(self, process: Node, atom: Node) -> tuple[str, Slot, Slot | Value]:
        """Property of ours, whose it is, and the value that an atom gives it."""
        arguments, predicate = self._arguments(atom), self._predicate(atom)
        if self._source.is_a(atom, SWRL.ClassAtom) and len(arguments) == 1:
            subject = self._subject(process, arguments[0])
            opposite = self._source.value(URIRef(predicate), OWL.complementOf)
            self._source.types(URIRef(predicate))
            about = str(opposite) if isinstance(opposite, URIRef) else predicate
            name = self._draft.names.of(f"is {about}", f"is{local(about)}")
            self._draft.prop(name, Sort.DATATYPE_PROPERTY, range_=f"{XSD}boolean", label=f"is {local(about)}")
            return name, subject, opposite is None
        if len(arguments) != 2 or self._source.is_a(atom, SWRL.BuiltinAtom) or not predicate:
            raise _CannotSay("it is neither of a class, nor of a property, nor a comparison")
        subject, value = self._subject(process, arguments[0]), self._object(process, arguments[1])
        name = self._draft.names.of(predicate, parameter_name(local(predicate)))
        self._source.values(URIRef(predicate), RDF.type, RDFS.range)
        if isinstance(value, Slot):
            self._draft.prop(name, Sort.OBJECT_PROPERTY, range_=value.type.kind)
        else:
            self._draft.prop(name, Sort.DATATYPE_PROPERTY, range_=f"{XSD}{_RANGES[type(value)]}")
        return name, subject, value

    def _object(self, process: Node, node: Node) -> Slot | Value:
        if isinstance(node, Literal):
            value = node.toPython()
            return value if isinstance(value, bool | int | float) else str(node)
        slot = self._slots.find(process, node)
        if slot is None:
            raise _CannotSay(f"{local(str(node))} is neither a parameter of the process nor a value")
        return slot

    def _holds(self, process: Node, atom: Node, wanted: str) -> str:
        if self._source.is_a(atom, SWRL.BuiltinAtom):
            return self._comparison(process, atom, wanted)
        prop, subject, value = self._said(process, atom)
        if isinstance(value, Slot) and value.type.is_datum:
            raise _CannotSay(f"{value.parameter} is data, which the planner cannot look into")
        return self._write(Kind.HOLDS, wanted, prop, subject, value)

    def _effect(self, process: Node, atom: Node, wanted: str) -> str:
        if self._source.is_a(atom, SWRL.BuiltinAtom):
            raise _CannotSay("a comparison is no effect")
        prop, subject, value = self._said(process, atom)
        sort = Sort.OBJECT_PROPERTY if isinstance(value, Slot) else Sort.DATATYPE_PROPERTY
        self._draft.prop(prop, sort, fluent=True)
        return self._write("Effect", wanted, prop, subject, value)

    def _write(self, kind: Kind | str, wanted: str, prop: str, subject: Slot, value: Slot | Value) -> str:
        links: list[tuple[Property, str]] = [(Property.OF_PROPERTY, prop), (Property.SUBJECT_PARAMETER, subject.name)]
        values: list[tuple[Property, Value]] = []
        if isinstance(value, Slot):
            links.append((Property.OBJECT_PARAMETER, value.name))
        else:
            values.append((Property.HAS_VALUE, value))
        return self._draft.individual(self._draft.names.fresh(wanted), kind, links, values)

    # Comparisons

    def _comparison(self, process: Node, atom: Node, wanted: str) -> str:
        left, comparison, right = self._sides(process, atom)
        for side in (left, right):
            if side.slot is not None and (side.slot.type.is_datum or not side.prop):
                raise _CannotSay(f"{side.slot.parameter} is data, which the planner cannot look into")
        if left.slot is None:
            raise _CannotSay("it compares a number with something; turn it round")
        links: list[tuple[Property, str]] = [
            (Property.OF_PROPERTY, self._number_property(left.prop)),
            (Property.SUBJECT_PARAMETER, left.slot.name),
        ]
        values: list[tuple[Property, Value]] = [(Property.COMPARISON, comparison)]
        if right.slot is None:
            values.append((Property.HAS_VALUE, right.number))
        else:
            links.append((Property.OBJECT_PROPERTY, self._number_property(right.prop)))
            links.append((Property.OBJECT_PARAMETER, right.slot.name))
        return self._draft.individual(self._draft.names.fresh(wanted), Kind.COMPARE, links, values)

    def _number_property(self, prop: str) -> str:
        name = self._draft.names.of(prop, parameter_name(local(prop)))
        self._draft.prop(name, Sort.DATATYPE_PROPERTY, range_=f"{XSD}double")
        return name

    def _sides(self, process: Node, atom: Node) -> tuple[Operand, str, Operand]:
        said, arguments = local(self._predicate(atom)), self._arguments(atom)
        comparison = _COMPARISONS.get(said)
        if comparison is None or len(arguments) != 2:
            known = ", ".join(sorted(_COMPARISONS))
            raise _CannotSay(f"{said} is no comparison that we know ({known})")
        return self._operand(process, arguments[0]), comparison, self._operand(process, arguments[1])

    def _operand(self, process: Node, node: Node) -> Operand:
        if isinstance(node, Literal):
            number = node.toPython()
            if isinstance(number, bool) or not isinstance(number, int | float):
                raise _CannotSay(f"{node} is no number")
            return Operand(number=number)
        slot = self._slots.find(process, node)
        if slot is not None:
            return Operand(slot=slot)
        defined = self._definition(process, node)
        if defined is None:
            raise _CannotSay(f"{local(str(node))} stands for no property of a parameter")
        prop, whose = defined
        return Operand(slot=whose, prop=prop)
