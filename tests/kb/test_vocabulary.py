import re

import pytest
from rdflib import OWL, RDF, RDFS, XSD, Graph, URIRef

from kb.files import SHIPPED, local_name
from kb.vocabulary import CORE, CORE_IRI, Kind, Property
from tests.kb.conftest import CORE as CORE_FILE
from tests.kb.conftest import OBJECTS

PROPERTY_SORTS = (OWL.ObjectProperty, OWL.DatatypeProperty, OWL.AnnotationProperty)
UNIT = re.compile(r"_(s|m|rad|mps|radps|J|W|kg|N|Nm)\Z")
# Numbers that count or order, or are a probability or a factor, and so have no unit.
WITHOUT_UNIT = {
    "capacity",
    "learnedOdds",
    "learnedRecoveryOdds",
    "learnedTravelFactor",
    "maxAttempts",
    "parameterNumber",
    "recoveryOdds",
    "stepNumber",
    "successOdds",
    "travelFactor",
}


def parsed(file: str) -> Graph:
    """A shipped file."""
    return Graph().parse(SHIPPED / file, format="xml")


def terms(graph: Graph) -> list[URIRef]:
    """The classes and properties that a file declares."""
    sorts = (OWL.Class, *PROPERTY_SORTS)
    return sorted({s for sort in sorts for s in graph.subjects(RDF.type, sort) if isinstance(s, URIRef)})


CORE_GRAPH = parsed(CORE_FILE)


def test_the_core_has_the_iri_that_code_names() -> None:
    """`CORE_IRI` is the IRI of core.owl."""
    assert [str(s) for s in CORE_GRAPH.subjects(RDF.type, OWL.Ontology)] == [CORE_IRI]


@pytest.mark.parametrize("kind", Kind)
def test_every_kind_is_a_class(kind: Kind) -> None:
    """Code names no class that core.owl does not declare."""
    assert (URIRef(CORE + kind), RDF.type, OWL.Class) in CORE_GRAPH


@pytest.mark.parametrize("prop", Property)
def test_every_property_is_a_property(prop: Property) -> None:
    """Code names no property that core.owl does not declare, as one sort."""
    sorts = [sort for sort in PROPERTY_SORTS if (URIRef(CORE + prop), RDF.type, sort) in CORE_GRAPH]
    assert len(sorts) == 1


@pytest.mark.parametrize("file", [CORE_FILE, OBJECTS])
def test_every_term_is_explained(file: str) -> None:
    """Each class and property has one English label and one English comment that ends in a full stop."""
    graph = parsed(file)
    assert terms(graph)
    for term in terms(graph):
        for prop in (RDFS.label, RDFS.comment):
            languages = [getattr(o, "language", None) for o in graph.objects(term, prop)]
            assert languages.count("en") == 1, f"{local_name(str(term))} has no {local_name(str(prop))}"
        assert str(graph.value(term, RDFS.comment)).endswith("."), (
            f"{local_name(str(term))}: its comment is no sentence"
        )


def test_numbers_carry_their_unit() -> None:
    """A numeric property is named with its SI unit, unless it counts."""
    numeric = {XSD.double, XSD.integer}
    names = [local_name(str(p)) for p, r in CORE_GRAPH.subject_objects(RDFS.range) if r in numeric]
    assert set(names) >= {"duration_s", "radius_m", "poseYaw_rad", "maxVelLin_mps", "maxVelAng_radps", "stepNumber"}
    assert {name for name in names if not UNIT.search(name)} == WITHOUT_UNIT


def test_quantities_are_doubles() -> None:
    """A property named with a unit has real values."""
    for prop in CORE_GRAPH.subjects(RDF.type, OWL.DatatypeProperty):
        if UNIT.search(local_name(str(prop))):
            assert CORE_GRAPH.value(prop, RDFS.range) == XSD.double, local_name(str(prop))
