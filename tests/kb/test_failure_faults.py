"""The corpus of wrong edits, continued: failures, their codes, and what is done about them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.kb.conftest import IRI, NAVIGATION, added, dropped, given, link, number, renamed
from tests.kb.faults import Fault, fault, found, make, told_before_reasoning

FILE = "failures/failures.owl"


def of_class(name: str, *lines: str) -> str:
    """More lines of a class of failure."""
    return f'<rdf:Description rdf:about="{IRI}failures.owl#{name}">{"".join(lines)}</rdf:Description>'


def code(text: str) -> str:
    """A failure code."""
    return f"<core:failureCode>{text}</core:failureCode>"


FAILURES = [
    fault(
        "KB146",
        FILE,
        "TimedOut",
        added(FILE, of_class("TimedOut", code("104 PATIENCE_EXCEEDED"))),
        words="'104 PATIENCE_EXCEEDED'|a ROS type, its number if it has one, its name: nav2_msgs/",
    ),
    fault(
        "KB146",
        FILE,
        "TimedOut",
        added(FILE, of_class("TimedOut", code("moveit_msgs/MoveItErrorCodes -31 NO_IK"))),
        words="has the failure code moveit_msgs/MoveItErrorCodes -31, as ArmGoalUnreachable has|one class of failure",
    ),
    fault(
        "KB146",
        FILE,
        "TimedOut",
        added(FILE, of_class("TimedOut", code("concertmaster BadReply"))),
        words="has the failure code concertmaster BadReply, as BadReply has",
    ),
    fault("KB147", FILE, "retry", dropped(FILE, "retry", "recoveryTime_s"), words="needs one recoveryTime_s"),
    fault("KB147", FILE, "retry", renamed(FILE, "retry", ">0.3<", ">30.0<"), words="recoveryOdds|at most 1"),
    fault("KB147", FILE, "retry", renamed(FILE, "retry", ">2<", ">0<"), words="maxAttempts|1 or more"),
    fault("KB147", FILE, "look_again", renamed(FILE, "look_again", ">1.0<", ">9.0<"), words="pause_s|a part"),
    fault(
        "KB148",
        FILE,
        "TimedOut",
        added(FILE, of_class("TimedOut", link("recoveredBy", FILE, "BadReply"))),
        words="recoveredBy names BadReply, which is not an individual that is a Recovery",
    ),
    fault(
        "KB148",
        NAVIGATION,
        "Laser",
        given(NAVIGATION, "Laser", link("expectedFailure", FILE, "retry")),
        words="expectedFailure names retry, which is not a class below Failure",
    ),
    fault(
        "KB148",
        NAVIGATION,
        "Localize",
        given(NAVIGATION, "Localize", link("failureIfLate", FILE, "start_over")),
        words="failureIfLate names start_over, which is not a class below Failure",
    ),
    fault(
        "KB016",
        NAVIGATION,
        "Laser",
        renamed(NAVIGATION, "Laser", '#boolean">false', '#string">no'),
        words="isDeterministic is of xsd:boolean, but 'no' is of xsd:string; choose xsd:boolean",
    ),
    fault(
        "KB143",
        NAVIGATION,
        "Laser",
        given(NAVIGATION, "Laser", number("isDeterministic", "true", "boolean")),
        words="isDeterministic has 2 values, false and true",
    ),
]
"""What an executive could not act on."""


@pytest.mark.parametrize("case", FAILURES, ids=str)
def test_what_is_said_of_failures_can_be_acted_on(case: Fault, folder: Path) -> None:
    """The problem has its code, points at file, line and entity, and says what helps; nothing else is blamed."""
    make([case], folder)
    found([case], folder, told_before_reasoning(folder))
