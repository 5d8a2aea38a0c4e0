from dataclasses import replace
from pathlib import Path

import pytest

from kb.files import read_files
from kb.ontology import Ontology, close, fluent_properties
from kb.problems import OntologyRejected
from kb.reasoner import classify
from kb.store import KnowledgeBase
from tests.kb.conftest import IRI, SITE, Edit, added, given


def ontology_of(shipped: KnowledgeBase) -> Ontology:
    """The shipped ontology."""
    return shipped.snapshot().ontology


def test_values_are_closed(shipped: KnowledgeBase) -> None:
    """Transitive properties, values of classes and super-properties are worked out."""
    ontology = ontology_of(shipped)
    assert ontology.values("inArea", "at_bar") == ("kitchen", "tue_lab")
    assert ontology.value("radius_m", "amigo_1") == 0.35
    assert ontology.value("hasDisposeLocation", "drink_1") == "trash_bin_1"
    assert "Laser_robot" in ontology.values("hasParameter", "Laser")
    assert ontology.value("locatedAt", "kitchen") is None


def test_values_have_their_types(shipped: KnowledgeBase) -> None:
    """Numbers are numbers, truth values truth values, names names."""
    ontology = ontology_of(shipped)
    assert ontology.value("isEmpty", "drink_1") is True
    assert ontology.value("stepNumber", "Localize_20_Laser") == 20
    assert isinstance(ontology.value("poseX_m", "at_bar"), float)
    assert ontology.value("parameterType", "Laser_scan") == "Scan"
    assert ontology.value("serviceName", "Laser_service") == "/{robot}/laser"


def test_a_capability_is_told_as_it_is_defined(shipped: KnowledgeBase) -> None:
    """For messages: what a robot would need."""
    assert ontology_of(shipped).definition("RobotWithKinect") == "hasSensor some Kinect"


def test_the_kind_of_a_thing_is_its_narrowest_class(shipped: KnowledgeBase) -> None:
    """Of classes that mean the same, the first by name."""
    ontology = ontology_of(shipped)
    assert (ontology.kind_of("drink_1"), ontology.kind_of("kitchen")) == ("Beer", "Room")
    both = frozenset({"Beer", "Ale", "Drink"})
    synonyms = replace(
        ontology,
        kinds={"drink_1": both},
        superclasses={"Beer": both, "Ale": both, "Drink": frozenset({"Drink"})},
    )
    assert synonyms.kind_of("drink_1") == "Ale"


def test_fluents_are_what_the_ontology_marks(shipped: KnowledgeBase) -> None:
    """What changes while robots work is said in core.owl."""
    marked = {"locatedAt", "isEmpty", "hasPoseEstimate", "hasOdometry", "hasDetectedPosition"}
    assert fluent_properties(ontology_of(shipped)) >= marked
    assert "inArea" not in fluent_properties(ontology_of(shipped))


def test_messages_are_told_from_individuals(shipped: KnowledgeBase) -> None:
    """A scan is a message, a place is not."""
    ontology = ontology_of(shipped)
    assert [ontology.is_datum(kind) for kind in ("Scan", "Location", None)] == [True, False, False]
    assert [ontology.datum_property(prop) for prop in ("hasOdometry", "locatedAt")] == [True, False]


FUNCTIONAL = f'<owl:FunctionalProperty rdf:about="{IRI}tue_lab.owl#nearest"/>'
INVERSE = f'<owl:InverseFunctionalProperty rdf:about="{IRI}tue_lab.owl#nearest"/>'
NEAREST = f'<owl:ObjectProperty rdf:about="{IRI}tue_lab.owl#nearest"/>'
NEXT = (
    f'<owl:ObjectProperty rdf:about="{IRI}tue_lab.owl#next">'
    f'<rdfs:subPropertyOf rdf:resource="{IRI}tue_lab.owl#nearest"/></owl:ObjectProperty>'
)


def nearest(prop: str, one: str, other: str) -> Edit:
    """A value of one of the two properties."""
    return given(SITE, one, f'<site:{prop} xmlns:site="{IRI}tue_lab.owl#" rdf:resource="{IRI}tue_lab.owl#{other}"/>')


@pytest.mark.parametrize(
    ("edits", "entity", "words"),
    [
        (
            [given(SITE, "bar_1", f'<owl:sameAs rdf:resource="{IRI}tue_lab.owl#cabinet_1"/>')],
            "bar_1",
            "is said to be the same as cabinet_1",
        ),
        (
            [
                added(SITE, NEAREST + NEXT + FUNCTIONAL),
                nearest("nearest", "bar_1", "kitchen"),
                nearest("next", "bar_1", "living_room"),
            ],
            "bar_1",
            "has by inference 2 values of nearest, kitchen and living_room",
        ),
        (
            [
                added(SITE, NEAREST + INVERSE),
                nearest("nearest", "bar_1", "at_bar"),
                nearest("nearest", "cabinet_1", "at_bar"),
            ],
            "at_bar",
            "is the nearest of bar_1 and cabinet_1",
        ),
    ],
    ids=["stated", "functional", "inverse"],
)
def test_two_names_of_one_individual_are_refused(edits: list[Edit], entity: str, words: str, folder: Path) -> None:
    """KB304: a reasoner would take the two for one in silence; planner and services would not."""
    for edit in edits:
        edit(folder)
    files = read_files(folder / SITE, folder)
    with pytest.raises(OntologyRejected) as caught:
        close(files, classify(files))
    (problem,) = caught.value.problems
    assert (problem.code, problem.entity, problem.file) == ("KB304", entity, folder / SITE)
    assert words in problem.message
