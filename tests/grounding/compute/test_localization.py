from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grounding.compute.errors import ComputeFailed
from grounding.compute.grids import grid_message
from grounding.compute.localization import pose
from grounding.compute.scans import wrapped
from grounding.messages import (
    LaserScan,
    OccupancyGrid,
    Odometry,
    PoseStamped,
    PoseWithCovariance,
    Twist,
    TwistWithCovariance,
    Vector3,
    header,
    planar_pose,
    pose_stamped,
    stamp_s,
    xyyaw,
)
from tests.grounding.compute.rooms import MOUNT, ROOMS, WALLS, Box, at, grid_with, scan_from

MAP = grid_message(grid_with(ROOMS), t_s=0.0)
State = tuple[float, float, float]


def localized(
    scan: LaserScan, last: PoseStamped, *, odometry: Odometry | None = None, grid: OccupancyGrid = MAP
) -> PoseStamped:
    """The pose from a scan."""
    return pose(map=grid, scan=scan, last_pose=last, odometry=odometry, t_s=9.0, **MOUNT)["pose"]


def moving(x_mps: float, y_mps: float, yaw_radps: float, *, t_s: float = 0.0) -> Odometry:
    """Odometry with this velocity, measured at a time."""
    twist = Twist(linear=Vector3(x=x_mps, y=y_mps, z=0.0), angular=Vector3(x=0.0, y=0.0, z=yaw_radps))
    return Odometry(
        header=header("robot/odom", t_s),
        child_frame_id="robot/base_link",
        pose=PoseWithCovariance(pose=planar_pose(0.0, 0.0, 0.0), covariance=np.zeros(36)),
        twist=TwistWithCovariance(twist=twist, covariance=np.zeros(36)),
    )


def assert_near(found: PoseStamped, truth: State, *, within_m: float = 0.03, within_deg: float = 1.0) -> None:
    """The pose is the truth within these errors."""
    x_m, y_m, yaw_rad = xyyaw(found.pose)
    assert math.dist((x_m, y_m), truth[:2]) <= within_m
    assert abs(wrapped(yaw_rad - truth[2])) <= math.radians(within_deg)


@settings(deadline=None, max_examples=60, derandomize=True)
@given(
    x_m=st.floats(0.9, 2.5) | st.floats(3.5, 5.5),
    y_m=st.floats(0.5, 2.6),
    yaw_rad=st.floats(-math.pi, math.pi),
    off_rad=st.floats(-math.pi, math.pi),
    turned_rad=st.sampled_from([-0.1, 0.1]),
    seed=st.integers(0, 1000),
)
def test_a_wrong_prior_is_put_right(
    x_m: float, y_m: float, yaw_rad: float, off_rad: float, turned_rad: float, seed: int
) -> None:
    """From noisy scans and priors off by 0.15 m and 0.1 rad the pose is found within 0.03 m and 1 degree."""
    truth = (x_m, y_m, yaw_rad)
    prior = at(x_m + 0.15 * math.cos(off_rad), y_m + 0.15 * math.sin(off_rad), yaw_rad + turned_rad)
    assert_near(localized(scan_from(ROOMS, truth, noise=np.random.default_rng(seed)), prior), truth)


@pytest.mark.parametrize("truth", [(1.4, 1.0, 0.3), (4.2, 2.0, -2.0), (1.5, 3.3, 3.1), (3.6, 0.7, 1.6)])
def test_who_is_not_on_the_map_does_not_pull(truth: State) -> None:
    """Two people and a robot near by cost less than 0.02 m while tracking."""
    x_m, y_m, yaw_rad = truth
    strangers: list[Box] = []
    for angle_rad, far_m in ((-1.0, 0.7), (0.2, 0.9), (1.2, 0.6)):
        stands_x_m, stands_y_m = (
            x_m + far_m * math.cos(yaw_rad + angle_rad),
            y_m + far_m * math.sin(yaw_rad + angle_rad),
        )
        strangers.append((stands_x_m - 0.15, stands_y_m - 0.15, stands_x_m + 0.15, stands_y_m + 0.15))
    scan = scan_from((*ROOMS, *strangers), truth, noise=np.random.default_rng(5))
    assert_near(localized(scan, at(x_m + 0.03, y_m - 0.02, yaw_rad + 0.02)), truth, within_m=0.02)


def test_odometry_moves_the_prior_on() -> None:
    """A robot that drove and turned for 0.8 s, too far for the scan alone, is found; the stamp is the scan's."""
    truth = (2.0, 2.1, 0.9)
    middle_rad = truth[2] - 0.4
    last = at(
        truth[0] - 0.56 * math.cos(middle_rad) + 0.24 * math.sin(middle_rad),
        truth[1] - 0.56 * math.sin(middle_rad) - 0.24 * math.cos(middle_rad),
        truth[2] - 0.8,
        t_s=1.0,
    )
    scan = scan_from(ROOMS, truth, t_s=1.8, noise=np.random.default_rng(2))
    found = localized(scan, last, odometry=moving(0.7, 0.3, 1.0, t_s=1.3))
    assert_near(found, truth)
    assert stamp_s(found.header.stamp) == pytest.approx(1.8)
    assert found.header.frame_id == "map"


