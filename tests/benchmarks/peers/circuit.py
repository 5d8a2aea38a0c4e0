"""A plain model in OR-tools CP-SAT: what one writes by hand for just this instance.

Each robot goes through a circuit of optional stops. Without fetching, the time of a circuit is the sum of its arcs.
In the coupled variant every stop has a start and an end; a drink is fetched after it was found, and the door
is a resource that one robot uses at a time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from ortools.sat.python import cp_model

from tests.benchmarks.fleets import (
    COLLECT,
    DETECT_MS,
    FETCHING,
    FIND,
    GRASP_MS,
    PASS_MS,
    PUT_MS,
    SERVE,
    Act,
    Instance,
)
from tests.benchmarks.peers.report import Report, Solve, take_part

WORKERS = 2
UNIT_MS = 100
"""All times are multiples of it; the model counts in it."""

ReadPlan: TypeAlias = Callable[[cp_model.CpSolverSolutionCallback], list[Act]]


def prepare(instance: Instance, way: str) -> Solve:
    """Nothing to load but OR-tools."""
    return lambda report: (_solve_coupled if instance.coupled else _solve)(instance, report)


def _solve(instance: Instance, report: Report) -> None:
    model = cp_model.CpModel()
    makespan = model.new_int_var(0, _horizon(instance), "makespan")
    goes: dict[tuple[int, int, int], cp_model.IntVar] = {}
    """By robot, node and node (0: the dock; drink d: d + 1): the robot goes from the one to the other."""
    visited: list[list[cp_model.IntVar]] = [[] for _ in range(instance.drinks)]
    for robot in range(instance.robots):
        drinks = [d for d in range(instance.drinks) if robot in instance.finders(d)]
        idle = model.new_bool_var("")
        arcs: list[tuple[int, int, cp_model.LiteralT]] = [(0, 0, idle)]
        time = []
        for drink in drinks:
            visits = model.new_bool_var("")
            visited[drink].append(visits)
            model.add_implication(idle, ~visits)
            arcs.append((drink + 1, drink + 1, ~visits))
            arcs.append((drink + 1, 0, model.new_bool_var("")))  # where it ends does not matter
            for before in (-1, *drinks):
                if before == drink:
                    continue
                arc = goes[robot, before + 1, drink + 1] = model.new_bool_var("")
                arcs.append((before + 1, drink + 1, arc))
                start = robot if before < 0 else instance.spot(before)
                time.append(arc * (instance.duration_ms(FIND, robot, drink, start) // UNIT_MS))
        model.add_circuit(arcs)
        model.add(sum(time) <= makespan)
    for visits_by_robot in visited:
        model.add_exactly_one(visits_by_robot)
    model.minimize(makespan)

    def plan(solution: cp_model.CpSolverSolutionCallback) -> list[Act]:
        after = {(r, a): b for (r, a, b), arc in goes.items() if solution.boolean_value(arc)}
        acts: list[Act] = []
        for robot in range(instance.robots):
            node = 0
            while node := after.get((robot, node), 0):
                acts.append((FIND, robot, node - 1))
        return acts

    _run(model, report, plan)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stop:
    """Finding (even numbers) or fetching (odd) a drink; times from setting off to being free again."""

    drink: int
    start: cp_model.IntVar
    end: cp_model.IntVar
    by: dict[int, cp_model.IntVar]
    leaves: cp_model.IntVar | None = None
    returns: cp_model.IntVar | None = None


def _solve_coupled(instance: Instance, report: Report) -> None:
    model = cp_model.CpModel()
    horizon = _horizon(instance)
    makespan = model.new_int_var(0, horizon, "makespan")

    def moment() -> cp_model.IntVar:
        return model.new_int_var(0, horizon, "")

    stops: list[_Stop] = []
    at_door = []
    for drink in range(instance.drinks):
        finders = {r: model.new_bool_var("") for r in instance.finders(drink)}
        fetchers = {r: model.new_bool_var("") for r in instance.fetchers()}
        found = _Stop(drink=drink, start=moment(), end=moment(), by=finders)
        fetched = _Stop(drink=drink, start=moment(), end=moment(), by=fetchers, leaves=moment(), returns=moment())
        model.add(fetched.start >= found.end)
        for stop in (found, fetched):
            model.add_exactly_one(stop.by.values())
            model.add(stop.end <= makespan)
            stops.append(stop)
        assert fetched.leaves is not None
        assert fetched.returns is not None
        passing = PASS_MS // UNIT_MS
        at_door += [model.new_fixed_size_interval_var(t, passing, "") for t in (fetched.leaves, fetched.returns)]
        model.add(fetched.end == fetched.returns + passing)
        for robot, does in fetchers.items():
            serving = instance.duration_ms(SERVE, robot, drink, instance.outside) // UNIT_MS
            model.add(fetched.returns >= fetched.leaves + passing + serving).only_enforce_if(does)
    model.add_no_overlap(at_door)
    for robot in range(instance.robots):
        _circuit(model, instance, stops, robot)
    model.minimize(makespan)

    def plan(solution: cp_model.CpSolverSolutionCallback) -> list[Act]:
        timed: list[tuple[int, int, Act]] = []
        for stop in stops:
            robot = next(r for r, does in stop.by.items() if solution.boolean_value(does))
            if stop.leaves is None or stop.returns is None:
                moments = [(FIND, stop.start)]
            else:
                moments = list(zip(FETCHING, (stop.start, stop.leaves, stop.leaves, stop.returns), strict=True))
            for number, (what, when) in enumerate(moments):
                timed.append((solution.value(when), number, (what, robot, stop.drink)))
        return [act for _, _, act in sorted(timed)]

    _run(model, report, plan)


def _circuit(model: cp_model.CpModel, instance: Instance, stops: list[_Stop], robot: int) -> None:
    """The stops that a robot makes, one after the other; where it comes from is how long the next takes."""
    mine = [number for number, stop in enumerate(stops) if robot in stop.by]
    idle = model.new_bool_var("")
    arcs: list[tuple[int, int, cp_model.LiteralT]] = [(0, 0, idle)]
    for number in mine:
        stop = stops[number]
        does = stop.by[robot]
        model.add_implication(idle, ~does)
        arcs.append((number + 1, number + 1, ~does))
        arcs.append((number + 1, 0, model.new_bool_var("")))
        for before in (-1, *mine):
            if before == number:
                continue
            arc = model.new_bool_var("")
            arcs.append((before + 1, number + 1, arc))
            start = robot if before < 0 else _end_of(instance, stops[before])
            if before >= 0:
                model.add(stop.start >= stops[before].end).only_enforce_if(arc)
            if stop.leaves is None:
                takes = instance.duration_ms(FIND, robot, stop.drink, start) // UNIT_MS
                model.add(stop.end == stop.start + takes).only_enforce_if(arc)
            else:
                takes = instance.duration_ms(COLLECT, robot, stop.drink, start) // UNIT_MS
                model.add(stop.leaves >= stop.start + takes).only_enforce_if(arc)
    model.add_circuit(arcs)


def _end_of(instance: Instance, stop: _Stop) -> int:
    return instance.spot(stop.drink) if stop.leaves is None else instance.inside


def _horizon(instance: Instance) -> int:
    """The slowest robot does everything, each leg from one end of the world to the other."""
    xs, ys = [x for x, _ in instance.xy_dm], [y for _, y in instance.xy_dm]
    leg = math.ceil((max(xs) - min(xs) + max(ys) - min(ys)) / min(instance.speed_mps))
    find = leg + DETECT_MS // UNIT_MS
    fetch = 4 * leg + (GRASP_MS + PUT_MS + 2 * PASS_MS) // UNIT_MS
    return instance.drinks * (find + (fetch if instance.coupled else 0))


class _Teller(cp_model.CpSolverSolutionCallback):
    """Tells each plan when it is found."""

    def __init__(self, report: Report, plan: ReadPlan) -> None:
        super().__init__()
        self._report, self._plan = report, plan

    def on_solution_callback(self) -> None:
        self._report.plan(self._plan(self))


def _run(model: cp_model.CpModel, report: Report, plan: ReadPlan) -> None:
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = WORKERS
    solver.best_bound_callback = lambda bound: report.bound(UNIT_MS * bound)
    if solver.solve(model, _Teller(report, plan)) == cp_model.OPTIMAL:
        report.proven()


if __name__ == "__main__":
    take_part(prepare)
