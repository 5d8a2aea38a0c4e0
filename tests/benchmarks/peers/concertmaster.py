"""The planner of this project: the process of the ontology, as any request is planned."""

from __future__ import annotations

import functools
import tempfile
from pathlib import Path

from kb.store import KnowledgeBase, Snapshot
from planner.plan import Plan, PlanStatus
from planner.planner import Session, Solver
from tests.benchmarks.fleet_ontology import ROOM, SITE, task, write_ontologies
from tests.benchmarks.fleets import Act, Instance, travel_times
from tests.benchmarks.peers.processes import acts
from tests.benchmarks.peers.report import Report, Solve, take_part

EFFORT = 10_000.0
"""Deterministic seconds; more than there is time for, as the clock ends a run here."""

PROLOG_ALONE = "prolog"


def prepare(instance: Instance, way: str) -> Solve:
    """Load and compile the ontology. Ways: "" (all solvers), "prolog" (without OR-tools)."""
    with tempfile.TemporaryDirectory() as folder:
        write_ontologies(instance, Path(folder) / "ontologies")
        snapshot = KnowledgeBase(SITE, Path(folder) / "ontologies").snapshot()
    loading = Session("loading", snapshot, task(instance), {"room": ROOM}, robots=instance.robots)
    loading.exclusions()  # has SWI-Prolog load the planner's files, as a planner that serves has long done
    loading.close()
    solver = Solver.PROLOG if way == PROLOG_ALONE else Solver.OPTIMIZER
    return functools.partial(_solve, instance, snapshot, solver)


def _solve(instance: Instance, snapshot: Snapshot, solver: Solver, report: Report) -> None:
    session = Session("bench", snapshot, task(instance), {"room": ROOM}, robots=instance.robots)
    for plan in session.plans(travel_times(instance), now_s=0.0, effort=EFFORT, solver=solver):
        if not plan.solved:
            report.note(f"{plan.status}: {plan.reason}")
            continue
        report.plan(_acts(plan), round(1000.0 * plan.makespan_s))
        report.bound(round(1000.0 * plan.lower_bound_s))
        if plan.status is PlanStatus.SOLVED_OPTIMALLY:
            report.proven()


def _acts(plan: Plan) -> list[Act]:
    steps = []
    for step in plan.steps:
        what = step.action.argument("drink") or step.action.argument("door") or ""
        steps.append((step.start_s, step.action.process, step.action.robot or "", str(what)))
    return acts(steps)


if __name__ == "__main__":
    take_part(prepare)
