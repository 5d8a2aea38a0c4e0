"""How long the planner takes online, from an outcome to the actions that may start then.

Ten robots look for forty drinks with the process of the shipped ontology, loops and all: every outcome of
every service call goes to the planner, for which time passes as the processes' durations say. Once along
a plan, which leaves no choice, once without one, so that every pick is a choice of the moment. A last run
of 100,000 steps tells how much memory grows.
"""

from __future__ import annotations

import ctypes
import gc
import heapq
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from kb.store import Snapshot
from kb.terms import Action
from planner.network import Travel
from planner.planner import Session
from planner.progress import Started
from tests.benchmarks.harness import Figure, main
from tests.planner.labs import larger_lab

ROBOTS, DRINKS = 10, 40
LONG_RUN_STEPS = 100_000
_TRUTHS = {"arrived", "blocked"}


def run(quick: bool) -> Mapping[str, Figure]:
    """Measure: milliseconds for each decision, bytes for the long run."""
    with tempfile.TemporaryDirectory() as folder:
        knowledge = larger_lab(Path(folder) / "ontologies", ROBOTS, DRINKS)
        snapshot = knowledge.snapshot()
        figures: dict[str, Figure] = {}
        for name, planned in (("planned", True), ("choosing", False)):
            spent_s = sorted(decisions(snapshot, planned=planned, cycles=5, steps=2_000 if quick else 20_000))
            figures[f"{name}_decisions"] = len(spent_s)
            figures[f"{name}_median_ms"] = 1000.0 * spent_s[len(spent_s) // 2]
            figures[f"{name}_p99_ms"] = 1000.0 * spent_s[int(0.99 * (len(spent_s) - 1))]
            figures[f"{name}_slowest_ms"] = 1000.0 * spent_s[-1]
        steps = LONG_RUN_STEPS // 20 if quick else LONG_RUN_STEPS
        cycles = 1 + LONG_RUN_STEPS // (5 * DRINKS)
        long_run = decisions(snapshot, planned=True, cycles=cycles, steps=steps + 1_000)
        for _ in range(1_000):  # whatever is made once
            next(long_run)
        before_b, in_use_b = _resident_b(), _in_use_b()
        taken = sum(1 for _ in long_run)
        figures["long_run_steps"] = taken
        figures["long_run_grows_mb"] = (_resident_b() - before_b) / 1e6
        figures["long_run_keeps_b_per_step"] = (_in_use_b() - in_use_b) / taken
        knowledge.close()
    return figures


def decisions(snapshot: Snapshot, *, planned: bool, cycles: int, steps: int, robots: int = ROBOTS) -> Iterator[float]:
    """Seconds of each decision, until everything is done or so many steps have ended.

    Args:
        planned: Along a plan; without one, every pick is a choice of the moment.
        cycles: Turns of the loop by which a robot drives, until it has arrived.
    """
    session = Session(f"decisions_{planned}_{cycles}", snapshot, "FindEmptyDrink", {"room": "tue_lab"}, robots=robots)
    try:
        if planned:
            session.plan(_travel, now_s=0.0)
        driven: dict[str, int] = {}
        running: list[tuple[float, int, Action]] = []
        progress = session.next_actions(now_s=0.0)
        now_s, number = 0.0, 0
        for _ in range(steps):
            for event in progress.events:
                if isinstance(event, Started):
                    number += 1
                    heapq.heappush(running, (now_s + _duration_s(snapshot, event.action), number, event.action))
            if progress.done:
                return
            now_s, _, action = heapq.heappop(running)
            truths = {}
            if {a.name for a in action.arguments} >= _TRUTHS:
                driven[action.id] = driven.get(action.id, 0) + 1
                truths = {"arrived": driven[action.id] >= cycles, "blocked": False}
            begun = time.perf_counter()
            progress = session.succeeded(action, truths, now_s=now_s)
            yield time.perf_counter() - begun
    finally:
        session.close()


def _duration_s(snapshot: Snapshot, action: Action) -> float:
    return max(0.001, float(str(snapshot.ontology.value("duration_s", action.process))))


def _travel(robots: object, places: object) -> Travel:
    """Random travel times, the same every time; it is not travel that is measured here."""
    assert isinstance(robots, list)
    assert isinstance(places, list)
    rng = np.random.default_rng(1)
    return Travel(
        places=tuple(places),
        profile=dict.fromkeys(robots, 0),
        between=(rng.integers(1_000, 20_000, (len(places), len(places))),),
        here={robot: rng.integers(1_000, 20_000, len(places)) for robot in robots},
    )


def _resident_b() -> int:
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1])
    return pages * 4096


class _Mallinfo2(ctypes.Structure):
    """What glibc's mallinfo2(3) returns."""

    _fields_ = tuple(
        (name, ctypes.c_size_t)
        for name in [
            "arena",
            "ordblks",
            "smblks",
            "hblks",
            "hblkhd",
            "usmblks",
            "fsmblks",
            "uordblks",
            "fordblks",
            "keepcost",
        ]
    )


def _in_use_b() -> int:
    """What C code, SWI-Prolog above all, has taken and not given back: small leaks show here, not in resident size."""
    gc.collect()
    mallinfo2 = ctypes.CDLL(None).mallinfo2
    mallinfo2.restype = _Mallinfo2
    info = mallinfo2()
    return int(info.uordblks + info.hblkhd)


if __name__ == "__main__":
    sys.exit(main("decisions", run))
