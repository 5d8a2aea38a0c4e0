"""When something goes wrong: another robot, another path, or the true reason; never silence."""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path

import pytest

from executive import Fleet, TaskStatus
from executive.trace import ActionFinished, ActionStarted, PlanMade, ProcessBegun, Replanned
from grounding.inprocess import Service
from kb.errors import ServiceFailed
from tests.scenarios.conftest import ROBOTS, run_scored


def failing(fields: Mapping[str, object]) -> Mapping[str, object]:
    """A service that is broken."""
    raise ServiceFailed("DeviceBroken", "it does not answer")


def mute(fields: Mapping[str, object]) -> Mapping[str, object]:
    """A service whose reply holds nothing."""
    return {}


def finished(fleet: Fleet, process: str) -> list[ActionFinished]:
    """How the actions of a process ended."""
    return [e for e in fleet.trace if isinstance(e, ActionFinished) and e.action.startswith(f"{process}(")]


def test_a_broken_robot_is_made_up_for_by_the_other() -> None:
    """Amigo's laser fails before it has moved: Pico detects both drinks, and the trace says why."""
    with Fleet.open("tue_lab") as fleet:
        fleet.parts.transport.offer("/amigo_1/laser", Service(handler=failing, latency_s=0.1))
        scored = run_scored(fleet)
        assert scored.result.status is TaskStatus.COMPLETED, scored.result.reason
        assert [e.robot for e in finished(fleet, "Detection")] == ["pico_1", "pico_1"]
        [anew] = [e for e in fleet.trace if isinstance(e, Replanned)]
        assert "DeviceBroken, it does not answer" in anew.reason
        assert "amigo_1 is not tried again" in anew.reason
        rest = list(fleet.trace)[list(fleet.trace).index(anew) :]
        plan_made = next(n for n, event in enumerate(rest) if isinstance(event, PlanMade))
        begun = [e.process for e in rest[:plan_made] if isinstance(e, ProcessBegun)]
        assert not [process for process in begun if process.startswith("SearchDrink")]  # not before there is a plan


@pytest.mark.slow
def test_a_place_that_stays_taken_is_given_up_after_the_grace_time() -> None:
    """Amigo stays where its camera failed, so Pico cannot get there: the task ends, saying that it took too long."""
    with Fleet.open("tue_lab") as fleet:
        fleet.parts.transport.offer("/amigo_1/kinect", Service(handler=failing, latency_s=0.1))
        scored = run_scored(fleet)
        assert scored.result.status is TaskStatus.FAILED
        assert 'TookTooLong, Navigate(pico_1,"tue_lab","at_coffee_table") has not ended after' in scored.result.reason
        assert fleet.parts.simulation.collisions == 0


@pytest.mark.parametrize(
    ("service", "told"),
    [
        (Service(handler=failing, latency_s=0.1), "EXECUTION_FAILED: DeviceBroken, it does not answer"),
        (
            Service(handler=mute, latency_s=0.1),
            "POSTCONDITION_FAILED: BadReply, Kinect, field camera_info: the reply of /pico_1/kinect lacks it",
        ),
        (Service(handler=failing, latency_s=60.0), "TIMED_OUT: NoReply, /pico_1/kinect did not reply within 2 s"),
    ],
)
def test_when_no_robot_is_left_the_task_fails_with_the_true_reason(service: Service, told: str) -> None:
    """The only robot asked for has a camera that fails, replies with nothing, or hangs: the task says so."""
    with Fleet.open("tue_lab") as fleet:
        fleet.parts.transport.offer("/pico_1/kinect", service)
        result = fleet.request(
            "SearchDrink", robot="pico_1", drink="drink_2", area="tue_lab", location="at_dining_table"
        ).wait()
        assert result.status is TaskStatus.FAILED
        assert f"Kinect(pico_1) {told}" in result.reason
        assert "there is no other way to do it" in result.reason


def scenario_with(tmp_path: Path, old: str, new: str) -> Path:
    """The default scenario with one text replaced."""
    text = files("sim").joinpath("scenarios/tue_lab.toml").read_text(encoding="utf-8")
    assert text.count(old) == 1
    scenario = tmp_path / "changed.toml"
    scenario.write_text(text.replace(old, new), encoding="utf-8")
    return scenario


