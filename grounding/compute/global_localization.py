"""Localization from nothing: where on the map a robot may be that does not know it.

Poses all over the open part of the map are compared with the scan; the best are matched as in localization.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from grounding.compute.errors import ComputeFailed
from grounding.compute.grids import grid_of
from grounding.compute.matching import (
    MATCHED_WITHIN_M,
    WIDE_M,
    DistanceField,
    State,
    field_of_part,
    largest_part,
    matched,
    misfits,
    open_parts,
)
from grounding.compute.scans import moved, points_of, wrapped
from grounding.messages import LaserScan, OccupancyGrid, PoseStamped, pose_stamped, stamp_s

EVERY_M = 0.25  # between the places that are tried
EVERY_RAD = math.radians(12.0)
CLEAR_M = 0.15  # no robot is nearer to an obstacle with its center
SCREENED_WITH = 60  # returns of the scan, evenly taken
AT_ONCE = 4096  # poses; bounds memory
MATCHED_OF_BEST = 60
MATCHED_AT_LEAST = 0.75  # share of the returns: there is no last pose that speaks for a match
OTHER_PLACE_M, OTHER_YAW_RAD = 0.5, 0.5
CLEARLY = 0.02  # by so much less misfit than anywhere else


def pose_anywhere(
    *,
    map: OccupancyGrid,  # noqa: A002  (the field's name)
    scan: LaserScan,
    laser_x_m: float,
    laser_y_m: float,
    laser_yaw_rad: float,
    t_s: float,
) -> dict[str, PoseStamped]:
    """The robot's pose at the time of the scan, wherever on the map it is.

    That takes longer the more open places there are: half a second on 10 m x 8 m, eight on 40 m x 40 m.

    Args:
        map: What the laser sees of the site (`loc_map`).
        scan: The scan to match.
        laser_x_m: Mount, base_from_laser.
        laser_y_m: Mount, base_from_laser.
        laser_yaw_rad: Mount, base_from_laser.
        t_s: Time of the call; the pose bears the scan's stamp instead.

    Returns:
        `pose`: map_from_base at the scan's stamp.

    Raises:
        ComputeFailed: NotLocalized, if less than 75 % of the returns fit the map anywhere, or if they fit nearly as
            well at another place: the robot should be somewhere else then to find out.
    """
    points_m = points_of(scan, x_m=laser_x_m, y_m=laser_y_m, yaw_rad=laser_yaw_rad)
    grid = grid_of(map)
    part = largest_part(grid)
    field = field_of_part(grid, part)
    places = ndimage.distance_transform_edt(open_parts(grid) == part) * grid.resolution_m > CLEAR_M
    step = max(1, round(EVERY_M / grid.resolution_m))
    rows, columns = np.nonzero(places[::step, ::step])
    if not len(rows) or not len(points_m):
        raise ComputeFailed("NotLocalized", f"the scan has {len(points_m)} returns, the map {len(rows)} open places")
    cells = np.stack([columns, rows], axis=-1).astype(np.float64) * step + 0.5
    centers_m = cells * grid.resolution_m + np.array([grid.x_m, grid.y_m])
    starts = _best_starts(field, points_m, centers_m)
    found = matched(field, points_m, starts, starts, WIDE_M)
    fits = misfits(field, points_m, found)
    best = int(np.argmin(fits))
    distances_m, _ = field.at(moved(points_m, *found[best]))
    share = float((np.abs(distances_m) <= MATCHED_WITHIN_M).mean())
    x_m, y_m, yaw_rad = found[best].tolist()
    if share < MATCHED_AT_LEAST:
        told = f"the best fit on all of the map, at ({x_m:.2f}, {y_m:.2f}) m, explains {share:.0%} of the returns"
        raise ComputeFailed("NotLocalized", f"{told}; at least {MATCHED_AT_LEAST:.0%} must be")
    others = _elsewhere(found, found[best]) & (fits < fits[best] + CLEARLY)
    if others.any():
        x2_m, y2_m, _ = found[others][0].tolist()
        told = f"the scan fits as well at ({x_m:.2f}, {y_m:.2f}) m as at ({x2_m:.2f}, {y2_m:.2f}) m"
        raise ComputeFailed("NotLocalized", f"{told}; drive elsewhere to tell them apart")
    scan_s = stamp_s(scan.header.stamp)
    return {"pose": pose_stamped(x_m, y_m, wrapped(yaw_rad), t_s=scan_s, frame_id=map.header.frame_id)}


def _best_starts(
    field: DistanceField, points_m: NDArray[np.float64], centers_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The states (k, 3) at these places (n, 2), in all directions, that fit best."""
    few_m = points_m[:: max(1, len(points_m) // SCREENED_WITH)]
    yaws_rad = np.arange(0.0, 2.0 * math.pi, EVERY_RAD)
    states = np.column_stack([np.repeat(centers_m, len(yaws_rad), axis=0), np.tile(yaws_rad, len(centers_m))])
    chunks = [states[at : at + AT_ONCE] for at in range(0, len(states), AT_ONCE)]
    fits = np.concatenate([misfits(field, few_m, chunk) for chunk in chunks])
    best: NDArray[np.float64] = states[np.argsort(fits, kind="stable")[:MATCHED_OF_BEST]]
    return best


def _elsewhere(states: NDArray[np.float64], one: State) -> NDArray[np.bool_]:
    """Which of these states (k, 3) are at another place, or look another way, than one."""
    turned_rad = np.abs((states[:, 2] - one[2] + math.pi) % (2.0 * math.pi) - math.pi)
    far_m = np.linalg.norm(states[:, :2] - one[:2], axis=1)
    elsewhere: NDArray[np.bool_] = (far_m > OTHER_PLACE_M) | (turned_rad > OTHER_YAW_RAD)
    return elsewhere
