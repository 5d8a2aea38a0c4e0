"""The sensors against geometry that is worked out by hand."""

from __future__ import annotations

import colorsys
import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from grounding.messages import Image, LaserScan, stamp_s
from tests.sim.conftest import Lab

ANGLES = np.radians(np.arange(-135, 136))


def _to_walls(x: float, y: float, yaw: float, size: float) -> NDArray[np.float64]:
    """Distances (271,) from a point in an empty square room to its walls, one per beam."""
    dx, dy = np.cos(ANGLES + yaw), np.sin(ANGLES + yaw)
    with np.errstate(divide="ignore"):
        in_x = np.where(dx > 0, (size - x) / dx, -x / dx)
        in_y = np.where(dy > 0, (size - y) / dy, -y / dy)
    return np.minimum(np.abs(in_x), np.abs(in_y))


def _to_disc(center: tuple[float, float], radius: float, x: float, y: float) -> NDArray[np.float64]:
    """Distances (271,) from a point with yaw 0 to an upright cylinder; +inf for beams that miss."""
    along = np.cos(ANGLES) * (center[0] - x) + np.sin(ANGLES) * (center[1] - y)
    beside2 = (center[0] - x) ** 2 + (center[1] - y) ** 2 - along**2
    hit = (beside2 < radius**2) & (along > 0)
    return np.where(hit, along - np.sqrt(np.maximum(radius**2 - beside2, 0.0)), np.inf)


def _pixels(image: Image) -> NDArray[np.float64]:
    """Depths (height, width) in m."""
    return image.data.view("<f4").reshape(image.height, image.width).astype(np.float64)


def test_scan_measures_the_walls(room: Callable[..., Lab]) -> None:
    """Ranges are the distances from the laser's mount to the walls, up to noise of 1 cm (1 sigma)."""
    lab = room(8.0, amigo_1=(3.0, 2.5, 0.7))
    mount_x, mount_y = 3.0 + 0.20 * math.cos(0.7), 2.5 + 0.20 * math.sin(0.7)
    errors = np.array([lab.scan("amigo_1").ranges - _to_walls(mount_x, mount_y, 0.7, 8.0) for _ in range(10)])
    assert np.abs(errors).max() < 0.05
    assert abs(errors.mean()) < 0.001
    assert errors.std() == pytest.approx(0.01, rel=0.1)


def test_scan_says_what_it_is(room: Callable[..., Lab]) -> None:
    """Frame, time and geometry of a scan are those of the laser."""
    lab = room(8.0, pico_1=(3.0, 2.5, 0.7))
    lab.wait(1.25)
    scan = lab.scan("pico_1")
    assert scan.header.frame_id == "pico_1/laser"
    assert stamp_s(scan.header.stamp) == 1.25
    assert (len(scan.ranges), scan.range_min, scan.range_max) == (271, 0.05, 12.0)
    assert (scan.angle_min, scan.angle_max) == pytest.approx((math.radians(-135), math.radians(135)))
    assert scan.ranges.dtype == np.float32


def test_nothing_in_range_is_infinite(room: Callable[..., Lab]) -> None:
    """A room with walls farther than 12 m looks empty; the own body is not in the scan."""
    for robot in ("amigo_1", "pico_1"):
        scan: LaserScan = room(40.0, **{robot: (20.0, 20.0, 0.3)}).scan(robot)
        assert np.isposinf(scan.ranges).all()


def test_a_wall_that_the_robot_presses_against_is_seen(room: Callable[..., Lab]) -> None:
    """In contact, also in the moment of impact, no beam passes through the wall."""
    lab = room(4.0, amigo_1=(3.3, 2.0, 0.0))
    for _ in range(90):
        lab.command("amigo_1", 0.7, 0.0, 0.0)
        lab.wait(1 / 60)
        x, y, yaw = lab.fleet.true_pose("amigo_1")
        mount_x, mount_y = x + 0.20 * math.cos(yaw), y + 0.20 * math.sin(yaw)
        assert lab.scan("amigo_1").ranges == pytest.approx(_to_walls(mount_x, mount_y, yaw, 4.0), abs=0.06)
    assert lab.fleet.collisions > 60


@pytest.mark.parametrize("distance", [0.66, 1.5, 4.0])
def test_other_robots_are_seen(room: Callable[..., Lab], distance: float) -> None:
    """Another robot is a disc in the scan, even when the bodies almost touch, and hides nothing beside it."""
    lab = room(40.0, amigo_1=(20.0, 20.0, 0.0), pico_1=(20.0 + distance * 0.8, 20.0 + distance * 0.6, 0.0))
    ranges = lab.scan("amigo_1").ranges
    expected = _to_disc((20.0 + distance * 0.8, 20.0 + distance * 0.6), 0.30, 20.20, 20.0)
    seen = np.isfinite(expected)
    assert seen.sum() >= 5
    # A grazing beam may go either way; all others agree.
    edge = np.convolve(np.diff(seen.astype(int), prepend=0) != 0, [1, 1, 1], mode="same")
    assert (np.isfinite(ranges) == seen)[~edge].all()
    assert ranges[seen & ~edge] == pytest.approx(expected[seen & ~edge], abs=0.05)


