"""Everything that the ontology files name, with what is said of it and where: for reference pages and answers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from rdflib import OWL, RDF, RDFS, SKOS, BNode, Graph, Literal, URIRef
from rdflib.collection import Collection
from rdflib.term import Node

from kb.files import OntologyFile, local_name
from kb.ontology import Ontology, Value


class Sort(StrEnum):
    """What an entity is to OWL."""

    CLASS = "class"
    OBJECT_PROPERTY = "object property"
    DATA_PROPERTY = "data property"
    ANNOTATION_PROPERTY = "annotation property"
    INDIVIDUAL = "individual"


_SORTS = {
    OWL.AnnotationProperty: Sort.ANNOTATION_PROPERTY,
    OWL.DatatypeProperty: Sort.DATA_PROPERTY,
    OWL.ObjectProperty: Sort.OBJECT_PROPERTY,
    OWL.Class: Sort.CLASS,
    OWL.NamedIndividual: Sort.INDIVIDUAL,
}


class Role(StrEnum):
    """What a name stands for; several entities may share one."""

    INDIVIDUAL = "individual"
    CLASS = "class"
    PROPERTY = "property"


_ROLES = {Sort.CLASS: Role.CLASS, Sort.INDIVIDUAL: Role.INDIVIDUAL}
_ALIGNMENTS = (OWL.equivalentClass, OWL.equivalentProperty, OWL.sameAs, RDFS.seeAlso, RDFS.isDefinedBy)
_COUNTS = (
    (OWL.minQualifiedCardinality, "min"),
    (OWL.maxQualifiedCardinality, "max"),
    (OWL.qualifiedCardinality, "exactly"),
    (OWL.minCardinality, "min"),
    (OWL.maxCardinality, "max"),
    (OWL.cardinality, "exactly"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where something is written.

    Attributes:
        file: Path of the file.
        line: From 1; 0 if it is not known.
    """

    file: Path
    line: int

    def __str__(self) -> str:
        return f"{self.file.name}:{self.line}" if self.line else self.file.name


@dataclass(frozen=True, slots=True, kw_only=True)
class Entity:
    """A class, property or individual.

    Attributes:
        label: What screens show; the name where there is none.
        comment: What it means; empty where nothing is said.
        alignments: What it corresponds to elsewhere: (relation, IRI).
    """

    name: str
    iri: str
    sort: Sort
    place: Place
    label: str
    comment: str
    alignments: tuple[tuple[str, str], ...]


