"""Stage 8: replies into outcomes, as their groundings say."""

from __future__ import annotations

import pytest

from grounding.errors import GroundingError
from grounding.messages import Twist, Vector3, pose_stamped
from grounding.outcome import OutcomeStatus, interpret, refused, timed_out
from grounding.transport import ServiceCall, ServiceReply
from kb.groundings import Field, Grounding


def field(name: str, message_type: str, parameter: str | None) -> Field:
    """A field of a reply."""
    return Field(
        name=name,
        message_type=message_type,
        parameter=parameter,
        of_property=None,
        kind_of=False,
        file=None,
        optional=False,
    )


GROUNDING = Grounding(
    name="vel_cmd_grounding",
    process="VelCmd",
    service="/compute/vel_cmd",
    on_robot=False,
    timeout_s=1.0,
    duration_s=0.002,
    request=(),
    reply=(
        field("arrived", "bool", "arrived"),
        field("distance", "float64", None),
        field("velocity", "geometry_msgs/Twist", "speed"),
    ),
)
ZERO = Vector3(x=0.0, y=0.0, z=0.0)
TWIST = Twist(linear=ZERO, angular=ZERO)
GOOD: dict[str, object] = {"arrived": False, "distance": 1.5, "velocity": TWIST}


def reply(fields: dict[str, object], *, failure: str = "", reason: str = "") -> ServiceReply:
    """A reply."""
    return ServiceReply(call_id=3, fields=fields, failure=failure, reason=reason)


def test_fields_become_the_parameters_that_they_map_to() -> None:
    """What maps to none is checked and left out; what is false is not taken for missing."""
    outcome = interpret(reply(GOOD), GROUNDING, service="/compute/vel_cmd", elapsed_s=0.25)
    assert outcome.succeeded
    assert outcome.outputs == {"arrived": False, "speed": TWIST}
    assert (outcome.failure, outcome.reason, outcome.elapsed_s) == ("", "", 0.25)


def test_fields_beyond_the_grounding_are_left_alone() -> None:
    """A service may tell more than is asked of it."""
    outcome = interpret(reply({**GOOD, "mood": "calm"}), GROUNDING, service="/compute/vel_cmd", elapsed_s=0.25)
    assert outcome.succeeded
    assert "mood" not in outcome.outputs


@pytest.mark.parametrize("name", GOOD)
def test_a_missing_field_is_named(name: str) -> None:
    """Whether it maps to a parameter or not; no output is taken from the rest."""
    fields = {n: value for n, value in GOOD.items() if n != name}
    outcome = interpret(reply(fields), GROUNDING, service="/compute/vel_cmd", elapsed_s=0.25)
    assert (outcome.status, outcome.failure) == (OutcomeStatus.POSTCONDITION_FAILED, "BadReply")
    assert outcome.reason == f"VelCmd, field {name}: the reply of /compute/vel_cmd lacks it"
    assert (outcome.outputs, outcome.elapsed_s, outcome.succeeded) == ({}, 0.25, False)


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("arrived", 1, "is int, not bool"),
        ("arrived", None, "is NoneType, not bool"),
        ("distance", True, "is bool, not float64"),
        ("velocity", pose_stamped(0.0, 0.0, 0.0, t_s=0.0), "is geometry_msgs/PoseStamped, not geometry_msgs/Twist"),
        ("velocity", Twist(linear=ZERO, angular=Vector3(x=0.0, y="", z=0.0)), ".angular.y is str, not float64"),  # type: ignore[arg-type]
    ],
)
def test_a_value_of_the_wrong_type_is_named(name: str, value: object, told: str) -> None:
    """With its path within the message."""
    outcome = interpret(reply({**GOOD, name: value}), GROUNDING, service="/r1/x", elapsed_s=0.25)
    assert (outcome.status, outcome.failure) == (OutcomeStatus.POSTCONDITION_FAILED, "BadReply")
    assert outcome.reason == f"VelCmd, field {name}: the reply of /r1/x: {told}"
    assert outcome.outputs == {}


def test_a_failure_is_passed_on_without_its_fields() -> None:
    """Its class and reason are the service's own."""
    failed = reply(GOOD, failure="NoPath", reason="walled in")
    outcome = interpret(failed, GROUNDING, service="/compute/vel_cmd", elapsed_s=0.25)
    assert (outcome.status, outcome.failure, outcome.reason) == (OutcomeStatus.EXECUTION_FAILED, "NoPath", "walled in")
    assert (outcome.outputs, outcome.elapsed_s) == ({}, 0.25)


def test_what_cannot_be_called_is_refused() -> None:
    """The reason is the grounding's error; no time has passed."""
    outcome = refused(GroundingError("VelCmd", "scan", "is missing"))
    assert (outcome.status, outcome.failure, outcome.elapsed_s) == (OutcomeStatus.REFUSED, "NotGrounded", 0.0)
    assert outcome.reason == "VelCmd, field scan: is missing"
    assert not outcome.succeeded


def test_what_does_not_reply_has_timed_out() -> None:
    """After as long as the call was given."""
    outcome = timed_out(ServiceCall(id=1, service="/r1/laser", fields={}, timeout_s=2.5))
    assert (outcome.status, outcome.failure, outcome.elapsed_s) == (OutcomeStatus.TIMED_OUT, "NoReply", 2.5)
    assert outcome.reason == "/r1/laser did not reply within 2.5 s"


def test_no_status_but_success_counts_as_one() -> None:
    """All others are told by their names."""
    assert [status for status in OutcomeStatus if status is OutcomeStatus.SUCCEEDED] == [OutcomeStatus.SUCCEEDED]
    assert all(status.value == status.name for status in OutcomeStatus)


@pytest.mark.parametrize(
    ("failure", "status"), [("Lost", OutcomeStatus.LOST), ("BadReply", OutcomeStatus.POSTCONDITION_FAILED)]
)
def test_failures_of_the_transport_have_a_status_of_their_own(failure: str, status: OutcomeStatus) -> None:
    """They say nothing about what the service did."""
    outcome = interpret(
        reply({}, failure=failure, reason="gone"), GROUNDING, service="/compute/vel_cmd", elapsed_s=0.25
    )
    assert (outcome.status, outcome.failure, outcome.reason) == (status, failure, "gone")
