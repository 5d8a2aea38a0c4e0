"""What is known as RDF graphs in N-Triples, for queries: all that is so now, and where each part of it is from."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

from rdflib import RDF, RDFS, BNode, Literal, URIRef
from rdflib.term import Node

from kb.entities import Entities, Role, Sort
from kb.ontology import Value
from kb.store import Snapshot

GRAPHS = "http://example.org/concertmaster/graph#"
INFERRED, TOLD = GRAPHS + "inferred", GRAPHS + "told"

_ESCAPED = str.maketrans({"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r"})
_Triple = tuple[Node, Node, Node]


def dataset(snapshot: Snapshot) -> dict[str, str]:
    """All graphs by IRI: one for each file, INFERRED, TOLD; the default graph, all that is so now, by the empty IRI."""
    ontology = snapshot.ontology
    names = Entities(ontology)
    told: set[_Triple] = set()
    for (prop, subject), value in snapshot.fluents.items():
        node, relation = _iri(names, subject, Role.INDIVIDUAL), _iri(names, prop, Role.PROPERTY)
        if node is not None and relation is not None and value != ontology.value(prop, subject):
            told.add((node, relation, _node(names, prop, value)))
    changed = {(s, p) for s, p, _ in told}
    stated = {file.iri: set(file.graph) for file in ontology.files.files}
    now = {t for triples in stated.values() for t in triples if (t[0], t[1]) not in changed} | told
    numbers = {
        (s, p, o.toPython()) for s, p, o in now if isinstance(o, Literal) and isinstance(o.toPython(), int | float)
    }
    inferred = set()
    for s, p, o in _inferred(snapshot, names):
        # A number may be stated with another datatype than the one that it would get here.
        is_stated = (s, p, o) in now or (isinstance(o, Literal) and (s, p, o.toPython()) in numbers)
        if not is_stated and (s, p) not in changed:
            inferred.add((s, p, o))
    return {
        "": _n_triples(now | inferred),
        INFERRED: _n_triples(inferred),
        TOLD: _n_triples(told),
        **{iri: _n_triples(triples) for iri, triples in stated.items()},
    }


def _inferred(snapshot: Snapshot, names: Entities) -> Iterator[_Triple]:
    """Classes of individuals and classes, and closed values; some of it is stated too."""
    ontology = snapshot.ontology
    for kinds, predicate, role in (
        (ontology.kinds, RDF.type, Role.INDIVIDUAL),
        (ontology.superclasses, RDFS.subClassOf, Role.CLASS),
    ):
        for name, above in kinds.items():
            node = _iri(names, name, role)
            for kind in above - {name} if role is Role.CLASS else above:
                higher = _iri(names, kind, Role.CLASS)
                if node is not None and higher is not None:
                    yield node, predicate, higher
    for prop, subject, value in ontology.all_values():
        node, relation = _iri(names, subject, Role.INDIVIDUAL), _iri(names, prop, Role.PROPERTY)
        if node is not None and relation is not None and _sort(names, prop) is not Sort.ANNOTATION_PROPERTY:
            literals = ontology.graph.objects(node, relation) if isinstance(value, str) else ()
            # Of a text, the datatype or language is not known here: it is stated.
            if not any(isinstance(o, Literal) and str(o) == value for o in literals):
                yield node, relation, _node(names, prop, value)


def _iri(names: Entities, name: str, role: Role) -> URIRef | None:
    key = names.key(name, role)
    return None if key is None else URIRef(names.iri(key))


def _sort(names: Entities, prop: str) -> Sort | None:
    key = names.key(prop, Role.PROPERTY)
    return None if key is None else names.sort(key)


def _node(names: Entities, prop: str, value: Value) -> Node:
    if isinstance(value, str) and _sort(names, prop) is Sort.OBJECT_PROPERTY:
        return _iri(names, value, Role.INDIVIDUAL) or Literal(value)
    return Literal(value)


def _n_triples(triples: set[_Triple]) -> str:
    """Sorted lines: written here because rdflib's writer takes ten times as long."""
    written = cache(_written)
    return "".join(sorted(f"{written(s)} {written(p)} {written(o)} .\n" for s, p, o in triples))


def _written(node: Node) -> str:
    match node:
        case Literal():
            text = f'"{str(node).translate(_ESCAPED)}"'
            if node.language:
                return f"{text}@{node.language}"
            return f"{text}^^<{node.datatype}>" if node.datatype else text
        case BNode():
            return f"_:{node}"
        case _:
            return f"<{node}>"
