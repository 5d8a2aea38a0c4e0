"""Localization: where the robot is on the map, by matching a laser scan to it.

The end points of the beams should lie on the surfaces of the map's obstacles. The signed distance to these surfaces is
worked out once per map; the pose that brings the points' distances to zero is found by Gauss-Newton steps from where
odometry says the robot is, with a robust weight (Geman-McClure) whose scale narrows, so that people, robots and table
legs that the map does not have do not pull. Likelihood field: Thrun, Burgard, Fox, "Probabilistic Robotics", 6.4.
"""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from grounding.compute.errors import ComputeFailed
from grounding.compute.grids import OCCUPIED, Grid, grid_of
from grounding.compute.scans import moved, points_of, wrapped
from grounding.messages import LaserScan, OccupancyGrid, Odometry, PoseStamped, pose_stamped, stamp_s, xyyaw

MATCHED_WITHIN_M = 0.15  # a return this near to an occupied cell's edge counts as matched
MATCHED_AT_LEAST = 0.30  # share of the returns that must be matched
RETURNS_AT_LEAST = 10  # fewer do not tell three coordinates from noise
TRUSTED_FOR_S = 1.0  # a base's watchdog stops it: a velocity says nothing about longer times
LASER_SIGMA_M = 0.02
PRIOR_SIGMA = np.array([0.2, 0.2, 0.2])  # m, m, rad: holds what the scan leaves open, as along a bare corridor
# Scales of the robust weight, one per step: while tracking, and when the robot may be farther off.
NARROW_M = (0.15, 0.1, 0.1, *(0.05,) * 12)  # ends early when the steps get small
WIDE_M = (0.3, 0.3, 0.2, *NARROW_M)
AWAY = 0.3  # cosine between beam and a surface's normal from which the surface faces away; noise stays below
STEP_DONE = 1e-4  # m or rad
MISFIT_SCALE_M = 0.1
POOR_MISFIT = 0.3  # above it other starts are tried,
SURPRISING = np.array([0.18, 0.18, 0.15])  # and if the match is so far from the prior, m, m, rad
OFFSETS = np.array(
    [(dx, dy, dyaw) for dyaw in (0.0, -0.075, 0.075, -0.15, 0.15) for dx in (0.0, -0.2, 0.2) for dy in (0.0, -0.2, 0.2)]
)
SCREEN_EVERY = 2  # every second return tells which offsets are worth a try
OFFSETS_TRIED = 3
FARTHEST = np.array([0.4, 0.4, 0.3])  # from the prior, m, m, rad: a match farther off is a chance one

State = NDArray[np.float64]  # x m, y m, yaw rad: map_from_base


def pose(
    *,
    map: OccupancyGrid,  # noqa: A002  (the field's name)
    scan: LaserScan,
    last_pose: PoseStamped,
    odometry: Odometry | None,
    laser_x_m: float,
    laser_y_m: float,
    laser_yaw_rad: float,
    t_s: float,
) -> dict[str, PoseStamped]:
    """The robot's pose at the time of the scan.

    Args:
        map: What the laser sees of the site (`loc_map`).
        scan: The scan to match.
        last_pose: Where the robot was, in the map's frame; within about 0.2 m and 0.15 rad once moved on by odometry.
        odometry: Its twist moves `last_pose` on to the time of the scan, by 1 s at most; None: the robot stood still.
        laser_x_m: Mount, base_from_laser.
        laser_y_m: Mount, base_from_laser.
        laser_yaw_rad: Mount, base_from_laser.
        t_s: Time of the call; the pose bears the scan's stamp instead.

    Returns:
        `pose`: map_from_base at the scan's stamp.

    Raises:
        ComputeFailed: NotLocalized, if there are fewer than 10 returns or less than 30 % of them are within 0.15 m of
            an occupied cell; BadInput, if frames differ or the last pose is not finite.
    """
    frame_id = map.header.frame_id
    if last_pose.header.frame_id != frame_id:
        raise ComputeFailed(
            "BadInput", f"pose: last_pose is in frame {last_pose.header.frame_id!r}, the map in {frame_id!r}"
        )
    scan_s = stamp_s(scan.header.stamp)
    prior = _moved_on(last_pose, odometry, scan_s - stamp_s(last_pose.header.stamp))
    if not np.isfinite(prior).all():
        raise ComputeFailed("BadInput", f"pose: last_pose moved on by odometry is {prior.tolist()}; it must be finite")
    points_m = points_of(scan, x_m=laser_x_m, y_m=laser_y_m, yaw_rad=laser_yaw_rad)
    if len(points_m) < RETURNS_AT_LEAST:
        raise ComputeFailed(
            "NotLocalized", f"the scan has {len(points_m)} returns, at least {RETURNS_AT_LEAST} are needed"
        )
    field = _field_around(grid_of(map), float(prior[0]), float(prior[1]))

    found = _matched(field, points_m, prior[None], prior, NARROW_M)
    surprising = (np.abs(found - prior) > SURPRISING).any()
    if surprising or _misfits(field, points_m, found)[0] > POOR_MISFIT:
        starts = prior + OFFSETS  # the first is the prior itself
        best_starts = np.argsort(_misfits(field, points_m[::SCREEN_EVERY], starts), kind="stable")[:OFFSETS_TRIED]
        found = np.concatenate([found, _matched(field, points_m, starts[[0, *best_starts]], prior, WIDE_M)])
    too_far = np.asarray((np.abs(found - prior) > FARTHEST).any(axis=1))
    chosen = np.argmin(_misfits(field, points_m, found) + too_far)  # a misfit is 1 at most
    best = found[chosen]
    distances_m, _ = field.at(moved(points_m, *best))
    matched = 0.0 if too_far[chosen] else float((np.abs(distances_m) <= MATCHED_WITHIN_M).mean())
    if matched < MATCHED_AT_LEAST:
        raise ComputeFailed(
            "NotLocalized",
            f"{matched:.0%} of {len(points_m)} returns fit the map near ({prior[0]:.2f}, {prior[1]:.2f}) m, "
            f"{prior[2]:.2f} rad; at least {MATCHED_AT_LEAST:.0%} must",
        )
    x_m, y_m, yaw_rad = best.tolist()
    return {"pose": pose_stamped(x_m, y_m, wrapped(yaw_rad), t_s=scan_s, frame_id=frame_id)}


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Field:
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