class Entities:
    """The entities of an ontology, by name; a class that is named like an individual is `Kinect (class)`."""

    def __init__(self, ontology: Ontology) -> None:
        self._ontology = ontology
        self._graph = ontology.graph
        self._iris: dict[str, str] = {}
        self._sorts: dict[str, Sort] = {}
        self._keys: dict[tuple[str, Role], str] = {}
        # Of one name, individuals come before classes, and these before properties.
        for own, sort in reversed(_SORTS.items()):
            for node in sorted(n for n in self._graph.subjects(RDF.type, own) if isinstance(n, URIRef)):
                name, role = local_name(str(node)), _ROLES.get(sort, Role.PROPERTY)
                if (name, role) in self._keys:
                    continue  # one property of two sorts
                key = name if name not in self._iris else f"{name} ({role})"
                self._keys[name, role] = key
                self._iris[key] = str(node)
                self._sorts[key] = sort
        self._files = {
            str(node): file for file in reversed(ontology.files.files) for node in file.graph.subjects(RDF.type, None)
        }

    @property
    def names(self) -> list[str]:
        """All of them, in order."""
        return sorted(self._iris)

    @property
    def local_names(self) -> set[str]:
        """The names as files have them; several entities may share one."""
        return {name for name, _ in self._keys}

    def of_sort(self, *sorts: Sort) -> list[str]:
        """The names of those of some sorts, in order."""
        return [n for n in self.names if self._sorts[n] in sorts]

    def key(self, name: str, *roles: Role) -> str | None:
        """Under which name an entity of one of these roles, the first that there is, is known here; None if none is."""
        return next((self._keys[name, r] for r in roles or tuple(Role) if (name, r) in self._keys), None)

    def iri(self, name: str) -> str:
        """The whole name."""
        return self._iris[name]

    def sort(self, name: str) -> Sort:
        """What an entity is to OWL."""
        return self._sorts[name]

    def entity(self, name: str) -> Entity:
        """What is said of an entity itself.

        Raises:
            KeyError: There is none of this name.
        """
        iri = self._iris[name]
        return Entity(
            name=local_name(iri),
            iri=iri,
            sort=self._sorts[name],
            place=self.place(name),
            label=text_of(self._graph, iri, RDFS.label) or local_name(iri),
            comment=text_of(self._graph, iri, RDFS.comment),
            alignments=tuple(sorted(self._alignments(iri))),
        )

    def comment(self, name: str) -> str:
        """What an entity means; empty where nothing is said."""
        return text_of(self._graph, self._iris[name], RDFS.comment)

    def place(self, name: str) -> Place:
        """Where an entity is described."""
        iri = self._iris[name]
        file = self._files.get(iri) or self._ontology.files.file_of(iri)
        return Place(file=file.path, line=file.line_of(iri))

    def stated(self, prop: str, subject: str, value: Value) -> Place | None:
        """Where a value is stated of an individual itself; None if it is inferred, or told since."""
        prop_key, key = self.key(prop, Role.PROPERTY), self.key(subject)
        if prop_key is None or key is None:
            return None
        predicate, node = URIRef(self._iris[prop_key]), URIRef(self._iris[key])
        for file in self._ontology.files.files:
            for found in file.graph.objects(node, predicate):
                if _same(found, value):
                    return _place_in(file, str(node))
        return None

    def stated_kind(self, kind: str, name: str, role: Role = Role.INDIVIDUAL) -> Place | None:
        """Where it is stated that an individual, or a class, is below a class; None if that is inferred.

        Args:
            role: Of the name, INDIVIDUAL or CLASS.
        """
        kind_key, key = self.key(kind, Role.CLASS), self.key(name, role)
        if kind_key is None or key is None:
            return None
        above, node = URIRef(self._iris[kind_key]), URIRef(self._iris[key])
        for file in self._ontology.files.files:
            if (node, RDF.type, above) in file.graph or (node, RDFS.subClassOf, above) in file.graph:
                return _place_in(file, str(node))
        return None

    def axioms(self, name: str) -> list[tuple[str, str]]:
        """What a class or property is said to be, beside label, comment and alignments: (relation, expression)."""
        node = URIRef(self._iris[name])
        found = []
        for predicate in (
            RDFS.subClassOf,
            OWL.equivalentClass,
            OWL.disjointWith,
            RDFS.subPropertyOf,
            OWL.inverseOf,
            RDFS.domain,
            RDFS.range,
        ):
            for value in self._graph.objects(node, predicate):
                if isinstance(value, BNode) or str(value) in self._iris.values() or str(value).startswith(str(RDFS)):
                    found.append((local_name(str(predicate)), self.expression(value)))
        for kind in self._graph.objects(node, RDF.type):
            if kind not in _SORTS:
                found.append(("is a", local_name(str(kind))))
        return sorted(set(found))

    def expression(self, node: Node) -> str:
        """A class expression in Manchester syntax, with local names."""
        if isinstance(node, Literal):
            return str(node)
        if isinstance(node, URIRef):
            return local_name(str(node))
        for predicate, word in ((OWL.intersectionOf, " and "), (OWL.unionOf, " or ")):
            members = self._graph.value(node, predicate)
            if members is not None:
                return f"({word.join(self.expression(m) for m in Collection(self._graph, members))})"
        members = self._graph.value(node, OWL.oneOf)
        if members is not None:
            return "{" + ", ".join(self.expression(m) for m in Collection(self._graph, members)) + "}"
        negated = self._graph.value(node, OWL.complementOf)
        if negated is not None:
            return f"not {self.expression(negated)}"
        return self._restriction(node)

    def _restriction(self, node: Node) -> str:
        prop = local_name(str(self._graph.value(node, OWL.onProperty)))
        for predicate, word in ((OWL.someValuesFrom, "some"), (OWL.allValuesFrom, "only"), (OWL.hasValue, "value")):
            filler = self._graph.value(node, predicate)
            if filler is not None:
                return f"{prop} {word} {self.expression(filler)}"
        for predicate, word in _COUNTS:
            count = self._graph.value(node, predicate)
            if count is not None:
                filler = self._graph.value(node, OWL.onClass) or self._graph.value(node, OWL.onDataRange)
                return f"{prop} {word} {count}" + (f" {self.expression(filler)}" if filler is not None else "")
        return f"{prop} (a restriction that is not shown)"

    def used_by(self) -> dict[str, list[str]]:
        """Which entities name an entity in what is said of them, by its name; both in order."""
        names = {iri: name for name, iri in self._iris.items()}
        found: dict[str, set[str]] = {}
        for subject in self._graph.subjects(unique=True):
            if isinstance(subject, URIRef) and str(subject) in names:
                for node in self._mentioned(subject):
                    if str(node) in names and node != subject:
                        found.setdefault(names[str(node)], set()).add(names[str(subject)])
        return {name: sorted(users) for name, users in sorted(found.items())}

    def _mentioned(self, subject: Node) -> Iterator[URIRef]:
        todo, seen = [subject], set[Node]()
        while todo:
            for predicate, value in self._graph.predicate_objects(todo.pop()):
                if isinstance(predicate, URIRef):
                    yield predicate
                if isinstance(value, URIRef):
                    yield value
                elif isinstance(value, BNode) and value not in seen:
                    seen.add(value)
                    todo.append(value)

    def _alignments(self, iri: str) -> Iterator[tuple[str, str]]:
        own = set(self._iris.values())
        for predicate, value in self._graph.predicate_objects(URIRef(iri)):
            is_alignment = predicate in _ALIGNMENTS or str(predicate).startswith(str(SKOS))
            if is_alignment and isinstance(value, URIRef | Literal) and str(value) not in own:
                yield local_name(str(predicate)), str(value)


def text_of(graph: Graph, iri: str, predicate: URIRef) -> str:
    """A label or comment, in English where there are several languages; empty where nothing is said."""
    texts = [t for t in graph.objects(URIRef(iri), predicate) if isinstance(t, Literal)]
    return min(((t.language or "") not in ("en", ""), str(t)) for t in texts)[1] if texts else ""


def _place_in(file: OntologyFile, iri: str) -> Place:
    return Place(file=file.path, line=file.line_of(iri))


def _same(node: Node, value: Value) -> bool:
    if isinstance(node, Literal):
        found = node.toPython()
        if isinstance(value, bool) or isinstance(found, bool):
            return found is value
        return str(found) == str(value) or (isinstance(value, int | float) and found == value)
    return local_name(str(node)) == value
