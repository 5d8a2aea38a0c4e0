"""The navigation of a robot itself: one goal, and it drives there, as Nav2's `NavigateToPose` does.

It knows what a robot knows: its maps, its measures, its scans and its odometry. Ten times a second it localizes
itself, finds a velocity along its path, and holds it; when the way is blocked for a while, it finds another path. The
computations are those that the executive calls as services (grounding/compute).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from grounding.actions import GoalHandle, GoalStatus
from grounding.compute.localization import pose as localize
from grounding.compute.maps import loc_map, nav_map
from grounding.compute.path import path as find_path
from grounding.compute.velocity import vel_cmd
from grounding.inprocess import Handler
from grounding.messages import Duration, LaserScan, Odometry, PoseStamped, Twist, Vector3, pose_stamped, xyyaw
from grounding.messages import Path as Route
from kb.clock import Callback, Clock
from kb.errors import ServiceFailed

OWN_NAVIGATION_TYPE = "nav2_msgs/NavigateToPose"
PERIOD_S = 0.1
BLOCKED_S = 2.0
"""So long the way may be blocked, as by somebody who passes, until another path is looked for."""
MOST_RECOVERIES = 3
_LOST_AFTER_M = 0.5
_LOST_AFTER_RAD = 0.5
"""So far the wheels alone tell well enough where the robot is."""

_TF_ERROR = 9002
_NO_VALID_PATH = 208
_PATIENCE_EXCEEDED = 104
_GOAL_REJECTED = 1
_CODE_OF = {"NoPath": _NO_VALID_PATH, "NotLocalized": _TF_ERROR, "BadInput": _TF_ERROR}
"""Result codes of Nav2: its own, and those of ComputePathToPose and FollowPath, which it passes on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Measures:
    """What a robot knows of itself and of the site (SI units; the laser's mount is base_from_laser)."""

    loc_map_file: Path
    nav_map_file: Path
    radius_m: float
    max_vel_lin_mps: float
    max_vel_ang_radps: float
    laser_x_m: float
    laser_y_m: float
    laser_yaw_rad: float

    @property
    def mount(self) -> dict[str, float]:
        """Of the laser, as compute services take it."""
        return {"laser_x_m": self.laser_x_m, "laser_y_m": self.laser_y_m, "laser_yaw_rad": self.laser_yaw_rad}


@dataclass(slots=True, kw_only=True)
class _Drive:
    """A goal on the way."""

    handle: GoalHandle
    goal: PoseStamped
    began_s: float
    route: Route
    blocked_since_s: float | None = None
    recoveries: int = 0


