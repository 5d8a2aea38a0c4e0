from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from grounding.compute.errors import ComputeFailed
from grounding.compute.grids import grid_message, inflated
from grounding.compute.path import path as plan
from grounding.compute.scans import wrapped
from grounding.compute.velocity import vel_cmd
from grounding.messages import LaserScan, Path, PoseStamped, Twist, header, pose_stamped
from tests.grounding.compute.rooms import (
    MOUNT,
    RADIUS_M,
    ROOMS,
    TABLETOP,
    WALLS,
    Box,
    OmniBase,
    at,
    grid_with,
    scan_from,
)

MAX_MPS, MAX_RADPS = 0.7, 1.2
EMPTY = scan_from((), (0.0, 0.0, 0.0))
State = tuple[float, float, float]


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """A reply of `vel_cmd`."""

    velocity: NDArray[np.float64]
    arrived: bool
    blocked: bool

    @property
    def speed_mps(self) -> float:
        """Speed over ground."""
        return float(np.hypot(self.velocity[0], self.velocity[1]))


def command(way: Path, pose: PoseStamped, scan: LaserScan = EMPTY) -> Command:
    """What `vel_cmd` says."""
    reply = vel_cmd(
        path=way,
        pose=pose,
        scan=scan,
        max_vel_lin_mps=MAX_MPS,
        max_vel_ang_radps=MAX_RADPS,
        radius_m=RADIUS_M,
        t_s=0.0,
        **MOUNT,
    )
    twist, arrived, blocked = reply["velocity"], reply["arrived"], reply["blocked"]
    assert isinstance(twist, Twist)
    assert isinstance(arrived, bool)
    assert isinstance(blocked, bool)
    return Command(
        velocity=np.array([twist.linear.x, twist.linear.y, twist.angular.z]), arrived=arrived, blocked=blocked
    )


def way_over(*corners: State) -> Path:
    """A path over these poses."""
    return Path(header=header("map", 0.0), poses=[at(*corner) for corner in corners])


def driven(
    way: Path, start: State, boxes: tuple[Box, ...], *, seconds: float
) -> tuple[list[State], list[float], Command]:
    """States and speeds at 30 Hz until the base has arrived and stands, or the time is over, and the last command."""
    base = OmniBase(state=np.array(start))
    noise = np.random.default_rng(11)
    states, speeds_mps = [start], [0.0]
    said = command(way, at(*start))
    for _ in range(round(seconds * 30.0)):
        x_m, y_m, yaw_rad = base.state.tolist()
        said = command(way, at(x_m, y_m, yaw_rad), scan_from(boxes, (x_m, y_m, yaw_rad), noise=noise))
        base.drive(said.velocity)
        x_m, y_m, yaw_rad = base.state.tolist()
        states.append((x_m, y_m, yaw_rad))
        speeds_mps.append(float(np.hypot(base.velocity[0], base.velocity[1])))
        assert abs(base.velocity[2]) <= MAX_RADPS + 1e-9
        if said.arrived and speeds_mps[-1] < 1e-6:
            break
    return states, speeds_mps, said


def least_gap_m(states: list[State], boxes: tuple[Box, ...]) -> float:
    """Least distance between the footprint and a box."""
    centers_m = np.array(states)[:, None, :2]
    edges_m = np.array(boxes)
    outside_m = np.maximum(np.maximum(edges_m[:, :2] - centers_m, centers_m - edges_m[:, 2:]), 0.0)
    return float(np.hypot(outside_m[..., 0], outside_m[..., 1]).min()) - RADIUS_M


@pytest.mark.parametrize(
    ("start", "goal", "seconds"),
    [
        ((1.0, 1.0, 0.8), (5.0, 1.0, -1.57), 11.0),
        ((5.0, 2.3, 0.0), (1.0, 1.0, 3.1), 11.0),
        ((1.0, 3.3, -2.0), (4.9, 2.4, 1.57), 11.0),
        ((1.0, 3.3, 0.0), (1.3, 3.4, 2.8), 5.0),
        ((1.0, 1.0, 0.0), (1.0, 1.0, 3.0), 4.5),
    ],
)
def test_a_path_is_followed_to_its_end(start: State, goal: State, seconds: float) -> None:
    """With delay, limited acceleration and a noisy laser the base arrives in time and tolerance and touches nothing."""
    grid = grid_message(inflated(grid_with((*ROOMS, TABLETOP)), RADIUS_M), t_s=0.0)
    way = plan(map=grid, start=at(*start), goal=at(*goal), scan=None, radius_m=RADIUS_M, t_s=0.0, **MOUNT)["path"]
    states, speeds_mps, said = driven(way, start, ROOMS, seconds=seconds)
    assert said.arrived
    assert math.dist(states[-1][:2], goal[:2]) <= 0.05
    assert abs(wrapped(states[-1][2] - goal[2])) <= 0.06
    assert max(speeds_mps) <= MAX_MPS + 1e-9
    assert least_gap_m(states, ROOMS) > 0.05


