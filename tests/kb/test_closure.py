from collections.abc import Mapping

import pytest
from rdflib import Graph, URIRef
from rdflib.term import Node

from kb.closure import closed_values

PREFIXES = """
@prefix : <http://example.org/x#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
:p a owl:ObjectProperty . :q a owl:ObjectProperty . :r a owl:ObjectProperty . :d a owl:DatatypeProperty .
:e a owl:DatatypeProperty .
"""


def values(turtle: str, types: Mapping[str, list[str]] | None = None) -> set[tuple[str, str, str]]:
    """All closed values of an ontology, in local names."""
    named = {f"http://example.org/x#{i}": [f"http://example.org/x#{c}" for c in k] for i, k in (types or {}).items()}
    closed = closed_values(Graph().parse(data=PREFIXES + turtle, format="turtle"), named)
    return {
        (name(prop), name(subject), name(value))
        for prop, subjects in closed.items()
        for subject, nodes in subjects.items()
        for value in nodes
        if isinstance(prop, URIRef)
    }


def name(node: Node) -> str:
    """What stands behind the `#`."""
    return str(node).rsplit("#", 1)[-1]


@pytest.mark.parametrize(
    ("axioms", "derived"),
    [
        (":p rdfs:subPropertyOf :q . :q rdfs:subPropertyOf :r . :a :p :b .", "qab rab"),
        (":d rdfs:subPropertyOf :e . :a :d '1' .", "ea1"),
        (":p owl:equivalentProperty :q . :a :p :b . :c :q :b .", "qab pcb"),
        (":p owl:inverseOf :q . :a :p :b . :c :q :b .", "qba pbc"),
        (":p a owl:SymmetricProperty . :a :p :b .", "pba"),
        (":p a owl:TransitiveProperty . :a :p :b . :b :p :c . :c :p :a .", "paa pac pba pbb pca pcb pcc"),
        (":r owl:propertyChainAxiom (:p :q) . :b :q :c . :a :p :b .", "rac"),
        (":r owl:propertyChainAxiom (:p :q :p) . :a :p :b . :c :p :d . :b :q :c .", "rad"),
        (":r owl:propertyChainAxiom (:p :d) . :a :p :b . :b :d '1' .", "ra1"),
        (":q owl:propertyChainAxiom (:p :q) . :a :p :b . :b :p :c . :c :q :d .", "qbd qad"),
        (":p rdfs:subPropertyOf [ owl:inverseOf :q ] . :a :p :b .", "qba"),
        (":p rdfs:subPropertyOf :q . :q a owl:TransitiveProperty , owl:SymmetricProperty . :a :p :b . :c :p :b .",
         "qab qba qcb qbc qac qca qaa qbb qcc"),
    ],
)  # fmt: skip
def test_values_follow(axioms: str, derived: str) -> None:
    """Those that OWL says, and no others."""
    graph = Graph().parse(data=PREFIXES + axioms, format="turtle")
    letters = {
        name(p) + name(s) + name(o)
        for s, p, o in graph
        if isinstance(s, URIRef) and isinstance(p, URIRef) and len(name(p)) == 1
    }
    assert {"".join(value) for value in values(axioms)} == letters | set(derived.split())


def test_classes_give_values_to_their_members() -> None:
    """Alone, within an intersection, and what follows from them by properties."""
    axioms = """
    :A a owl:Class ; rdfs:subClassOf [ owl:onProperty :p ; owl:hasValue :x ] .
    :B a owl:Class ; owl:equivalentClass [ owl:intersectionOf (:A [ owl:onProperty :q ; owl:hasValue :y ]) ] .
    :C a owl:Class ; owl:equivalentClass [ owl:unionOf ([ owl:onProperty :p ; owl:hasValue :z ] :A) ] .
    :q owl:inverseOf :r .
    """
    told = values(axioms, {"a": ["A"], "b": ["B", "A"], "c": ["C"]})
    assert told == {("p", "a", "x"), ("p", "b", "x"), ("q", "b", "y"), ("r", "y", "b")}


def test_many_values_take_no_more_than_their_number() -> None:
    """20,000 individuals, each under one of few: nothing is looked at for each pair."""
    axioms = ":p a owl:TransitiveProperty . :q owl:inverseOf :p . :room :p :site .\n"
    told = values(axioms + "\n".join(f":i{n} :p :room ." for n in range(20_000)))
    assert len(told) == 2 * (20_000 * 2 + 1)
