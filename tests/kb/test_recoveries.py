"""What the shipped ontologies say of failures and of what may help."""

from __future__ import annotations

import pytest

from kb.recoveries import MOST_ATTEMPTS, Recoveries, Recovery
from kb.store import KnowledgeBase


@pytest.fixture(scope="module")
def recoveries(shipped: KnowledgeBase) -> Recoveries:
    """Of the shipped site."""
    return Recoveries(shipped.snapshot().ontology)


@pytest.mark.parametrize(
    ("code", "failure"),
    [
        ("NoReply", "TimedOut"),
        ("ObjectNotFound", "NotDetected"),
        ("Lost", "RobotLost"),
        ("PATIENCE_EXCEEDED", "NavigationBlocked"),
        ("SomethingElse", "UnknownFailure"),
    ],
)
def test_a_code_means_a_class_of_failure(code: str, failure: str, recoveries: Recoveries) -> None:
    """Ours, and those of ROS by their names; what nobody claims is unknown."""
    assert recoveries.failure_class(code) == failure


def test_what_helps_against_a_class_helps_against_those_below(recoveries: Recoveries) -> None:
    """A reply that does not come is tried for as any call is that does not come through."""
    retry = Recovery(name="retry", time_s=1.0, odds=0.3, attempts=2, pause_s=0.0)
    assert recoveries.against("TimedOut") == recoveries.against("CommunicationFailure") == (retry,)
    assert [way.name for way in recoveries.against("SensorSilent")] == ["look_again", "retry_after_pause"]
    assert recoveries.against("SensorSilent")[1].pause_s > 0.0
    assert recoveries.against("Canceled") == ()
    assert MOST_ATTEMPTS == 10


@pytest.mark.parametrize(
    ("action_type", "number", "name", "failure"),
    [
        ("nav2_msgs/NavigateToPose", 9002, "TF_ERROR", "TransformMissing"),
        ("nav2_msgs/NavigateToPose", 208, "NO_VALID_PATH", "GoalUnreachable"),
        ("nav2_msgs/FollowPath", 104, "PATIENCE_EXCEEDED", "NavigationBlocked"),
        ("mbf_msgs/MoveBase", 11, "CANCELED", "Canceled"),
        ("mbf_msgs/ExePath", 103, "PAT_EXCEEDED", "TimedOut"),
        ("nav2_msgs/NavigateToPose", 4711, "4711", "UnknownFailure"),
        ("some_msgs/Other", 208, "208", "UnknownFailure"),
    ],
)
def test_a_number_is_known_by_its_action(
    action_type: str, number: int, name: str, failure: str, recoveries: Recoveries
) -> None:
    """The same number means other things elsewhere; what Nav2 passes on is known too."""
    assert recoveries.code_name(action_type, number) == name
    assert recoveries.failure_class(name, action_type) == failure


@pytest.mark.parametrize(
    ("failure", "is_of_robot"), [("TimedOut", True), ("RobotLost", True), ("RobotStuck", False), ("NotDetected", False)]
)
def test_what_concerns_the_robot_concerns_it_everywhere(
    failure: str, recoveries: Recoveries, *, is_of_robot: bool
) -> None:
    """The ontology says so of classes, for all below them."""
    assert recoveries.is_of_robot(failure) is is_of_robot
