"""The exact search against trying every execution."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from kb.prolog import Entry
from kb.terms import Term, struct
from tests.planner.brute_force import Maker, Tree, World, least, random_world, request, travel_tables

_CASES = 300
_REVISION = -1

_load_facts = Entry(search_path="kb_rules", file="facts", name="load_facts")
_drop_facts = Entry(search_path="kb_rules", file="facts", name="drop_facts")
_open_session = Entry(search_path="planner_golog", file="steps", name="open_session")
_close_session = Entry(search_path="planner_golog", file="steps", name="close_session")
_look_ahead = Entry(search_path="planner_golog", file="planning", name="look_ahead")
_search_plan = Entry(search_path="planner_golog", file="planning", name="search_plan")


def plan(body: Term, world: World, max_nodes: int) -> Any:
    """What the planner answers for a program."""
    _load_facts([*world.facts(_REVISION), *request(body, _REVISION)])
    try:
        _open_session(struct("request", "test", _REVISION, "Main", world.limit, 0))
        _look_ahead(struct("ahead", "test", 0, travel_tables(world)))
        return _search_plan(struct("search", "test", max_nodes, -1))
    finally:
        _close_session("test")
        _drop_facts(_REVISION)


def case(seed: int) -> tuple[Term, Tree, World]:
    """A program, its tree and its world."""
    rng = np.random.default_rng(seed)
    world = random_world(rng)
    body, tree = Maker(rng, world).program()
    return body, tree, world


def robot_time_ms(answer: Any) -> int:
    """The sum of what the steps of robots take."""
    return sum(len(robots) * (end - start) for start, end, _, robots, *_ in answer["steps"])


def test_a_plan_has_the_least_makespan_and_then_the_least_robot_time() -> None:
    """Over random programs: both are those of the best of all executions; "unsolvable" where there is none."""
    statuses: Counter[str] = Counter()
    for seed in range(_CASES):
        body, tree, world = case(seed)
        best = least(tree, world)
        answer = plan(body, world, 200_000)
        statuses[answer["status"]] += 1
        if best is None:
            assert answer["status"] == "unsolvable_proven", f"seed {seed}"
        else:
            assert answer["status"] == "solved_optimally", f"seed {seed}"
            assert (answer["makespan"], robot_time_ms(answer)) == best, f"seed {seed}"
    assert len(statuses) == 2
    assert min(statuses.values()) > _CASES // 10, statuses


def test_with_a_small_budget_the_bound_is_below_and_the_plan_above_the_optimum() -> None:
    """Nothing is said to be optimal or unsolvable that is not."""
    statuses: Counter[str] = Counter()
    for seed in range(_CASES):
        body, tree, world = case(seed)
        best = least(tree, world)
        answer = plan(body, world, seed % 4)
        statuses[answer["status"]] += 1
        if best is None:
            assert answer["status"] in ("unsolvable_proven", "unsolvable_incompletely"), f"seed {seed}"
        elif answer["status"] == "solved_optimally":
            assert answer["makespan"] == answer["bound"] == best[0], f"seed {seed}"
        elif answer["status"] == "solved_satisficing":
            assert answer["bound"] <= best[0] <= answer["makespan"], f"seed {seed}"
        else:
            assert answer["status"] == "unsolvable_incompletely", f"seed {seed}"
    assert set(statuses) == {"unsolvable_proven", "solved_optimally", "solved_satisficing", "unsolvable_incompletely"}
