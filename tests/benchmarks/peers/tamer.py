"""up-tamer, a temporal planner (heuristic search), through unified-planning: its first plan, as it has no metric."""

from __future__ import annotations

from unified_planning.shortcuts import OneshotPlanner, get_environment

from tests.benchmarks.fleets import Instance
from tests.benchmarks.peers.report import Report, Solve, take_part
from tests.benchmarks.peers.temporal import FleetProblem, acts


def prepare(instance: Instance, way: str) -> Solve:
    """Flat problems only."""
    get_environment().credits_stream = None

    def solve(report: Report) -> None:
        problem = FleetProblem(instance, hierarchical=False).problem
        with OneshotPlanner(name="tamer") as planner:
            planner.skip_checks = True  # it takes the metric for one that it does not know, and plans all the same
            result = planner.solve(problem)
        if result.plan is not None:
            report.plan(acts(result.plan))
        else:
            report.note(result.status.name)

    return solve


if __name__ == "__main__":
    take_part(prepare)
