"""Property values that follow from others: what HermiT knows, but does not tell.

From sub-properties, equivalent, inverse and symmetric properties, transitive ones and chains of properties,
and from the values that classes give to their members (`SubClassOf: property value v`). The rules are those of
OWL 2 RL (the profile's tables 5 and 6: prp-spo1, prp-spo2, prp-eqp, prp-inv, prp-symp, prp-trp, cls-hv1,
cls-int2), followed from each new value on, as in semi-naive evaluation, so that nothing is derived twice.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from rdflib import OWL, RDF, RDFS, BNode, Graph, URIRef
from rdflib.collection import Collection
from rdflib.term import Node

PROPERTY_SORTS = (OWL.ObjectProperty, OWL.DatatypeProperty, OWL.AnnotationProperty)

Values = dict[Node, dict[Node, set[Node]]]


def closed_values(graph: Graph, types: Mapping[str, Iterable[str]]) -> Values:
    """All values, stated and derived, by property and subject.

    Args:
        types: All classes of each individual, by IRI.
    """
    closure = _Closure(graph)
    for prop in {p for sort in PROPERTY_SORTS for p in graph.subjects(RDF.type, sort)}:
        for subject, value in graph.subject_objects(prop):
            if isinstance(subject, URIRef):
                closure.add(prop, subject, value)
    given = _values_of_classes(graph)
    for individual, kinds in types.items():
        for kind in given.keys() & set(kinds):
            for prop, value in given[kind]:
                closure.add(prop, URIRef(individual), value)
    return closure.values


class _Closure:
    """Values so far, and what follows from one more."""

    def __init__(self, graph: Graph) -> None:
        self.values: Values = {}
        self._subjects: Values = {}
        self._above = _properties_above(graph)
        self._chains: dict[Node, list[tuple[tuple[Node, ...], int, Node]]] = {}
        for chain, whole in _chains(graph):
            for place, prop in enumerate(chain):
                self._chains.setdefault(prop, []).append((chain, place, whole))

    def add(self, prop: Node, subject: Node, value: Node) -> None:
        """Add a value and all that follows from it."""
        todo = [(prop, subject, value)]
        while todo:
            new = todo.pop()
            prop, subject, value = new
            known = self.values.setdefault(prop, {}).setdefault(subject, set())
            if value in known:
                continue
            known.add(value)
            if isinstance(value, URIRef):
                self._subjects.setdefault(prop, {}).setdefault(value, set()).add(subject)
            todo += self._followed(*new)

    def _followed(self, prop: Node, subject: Node, value: Node) -> Iterator[tuple[Node, Node, Node]]:
        for above, inverse in self._above.get(prop, ()):
            if not inverse:
                yield above, subject, value
            elif isinstance(value, URIRef):
                yield above, value, subject
        for chain, place, whole in self._chains.get(prop, ()):
            begins, ends = {subject}, {value}
            for link in reversed(chain[:place]):
                begins = {b for node in begins for b in self._subjects.get(link, {}).get(node, ())}
            for link in chain[place + 1 :]:
                ends = {e for node in ends for e in self.values.get(link, {}).get(node, ())}
            for begin in begins:
                for end in ends:
                    yield whole, begin, end


def _properties_above(graph: Graph) -> dict[Node, set[tuple[Node, bool]]]:
    """What has the values of a property, too; or has them the other way round."""
    above: dict[Node, set[tuple[Node, bool]]] = {}
    for prop, other in graph.subject_objects(RDFS.subPropertyOf):
        above.setdefault(prop, set()).add((other, False))
    for relation, inverse in ((OWL.equivalentProperty, False), (OWL.inverseOf, True)):
        for prop, other in graph.subject_objects(relation):
            above.setdefault(prop, set()).add((other, inverse))
            above.setdefault(other, set()).add((prop, inverse))
    for prop in graph.subjects(RDF.type, OWL.SymmetricProperty):
        above.setdefault(prop, set()).add((prop, True))
    return above


def _chains(graph: Graph) -> Iterator[tuple[tuple[Node, ...], Node]]:
    for prop in graph.subjects(RDF.type, OWL.TransitiveProperty):
        yield (prop, prop), prop
    for prop, chain in graph.subject_objects(OWL.propertyChainAxiom):
        yield tuple(Collection(graph, chain)), prop


def _values_of_classes(graph: Graph) -> dict[str, list[tuple[Node, Node]]]:
    """The values that a class gives to its members, alone or as part of an intersection, by its IRI."""
    given: dict[str, list[tuple[Node, Node]]] = {}
    if (None, OWL.hasValue, None) not in graph:
        return given
    for kind in graph.subjects(RDF.type, OWL.Class):
        if not isinstance(kind, URIRef):
            continue
        todo = [o for p in (RDFS.subClassOf, OWL.equivalentClass) for o in graph.objects(kind, p)]
        while todo:
            node = todo.pop()
            if not isinstance(node, BNode):
                continue
            prop, value = graph.value(node, OWL.onProperty), graph.value(node, OWL.hasValue)
            if prop is not None and value is not None:
                given.setdefault(str(kind), []).append((prop, value))
            for operands in graph.objects(node, OWL.intersectionOf):
                todo += Collection(graph, operands)
    return given