class OwnNavigation:
    """The action server of one robot; a new goal takes the place of the one that it drives to.

    Args:
        laser: Takes a scan: the reply has `scan`.
        base: Holds a velocity: the request has `velocity`.
        odometry: What the wheels tell now.
        told: Where the robot stands when it is switched on, in the map.
    """

    def __init__(
        self,
        measures: Measures,
        clock: Clock,
        *,
        laser: Handler,
        base: Handler,
        odometry: Callable[[], Odometry],
        told: PoseStamped,
    ) -> None:
        self._measures, self._clock = measures, clock
        self._laser, self._base, self._odometry = laser, base, odometry
        self._pose, self._odometry_there = told, odometry()
        self._drive: _Drive | None = None
        self._forget_tick: Callback = lambda: None

    def start(self, handle: GoalHandle) -> None:
        """Begin to drive to a goal: `pose`, in the map. Feedback and result are those of NavigateToPose."""
        self._end(GoalStatus.ABORTED, _GOAL_REJECTED, "another goal has taken its place")
        goal = handle.fields["pose"]
        assert isinstance(goal, PoseStamped)
        try:
            scan = self._localize()
            route = self._route(goal, scan)
        except ServiceFailed as failed:
            _finish(handle, GoalStatus.ABORTED, _CODE_OF.get(failed.code, _TF_ERROR), failed.message)
            return
        drive = self._drive = _Drive(handle=handle, goal=goal, began_s=self._clock.now_s, route=route)
        handle.canceled = lambda: self._cancel(drive)
        self._later()

    def scan(self, fields: Mapping[str, object]) -> Mapping[str, object]:
        """Take a scan for somebody else: the laser's service. It keeps track of where the robot is driven by others.

        Raises:
            ServiceFailed: What the laser raises.
        """
        reply = self._laser(fields)
        before, now = xyyaw(self._odometry_there.pose.pose), xyyaw((odometry := self._odometry()).pose.pose)
        turned_rad = abs(math.remainder(now[2] - before[2], math.tau))
        if self._drive is None and (math.dist(now[:2], before[:2]) > _LOST_AFTER_M or turned_rad > _LOST_AFTER_RAD):
            scan = reply["scan"]
            assert isinstance(scan, LaserScan)
            with suppress(ServiceFailed):  # the next one may fit
                self._match(scan, odometry)
        return reply

    def _cancel(self, drive: _Drive) -> None:
        if self._drive is drive:
            self._end(GoalStatus.CANCELED, 0, "")

    def _later(self) -> None:
        self._forget_tick = self._clock.call_at(self._clock.now_s + PERIOD_S, self._tick)

    def _tick(self) -> None:
        drive, measures = self._drive, self._measures
        assert drive is not None
        try:
            scan = self._localize()
            found = vel_cmd(
                path=drive.route,
                pose=self._pose,
                scan=scan,
                max_vel_lin_mps=measures.max_vel_lin_mps,
                max_vel_ang_radps=measures.max_vel_ang_radps,
                radius_m=measures.radius_m,
                t_s=self._clock.now_s,
                **measures.mount,
            )
            self._base({"velocity": found["velocity"]})
            if found["blocked"]:
                self._look_for_another(drive, scan)
            else:
                drive.blocked_since_s = None
        except ServiceFailed as failed:
            self._end(GoalStatus.ABORTED, _CODE_OF.get(failed.code, _TF_ERROR), failed.message)
            return
        if self._drive is not drive:
            return  # it has lost patience
        drive.handle.feed(self._feedback(drive))
        if found["arrived"]:
            self._end(GoalStatus.SUCCEEDED, 0, "")
        else:
            self._later()

    def _look_for_another(self, drive: _Drive, scan: LaserScan) -> None:
        """The way is blocked: after a while find another path, and after some of them give up."""
        now_s = self._clock.now_s
        if drive.blocked_since_s is None:
            drive.blocked_since_s = now_s
        elif now_s - drive.blocked_since_s > BLOCKED_S:
            if drive.recoveries == MOST_RECOVERIES:
                told = f"the way is still blocked after {MOST_RECOVERIES} other paths"
                self._end(GoalStatus.ABORTED, _PATIENCE_EXCEEDED, told)
                return
            drive.blocked_since_s, drive.recoveries = None, drive.recoveries + 1
            drive.route = self._route(drive.goal, scan)

    def _localize(self) -> LaserScan:
        """Find out where the robot is by a scan."""
        scan = self._laser({})["scan"]
        assert isinstance(scan, LaserScan)
        self._match(scan, self._odometry())
        return scan

    def _match(self, scan: LaserScan, odometry: Odometry) -> None:
        """Match a scan to the map, from where the wheels have brought the robot since the last one."""
        t_s = self._clock.now_s
        read = loc_map(map_file=self._measures.loc_map_file, t_s=0.0)
        found = localize(
            map=read["map"],
            scan=scan,
            last_pose=pose_stamped(*_moved(self._pose, self._odometry_there, odometry), t_s=t_s),
            odometry=None,
            t_s=t_s,
            **self._measures.mount,
        )
        self._pose, self._odometry_there = found["pose"], odometry

    def _route(self, goal: PoseStamped, scan: LaserScan) -> Route:
        measures, t_s = self._measures, self._clock.now_s
        read = nav_map(map_file=measures.nav_map_file, radius_m=measures.radius_m, t_s=0.0)
        found = find_path(
            map=read["map"],
            start=self._pose,
            goal=goal,
            scan=scan,
            radius_m=measures.radius_m,
            t_s=t_s,
            **measures.mount,
        )
        return found["path"]

    def _feedback(self, drive: _Drive) -> Mapping[str, object]:
        distance_m = _left_m(self._pose, drive.route)
        return {
            "current_pose": self._pose,
            "navigation_time": _duration(self._clock.now_s - drive.began_s),
            "estimated_time_remaining": _duration(distance_m / self._measures.max_vel_lin_mps),
            "number_of_recoveries": drive.recoveries,
            "distance_remaining": distance_m,
        }

    def _end(self, status: GoalStatus, code: int, message: str) -> None:
        """Stand still, and tell how the goal ended; nothing happens without one."""
        drive, self._drive = self._drive, None
        if drive is not None:
            self._forget_tick()
            self._base({"velocity": Twist(linear=Vector3(x=0.0, y=0.0, z=0.0), angular=Vector3(x=0.0, y=0.0, z=0.0))})
            _finish(drive.handle, status, code, message)


def _finish(handle: GoalHandle, status: GoalStatus, code: int, message: str) -> None:
    handle.end(status, {"error_code": code, "error_msg": message}, message)


def _moved(pose: PoseStamped, before: Odometry, now: Odometry) -> tuple[float, float, float]:
    """A pose in the map (m, m, rad), moved on by what the wheels measured between two readings."""
    x_m, y_m, yaw_rad = xyyaw(pose.pose)
    (x0_m, y0_m, yaw0_rad), (x1_m, y1_m, yaw1_rad) = xyyaw(before.pose.pose), xyyaw(now.pose.pose)
    turn_rad = yaw_rad - yaw0_rad
    cos, sin, dx_m, dy_m = math.cos(turn_rad), math.sin(turn_rad), x1_m - x0_m, y1_m - y0_m
    return x_m + cos * dx_m - sin * dy_m, y_m + sin * dx_m + cos * dy_m, yaw_rad + yaw1_rad - yaw0_rad


def _left_m(pose: PoseStamped, route: Route) -> float:
    """How far it is along the rest of a path: to the one of its corners over which it is shortest, and on."""
    here = xyyaw(pose.pose)[:2]
    best_m, rest_m, after = math.inf, 0.0, None
    for corner in reversed([xyyaw(corner.pose)[:2] for corner in route.poses]):
        rest_m += math.dist(corner, after) if after is not None else 0.0
        best_m, after = min(best_m, math.dist(here, corner) + rest_m), corner
    return best_m


def _duration(seconds: float) -> Duration:
    whole, part = divmod(max(seconds, 0.0), 1.0)
    return Duration(sec=int(whole), nanosec=int(part * 1e9))
