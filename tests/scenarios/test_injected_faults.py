"""Faults from a file, and compute services in workers: what becomes of a task, and that it can be repeated."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import pytest

from executive import Fleet, TaskResult, TaskStatus
from executive.replay import first_difference
from executive.trace import ActionFinished, FleetOpened, PlanMade, RecoveryChosen, Replanned, TraceEvent
from kb.files import SHIPPED


def run(
    *, faults: Path | None = None, compute: Path | None = None, knowledge: Path | None = None
) -> tuple[TaskResult, list[TraceEvent]]:
    """Find the drinks of the whole lab with both robots; how it ended, and the trace."""
    with Fleet.open("tue_lab", faults=faults, compute=compute, knowledge=knowledge) as fleet:
        return fleet.request("FindEmptyDrink", room="tue_lab").wait(), list(fleet.trace)


def test_the_work_of_a_lost_robot_is_taken_over(tmp_path: Path) -> None:
    """Its calls time out, the other robot does what is left, and a replay meets the same."""
    faults = tmp_path / "lost.toml"
    faults.write_text('[faults.lost]\nservice = "/amigo_1/*"\nkind = "cut"\nfrom_s = 1.5\n')
    result, trace = run(faults=faults)
    assert result.status is TaskStatus.COMPLETED
    ended = [event for event in trace if isinstance(event, ActionFinished)]
    assert {event.robot for event in ended if event.failure} == {"amigo_1"}
    assert {event.robot for event in ended if event.action.startswith("Kinect(")} == {"pico_1"}
    assert first_difference(trace, SHIPPED) == ""


def chosen(trace: list[TraceEvent]) -> list[tuple[str, str, str]]:
    """What was done about failures: action, class of failure, recovery."""
    return [(e.action, e.failure, e.recovery) for e in trace if isinstance(e, RecoveryChosen)]


@pytest.mark.slow
def test_a_camera_that_fails_once_is_tried_again(tmp_path: Path) -> None:
    """By the same robot: that is sooner than another one; the drink is found, and a replay decides the same."""
    faults = tmp_path / "camera.toml"
    faults.write_text('[faults.camera]\nservice = "/amigo_1/kinect"\nkind = "fail"\ncalls = [1]\n')
    (result, trace), (_, without) = run(faults=faults), run()
    assert result.status is TaskStatus.COMPLETED
    assert chosen(trace) == [("Kinect(amigo_1)", "UnknownFailure", "retry")]
    assert not [e for e in trace if isinstance(e, Replanned)]
    seen = [
        {e.robot for e in events if isinstance(e, ActionFinished) and "drink_1" in e.action}
        for events in (trace, without)
    ]
    assert seen == [{"amigo_1"}, {"amigo_1"}]
    assert first_difference(trace, SHIPPED) == ""


@pytest.mark.slow
def test_a_camera_that_fails_again_and_again_is_given_up(tmp_path: Path) -> None:
    """As often as the ontology allows it is tried again, and then another robot goes; each decision tells why."""
    faults = tmp_path / "camera.toml"
    faults.write_text('[faults.camera]\nservice = "/amigo_1/kinect"\nkind = "fail"\n')
    _, trace = run(faults=faults)
    decided = [e for e in trace if isinstance(e, RecoveryChosen) and e.robot == "amigo_1"]
    assert [e.recovery for e in decided] == ["retry", "retry", ""]
    assert [" s with retry or " in e.reason for e in decided] == [True, True, False]
    [anew] = [e for e in trace if isinstance(e, Replanned) and "amigo_1 is not tried again" in e.reason]
    assert "(3 times)" in anew.reason


@pytest.mark.slow
def test_the_place_of_a_robot_that_is_lost_there_is_looked_at_from_beside(tmp_path: Path) -> None:
    """Nobody can move it; the other robot goes as near as it can, and finds the drink all the same."""
    faults = tmp_path / "lost.toml"
    faults.write_text('[faults.lost]\nservice = "/pico_1/*"\nkind = "cut"\nfrom_s = 7.7\n')
    result, trace = run(faults=faults)
    assert result.status is TaskStatus.COMPLETED, result.reason
    assert not [e for e in trace if isinstance(e, ActionFinished) and e.robot == "amigo_1" and e.failure]
    found, before = (one.outputs["position"]["drink_2"].point for one in (result, run()[0]))
    assert math.dist((found.x, found.y), (before.x, before.y)) < 0.15


@pytest.mark.slow
def test_a_robot_whose_camera_is_broken_makes_room_for_the_other_one(tmp_path: Path, knowledge: Path) -> None:
    """The other one has to be where the first one still stands, and does not get there; the first one goes aside."""
    lab = knowledge / "sites" / "tue_lab" / "tue_lab.owl"
    text = lab.read_text(encoding="utf-8")
    _, coffee_table = text.split('tue_lab.owl#at_coffee_table">', 1)
    [tolerance] = re.findall(r"\n.*tolerance_m.*(?=\n)", coffee_table.split("</owl:NamedIndividual>")[0])
    lab.write_text(text.replace(coffee_table, coffee_table.replace(tolerance, "", 1)), encoding="utf-8")
    faults = tmp_path / "camera.toml"
    faults.write_text('[faults.camera]\nservice = "/amigo_1/kinect"\nkind = "fail"\n')
    result, trace = run(faults=faults, knowledge=knowledge)
    assert result.status is TaskStatus.COMPLETED, result.reason
    [chosen] = [e for e in trace if isinstance(e, RecoveryChosen) and e.recovery == "make_room"]
    assert (chosen.robot, chosen.failure) == ("pico_1", "RobotStuck")
    assert chosen.again == 'Navigate(pico_1,"tue_lab","at_coffee_table")'
    [*_, last] = [e for e in trace if isinstance(e, PlanMade)]
    (aside, robot, _, until_s), (then, *_), *_ = last.steps
    assert (aside, robot) == ('Navigate(amigo_1,"tue_lab","at_cabinet")', "amigo_1"), "the nearest free place"
    assert then == 'Navigate(pico_1,"tue_lab","at_coffee_table")'
    assert last.steps[1][2] >= until_s


def test_late_and_repeated_replies_do_no_harm(tmp_path: Path) -> None:
    """A network that is slow by chance, and repeats itself, makes the task longer and nothing else."""
    faults = tmp_path / "slow.toml"
    slow = '[faults.slow]\nservice = "*"\nkind = "delay"\nprobability = 0.05\ndelay_s = 0.05\n'
    faults.write_text(f'{slow}[faults.twice]\nservice = "*"\nkind = "repeat"\nprobability = 0.05\ndelay_s = 0.02\n')
    (result, trace), (quick, _) = run(faults=faults), run()
    assert result.status is TaskStatus.COMPLETED
    assert result.took_s > quick.took_s
    numbers = [event.number for event in trace if isinstance(event, ActionFinished)]
    assert len(numbers) == len(set(numbers)), "each action ends once"


@pytest.mark.slow
def test_where_services_run_makes_no_difference(tmp_path: Path) -> None:
    """Path and Detection in workers: the same trace, but for the file that says so."""
    compute = tmp_path / "compute.toml"
    compute.write_text('[services]\n"/compute/path" = "workers"\n"/compute/detection" = "workers"\n')
    (_, there), (_, here) = run(compute=compute), run()
    opened = there[0]
    assert isinstance(opened, FleetOpened)
    assert opened.compute == str(compute)
    assert [replace(opened, compute=""), *there[1:]] == here
