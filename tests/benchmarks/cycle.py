"""How fast the localize-navigate cycle closes, with every service call decided by the planner.

Runs FindEmptyDrink with two robots. A cycle is LocMap, Laser, Pose, VelCmd, Base (and Path when asked
again). Baseline: the 0.1 Hz that [RoboEarth] section 5 reports for the same cycle through its services.

The rate in simulated time follows from the durations that the ontology, the simulated robots and the
executive declare. Whether it would hold on robots depends on whether computing really takes no longer than
declared: so every compute service and every decision of the planner is timed as well, and `*_of_declared`
is its 95th percentile in wall time over its declared duration: below 1 it keeps what is promised.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from itertools import pairwise
from statistics import median
from typing import Any

from executive import Fleet
from executive.pace import SIMULATED
from executive.trace import ActionFinished, ProcessBegun, ProcessEnded
from grounding.inprocess import Service
from grounding.runner import compute
from tests.benchmarks.harness import Figure, main

PAPER_HZ = 0.1
CYCLE_ENDS_WITH = "Base("
DRIVING = "Navigate("
DECISION = "Decision"


def run(quick: bool) -> Mapping[str, Figure]:
    """Measure one run, or the median of three."""
    runs = [_run() for _ in range(1 if quick else 3)]
    return {name: median(r[name] for r in runs) for name in runs[0]} | {"paper_hz": PAPER_HZ}


def _run() -> dict[str, float]:
    started = time.perf_counter()
    with Fleet.open("tue_lab") as fleet:
        opened = time.perf_counter()
        spent_s = _timed(fleet)
        result = fleet.request("FindEmptyDrink", room="tue_lab", robots=2).wait()
        took_wall_s = time.perf_counter() - opened
        figures: dict[str, float] = {}
        cycles = 0
        for robot in ("amigo_1", "pico_1"):
            driving_s = sum(_driving_s(fleet, robot))
            ends_s = [
                e.t_s
                for e in fleet.trace
                if isinstance(e, ActionFinished) and e.robot == robot and e.action.startswith(CYCLE_ENDS_WITH)
            ]
            cycles += len(ends_s)
            figures[f"{robot}_cycle_hz"] = len(ends_s) / driving_s
            figures[f"{robot}_slowest_cycle_s"] = max(b - a for a, b in pairwise(ends_s))
        figures |= _of_declared(fleet, spent_s)
        actions = sum(isinstance(e, ActionFinished) for e in fleet.trace)
    return {
        **figures,
        "simulated_s": result.took_s,
        "wall_s": took_wall_s,
        "open_wall_s": opened - started,
        "times_real_time": result.took_s / took_wall_s,
        "wall_ms_per_cycle": 1000.0 * took_wall_s / cycles,
        "actions": float(actions),
        "wall_ms_per_action": 1000.0 * took_wall_s / actions,
    }


def _timed(fleet: Fleet) -> dict[str, list[float]]:
    """Have every compute service, and every decision, note how long it takes; seconds by process."""
    spent_s: dict[str, list[float]] = {DECISION: []}

    def timed(function: Callable[..., Any], into: list[float]) -> Callable[..., Any]:
        def run_timed(*arguments: Any, **options: Any) -> Any:
            begun = time.perf_counter()
            try:
                return function(*arguments, **options)
            finally:
                into.append(time.perf_counter() - begun)

        return run_timed

    transport = fleet.parts.transport
    for grounding in fleet.parts.knowledge.snapshot().groundings.values():
        if not grounding.on_robot:
            into = spent_s.setdefault(grounding.process, [])
            handler = timed(lambda f, name=grounding.service: compute(name, f, t_s=fleet.now_s), into)
            transport.offer(grounding.service, Service(handler=handler, latency_s=grounding.duration_s))
    fleet.parts.shell.report_outcome = timed(fleet.parts.shell.report_outcome, spent_s[DECISION])  # type: ignore[method-assign]
    return spent_s


def _of_declared(fleet: Fleet, spent_s: Mapping[str, list[float]]) -> dict[str, float]:
    groundings = fleet.parts.knowledge.snapshot().groundings
    declared_s = {name: groundings[name].duration_s for name in spent_s if name in groundings} | {
        DECISION: SIMULATED.deciding_s
    }
    figures = {}
    for name, times_s in ((name, times_s) for name, times_s in spent_s.items() if times_s):
        usual_s = sorted(times_s)[int(0.95 * (len(times_s) - 1))]
        figures[f"{name}_p95_wall_ms"] = 1000.0 * usual_s
        figures[f"{name}_of_declared"] = usual_s / declared_s[name]
    return figures


def _driving_s(fleet: Fleet, robot: str) -> list[float]:
    """How long each drive of a robot took."""
    times_s: list[float] = []
    begun_s = 0.0
    for event in fleet.trace:
        if (
            isinstance(event, ProcessBegun | ProcessEnded)
            and event.robot == robot
            and event.process.startswith(DRIVING)
        ):
            if isinstance(event, ProcessBegun):
                begun_s = event.t_s
            else:
                times_s.append(event.t_s - begun_s)
    return times_s


if __name__ == "__main__":
    sys.exit(main("cycle", run))
