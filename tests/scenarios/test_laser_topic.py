"""The same program, its scans read from a topic rather than from a service, as the knowledge says."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from executive import Fleet, TaskStatus
from executive.replay import first_difference
from executive.trace import ActionFinished, ActionStarted, PlanMade, RecoveryChosen, TraceEvent
from grounding.errors import GroundingError
from grounding.inprocess import InProcessTopics
from grounding.messages import LaserScan, stamp_of
from tests.scenarios.conftest import ROBOTS, run_scored
from tests.scenarios.laser_topic import ground_laser_in_topic
from tests.scenarios.test_find_empty_drink import DETECTED_WITHIN_M, distance_to_truth
from tests.scenarios.test_over_rosbridge import both_found, found, served


def assigned(trace: Sequence[TraceEvent]) -> list[list[str]]:
    """The steps of the first plan, and by which robots."""
    plan = next(event for event in trace if isinstance(event, PlanMade))
    return [list(step[:2]) for step in plan.steps]


def scans(trace: Sequence[TraceEvent]) -> list[ActionFinished]:
    """What became of the readings."""
    return [event for event in trace if isinstance(event, ActionFinished) and event.action.startswith("Laser(")]


def test_the_task_is_the_same(knowledge: Path) -> None:
    """Assignment, actions and what is found; almost no scan is waited for, and the run replays."""
    with Fleet.open("tue_lab") as fleet:
        _, by_service = both_found(fleet)
    ground_laser_in_topic(knowledge)
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        scored = run_scored(fleet, robots=2)
        assert scored.result.status is TaskStatus.COMPLETED, scored.result.reason
        assert max(distance_to_truth(scored, drink) for drink in ("drink_1", "drink_2")) <= DETECTED_WITHIN_M
        assert fleet.parts.simulation.collisions == 0
        assert assigned(fleet.trace) == assigned(by_service)
        assert found(fleet.trace) == found(by_service)
        services = {event.service for event in fleet.trace if isinstance(event, ActionStarted)}
        assert services >= {f"/{robot}/scan" for robot in ROBOTS}
        assert not services & {f"/{robot}/laser" for robot in ROBOTS}
        assert sum(event.elapsed_s > 0.0 for event in scans(fleet.trace)) == len(ROBOTS)
        recorded = list(fleet.trace)
    assert first_difference(recorded, knowledge) == ""


def test_knowledge_may_change_from_service_to_topic_and_back(knowledge: Path) -> None:
    """Between two tasks: the next one reads as is said by then. A sensor that nobody has asked for does not measure."""
    file = knowledge / "tasks" / "groundings.owl"
    shipped = file.read_bytes()
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        topics = fleet.parts.transport.topics

        def localized() -> str:
            before = len(fleet.trace)
            result = fleet.request("Localize", robot="pico_1", area="tue_lab").wait()
            assert result.status is TaskStatus.COMPLETED, result.reason
            started = [event for event in fleet.trace[before:] if isinstance(event, ActionStarted)]
            [service] = {event.service for event in started if event.action.startswith("Laser(")}
            return service

        assert localized() == "/pico_1/laser"
        assert not topics.is_heard("/pico_1/scan")
        ground_laser_in_topic(knowledge)
        fleet.accept_knowledge(fleet.propose_knowledge())
        assert localized() == "/pico_1/scan"
        assert topics.is_heard("/pico_1/scan")
        assert not topics.is_heard("/amigo_1/scan")
        file.write_bytes(shipped)
        fleet.accept_knowledge(fleet.propose_knowledge())
        assert localized() == "/pico_1/laser"


def test_a_sensor_that_falls_silent_is_waited_for(knowledge: Path, tmp_path: Path) -> None:
    """Its readings fail with the topic and its age; what the ontology says against silent sensors helps."""
    ground_laser_in_topic(knowledge)
    faults = tmp_path / "faults.toml"
    faults.write_text(
        "[faults.laser_is_silent]\nservice = '/amigo_1/scan'\nkind = 'cut'\nfrom_s = 2.0\nuntil_s = 3.5\n",
        encoding="utf-8",
    )
    with Fleet.open("tue_lab", knowledge=knowledge, faults=faults) as fleet:
        result = fleet.request("FindEmptyDrink", room="tue_lab", robots=2).wait()
        assert result.status is TaskStatus.COMPLETED, result.reason
        failed = [event for event in scans(fleet.trace) if event.failure]
        assert {event.failure for event in failed} == {"NoMessage"}
        assert all("no message of /amigo_1/scan came within 1 s; the newest is 1." in e.reason for e in failed)
        [chosen] = {event.failure for event in fleet.trace if isinstance(event, RecoveryChosen)}
        assert chosen == "SensorSilent"


def _without_directions(scan: LaserScan) -> object:
    return replace(scan, angle_min=math.nan)


def _of_another_type(scan: LaserScan) -> object:
    return scan.header


def _from_a_clock_that_is_off(scan: LaserScan) -> object:
    return replace(scan, header=replace(scan.header, stamp=stamp_of(3600.0)))


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (_without_directions, "angle_min"),
        (_of_another_type, "the reply of /pico_1/scan: is std_msgs/Header, not sensor_msgs/LaserScan"),
        (_from_a_clock_that_is_off, ""),
    ],
)
def test_a_robot_that_says_what_it_should_not(
    knowledge: Path, monkeypatch: pytest.MonkeyPatch, spoil: Callable[[LaserScan], object], reason: str
) -> None:
    """The task ends with one clear reason, as where a service does; the time of a robot's own clock does no harm."""
    say = InProcessTopics.say
    monkeypatch.setattr(InProcessTopics, "say", lambda self, name, scan: say(self, name, spoil(scan)))
    ground_laser_in_topic(knowledge)
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        result = fleet.request("Localize", robot="pico_1", area="tue_lab").wait()
        assert result.status is (TaskStatus.FAILED if reason else TaskStatus.COMPLETED), result.reason
        assert reason in result.reason


def test_a_topic_that_no_robot_speaks_on_is_told_at_once(knowledge: Path) -> None:
    """Before anything moves, where that can be known."""
    ground_laser_in_topic(knowledge)
    file = knowledge / "tasks" / "groundings.owl"
    file.write_text(file.read_text(encoding="utf-8").replace("/{robot}/scan<", "/{robot}/lidar<"), encoding="utf-8")
    with pytest.raises(GroundingError, match="Laser, field Laser_service: amigo_1 offers no topic /amigo_1/lidar"):
        Fleet.open("tue_lab", knowledge=knowledge)


def test_the_task_is_the_same_over_rosbridge(knowledge: Path) -> None:
    """In real time, each robot's topic subscribed to once."""
    with Fleet.open("tue_lab") as fleet:
        here, trace = both_found(fleet)
    ground_laser_in_topic(knowledge, max_age_s=0.5)
    with (
        served() as port,
        Fleet.open("tue_lab", connect=f"ws://127.0.0.1:{port}", knowledge=knowledge) as fleet,
    ):
        there, remote_trace = both_found(fleet)
    assert assigned(remote_trace) == assigned(trace)
    assert found(remote_trace) == found(trace)
    for drink, position in here.outputs["position"].items():
        other = there.outputs["position"][drink].point
        assert math.dist((position.point.x, position.point.y), (other.x, other.y)) < DETECTED_WITHIN_M
