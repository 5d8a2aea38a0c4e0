"""The base: limits, watchdog, contacts, odometry."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from grounding.messages import xyyaw
from sim.scenario import load_scenario
from tests.sim.conftest import Lab


def test_speed_changes_within_the_acceleration_limit(room: Callable[..., Lab]) -> None:
    """Every step the base gains at most 1/240 m/s and 3/240 rad/s, until it has the speed it can have."""
    lab = room(10.0, amigo_1=(3.0, 3.0, 0.0))
    poses = []
    for _ in range(240):
        lab.command("amigo_1", 2.0, 0.0, 5.0)  # more than it can: 0.7 m/s, 1.2 rad/s
        lab.wait(1 / 240)
        poses.append(lab.fleet.true_pose("amigo_1"))
    x, y, yaw = np.array(poses).T
    speed = np.hypot(np.diff(x), np.diff(y)) * 240
    turn = np.diff(np.unwrap(yaw)) * 240
    assert np.diff(speed).max() * 240 <= 1.0 + 1e-6
    assert np.diff(turn).max() * 240 <= 3.0 + 1e-6
    assert speed[-1] == pytest.approx(0.7, abs=1e-6)
    assert turn[-1] == pytest.approx(1.2, abs=1e-6)


def test_the_base_drives_arcs(room: Callable[..., Lab]) -> None:
    """Steady forward and turning speed gives a circle of radius v/w, also for an omnidirectional command."""
    lab = room(10.0, pico_1=(5.0, 5.0, 1.0))
    lab.drive("pico_1", 0.3, 0.4, 0.5, seconds=2)
    poses = []
    for _ in range(40):
        lab.drive("pico_1", 0.3, 0.4, 0.5, seconds=0.3)
        poses.append(lab.fleet.true_pose("pico_1")[:2])
    points = np.array(poses)
    # The circle through all points: |p|^2 = 2 p.c + k.
    solution, *_ = np.linalg.lstsq(np.column_stack((2 * points, np.ones(40))), (points**2).sum(axis=1), rcond=None)
    radii = np.hypot(*(points - solution[:2]).T)
    assert radii == pytest.approx(0.5 / 0.5, abs=1e-4)
    # A step goes along the chord: the commanded direction, seen from the heading in the middle of the step.
    x0, y0, yaw0 = lab.fleet.true_pose("pico_1")
    lab.wait(1 / 240)
    x1, y1, yaw1 = lab.fleet.true_pose("pico_1")
    direction = math.atan2(y1 - y0, x1 - x0) - (yaw0 + yaw1) / 2
    assert math.remainder(direction - math.atan2(0.4, 0.3), math.tau) == pytest.approx(0.0, abs=1e-6)


def test_the_watchdog_stops_a_base_that_hears_nothing(room: Callable[..., Lab]) -> None:
    """A command holds for 0.5 s; then the base brakes within its limits, and stays."""
    lab = room(10.0, amigo_1=(2.0, 5.0, 0.0))
    lab.drive("amigo_1", 0.6, 0.0, 0.0, seconds=2)
    lab.wait(0.38)  # 0.48 s after the last command
    assert lab.command("amigo_1", 0.6, 0.0, 0.0).twist.twist.linear.x == pytest.approx(0.6, rel=0.1)
    before = lab.fleet.true_pose("amigo_1")[0]
    lab.wait(2.0)
    after = lab.fleet.true_pose("amigo_1")[0]
    assert after - before == pytest.approx(0.6 * 0.5 + 0.6**2 / 2, abs=0.01)
    lab.wait(1.0)
    assert lab.fleet.true_pose("amigo_1")[0] == after


def test_a_base_driven_into_a_wall_stays_out(room: Callable[..., Lab]) -> None:
    """The body stops at the wall, upright, within the millimeters that an impact takes, and contact is counted."""
    lab = room(4.0, amigo_1=(2.0, 2.0, 0.0))
    lab.drive("amigo_1", 0.7, 0.0, 0.0, seconds=1)
    assert lab.fleet.collisions == 0
    for _ in range(40):
        lab.drive("amigo_1", 0.7, 0.0, 0.0, seconds=0.1)
        assert lab.fleet.true_pose("amigo_1")[0] < 4.0 - 0.35 + 0.01
    assert lab.fleet.true_pose("amigo_1")[0] > 4.0 - 0.35 - 0.01
    assert lab.fleet.collisions > 240
    assert abs(lab.command("amigo_1", 0.0, 0.0, 0.0).twist.twist.linear.x) < 0.02


def test_a_base_can_leave_the_wall_again(room: Callable[..., Lab]) -> None:
    """Touching does not hold a robot: it slides along, and backs off."""
    lab = room(4.0, amigo_1=(3.0, 1.0, 0.0))
    lab.drive("amigo_1", 0.5, 0.4, 0.0, seconds=4)
    assert lab.fleet.true_pose("amigo_1")[1] > 2.0
    touching = lab.fleet.collisions
    lab.drive("amigo_1", -0.5, 0.0, 0.0, seconds=2)
    assert touching < lab.fleet.collisions < touching + 60
    assert lab.fleet.true_pose("amigo_1")[0] < 3.3


def test_a_table_stops_the_body_at_its_top(tue_lab: Callable[..., Lab]) -> None:
    """A robot is taller than a table: it does not drive below it between the legs."""
    lab = tue_lab(amigo="at_coffee_table")
    lab.drive("amigo_1", 0.5, 0.0, 0.0, seconds=4)
    assert lab.fleet.true_pose("amigo_1")[1] == pytest.approx(5.8 - 0.35, abs=0.01)


def test_robots_do_not_drive_through_each_other(room: Callable[..., Lab]) -> None:
    """Head on, two robots keep the sum of their radii apart."""
    lab = room(6.0, amigo_1=(2.0, 3.0, 0.0), pico_1=(4.0, 3.0, math.pi))
    closest = math.inf
    for _ in range(40):
        lab.command("amigo_1", 0.7, 0.0, 0.0)
        lab.command("pico_1", 0.6, 0.0, 0.0)
        lab.wait(0.1)
        ax, ay, _ = lab.fleet.true_pose("amigo_1")
        px, py, _ = lab.fleet.true_pose("pico_1")
        closest = min(closest, math.hypot(ax - px, ay - py))
    assert 0.65 - 0.02 < closest < 0.66
    assert lab.fleet.collisions > 0


def test_no_drive_gets_into_furniture(tue_lab: Callable[..., Lab]) -> None:
    """Whatever is commanded, the footprint never overlaps a box by more than an impact's centimeter."""
    lab = tue_lab()
    boxes = load_scenario("tue_lab").world.boxes
    low, high = np.array([box.low[:2] for box in boxes]), np.array([box.high[:2] for box in boxes])
    chance = np.random.default_rng(5)
    deepest = -math.inf
    for _ in range(25):
        amigo, pico = chance.uniform(-1, 1, 3), chance.uniform(-1, 1, 3)
        for _ in range(4):
            lab.command("amigo_1", *amigo.tolist())
            lab.command("pico_1", *pico.tolist())
            lab.wait(0.4)
            for robot, radius in (("amigo_1", 0.35), ("pico_1", 0.30)):
                center = np.array(lab.fleet.true_pose(robot)[:2])
                gaps = np.hypot(*(center - np.clip(center, low, high)).T)
                deepest = max(deepest, radius - gaps.min())
    assert 0.0 < deepest < 0.01  # it did hit something, and did not get in
    assert lab.fleet.collisions > 0


