"""What the ontology says, closed: asserted and inferred, in local names.

On top of the reasoner's classification, property values are closed under sub-properties, transitive
properties and the values that classes give to their members (`SubClassOf: property value v`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

from rdflib import OWL, RDF, RDFS, XSD, BNode, Graph, Literal, URIRef
from rdflib.term import Node

from kb.files import OntologyFiles, local_name
from kb.problems import OntologyRejected, Problem
from kb.reasoner import Classification
from kb.vocabulary import CORE, Kind, Property

Value: TypeAlias = str | int | float | bool

_PROPERTY_SORTS = (OWL.ObjectProperty, OWL.DatatypeProperty, OWL.AnnotationProperty)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ontology:
    """A consistent, classified ontology.

    Attributes:
        files: Where it came from.
        graph: All triples.
        kinds: All classes of each individual, by local name; own classes before inferred ones.
        superclasses: All classes above each class, itself included, by local name.
    """

    files: OntologyFiles
    graph: Graph
    kinds: dict[str, frozenset[str]]
    superclasses: dict[str, frozenset[str]]
    _iris: dict[str, str] = field(repr=False)
    _values: dict[tuple[str, str], tuple[Value, ...]] = field(repr=False)

    def is_a(self, individual: str, kind: str) -> bool:
        """Whether an individual belongs to a class."""
        return kind in self.kinds.get(individual, frozenset())

    def individuals(self, kind: str) -> list[str]:
        """The individuals of a class, by name."""
        return sorted(name for name, kinds in self.kinds.items() if kind in kinds)

    def values(self, prop: str, subject: str) -> tuple[Value, ...]:
        """All values of a property: names of individuals, or literals; in order."""
        return self._values.get((prop, subject), ())

    def value(self, prop: str, subject: str) -> Value | None:
        """The value of a property that has at most one."""
        values = self.values(prop, subject)
        return values[0] if values else None

    def all_values(self) -> Iterator[tuple[str, str, Value]]:
        """All (property, subject, value), sorted."""
        for (prop, subject), values in sorted(self._values.items()):
            for value in values:
                yield prop, subject, value

    def kind_of(self, individual: str) -> str:
        """The most specific class of an individual, by name where there are several."""
        kinds = self.kinds[individual]
        above = {k: self.superclasses.get(k, frozenset({k})) for k in kinds}
        # Equivalent classes are above each other; neither is more specific.
        return min(k for k in kinds if not any(k in above[o] and o not in above[k] for o in kinds))

    def definition(self, kind: str) -> str:
        """What a capability class asks for, in Manchester syntax, for messages: `hasSensor some Kinect`."""
        texts: set[str] = set()
        todo: list[Node] = [self._class_iri(kind)]
        while todo:
            node = todo.pop()
            prop = self.graph.value(node, OWL.onProperty)
            filler = self.graph.value(node, OWL.someValuesFrom)
            if prop is not None and filler is not None:
                texts.add(f"{local_name(str(prop))} some {local_name(str(filler))}")
            todo.extend(o for o in self.graph.objects(node) if isinstance(o, BNode))
        return " and ".join(sorted(texts))

    def is_datum(self, kind: str | None) -> bool:
        """Whether values of this class are messages that only the executive holds."""
        return kind is not None and Kind.DATUM in self.superclasses.get(kind, frozenset({kind}))

    def datum_property(self, prop: str) -> bool:
        """Whether the values of a property are messages that only the executive holds."""
        return any(self.is_datum(local_name(str(r))) for r in self.graph.objects(URIRef(CORE + prop), RDFS.range))

    def problem(self, code: str, name: str, message: str) -> Problem:
        """A problem with an individual, at its place."""
        return self.files.problem(code, self._iris.get(name, name), message)

    def _class_iri(self, kind: str) -> URIRef:
        for node in self.graph.subjects(RDF.type, OWL.Class):
            if isinstance(node, URIRef) and local_name(str(node)) == kind:
                return node
        return URIRef(CORE + kind)


def close(files: OntologyFiles, classification: Classification) -> Ontology:
    """Put files and classification together.

    Raises:
        OntologyRejected: Two individuals (or two classes, or two properties) share a local name.
    """
    graph = files.merged()
    iris = _names(files, graph)
    superclasses = {
        local_name(c): frozenset(map(local_name, above)) for c, above in classification.superclasses.items()
    }
    return Ontology(
        files=files,
        graph=graph,
        kinds={local_name(i): frozenset(map(local_name, types)) for i, types in classification.types.items()},
        superclasses=superclasses,
        _iris=iris,
        _values=_closed_values(graph, classification),
    )


def _names(files: OntologyFiles, graph: Graph) -> dict[str, str]:
    """IRI of each local name; individuals win over classes, and classes over properties, of the same name."""
    iris: dict[str, str] = {}
    problems: list[Problem] = []
    for roles in (_PROPERTY_SORTS, (OWL.Class,), (OWL.NamedIndividual,)):
        own: dict[str, str] = {}
        for node in sorted({s for role in roles for s in graph.subjects(RDF.type, role)}, key=str):
            if isinstance(node, BNode):
                continue
            other = own.setdefault(local_name(str(node)), str(node))
            if other != str(node):
                place = files.file_of(other)
                problems.append(
                    files.problem(
                        "KB004",
                        str(node),
                        f"has the same name as an entity in {place.path.name}:{place.line_of(other)}; rename one",
                    )
                )
        iris.update(own)
    if problems:
        raise OntologyRejected(problems)
    return iris


def _closed_values(graph: Graph, classification: Classification) -> dict[tuple[str, str], tuple[Value, ...]]:
    pairs: dict[str, dict[str, set[Value]]] = {}

    def add(prop: Node, subject: str, value: Node) -> None:
        converted = _value(value)
        for name in _superproperties(graph, prop):
            pairs.setdefault(name, {}).setdefault(local_name(subject), set()).add(converted)

    properties = {p for sort in _PROPERTY_SORTS for p in graph.subjects(RDF.type, sort)}
    for prop in properties:
        for subject, value in graph.subject_objects(prop):
            if isinstance(subject, URIRef):
                add(prop, str(subject), value)
    given = _values_of_classes(graph)
    for individual, kinds in classification.types.items():
        for kind in sorted(kinds):
            for prop, value in given.get(kind, ()):
                add(prop, individual, value)
    for prop in graph.subjects(RDF.type, OWL.TransitiveProperty):
        _close_transitively(pairs.get(local_name(str(prop)), {}))
    return {
        (prop, subject): tuple(sorted(values, key=lambda v: (str(type(v)), v)))
        for prop, subjects in pairs.items()
        for subject, values in subjects.items()
    }


def _superproperties(graph: Graph, prop: Node) -> set[str]:
    return {local_name(str(p)) for p in graph.transitive_objects(prop, RDFS.subPropertyOf)}


def _values_of_classes(graph: Graph) -> dict[str, list[tuple[Node, Node]]]:
    """`SubClassOf: property value v`, by the IRI of the class."""
    given: dict[str, list[tuple[Node, Node]]] = {}
    for restriction, value in graph.subject_objects(OWL.hasValue):
        prop = graph.value(restriction, OWL.onProperty)
        for kind in graph.subjects(RDFS.subClassOf, restriction):
            if prop is not None:
                given.setdefault(str(kind), []).append((prop, value))
    return given


def _close_transitively(subjects: dict[str, set[Value]]) -> None:
    for subject in sorted(subjects):
        todo = [v for v in subjects[subject] if isinstance(v, str)]
        while todo:
            for value in subjects.get(todo.pop(), set()) - subjects[subject]:
                subjects[subject].add(value)
                if isinstance(value, str):
                    todo.append(value)


def _value(node: Node) -> Value:
    if isinstance(node, Literal):
        if node.datatype in (XSD.boolean, XSD.integer, XSD.int, XSD.double, XSD.float, XSD.decimal):
            value = node.toPython()
            if isinstance(value, bool | int | float):
                return value
            return float(value) if node.datatype == XSD.decimal else str(node)
        return str(node)
    return local_name(str(node))


def fluent_properties(ontology: Ontology) -> frozenset[str]:
    """The properties whose values change while robots work."""
    return frozenset(
        subject for prop, subject, value in ontology.all_values() if prop == Property.FLUENT and value is True
    )
