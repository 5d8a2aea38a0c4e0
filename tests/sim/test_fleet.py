"""The fleet as its callers see it: services, lockstep, repetition, refusals."""

from __future__ import annotations

import hashlib
import math
import subprocess
import sys
from collections.abc import Callable

import pytest

from kb.clock import SimClock
from sim.errors import BadScenario, ServiceRefused
from sim.fleet import SimFleet
from sim.scenario import load_scenario
from tests.sim.conftest import Lab, Pose2, twist


def _digest(lab: Lab, *, busy_pico: bool = False) -> str:
    """All that amigo_1 meets in 1.5 s of driving, as a digest; `busy_pico` calls the other robot's sensors too."""
    digest = hashlib.sha256()
    for turn in range(15):
        odometry = lab.command("amigo_1", 0.4, 0.1, 0.1 * turn)
        digest.update(repr((odometry.pose.pose, odometry.twist.twist)).encode())
        digest.update(lab.scan("amigo_1").ranges.tobytes())
        if busy_pico:
            lab.scan("pico_1")
            if turn == 3:
                lab.images("pico_1")
        lab.wait(0.1)
        digest.update(repr(lab.fleet.true_pose("amigo_1")).encode())
    for image in lab.images("amigo_1")[:2]:
        digest.update(image.data.tobytes())
    return digest.hexdigest()


def test_same_seed_same_run(tue_lab: Callable[..., Lab]) -> None:
    """Two runs agree in every bit of poses, odometry, scans and images."""
    assert _digest(tue_lab()) == _digest(tue_lab())


def test_other_seed_other_run(tue_lab: Callable[..., Lab]) -> None:
    """The seed given to the fleet replaces that of the scenario."""
    assert _digest(tue_lab(seed=1)) != _digest(tue_lab(seed=2))
    assert _digest(tue_lab(seed=1)) == _digest(tue_lab())  # the scenario's seed is 1


def test_reading_one_robot_does_not_change_another(tue_lab: Callable[..., Lab]) -> None:
    """Sensor calls to pico_1 leave everything that amigo_1 meets as it was."""
    assert _digest(tue_lab(), busy_pico=True) == _digest(tue_lab())


def test_services_and_latencies(tue_lab: Callable[..., Lab]) -> None:
    """Each robot offers laser, base, kinect, loading and unloading, with the latency of each; there are no doors."""
    latencies = {name: service.latency_s for name, service in tue_lab().fleet.services().items()}
    assert latencies == {
        f"/{robot}/{service}": latency_s
        for robot in ("amigo_1", "pico_1")
        for service, latency_s in (
            ("laser", 0.008),
            ("base", 0.004),
            ("kinect", 0.08),
            ("load", 3.0),
            ("unload", 3.0),
        )
    }


def test_robots_stand_near_where_they_are_told(tue_lab: Callable[..., Lab], places: dict[str, Pose2]) -> None:
    """The placement error is there, is drawn per robot, and is a few sigma of 3 cm and 0.03 rad at most."""
    offsets = []
    for seed in range(20):
        fleet = tue_lab(seed=seed).fleet
        for robot, place in (("amigo_1", "start_west"), ("pico_1", "start_east")):
            offsets.append([true - told for true, told in zip(fleet.true_pose(robot), places[place], strict=True)])
    flat = [off for offset in offsets for off in offset]
    assert len(set(flat)) == len(flat)
    assert max(abs(off) for off in flat) < 0.15
    assert math.sqrt(sum(off * off for off in flat) / len(flat)) == pytest.approx(0.03, rel=0.2)


def test_the_fleet_keeps_step_with_the_clock(room: Callable[..., Lab]) -> None:
    """At time t exactly the steps that end by t are done: 0.1 s at 1 m/s2 is n(n+1)/2 steps of 1/240^2 m."""
    lab = room(10.0, amigo_1=(2.0, 5.0, 0.0))
    lab.command("amigo_1", 0.7, 0.0, 0.0)
    for milliseconds, steps in ((4, 0), (5, 1), (100, 24), (103, 24), (105, 25)):
        lab.wait(milliseconds / 1000 - lab.clock.now_s)
        moved = lab.fleet.true_pose("amigo_1")[0] - 2.0
        assert moved == pytest.approx(steps * (steps + 1) / 2 / 240**2, abs=1e-9)


def test_objects_are_where_the_scenario_puts_them(tue_lab: Callable[..., Lab]) -> None:
    """True positions are for scoring."""
    fleet = tue_lab().fleet
    assert fleet.true_position("drink_1") == (2.5, 6.0, 0.45)
    assert fleet.true_position("drink_2") == (8.3, 5.6, 0.75)


