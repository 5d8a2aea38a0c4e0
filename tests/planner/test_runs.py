"""Run tables against all orders of all sets."""

from __future__ import annotations

from itertools import combinations, permutations, product

import numpy as np
import pytest

from planner.jobs import NEVER, SAME_ROW, Crew, separate
from planner.runs import earliest_ms, fill
from tests.planner.fleet_networks import fleet, random_network


def run_ms(crew: Crew, legs: tuple[int, ...]) -> tuple[int, int]:
    """Time and work of a run."""
    ms, work_ms, row = crew.start.ms, crew.start.work_ms, crew.first_ms
    for leg in legs:
        ms += int(row[leg])
        work_ms += int(row[leg] - crew.computing_ms[leg])
        row = row if crew.end[leg] == SAME_ROW else crew.ms[crew.end[leg]]
    return ms, work_ms


def all_sets(crew: Crew, horizon_ms: int) -> dict[tuple[int, ...], int]:
    """Least times by set of jobs, of those within the horizon and the robot's work."""
    jobs = sorted(set(crew.job.tolist()))
    best = {}
    for size in range(1, len(jobs) + 1):
        for chosen in combinations(jobs, size):
            times = [
                run_ms(crew, legs)
                for order in permutations(chosen)
                for legs in product(*(np.flatnonzero(crew.job == job).tolist() for job in order))
            ]
            limit_ms = NEVER if crew.work_ms is None else crew.work_ms
            fitting = [ms for ms, work_ms in times if ms <= horizon_ms and work_ms <= limit_ms]
            if fitting:
                best[chosen] = min(fitting)
    return best


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("triangle", [True, False])
@pytest.mark.parametrize("horizon_ms", [60, 150, 10_000])
def test_a_table_has_all_sets_with_their_least_times(seed: int, triangle: bool, horizon_ms: int) -> None:
    """And an order that takes that time; which sets can be added to; whether subsets take no longer."""
    request = random_network(np.random.default_rng(seed), 2, 4, triangle=triangle, limits=seed % 2 == 1)
    jobs = separate(request)
    assert jobs is not None
    for crew in jobs.crews:
        expected = all_sets(crew, horizon_ms)
        table = fill(crew, jobs.count, horizon_ms, 10_000)
        assert table is not None
        sets = [tuple(row[:size]) for row, size in zip(table.jobs.tolist(), table.size.tolist(), strict=True)]
        assert dict(zip(sets, table.ms.tolist(), strict=True)) == expected
        for index, chosen in enumerate(sets):
            legs = table.legs(index)
            assert tuple(sorted(crew.job[list(legs)].tolist())) == chosen
            assert run_ms(crew, legs)[0] == expected[chosen]
            assert table.find(list(chosen)) == index
            larger = [ms for other, ms in expected.items() if len(other) == len(chosen) + 1 and {*chosen} <= {*other}]
            assert table.longer_ms[index] == min(larger, default=NEVER)
        assert table.closed == all(
            expected.get(tuple(job for job in chosen if job != left), NEVER) <= ms
            for chosen, ms in expected.items()
            for left in (chosen if len(chosen) > 1 else ())
        )


def test_a_table_too_large_is_given_up() -> None:
    """Instead of filling the memory."""
    jobs = separate(fleet(3, 12))
    assert jobs is not None
    assert fill(jobs.crews[0], jobs.count, 10**9, 1_000) is None


def test_the_earliest_end_of_a_leg_may_be_by_a_detour() -> None:
    """Where the way straight there takes longer, or there is none."""
    jobs = separate(random_network(np.random.default_rng(3), 2, 4, triangle=False))
    assert jobs is not None
    for crew in jobs.crews:
        ends = [
            [run_ms(crew, (*before, leg))[0] for n in range(4) for before in product(range(len(crew.legs)), repeat=n)]
            for leg in range(len(crew.legs))
        ]
        assert earliest_ms(crew).tolist() == [min(*times, NEVER) for times in ends]
