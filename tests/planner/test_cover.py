"""Bounds and covers by run tables."""

from __future__ import annotations

import numpy as np
import pytest

from planner.cover import Cover
from planner.jobs import Jobs, separate
from planner.network import Network
from planner.runs import fill
from tests.planner.fleet_networks import OPTIMA_MS, fleet, least_makespan_ms, random_network


def cover(request: Network, horizon_ms: int) -> tuple[Jobs, Cover]:
    """The tables of a network that falls apart."""
    jobs = separate(request)
    assert jobs is not None
    tables = [fill(crew, jobs.count, horizon_ms, 100_000) for crew in jobs.crews]
    return jobs, Cover(jobs, [table for table in tables if table is not None])


def never() -> bool:
    """Do not stop."""
    return False


@pytest.mark.parametrize("size", [(3, 4), (6, 10), (10, 20)])
def test_the_fractional_bound_is_close_below_the_optimum(size: tuple[int, int]) -> None:
    """It rises step by step, to within five percent of it and never beyond it."""
    _, runs = cover(fleet(*size), 15_000)
    bounds = list(runs.raised(1, never))
    assert bounds == sorted(set(bounds))
    assert 0.95 * OPTIMA_MS[size] <= bounds[-1] <= OPTIMA_MS[size]


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("triangle", [True, False])
def test_there_is_an_exact_cover_from_the_least_makespan_on_and_not_before(seed: int, triangle: bool) -> None:
    """With limits of team and work."""
    request = random_network(np.random.default_rng(seed), 3, 4, triangle=triangle, limits=seed % 2 == 0)
    least_ms = least_makespan_ms(request)
    jobs, runs = cover(request, 10_000)
    if least_ms is None:
        assert runs.exact(10_000, 1_000, never).none
        return
    assert all(bound <= least_ms for bound in runs.raised(1, never))
    assert runs.exact(least_ms - 1, 1_000, never).none
    found = runs.exact(least_ms, 1_000, never).runs
    assert found is not None
    crews = [crew for crew in jobs.crews for _ in crew.robots]
    done = [int(crew.job[leg]) for crew, legs in zip(crews, found, strict=True) for leg in legs]
    assert sorted(done) == list(range(jobs.count))
    assert sum(map(bool, found)) <= jobs.team


def test_a_cover_stops_when_told_to() -> None:
    """Without an answer."""
    _, runs = cover(fleet(10, 20), 11_000)
    answer = runs.exact(10_100, 1_000, lambda: True)
    assert answer.runs is None
    assert list(runs.raised(1, lambda: True)) == []
