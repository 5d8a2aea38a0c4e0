"""Why a robot, or a class of robots, has a capability or lacks it: down to the sensors and where they are stated."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from rdflib import OWL, RDFS, BNode, URIRef
from rdflib.collection import Collection
from rdflib.term import Node

from kb.entities import Entities, Place, Role
from kb.files import local_name
from kb.ontology import Ontology
from kb.vocabulary import Kind


@dataclass(frozen=True, slots=True, kw_only=True)
class Reason:
    """A statement, whether it holds, where it is stated and what it rests on."""

    text: str
    holds: bool
    place: Place | None = None
    because: tuple[Reason, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Restriction:
    """`SubClassOf: prop some filler` or `prop value filler`, as a class states it.

    Attributes:
        owner: The class.
        word: `some` or `value`.
    """

    owner: str
    prop: str
    word: str
    filler: str


class Derivation:
    """Derives capabilities from what files state."""

    def __init__(self, ontology: Ontology) -> None:
        self._ontology = ontology
        self._graph = ontology.graph
        self._entities = Entities(ontology)

    def models(self) -> list[str]:
        """The classes of robots that are not defined by what they have: models, such as Pico; by name."""
        defined = {
            local_name(str(kind))
            for kind, by in self._graph.subject_objects(OWL.equivalentClass)
            if isinstance(by, BNode)
        }
        return sorted(
            name
            for name, above in self._ontology.superclasses.items()
            if Kind.ROBOT in above and self._is_class(name) and name not in defined | {str(Kind.ROBOT)}
        )

    def kinds(self, who: str) -> frozenset[str]:
        """All classes of a robot, or above a class of robots, itself included."""
        known = self._ontology.superclasses if self._role(who) is Role.CLASS else self._ontology.kinds
        return known.get(who, frozenset({who}))

    def _role(self, who: str) -> Role:
        return Role.INDIVIDUAL if self._ontology.is_a(who, Kind.ROBOT) else Role.CLASS

    def _is_class(self, name: str) -> bool:
        return self._entities.key(name, Role.CLASS) is not None

    def restrictions(self, who: str) -> list[Restriction]:
        """All that a robot's classes, or the classes above a class, say of their members; by class."""
        return [r for kind in sorted(self.kinds(who)) if self._is_class(kind) for r in self._stated(kind)]

    def number(self, prop: str, who: str) -> float | None:
        """The value of a property of numbers, of a robot or of all robots of a class."""
        value = self._ontology.value(prop, who)
        if value is None:
            found = [r.filler for r in self.restrictions(who) if (r.prop, r.word) == (prop, "value")]
            value = float(found[0]) if found else None
        return float(value) if isinstance(value, int | float) else None

    def capability(self, who: str, kind: str) -> Reason:
        """Why a robot, or every robot of a class, belongs to a class; or what is missing."""
        holds = kind in self.kinds(who)
        text = f"{who} is {'a' if holds else 'no'} {kind}"
        stated = self._entities.stated_kind(kind, who, self._role(who))
        definitions = [n for n in self._graph.objects(self._node(kind), OWL.equivalentClass) if isinstance(n, BNode)]
        if stated is not None or who == kind:
            return Reason(text=text, holds=True, place=stated)
        if definitions:
            place = self._class_place(kind)
            parts = tuple(self._reason(who, node) for node in self._conjuncts(definitions[0]))
            return Reason(
                text=f"{text}: {self._entities.expression(definitions[0])}", holds=holds, place=place, because=parts
            )
        return Reason(text=text, holds=holds, because=tuple(self._chain(who, kind, self._role(who))) if holds else ())

    def _reason(self, who: str, node: Node) -> Reason:
        if isinstance(node, URIRef):
            return self.capability(who, local_name(str(node)))
        prop, filler = self._graph.value(node, OWL.onProperty), self._graph.value(node, OWL.someValuesFrom)
        text = self._entities.expression(node)
        if prop is None or not isinstance(filler, URIRef):
            return Reason(text=f"{text}: left to the reasoner", holds=False)
        supports = tuple(self._supports(who, local_name(str(prop)), local_name(str(filler))))
        if supports:
            return Reason(text=text, holds=True, because=supports)
        others = sorted({self._has(r) for r in self._like(who, local_name(str(prop)))})
        has = f"it has {', '.join(others)}" if others else "it has none of any kind"
        return Reason(text=f"no {local_name(str(filler))} by {local_name(str(prop))}; {has}", holds=False)

    def _supports(self, who: str, prop: str, filler: str) -> Iterator[Reason]:
        """What a robot has of a kind: individuals, and what its classes say."""
        for value in self._ontology.values(prop, who):
            if isinstance(value, str) and self._ontology.is_a(value, filler):
                place = next((p for q in self._below(prop) if (p := self._entities.stated(q, who, value))), None)
                yield Reason(
                    text=f"{who} {prop} {value}",
                    holds=True,
                    place=place,
                    because=tuple(self._chain(value, filler, Role.INDIVIDUAL)),
                )
        for restriction in self._like(who, prop):
            fits = filler in self._ontology.superclasses.get(restriction.filler, {restriction.filler})
            fits = fits or (restriction.word == "value" and self._ontology.is_a(restriction.filler, filler))
            if fits:
                yield Reason(
                    text=f"every {restriction.owner} {restriction.prop} {restriction.word} {restriction.filler}",
                    holds=True,
                    place=self._class_place(restriction.owner),
                    because=(
                        *self._chain(who, restriction.owner, self._role(who)),
                        *self._chain(
                            restriction.filler, filler, Role.CLASS if restriction.word == "some" else Role.INDIVIDUAL
                        ),
                    ),
                )

    def _chain(self, below: str, above: str, role: Role) -> Iterator[Reason]:
        """Stated memberships that lead from an individual or class up to a class, the shortest way.

        Args:
            role: Of what it begins with.
        """
        ways: list[tuple[str, ...]] = [(below,)]
        seen: set[str] = {below} if role is Role.CLASS else set()
        while ways:
            way = ways.pop(0)
            own = role if len(way) == 1 else Role.CLASS
            if way[-1] == above and own is Role.CLASS:
                for number, (lower, upper) in enumerate(pairwise(way)):
                    lower_role = role if number == 0 else Role.CLASS
                    every = "every " if lower_role is Role.CLASS else ""
                    place = self._entities.stated_kind(upper, lower, lower_role)
                    yield Reason(text=f"{every}{lower} is a {upper}", holds=True, place=place)
                return
            known = self._ontology.superclasses if own is Role.CLASS else self._ontology.kinds
            for upper in sorted(known.get(way[-1], frozenset()) - seen):
                if self._entities.stated_kind(upper, way[-1], own) is not None:
                    seen.add(upper)
                    ways.append((*way, upper))

    def _like(self, who: str, prop: str) -> list[Restriction]:
        below = self._below(prop)
        return [r for r in self.restrictions(who) if r.prop in below]

    def _has(self, restriction: Restriction) -> str:
        return f"a {restriction.filler}" if restriction.word == "some" else restriction.filler

    def _below(self, prop: str) -> set[str]:
        key = self._entities.key(prop, Role.PROPERTY)
        if key is None:
            return {prop}
        node = URIRef(self._entities.iri(key))
        return {local_name(str(p)) for p in self._graph.transitive_subjects(RDFS.subPropertyOf, node)}

    def _stated(self, kind: str) -> Iterator[Restriction]:
        # What defines a class is not taken for what its members have: that would explain a capability by itself.
        above = self._graph.objects(self._node(kind), RDFS.subClassOf)
        found = []
        for part in (p for expression in above for p in self._conjuncts(expression)):
            prop = self._graph.value(part, OWL.onProperty)
            for predicate, word in ((OWL.someValuesFrom, "some"), (OWL.hasValue, "value")):
                filler = self._graph.value(part, predicate)
                if prop is not None and filler is not None and not isinstance(filler, BNode):
                    told = local_name(str(filler))
                    found.append(Restriction(owner=kind, prop=local_name(str(prop)), word=word, filler=told))
        yield from sorted(found, key=lambda r: (r.prop, r.filler))

    def _conjuncts(self, node: Node) -> list[Node]:
        """The parts of an intersection, in order; else the expression alone."""
        members = self._graph.value(node, OWL.intersectionOf) if isinstance(node, BNode) else None
        if members is None:
            return [node]
        return [part for member in Collection(self._graph, members) for part in self._conjuncts(member)]

    def _node(self, kind: str) -> URIRef:
        key = self._entities.key(kind, Role.CLASS)
        return URIRef(self._entities.iri(key) if key is not None else kind)

    def _class_place(self, kind: str) -> Place | None:
        key = self._entities.key(kind, Role.CLASS)
        return None if key is None else self._entities.place(key)


def reason_lines(reason: Reason) -> Iterator[str]:
    """A reason and what it rests on, indented."""
    where = f" ({reason.place})" if reason.place is not None else ""
    yield f"{'+' if reason.holds else '-'} {reason.text}{where}"
    for part in reason.because:
        yield from (f"  {line}" for line in reason_lines(part))
