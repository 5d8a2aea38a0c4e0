"""What a planner tells of itself while it works: the child's side of race.py.

A planner is a program `python -m tests.benchmarks.peers.NAME ROBOTS DRINKS SEED separable|coupled LIMIT_S [WAY]`. It
writes a line of JSON for each thing it finds out: that it is ready and its clock runs, a better plan, a better bound,
a proof.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Sequence
from typing import TypeAlias

from tests.benchmarks.fleets import Act, Instance, draw


class Report:
    """The way from a planner to the benchmark.

    Attributes:
        limit_s: So long after `ready` the planner is killed.
    """

    def __init__(self, limit_s: float) -> None:
        self.limit_s = limit_s
        # What planners print themselves must not come between.
        self._descriptor = os.dup(1)
        os.dup2(2, 1)

    def ready(self) -> None:
        """All is loaded, nothing is known of the instance: from now on time counts."""
        self._write({"ready": True})

    def plan(self, acts: Sequence[Act], stated_ms: float | None = None) -> None:
        """A plan, better than those before; `stated_ms`: the planner says that it takes no longer."""
        self._write({"plan": acts, "stated_ms": stated_ms})

    def bound(self, ms: float) -> None:
        """No plan takes less."""
        self._write({"bound_ms": ms})

    def proven(self) -> None:
        """No plan is better than the best told."""
        self._write({"proven": True})

    def note(self, text: str) -> None:
        """Something that people should know of this run."""
        self._write({"note": text})

    def _write(self, message: object) -> None:
        os.write(self._descriptor, (json.dumps(message) + "\n").encode())


Solve: TypeAlias = Callable[[Report], None]


def take_part(prepare: Callable[[Instance, str], Solve]) -> None:
    """Solve the instance of the command line.

    Args:
        prepare: Gets the instance and the way, loads what there is to load, and returns what solves it.
    """
    report = Report(float(sys.argv[5]))
    robots, drinks, seed = map(int, sys.argv[1:4])
    instance = draw(robots, drinks, seed, coupled=sys.argv[4] == "coupled")
    solve = prepare(instance, sys.argv[6] if len(sys.argv) > 6 else "")
    report.ready()
    solve(report)
