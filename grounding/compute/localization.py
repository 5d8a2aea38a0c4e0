"""Localization: where the robot is on the map, by matching a laser scan to it.

The end points of the beams should lie on the surfaces of the map's obstacles. The signed distance to these surfaces is
worked out once per map; the pose that brings the points' distances to zero is found by Gauss-Newton steps from where
odometry says the robot is, with a robust weight (Geman-McClure) whose scale narrows, so that people, robots and table
legs that the map does not have do not pull (grounding/compute/matching.py).
"""

from __future__ import annotations

import math

import numpy as np

from grounding.compute.errors import ComputeFailed
from grounding.compute.grids import grid_of
from grounding.compute.matching import MATCHED_WITHIN_M, NARROW_M, WIDE_M, State, field_around, matched, misfits
from grounding.compute.scans import moved, points_of, wrapped
from grounding.messages import LaserScan, OccupancyGrid, Odometry, PoseStamped, pose_stamped, stamp_s, xyyaw

MATCHED_AT_LEAST = 0.30  # share of the returns that must be matched
RETURNS_AT_LEAST = 10  # fewer do not tell three coordinates from noise
TRUSTED_FOR_S = 0.6  # a base's watchdog stops it: a velocity says nothing about longer times
POOR_MISFIT = 0.3  # above it other starts are tried,
SURPRISING = np.array([0.18, 0.18, 0.15])  # and if the match is so far from the prior, m, m, rad
OFFSETS = np.array(
    [(dx, dy, dyaw) for dyaw in (0.0, -0.075, 0.075, -0.15, 0.15) for dx in (0.0, -0.2, 0.2) for dy in (0.0, -0.2, 0.2)]
)
SCREEN_EVERY = 2  # every second return tells which offsets are worth a try
OFFSETS_TRIED = 3
FARTHEST = np.array([0.4, 0.4, 0.3])  # from the prior, m, m, rad: a match farther off is a chance one


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
        odometry: Its twist moves `last_pose` on to the time of the scan, but not beyond 0.6 s after it was measured;
            None: the robot stood still.
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
    prior = _moved_on(last_pose, odometry, scan_s)
    if not np.isfinite(prior).all():
        raise ComputeFailed("BadInput", f"pose: last_pose moved on by odometry is {prior.tolist()}; it must be finite")
    points_m = points_of(scan, x_m=laser_x_m, y_m=laser_y_m, yaw_rad=laser_yaw_rad)
    if len(points_m) < RETURNS_AT_LEAST:
        raise ComputeFailed(
            "NotLocalized", f"the scan has {len(points_m)} returns, at least {RETURNS_AT_LEAST} are needed"
        )
    field = field_around(grid_of(map), float(prior[0]), float(prior[1]))

    found = matched(field, points_m, prior[None], prior, NARROW_M)
    surprising = (np.abs(found - prior) > SURPRISING).any()
    if surprising or misfits(field, points_m, found)[0] > POOR_MISFIT:
        starts = prior + OFFSETS  # the first is the prior itself
        best_starts = np.argsort(misfits(field, points_m[::SCREEN_EVERY], starts), kind="stable")[:OFFSETS_TRIED]
        found = np.concatenate([found, matched(field, points_m, starts[[0, *best_starts]], prior, WIDE_M)])
    too_far = np.asarray((np.abs(found - prior) > FARTHEST).any(axis=1))
    chosen = np.argmin(misfits(field, points_m, found) + too_far)  # a misfit is 1 at most
    best = found[chosen]
    distances_m, _ = field.at(moved(points_m, *best))
    share = 0.0 if too_far[chosen] else float((np.abs(distances_m) <= MATCHED_WITHIN_M).mean())
    if share < MATCHED_AT_LEAST:
        raise ComputeFailed(
            "NotLocalized",
            f"{share:.0%} of {len(points_m)} returns fit the map near ({prior[0]:.2f}, {prior[1]:.2f}) m, "
            f"{prior[2]:.2f} rad; at least {MATCHED_AT_LEAST:.0%} must",
        )
    x_m, y_m, yaw_rad = best.tolist()
    return {"pose": pose_stamped(x_m, y_m, wrapped(yaw_rad), t_s=scan_s, frame_id=frame_id)}


def _moved_on(last_pose: PoseStamped, odometry: Odometry | None, until_s: float) -> State:
    """The last pose moved on by the odometry's body velocity, as long as it is trusted, along the chord of the arc."""
    x_m, y_m, yaw_rad = xyyaw(last_pose.pose)
    if odometry is None:
        return np.array([x_m, y_m, yaw_rad])
    trusted_until_s = stamp_s(odometry.header.stamp) + TRUSTED_FOR_S
    elapsed_s = max(0.0, min(until_s, trusted_until_s) - stamp_s(last_pose.header.stamp))
    twist = odometry.twist.twist
    turn_rad = twist.angular.z * elapsed_s
    forward_m, left_m = twist.linear.x * elapsed_s, twist.linear.y * elapsed_s
    c, s = math.cos(yaw_rad + turn_rad / 2.0), math.sin(yaw_rad + turn_rad / 2.0)
    return np.array([x_m + c * forward_m - s * left_m, y_m + s * forward_m + c * left_m, yaw_rad + turn_rad])