def test_odometry_drifts_a_little(room: Callable[..., Lab]) -> None:
    """After some driving, odometry is off by some centimeters: not by nothing, and not by more than 10 %."""
    lab = room(10.0, amigo_1=(2.0, 2.0, 0.5))
    lab.drive("amigo_1", 0.6, 0.1, 0.05, seconds=8)
    lab.drive("amigo_1", 0.0, 0.0, 0.0, seconds=1)
    odometry = lab.command("amigo_1", 0.0, 0.0, 0.0)
    x, y, yaw = lab.fleet.true_pose("amigo_1")
    dx, dy = x - 2.0, y - 2.0
    true_x, true_y = math.cos(0.5) * dx + math.sin(0.5) * dy, -math.sin(0.5) * dx + math.cos(0.5) * dy
    odom_x, odom_y, odom_yaw = xyyaw(odometry.pose.pose)
    off = math.hypot(odom_x - true_x, odom_y - true_y)
    assert 0.005 < off < 0.1 * math.hypot(dx, dy)
    assert 0.0 < abs(odom_yaw - (yaw - 0.5)) < 0.05
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("amigo_1/odom", "amigo_1/base_link")


def test_odometry_at_rest_stays_at_its_origin(room: Callable[..., Lab]) -> None:
    """Wheels that do not turn count nothing, wherever the robot stands."""
    lab = room(10.0, amigo_1=(2.0, 2.0, 0.5))
    lab.wait(3.0)
    assert xyyaw(lab.command("amigo_1", 0.0, 0.0, 0.0).pose.pose) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_every_robot_drifts_in_its_own_way(room: Callable[..., Lab]) -> None:
    """Robots of one kind that do the same do not report the same: the errors of scale are 2 % of distance."""
    names = [f"amigo_{number}" for number in range(12)]
    lab = room(30.0, **{name: (2.0, 2.0 + 2.0 * number, 0.0) for number, name in enumerate(names)})
    for _ in range(10):
        for name in names:
            lab.command(name, 0.5, 0.0, 0.0)
        lab.wait(0.1)
    moved = [lab.fleet.true_pose(name)[0] - 2.0 for name in names]
    assert moved == pytest.approx([moved[0]] * 12, abs=1e-9)
    counted = np.array([lab.command(name, 0.0, 0.0, 0.0).pose.pose.position.x for name in names])
    errors = counted / np.array(moved) - 1.0
    assert len(set(errors.tolist())) == 12
    assert 0.01 < errors.std() < 0.035  # 2 % (1 sigma) of scale


def test_the_order_of_robots_in_the_file_does_not_matter(room: Callable[..., Lab]) -> None:
    """A robot draws its errors by its name's place in the alphabet, not by its place in the file."""
    amigo, pico = (2.0, 2.0, 0.0), (2.0, 7.0, 0.0)
    reports = []
    for lab in (room(10.0, amigo_1=amigo, pico_1=pico), room(10.0, pico_1=pico, amigo_1=amigo)):
        lab.drive("amigo_1", 0.5, 0.1, 0.2, seconds=1)
        reports.append(xyyaw(lab.command("amigo_1", 0.0, 0.0, 0.0).pose.pose))
    assert reports[0] == reports[1]
