"""Kinematic robots behind a rosbridge server, in a process of their own.

A robot stands at a corner of its square, and drives along a side of it when it is asked to, at a speed of its own; it
answers when it is at the next corner. There is no physics, but a pose for every time; what robots are asked for while
they drive is counted. `python -m tests.benchmarks.patrol_robots FIRST ROBOTS STEP SEED` prints its address; a line
`over` makes each patrol end with the leg that is being driven, a line `report` has what was seen printed as JSON.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from grounding.rosbridge.hub import Hub
from grounding.rosbridge.policy import Allowance, Policy
from grounding.rosbridge.server import serve
from grounding.rosbridge.types import Types
from kb.clock import SimClock
from tests.benchmarks.patrol_ontology import DRIVE, LEG_M, LONGEST_LEG_S, robot_name, service_of

_SHORTEST_LEG_S = 5.0
_CORNERS_M = ((0.0, 0.0), (LEG_M, 0.0), (LEG_M, LEG_M), (0.0, LEG_M))


@dataclass
class Patrols:
    """The robots of a process.

    Attributes:
        over: Patrols end.
        begun: Legs that were begun.
        ended: Legs that were driven to their end, of which the executive was told.
        refused: Calls that came while the robot drove.
        dispatches_s: For each leg but a robot's first, the time from the end of the one before until it was begun.
    """

    over: bool = False
    begun: int = 0
    ended: int = 0
    refused: int = 0
    dispatches_s: list[float] = field(default_factory=list)


class Robot:
    """One that drives around its square.

    Args:
        leg_s: How long it takes for a side.
    """

    def __init__(self, patrols: Patrols, clock: SimClock, leg_s: float) -> None:
        self._patrols, self._clock, self.leg_s = patrols, clock, leg_s
        self._corner = 0
        self._until_s: float | None = None
        self._arrived_s: float | None = None  # of the real clock

    @property
    def xy_m(self) -> tuple[float, float]:
        """Where it is now, from the first corner of its square."""
        (x, y), (to_x, to_y) = _CORNERS_M[self._corner], _CORNERS_M[(self._corner + 1) % 4]
        done = 0.0 if self._until_s is None else 1.0 - max(0.0, self._until_s - self._clock.now_s) / self.leg_s
        return x + done * (to_x - x), y + done * (to_y - y)

    def drive_leg(self, request: Mapping[str, object]) -> Mapping[str, object]:
        """Set off; the reply goes out when it has arrived."""
        if self._until_s is not None:
            self._patrols.refused += 1
            return {"over": True}
        self._patrols.begun += 1
        if self._arrived_s is not None:
            self._patrols.dispatches_s.append(time.monotonic() - self._arrived_s)
        self._until_s = self._clock.now_s + self.leg_s
        self._clock.call_at(self._until_s, self._arrive)
        return {"over": self._patrols.over}

    def _arrive(self) -> None:
        self._patrols.ended += 1
        self._corner, self._until_s, self._arrived_s = (self._corner + 1) % 4, None, time.monotonic()


def main() -> None:
    """Serve the robots until the input ends."""
    first, robots, step, seed = map(int, sys.argv[1:])
    rng = np.random.default_rng([seed, first])
    clock, types, patrols = SimClock(), Types(), Patrols()
    hub = Hub(clock, types=types, policy=Policy(allowance=Allowance(held=2 * robots)))
    drive = types.add_service_of(DRIVE, {}, {"over": "bool"}).name
    for number in range(first, robots, step):
        robot = Robot(patrols, clock, float(rng.uniform(_SHORTEST_LEG_S, LONGEST_LEG_S)))
        hub.services.offer(service_of(robot_name(number)), drive, robot.drive_leg, robot.leg_s)
    with serve(hub, clock) as server:
        print(server.uri, flush=True)
        for line in sys.stdin:
            if line.strip() == "over":
                server.post(lambda: setattr(patrols, "over", True))
            else:
                done = threading.Event()
                server.post(done.set)
                done.wait()
                print(json.dumps(vars(patrols)), flush=True)


if __name__ == "__main__":
    main()
