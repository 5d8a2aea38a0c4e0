"""Deliveries through a door: open, closed and known to be, closed and not known to be."""

from __future__ import annotations

import math
from importlib.resources import files
from pathlib import Path

import pytest

from executive import Fleet, TaskResult, TaskStatus
from executive.replay import first_difference
from executive.trace import ActionFinished, FactsTold, PlanMade, RecoveryChosen, Replanned
from planner.plan import PlanStatus
from sim.floor_plan import draw_floor_plans
from sim.world import load_world
from tests.scenarios.conftest import Edit

FAILURES = "http://example.org/concertmaster/failures.owl#"

_TABLES_M = {"at_bed_1": (7.6, 1.2), "at_bed_2": (7.6, 4.4)}

_WALLED_UP = """
[inner_walls.north]
x_m = [3.95, 4.05]
y_m = [6.4, 8.0]
"""


def deliver(fleet: Fleet, to: str = "at_bed_1") -> TaskResult:
    """Have the meal delivered."""
    return fleet.request("Deliver", area="ward", thing="meal_1", to=to).wait()


def planned(fleet: Fleet) -> list[tuple[str, str]]:
    """Process and robot of each step of the last plan, which is proven optimal."""
    made = [event for event in fleet.trace if isinstance(event, PlanMade)][-1]
    assert made.status == PlanStatus.SOLVED_OPTIMALLY
    return [(action.split("(")[0], robot) for action, robot, *_ in made.steps]


def is_served(fleet: Fleet, bed: str = "at_bed_1") -> bool:
    """Whether the meal truly stands on the table of a bed, is known to be there, and nothing was touched."""
    x_m, y_m, z_m = fleet.parts.simulation.true_position("meal_1")
    known = fleet.parts.knowledge.snapshot().value("locatedAt", "meal_1")
    assert fleet.parts.simulation.collisions == 0
    return known == bed and z_m == 0.75 and math.dist((x_m, y_m), _TABLES_M[bed]) < 0.45


@pytest.fixture
def walled_up(tmp_path: Path, knowledge: Path, edit: Edit) -> tuple[Path, Path]:
    """A ward whose only way is a door that is shut: scenario, and knowledge with its maps and little patience."""
    world = files("sim").joinpath("worlds/ward.toml").read_text(encoding="utf-8")
    (tmp_path / "walled_up.toml").write_text(world + _WALLED_UP, encoding="utf-8")
    draw_floor_plans(load_world(tmp_path / "walled_up.toml"), knowledge / "sites" / "ward")
    grace = '<core:graceTime_s rdf:datatype="http://www.w3.org/2001/XMLSchema#double">{}</core:graceTime_s>'
    edit(knowledge / "tasks" / "navigation.owl", grace.format("20.0"), grace.format("4.0"))
    text = files("sim").joinpath("scenarios/ward_door_shut.toml").read_text(encoding="utf-8")
    scenario = tmp_path / "scenario.toml"
    scenario.write_text(text.replace('world = "ward"', 'world = "walled_up.toml"'), encoding="utf-8")
    return scenario, knowledge


def test_through_an_open_door() -> None:
    """The robot of the kitchen does it alone: nobody opens what is open."""
    with Fleet.open("ward") as fleet:
        result = deliver(fleet)
        assert result.status is TaskStatus.COMPLETED, result.reason
        assert planned(fleet) == [
            ("Navigate", "runner_1"),
            ("Load", "runner_1"),
            ("Navigate", "runner_1"),
            ("Unload", "runner_1"),
        ]
        assert is_served(fleet)


def test_a_door_that_is_known_to_be_closed_is_opened_meanwhile() -> None:
    """The porter, who alone can, opens it while the runner fetches the meal; it costs no time."""
    with Fleet.open("ward", scenario="ward_door_shut") as fleet:
        free, _ = fleet.plan("Deliver", area="ward", thing="meal_1", to="at_bed_1")
        fleet.tell("isOpen", "ward_door", False)
        result = deliver(fleet)
        assert result.status is TaskStatus.COMPLETED, result.reason
        steps = planned(fleet)
        assert ("OpenDoor", "porter_1") in steps
        assert steps.index(("OpenDoor", "porter_1")) < steps.index(("Load", "runner_1"))
        assert result.plan is not None
        assert result.plan.makespan_s == free.makespan_s
        assert fleet.parts.simulation.door_is_open("ward_door")
        assert is_served(fleet)


def test_a_door_of_which_it_is_told_on_the_way_that_it_is_shut_is_opened() -> None:
    """What is left to do rests on it, so that it is planned anew at once; telling it again changes nothing."""
    with Fleet.open("ward") as fleet:
        task = fleet.request("Deliver", area="ward", thing="meal_1", to="at_bed_1")
        assert task.wait_until(2.0) is None
        before = planned(fleet)
        fleet.tell("isOpen", "ward_door", False)
        fleet.tell("isOpen", "ward_door", False)
        assert task.wait_until(3.0) is None
        assert len([event for event in fleet.trace if isinstance(event, Replanned)]) == 1
        assert ("OpenDoor", "porter_1") in planned(fleet)
        assert ("OpenDoor", "porter_1") not in before