def test_the_base_does_not_swing_around_the_end() -> None:
    """It comes to the end from one side: the distance never grows, and once arrived it stays arrived."""
    goal = (3.0, 2.0, 0.0)
    states, _, said = driven(way_over((1.0, 2.0, 0.0), goal), (1.0, 2.0, 0.0), WALLS, seconds=8.0)
    assert said.arrived
    distances_m = [math.dist(state[:2], goal[:2]) for state in states]
    assert all(after <= before + 1e-6 for before, after in itertools.pairwise(distances_m))
    assert command(way_over((1.0, 2.0, 0.0), goal), at(*states[-1])).arrived


def test_sharp_corners_are_not_cut() -> None:
    """Around a right angle the base stays within 0.06 m of the path."""
    way = way_over((1.0, 1.0, 0.0), (3.0, 1.0, 1.57), (3.0, 3.0, 1.57))
    states, _, said = driven(way, (1.0, 1.0, 0.0), (), seconds=14.0)
    assert said.arrived
    for x_m, y_m, _ in states:
        to_first = math.hypot(x_m - min(max(x_m, 1.0), 3.0), y_m - 1.0)
        to_second = math.hypot(x_m - 3.0, y_m - min(max(y_m, 1.0), 3.0))
        assert min(to_first, to_second) <= 0.06


def test_a_box_in_the_way_stops_and_is_told() -> None:
    """The base slows down, stops at 0.1 m or more from a box on its path, says `blocked`, and goes on without it."""
    box = (3.0, 1.7, 3.4, 2.3)
    way = way_over((1.0, 2.0, 0.0), (5.0, 2.0, 0.0))
    states, speeds_mps, said = driven(way, (1.0, 2.0, 0.0), (*WALLS, box), seconds=10.0)
    assert (said.arrived, said.blocked) == (False, True)
    assert speeds_mps[-1] < 0.02
    assert 0.1 <= least_gap_m(states, (box,)) <= 0.3
    after = command(way, at(*states[-1]), scan_from(WALLS, states[-1]))
    assert (after.blocked, after.speed_mps > 0.3) == (False, True)


@pytest.mark.parametrize(
    ("gap_m", "least_mps", "most_mps"), [(1.0, 0.7, 0.7), (0.6, 0.4, 0.55), (0.3, 0.1, 0.22), (0.15, 0.0, 0.0)]
)
def test_speed_falls_with_the_free_way(gap_m: float, least_mps: float, most_mps: float) -> None:
    """Full speed beyond 0.8 m of free way, linear below, none at 0.15 m."""
    front_m = 1.0 + RADIUS_M + gap_m
    scan = scan_from(((front_m, -1.0, front_m + 0.3, 1.0),), (1.0, 0.0, 0.0))
    said = command(way_over((1.0, 0.0, 0.0), (6.0, 0.0, 0.0)), at(1.0, 0.0), scan)
    assert least_mps <= said.speed_mps <= most_mps
    assert said.blocked == (gap_m < 0.2)


def test_what_stands_beside_is_passed_slowly() -> None:
    """Something 0.05 m beside the footprint does not stop the base; it passes at 0.3 m/s."""
    scan = scan_from(((1.1, RADIUS_M + 0.05, 1.6, 1.0),), (1.0, 0.0, 0.0))
    said = command(way_over((1.0, 0.0, 0.0), (6.0, 0.0, 0.0)), at(1.0, 0.0), scan)
    assert said.speed_mps == pytest.approx(0.3)
    assert not said.blocked


def test_what_lies_beyond_the_end_is_not_in_the_way() -> None:
    """A goal right before a cabinet is reached."""
    cabinet = (3.0 + RADIUS_M + 0.08, 1.0, 4.0, 3.0)
    states, _, said = driven(way_over((1.0, 2.0, 0.0), (3.0, 2.0, 0.0)), (1.0, 2.0, 0.0), (cabinet,), seconds=9.0)
    assert said.arrived
    assert least_gap_m(states, (cabinet,)) > 0.02


