"""A thousand robots behind rosbridge, served by one executive: does it keep up, keep its memory, and lose nothing?

Kinematic robots in three processes (patrol_robots.py) drive leg after leg, 10 s each on average, in one task in which
all of them work side by side (patrol_ontology.py); every leg is an action that the planner decides on and the executive
grounds, calls and records, over a connection to each process. `dispatch_*_ms` is from the end of a robot's leg, in its
own process, until the call for its next leg has arrived there: the reply's way, the planner's step, and the call's way.
`lost` counts whatever does not agree between what the robots did and what the executive has recorded: legs begun twice,
not ended, not told of, or told of as failed. `grows_mb` is how much more memory the executive has at the end than after
the first tenth of the time. The trace goes to a file.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO

import numpy as np

from executive import Fleet, TaskStatus
from executive.fleet import TaskHandle
from executive.trace import ActionFinished, ActionStarted, PlanMade, TaskAccepted
from tests.benchmarks.harness import Figure, main
from tests.benchmarks.patrol_ontology import LONGEST_LEG_S, SITE, TASK, robot_name, write_ontologies
from tests.benchmarks.patrol_robots import Patrols

_ROBOTS, _QUICK_ROBOTS = 1000, 100
_DURATION_S, _QUICK_DURATION_S = 600.0, 30.0
_PROCESSES = 3
_SEED = 1
_MB = 1 << 20


def run(quick: bool) -> Mapping[str, Figure]:
    """Measure: dispatch times in ms, memory in MB, actions a second."""
    robots, duration_s = (_QUICK_ROBOTS, _QUICK_DURATION_S) if quick else (_ROBOTS, _DURATION_S)
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        knowledge, trace = Path(folder) / "ontologies", Path(folder) / "trace.jsonl"
        write_ontologies(robots, knowledge)
        far = [stack.enter_context(_process(first, robots)) for first in range(_PROCESSES)]
        file = Path(folder) / "robots.toml"
        file.write_text("".join(_section(n, far[n % _PROCESSES].uri) for n in range(robots)))
        begun_s = time.perf_counter()
        with Fleet.open(SITE, knowledge=knowledge, connect=file, trace=trace) as fleet:
            opened_s = time.perf_counter() - begun_s
            task = fleet.request(TASK)
            cpu_s, memory_mb = _let_work(fleet, task, duration_s)
            done_in_time = sum(process.report().ended for process in far)
            for process in far:
                process.say("over")
            # A leg that is being driven, one that is told to be the last, and as much again.
            result = task.wait_until(fleet.now_s + 4 * LONGEST_LEG_S)
            told = _told(fleet)
        seen = [process.report() for process in far]
    assert result is not None, "the task has not ended although all patrols are over"
    assert result.status is TaskStatus.COMPLETED, result.reason
    dispatches_ms = 1000.0 * np.concatenate([s.dispatches_s for s in seen])
    begun, ended, refused = sum(s.begun for s in seen), sum(s.ended for s in seen), sum(s.refused for s in seen)
    return {
        "robots": robots,
        "processes": _PROCESSES,
        "opened_s": opened_s,
        **told,
        "duration_s": duration_s,
        "actions": ended,
        "actions_per_s": done_in_time / duration_s,
        "dispatch_median_ms": float(np.median(dispatches_ms)),
        "dispatch_p99_ms": float(np.percentile(dispatches_ms, 99)),
        "dispatch_max_ms": float(dispatches_ms.max()),
        "lost": abs(begun - ended) + refused + abs(begun - int(told["started"])) + abs(ended - int(told["succeeded"])),
        "executive_cpu_share": cpu_s / duration_s,
        "memory_mb": memory_mb[-1],
        "grows_mb": memory_mb[-1] - memory_mb[0],
    }


def _let_work(fleet: Fleet, task: TaskHandle, duration_s: float) -> tuple[float, list[float]]:
    """Until the time is over; seconds of the processor that the executive has taken, and its memory at each tenth."""
    task.wait_until(fleet.now_s)  # it is accepted, and its plan is made
    begun_s, begun_cpu_s, memory_mb = fleet.now_s, time.process_time(), list[float]()
    for tenth in range(1, 11):
        ended = task.wait_until(begun_s + tenth * duration_s / 10)
        assert ended is None, f"the task ended too early: {ended}"
        memory_mb.append(_memory_mb())
        print(f"{fleet.now_s - begun_s:.0f} s: {memory_mb[-1]:.0f} MB", file=sys.stderr)
    return time.process_time() - begun_cpu_s, memory_mb


def _memory_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / _MB


def _told(fleet: Fleet) -> Mapping[str, Figure]:
    """What the executive has recorded."""
    started = succeeded = 0
    planned_s = 0.0
    for event in fleet.trace:
        match event:
            case TaskAccepted(t_s=t_s):
                planned_s -= t_s
            case PlanMade(t_s=t_s):
                planned_s += t_s
            case ActionStarted():
                started += 1
            case ActionFinished(failure=""):
                succeeded += 1
            case _:
                pass
    return {"planned_s": planned_s, "started": started, "succeeded": succeeded}


def _section(number: int, uri: str) -> str:
    return f'[robots.{robot_name(number)}]\nuri = "{uri}"\nbinary = true\n'


class _Process:
    """A process with robots."""

    def __init__(self, uri: str, stdin: IO[str], stdout: IO[str]) -> None:
        self.uri, self._stdin, self._stdout = uri, stdin, stdout

    def say(self, line: str) -> None:
        print(line, file=self._stdin, flush=True)

    def report(self) -> Patrols:
        self.say("report")
        return Patrols(**json.loads(self._stdout.readline()))


@contextmanager
def _process(first: int, robots: int) -> Iterator[_Process]:
    """Every third robot, from the first on."""
    command = [
        sys.executable,
        "-m",
        "tests.benchmarks.patrol_robots",
        str(first),
        str(robots),
        str(_PROCESSES),
        str(_SEED),
    ]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=os.environ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            yield _Process(process.stdout.readline().strip(), process.stdin, process.stdout)
        finally:
            process.stdin.close()


if __name__ == "__main__":
    sys.exit(main("fleet", run))
