"""up-aries, a temporal and hierarchical planner (constraints and SAT), through unified-planning, anytime."""

from __future__ import annotations

import time

import grpc
from unified_planning.engines import PlanGenerationResultStatus
from unified_planning.shortcuts import AnytimePlanner, get_environment

from tests.benchmarks.fleets import Instance
from tests.benchmarks.peers.report import Report, Solve, take_part
from tests.benchmarks.peers.temporal import FleetProblem, acts

FINISH_S = 0.5
"""Some of its plans arrive only when its time is over: it is given so much less than it has."""


def prepare(instance: Instance, way: str) -> Solve:
    """Ways: flat, hierarchical."""
    get_environment().credits_stream = None

    def solve(report: Report) -> None:
        started = time.perf_counter()
        problem = FleetProblem(instance, hierarchical=way == "hierarchical").problem
        while (left_s := started + report.limit_s - FINISH_S - time.perf_counter()) > 0.0:
            try:
                _tell_plans(problem, report, left_s)
                return
            except grpc.RpcError as lost:  # its server ends now and then before it has told: it is asked again
                report.note(f"lost its server: {lost.details()}")

    return solve


def _tell_plans(problem: object, report: Report, limit_s: float) -> None:
    with AnytimePlanner(name="aries") as planner:
        for result in planner.get_solutions(problem, timeout=limit_s):
            if result.plan is not None:
                report.plan(acts(result.plan))
            if result.status is PlanGenerationResultStatus.SOLVED_OPTIMALLY:
                report.proven()
            elif result.plan is None:
                report.note(result.status.name)


if __name__ == "__main__":
    take_part(prepare)
