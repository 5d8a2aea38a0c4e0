"""Goals end to end: what leads there is found out, planned and done; then it is so, as told and truly."""

from __future__ import annotations

import math

import pytest

from executive import Fleet, TaskStatus
from executive.replay import first_difference
from executive.trace import ActionStarted, FactsTold, GoalSolved, PlanMade, TaskAccepted
from kb.files import SHIPPED
from kb.store import Snapshot
from kb.terms import Struct
from planner.classical_operators import KNOWN
from planner.plan import PlanStatus
from tests.scenarios.conftest import ROBOTS

_THERE_M = 0.3
"""A robot that is so near to a place is there."""
_FOUND_M = 0.25
"""What is found is so near to where it was told to be, on the floor plan."""

_SLOW = pytest.mark.slow


def truly(fleet: Fleet, prop: str, subject: str, value: str) -> bool:
    """Whether a fact is so in the simulator, whatever anybody believes."""
    simulation, snapshot = fleet.parts.simulation, fleet.parts.knowledge.snapshot()
    if prop == "locatedAt":
        x_m, y_m, _ = simulation.true_pose(subject)
        at_m = [snapshot.ontology.value(p, value) for p in ("poseX_m", "poseY_m")]
        return math.dist((x_m, y_m), at_m) <= _THERE_M  # type: ignore[arg-type]
    assert (prop, value) == ("hasDetectedPosition", KNOWN)
    found = [e.value for e in fleet.trace if isinstance(e, FactsTold) and (e.prop, e.subject) == (prop, subject)]
    x_m, y_m, _ = simulation.true_position(subject)
    return isinstance(found[-1], list) and math.dist(found[-1][:2], (x_m, y_m)) <= _FOUND_M


def told(fleet: Fleet, prop: str, subject: str, value: str) -> bool:
    """Whether a fact is so for all that the robots have told."""
    snapshot: Snapshot = fleet.parts.knowledge.snapshot()
    if value == KNOWN:
        return any(isinstance(e, FactsTold) and (e.prop, e.subject) == (prop, subject) for e in fleet.trace)
    return snapshot.value(prop, subject) == value


@pytest.mark.parametrize(
    ("goal", "processes"),
    [
        pytest.param("locatedAt(pico_1)=at_dining_table", ["Navigate"], id="a robot at a place"),
        pytest.param("hasDetectedPosition(drink_1)", ["SearchDrink"], id="a drink found"),
        pytest.param(
            "locatedAt(amigo_1)=at_coffee_table, locatedAt(pico_1)=at_bar",
            ["Navigate", "Navigate"],
            marks=_SLOW,
            id="two robots at places",
        ),
        pytest.param(
            "hasDetectedPosition(drink_1) and hasDetectedPosition(drink_2)",
            ["SearchDrink", "SearchDrink"],
            marks=_SLOW,
            id="two drinks found",
        ),
        pytest.param(
            "hasDetectedPosition(drink_1), locatedAt(pico_1)=at_side_table",
            ["Navigate", "SearchDrink"],
            marks=_SLOW,
            id="a drink found and a robot elsewhere",
        ),
        pytest.param(
            "hasDetectedPosition(drink_2), locatedAt(amigo_1)=start_west, locatedAt(pico_1)=start_east",
            ["Navigate", "SearchDrink"],
            marks=_SLOW,
            id="a drink found and everybody back",
        ),
        pytest.param("not locatedAt(amigo_1)=start_west", ["Navigate"], marks=_SLOW, id="a robot anywhere else"),
    ],
)
def test_a_goal_is_reached(goal: str, processes: list[str]) -> None:
    """The plan is the fastest execution of what was found; at the end the goal is true, and nothing was touched."""
    with Fleet.open("tue_lab") as fleet:
        result = fleet.request_goal(goal).wait()
        assert result.status is TaskStatus.COMPLETED, result.reason
        assert result.goal is not None
        assert sorted(step.operator.process for step in result.goal.steps) == processes
        for condition in result.goal.goal.conditions:
            wanted = condition.functor == "holds"
            holds = condition if wanted else condition.args[0]
            assert isinstance(holds, Struct)
            fact = [str(argument) for argument in holds.args]
            assert told(fleet, *fact) is wanted
            assert truly(fleet, *fact) is wanted
        assert fleet.parts.simulation.collisions == 0
        [accepted] = [event for event in fleet.trace if isinstance(event, TaskAccepted)]
        [solved] = [event for event in fleet.trace if isinstance(event, GoalSolved)]
        [made] = [event for event in fleet.trace if isinstance(event, PlanMade)]
    assert accepted.goal == result.goal.goal.text
    assert made.status == PlanStatus.SOLVED_OPTIMALLY
    assert made.makespan_s == solved.makespan_s == result.goal.makespan_ms / 1000
    assert solved.lower_bound_s <= solved.makespan_s


def test_what_cannot_be_is_refused_before_anything_moves() -> None:
    """No process moves a drink; the reason says so."""
    with Fleet.open("tue_lab") as fleet:
        before = [fleet.parts.simulation.true_pose(robot) for robot in ROBOTS]
        result = fleet.request_goal("locatedAt(drink_1)=at_bar and locatedAt(amigo_1)=at_bar").wait()
        assert result.status is TaskStatus.REFUSED
        assert "locatedAt(drink_1) cannot become at_bar" in result.reason
        assert not [event for event in fleet.trace if isinstance(event, ActionStarted)]
        for robot, pose in zip(ROBOTS, before, strict=True):
            assert fleet.parts.simulation.true_pose(robot) == pytest.approx(pose, abs=1e-12)


@pytest.mark.slow
def test_what_is_told_already_is_not_done_again() -> None:
    """A drink that one task has found is known to the next goal, which ends with the time of planning."""
    with Fleet.open("tue_lab") as fleet:
        found = fleet.request(
            "SearchDrink", robot="pico_1", drink="drink_2", area="kitchen", location="at_dining_table"
        )
        again = fleet.request_goal("hasDetectedPosition(drink_2), locatedAt(pico_1)=at_dining_table")
        assert found.wait().status is TaskStatus.COMPLETED
        actions = sum(isinstance(event, ActionStarted) for event in fleet.trace)
        result = again.wait()
        assert (result.status, result.reason) == (TaskStatus.COMPLETED, "the goal holds already")
        assert sum(isinstance(event, ActionStarted) for event in fleet.trace) == actions


@pytest.mark.slow
def test_a_goal_replays_the_same() -> None:
    """Solving is repeatable: the same events come again, also of a goal that was canceled."""
    with Fleet.open("tue_lab") as fleet:
        canceled = fleet.request_goal("locatedAt(amigo_1)=at_bar")
        other = fleet.request_goal("locatedAt(pico_1)=at_dining_table")
        other.wait_until(0.25)
        canceled.cancel()
        other.wait()
        recorded = list(fleet.trace)
    assert first_difference(recorded, SHIPPED) == ""
