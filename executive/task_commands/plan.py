"""`concertmaster plan`: plan a task or a goal; nothing moves."""

from __future__ import annotations

import argparse
import signal
import sys
from typing import Any, Self

from executive.exit_codes import OK, REFUSED, complain
from executive.task_commands.asked import arguments_of, check_goal_options, check_store, open_fleet, store
from planner.plan import Plan


def plan(options: argparse.Namespace) -> int:
    """Plan it; the exit status."""
    arguments = arguments_of(options)
    check_goal_options(options)
    if options.goal is not None:
        return _plan_goal(options)
    with open_fleet(options) as fleet, _Search() as search:
        made, lacking = fleet.plan(
            options.task,
            robots=options.robots,
            effort=options.effort,
            stop=search.stopped,
            on_plan=search.tell,
            **arguments,
        )
    print(f"{made.status}: {made.reason}")
    _print_steps(made)
    for sentence in lacking:
        complain(sentence)
    return OK if made.solved else REFUSED


def _plan_goal(options: argparse.Namespace) -> int:
    with open_fleet(options) as fleet:
        check_store(options, fleet)
        found, made = fleet.plan_goal(options.goal)
        print(f"{found.status}: {found.reason}")
        if found.program is None:
            return REFUSED
        if made is not None:
            _print_steps(made)
        if options.store:
            store(options, fleet, found)
    return OK


class _Search:
    """A line of progress while a plan is looked for, where somebody is watching; Ctrl-C ends the search."""

    def __init__(self) -> None:
        self._stopped = False
        self._before: Any = None
        self._shown = False

    def __enter__(self) -> Self:
        self._before = signal.signal(signal.SIGINT, self._stop)
        return self

    def __exit__(self, *_: object) -> None:
        signal.signal(signal.SIGINT, self._before)
        if self._shown:
            print(file=sys.stderr)

    def stopped(self) -> bool:
        return self._stopped

    def tell(self, plan: Plan) -> None:
        if plan.solved and sys.stderr.isatty():
            self._shown = True
            told = f"makespan {plan.makespan_s:.2f} s, at least {plan.lower_bound_s:.2f} s ({plan.phase})"
            print(f"\r{told:<78}", end="", file=sys.stderr, flush=True)

    def _stop(self, *_: object) -> None:
        self._stopped = True


def _print_steps(plan: Plan) -> None:
    for step in plan.steps:
        print(f"  [{step.action}] from {step.start_s:.2f} to {step.end_s:.2f}")
