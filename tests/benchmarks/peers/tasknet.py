"""GTPyhop, a hierarchical task network planner, with the robots' clocks kept by hand, as it knows no time.

First one plan: the drink that is farthest from all robots first, each by the robot that has it soonest. Then the bound
is tightened: each robot in turn serves any sequence of drinks, and an action fails that would end at the best
makespan so far or later; when no plan is left, the last is the best.
"""

from __future__ import annotations

import contextlib
import functools
import io
import sys
from collections.abc import Callable
from typing import Any

with contextlib.redirect_stdout(io.StringIO()):  # it introduces itself
    import gtpyhop

from tests.benchmarks.fleets import FIND, Act, Instance
from tests.benchmarks.peers.report import Report, Solve, take_part

# The default strategy never goes back: that it finds no plan would prove nothing.
STRATEGY = "iterative_dfs_backtracking"


def prepare(instance: Instance, way: str) -> Solve:
    """Without fetching only."""
    return functools.partial(_solve, instance)


def _solve(instance: Instance, report: Report) -> None:
    def soonest_ms(drink: int) -> int:
        return min(instance.duration_ms(FIND, robot, drink, robot) for robot in instance.finders(drink))

    order = sorted(range(instance.drinks), key=lambda drink: -soonest_ms(drink))
    plan = _plan(instance, _greedy(instance), [("find", drink) for drink in order])
    while plan is not None:
        report.plan([(FIND, robot, drink) for name, robot, drink in plan if name == "detect"])
        plan = _plan(instance, _bounded(instance, _makespan_ms(instance, plan)), [("serve", 0)])
    report.proven()


def _plan(instance: Instance, domain: Any, tasks: list[tuple[str, int]]) -> list[Act] | None:
    state = gtpyhop.State("start")
    state.at = dict(enumerate(range(instance.robots)))
    state.clock_ms = dict.fromkeys(range(instance.robots), 0)
    state.finder = dict.fromkeys(range(instance.drinks))
    with gtpyhop.PlannerSession(domain=domain, verbose=0, structured_logging=False, strategy=STRATEGY) as session:
        result = session.find_plan(state, tasks)
    return list(result.plan) if result.success else None


def _makespan_ms(instance: Instance, plan: list[Act]) -> int:
    at, clock_ms = list(range(instance.robots)), [0] * instance.robots
    for name, robot, drink in plan:
        if name == "detect":
            clock_ms[robot] += instance.duration_ms(FIND, robot, drink, at[robot])
            at[robot] = instance.spot(drink)
    return max(clock_ms)


def _domain(instance: Instance, below_ms: float, task: str, methods: list[Callable[..., Any]]) -> Any:
    domain = gtpyhop.Domain(f"{task}_{below_ms}")
    gtpyhop.set_current_domain(domain)

    def navigate(state: Any, robot: int, drink: int) -> Any:
        state.clock_ms[robot] += instance.travel_ms(robot, state.at[robot], instance.spot(drink))
        state.at[robot] = instance.spot(drink)
        return state if state.clock_ms[robot] < below_ms else False

    def detect(state: Any, robot: int, drink: int) -> Any:
        here = instance.spot(drink)
        if state.at[robot] != here or robot not in instance.finders(drink) or state.finder[drink] is not None:
            return False
        state.clock_ms[robot] += instance.duration_ms(FIND, robot, drink, here)
        state.finder[drink] = robot
        return state if state.clock_ms[robot] < below_ms else False

    gtpyhop.declare_actions(navigate, detect)
    for number, method in enumerate(methods):
        method.__name__ = f"method_{number}"
    gtpyhop.declare_task_methods(task, *methods)
    return domain


def _greedy(instance: Instance) -> Any:
    """A method of `find` for each rank: the robot that has the drink soonest, the next, ..."""

    def nth(rank: int, state: Any, drink: int) -> Any:
        ranked = sorted(
            (state.clock_ms[robot] + instance.duration_ms(FIND, robot, drink, state.at[robot]), robot)
            for robot in instance.finders(drink)
        )
        if rank >= len(ranked):
            return False
        robot = ranked[rank][1]
        return [("navigate", robot, drink), ("detect", robot, drink)]

    ranks = [functools.partial(nth, rank) for rank in range(instance.robots)]
    return _domain(instance, float("inf"), "find", list(ranks))


def _bounded(instance: Instance, below_ms: int) -> Any:
    """A method of `serve` for each drink that a robot may take next, and one to leave the rest to the next robot."""

    def take(drink: int, state: Any, robot: int) -> Any:
        if state.finder[drink] is not None or robot not in instance.finders(drink):
            return False
        if state.clock_ms[robot] + instance.duration_ms(FIND, robot, drink, state.at[robot]) >= below_ms:
            return False
        return [("navigate", robot, drink), ("detect", robot, drink), ("serve", robot)]

    def leave(state: Any, robot: int) -> Any:
        if robot + 1 < instance.robots:
            return [("serve", robot + 1)]
        return [] if None not in state.finder.values() else False

    takes = [functools.partial(take, drink) for drink in range(instance.drinks)]
    return _domain(instance, below_ms, "serve", [*takes, leave])


if __name__ == "__main__":
    sys.setrecursionlimit(100_000)
    take_part(prepare)
