"""FindEmptyDrink end to end: ontology files in, moving robots and found drinks out ([RoboEarth] section 4)."""

from __future__ import annotations

import itertools
import math
import re
import statistics
from collections.abc import Iterator
from pathlib import Path

import pytest

from executive import Fleet, TaskStatus
from executive.trace import ActionStarted, narrate
from tests.scenarios.conftest import NO_KINECT, ROBOTS, Edit, Scored, run_scored

DETECTED_WITHIN_M = 0.25


@pytest.fixture(scope="module")
def first_run() -> Iterator[Scored]:
    """The default scenario, run once for the tests that only read its result."""
    with Fleet.open("tue_lab") as fleet:
        yield run_scored(fleet, robots=2)


def distance_to_truth(scored: Scored, drink: str) -> float:
    """How far the detected position of a drink is from the true one, on the floor plan."""
    found = scored.result.outputs["position"][drink].point
    x_m, y_m, _ = scored.fleet.parts.simulation.true_position(drink)
    return math.hypot(found.x - x_m, found.y - y_m)


def test_both_drinks_are_detected_near_their_true_positions(first_run: Scored) -> None:
    """Each drink is found within 0.25 m, and the robots touch nothing on the way."""
    assert first_run.result.status is TaskStatus.COMPLETED, first_run.result.reason
    assert set(first_run.result.outputs["position"]) == {"drink_1", "drink_2"}
    for drink in ("drink_1", "drink_2"):
        assert distance_to_truth(first_run, drink) <= DETECTED_WITHIN_M
    assert first_run.fleet.parts.simulation.collisions == 0


def test_robots_know_where_they_are_along_the_way(first_run: Scored) -> None:
    """Median localization error under 0.15 m and 5 degrees, against the simulator's truth."""
    assert len(first_run.errors_m) > 200
    assert statistics.median(first_run.errors_m) < 0.15
    assert statistics.median(first_run.errors_rad) < math.radians(5)


def test_the_trace_reads_as_in_the_paper(first_run: Scored) -> None:
    """`do [NavMap(amigo_1,"tue_lab")] at time ...`: both robots' actions, interleaved, every service in use."""
    lines = [line for line in narrate(first_run.fleet.trace) if line.startswith("do [")]
    assert re.fullmatch(r'do \[NavMap\(amigo_1,"tue_lab"\)\] at time \d+\.\d\d', lines[0])
    robots = [event.robot for event in first_run.fleet.trace if isinstance(event, ActionStarted)]
    changes = sum(one != other for one, other in itertools.pairwise(robots))
    assert changes > len(robots) / 4
    names = {line.split("[")[1].split("(")[0] for line in lines}
    assert names == {"NavMap", "LocMap", "Laser", "Pose", "Path", "VelCmd", "Base", "Kinect", "Detection"}


def test_each_robot_takes_the_drink_it_reaches_soonest_and_the_plan_is_proven(first_run: Scored) -> None:
    """Amigo starts in the west and Pico in the east; bound equals makespan."""
    assert (first_run.searcher("drink_1"), first_run.searcher("drink_2")) == ("amigo_1", "pico_1")
    assert first_run.plan.status == "SOLVED_OPTIMALLY"
    assert first_run.plan.lower_bound_s == first_run.plan.makespan_s
    assert "every other execution takes at least" in first_run.plan.reason


def test_swapped_starts_swap_the_assignment() -> None:
    """With the robots' start positions exchanged, each takes the other drink, and both find theirs."""
    with Fleet.open("tue_lab", scenario="swapped_starts") as fleet:
        scored = run_scored(fleet, robots=2)
        assert scored.result.status is TaskStatus.COMPLETED, scored.result.reason
        assert (scored.searcher("drink_1"), scored.searcher("drink_2")) == ("pico_1", "amigo_1")
        assert max(distance_to_truth(scored, drink) for drink in ("drink_1", "drink_2")) <= DETECTED_WITHIN_M


def test_both_drinks_near_one_robot_gives_the_least_makespan() -> None:
    """Amigo does both: a second robot makes no plan shorter, and the trace states the proof."""
    with Fleet.open("tue_lab", scenario="both_drinks_west") as fleet:
        alone, _ = fleet.plan("FindEmptyDrink", room="tue_lab", robots=1)
        scored = run_scored(fleet, robots=2)
        plan = scored.plan
        assert scored.result.status is TaskStatus.COMPLETED, scored.result.reason
        assert {scored.searcher("drink_1"), scored.searcher("drink_2")} == {"amigo_1"}
        assert plan.makespan_s == plan.lower_bound_s == alone.makespan_s
        ends_s = [end_s for *_, end_s in plan.steps]
        assert max(ends_s) == pytest.approx(plan.makespan_s + alone.made_at_s)


def test_without_its_kinect_amigo_sends_pico_to_both_drinks(knowledge: Path, edit: Edit) -> None:
    """One restriction removed from the class Amigo, and nothing else."""
    edit(knowledge / "robots" / "amigo.owl", NO_KINECT, "")
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        scored = run_scored(fleet, robots=2)
        assert scored.result.status is TaskStatus.COMPLETED, scored.result.reason
        assert {scored.searcher("drink_1"), scored.searcher("drink_2")} == {"pico_1"}
        assert max(distance_to_truth(scored, drink) for drink in ("drink_1", "drink_2")) <= DETECTED_WITHIN_M


def test_without_any_kinect_the_task_is_refused_before_anything_moves(knowledge: Path, edit: Edit) -> None:
    """The refusal names robots and missing capability; no service was called and no robot moved."""
    for robot in ("amigo", "pico"):
        edit(knowledge / "robots" / f"{robot}.owl", NO_KINECT, "")
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        before = [fleet.parts.simulation.true_pose(robot) for robot in ROBOTS]
        result = fleet.request("FindEmptyDrink", room="tue_lab", robots=2).wait()
        assert result.status is TaskStatus.REFUSED
        for robot in ROBOTS:
            assert (
                f"{robot} cannot do Kinect or SearchDrink: it is no RobotWithKinect (hasSensor some Kinect)"
                in result.reason
            )
        assert not [event for event in fleet.trace if isinstance(event, ActionStarted)]
        for robot, pose in zip(ROBOTS, before, strict=True):
            assert fleet.parts.simulation.true_pose(robot) == pytest.approx(pose, abs=1e-12)