def test_where_nobody_can_open_it_they_go_around(knowledge: Path, edit: Edit) -> None:
    """Without the porter's door opener, the plan goes over the open passage, and takes longer."""
    ward = knowledge / "sites" / "ward" / "ward.owl"
    opener = 'rdf:resource="http://example.org/concertmaster/doors.owl#DoorOpener"'
    edit(ward, opener, 'rdf:resource="http://example.org/concertmaster/delivery.owl#Tray"')
    with Fleet.open("ward", scenario="ward_door_shut", knowledge=knowledge) as fleet:
        free, _ = fleet.plan("Deliver", area="ward", thing="meal_1", to="at_bed_1")
        fleet.tell("isOpen", "ward_door", False)
        fleet.let_time_pass(0.1)
        plan, _ = fleet.plan("Deliver", area="ward", thing="meal_1", to="at_bed_1")
        assert plan.status is PlanStatus.SOLVED_OPTIMALLY
        assert 'Navigate(runner_1,"ward","passage")' in [str(step.action) for step in plan.steps]
        assert plan.makespan_s is not None
        assert free.makespan_s is not None
        assert plan.makespan_s > free.makespan_s


@pytest.mark.slow
def test_a_door_that_is_shut_unknown_to_all_is_driven_around() -> None:
    """The laser sees the leaf, and the way is found anew through the passage: later than planned, but served."""
    with Fleet.open("ward", scenario="ward_door_shut") as fleet:
        result = deliver(fleet, to="at_bed_2")
        assert result.status is TaskStatus.COMPLETED, result.reason
        assert not [robot for process, robot in planned(fleet) if process == "OpenDoor"]
        assert not fleet.parts.simulation.door_is_open("ward_door")
        assert is_served(fleet, "at_bed_2")


def test_what_a_robot_finds_out_of_a_door_is_planned_with() -> None:
    """The porter looks at the door and sees that it is shut; from then on somebody has to open it."""
    with Fleet.open("ward", scenario="ward_door_shut") as fleet:
        seen = fleet.request("SeeFrom", robot="porter_1", area="ward", door="ward_door", location="door_east").wait()
        assert (seen.status, seen.outputs["open"]) == (TaskStatus.COMPLETED, False)
        assert fleet.parts.knowledge.snapshot().value("isOpen", "ward_door") is False
        plan, _ = fleet.plan("Deliver", area="ward", thing="meal_1", to="at_bed_1")
        assert "OpenDoor" in [step.action.process for step in plan.steps]


def test_a_robot_shuts_a_door_at_which_it_stands() -> None:
    """It does so, and it is known; from elsewhere it is not even tried."""
    with Fleet.open("ward") as fleet:
        far = fleet.request("CloseDoor", robot="porter_1", door="ward_door").wait()
        assert far.status is TaskStatus.REFUSED
        assert "no execution" in far.reason
        fleet.request("GoTo", robot="porter_1", area="ward", location="door_east").wait()
        near = fleet.request("CloseDoor", robot="porter_1", door="ward_door").wait()
        assert near.status is TaskStatus.COMPLETED, near.reason
        assert fleet.parts.knowledge.snapshot().value("isOpen", "ward_door") is False
        fleet.let_time_pass(fleet.now_s + 1.0)
        assert not fleet.parts.simulation.door_is_open("ward_door")


@pytest.mark.slow
def test_a_door_that_is_shut_unknown_to_all_and_is_the_only_way_is_found_out_and_opened(
    walled_up: tuple[Path, Path],
) -> None:
    """The robot waits for what is in its way, as that may move; then it looks at the door, and is let through.

    Who opens is planned: the porter, on the other side, as the robot itself has no door opener.
    """
    scenario, knowledge = walled_up
    with Fleet.open("ward", scenario=scenario, knowledge=knowledge) as fleet:
        result = deliver(fleet)
        assert result.status is TaskStatus.COMPLETED, result.reason
        [failure] = [e.failure for e in fleet.trace if isinstance(e, ActionFinished) and e.failure]
        assert failure == "TookTooLong"
        [chosen] = [e for e in fleet.trace if isinstance(e, RecoveryChosen)]
        assert (chosen.failure, chosen.recovery) == ("RobotStuck", "open_door")
        assert chosen.again == 'GoTo(runner_1,"ward","at_bed_1")'
        _, looking, rest = [[name for name, *_ in e.steps] for e in fleet.trace if isinstance(e, PlanMade)]
        assert looking == ['Navigate(runner_1,"ward","door_west")', 'SeeDoor(runner_1,"ward_door")']
        assert 'OpenDoor(porter_1,"ward_door")' in rest
        assert not {name for name in (*looking, *rest) if name.startswith("Load")}, "it has the meal"
        [seen] = [e for e in fleet.trace if isinstance(e, FactsTold) and (e.prop, e.value) == ("isOpen", False)]
        assert seen.robot == "runner_1"
        assert fleet.parts.simulation.door_is_open("ward_door")
        assert is_served(fleet)
        trace = list(fleet.trace)
    assert first_difference(trace, knowledge) == ""


@pytest.mark.slow
def test_where_nothing_is_known_to_help_the_task_fails_truly(walled_up: tuple[Path, Path], edit: Edit) -> None:
    """If it says nothing but that it has taken too long: nobody else can have the meal."""
    scenario, knowledge = walled_up
    navigation = knowledge / "tasks" / "navigation.owl"
    edit(navigation, f'<core:failureIfLate rdf:resource="{FAILURES}RobotStuck"/>', "")
    with Fleet.open("ward", scenario=scenario, knowledge=knowledge) as fleet:
        failed = deliver(fleet)
        assert failed.status is TaskStatus.FAILED
        assert "has not ended after" in failed.reason
        assert {e.recovery for e in fleet.trace if isinstance(e, RecoveryChosen)} == {""}
