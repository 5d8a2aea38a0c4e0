"""The executive and robots in another process, over rosbridge, in real time."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from executive import Fleet, TaskResult, TaskStatus, connecting
from executive.cli import main
from executive.connecting import NotConnected
from executive.errors import BadRequest
from executive.trace import (
    ActionFinished,
    ActionStarted,
    FactsTold,
    FleetOpened,
    PlanMade,
    RecoveryChosen,
    TraceEvent,
)
from grounding.errors import GroundingError
from tests.scenarios.conftest import ROBOTS, Edit
from tests.scenarios.relay import Relay

SAME_PLACE_M = 0.1
LONGEST_CYCLE = 8
LASER = Path("tasks") / "groundings.owl"
"""The file in which the laser's service is named."""


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    """Where the simulated robots are, in a process of their own; each test finds them where the last one left them."""
    with served() as port:
        yield port


@contextmanager
def served(*options: str, environment: Mapping[str, str] | None = None) -> Iterator[int]:
    """The simulated robots of the lab, where they start; their port."""
    command = [sys.executable, "-m", "executive.cli", "simulate", "--port", "0", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as server:
        try:
            assert server.stdout is not None
            told = next(line for line in server.stdout if line.startswith("serving at "))
            yield int(re.findall(r":(\d+) ", told)[0])
        finally:
            server.terminate()


def found(trace: Sequence[TraceEvent]) -> dict[str, list[str]]:
    """What each robot did, in order; of what it did again and again, such as the cycle by which it drives, one turn."""
    return {
        robot: once([e.action for e in trace if isinstance(e, ActionStarted) and e.robot == robot]) for robot in ROBOTS
    }


def once(actions: list[str]) -> list[str]:
    """A sequence of actions without the repetitions in it."""
    for size in range(LONGEST_CYCLE, 0, -1):
        at = 0
        while at + 2 * size <= len(actions):
            if actions[at : at + size] == actions[at + size : at + 2 * size]:
                del actions[at : at + size]
            else:
                at += 1
    return actions


def both_found(fleet: Fleet) -> tuple[TaskResult, list[TraceEvent]]:
    """The drinks of the whole lab, found with both robots."""
    result = fleet.request("FindEmptyDrink", room="tue_lab", robots=2).wait()
    assert result.status is TaskStatus.COMPLETED, result.reason
    return result, list(fleet.trace)


@pytest.mark.slow
def test_a_task_is_the_same_over_rosbridge(tmp_path: Path) -> None:
    """Assignment, actions and what is found; only times differ. One robot speaks CBOR and one text."""
    with Fleet.open("tue_lab") as fleet:
        there, trace = both_found(fleet)
    with served() as port:
        file = tmp_path / "robots.toml"
        binary, text = (f'[robots.{robot}]\nuri = "ws://127.0.0.1:{port}"\n' for robot in ROBOTS)
        file.write_text(f"{binary}binary = true\n{text}")
        with Fleet.open("tue_lab", connect=file, seed=3) as fleet:
            remote, remote_trace = both_found(fleet)
    assert found(remote_trace) == found(trace)
    plan, remote_plan = (next(e for e in events if isinstance(e, PlanMade)) for events in (trace, remote_trace))
    assert [step[:2] for step in remote_plan.steps] == [step[:2] for step in plan.steps]
    assert remote_plan.makespan_s == pytest.approx(plan.makespan_s, abs=0.01)
    for drink, position in there.outputs["position"].items():
        other = remote.outputs["position"][drink].point
        assert math.dist((position.point.x, position.point.y), (other.x, other.y)) < SAME_PLACE_M
    opened = remote_trace[0]
    assert isinstance(opened, FleetOpened)
    assert (opened.connect, opened.scenario, opened.seed) == (str(file), "", 3)


@pytest.mark.slow
def test_the_work_of_a_robot_whose_connection_breaks_is_taken_over(tmp_path: Path) -> None:
    """What was under way counts as lost, and the reason is told; the other robot does the rest."""
    with served() as port, Relay(port) as relay:
        file = tmp_path / "robots.toml"
        amigo, pico = f"ws://127.0.0.1:{relay.port}", f"ws://127.0.0.1:{port}"
        file.write_text(f'[robots.amigo_1]\nuri = "{amigo}"\n[robots.pico_1]\nuri = "{pico}"\n')
        with Fleet.open("tue_lab", connect=file) as fleet:
            task = fleet.request("FindEmptyDrink", room="tue_lab")
            assert task.wait_until(fleet.now_s + 2.0) is None
            relay.cut()
            result = task.wait()
            ended = [e for e in fleet.trace if isinstance(e, ActionFinished)]
    assert result.status is TaskStatus.COMPLETED, result.reason
    assert set(result.outputs["position"]) == {"drink_1", "drink_2"}
    failed = {(e.robot, e.outcome, e.failure) for e in ended if e.failure}
    assert failed == {("amigo_1", "LOST", "Lost")}
    assert {e.robot for e in ended if e.action.startswith("Kinect(")} == {"pico_1"}


def test_a_robot_whose_connection_comes_again_goes_on(tmp_path: Path) -> None:
    """Nobody else can do it: what was lost is tried again until it is there, and then it can be planned with again."""
    with served() as port, Relay(port) as relay, Fleet.open("tue_lab", connect=f"ws://127.0.0.1:{relay.port}") as fleet:
        relay.cut()
        task = fleet.request("Localize", robot="pico_1", area="tue_lab")
        assert task.wait_until(fleet.now_s + 1.0) is None
        assert fleet.known_at(fleet.now_s)["isReachable", "pico_1"] is False
        relay.mend()
        result = task.wait()
        ended = [e for e in fleet.trace if isinstance(e, ActionFinished) and e.failure]
        chosen = [e.recovery for e in fleet.trace if isinstance(e, RecoveryChosen)]
        again = fleet.request("Localize", robot="pico_1", area="tue_lab").wait()
        told = [(e.value, e.source) for e in fleet.trace if isinstance(e, FactsTold) and e.prop == "isReachable"]
    assert result.status is again.status is TaskStatus.COMPLETED, result.reason
    assert {(e.outcome, e.failure) for e in ended} == {("LOST", "Lost")}
    assert chosen == ["wait_for_robot"] * len(ended)
    assert told[0] == (False, "connection")
    assert told[-1] == (True, "connection")


def test_nobody_where_the_robots_should_be(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who, where and why, and nothing is left."""
    monkeypatch.setattr(connecting, "_PATIENCE_S", 1.0)
    with Relay(1) as relay:
        relay.cut()
        with pytest.raises(
            NotConnected, match=rf"amigo_1 and pico_1 cannot be reached at ws://127.0.0.1:{relay.port}: "
        ):
            Fleet.open("tue_lab", connect=f"ws://127.0.0.1:{relay.port}")


def test_a_service_that_no_robot_offers_is_told_at_once(port: int, knowledge: Path, edit: Edit) -> None:
    """Before anything moves, as the server's rosapi tells what there is."""
    edit(knowledge / LASER, "/{robot}/laser<", "/{robot}/lidar<")
    with pytest.raises(GroundingError, match="offers no service /amigo_1/lidar"):
        Fleet.open("tue_lab", connect=f"ws://127.0.0.1:{port}", knowledge=knowledge)


def test_knowledge_that_wants_other_fields_needs_another_connection(port: int, knowledge: Path, edit: Edit) -> None:
    """Types are agreed on when connecting: the revision in force stays."""
    with Fleet.open("tue_lab", connect=f"ws://127.0.0.1:{port}", knowledge=knowledge) as fleet:
        edit(knowledge / LASER, "/{robot}/laser<", "/{robot}/lidar<")
        with pytest.raises(BadRequest, match="/amigo_1/lidar had other fields, or was not there"):
            fleet.propose_knowledge()


def test_the_command_line_connects(port: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One localization by a robot elsewhere; its trace is read as others are, and not done again."""
    where = ["--connect", f"ws://127.0.0.1:{port}"]
    assert main(["run", "Localize", "robot=pico_1", "area=tue_lab", "--out", str(tmp_path), *where]) == 0
    assert "Localize-1 completed" in capsys.readouterr().out
    assert main(["trace", str(tmp_path / "trace.jsonl"), "--replay"]) == 2
    assert f"is of robots at ws://127.0.0.1:{port}" in capsys.readouterr().err
    assert main(["run", "Localize", "robot=pico_1", "area=tue_lab", "--scenario", "tue_lab", *where]) == 2
    assert "leave the scenario out" in capsys.readouterr().err
