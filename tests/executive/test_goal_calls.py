"""Goals that the executive sends: what becomes of them, in time, late, canceled, or never."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from executive.events import Event, GoalHasEnded, GoalWasSent
from executive.goal_calls import CANCEL_S, GoalCalls
from grounding.actions import GoalHandle, GoalStatus
from grounding.faults import Fault, FaultKind, FaultyTransport
from grounding.inprocess import InProcessTransport
from grounding.messages import pose_stamped
from grounding.outcome import Outcome
from grounding.transport import ServiceCall
from kb.clock import SimClock
from kb.groundings import Field, Grounding
from kb.recoveries import Recoveries
from kb.store import Snapshot

ACTION = "/r1/navigate_to_pose"
HERE = pose_stamped(1.0, 2.0, 0.0, t_s=0.0)
GROUNDING = Grounding(
    name="Drive_action",
    process="Drive",
    service="/{robot}/navigate_to_pose",
    on_robot=True,
    timeout_s=10.0,
    duration_s=1.0,
    request=(),
    reply=(
        Field(
            name="current_pose",
            message_type="geometry_msgs/PoseStamped",
            parameter="pose",
            of_property=None,
            kind_of=False,
            file=None,
            optional=False,
        ),
    ),
    action_type="nav2_msgs/NavigateToPose",
)


@pytest.fixture(scope="module")
def recoveries(snapshot: Snapshot) -> Recoveries:
    """Of the shipped site."""
    return Recoveries(snapshot.ontology)


class Trial:
    """One goal, its robot, and all that was told of it."""

    def __init__(self, recoveries: Recoveries, *faults: Fault) -> None:
        self.clock, self.posted, self.goals = SimClock(), list[Event](), list[GoalHandle]()
        self.came: list[tuple[float, Outcome]] = []
        transport = InProcessTransport(self.clock)
        transport.offer_action(ACTION, self.goals.append)
        faulty = FaultyTransport(transport, self.clock, faults, np.random.default_rng(1))
        self.calls = GoalCalls(faulty, self.clock, self.posted.append)
        call = ServiceCall(id=1, service=ACTION, fields={}, timeout_s=GROUNDING.timeout_s)
        self.calls.send(call, GROUNDING, recoveries, self._note)

    def _note(self, outcome: Outcome, fields: Mapping[str, object]) -> None:
        self.came.append((self.clock.now_s, outcome))

    @property
    def goal(self) -> GoalHandle:
        """As the robot sees it."""
        return self.goals[0]

    def later(self, t_s: float, status: GoalStatus, code: int = 0) -> None:
        """Have the robot end the goal at a time."""
        result = {"error_code": code, "error_msg": "no way" if code else ""}
        self.clock.call_at(t_s, lambda: self.goal.end(status, result))

    def end(self) -> None:
        """Let all happen."""
        assert not self.clock.run_until(lambda: False)


def test_a_goal_that_succeeds_gives_what_result_and_feedback_tell(recoveries: Recoveries) -> None:
    """Outputs that no result has are in the last feedback."""
    trial = Trial(recoveries)
    trial.goal.feed({"current_pose": HERE, "distance_remaining": 2.5})
    trial.later(4.0, GoalStatus.SUCCEEDED)
    trial.end()
    [(t_s, outcome)] = trial.came
    assert (t_s, outcome.succeeded, outcome.elapsed_s) == (4.0, True, 4.0)
    assert outcome.outputs == {"pose": HERE}
    assert trial.posted == [GoalWasSent(number=1)]


@pytest.mark.parametrize(
    ("code", "failure", "reason"),
    [
        (208, "NO_VALID_PATH", "nav2_msgs/NavigateToPose 208: no way; distance_remaining was 2.5"),
        (0, "GoalFailed", "/r1/navigate_to_pose ended with status 6, ABORTED; distance_remaining was 2.5"),
    ],
)
def test_a_result_code_is_the_failure(code: int, failure: str, reason: str, recoveries: Recoveries) -> None:
    """By its name; without one, the status tells what there is to tell."""
    trial = Trial(recoveries)
    trial.goal.feed({"current_pose": HERE, "distance_remaining": 2.5})
    trial.later(4.0, GoalStatus.ABORTED, code)
    trial.end()
    [(_, outcome)] = trial.came
    assert (outcome.status, outcome.failure, outcome.reason) == ("EXECUTION_FAILED", failure, reason)


def test_a_goal_whose_time_is_over_is_canceled_and_times_out_when_its_robot_has_stopped(recoveries: Recoveries) -> None:
    """It takes the robot a second to stop."""
    trial = Trial(recoveries)
    trial.goal.canceled = lambda: trial.later(trial.clock.now_s + 1.0, GoalStatus.CANCELED)
    trial.end()
    [(t_s, outcome)] = trial.came
    assert (t_s, outcome.status) == (GROUNDING.timeout_s + 1.0, "TIMED_OUT")


def test_a_goal_of_which_nothing_is_heard_any_more_times_out(recoveries: Recoveries) -> None:
    """After its time, and the time that it has to end; what comes after that changes nothing."""
    trial = Trial(recoveries)
    trial.later(GROUNDING.timeout_s + CANCEL_S + 1.0, GoalStatus.SUCCEEDED)
    trial.end()
    [(t_s, outcome)] = trial.came
    assert (t_s, outcome.status) == (GROUNDING.timeout_s + CANCEL_S, "TIMED_OUT")


def test_a_goal_that_arrives_while_it_is_canceled_for_its_time_has_succeeded(recoveries: Recoveries) -> None:
    """The robot was there already."""
    trial = Trial(recoveries)
    trial.goal.feed({"current_pose": HERE})
    trial.later(GROUNDING.timeout_s + 0.5, GoalStatus.SUCCEEDED)
    trial.end()
    assert [outcome.succeeded for _, outcome in trial.came] == [True]


@pytest.mark.parametrize("ends_s", [3.5, None])
def test_a_canceled_goal_is_told_to_have_ended_once(ends_s: float | None, recoveries: Recoveries) -> None:
    """When its robot says so, or has said nothing for too long; there is no outcome, as nobody wants one."""
    trial = Trial(recoveries)
    if ends_s is not None:
        trial.later(ends_s, GoalStatus.CANCELED)
    told: list[float] = []
    trial.clock.call_at(3.0, lambda: trial.calls.cancel(1))
    trial.clock.call_at(3.1, lambda: trial.calls.cancel(1))
    trial.clock.call_at(3.4, lambda: told.append(len(trial.posted)))
    trial.end()
    assert told == [1]
    assert trial.posted == [GoalWasSent(number=1), GoalHasEnded(number=1)]
    assert trial.came == []


def test_a_goal_that_has_ended_is_canceled_at_once(recoveries: Recoveries) -> None:
    """Who waits for its robot need not wait."""
    trial = Trial(recoveries)
    trial.later(1.0, GoalStatus.ABORTED)
    trial.end()
    trial.calls.cancel(1)
    assert trial.posted[-1] == GoalHasEnded(number=1)


@pytest.mark.parametrize(
    ("kind", "status", "t_s"),
    [(FaultKind.FAIL, "LOST", 0.0), (FaultKind.HANG, "TIMED_OUT", GROUNDING.timeout_s + CANCEL_S)],
)
def test_a_robot_that_is_gone_is_an_outcome(kind: FaultKind, status: str, t_s: float, recoveries: Recoveries) -> None:
    """Its connection tells at once; silence only in time."""
    trial = Trial(recoveries, Fault(service=ACTION, kind=kind, code="Lost"))
    trial.end()
    assert [(came_s, outcome.status) for came_s, outcome in trial.came] == [(t_s, status)]
