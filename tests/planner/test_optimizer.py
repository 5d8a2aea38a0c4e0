"""The optimizer on networks that fall apart into jobs."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from planner.network import NO_WAY, Improvement, InSequence, Network, Solution, Step, Underway
from planner.optimizer import improve
from tests.planner.fleet_networks import (
    OPTIMA_MS,
    check,
    find,
    fleet,
    least_makespan_ms,
    network,
    random_network,
)


def never() -> bool:
    """Do not stop."""
    return False


def last(request: Network, effort: float = 20.0) -> Improvement:
    """The last improvement, after a look at the whole stream."""
    stream = list(improve(request, effort=effort, stop=never))
    for before, after in pairwise(stream):
        assert after.bound_ms >= before.bound_ms
        assert after.effort >= before.effort
        if before.solution is not None:
            assert after.solution is not None
            assert after.solution.makespan_ms <= before.solution.makespan_ms
    for improvement in stream:
        if improvement.solution is not None:
            check(request, improvement.solution)
    return stream[-1]


@pytest.mark.parametrize("size", [(2, 2), (3, 4), (4, 6), (6, 10), (10, 20)])
def test_the_known_optimum_of_a_fleet_is_found_and_proven(size: tuple[int, int]) -> None:
    """Makespan and bound are the optimum that other programs have found."""
    found = last(fleet(*size))
    assert found.solution is not None
    assert found.solution.makespan_ms == found.bound_ms == OPTIMA_MS[size]


@pytest.mark.parametrize("triangle", [True, False])
@pytest.mark.parametrize("limits", [True, False])
@pytest.mark.parametrize("seed", range(12))
def test_the_least_makespan_is_that_of_brute_force(seed: int, limits: bool, triangle: bool) -> None:
    """Over random jobs with two ways each: the optimum, proven, or the proof that there is no plan."""
    request = random_network(np.random.default_rng(seed), 3, 5, triangle=triangle, limits=limits)
    expected = least_makespan_ms(request)
    found = last(request)
    if expected is None:
        assert found.unsolvable
    else:
        assert found.solution is not None
        assert (found.solution.makespan_ms, found.bound_ms) == (expected, expected)


def test_a_larger_fleet_has_a_plan_at_once_and_a_close_bound_soon() -> None:
    """50 robots, 200 drinks: within a few seconds of effort the gap is less than fifteen percent."""
    request = fleet(50, 200)
    stream = list(improve(request, effort=2.5, stop=never))
    assert stream[0].phase == "greedy"
    best = stream[-1].solution
    assert best is not None
    check(request, best)
    assert (best.makespan_ms - stream[-1].bound_ms) / best.makespan_ms < 0.15


def test_the_same_request_has_the_same_stream() -> None:
    """Improvement by improvement, with all efforts."""
    request = fleet(20, 50)
    assert list(improve(request, effort=0.5, stop=never)) == list(improve(request, effort=0.5, stop=never))


def test_it_ends_soon_after_it_is_stopped() -> None:
    """With the best so far."""
    asked = 0

    def stop() -> bool:
        nonlocal asked
        asked += 1
        return asked > 30

    stream = list(improve(fleet(50, 200), effort=60.0, stop=stop))
    assert stream[-1].solution is not None
    assert asked < 60


def test_a_start_is_taken_over_where_it_is_good() -> None:
    """The first improvement is as good as it; a solution of another network is ignored."""
    request = fleet(10, 20)
    best = last(request).solution
    assert best is not None
    first = next(improve(request, effort=1.0, stop=never, start=best))
    assert first.solution is not None
    assert first.solution.makespan_ms == best.makespan_ms
    other = last(fleet(4, 6)).solution
    found = next(improve(request, effort=1.0, stop=never, start=other)).solution
    assert found is not None
    check(request, found)


def test_a_start_that_is_too_much_by_now_is_not_taken_over() -> None:
    """With a team of one, two robots are too many; with an empty battery, two drinks."""
    here, table = np.array([10, 10]), np.full((2, 2), 3_000)
    robots = {"r1": (0, here), "r2": (0, here)}
    drinks = [find(f"d{i}", ["r1", "r2"], place) for i, place in enumerate("ab")]
    two = last_of(network(drinks, tuple("ab"), [table], robots))
    assert two.makespan_ms == 1_010
    one = network(drinks, tuple("ab"), [table], robots, team=1)
    assert {i.solution.makespan_ms for i in improve(one, effort=1.0, stop=never, start=two) if i.solution} == {5_010}
    alone = last_of(one)
    weak = network(drinks, tuple("ab"), [table], robots, work_ms={"r1": 2_000, "r2": 2_000})
    first = next(improve(weak, effort=1.0, stop=never, start=alone)).solution
    assert first is not None
    assert first.makespan_ms == 1_010


def test_what_is_under_way_comes_first() -> None:
    """A robot that is at something for long leaves the drink to the other, though that is farther away."""
    here = {"near": (0, np.array([1_000, 9_000])), "far": (0, np.array([5_000, 9_000]))}
    drink, places = find("drink", ["far", "near"], "spot"), ("spot", "dock")
    table = np.array([[0, 8_000], [8_000, 0]])
    free = last(network([drink], places, [table], here)).solution
    assert free is not None
    assert (free.choices["drink"], free.makespan_ms) == ("near", 2_000)
    drive = Underway(id="drive", robots=("near",), left_ms=4_000, ends=("dock",))
    look = Step(id="look", robots=("near",), fixed_ms=500)
    going = InSequence(parts=(drive, look))
    stream = list(improve(network([drink, going], places, [table], here), effort=5.0, stop=never))
    busy = stream[-1].solution
    assert busy is not None
    assert (busy.choices["drink"], busy.makespan_ms, stream[-1].bound_ms) == ("far", 6_000, 6_000)
    assert [(s.id, s.robots, s.start_ms, s.end_ms) for s in busy.steps] == [
        ("drink/go", ("far",), 0, 5_000),
        ("look", ("near",), 4_000, 4_500),
        ("drink/look", ("far",), 5_000, 6_000),
    ]


def test_a_robot_under_way_is_one_of_the_team() -> None:
    """So that with a team of one it does all the rest."""
    here = {"near": (0, np.array([1_000])), "far": (0, np.array([5_000]))}
    drive = Underway(id="drive", robots=("far",), left_ms=4_000)
    parts = [find("drink", ["far", "near"], "spot"), drive]
    found = last_of(network(parts, ("spot",), [np.zeros((1, 1), dtype=np.int64)], here, team=1))
    assert (found.choices["drink"], found.makespan_ms) == ("far", 10_000)


def last_of(request: Network) -> Solution:
    """The proven optimum."""
    found = list(improve(request, effort=5.0, stop=never))[-1]
    assert found.solution is not None
    assert found.solution.makespan_ms == found.bound_ms
    return found.solution


def test_nothing_to_do_takes_no_time() -> None:
    """And what no robot is needed for takes its own."""
    nothing = network([], (), [np.zeros((0, 0), dtype=np.int64)], {"r": (0, np.zeros(0, dtype=np.int64))})
    assert last_of(nothing).makespan_ms == 0
    think = Step(id="think", robots=(), fixed_ms=70)
    thought = last_of(network([think], (), [np.zeros((0, 0), dtype=np.int64)], {}))
    assert [(s.id, s.start_ms, s.end_ms) for s in thought.steps] == [("think", 0, 70)]


def test_a_drink_that_nobody_reaches_is_proven_to_be_out_of_reach() -> None:
    """By the first improvement."""
    request = network([find("x", ["r"], "a")], ("a",), [np.array([[0]])], {"r": (0, np.array([NO_WAY]))})
    (told,) = improve(request, effort=1.0, stop=never)
    assert told.unsolvable
    assert told.solution is None


def test_too_few_robots_for_the_work_is_proven() -> None:
    """Each can do one of the three drinks before its battery is empty."""
    here, table = np.array([10, 10, 10]), np.full((3, 3), 10)
    robots = {"r1": (0, here), "r2": (0, here)}
    drinks = [find(f"d{i}", ["r1", "r2"], place) for i, place in enumerate("abc")]
    request = network(drinks, tuple("abc"), [table], robots, work_ms={"r1": 2_000, "r2": 2_000})
    assert list(improve(request, effort=5.0, stop=never))[-1].unsolvable
    enough = network(drinks, tuple("abc"), [table], robots, work_ms={"r1": 2_000, "r2": 2_020})
    assert last_of(enough).makespan_ms == 2_020