def test_scan_passes_below_the_table_top(tue_lab: Callable[..., Lab]) -> None:
    """At 0.30 m the laser sees table legs and the sofa behind, not the top."""
    lab = tue_lab(amigo="at_coffee_table")
    x, y, yaw = lab.fleet.true_pose("amigo_1")
    ranges = lab.scan("amigo_1").ranges
    mount_x, mount_y = x + 0.20 * math.cos(yaw), y + 0.20 * math.sin(yaw)
    ahead = np.abs(ANGLES + yaw - math.pi / 2) < math.radians(8)
    assert ahead.sum() > 10
    front_of_sofa = (7.25 - mount_y) / np.sin(ANGLES + yaw)
    assert ranges[ahead] == pytest.approx(front_of_sofa[ahead], abs=0.05)
    leg = math.atan2(5.83 - mount_y, 2.03 - mount_x) - yaw
    nearest = int(np.abs(ANGLES - math.remainder(leg, math.tau)).argmin())
    assert ranges[nearest] == pytest.approx(math.hypot(5.83 - mount_y, 2.03 - mount_x), abs=0.08)


@pytest.mark.parametrize(
    ("robot", "drink", "height", "hue_deg", "camera"),
    [("amigo_1", "drink_1", 0.20, 120.0, (0.15, 1.20, 0.45)), ("pico_1", "drink_2", 0.13, 0.0, (0.12, 1.05, 0.40))],
)
def test_camera_sees_the_drink_where_it_is(
    tue_lab: Callable[..., Lab],
    robot: str,
    drink: str,
    height: float,
    hue_deg: float,
    camera: tuple[float, float, float],
) -> None:
    """The drink's true position, projected through camera_info, has the drink's hue and depth."""
    lab = tue_lab(amigo="at_coffee_table", pico="at_dining_table")
    color, depth, info = lab.images(robot)
    x, y, yaw = lab.fleet.true_pose(robot)
    thing = np.array(lab.fleet.true_position(drink)) + np.array([0.0, 0.0, height / 2])
    mount_x, mount_z, pitch = camera
    dx, dy = thing[0] - x, thing[1] - y
    ahead = math.cos(yaw) * dx + math.sin(yaw) * dy - mount_x
    left = -math.sin(yaw) * dx + math.cos(yaw) * dy
    below = mount_z - thing[2]
    z = math.cos(pitch) * ahead + math.sin(pitch) * below
    down = math.cos(pitch) * below - math.sin(pitch) * ahead
    k = info.k.reshape(3, 3)
    column, row = round(k[0, 0] * -left / z + k[0, 2]), round(k[1, 1] * down / z + k[1, 2])

    red, green, blue = (color.data.reshape(240, 320, 3)[row, column] / 255.0).tolist()
    hue, saturation, value = colorsys.rgb_to_hsv(red, green, blue)
    assert abs(math.remainder(hue * 360.0 - hue_deg, 360.0)) < 10.0
    assert saturation > 0.6
    assert value > 0.3
    # The surface is about a radius nearer than the middle of the drink.
    assert 0.02 < z - _pixels(depth)[row, column] < 0.06
    # The middle of the drink's pixels is where the true middle is projected.
    pixels = color.data.reshape(240, 320, 3).astype(int)
    drinkish = np.argwhere(pixels.max(axis=2) - pixels.min(axis=2) > 0.6 * pixels.max(axis=2))
    assert len(drinkish) > 100
    assert drinkish.mean(axis=0) == pytest.approx((row, column), abs=3.0)


@pytest.mark.parametrize(("robot", "camera"), [("amigo_1", (0.15, 1.20, 0.45)), ("pico_1", (0.12, 1.05, 0.40))])
def test_depth_of_the_floor(room: Callable[..., Lab], robot: str, camera: tuple[float, float, float]) -> None:
    """In every pixel below the walls the depth is that of the floor, so the own body is in none of them."""
    lab = room(20.0, **{robot: (2.0, 10.0, 0.0)})
    _, depth, info = lab.images(robot)
    _, height, pitch = camera
    k = info.k.reshape(3, 3)
    slope = (np.arange(info.height) - k[1, 2]) / k[1, 1]  # down per forward, one per row
    floor = height / (math.sin(pitch) + slope * math.cos(pitch))
    rows = (floor > 0) & (floor < 8.0)
    assert rows.sum() > 150
    noise = _pixels(depth)[rows] - floor[rows, None]
    spread = (0.0012 + 0.0019 * (floor[rows] - 0.4) ** 2)[:, None]
    assert (noise / spread).std() == pytest.approx(1.0, abs=0.02)
    assert abs((noise / spread).mean()) < 0.02


def test_nothing_near_enough_has_infinite_depth(room: Callable[..., Lab]) -> None:
    """Where the camera sees nothing within 12 m, the depth is +inf (REP 118), and only there."""
    depths = _pixels(room(40.0, pico_1=(5.0, 20.0, 0.0)).images("pico_1")[1])
    assert np.isposinf(depths[0]).all()
    assert np.isfinite(depths[120:]).all()
    assert not np.isnan(depths).any()


def test_images_say_what_they_are(room: Callable[..., Lab]) -> None:
    """Frame, time, size, encoding and field of view are those of the camera."""
    lab = room(8.0, amigo_1=(3.0, 2.5, 0.7))
    lab.wait(0.5)
    color, depth, info = lab.images("amigo_1")
    for message in (color, depth, info):
        assert message.header.frame_id == "amigo_1/camera"
        assert stamp_s(message.header.stamp) == 0.5
        assert (message.width, message.height) == (320, 240)
    assert (color.encoding, color.step, color.data.size) == ("rgb8", 960, 230_400)
    assert (depth.encoding, depth.step, depth.data.size) == ("32FC1", 1280, 307_200)
    assert 2.0 * math.atan(160.0 / info.k[0]) == pytest.approx(1.02)
