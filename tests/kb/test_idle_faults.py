"""The corpus of wrong edits, continued: what can never be done, is never used, or finds nothing; most are warnings."""

from __future__ import annotations

from pathlib import Path

import pytest

from kb.store import KnowledgeBase
from tests.kb.conftest import NAVIGATION, OBJECTS, SITE, TASK, given, individual, link, number, renamed
from tests.kb.faults import Fault, a_class, fault, refused
from tests.kb.test_program_faults import IS_EMPTY, in_area, parameter

EMPTY = individual(TASK, "Empty", "Holds", *IS_EMPTY, number("hasValue", "true", "boolean"))
FULL = individual(TASK, "Full", "Not", link("operand", TASK, "Empty"))
BOTH = individual(TASK, "Both", "AllOf", link("operand", TASK, "Empty"), link("operand", TASK, "Full"))
NUMBER = number("stepNumber", "25", "integer")

CONTRADICTING = [
    fault(
        "KB216",
        TASK,
        "SearchDrink_30_Kinect",
        EMPTY,
        FULL,
        BOTH,
        individual(TASK, "SearchDrink_25_wait", "Await", link("hasCondition", TASK, "Both"), NUMBER),
        given(TASK, "SearchDrink_body", link("hasStep", TASK, "SearchDrink_25_wait")),
        words="is never done in SearchDrink|before it never comes to an end",
    ),
    fault(
        "KB216",
        NAVIGATION,
        "Localize_extra",
        individual(NAVIGATION, "Localize_here", "Holds", *in_area("Localize")),
        individual(NAVIGATION, "Localize_away", "Not", link("operand", NAVIGATION, "Localize_here")),
        parameter("Localize", "location", "Input", "Location", 15),
        given(NAVIGATION, "Localize", link("hasInput", NAVIGATION, "Localize_location")),
        individual(NAVIGATION, "Localize_extra", "Perform", link("performs", NAVIGATION, "Laser")),
        individual(
            NAVIGATION,
            "Localize_inner",
            "IfThenElse",
            link("hasCondition", NAVIGATION, "Localize_away"),
            link("thenStep", NAVIGATION, "Localize_extra"),
        ),
        individual(
            NAVIGATION,
            "Localize_outer",
            "IfThenElse",
            link("hasCondition", NAVIGATION, "Localize_here"),
            link("thenStep", NAVIGATION, "Localize_inner"),
            number("stepNumber", "40", "integer"),
        ),
        given(NAVIGATION, "Localize_body", link("hasStep", NAVIGATION, "Localize_outer")),
        words="inArea(location, area) and not inArea(location, area) exclude each other",
    ),
]
"""Steps that are never come to."""

IDLE = [
    fault(
        "KB217",
        NAVIGATION,
        "Spin",
        parameter("Spin", "robot", "RobotParameter", "Robot", 10),
        parameter("Spin", "velocity", "Input", "Velocity", 20),
        individual(
            NAVIGATION,
            "Spin",
            "CompositeProcess",
            link("hasInput", NAVIGATION, "Spin_robot"),
            link("hasInput", NAVIGATION, "Spin_velocity"),
            link("composedOf", NAVIGATION, "Spin_Base"),
        ),
        individual(NAVIGATION, "Spin_Base", "Perform", link("performs", NAVIGATION, "Base")),
        words="is never done: it needs 'velocity', which only another step can make",
    ),
    fault(
        "KB218",
        NAVIGATION,
        "Localize_spare",
        parameter("Localize", "spare", "Local", "Scan", 60),
        given(NAVIGATION, "Localize", link("hasLocal", NAVIGATION, "Localize_spare")),
        words="is a parameter of Localize that nothing uses",
    ),
    fault(
        "KB219",
        NAVIGATION,
        "Laser",
        a_class(NAVIGATION, "RobotWithWings", "core.owl#Robot"),
        given(NAVIGATION, "Laser", link("requiresCapability", NAVIGATION, "RobotWithWings")),
        words="can be done by no robot|amigo_1 is no RobotWithWings|pico_1 is no RobotWithWings|equip",
    ),
]
"""Processes and parameters."""

UNDESCRIBED = [
    fault(
        "KB135",
        SITE,
        "drink_1",
        a_class(OBJECTS, "Cider", "objects.owl#Drink"),
        renamed(SITE, "drink_1", "#Beer", "#Cider"),
        words="is of the class Cider, of which Detection_service finds nothing in HUE.yaml|add an entry Cider",
    ),
]
"""A thing that a service does not know."""

DOUBTS = [CONTRADICTING, IDLE, UNDESCRIBED]


@pytest.mark.parametrize("cases", DOUBTS, ids=lambda cases: "-".join(sorted({case.code for case in cases})))
def test_doubtful_edits_are_all_told(cases: list[Fault], folder: Path) -> None:
    """Each has its code, points at file, line and entity, and says what helps; nothing else is blamed."""
    refused(cases, folder)


def test_a_warning_stops_no_load(folder: Path) -> None:
    """Files with nothing worse than warnings are used; the warnings are kept with what was read."""
    for edit in IDLE[1].edits:
        edit(folder)
    knowledge = KnowledgeBase("tue_lab", folder)
    assert [w.code for w in knowledge.warnings] == ["KB218"]
    assert "Localize" in knowledge.snapshot().processes
    knowledge.close()
