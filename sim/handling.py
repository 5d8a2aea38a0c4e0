"""Loading and unloading: a robot takes an object within its reach onto its top, and puts it down in front of it.

What an arm would do is left out: the object is on the robot at once, and rides with it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from sim.errors import ServiceRefused
from sim.physics import Body, Physics
from sim.robot import Base
from sim.world import ObjectModel, Point3, World

REACH_M = 1.5  # from the middle of the robot
_ABOVE_TOP_M = 0.02  # so that what rides does not push its robot
_FIRST_M, _STEP_M = 0.4, 0.05  # where it looks for room to put something down, straight ahead
_APART_M = 0.02


@dataclass(slots=True)
class Thing:
    """An object in the engine, and where its bottom center truly is (map, m)."""

    model: ObjectModel
    body: Body
    position: Point3

    def put(self, physics: Physics, bottom: Point3) -> None:
        """Put it somewhere else."""
        self.position = bottom
        physics.move(self.body, (bottom[0], bottom[1], bottom[2] + self.model.height_m / 2))


class Cargo:
    """What rides on one robot.

    Args:
        things: All objects of the world by name; whoever moves one tells the others by it.
    """

    def __init__(self, robot: str, base: Base, physics: Physics, world: World, things: Mapping[str, Thing]) -> None:
        self._robot = robot
        self._base = base
        self._physics = physics
        self._world = world
        self._things = things
        self._top_m = physics.top_m(base.body)
        self.held: str | None = None

    def load(self, name: str, held_elsewhere: Iterable[str | None], t_s: float) -> None:
        """Take an object on, at the time `t_s`.

        Raises:
            ServiceRefused: The robot is told to drive or holds something, or the object is unknown, taken, or out
                of reach.
        """
        service = f"/{self._robot}/load"
        self._check_stands(service, t_s)
        if self.held is not None:
            raise ServiceRefused("AlreadyHolding", f"{service}: {self._robot} holds {self.held}; unload it first")
        if name not in self._things:
            raise ServiceRefused("ObjectNotFound", f"{service}: there is no {name} here")
        if name in held_elsewhere:
            raise ServiceRefused("ObjectNotFound", f"{service}: another robot has taken {name}")
        x, y, _ = self._base.pose
        thing = self._things[name]
        away_m = math.dist((x, y), thing.position[:2])
        if away_m > REACH_M:
            problem = f"{name} is {away_m:.2f} m away; the reach is {REACH_M:g} m"
            raise ServiceRefused("OutOfReach", f"{service}: {problem}")
        self.held = name
        self.ride()

    def unload(self, t_s: float) -> None:
        """Put down what is held, on the first free furniture straight ahead, at the time `t_s`.

        Raises:
            ServiceRefused: The robot is told to drive, holds nothing, or there is no room within reach.
        """
        service = f"/{self._robot}/unload"
        self._check_stands(service, t_s)
        if self.held is None:
            raise ServiceRefused("NotHolding", f"{service}: {self._robot} holds nothing")
        thing = self._things[self.held]
        x, y, yaw = self._base.pose
        for turn in range(round((REACH_M - _FIRST_M) / _STEP_M) + 1):
            ahead_m = _FIRST_M + turn * _STEP_M
            at = (x + ahead_m * math.cos(yaw), y + ahead_m * math.sin(yaw))
            if self._has_room(at, thing):
                self.held = None
                thing.put(self._physics, (*at, self._world.top_m(*at)))
                return
        problem = f"no free surface within {REACH_M:g} m ahead of {self._robot}; turn it to one"
        raise ServiceRefused("NoSurface", f"{service}: {problem}")

    def give_away(self, name: str) -> None:
        """Somebody has taken an object from the robot, if it was there."""
        if self.held == name:
            self.held = None

    def ride(self) -> None:
        """Keep what is held on the top of the robot."""
        if self.held is not None:
            x, y, _ = self._base.pose
            self._things[self.held].put(self._physics, (x, y, self._top_m + _ABOVE_TOP_M))

    def _check_stands(self, service: str, t_s: float) -> None:
        """Slowing down to a stand takes less time than loading does: that it is told to is enough."""
        if self._base.is_told_to_drive(t_s):
            raise ServiceRefused("BaseMoves", f"{service}: {self._robot} drives; stop it first")

    def _has_room(self, at: tuple[float, float], thing: Thing) -> bool:
        """Whether furniture, lower than a wall, bears the whole of an object at a point, and nothing stands there."""
        radius_m, top_m = thing.model.radius_m, self._world.top_m(*at)
        rim = [(at[0] + dx * radius_m, at[1] + dy * radius_m) for dx, dy in ((1, 0), (0, 1), (-1, 0), (0, -1))]
        borne = 0.0 < top_m <= self._top_m and all(self._world.top_m(*point) == top_m for point in rim)
        others = (other for other in self._things.values() if other is not thing)
        return borne and all(
            math.dist(at, other.position[:2]) > radius_m + other.model.radius_m + _APART_M for other in others
        )
