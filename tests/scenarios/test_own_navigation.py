"""Robots that drive by their own navigation: one goal of a ROS action in place of a loop of six services."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from executive import Fleet, TaskStatus
from executive.cli import main
from executive.trace import ActionFinished, ActionStarted, Replanned
from grounding.errors import GroundingError
from planner.plan import PlanStatus
from tests.scenarios.conftest import Edit
from tests.scenarios.own_navigation import give_own_navigation
from tests.scenarios.test_doors import deliver, is_served, planned
from tests.scenarios.test_over_rosbridge import served

ACTION = "/runner_1/navigate_to_pose"


def called(fleet: Fleet, robot: str) -> set[str]:
    """Services and actions that were called for a robot."""
    return {event.service for event in fleet.trace if isinstance(event, ActionStarted) and event.robot == robot}


def test_a_delivery_by_goals(knowledge: Path) -> None:
    """The robot that can is given goals, and gets there; what it says of where it is, is known."""
    give_own_navigation(knowledge, "Runner")
    with Fleet.open("ward", knowledge=knowledge) as fleet:
        result = deliver(fleet)
        assert result.status is TaskStatus.COMPLETED, result.reason
        assert planned(fleet) == [
            ("DriveToPose", "runner_1"),
            ("Load", "runner_1"),
            ("DriveToPose", "runner_1"),
            ("Unload", "runner_1"),
        ]
        assert is_served(fleet)
        assert called(fleet, "runner_1") == {ACTION, "/runner_1/load", "/runner_1/unload"}
        [use] = [use for use in fleet.metrics.uses() if use.service == ACTION]
        assert (use.calls, use.failed) == (2, 0)
        assert use.request_bytes > 0


def test_where_the_goal_takes_longer_the_loop_is_taken(knowledge: Path, edit: Edit) -> None:
    """Both ways are open; cost decides."""
    give_own_navigation(knowledge, "Runner", "Porter")
    seconds = '<core:duration_s rdf:datatype="http://www.w3.org/2001/XMLSchema#double">{}</core:duration_s>'
    edit(knowledge / "tasks" / "own_navigation.owl", seconds.format("0.5"), seconds.format("9.5"))
    with Fleet.open("ward", knowledge=knowledge) as fleet:
        plan, _ = fleet.plan("Deliver", area="ward", thing="meal_1", to="at_bed_1")
        assert plan.status is PlanStatus.SOLVED_OPTIMALLY
        assert {step.action.process for step in plan.steps} == {"Navigate", "Load", "Unload"}


def test_who_has_none_drives_by_the_loop() -> None:
    """The second recipe is known, but no robot of the ward as it is shipped is capable of it."""
    with Fleet.open("ward") as fleet:
        plan, _ = fleet.plan("Deliver", area="ward", thing="meal_1", to="at_bed_1")
        assert plan.status is PlanStatus.SOLVED_OPTIMALLY
        assert {step.action.process for step in plan.steps} == {"Navigate", "Load", "Unload"}


def test_a_canceled_task_stops_its_robot(knowledge: Path) -> None:
    """The goal is canceled at the robot, which stands still soon; it can be asked for something else at once."""
    give_own_navigation(knowledge, "Runner")
    with Fleet.open("ward", knowledge=knowledge) as fleet:
        task = fleet.request("Deliver", area="ward", thing="meal_1", to="at_bed_1")
        start = fleet.parts.simulation.true_pose("runner_1")
        fleet.let_time_pass(3.0)
        task.cancel()
        fleet.let_time_pass(1.0)
        there = fleet.parts.simulation.true_pose("runner_1")
        fleet.let_time_pass(2.0)
        assert math.dist(start[:2], there[:2]) > 0.1, "it was on its way"
        assert math.dist(there[:2], fleet.parts.simulation.true_pose("runner_1")[:2]) < 0.01
        assert task.status is TaskStatus.CANCELED
        again = deliver(fleet)
        assert again.status is TaskStatus.COMPLETED, again.reason
        assert is_served(fleet)


FAULTS = """
[faults.goal]
service = "/runner_1/navigate_to_pose"
kind = "{kind}"
calls = [1]
code = "{code}"
"""


@pytest.mark.parametrize(
    ("kind", "code", "outcome"), [("fail", "PATIENCE_EXCEEDED", "EXECUTION_FAILED"), ("hang", "-", "TIMED_OUT")]
)
def test_a_goal_that_fails_is_recovered_from(
    kind: str, code: str, outcome: str, knowledge: Path, edit: Edit, tmp_path: Path
) -> None:
    """It fails, or nothing is heard of it: it is given again, as the ontology of failures says that it may help."""
    give_own_navigation(knowledge, "Runner")
    limit = '<core:timeout_s rdf:datatype="http://www.w3.org/2001/XMLSchema#double">{}</core:timeout_s>'
    edit(knowledge / "tasks" / "own_navigation.owl", limit.format("180.0"), limit.format("15.0"))
    faults = tmp_path / "faults.toml"
    faults.write_text(FAULTS.format(kind=kind, code=code), encoding="utf-8")
    with Fleet.open("ward", knowledge=knowledge, faults=faults) as fleet:
        result = deliver(fleet)
        assert result.status is TaskStatus.COMPLETED, result.reason
        assert is_served(fleet)
        failed = [e for e in fleet.trace if isinstance(e, ActionFinished) and e.failure]
        assert [event.outcome for event in failed] == [outcome]


@pytest.mark.slow
def test_where_goals_fail_for_good_the_robot_drives_by_the_loop(knowledge: Path, tmp_path: Path) -> None:
    """The other recipe of the same task type, by the same robot, as it has the meal."""
    give_own_navigation(knowledge, "Runner")
    faults = tmp_path / "faults.toml"
    later = FAULTS.format(kind="fail", code="NO_VALID_PATH").replace("[1]", "[2, 3, 4, 5, 6, 7, 8]")
    faults.write_text(later, encoding="utf-8")
    with Fleet.open("ward", knowledge=knowledge, faults=faults) as fleet:
        result = deliver(fleet)
        assert result.status is TaskStatus.COMPLETED, result.reason
        assert is_served(fleet)
        drives = [e.robot for e in fleet.trace if isinstance(e, ActionFinished) and e.action.startswith("Base(")]
        assert set(drives) == {"runner_1"}
        assert any("DriveToPose is not tried again" in e.reason for e in fleet.trace if isinstance(e, Replanned))


@pytest.mark.slow
def test_goals_go_over_rosbridge_too(knowledge: Path) -> None:
    """The simulated robots are in another process; time is real."""
    give_own_navigation(knowledge, "Runner")
    options = ("--site", "ward", "--knowledge", str(knowledge))
    with served(*options) as port:
        address = f"ws://127.0.0.1:{port}"
        with Fleet.open("ward", knowledge=knowledge, connect=address) as fleet:
            result = deliver(fleet)
            assert result.status is TaskStatus.COMPLETED, result.reason
            assert called(fleet, "runner_1") == {ACTION, "/runner_1/load", "/runner_1/unload"}
            [use] = [use for use in fleet.metrics.uses() if use.service == ACTION]
            assert (use.calls, use.failed) == (2, 0)


def test_an_action_that_a_robot_does_not_offer_is_told_at_once(knowledge: Path, edit: Edit) -> None:
    """Of the robots that are capable; nobody gives goals to the others."""
    edit(knowledge / "tasks" / "own_navigation.owl", "/{robot}/navigate_to_pose", "/{robot}/move_base")
    with Fleet.open("ward", knowledge=knowledge):
        pass
    give_own_navigation(knowledge, "Runner")
    with pytest.raises(GroundingError, match="runner_1 offers no action /runner_1/move_base"):
        Fleet.open("ward", knowledge=knowledge)


def test_what_a_robot_must_offer_tells_of_its_actions(knowledge: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With their type; again only where the robot is capable."""
    give_own_navigation(knowledge, "Runner")
    for robot, told in (("runner_1", True), ("porter_1", False)):
        assert main(["kb", "services", robot, "--site", "ward", "--knowledge", str(knowledge)]) == 0
        line = f"# /{robot}/navigate_to_pose: NavigateToPose, an action of type nav2_msgs/NavigateToPose\n"
        assert (line in capsys.readouterr().out) is told
