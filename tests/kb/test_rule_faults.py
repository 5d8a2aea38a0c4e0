"""The corpus of wrong edits, continued: rules."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.kb.conftest import NAVIGATION, SITE, TASK, Edit, given, individual, link, number
from tests.kb.faults import Fault, fault, refused
from tests.kb.rules import built_in, core, has, has_data, is_a, named, rule, satisfied


def asked(name: str, *body: str, label: str = "") -> tuple[Edit, ...]:
    """Give SearchDrink a precondition that a rule defines; without a body, the condition alone."""
    edits = (
        individual(TASK, name, "RuleCondition"),
        given(TASK, "SearchDrink", link("hasPrecondition", TASK, name)),
    )
    return (*edits, rule(TASK, satisfied(named(TASK, name)), *body, label=label)) if body else edits


def of_robot(name: str, process: str, *numbers: str, robot: bool = True) -> Edit:
    """Add a learned value of a process and, if `robot`, of pico_1."""
    by = [link("ofRobot", SITE, "pico_1")] if robot else []
    return individual(SITE, name, "LearnedValue", link("ofProcess", TASK, process), *by, *numbers)


THERE = has(core("locatedAt"), "?drink", "?location")

UNREADABLE = [
    fault(
        "KB203",
        TASK,
        "Powerful",
        *asked("Powerful", has_data(core("radius_m"), "?robot", "?r"), built_in("pow", "?r", 2, 3)),
        words="pow",
    ),
    fault("KB206", TASK, "Forgotten", *asked("Forgotten"), words="no rule says|satisfied(Forgotten, true)"),
    fault(
        "KB207",
        TASK,
        "general",
        rule(TASK, is_a(core("Robot"), "?x"), is_a(core("Area"), "?x"), label="general"),
        words="satisfied",
        at=">general<",
    ),
]
"""What no condition can be made of."""

UNDRAWN = [
    fault(
        "KB204",
        TASK,
        "Undrawn",
        *asked("Undrawn", THERE, built_in("lessThan", "?most", 2.0)),
        words="?most, which no atom gives a value",
    ),
]
"""Conditions on nothing."""

MISNAMED = [
    fault(
        "KB205",
        TASK,
        "Misnamed",
        *asked("Misnamed", THERE, has(core("locatedAt"), "?robots", "?where"), is_a(core("Robot"), "?robots")),
        words="?robots, which is no parameter of SearchDrink|did you mean ?robot?",
    ),
]
"""Variables that are probably meant to be parameters."""

LEARNED = [
    fault(
        "KB166",
        NAVIGATION,
        "Laser",
        given(NAVIGATION, "Laser", number("learnedDuration_s", "-1.0")),
        words="learnedDuration_s",
    ),
    fault(
        "KB167",
        SITE,
        "Of_nobody",
        of_robot("Of_nobody", "Kinect", number("learnedOdds", "0.5"), robot=False),
        words="ofRobot|who did it",
    ),
    fault(
        "KB167", SITE, "Of_nothing", of_robot("Of_nothing", "Kinect"), words="learnedDuration_s, learnedOdds or both"
    ),
]

LEARNED_OF_A_ROBOT = [
    fault(
        "KB016",
        SITE,
        "pico_1",
        given(SITE, "pico_1", number("learnedOdds", "0.5")),
        words="learnedOdds, which is of LearnedValue or Process",
    ),
]

LEARNED_WRONG = [
    fault(
        "KB167",
        SITE,
        "Twice",
        of_robot("Once", "Kinect", number("learnedOdds", "0.5")),
        of_robot("Twice", "Kinect", number("learnedOdds", "0.7")),
        words="same process, robot and place as Once",
    ),
    fault(
        "KB167",
        SITE,
        "Of_a_task",
        of_robot("Of_a_task", "FindEmptyDrink", number("learnedOdds", "0.5")),
        words="FindEmptyDrink, which is not one step",
    ),
]
"""What would be taken for nothing, or for either."""

RULES = [UNREADABLE, UNDRAWN, MISNAMED, LEARNED, LEARNED_OF_A_ROBOT, LEARNED_WRONG]


@pytest.mark.parametrize("cases", RULES, ids=lambda cases: "-".join(sorted({case.code for case in cases})))
def test_wrong_rules_are_all_told(cases: list[Fault], folder: Path) -> None:
    """Each has its code, points at file, line and entity, and says what helps; nothing else is blamed."""
    refused(cases, folder)
