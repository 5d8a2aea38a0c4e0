"""The base of a robot: it drives as told, within its limits, and counts how far it came.

Frames: `map` (the truth, which no service tells), `<robot>/odom` (origin where the robot started), and
`<robot>/base_link` (x forward, y left).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from grounding.messages import (
    Odometry,
    PoseWithCovariance,
    Twist,
    TwistWithCovariance,
    Vector3,
    header,
    planar_pose,
)
from kb.section import read_file
from sim.errors import BadScenario, ServiceRefused
from sim.physics import Body, Physics, PlanarState

WATCHDOG_S = 0.5  # a base that hears no command for this long stops

# Odometry: errors of scale that a robot keeps (1 sigma), and noise of every step relative to what it covered.
_SCALE_ERROR_DISTANCE = 0.02
_SCALE_ERROR_ANGLE = 0.01
_NOISE_DISTANCE = 0.05  # m per m
_NOISE_ANGLE = 0.05  # rad per rad
_NOISE_ANGLE_PER_M = 0.05  # rad per m: even a straight drive turns a little

Pose2 = tuple[float, float, float]  # x in m, y in m, yaw in rad


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotModel:
    """A kind of robot: file of its body (URDF, in `sim/models`) and limits of its base."""

    name: str
    urdf: str
    max_speed_mps: float
    max_turn_rate_radps: float
    max_acceleration_mps2: float
    max_turn_acceleration_radps2: float


@functools.cache
def robot_models() -> Mapping[str, RobotModel]:
    """The kinds of robots that come with the simulator, by name."""
    models = {}
    for name, section in read_file(files("sim") / "models" / "robots.toml", BadScenario).named():
        models[name] = RobotModel(
            name=name,
            urdf=section.text("urdf"),
            max_speed_mps=section.number("max_speed_mps", low=0.01, high=5.0),
            max_turn_rate_radps=section.number("max_turn_rate_radps", low=0.01, high=10.0),
            max_acceleration_mps2=section.number("max_acceleration_mps2", low=0.01, high=20.0),
            max_turn_acceleration_radps2=section.number("max_turn_acceleration_radps2", low=0.01, high=50.0),
        )
        section.end()
    return models


class Base:
    """An omnidirectional base under velocity control, with odometry that drifts.

    Args:
        name: Of the robot.
        model: Its kind.
        physics: The engine that moves it.
        body: Its body there.
        placed_at: Where it truly starts (map).
        step_s: Length of a step.
        chance: Source of all its errors of odometry.
    """

    def __init__(
        self,
        name: str,
        model: RobotModel,
        physics: Physics,
        body: Body,
        placed_at: Pose2,
        step_s: float,
        chance: np.random.Generator,
    ) -> None:
        self._name = name
        self._model = model
        self._physics = physics
        self._body = body
        self._step_s = step_s
        self._wanted: Pose2 = (0.0, 0.0, 0.0)  # velocity in base_link: m/s, m/s, rad/s
        self._wanted_until_s = 0.0
        self._velocity: Pose2 = (0.0, 0.0, 0.0)  # true velocity in base_link
        physics.place(body, *placed_at)
        self._pose = placed_at

        self._chance = chance
        self._distance_scale = 1.0 + _SCALE_ERROR_DISTANCE * float(chance.standard_normal())
        self._angle_scale = 1.0 + _SCALE_ERROR_ANGLE * float(chance.standard_normal())
        self._odom_pose: Pose2 = (0.0, 0.0, 0.0)

    @property
    def body(self) -> Body:
        """The body in the engine."""
        return self._body

    @property
    def pose(self) -> Pose2:
        """Where the robot truly is: x, y, yaw in map."""
        return self._pose

    def is_told_to_drive(self, t_s: float) -> bool:
        """Whether a velocity other than zero is in force. One that is told to stop may still be slowing down."""
        return t_s < self._wanted_until_s and self._wanted != (0.0, 0.0, 0.0)

    def command(self, velocity: Twist, t_s: float) -> None:
        """Drive with `velocity` (base_link), cut to the limits of the base, until told otherwise or too long ago.

        Raises:
            ServiceRefused: a component is not finite, or the base cannot move that way.
        """
        linear, angular = velocity.linear, velocity.angular
        parts = (linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
        if not all(math.isfinite(part) for part in parts):
            raise ServiceRefused("BadRequest", f"/{self._name}/base: velocity: {parts} has to be finite numbers")
        if linear.z != 0.0 or angular.x != 0.0 or angular.y != 0.0:
            problem = "linear.z, angular.x and angular.y have to be 0: the base drives on the floor"
            raise ServiceRefused("BadRequest", f"/{self._name}/base: velocity: {problem}")
        speed = math.hypot(linear.x, linear.y)
        cut = min(1.0, self._model.max_speed_mps / speed) if speed > 0.0 else 1.0
        turn = self._model.max_turn_rate_radps
        self._wanted = (linear.x * cut, linear.y * cut, max(-turn, min(turn, angular.z)))
        self._wanted_until_s = t_s + WATCHDOG_S

    def drive(self, t_s: float) -> None:
        """Before the step that starts at `t_s`: change the velocity toward the wanted one, as fast as allowed."""
        wanted_x, wanted_y, wanted_turn = self._wanted if t_s < self._wanted_until_s else (0.0, 0.0, 0.0)
        vx, vy, wz = self._velocity
        most = self._model.max_acceleration_mps2 * self._step_s
        change = math.hypot(wanted_x - vx, wanted_y - vy)
        share = min(1.0, most / change) if change > 0.0 else 0.0
        vx += (wanted_x - vx) * share
        vy += (wanted_y - vy) * share
        most_turn = self._model.max_turn_acceleration_radps2 * self._step_s
        wz += max(-most_turn, min(most_turn, wanted_turn - wz))
        # The heading in the middle of the step makes the step's straight line the chord of the arc.
        heading = self._pose[2] + wz * self._step_s / 2
        map_vx, map_vy = _turned(vx, vy, heading)
        self._physics.push(self._body, map_vx, map_vy, wz)

    def sense(self) -> None:
        """After the step: see where the robot came, and count it in the odometry."""
        x, y, yaw = self._pose
        state = self._physics.settle(self._body)
        turned = math.remainder(state.yaw_rad - yaw, math.tau)
        heading = yaw + turned / 2
        self._velocity = _body_velocity(state, heading)
        self._pose = (state.x_m, state.y_m, state.yaw_rad)

        forward, left = _turned(state.x_m - x, state.y_m - y, -heading)
        distance = math.hypot(forward, left)
        noise = self._chance.standard_normal(2)  # drawn in every step, so that what comes later does not depend on rest
        scale = self._distance_scale + _NOISE_DISTANCE * float(noise[0])
        spread = math.hypot(_NOISE_ANGLE * turned, _NOISE_ANGLE_PER_M * distance)
        odom_x, odom_y, odom_yaw = self._odom_pose
        odom_turned = turned * self._angle_scale + spread * float(noise[1])
        dx, dy = _turned(forward * scale, left * scale, odom_yaw + odom_turned / 2)
        self._odom_pose = (odom_x + dx, odom_y + dy, math.remainder(odom_yaw + odom_turned, math.tau))

    def odometry(self, t_s: float) -> Odometry:
        """Pose in `<robot>/odom` and velocity in base_link, as the wheels tell. Covariances are not known: 0."""
        vx, vy, wz = self._velocity
        twist = Twist(
            linear=Vector3(x=vx * self._distance_scale, y=vy * self._distance_scale, z=0.0),
            angular=Vector3(x=0.0, y=0.0, z=wz * self._angle_scale),
        )
        return Odometry(
            header=header(f"{self._name}/odom", t_s),
            child_frame_id=f"{self._name}/base_link",
            pose=PoseWithCovariance(pose=planar_pose(*self._odom_pose), covariance=np.zeros(36)),
            twist=TwistWithCovariance(twist=twist, covariance=np.zeros(36)),
        )


def _turned(x: float, y: float, angle_rad: float) -> tuple[float, float]:
    """A vector of the plane, turned counterclockwise."""
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return cos * x - sin * y, sin * x + cos * y


def _body_velocity(state: PlanarState, heading_rad: float) -> Pose2:
    """Velocity of the body in base_link, given its heading in map: contacts show in it."""
    vx, vy = _turned(state.vx_mps, state.vy_mps, -heading_rad)
    return vx, vy, state.wz_radps
