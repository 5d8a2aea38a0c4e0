"""Following a path with an omnidirectional base, one velocity at a time, from the pose and the scan alone."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from grounding.compute.errors import ComputeFailed
from grounding.compute.scans import moved, points_of, wrapped
from grounding.messages import LaserScan, Path, PoseStamped, Twist, Vector3, xyyaw

ARRIVED_WITHIN_M = 0.05
ARRIVED_WITHIN_RAD = 0.06
LOOKAHEAD_M = 0.40
CUT_CORNERS_BY_M = 0.03  # the straight line to the lookahead point leaves the path by no more
SAMPLE_M = 0.02  # along the path
LOOKAHEADS_PER_S = 1.8  # speed over lookahead distance: slow where the path turns sharply
TURN_TO_GOAL_WITHIN_M = 0.30
BRAKE_MPS2 = 0.5
BRAKE_RADPS2 = 1.5
GAIN_PER_S = 2.0  # of distance to speed, at the very end
TURN_GAIN_PER_S = 2.5
SLOW_WITHIN_M = 0.80
STOP_WITHIN_M = 0.15
CONTACT_M = 0.02  # footprint margin: what comes nearer is in the way
BESIDE_M = 0.10  # footprint margin: what comes nearer is passed slowly
PASS_MPS = 0.30
BLIND_MPS = 0.10  # toward where the laser does not look
BLOCKED_MPS = 0.10

Points = NDArray[np.float64]


def vel_cmd(
    *,
    path: Path,
    pose: PoseStamped,
    scan: LaserScan,
    max_vel_lin_mps: float,
    max_vel_ang_radps: float,
    radius_m: float,
    laser_x_m: float,
    laser_y_m: float,
    laser_yaw_rad: float,
    t_s: float,
) -> dict[str, Twist | bool]:
    """The velocity to hold until the next call.

    The base heads for a point up to 0.4 m ahead on the path (less where the path bends), no faster than its limits,
    than it can brake at 0.5 m/s2 before the end, and than the laser allows: inside 0.8 m of way before the footprint
    would touch something the speed falls linearly, to zero at 0.15 m; what comes within 0.1 m beside the footprint is
    passed at 0.3 m/s, and toward where the laser does not look it goes at 0.1 m/s. Returns inside the footprint are
    the robot itself; what lies beyond the path's end is not in the way. The base turns toward its direction of travel,
    and in the last 0.3 m to the yaw of the path's last pose.

    Args:
        path: Corners of the path; the last pose is the goal.
        pose: Robot's pose, in the path's frame.
        scan: What the laser sees.
        max_vel_lin_mps: Greatest speed of the base.
        max_vel_ang_radps: Greatest turning speed of the base.
        radius_m: Radius of the robot.
        laser_x_m: Mount, base_from_laser.
        laser_y_m: Mount, base_from_laser.
        laser_yaw_rad: Mount, base_from_laser.
        t_s: Time of the call; a Twist has no stamp.

    Returns:
        `velocity`: of base_link, in base_link.
        `arrived`: within 0.05 m and 0.06 rad of the path's last pose; the velocity is then zero.
        `blocked`: on the rest of the path, to its end, the footprint (with a margin of 0.02 m) would touch something
            that the laser sees now, so near that it, and nothing else, holds the speed at 0.1 m/s or less, and the
            robot is not yet within 0.05 m of the end. It may come and go with who stands there: callers should wait a
            while before they act on it.

    Raises:
        ComputeFailed: BadInput, if the path is empty, frames differ or a pose is not finite.
    """
    if not path.poses:
        raise ComputeFailed("BadInput", "vel_cmd: the path has no poses; its last pose is where to go")
    if pose.header.frame_id != path.header.frame_id:
        raise ComputeFailed(
            "BadInput",
            f"vel_cmd: pose is in frame {pose.header.frame_id!r}, path in {path.header.frame_id!r}; they must agree",
        )
    x_m, y_m, yaw_rad = xyyaw(pose.pose)
    poses = np.array([xyyaw(corner.pose) for corner in path.poses])
    if not (np.isfinite(poses).all() and math.isfinite(x_m + y_m + yaw_rad)):
        raise ComputeFailed("BadInput", f"vel_cmd: pose ({x_m}, {y_m}, {yaw_rad}) and the path must be finite")
    position_m = np.array([x_m, y_m])
    goal_m, goal_yaw_rad = poses[-1, :2], poses[-1, 2]
    to_goal_m = math.dist(position_m, goal_m)
    if to_goal_m <= ARRIVED_WITHIN_M and abs(wrapped(goal_yaw_rad - yaw_rad)) <= ARRIVED_WITHIN_RAD:
        return {"velocity": _twist(0.0, 0.0, 0.0), "arrived": True, "blocked": False}

    corners_m = poses[:, :2]
    ahead_m, rest_m = _ahead(corners_m, position_m)
    remaining_m = max(to_goal_m, rest_m)
    most = min(round(LOOKAHEAD_M / SAMPLE_M), len(ahead_m) - 1)
    lookahead = _lookahead(ahead_m[: most + 1])
    target_m = ahead_m[lookahead]
    direction_rad = wrapped(math.atan2(target_m[1] - y_m, target_m[0] - x_m) - yaw_rad)

    returns_m = moved(points_of(scan, x_m=laser_x_m, y_m=laser_y_m, yaw_rad=laser_yaw_rad), x_m, y_m, yaw_rad)
    straight_m = np.linspace(position_m, target_m, math.ceil(math.dist(position_m, target_m) / SAMPLE_M) + 1)
    free_m, beside = _clear_way(np.concatenate([straight_m, ahead_m[lookahead + 1 :]]), returns_m, radius_m)
    laser_mps = max_vel_lin_mps * min(max((free_m - STOP_WITHIN_M) / (SLOW_WITHIN_M - STOP_WITHIN_M), 0.0), 1.0)
    speed_mps = min(
        max_vel_lin_mps,
        _braking_speed(remaining_m, BRAKE_MPS2, GAIN_PER_S),
        LOOKAHEADS_PER_S * lookahead * SAMPLE_M if lookahead < most else math.inf,
        PASS_MPS if beside else math.inf,
        math.inf if _looks(scan, direction_rad - laser_yaw_rad) else BLIND_MPS,
    )
    blocked = laser_mps <= min(BLOCKED_MPS, speed_mps) and to_goal_m > ARRIVED_WITHIN_M
    speed_mps = min(speed_mps, laser_mps)

    turn_rad = wrapped(goal_yaw_rad - yaw_rad) if remaining_m <= TURN_TO_GOAL_WITHIN_M else direction_rad
    turn_radps = min(_braking_speed(abs(turn_rad), BRAKE_RADPS2, TURN_GAIN_PER_S), max_vel_ang_radps)
    return {
        "velocity": _twist(
            speed_mps * math.cos(direction_rad),
            speed_mps * math.sin(direction_rad),
            math.copysign(turn_radps, turn_rad),
        ),
        "arrived": False,
        "blocked": blocked,
    }


def _ahead(corners_m: Points, position_m: Points) -> tuple[Points, float]:
    """The path from its point nearest to a position on, and how long it is from there to its end.

    Returns:
        Points (n >= 1, 2) every 0.02 m, the nearest first, over as much of the path as matters now, its end included
        if it is within that; and the length of all the rest, m.
    """
    begins_m, steps_m = corners_m[:-1], np.diff(corners_m, axis=0)
    lengths_m = np.linalg.norm(steps_m, axis=1)
    if not lengths_m.any():
        return corners_m[-1:], 0.0
    begins_m, steps_m, lengths_m = begins_m[lengths_m > 0.0], steps_m[lengths_m > 0.0], lengths_m[lengths_m > 0.0]
    along = np.clip(((position_m - begins_m) * steps_m).sum(axis=1) / lengths_m**2, 0.0, 1.0)
    nearest = int(np.argmin(np.linalg.norm(begins_m + along[:, None] * steps_m - position_m, axis=1)))
    at_corner_m = np.concatenate([[0.0], np.cumsum(lengths_m)])
    here_m, end_m = at_corner_m[nearest] + along[nearest] * lengths_m[nearest], at_corner_m[-1]
    at_m = np.arange(here_m, min(end_m, here_m + SLOW_WITHIN_M + LOOKAHEAD_M), SAMPLE_M)
    if end_m - here_m <= SLOW_WITHIN_M + LOOKAHEAD_M:
        at_m = np.append(at_m, end_m)
    distinct_m = np.concatenate([begins_m, corners_m[-1:]])
    points_m = np.stack([np.interp(at_m, at_corner_m, distinct_m[:, axis]) for axis in (0, 1)], axis=-1)
    return points_m, float(end_m - here_m)


def _lookahead(ahead_m: Points) -> int:
    """Index of the farthest of these points to which a straight line from the first stays near the path between.

    At least 0.1 m on, if there are as many points.
    """
    from_first_m = ahead_m - ahead_m[0]
    chords = from_first_m / np.maximum(np.linalg.norm(from_first_m, axis=1, keepdims=True), 1e-9)
    # off_m[j, i]: how far point i lies off the line to point j
    off_m = np.abs(np.outer(chords[:, 0], from_first_m[:, 1]) - np.outer(chords[:, 1], from_first_m[:, 0]))
    near = np.tril(off_m).max(axis=1) <= CUT_CORNERS_BY_M
    first_far = int(np.argmin(near)) if not near.all() else len(near)
    return min(max(first_far - 1, round(0.1 / SAMPLE_M)), len(ahead_m) - 1)


def _clear_way(way_m: Points, returns_m: Points, radius_m: float) -> tuple[float, bool]:
    """How far the footprint can go along a way before it touches a return, and whether it soon passes close by one.

    Only returns that come nearer count: what is beside a robot does not hold it from leaving.

    Args:
        way_m: Points (n, 2) of the center's way, the robot's own first, in one frame with the returns.
        returns_m: Points (k, 2).
        radius_m: Radius of the robot.

    Returns:
        Length of the clear way, m (inf if nothing is touched); whether a return comes within 0.1 m of the footprint.
    """
    reach_m = SLOW_WITHIN_M + 2.0 * LOOKAHEAD_M + radius_m
    now_m = np.linalg.norm(returns_m - way_m[0], axis=1)
    outside = (now_m > radius_m) & (now_m < reach_m)
    if not outside.any():
        return math.inf, False
    returns_m, now_m = returns_m[outside], now_m[outside]
    gap_m = np.linalg.norm(way_m[:, None] - returns_m[None], axis=2)
    gap_m = np.where(gap_m < now_m, gap_m, math.inf).min(axis=1) - radius_m
    at_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way_m, axis=0), axis=1))])
    touches = gap_m < CONTACT_M
    free_m = float(at_m[np.argmax(touches)]) if touches.any() else math.inf
    return free_m, bool((gap_m[at_m <= LOOKAHEAD_M] < BESIDE_M).any())


def _looks(scan: LaserScan, direction_rad: float) -> bool:
    """Whether the laser covers a corridor in this direction (of its own frame)."""
    to_edge_rad = 0.35
    middle_rad = (scan.angle_min + scan.angle_max) / 2.0
    return abs(wrapped(direction_rad - middle_rad)) <= (scan.angle_max - scan.angle_min) / 2.0 - to_edge_rad


def _braking_speed(distance: float, brake: float, gain: float) -> float:
    """Greatest speed from which to come to rest within a distance (m or rad) at a steady deceleration.

    The last piece is proportional to the distance, with the same slope where the two meet, so that delay and noise do
    not make it swing around the end.
    """
    meet = brake / gain**2
    return gain * distance if distance <= meet else math.sqrt(2.0 * brake * (distance - meet / 2.0))


def _twist(x_mps: float, y_mps: float, yaw_radps: float) -> Twist:
    return Twist(linear=Vector3(x=x_mps, y=y_mps, z=0.0), angular=Vector3(x=0.0, y=0.0, z=yaw_radps))
