"""Sliding doors: a leaf that closes an opening, or stands aside within the wall.

The leaf is solid: a laser sees it and a robot is stopped by it. It stops where it would touch a robot, and goes on
once that has left, as doors with a safety edge do.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from sim.physics import Body, Physics
from sim.world import DoorSetup


class Door:
    """A door in the engine."""

    def __init__(self, setup: DoorSetup, physics: Physics) -> None:
        self.name = setup.name
        self.travel_s = setup.travel_s
        self._setup = setup
        self._physics = physics
        self._body: Body = physics.add_box(setup.leaf)
        self._closed_at = physics.position(self._body)
        self._share = self._wanted = 1.0 if setup.is_open else 0.0
        self._put(self._share)

    @property
    def is_open(self) -> bool:
        """Whether the leaf is all aside."""
        return self._share == 1.0

    @property
    def is_closed(self) -> bool:
        """Whether the leaf closes the opening."""
        return self._share == 0.0

    def slide(self, *, to_open: bool) -> None:
        """Open or close from now on."""
        self._wanted = 1.0 if to_open else 0.0

    def advance(self, step_s: float, robots: Iterable[Body]) -> None:
        """Let the leaf go on for a step, unless it would touch a robot."""
        if self._share == self._wanted:
            return
        most = step_s / self._setup.travel_s
        before = self._share
        self._share += max(-most, min(most, self._wanted - self._share))
        self._put(self._share)
        if any(self._physics.near(self._body, robot) for robot in robots):
            self._share = before
            self._put(before)

    def distance_m(self, x_m: float, y_m: float) -> float:
        """From a point of the floor to the opening."""
        low, high = self._setup.leaf.low, self._setup.leaf.high
        return math.hypot(max(low[0] - x_m, 0.0, x_m - high[0]), max(low[1] - y_m, 0.0, y_m - high[1]))

    def _put(self, share: float) -> None:
        x, y, z = self._closed_at
        slide_x, slide_y = self._setup.slides_m
        self._physics.move(self._body, (x + share * slide_x, y + share * slide_y, z))