def test_a_drink_that_is_not_there_is_reported(tmp_path: Path) -> None:
    """drink_1 is in truth on the side table: the task fails, and says from where it was not seen."""
    scenario = scenario_with(tmp_path, "position = [2.5, 6.0, 0.45]", "position = [4.4, 0.7, 0.55]")
    with Fleet.open("tue_lab", scenario=scenario) as fleet:
        result = fleet.request("FindEmptyDrink", room="living_room", robots=1).wait()
        assert result.status is TaskStatus.FAILED
        assert re.search(r"ObjectNotFound, no Beer in the picture taken at \(2\.[56]\d, 4\.[89]\d\)", result.reason)
        assert not result.outputs["position"]


def test_a_blocked_way_is_driven_around(tmp_path: Path) -> None:
    """Behind the wall stands a crate that no map knows: Amigo meets it, asks for another path, and gets there."""
    crate = """
[furniture.crate]
shape = "solid"
center_m = [6.2, 2.0]
size_m = [0.5, 0.3]
height_m = 0.8
color = [0.5, 0.45, 0.4]
"""
    world = files("sim").joinpath("worlds/tue_lab.toml").read_text(encoding="utf-8")
    (tmp_path / "crated.toml").write_text(world + crate, encoding="utf-8")
    scenario = scenario_with(tmp_path, 'world = "tue_lab"', 'world = "crated.toml"')
    with Fleet.open("tue_lab", scenario=scenario) as fleet:
        task = fleet.request("Navigate", robot="amigo_1", area="tue_lab", location="at_bar")
        result = task.wait()
        assert result.status is TaskStatus.COMPLETED, result.reason
        assert len(finished(fleet, "Path")) > 1
        assert fleet.parts.simulation.collisions == 0


def test_a_subtask_can_be_asked_for_by_itself() -> None:
    """Navigate is a task type like any other: Amigo drives through the doorway into the kitchen."""
    with Fleet.open("tue_lab") as fleet:
        task = fleet.request("Navigate", robot="amigo_1", area="tue_lab", location="at_bar")
        assert task.wait().status is TaskStatus.COMPLETED
        x_m, y_m, _ = fleet.parts.simulation.true_pose("amigo_1")
        assert (x_m, y_m) == pytest.approx((7.5, 1.5), abs=0.1)
        assert fleet.parts.simulation.collisions == 0


def test_cancel_ends_the_task_and_the_robots_stand_still_soon() -> None:
    """After a cancel no service is called, the bases' watchdogs stop them within 0.5 s, and the next task runs."""
    with Fleet.open("tue_lab") as fleet:
        simulation = fleet.parts.simulation
        task = fleet.request("FindEmptyDrink", room="tue_lab")
        assert task.wait_until(3.0) is None
        task.cancel()
        assert task.wait().status is TaskStatus.CANCELED
        calls = len([e for e in fleet.trace if isinstance(e, ActionStarted)])
        fleet.parts.clock.call_at(5.0, lambda: None)
        fleet.parts.clock.run_until(lambda: fleet.now_s >= 5.0)
        stopped = [simulation.true_pose(robot) for robot in ROBOTS]
        fleet.parts.clock.call_at(6.0, lambda: None)
        fleet.parts.clock.run_until(lambda: fleet.now_s >= 6.0)
        assert [simulation.true_pose(robot) for robot in ROBOTS] == stopped
        assert len([e for e in fleet.trace if isinstance(e, ActionStarted)]) == calls
        task.cancel()
        assert fleet.request("FindEmptyDrink", room="kitchen").wait().status is TaskStatus.COMPLETED


def test_a_second_task_waits_for_the_first_and_says_so() -> None:
    """Tasks are done in order; a queued one may be canceled without disturbing the other."""
    with Fleet.open("tue_lab") as fleet:
        first = fleet.request("FindEmptyDrink", room="kitchen")
        second = fleet.request("FindEmptyDrink", room="living_room")
        third = fleet.request("FindEmptyDrink", room="tue_lab")
        assert second.status is TaskStatus.QUEUED
        third.cancel()
        assert third.status is TaskStatus.CANCELED
        assert second.wait().status is TaskStatus.COMPLETED
        assert first.status is TaskStatus.COMPLETED