def test_a_bend_before_a_wall_is_taken() -> None:
    """A wall straight ahead that the path turns away from does not block."""
    wall = (3.0 + RADIUS_M + 0.12, -1.0, 4.0, 5.0)
    way = way_over((1.0, 1.0, 0.0), (3.0, 1.0, 1.57), (3.0, 3.0, 1.57))
    _, _, said = driven(way, (1.0, 1.0, 0.0), (wall,), seconds=20.0)
    assert said.arrived


def test_what_is_right_beside_does_not_hold() -> None:
    """A base that all but touches something beside it drives on."""
    post = (0.95, RADIUS_M + 0.01, 1.0, 1.0)
    said = command(way_over((1.0, 0.0, 0.0), (4.0, 0.0, 0.0)), at(1.0, 0.0), scan_from((post,), (1.0, 0.0, 0.0)))
    assert not said.blocked
    assert said.speed_mps >= 0.3


@pytest.mark.parametrize("distance_m", [0.06, 0.1, 0.2, 0.3, 0.45])
def test_the_base_brakes_gently(distance_m: float) -> None:
    """Its speed is one from which 0.5 m/s2 brings it to rest at the end, and not much less."""
    said = command(way_over((0.0, 0.0, 0.0), (3.0, 0.0, 0.0)), at(3.0 - distance_m, 0.0))
    assert distance_m < said.speed_mps <= math.sqrt(distance_m)


def test_where_the_laser_does_not_look_the_base_creeps() -> None:
    """Straight backward it goes at 0.1 m/s, and turns around to see."""
    said = command(way_over((3.0, 0.0, 0.0), (0.0, 0.0, 3.1)), at(3.0, 0.0, 0.0))
    assert said.speed_mps == pytest.approx(0.1)
    assert abs(said.velocity[2]) == pytest.approx(MAX_RADPS)


@settings(deadline=None, max_examples=100, derandomize=True)
@given(
    corners=st.lists(
        st.tuples(st.floats(0.5, 5.5), st.floats(0.5, 3.5), st.floats(-math.pi, math.pi)), min_size=1, max_size=5
    ),
    x_m=st.floats(0.5, 5.5),
    y_m=st.floats(0.5, 3.5),
    yaw_rad=st.floats(-math.pi, math.pi),
)
def test_limits_hold_everywhere(corners: list[State], x_m: float, y_m: float, yaw_rad: float) -> None:
    """Wherever the base is and whatever the path, speeds are within limits, and arrived means near and zero."""
    said = command(way_over(*corners), at(x_m, y_m, yaw_rad), scan_from(ROOMS, (x_m, y_m, yaw_rad)))
    assert np.isfinite(said.velocity).all()
    assert said.speed_mps <= MAX_MPS + 1e-9
    assert abs(said.velocity[2]) <= MAX_RADPS
    near = math.dist((x_m, y_m), corners[-1][:2]) <= 0.05 and abs(wrapped(yaw_rad - corners[-1][2])) <= 0.06
    assert said.arrived == near


@settings(deadline=None, max_examples=30, derandomize=True)
@given(distance_m=st.floats(0.0, 0.049), bearing_rad=st.floats(-3.1, 3.1), turned_rad=st.floats(-0.059, 0.059))
def test_arrived_is_standing_still(distance_m: float, bearing_rad: float, turned_rad: float) -> None:
    """In tolerance of the last pose the velocity is zero, whatever the laser sees."""
    pose = at(3.0 + distance_m * math.cos(bearing_rad), 2.0 + distance_m * math.sin(bearing_rad), 1.0 + turned_rad)
    said = command(way_over((1.0, 1.0, 0.0), (3.0, 2.0, 1.0)), pose, scan_from(ROOMS, (3.0, 2.0, 1.0)))
    assert (said.arrived, said.blocked, said.velocity.tolist()) == (True, False, [0.0, 0.0, 0.0])


def test_the_robots_own_body_is_ignored() -> None:
    """Returns from inside the footprint do not stop it."""
    scan = dataclasses.replace(EMPTY, ranges=np.full(271, 0.1, dtype=np.float32))
    assert command(way_over((0.0, 0.0, 0.0), (3.0, 0.0, 0.0)), at(0.0, 0.0), scan).speed_mps == pytest.approx(MAX_MPS)


def test_bad_requests_are_refused() -> None:
    """Empty paths, poses in another frame and poses that are not numbers are BadInput."""
    way = way_over((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    with pytest.raises(ComputeFailed, match="no poses"):
        command(way_over(), at(0.0, 0.0))
    for pose in (pose_stamped(0.0, 0.0, 0.0, t_s=0.0, frame_id="odom"), at(math.nan, 0.0)):
        with pytest.raises(ComputeFailed, match="BadInput"):
            command(way, pose)
