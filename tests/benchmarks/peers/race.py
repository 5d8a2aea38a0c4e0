"""Runs planners, each in a process of its own, against the clock.

The clock is the benchmark's: it starts when a planner has told that it is loaded, and each plan counts from when
its line has arrived. What a plan is worth is worked out here, whatever its planner says (fleets.makespan_ms).
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.benchmarks.fleets import IllegalPlan, Instance, makespan_ms

LOADING_LIMIT_S = 600.0
_ROOT = Path(__file__).resolve().parents[3]


@dataclass(frozen=True, slots=True, kw_only=True)
class Entrant:
    """A planner that takes part.

    Attributes:
        name: For people, and in the names of figures.
        module: In tests.benchmarks.peers.
        way: How it goes about it, where it has several ways.
    """

    name: str
    module: str
    way: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What came of one run.

    Attributes:
        plans: Seconds and makespan of each plan that is better than those before.
        bounds: Seconds and lower bound, likewise.
        proven_s: When the best plan was proven to be the best; None: not.
        loading_s: How long it took to be ready (imports; ontology, reasoner and compiler for ours).
        cpu_s: Of all its processes, with loading.
        end: How it ended.
        faults: Plans that are none, or take longer than stated.
    """

    plans: tuple[tuple[float, int], ...]
    bounds: tuple[tuple[float, float], ...]
    proven_s: float | None
    loading_s: float
    cpu_s: float
    end: str
    faults: tuple[str, ...] = ()

    @property
    def first_s(self) -> float | None:
        """When the first plan was there."""
        return self.plans[0][0] if self.plans else None

    @property
    def makespan_ms(self) -> int | None:
        """Of the best plan."""
        return self.plans[-1][1] if self.plans else None

    @property
    def bound_ms(self) -> float | None:
        """The best lower bound."""
        if self.proven_s is not None:
            return self.makespan_ms
        return self.bounds[-1][1] if self.bounds else None

    @property
    def gap(self) -> float | None:
        """How much of the makespan is above the bound; 1 where there is no bound."""
        if self.makespan_ms is None:
            return None
        return 1.0 - (self.bound_ms or 0.0) / self.makespan_ms

    def after(self, s: float) -> int | None:
        """The makespan of the best plan that was there after so many seconds."""
        there = [ms for t_s, ms in self.plans if t_s <= s]
        return there[-1] if there else None


def run(entrant: Entrant, instance: Instance, *, limit_s: float) -> Run:
    """Let a planner solve an instance, and kill it when its time is over."""
    command = [sys.executable, "-W", "ignore", "-m", f"tests.benchmarks.peers.{entrant.module}"]
    command += [str(instance.robots), str(instance.drinks), str(instance.seed)]
    command += ["coupled" if instance.coupled else "separable", str(limit_s), entrant.way]
    started = time.perf_counter()
    with (
        tempfile.TemporaryFile() as complaints,
        subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=complaints, cwd=_ROOT, start_new_session=True
        ) as process,
    ):
        try:
            told = _listen(process, started, limit_s)
        finally:
            cpu_s = _cpu_s(process.pid)
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)  # with whatever it has started
        if told.end == "done" and process.wait() != 0:
            complaints.seek(0)
            lines = complaints.read().decode(errors="replace").split("\n")
            told.end = "failed: " + next((line[:200] for line in reversed(lines) if line.strip()), "without a word")
    return _judged(instance, told, cpu_s)


@dataclass(slots=True)
class _Told:
    """What a planner has told, and when."""

    messages: list[tuple[float, Mapping[str, Any]]]
    loading_s: float = 0.0
    end: str = "done"


def _listen(process: subprocess.Popen[bytes], started: float, limit_s: float) -> _Told:
    told = _Told([])
    assert process.stdout is not None
    pipe, ready, deadline, rest = process.stdout.fileno(), False, started + LOADING_LIMIT_S, b""
    while True:
        left_s = deadline - time.perf_counter()
        if left_s <= 0 or not select.select([pipe], [], [], left_s)[0]:
            told.end = f"killed at {limit_s:g} s" if ready else f"not loaded within {LOADING_LIMIT_S:.0f} s"
            return told
        read = os.read(pipe, 1 << 20)
        now = time.perf_counter()
        if not read:
            return told
        *lines, rest = (rest + read).split(b"\n")
        for message in map(json.loads, lines):
            if "ready" in message:
                ready, deadline, told.loading_s = True, now + limit_s, now - started
            else:
                told.messages.append((now - started - told.loading_s, message))


def _cpu_s(group: int) -> float:
    """What all processes of a group, and those that they have waited for, have used so far."""
    ticks = 0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
        except OSError:  # it has ended meanwhile
            continue
        if int(fields[2]) == group:
            ticks += sum(map(int, fields[11:15]))
    return ticks / os.sysconf("SC_CLK_TCK")


def _judged(instance: Instance, told: _Told, cpu_s: float) -> Run:
    plans: list[tuple[float, int]] = []
    bounds: list[tuple[float, float]] = []
    faults: list[str] = []
    proven_s: float | None = None
    end = told.end
    for t_s, message in told.messages:
        match message:
            case {"plan": acts, "stated_ms": stated_ms}:
                try:
                    worth_ms = makespan_ms(instance, [tuple(act) for act in acts])
                except IllegalPlan as illegal:
                    faults.append(f"illegal plan: {illegal}")
                    continue
                if stated_ms is not None and worth_ms > stated_ms:
                    faults.append(f"says {stated_ms} ms of a plan that takes {worth_ms} ms")
                if not plans or worth_ms < plans[-1][1]:
                    plans.append((t_s, worth_ms))
            case {"bound_ms": bound_ms}:
                if not bounds or bound_ms > bounds[-1][1]:
                    bounds.append((t_s, bound_ms))
            case {"proven": True}:
                proven_s = t_s
            case _:
                end = f"{end}; {message['note']}"
    return Run(
        plans=tuple(plans),
        bounds=tuple(bounds),
        proven_s=proven_s,
        loading_s=told.loading_s,
        cpu_s=cpu_s,
        end=end,
        faults=tuple(faults),
    )
