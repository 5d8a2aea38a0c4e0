"""What is known as RDF graphs in N-Triples, for queries: all that is so now, and where each part of it is from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache

import pyoxigraph as ox
from rdflib import RDF, RDFS, Literal, URIRef

from kb.entities import Entities, Role, Sort
from kb.ontology import Ontology, Value

GRAPHS = "http://example.org/concertmaster/graph#"
INFERRED, TOLD = GRAPHS + "inferred", GRAPHS + "told"

_TYPE, _SUBCLASS_OF = f"<{RDF.type}>", f"<{RDFS.subClassOf}>"


def dataset(ontology: Ontology, fluents: Mapping[tuple[str, str], Value]) -> dict[str, bytes]:
    """All graphs by IRI: one for each file, INFERRED, TOLD; the default graph, all that is so now, by the empty IRI.

    Args:
        fluents: The present value of what changes, by (property, individual); of all else, files tell.
    """
    terms = _Terms(ontology)
    told = []
    for (prop, individual), value in sorted(fluents.items(), key=lambda fluent: fluent[0]):
        node, relation = terms.name(individual, Role.INDIVIDUAL), terms.name(prop, Role.PROPERTY)
        if node and relation and value != ontology.value(prop, individual):
            told.append(f"{node} {relation} {terms.value(prop, value)} .")
    changed = set(map(_subject_and_predicate, told))
    stated = {f.iri: ox.serialize(f.triples, format=ox.RdfFormat.N_TRIPLES) or b"" for f in ontology.files.files}
    lines = [line for graph in stated.values() for line in graph.decode().split("\n") if line]
    follows = set(_following(ontology, terms)).difference(lines)
    inferred = sorted(line for line in follows if _subject_and_predicate(line) not in changed)
    now = [line for line in lines if _subject_and_predicate(line) not in changed]
    return {"": _text([*now, *inferred, *told]), INFERRED: _text(inferred), TOLD: _text(told), **stated}


class _Terms:
    """Names and values as N-Triples write them; a name is in many triples."""

    def __init__(self, ontology: Ontology) -> None:
        self._entities = Entities(ontology)
        self.name = cache(self._name)
        self.is_of_sort = cache(self._is_of_sort)

    def value(self, prop: str, value: Value) -> str:
        if isinstance(value, str) and self.is_of_sort(prop, Sort.OBJECT_PROPERTY):
            return self.name(value, Role.INDIVIDUAL) or str(ox.Literal(value))
        return str(ox.Literal(value))

    def _name(self, name: str, role: Role) -> str:
        key = self._entities.key(name, role)
        return "" if key is None else f"<{self._entities.iri(key)}>"

    def _is_of_sort(self, prop: str, sort: Sort) -> bool:
        key = self._entities.key(prop, Role.PROPERTY)
        return key is not None and self._entities.sort(key) is sort


def _following(ontology: Ontology, terms: _Terms) -> Iterator[str]:
    """Classes of individuals and classes, and closed values; some of it is stated too."""
    for kinds, predicate, role in (
        (ontology.kinds, _TYPE, Role.INDIVIDUAL),
        (ontology.superclasses, _SUBCLASS_OF, Role.CLASS),
    ):
        for name, above in kinds.items():
            node = terms.name(name, role)
            for kind in above - {name} if role is Role.CLASS else above:
                higher = terms.name(kind, Role.CLASS)
                if node and higher:
                    yield f"{node} {predicate} {higher} ."
    for prop, individual, value in ontology.all_values():
        node, relation = terms.name(individual, Role.INDIVIDUAL), terms.name(prop, Role.PROPERTY)
        if not node or not relation or terms.is_of_sort(prop, Sort.ANNOTATION_PROPERTY):
            continue
        is_link = isinstance(value, str) and terms.is_of_sort(prop, Sort.OBJECT_PROPERTY)
        if is_link or not _is_stated(ontology, node, relation, value):
            yield f"{node} {relation} {terms.value(prop, value)} ."


def _is_stated(ontology: Ontology, node: str, relation: str, value: Value) -> bool:
    """Whether files state a literal, with whatever datatype or language: that is not known any more."""
    stated = ontology.graph.objects(URIRef(node[1:-1]), URIRef(relation[1:-1]))
    return any(
        str(o) == value if isinstance(value, str) else o.toPython() == value for o in stated if isinstance(o, Literal)
    )


def _subject_and_predicate(line: str) -> tuple[str, str]:
    subject, predicate, _ = line.split(" ", 2)
    return subject, predicate


def _text(lines: list[str]) -> bytes:
    return "".join(f"{line}\n" for line in lines).encode()
