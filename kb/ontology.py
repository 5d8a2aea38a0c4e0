"""What the ontology says, closed: asserted and inferred, in local names.

On top of the reasoner's classification, property values are closed (kb/closure.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

from rdflib import OWL, RDF, RDFS, XSD, BNode, Graph, Literal, URIRef
from rdflib.term import Node

from kb.closure import PROPERTY_SORTS, Values, closed_values
from kb.files import OntologyFiles, local_name
from kb.problems import OntologyRejected, Problem
from kb.reasoner import Classification
from kb.vocabulary import CORE, Kind, Property

Value: TypeAlias = str | int | float | bool

LEARNED = {
    Property.DURATION_S: Property.LEARNED_DURATION_S,
    Property.SUCCESS_ODDS: Property.LEARNED_ODDS,
    Property.TRAVEL_FACTOR: Property.LEARNED_TRAVEL_FACTOR,
    Property.RECOVERY_ODDS: Property.LEARNED_RECOVERY_ODDS,
}
"""What stands in for a stated value where it was learned: see kb/learned.py."""


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

    def iri(self, name: str) -> str:
        """The IRI of what has this local name; of several, an individual's before a class's and a property's."""
        return self._iris[name]

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
        OntologyRejected: Two individuals (or two classes, or two properties) share a local name (KB004), or two names
            stand for one individual (KB304).
    """
    graph = files.merged()
    iris = _names(files, graph)
    values = closed_values(graph, classification.types)
    _refuse_equals(files, graph, values)
    names: dict[frozenset[str], frozenset[str]] = {}
    for types in classification.types.values():
        if types not in names:
            names[types] = frozenset(map(local_name, types))
    superclasses = {
        local_name(c): frozenset(map(local_name, above)) for c, above in classification.superclasses.items()
    }
    return Ontology(
        files=files,
        graph=graph,
        kinds={local_name(i): names[types] for i, types in classification.types.items()},
        superclasses=superclasses,
        _iris=iris,
        _values=_values_by_name(values),
    )


def _names(files: OntologyFiles, graph: Graph) -> dict[str, str]:
    """IRI of each local name; individuals win over classes, and classes over properties, of the same name."""
    iris: dict[str, str] = {}
    problems: list[Problem] = []
    for roles in (PROPERTY_SORTS, (OWL.Class,), (OWL.NamedIndividual,)):
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


def _values_by_name(values: Values) -> dict[tuple[str, str], tuple[Value, ...]]:
    by_name: dict[tuple[str, str], tuple[Value, ...]] = {}
    for prop, subjects in values.items():
        name = local_name(str(prop))
        for subject, nodes in subjects.items():
            if isinstance(prop, URIRef) and isinstance(subject, URIRef):
                converted = {_value(node) for node in nodes}
                by_name[name, local_name(str(subject))] = tuple(sorted(converted, key=lambda v: (str(type(v)), v)))
    for (prop_name, subject_name), found in list(by_name.items()):
        for stated, learned in LEARNED.items():
            if prop_name == learned:
                by_name[stated, subject_name] = found
    return by_name


def _refuse_equals(files: OntologyFiles, graph: Graph, values: Values) -> None:
    """Two names of one individual, stated or inferred: everything else here takes them for two."""
    problems = [
        files.problem("KB304", str(one), f"is said to be the same as {local_name(str(other))}; use one name for it")
        for one, other in graph.subject_objects(OWL.sameAs)
    ]
    for prop in set(graph.subjects(RDF.type, OWL.FunctionalProperty)) & set(values):
        for subject, nodes in values[prop].items():
            names = sorted(local_name(str(n)) for n in nodes if isinstance(n, URIRef))
            if len(names) > 1:
                told = f"has by inference {len(names)} values of {local_name(str(prop))}, {' and '.join(names)}; "
                problems.append(files.problem("KB304", str(subject), told + "it can have one"))
    for prop in set(graph.subjects(RDF.type, OWL.InverseFunctionalProperty)) & set(values):
        subjects: dict[Node, list[str]] = {}
        for subject, nodes in values[prop].items():
            for node in nodes:
                subjects.setdefault(node, []).append(local_name(str(subject)))
        for node, several in subjects.items():
            if len(several) > 1:
                told = f"is the {local_name(str(prop))} of {' and '.join(sorted(several))}; it can be of one"
                problems.append(files.problem("KB304", str(node), told))
    if problems:
        raise OntologyRejected(problems)


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