def test_an_old_velocity_is_not_trusted_for_long() -> None:
    """After minutes without a scan the prior is moved on by less than a second of the velocity, not by minutes."""
    truth = (1.55, 1.0, 0.0)
    scan = scan_from(ROOMS, truth, t_s=100.0, noise=np.random.default_rng(2))
    assert_near(localized(scan, at(1.5, 1.0, t_s=0.0), odometry=moving(0.05, 0.0, 0.0)), truth)


def test_a_velocity_from_before_the_last_pose_says_nothing() -> None:
    """The robot has stopped since; where it was found then, it still is."""
    truth = (1.55, 1.0, 0.0)
    scan = scan_from(ROOMS, truth, t_s=46.6, noise=np.random.default_rng(2))
    assert_near(localized(scan, at(*truth, t_s=46.0), odometry=moving(0.7, 0.3, 1.2, t_s=40.0)), truth)


def test_a_drive_is_tracked_without_odometry() -> None:
    """Scan by scan along an arc at 30 Hz, each pose the next one's prior, the error stays below 0.02 m."""
    noise = np.random.default_rng(7)
    last = at(1.0, 0.7)
    for step in range(60):
        turned_rad = step / 30.0 * 0.5
        truth = (1.0 + 1.2 * math.sin(turned_rad), 0.7 + 1.2 * (1.0 - math.cos(turned_rad)), turned_rad)
        last = localized(scan_from(ROOMS, truth, t_s=step / 30.0, noise=noise), last)
        assert_near(last, truth, within_m=0.02)


def test_a_bare_corridor_holds_the_prior_along_it() -> None:
    """What the scan leaves open stays as odometry says: no drift along two parallel walls without ends."""
    walls: tuple[Box, ...] = ((-0.2, -0.1, 6.2, 0.0), (-0.2, 2.0, 6.2, 2.1))
    grid = grid_message(grid_with(walls), t_s=0.0)
    scan = scan_from(walls, (3.0, 1.1, 0.05), noise=np.random.default_rng(3), range_max_m=2.0)
    x_m, y_m, yaw_rad = xyyaw(localized(scan, at(3.0, 1.0), grid=grid).pose)
    assert x_m == pytest.approx(3.0, abs=0.03)
    assert y_m == pytest.approx(1.1, abs=0.01)
    assert yaw_rad == pytest.approx(0.05, abs=0.01)


def test_the_surface_of_a_wall_is_at_the_edge_of_its_cells() -> None:
    """With one wall in reach and no noise the distance to it is right within 3 mm."""
    walls: tuple[Box, ...] = ((-0.2, -0.1, 6.2, 0.0),)
    scan = scan_from(walls, (3.0, 1.02, 0.0), range_max_m=2.0)
    found = localized(scan, at(3.0, 1.05), grid=grid_message(grid_with(walls), t_s=0.0))
    assert found.pose.position.y == pytest.approx(1.02, abs=0.003)


def test_a_scan_of_another_place_is_refused() -> None:
    """If the walls are meters from where the map has them, NotLocalized tells how little fits."""
    elsewhere = scan_from(((-1.0, -1.0, 0.0, 0.2), (1.2, -0.6, 1.3, 0.6)), (0.5, 0.0, 0.0))
    with pytest.raises(ComputeFailed) as caught:
        localized(elsewhere, at(4.2, 1.9, 0.0), grid=grid_message(grid_with(WALLS), t_s=0.0))
    assert caught.value.code == "NotLocalized"
    assert "30%" in caught.value.message


def test_a_scan_without_returns_is_refused() -> None:
    """Nothing seen, nothing known."""
    with pytest.raises(ComputeFailed, match=r"NotLocalized.*0 returns"):
        localized(scan_from((), (1.0, 1.0, 0.0)), at(1.0, 1.0))


def test_bad_requests_are_refused() -> None:
    """Poses in another frame, poses that are not numbers and maps without obstacles are BadInput."""
    scan = scan_from(ROOMS, (1.0, 1.0, 0.0))
    for last in (pose_stamped(1.0, 1.0, 0.0, t_s=0.0, frame_id="odom"), at(math.nan, 1.0)):
        with pytest.raises(ComputeFailed, match="BadInput"):
            localized(scan, last)
    with pytest.raises(ComputeFailed, match=r"BadInput.*nothing to match"):
        localized(scan, at(1.0, 1.0), grid=grid_message(grid_with(()), t_s=0.0))


def test_the_same_call_gives_the_same_pose() -> None:
    """Bit for bit."""
    scan = scan_from(ROOMS, (1.3, 0.8, 0.4), noise=np.random.default_rng(1))
    assert localized(scan, at(1.4, 0.9, 0.3)) == localized(scan, at(1.4, 0.9, 0.3))
