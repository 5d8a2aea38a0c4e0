"""Labs for the tests of the simulator: shipped scenarios, or rooms made for one question."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest

from grounding.messages import CameraInfo, Image, LaserScan, Odometry, Twist, Vector3
from kb.clock import SimClock
from sim.fleet import SimFleet
from sim.scenario import Scenario, load_scenario

Pose2 = tuple[float, float, float]

PLACES: dict[str, Pose2] = {
    "start_west": (1.0, 1.0, 0.8),
    "start_east": (9.0, 1.0, 2.3),
    "at_coffee_table": (2.6, 4.9, 1.5708),
    "at_dining_table": (8.2, 4.5, 1.5708),
    "at_cabinet": (1.7, 4.0, 3.1416),
}

_ROOM = """
[world]
name = "room"
size_m = [{size}, {size}]
wall_thickness_m = 0.1
wall_height_m = 2.0
wall_color = [0.9, 0.9, 0.9]
floor_color = [0.7, 0.7, 0.7]
[inner_walls]
[furniture]
"""

_ROBOT = """
[robots.{name}]
model = "{model}"
start = "somewhere"
placement_error_m = 0.0
placement_error_rad = 0.0
"""


class Lab:
    """A fleet with its clock, called as a transport would."""

    def __init__(self, scenario: Scenario, starts: Mapping[str, Pose2], seed: int | None = None) -> None:
        self.clock = SimClock()
        self.fleet = SimFleet(scenario, starts=starts, clock=self.clock, seed=seed)

    def call(self, service: str, **request: object) -> Mapping[str, object]:
        """The reply of a service, now."""
        return self.fleet.services()[service].handler(request)

    def scan(self, robot: str) -> LaserScan:
        """A laser scan, now."""
        scan = self.call(f"/{robot}/laser")["scan"]
        assert isinstance(scan, LaserScan)
        return scan

    def images(self, robot: str) -> tuple[Image, Image, CameraInfo]:
        """Color, depth and calibration, now."""
        reply = self.call(f"/{robot}/kinect")
        color, depth, info = reply["color"], reply["depth"], reply["camera_info"]
        assert isinstance(color, Image)
        assert isinstance(depth, Image)
        assert isinstance(info, CameraInfo)
        return color, depth, info

    def command(self, robot: str, vx: float, vy: float, wz: float) -> Odometry:
        """Command a velocity; gives the odometry."""
        odometry = self.call(f"/{robot}/base", velocity=twist(vx, vy, wz))["odometry"]
        assert isinstance(odometry, Odometry)
        return odometry

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        until_s = round(self.clock.now_s + seconds, 9)  # the clock ticks in nanoseconds
        self.clock.call_at(until_s, lambda: None)
        assert self.clock.run_until(lambda: self.clock.now_s >= until_s)

    def drive(self, robot: str, vx: float, vy: float, wz: float, *, seconds: float) -> None:
        """Command a velocity again and again, every 0.1 s."""
        for _ in range(round(seconds * 10)):
            self.command(robot, vx, vy, wz)
            self.wait(0.1)


def twist(vx: float, vy: float, wz: float) -> Twist:
    """Velocity in base_link."""
    return Twist(linear=Vector3(x=vx, y=vy, z=0.0), angular=Vector3(x=0.0, y=0.0, z=wz))


@pytest.fixture
def places() -> dict[str, Pose2]:
    """Where a robot can stand in tue_lab."""
    return PLACES


@pytest.fixture
def tue_lab() -> Iterator[Callable[..., Lab]]:
    """Make a lab of a shipped scenario; the robots start at named places."""
    labs: list[Lab] = []

    def make(amigo: str = "start_west", pico: str = "start_east", seed: int | None = None) -> Lab:
        starts = {"amigo_1": PLACES[amigo], "pico_1": PLACES[pico]}
        labs.append(Lab(load_scenario("tue_lab"), starts, seed))
        return labs[-1]

    yield make
    for lab in labs:
        lab.fleet.close()


@pytest.fixture
def room(tmp_path: Path) -> Iterator[Callable[..., Lab]]:
    """Make an empty square room of some size (m), with robots exactly where they are told to stand."""
    labs: list[Lab] = []

    def make(size: float, **starts: Pose2) -> Lab:
        (tmp_path / "room.toml").write_text(_ROOM.format(size=size))
        head = '[scenario]\nsite = "room"\nworld = "room.toml"\nseed = 7\n[objects]\n'
        robots = (_ROBOT.format(name=name, model=name.split("_")[0]) for name in starts)
        (tmp_path / "trial.toml").write_text(head + "".join(robots))
        labs.append(Lab(load_scenario(tmp_path / "trial.toml"), starts))
        return labs[-1]

    yield make
    for lab in labs:
        lab.fleet.close()
