from dataclasses import replace

from kb.ontology import Ontology, fluent_properties
from kb.store import KnowledgeBase


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