def _field_around(grid: Grid, x_m: float, y_m: float) -> _Field:
    """The field for a robot at this place: what is closed off from it counts as solid.

    So a wall has the one surface that can be seen, and points a little too far behind it are drawn back to it.
    """
    parts = _open_parts(grid)
    row, column = grid.cell_of(x_m, y_m)
    part = int(parts[row, column]) if grid.holds(row, column) else 0
    if part == 0:  # off the map or inside an obstacle: take the largest
        part = int(np.bincount(parts.ravel(), minlength=2)[1:].argmax()) + 1
    return _field(grid, part)


@functools.lru_cache(maxsize=8)
def _open_parts(grid: Grid) -> NDArray[np.int32]:
    """Number of the connected part each cell that is not occupied belongs to, from 1; 0 for occupied cells."""
    if grid.rows < 2 or grid.columns < 2 or not (grid.cells == OCCUPIED).any():
        raise ComputeFailed("BadInput", "map: nothing to match a scan to; it needs 2 x 2 cells, one of them occupied")
    parts: NDArray[np.int32] = np.zeros((grid.rows, grid.columns), dtype=np.int32)
    ndimage.label(grid.cells != OCCUPIED, output=parts)
    return parts


@functools.lru_cache(maxsize=8)
def _field(grid: Grid, part: int) -> _Field:
    open_ = _open_parts(grid) == part
    # From the centers of the cells; their surfaces are half a cell nearer, from either side.
    outside = ndimage.distance_transform_edt(grid.cells != OCCUPIED) - 0.5
    inside = ndimage.distance_transform_edt(~open_) - 0.5
    distance_m = np.where(open_, outside, -inside) * grid.resolution_m
    corners_m = np.stack([distance_m[:-1, :-1], distance_m[:-1, 1:], distance_m[1:, :-1], distance_m[1:, 1:]], axis=-1)
    return _Field(grid=grid, corners_m=corners_m)


def _moved_on(last_pose: PoseStamped, odometry: Odometry | None, elapsed_s: float) -> State:
    """The last pose after `elapsed_s` of the odometry's body velocity, along the chord of the arc."""
    x_m, y_m, yaw_rad = xyyaw(last_pose.pose)
    if odometry is None:
        return np.array([x_m, y_m, yaw_rad])
    elapsed_s = min(max(elapsed_s, 0.0), TRUSTED_FOR_S)
    twist = odometry.twist.twist
    turn_rad = twist.angular.z * elapsed_s
    forward_m, left_m = twist.linear.x * elapsed_s, twist.linear.y * elapsed_s
    c, s = math.cos(yaw_rad + turn_rad / 2.0), math.sin(yaw_rad + turn_rad / 2.0)
    return np.array([x_m + c * forward_m - s * left_m, y_m + s * forward_m + c * left_m, yaw_rad + turn_rad])


def _matched(
    field: _Field,
    points_m: NDArray[np.float64],
    starts: NDArray[np.float64],
    prior: State,
    scales_m: tuple[float, ...],
) -> NDArray[np.float64]:
    """The states (k, 3) near `starts` (k, 3) at which the points (n, 2) of base_link lie on the map's surfaces."""
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


def _misfits(field: _Field, points_m: NDArray[np.float64], states: NDArray[np.float64]) -> NDArray[np.float64]:
    """How badly the points fit at states (k, 3), 0 (all on surfaces that face the robot) to 1; shape (k,)."""
    distances_m, _, _, facing = _seen(field, points_m, states)
    squares = distances_m**2
    misfits: NDArray[np.float64] = np.where(facing, squares / (squares + MISFIT_SCALE_M**2), 1.0).mean(axis=-1)
    return misfits


def _seen(
    field: _Field, points_m: NDArray[np.float64], states: NDArray[np.float64]
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
