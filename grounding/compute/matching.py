"""Matching a laser scan to a map: distances to the surfaces of its obstacles, and the pose that brings them to zero.

Likelihood field: Thrun, Burgard, Fox, "Probabilistic Robotics", 6.4.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from grounding.compute.errors import ComputeFailed
from grounding.compute.grids import OCCUPIED, Grid

PRIOR_SIGMA = np.array([0.2, 0.2, 0.2])  # m, m, rad: holds what the scan leaves open, as along a bare corridor
LASER_SIGMA_M = 0.02
# Scales of the robust weight, one per step: while tracking, and when the robot may be farther off.
NARROW_M = (0.15, 0.1, 0.1, *(0.05,) * 12)  # ends early when the steps get small
WIDE_M = (0.3, 0.3, 0.2, *NARROW_M)
AWAY = 0.3  # cosine between beam and a surface's normal from which the surface faces away; noise stays below
STEP_DONE = 1e-4  # m or rad
MISFIT_SCALE_M = 0.1
MATCHED_WITHIN_M = 0.15  # a return this near to an occupied cell's edge counts as matched

State = NDArray[np.float64]  # x m, y m, yaw rad: map_from_base


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DistanceField:
    """Signed distance to the nearest obstacle's surface, negative inside, m.

    Attributes:
        grid: The map.
        corners_m: Of each square between four cell centers, the distances at its lower left, lower right, upper left
            and upper right corner; shape (rows - 1, columns - 1, 4).
    """

    grid: Grid
    corners_m: NDArray[np.float64]

    def at(self, points_m: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Distance (...) and its gradient (..., 2) at points (..., 2) of the map, bilinear between cell centers."""
        grid = self.grid
        u = (points_m[..., 0] - grid.x_m) / grid.resolution_m - 0.5
        v = (points_m[..., 1] - grid.y_m) / grid.resolution_m - 0.5
        u = np.clip(u, 0.0, grid.columns - 1.001)
        v = np.clip(v, 0.0, grid.rows - 1.001)
        column, row = u.astype(np.intp), v.astype(np.intp)
        u -= column
        v -= row
        ll, lr, ul, ur = np.moveaxis(self.corners_m[row, column], -1, 0)
        low, high = ll + u * (lr - ll), ul + u * (ur - ul)
        slope_x = (1.0 - v) * (lr - ll) + v * (ur - ul)
        return low + v * (high - low), np.stack([slope_x, high - low], axis=-1) / grid.resolution_m


def field_around(grid: Grid, x_m: float, y_m: float) -> DistanceField:
    """The field for a robot at this place: what is closed off from it counts as solid.

    So a wall has the one surface that can be seen, and points a little too far behind it are drawn back to it.
    """
    parts = open_parts(grid)
    row, column = grid.cell_of(x_m, y_m)
    part = int(parts[row, column]) if grid.holds(row, column) else 0
    return field_of_part(grid, part or largest_part(grid))  # 0: off the map or inside an obstacle


def largest_part(grid: Grid) -> int:
    """Number of the largest connected part of what is not occupied."""
    return int(np.bincount(open_parts(grid).ravel(), minlength=2)[1:].argmax()) + 1


@functools.lru_cache(maxsize=8)
def open_parts(grid: Grid) -> NDArray[np.int32]:
    """Number of the connected part each cell that is not occupied belongs to, from 1; 0 for occupied cells."""
    if grid.rows < 2 or grid.columns < 2 or not (grid.cells == OCCUPIED).any():
        raise ComputeFailed("BadInput", "map: nothing to match a scan to; it needs 2 x 2 cells, one of them occupied")
    parts: NDArray[np.int32] = np.zeros((grid.rows, grid.columns), dtype=np.int32)
    ndimage.label(grid.cells != OCCUPIED, output=parts)
    return parts


@functools.lru_cache(maxsize=8)
def field_of_part(grid: Grid, part: int) -> DistanceField:
    """The field for a robot in a connected part."""
    open_ = open_parts(grid) == part
    # From the centers of the cells; their surfaces are half a cell nearer, from either side.
    outside = ndimage.distance_transform_edt(grid.cells != OCCUPIED) - 0.5
    inside = ndimage.distance_transform_edt(~open_) - 0.5
    distance_m = np.where(open_, outside, -inside) * grid.resolution_m
    corners_m = np.stack([distance_m[:-1, :-1], distance_m[:-1, 1:], distance_m[1:, :-1], distance_m[1:, 1:]], axis=-1)
    return DistanceField(grid=grid, corners_m=corners_m)


def matched(
    field: DistanceField,
    points_m: NDArray[np.float64],
    starts: NDArray[np.float64],
    prior: State,
    scales_m: tuple[float, ...],
) -> NDArray[np.float64]:
    """The states (k, 3) near `starts` (k, 3) at which the points (n, 2) of base_link lie on the map's surfaces.

    Args:
        prior: What holds what the scan leaves open, as along a bare corridor: one state, or one for each (k, 3).
        scales_m: Of the robust weight, step by step.
    """
    states = starts
    prior_information = 1.0 / PRIOR_SIGMA**2
    for scale_m in scales_m:
        distances_m, gradient, arm_m, facing = _seen(field, points_m, states)
        turning = gradient[..., 1] * arm_m[..., 0] - gradient[..., 0] * arm_m[..., 1]
        jacobian = np.concatenate([gradient, turning[..., None]], axis=-1)
        weight = facing * (1.0 + (distances_m / scale_m) ** 2) ** -2.0 / LASER_SIGMA_M**2
        weighted = np.swapaxes(jacobian * weight[..., None], -1, -2)
        information = weighted @ jacobian + np.diag(prior_information)
        pull = weighted @ distances_m[..., None] + (prior_information * (states - prior))[..., None]
        steps = -np.linalg.solve(information, pull)[..., 0]
        states = states + np.clip(steps, -0.15, 0.15)
        if scale_m == scales_m[-1] and np.abs(steps).max() < STEP_DONE:
            break
    return states


def misfits(field: DistanceField, points_m: NDArray[np.float64], states: NDArray[np.float64]) -> NDArray[np.float64]:
    """How badly the points fit at states (k, 3), 0 (all on surfaces that face the robot) to 1; shape (k,)."""
    distances_m, _, _, facing = _seen(field, points_m, states)
    squares = distances_m**2
    misfits: NDArray[np.float64] = np.where(facing, squares / (squares + MISFIT_SCALE_M**2), 1.0).mean(axis=-1)
    return misfits


def _seen(
    field: DistanceField, points_m: NDArray[np.float64], states: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """The points (n, 2) of base_link seen from states (k, 3).

    Returns:
        Their distances (k, n) to the nearest surfaces and the gradients (k, n, 2); their places relative to the robot,
        along the axes of the map (k, n, 2); and whether the nearest surface faces the robot (k, n). One that does not
        cannot be what it sees, as the far side of a thin wall.
    """
    c, s = np.cos(states[:, 2:]), np.sin(states[:, 2:])
    arm_m = np.stack([c * points_m[:, 0] - s * points_m[:, 1], s * points_m[:, 0] + c * points_m[:, 1]], axis=-1)
    distances_m, gradient = field.at(states[:, None, :2] + arm_m)
    away = (gradient * arm_m).sum(axis=-1)
    return distances_m, gradient, arm_m, away <= AWAY * np.sqrt((arm_m**2).sum(axis=-1))
