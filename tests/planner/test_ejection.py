"""Greedy runs and the ejection pool."""

from __future__ import annotations

import numpy as np
import pytest

from planner.ejection import Pool, least_ms
from planner.jobs import NEVER, Jobs, separate
from tests.planner.fleet_networks import OPTIMA_MS, fleet, random_network


def taken_apart(size: tuple[int, int]) -> Jobs:
    """The jobs of a fleet."""
    jobs = separate(fleet(*size))
    assert jobs is not None
    return jobs


def done(jobs: Jobs, pool: Pool) -> list[int]:
    """Jobs in the runs of a pool, ascending."""
    crews = [crew for crew in jobs.crews for _ in crew.robots]
    return sorted(int(crew.job[leg]) for crew, legs in zip(crews, pool.runs, strict=True) for leg in legs)


@pytest.mark.parametrize("size", [(3, 4), (6, 10), (10, 20)])
def test_the_pool_gets_within_the_least_makespan(size: tuple[int, int]) -> None:
    """From greedy runs, without losing a job."""
    jobs = taken_apart(size)
    first = Pool(jobs, (), NEVER - 1, np.random.default_rng(1))
    first.greedy()
    assert first.complete
    assert done(jobs, first) == list(range(jobs.count))
    assert first.makespan_ms < 1.5 * OPTIMA_MS[size]
    pool = Pool(jobs, first.runs, OPTIMA_MS[size], np.random.default_rng(1))
    while not pool.complete and pool.looks < 1_000_000:
        pool.step()
    assert pool.makespan_ms == OPTIMA_MS[size]
    assert done(jobs, pool) == list(range(jobs.count))


def test_no_job_ends_before_its_least_time() -> None:
    """And a pool within less stays incomplete."""
    jobs = taken_apart((3, 4))
    pool = Pool(jobs, (), max(least_ms(jobs)) - 1, np.random.default_rng(1))
    for _ in range(50):
        pool.step()
    assert not pool.complete


def test_tidying_shortens_the_runs_in_all_and_keeps_the_horizon() -> None:
    """Every job stays in one run."""
    jobs = taken_apart((6, 10))
    pool = Pool(jobs, (), 40_000, np.random.default_rng(1))
    pool.greedy()
    before = pool.total_ms
    pool.tidy(2_000)
    assert pool.total_ms < before
    assert pool.makespan_ms <= 40_000
    assert done(jobs, pool) == list(range(jobs.count))


@pytest.mark.parametrize("seed", range(5))
def test_team_and_work_are_kept_to(seed: int) -> None:
    """Whatever is pushed out."""
    jobs = separate(random_network(np.random.default_rng(seed), 3, 5, triangle=True, limits=True))
    assert jobs is not None
    pool = Pool(jobs, (), 300, np.random.default_rng(1))
    for _ in range(60):
        if not pool.complete:
            pool.step()
        assert sum(map(bool, pool.runs)) <= jobs.team
