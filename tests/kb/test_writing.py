"""Files that we write are what Protégé would have saved, and read back as they were meant."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest
from rdflib import OWL, RDF, RDFS, Graph, Literal, URIRef
from rdflib.compare import to_isomorphic

from kb.files import SHIPPED
from kb.vocabulary import CORE
from kb.writing import Entity, Has, Some, Sort, ontology_text

IRI = "http://example.org/concertmaster/made.owl"


def graph_of(text: str) -> Graph:
    """What a text says."""
    return Graph().parse(data=text, format="xml")


def test_what_is_written_is_read() -> None:
    """Links, literals of each sort, restrictions, comments and labels come back, whatever characters they hold."""
    nasty = 'a < b & "c" \n ]]> ü'
    entities = [
        Entity(
            iri=f"{IRI}#x",
            sort=Sort.INDIVIDUAL,
            types=(f"{CORE}Input",),
            links=((f"{CORE}parameterType", f"{IRI}#K"), ("http://other.net/v#p", f"{IRI}#x")),
            values=((f"{CORE}a", 1), (f"{CORE}b", 0.5), (f"{CORE}c", True), (f"{IRI}#d", nasty)),
            comments=(nasty,),
            label="x",
        ),
        Entity(
            iri=f"{IRI}#K",
            sort=Sort.CLASS,
            above=(Some(prop=f"{CORE}q", kind=f"{CORE}L"), Has(prop=f"{CORE}r", value=2.0)),
        ),
        Entity(iri=f"{IRI}#d", sort=Sort.DATATYPE_PROPERTY, types=(str(OWL.FunctionalProperty),), range_=f"{CORE}R"),
    ]
    graph = graph_of(ontology_text(IRI, entities, imports=[f"{CORE[:-1]}"], comments=["made"], label="made"))
    x = URIRef(f"{IRI}#x")
    assert graph.value(x, URIRef(f"{IRI}#d")) == Literal(nasty)
    assert [graph.value(x, URIRef(CORE + p)).toPython() for p in "abc"] == [1, 0.5, True]  # type: ignore[union-attr]
    assert graph.value(x, URIRef("http://other.net/v#p")) == x
    assert graph.value(x, RDFS.comment) == Literal(nasty, lang="en")
    assert (URIRef(f"{IRI}#d"), RDF.type, OWL.FunctionalProperty) in graph
    assert {str(o) for o in graph.objects(None, OWL.someValuesFrom)} == {f"{CORE}L"}
    assert (URIRef(IRI), OWL.imports, URIRef(CORE[:-1])) in graph


def test_order_does_not_matter() -> None:
    """The same entities make the same text."""
    entities = [Entity(iri=f"{IRI}#{n}", sort=s) for n in "cab" for s in (Sort.INDIVIDUAL, Sort.CLASS)]
    assert ontology_text(IRI, entities) == ontology_text(IRI, reversed(entities))


@pytest.mark.parametrize("file", ["robots/pico.owl", "tasks/groundings.owl", "sites/objects.owl"])
def test_shipped_files_look_the_same(file: str) -> None:
    """Layout is that of the files that are shipped, but for what is said: titles, comments and blank lines."""
    text = (SHIPPED / file).read_text(encoding="utf-8")
    iri = f"http://example.org/concertmaster/{Path(file).name}"
    declared = re.findall(r'^    <owl:(\w+) rdf:about="([^"]+)">$', text, re.MULTILINE)
    entities = [
        Entity(iri=iri, sort=Sort(sort), label="x") for sort, iri in declared if sort in {s.value for s in Sort}
    ]
    assert entities
    assert _frame(ontology_text(iri, entities)) == _frame(text)


def _frame(text: str) -> list[str]:
    """Lines between the header and general axioms that are no statements."""
    _, _, body = text.partition("    </owl:Ontology>\n")
    end = body.find("    // General axioms")
    body = body[:end].removesuffix(f"    <!-- \n    {'/' * 87}\n    //\n") if end >= 0 else body
    return [line for line in body.splitlines() if not line.startswith("        ") and line != "</rdf:RDF>"]


@pytest.mark.parametrize(
    ("entity", "says"),
    [
        (Entity(iri=f"{IRI}#x", sort=Sort.INDIVIDUAL, values=((f"{CORE}a", math.nan),)), "no number"),
        (Entity(iri=f"{IRI}#x", sort=Sort.INDIVIDUAL, values=((f"{CORE}a", "\x00"),)), "which XML cannot hold"),
        (Entity(iri=f"{IRI}#x", sort=Sort.INDIVIDUAL, values=(("http://a/b c", 1),)), "no XML name"),
    ],
)
def test_what_cannot_be_written(entity: Entity, says: str) -> None:
    """What no file could hold is refused."""
    with pytest.raises(ValueError, match=says):
        ontology_text(IRI, [entity])


def test_prefixes_differ() -> None:
    """Two vocabularies whose names end alike get prefixes of their own."""
    links = (
        ("http://a.net/v.owl#p", f"{IRI}#x"),
        ("http://b.net/v.owl#p", f"{IRI}#x"),
        ("http://c.net/xml#p", f"{IRI}#x"),
    )
    text = ontology_text(IRI, [Entity(iri=f"{IRI}#x", sort=Sort.INDIVIDUAL, links=links)])
    assert len(to_isomorphic(graph_of(text))) == 5
    assert "xmlns:v_2=" in text
