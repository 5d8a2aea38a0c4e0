"""Laser scans as points."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from grounding.compute.errors import ComputeFailed
from grounding.messages import LaserScan


def points_of(scan: LaserScan, *, x_m: float, y_m: float, yaw_rad: float) -> NDArray[np.float64]:
    """The returns of a scan in base_link, shape (n, 2), m.

    Beams without a return (inf, nan, outside range_min..range_max) give no point.

    Args:
        scan: The scan, in the frame of the laser.
        x_m: Mount, base_from_laser.
        y_m: Mount, base_from_laser.
        yaw_rad: Mount, base_from_laser.

    Raises:
        ComputeFailed: BadInput, if the scan's angles are not numbers.
    """
    if not (math.isfinite(scan.angle_min) and math.isfinite(scan.angle_increment)):
        raise ComputeFailed(
            "BadInput", f"scan: angle_min {scan.angle_min}, angle_increment {scan.angle_increment}; both must be finite"
        )
    ranges_m = np.asarray(scan.ranges, dtype=np.float64)
    hit = (ranges_m >= scan.range_min) & (ranges_m <= scan.range_max) & np.isfinite(ranges_m)
    angles_rad = scan.angle_min + scan.angle_increment * np.flatnonzero(hit) + yaw_rad
    ranges_m = ranges_m[hit]
    return np.stack([x_m + ranges_m * np.cos(angles_rad), y_m + ranges_m * np.sin(angles_rad)], axis=-1)


def moved(points_m: NDArray[np.float64], x_m: float, y_m: float, yaw_rad: float) -> NDArray[np.float64]:
    """Points (n, 2) of frame b in frame a, where (x, y, yaw) is a_from_b."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.stack([x_m + c * points_m[:, 0] - s * points_m[:, 1], y_m + s * points_m[:, 0] + c * points_m[:, 1]], -1)


def wrapped(angle_rad: float) -> float:
    """The same angle in [-pi, pi]."""
    return math.remainder(angle_rad, math.tau)
