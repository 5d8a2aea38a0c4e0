"""Engines of unified-planning, each in a process of its own.

An engine may search for ever, start servers of its own, or die: so it runs in a child process, in a
session of its own that is ended as a whole, whatever happens. The problem goes in as a protocol buffer of
unified-planning, answers come out as lines of JSON.

Run as a program, this module is that child: `python -m planner.classical_engine ENGINE`.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import signal
import subprocess
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from threading import Thread, Timer
from typing import IO, Any

from grpc import RpcError
from unified_planning.engines import PlanGenerationResult, PlanGenerationResultStatus
from unified_planning.environment import get_environment
from unified_planning.grpc.generated import unified_planning_pb2
from unified_planning.grpc.proto_reader import ProtobufReader
from unified_planning.grpc.proto_writer import ProtobufWriter
from unified_planning.model import AbstractProblem
from unified_planning.plans import HierarchicalPlan, Plan, TimeTriggeredPlan

from kb.errors import DependencyMissing

ARIES = "aries"
PYPERPLAN = "pyperplan"
_PACKAGES = {ARIES: "up_aries", PYPERPLAN: "up_pyperplan"}
_PROOFS = {
    ARIES: (PlanGenerationResultStatus.UNSOLVABLE_PROVEN,),
    # Its search (A* with weights, h^add) looks into all states; up-pyperplan 1.1 means to say so, but does not.
    PYPERPLAN: (PlanGenerationResultStatus.UNSOLVABLE_PROVEN, PlanGenerationResultStatus.UNSOLVABLE_INCOMPLETELY),
}
_SEARCH_S, _MOST_LOST = 1.0, 10
HORIZON_MS = 50_000_000
"""aries looks no further than its horizon, which is ten thousand units where nobody says; above this, it overflows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedAction:
    """An action of a plan as an engine gives it; times are None where the plan has none."""

    name: str
    objects: tuple[str, ...]
    start: Fraction | None
    duration: Fraction | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What an engine says.

    Attributes:
        unsolvable: It has proven that there is no plan.
        actions: In order of start; None: it has no plan (yet).
        note: How it ended, in its words.
    """

    unsolvable: bool
    actions: tuple[TimedAction, ...] | None
    note: str


def require_engines(*names: str) -> None:
    """Check, without importing them, that engines are installed.

    Args:
        names: ARIES or PYPERPLAN; both if left out.

    Raises:
        DependencyMissing: One is not; with the command that installs it.
    """
    for name in names or _PACKAGES:
        if importlib.util.find_spec(_PACKAGES[name]) is None:
            told = f"goals need the planner {name}, which is not installed"
            raise DependencyMissing(f"{told}: run `pip install 'concertmaster[goals]'`")


class Engine:
    """An engine at work on a problem; to be used in a `with` statement, after which nothing of it runs."""

    def __init__(self, name: str, problem: AbstractProblem, *, timeout_s: float) -> None:
        """Begin.

        Args:
            name: PYPERPLAN, which stops at its first plan, or ARIES, which goes on to better ones.
            timeout_s: It is ended after so long.

        Raises:
            DependencyMissing: It is not installed.
        """
        require_engines(name)
        self._child = subprocess.Popen(
            [sys.executable, "-P", "-m", __name__, name],  # -P: modules from our path, not from the working folder
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            # The order of its sets decides between equally good plans: the same problem is to have the same plan.
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "PYTHONHASHSEED": "0"},
        )
        self._timer = Timer(timeout_s, self._end)
        self._timer.start()
        message = ProtobufWriter().convert(problem).SerializeToString()
        self._feeder = Thread(target=self._feed, args=(message,))
        self._feeder.start()

    @property
    def group(self) -> int:
        """The process group of the engine and all that it starts."""
        return self._child.pid

    def __enter__(self) -> Engine:
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.cancel()
        self._timer.join()
        self._end()
        self._feeder.join()
        assert self._child.stdout is not None
        self._child.stdout.close()
        self._child.wait()

    def answers(self) -> Iterator[Answer]:
        """What it says, until it ends or is ended."""
        assert self._child.stdout is not None
        for line in self._child.stdout:
            said: dict[str, Any] = json.loads(line)
            plan = said["plan"]
            yield Answer(
                unsolvable=said["unsolvable"],
                actions=None if plan is None else tuple(_timed(*row) for row in plan),
                note=said["note"],
            )

    def _feed(self, message: bytes) -> None:
        assert self._child.stdin is not None
        with contextlib.suppress(BrokenPipeError), self._child.stdin as stdin:
            stdin.write(message)

    def _end(self) -> None:
        # The child leads its session: its number names the group for as long as any of it runs.
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._child.pid, signal.SIGKILL)


def _timed(name: str, objects: list[str], start: str | None, duration: str | None) -> TimedAction:
    return TimedAction(
        name=name,
        objects=tuple(objects),
        start=None if start is None else Fraction(start),
        duration=None if duration is None else Fraction(duration),
    )


def _rows(plan: Plan | None) -> list[list[Any]] | None:
    if isinstance(plan, HierarchicalPlan):
        plan = plan.action_plan
    if plan is None:
        return None
    if isinstance(plan, TimeTriggeredPlan):
        timed = sorted(plan.timed_actions, key=lambda row: (row[0], str(row[1])))
    else:
        timed = [(None, instance, None) for instance in plan.actions]
    return [
        [
            instance.action.name,
            [str(p) for p in instance.actual_parameters],
            None if start is None else str(start),
            None if duration is None else str(duration),
        ]
        for start, instance, duration in timed
    ]


def _main(name: str) -> None:
    warnings.simplefilter("ignore")
    os.environ["ARIES_PLANNING_HORIZON"] = str(HORIZON_MS)
    os.environ["ARIES_PLANNING_PREPRO_STATE_VARS"] = "false"  # panics on relations that have no value at first
    environment = get_environment()  # the only one that the reader knows
    environment.credits_stream = None
    message = unified_planning_pb2.Problem()
    message.ParseFromString(sys.stdin.buffer.read())
    problem = ProtobufReader().convert(message, environment)
    with open(os.devnull, "w") as log:  # noqa: PTH123 - devnull is no path
        if name == ARIES:
            results = _by_aries(problem, log)
        else:
            with environment.factory.OneshotPlanner(name=name) as planner:
                planner.skip_checks = True  # it has no opinion on problems without parameters
                results = iter([planner.solve(problem)])
        for result in results:
            said = {
                "unsolvable": result.status in _PROOFS[name],
                "plan": _rows(result.plan),
                "note": "; ".join([result.status.name, *(m.message for m in result.log_messages or ())]),
            }
            print(json.dumps(said), flush=True)  # noqa: T201 - this is how the child talks


def _by_aries(problem: AbstractProblem, log: IO[str]) -> Iterator[PlanGenerationResult]:
    """What aries finds, each plan faster than those before.

    It has no proof where actions may be repeated, so it searches for a second; twice as long, and so on, until it
    has a plan. Plans on the way may get lost, but not the last one: that comes with the end of the search. Now and
    then its server is gone before that.
    """
    search_s, lost, solved = _SEARCH_S, 0, False
    while lost < _MOST_LOST:
        status = PlanGenerationResultStatus.INTERMEDIATE
        with contextlib.suppress(RpcError), get_environment().factory.AnytimePlanner(name=ARIES) as planner:
            for result in planner.get_solutions(problem, timeout=search_s, output_stream=log):
                status, solved = result.status, solved or result.plan is not None
                yield result
        if status is PlanGenerationResultStatus.INTERMEDIATE:
            lost += 1
        elif status is not PlanGenerationResultStatus.TIMEOUT or solved:
            return
        else:
            search_s *= 2


if __name__ == "__main__":
    _main(sys.argv[1])
