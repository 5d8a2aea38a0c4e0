"""Where on the map a robot is that does not know it: near the truth, or told that it cannot be said."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grounding.compute.errors import ComputeFailed
from grounding.compute.global_localization import pose_anywhere
from grounding.compute.grids import grid_message
from grounding.compute.scans import wrapped
from grounding.messages import LaserScan, xyyaw
from tests.grounding.compute.rooms import MOUNT, ROOMS, Box, grid_with, scan_from

MAP = grid_message(grid_with(ROOMS), t_s=0.0)
SQUARE: tuple[Box, ...] = ((-0.1, -0.1, 4.1, 0.0), (-0.1, 4.0, 4.1, 4.1), (-0.1, 0.0, 0.0, 4.0), (4.0, 0.0, 4.1, 4.0))
"""A room that looks the same from all four sides."""
CORRIDOR: tuple[Box, ...] = ((0.0, 2.6, 12.0, 2.7), (0.0, 0.0, 12.0, 0.1), (0.0, 0.0, 0.1, 2.6), (11.9, 0.0, 12.0, 2.6))


def found_from(scan: LaserScan) -> tuple[float, float, float] | None:
    """The pose on the map; None if it is told that there are several."""
    try:
        return xyyaw(pose_anywhere(map=MAP, scan=scan, t_s=9.0, **MOUNT)["pose"].pose)
    except ComputeFailed as failed:
        if "fits as well at" in failed.message:
            return None
        raise


def is_near(found: tuple[float, float, float], truth: tuple[float, float, float]) -> bool:
    """Within 0.03 m and 1 degree."""
    return math.dist(found[:2], truth[:2]) <= 0.03 and abs(wrapped(found[2] - truth[2])) <= math.radians(1.0)


@settings(deadline=None, max_examples=25, derandomize=True)
@given(
    x_m=st.floats(0.9, 2.5) | st.floats(3.5, 5.5),
    y_m=st.floats(0.5, 2.6),
    yaw_rad=st.floats(-math.pi, math.pi),
    seed=st.integers(0, 1000),
)
def test_a_robot_is_never_found_where_it_is_not(x_m: float, y_m: float, yaw_rad: float, seed: int) -> None:
    """From noisy scans: near the truth, or it is told that the scan fits elsewhere as well."""
    found = found_from(scan_from(ROOMS, (x_m, y_m, yaw_rad), noise=np.random.default_rng(seed)))
    assert found is None or is_near(found, (x_m, y_m, yaw_rad))


def test_a_robot_is_found_nearly_everywhere() -> None:
    """At 18 of 20 random places and more; the two rooms look alike, so that not all can be told apart."""
    rng = np.random.default_rng(5)
    drawn = rng.uniform((0.9, 0.5, -3.0), (2.5, 2.6, 3.0), (20, 3)).tolist()
    truths = [(x_m, y_m, yaw_rad) for x_m, y_m, yaw_rad in drawn]
    found = [found_from(scan_from(ROOMS, truth, noise=rng)) for truth in truths]
    assert sum(one is not None and is_near(one, truth) for one, truth in zip(found, truths, strict=True)) >= 18


def test_what_fits_at_several_places_is_no_place() -> None:
    """In a square room there are four."""
    grid = grid_message(grid_with(SQUARE, width_m=4.5), t_s=0.0)
    with pytest.raises(ComputeFailed, match="drive elsewhere to tell them apart"):
        pose_anywhere(map=grid, scan=scan_from(SQUARE, (1.2, 1.7, 0.4)), t_s=0.0, **MOUNT)


def test_a_scan_of_elsewhere_fits_nowhere() -> None:
    """At least three of four returns must be explained."""
    with pytest.raises(ComputeFailed, match="at least 75% must be") as failed:
        pose_anywhere(map=MAP, scan=scan_from(CORRIDOR, (6.0, 1.3, 0.3)), t_s=0.0, **MOUNT)
    assert failed.value.code == "NotLocalized"
