"""What is different between two revisions, exactly, and which tasks that concerns."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from kb.difference import Change, EntityChange, Values, concerned, difference, program_changed
from kb.files import SHIPPED
from kb.ontology import Value
from kb.revisions import Key, Revision, carry_over, read_revision
from kb.terms import Struct
from tests.kb.conftest import (
    AMIGO,
    GROUNDINGS,
    SITE,
    TASK,
    Edit,
    dropped,
    given,
    individual,
    instead,
    link,
    number,
    renamed,
)

Read = Callable[..., Revision]


@pytest.fixture(scope="module")
def before() -> Revision:
    """The shipped site, read once."""
    return read_revision("tue_lab", SHIPPED)


@pytest.fixture
def read(folder: Path) -> Read:
    """A function that edits a copy of the shipped ontologies and reads it."""

    def edit_and_read(*edits: Edit) -> Revision:
        for edit in edits:
            edit(folder)
        return read_revision("tue_lab", folder)

    return edit_and_read


def test_the_same_files_elsewhere_are_no_difference(before: Revision, read: Read) -> None:
    """Where the folder is does not matter, nor what the blank nodes are called, nor what is said to people alone."""

    def remark(folder: Path) -> None:
        for file in folder.rglob("*.owl"):
            file.write_text(file.read_text(encoding="utf-8") + "<!-- read again -->\n", encoding="utf-8")

    for edits in ((), (remark,)):
        found = difference(before, read(*edits))
        assert found.is_empty, found.lines
        assert (found.lines, found.summary) == ((), "nothing is different")


def test_a_value_of_an_individual(before: Revision, read: Read) -> None:
    """Its file, the property, what it was and what it is; programs are the same."""
    found = difference(before, read(renamed(SITE, "drink_1", "#at_coffee_table", "#at_cabinet")))
    [change] = found.entities
    assert change == EntityChange(
        file=SITE,
        sort="individual",
        entity="drink_1",
        change=Change.CHANGED,
        values=(Values(prop="locatedAt", removed=("at_coffee_table",), added=("at_cabinet",)),),
    )
    assert (len(found.processes), len(found.capabilities), len(found.tasks_added)) == (0, 0, 0)
    assert json.loads(json.dumps(found.as_data()))["entities"][0]["change"] == "changed"


def test_what_is_added_and_removed(before: Revision, read: Read) -> None:
    """An individual that is new, seen from the other side, is gone."""
    after = read(individual(SITE, "drink_9", "PhysicalObject", link("locatedAt", SITE, "at_bar")))
    [come] = difference(before, after).entities
    assert (come.entity, come.sort, come.change) == ("drink_9", "individual", Change.ADDED)
    found = difference(after, before)
    assert [e.change for e in found.entities] == [Change.REMOVED]
    assert found.individuals_removed == ("drink_9",)


def test_a_class_that_loses_a_sensor(before: Revision, read: Read) -> None:
    """The restriction as people write it, and what the robot is no more."""
    kinect = "http://example.org/concertmaster/core.owl#Kinect"
    laser = "http://example.org/concertmaster/core.owl#LaserScanner"
    text = (SHIPPED / AMIGO).read_text(encoding="utf-8")
    assert text.count(kinect) == 1
    other = laser if laser in text else "http://example.org/concertmaster/core.owl#Sensor"
    found = difference(before, read(instead(AMIGO, kinect, other)))
    [change] = [e for e in found.entities if e.entity == "Amigo"]
    assert change.sort == "class"
    assert "hasSensor some Kinect" in change.values[0].removed
    [lost] = found.capabilities
    assert (lost.robot, lost.gained, len(lost.lost) > 0) == ("amigo_1", (), True)
    assert "robot amigo_1 is no " + lost.lost[0] + " any more" in found.lines


def test_a_program_that_changes(before: Revision, read: Read) -> None:
    """The lines that are different, and which tasks come to it."""
    after = read(renamed(TASK, "FindEachDrink_is_empty", ">true<", ">false<"))
    found = difference(before, after)
    [process] = [p for p in found.processes if p.program]
    assert process.process == "FindEachDrink"
    assert {line[0] for line in process.program} >= {"-", "+"}
    assert program_changed("FindEmptyDrink", before, after) == "FindEachDrink"
    assert program_changed("Navigate", before, after) == ""


def test_a_duration_and_a_grounding_leave_programs_as_they_are(before: Revision, read: Read) -> None:
    """The planner is told otherwise, and the process is executed otherwise."""
    after = read(
        renamed(TASK, "Detection", ">0.05<", ">0.5<"),
        dropped(GROUNDINGS, "Detection_service", "timeout_s"),
        given(GROUNDINGS, "Detection_service", number("timeout_s", "7.5")),
    )
    found = difference(before, after)
    [process] = found.processes
    assert found.groundings == ("Detection",)
    assert (process.process, process.program) == ("Detection", ())
    assert [text for text in process.added if "fixed(500)" in text]
    assert program_changed("FindEmptyDrink", before, after) == ""
    assert "holds" in concerned("FindEmptyDrink", before, after, ())
    assert concerned("Navigate", before, after, ()) == ""


def test_what_plans_rest_on(before: Revision, read: Read) -> None:
    """A place that was moved concerns whoever travels; a label concerns nobody; a value only who asks for it."""
    moved = read(renamed(SITE, "at_bar", ">7.5<", ">7.4<"))
    assert "poseX_m" in concerned("FindEmptyDrink", before, moved, ())
    assert concerned("FindEmptyDrink", before, before, ()) == ""
    assert concerned("FindEmptyDrink", before, before, [("isEmpty", "drink_1")]) == "isEmpty(drink_1) has another value"
    assert concerned("Localize", before, before, [("isEmpty", "drink_1")]) == ""
    one, other = (
        replace(before, facts=(*before.facts, Struct("value", (before.key, "poseX_m", "at_sea", number))))
        for number in (1, 1.0)
    )
    assert concerned("FindEmptyDrink", one, other, ()) == "value(poseX_m,at_sea,1) holds no more"


def test_what_was_told_is_carried_over(before: Revision, read: Read) -> None:
    """As long as it fits; else it is said why not, and the files hold again."""
    after = read(renamed(SITE, "drink_1", "#at_coffee_table", "#at_cabinet"))
    now = {**before.initial, ("locatedAt", "drink_2"): "at_bar", ("isEmpty", "cup"): True}
    carry = carry_over(before, after, now, frozenset({("locatedAt", "drink_2"), ("isEmpty", "cup")}))
    assert carry.fluents["locatedAt", "drink_1"] == "at_cabinet"
    assert carry.fluents["locatedAt", "drink_2"] == "at_bar"
    assert dict(carry.dropped) == {("isEmpty", "cup"): "there is no cup any more"}
    assert dict(carry.changed) == {("locatedAt", "drink_1"): "at_cabinet", ("isEmpty", "cup"): None}
    back = carry_over(after, before, {("locatedAt", "drink_1"): "at_bar"}, frozenset({("locatedAt", "drink_1")}))
    [sentence] = [s for s in back.overridden if "drink_1" in s]
    assert sentence == "locatedAt(drink_1) stays at_bar, as told; the files now begin with at_coffee_table"
    same = carry_over(before, before, {("locatedAt", "drink_1"): "at_bar"}, frozenset({("locatedAt", "drink_1")}))
    assert same.overridden == ()  # the files say what they said
    told: dict[Key, Value] = {
        ("locatedAt", "drink_1"): "kitchen",
        ("isEmpty", "amigo_1"): True,
        ("isClean", "drink_1"): True,
    }
    assert dict(carry_over(after, before, told, frozenset(told)).dropped) == {
        ("locatedAt", "drink_1"): "kitchen is no Location any more",
        ("isEmpty", "amigo_1"): "amigo_1 is no PhysicalObject any more",
        ("isClean", "drink_1"): "there is no property isClean any more that changes",
    }
