"""Doors: what they stop, who moves them, and what stops them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from sim.errors import BadScenario, ServiceRefused
from sim.scenario import load_scenario
from tests.sim.conftest import Lab, Pose2

_WORLD = """
[world]
name = "two_rooms"
size_m = [6.0, 4.0]
wall_thickness_m = 0.1
wall_height_m = 2.0
wall_color = [0.9, 0.9, 0.9]
floor_color = [0.7, 0.7, 0.7]

[inner_walls.south]
x_m = [2.95, 3.05]
y_m = [0.0, 1.5]

[inner_walls.north]
x_m = [2.95, 3.05]
y_m = [2.5, 4.0]

[furniture]

[doors.passage]
x_m = [2.97, 3.03]
y_m = [1.5, 2.5]
slides_m = [0.0, 1.0]
travel_s = 2.0
open = {open}
"""

_SCENARIO = """
[scenario]
site = "two_rooms"
world = "two_rooms.toml"
seed = 7

[robots.pico_1]
model = "pico"
start = "somewhere"
placement_error_m = 0.0
placement_error_rad = 0.0

[objects]
{changes}
"""


@pytest.fixture
def two_rooms(tmp_path: Path) -> Iterator[Callable[..., Lab]]:
    """Make a lab of two rooms with a door between them; pico_1 stands at `pico` and looks east."""
    labs: list[Lab] = []

    def make(pico: Pose2 = (2.0, 2.0, 0.0), *, is_open: bool = True, changes: str = "") -> Lab:
        (tmp_path / "two_rooms.toml").write_text(_WORLD.format(open=str(is_open).lower()))
        (tmp_path / "trial.toml").write_text(_SCENARIO.format(changes=changes))
        labs.append(Lab(load_scenario(tmp_path / "trial.toml"), {"pico_1": pico}))
        return labs[-1]

    yield make
    for lab in labs:
        lab.fleet.close()


def _ahead_m(lab: Lab) -> float:
    """What the laser sees straight ahead."""
    scan = lab.scan("pico_1")
    return float(scan.ranges[round(-scan.angle_min / scan.angle_increment)])


def test_a_closed_door_is_seen_and_stops_a_robot(two_rooms: Callable[..., Lab]) -> None:
    """Through an open one, the robot sees the far wall and gets there."""
    closed, opened = two_rooms(is_open=False), two_rooms()
    assert _ahead_m(closed) < 1.0 < 3.0 < _ahead_m(opened)
    for lab in (closed, opened):
        lab.drive("pico_1", 0.5, 0.0, 0.0, seconds=5.0)
    assert closed.fleet.true_pose("pico_1")[0] < 2.9
    assert opened.fleet.true_pose("pico_1")[0] > 4.0
    assert closed.fleet.collisions > 0 == opened.fleet.collisions


def test_a_robot_opens_and_closes_a_door(two_rooms: Callable[..., Lab]) -> None:
    """It takes as long as the leaf takes, and the robot can see what has become of it."""
    lab = two_rooms(is_open=False)
    assert lab.call("/pico_1/see_door", door="passage") == {"is_open": False}
    assert lab.call("/pico_1/open_door", door="passage") == {}
    lab.wait(1.0)
    assert not lab.fleet.door_is_open("passage")
    lab.wait(1.01)
    assert lab.call("/pico_1/see_door", door="passage") == {"is_open": True}
    lab.call("/pico_1/close_door", door="passage")
    lab.wait(2.01)
    assert lab.call("/pico_1/see_door", door="passage") == {"is_open": False}
    assert lab.fleet.services()["/pico_1/open_door"].latency_s == 2.0


@pytest.mark.parametrize(
    ("door", "pico", "code", "told"),
    [
        ("gate", (2.0, 2.0, 0.0), "BadRequest", "there is no door gate; there is passage"),
        ("passage", (0.5, 2.0, 0.0), "OutOfReach", "passage is 2.47 m away; the reach is 1.5 m"),
    ],
)
def test_what_a_robot_cannot_open(two_rooms: Callable[..., Lab], door: str, pico: Pose2, code: str, told: str) -> None:
    """A door that is not there, or too far away; the leaf stays where it is."""
    lab = two_rooms(pico, is_open=False)
    with pytest.raises(ServiceRefused, match=told) as refused:
        lab.call("/pico_1/open_door", door=door)
    assert refused.value.code == code
    lab.wait(3.0)
    assert not lab.fleet.door_is_open("passage")


def test_a_door_does_not_close_on_a_robot(two_rooms: Callable[..., Lab]) -> None:
    """It stops where the robot is, without pushing it, and goes on when the robot has left."""
    lab = two_rooms((3.0, 2.0, 0.0))
    lab.call("/pico_1/close_door", door="passage")
    lab.wait(3.0)
    assert lab.fleet.true_pose("pico_1")[:2] == (3.0, 2.0)
    assert lab.fleet.collisions == 0
    lab.drive("pico_1", 0.5, 0.0, 0.0, seconds=4.0)
    lab.wait(2.0)
    assert lab.call("/pico_1/see_door", door="passage") == {"is_open": False}
    lab.drive("pico_1", -0.5, 0.0, 0.0, seconds=5.0)
    assert lab.fleet.true_pose("pico_1")[0] > 3.0


def test_a_scenario_closes_a_door(two_rooms: Callable[..., Lab]) -> None:
    """At its time, and nobody is told."""
    lab = two_rooms(changes='[changes.draft]\nat_s = 1.5\ndoor = "passage"\nopen = false')
    lab.wait(1.4)
    assert lab.fleet.door_is_open("passage")
    lab.wait(2.2)
    assert not lab.fleet.door_is_open("passage")
    assert _ahead_m(lab) < 1.0


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ('at_s = 1.0\ndoor = "gate"\nopen = true', "changes.c.door: unknown: 'gate'; known are passage"),
        ('at_s = 1.0\ndoor = "passage"\nopen = "yes"', "changes.c.open: 'yes' is neither true nor false"),
        ('at_s = -1.0\ndoor = "passage"\nopen = true', "changes.c.at_s: -1.0 is not from 0 to inf"),
        ('at_s = 1.0\nobject = "cup"\nposition = [1, 1, 0]', "changes.c.object: unknown: 'cup'"),
        ("at_s = 1.0", "changes.c.object: missing"),
    ],
)
def test_wrong_changes_are_refused(two_rooms: Callable[..., Lab], change: str, told: str) -> None:
    """With the field at fault."""
    with pytest.raises(BadScenario, match=told):
        two_rooms(changes=f"[changes.c]\n{change}")


def test_a_door_that_goes_nowhere_is_refused(two_rooms: Callable[..., Lab], tmp_path: Path) -> None:
    """It could not open."""
    two_rooms()
    world = tmp_path / "two_rooms.toml"
    world.write_text(world.read_text().replace("[0.0, 1.0]", "[0.0, 0.0]"))
    with pytest.raises(BadScenario, match=r"doors.passage.slides_m: is \[0, 0\]; a leaf has to move aside"):
        load_scenario(tmp_path / "trial.toml")
