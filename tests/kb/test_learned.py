"""What was learned stands in for what is stated, and can be taken away."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from kb.compiler import Compiler
from kb.learned import Refinement, forget_learned, write_learned
from kb.problems import OntologyRejected
from kb.store import KnowledgeBase
from kb.terms import render
from kb.vocabulary import Property
from tests.kb.conftest import IRI

KINECT = f"{IRI}find_empty_drink.owl#Kinect"
LEARNED = [
    Refinement(prop=Property.DURATION_S, subject=KINECT, value=0.125, source="12 tries & more"),
    Refinement(prop=Property.SUCCESS_ODDS, subject=KINECT, value=0.9, source="12 tries"),
    Refinement(prop=Property.TRAVEL_FACTOR, subject=f"{IRI}tue_lab.owl#pico_1", value=1.25, source="9 trips"),
]


def values(folder: Path) -> tuple[object, object, object]:
    """Duration and odds of Kinect, and the travel factor of a robot, as the planner is told."""
    knowledge = KnowledgeBase("tue_lab", folder)
    ontology = knowledge.snapshot().ontology
    knowledge.close()
    return (
        ontology.value(Property.DURATION_S, "Kinect"),
        ontology.value(Property.SUCCESS_ODDS, "Kinect"),
        ontology.value(Property.TRAVEL_FACTOR, "pico_1"),
    )


def test_learned_values_hold_until_they_are_taken_away(folder: Path) -> None:
    """People's files are not touched; the file is the same however often and in whatever order it is written."""
    others = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    before = values(folder)
    file = write_learned(folder, "tue_lab", LEARNED)
    text = file.read_bytes()
    assert values(folder) == (0.125, 0.9, 1.25)
    assert write_learned(folder, "tue_lab", reversed(LEARNED)).read_bytes() == text
    assert forget_learned(folder, "tue_lab")
    assert not forget_learned(folder, "tue_lab")
    assert values(folder) == before == (0.08, None, None)
    assert {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()} == others


def test_what_is_learned_of_a_robot_is_an_individual_of_its_own(folder: Path) -> None:
    """Everywhere and at a place; it is checked, and compiled to whole facts."""
    robot, place = f"{IRI}tue_lab.owl#pico_1", f"{IRI}tue_lab.owl#at_bar"
    of_robot = Refinement(prop=Property.DURATION_S, subject=KINECT, value=0.25, source="30 tries", robot=robot)
    there = Refinement(prop=Property.SUCCESS_ODDS, subject=KINECT, value=0.5, source="9", robot=robot, place=place)
    way = replace(there, subject=f"{IRI}navigation.owl#Navigate", value=0.8)
    file = write_learned(folder, "tue_lab", [*LEARNED, there, of_robot, way])
    assert "#Kinect_by_pico_1_at_at_bar" in file.read_text(encoding="utf-8")
    knowledge = KnowledgeBase("tue_lab", folder)
    snapshot = knowledge.snapshot()
    knowledge.close()
    told = map(render, Compiler(snapshot.ontology, snapshot.processes).facts(1))
    facts = {fact for fact in told if fact.startswith(("learned(", "takes_place("))}
    assert facts == {
        "learned(1,'Kinect',pico_1,anywhere,250,0.9)",
        "learned(1,'Kinect',pico_1,at(at_bar),250,0.5)",
        "learned(1,'Navigate',pico_1,at(at_bar),1500,0.8)",
        "takes_place(1,'Navigate'(Robot,Area,Location),Location)",
    }


@pytest.mark.parametrize(
    ("prop", "value", "code"),
    [
        (Property.DURATION_S, -1.0, "KB166"),
        (Property.SUCCESS_ODDS, 0.0, "KB166"),
        (Property.SUCCESS_ODDS, 1.5, "KB166"),
    ],
)
def test_a_learned_value_that_cannot_be_is_refused(prop: Property, value: float, code: str, folder: Path) -> None:
    """As a stated one would be, in its own file."""
    file = write_learned(folder, "tue_lab", [Refinement(prop=prop, subject=KINECT, value=value, source="")])
    with pytest.raises(OntologyRejected) as rejected:
        KnowledgeBase("tue_lab", folder)
    assert code in {p.code for p in rejected.value.problems}
    assert file.exists()


def test_a_learned_travel_factor_is_above_zero(folder: Path) -> None:
    """A robot that takes no time, or turns it back, is refused."""
    robot = f"{IRI}tue_lab.owl#pico_1"
    write_learned(folder, "tue_lab", [Refinement(prop=Property.TRAVEL_FACTOR, subject=robot, value=0.0, source="")])
    with pytest.raises(OntologyRejected, match=r"KB166|KB132"):
        KnowledgeBase("tue_lab", folder)