@pytest.mark.parametrize(
    ("service", "request_fields", "words"),
    [
        ("/amigo_1/laser", {"speed": 1.0}, "fields given: speed; needed: none"),
        ("/amigo_1/kinect", {"": None}, "needed: none"),
        ("/amigo_1/base", {}, "fields given: none; needed: velocity"),
        ("/amigo_1/base", {"velocity": (0.1, 0.0, 0.0)}, "is tuple; needed is"),
        ("/amigo_1/base", {"velocity": twist(math.nan, 0.0, 0.0)}, "finite"),
        ("/amigo_1/base", {"velocity": twist(0.0, -math.inf, 0.0)}, "finite"),
    ],
)
def test_a_wrong_request_is_refused(
    tue_lab: Callable[..., Lab], service: str, request_fields: dict[str, object], words: str
) -> None:
    """A refusal has a code and names the service and what is wrong."""
    with pytest.raises(ServiceRefused, match=words) as caught:
        tue_lab().call(service, **request_fields)
    assert caught.value.code == "BadRequest"
    assert service in caught.value.message


def test_a_base_does_not_fly(tue_lab: Callable[..., Lab]) -> None:
    """A velocity off the floor is refused, and what was commanded before still holds."""
    lab = tue_lab()
    lab.command("amigo_1", 0.3, 0.0, 0.0)
    upward = twist(0.0, 0.0, 0.0)
    upward.linear.z = 0.1
    with pytest.raises(ServiceRefused, match="drives on the floor"):
        lab.call("/amigo_1/base", velocity=upward)
    lab.wait(0.4)
    assert lab.command("amigo_1", 0.0, 0.0, 0.0).twist.twist.linear.x > 0.2


def test_a_closed_fleet_refuses_and_lets_the_clock_go_on(tue_lab: Callable[..., Lab]) -> None:
    """After close, calls are refused as such, time passes, and a second close is nothing."""
    lab = tue_lab()
    lab.fleet.close()
    lab.wait(1.0)
    assert lab.clock.now_s == 1.0
    with pytest.raises(ServiceRefused) as caught:
        lab.call("/amigo_1/laser")
    assert caught.value.code == "Closed"
    lab.fleet.close()


@pytest.mark.parametrize(
    ("starts", "words"),
    [
        ({"amigo_1": (1.0, 1.0, 0.0)}, "needed for amigo_1, pico_1"),
        ({"amigo_1": (1.0, 1.0, 0.0), "pico_1": (9.0, 1.0, 0.0), "hal": (5.0, 4.0, 0.0)}, "given for amigo_1, hal"),
        ({"amigo_1": (2.6, 6.2, 0.0), "pico_1": (9.0, 1.0, 0.0)}, "amigo_1.start: the robot would stand in something"),
        ({"amigo_1": (5.0, 4.0, 0.0), "pico_1": (5.4, 4.0, 0.0)}, "would stand in something"),
    ],
)
def test_wrong_starts_are_told(starts: dict[str, Pose2], words: str) -> None:
    """Robots that are missing, unknown, or placed in furniture or each other are a fault of the scenario."""
    with pytest.raises(BadScenario, match=words):
        SimFleet(load_scenario("tue_lab"), starts=starts, clock=SimClock())


def test_a_clock_that_already_runs(places: dict[str, Pose2]) -> None:
    """A fleet made later starts at that time, and does not make up for what was before."""
    clock = SimClock()
    clock.call_at(100.0, lambda: None)
    clock.run_until(lambda: clock.now_s >= 100.0)
    starts = {"amigo_1": places["start_west"], "pico_1": places["start_east"]}
    with SimFleet(load_scenario("tue_lab"), starts=starts, clock=clock) as fleet:
        before = fleet.true_pose("amigo_1")
        fleet.services()["/amigo_1/base"].handler({"velocity": twist(0.5, 0.0, 0.0)})
        clock.call_at(100.1, lambda: None)
        clock.run_until(lambda: clock.now_s >= 100.1)
        after = fleet.true_pose("amigo_1")
    assert math.hypot(after[0] - before[0], after[1] - before[1]) == pytest.approx(0.1**2 / 2, rel=0.1)


def test_importing_the_engine_prints_nothing() -> None:
    """The banner that pybullet writes at import does not reach the user."""
    done = subprocess.run([sys.executable, "-c", "import sim.physics"], capture_output=True, check=True)
    assert (done.stdout, done.stderr) == (b"", b"")
