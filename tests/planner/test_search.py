"""The exact search against trying every execution."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from kb.prolog import Entry
from kb.store import Snapshot
from kb.terms import struct
from tests.planner.brute_force import World, least, random_case, travel_tables
from tests.planner.yard import Job

_CASES = 150
_REVISION = -1

_load_facts = Entry(search_path="kb_rules", file="facts", name="load_facts")
_drop_facts = Entry(search_path="kb_rules", file="facts", name="drop_facts")
_open_session = Entry(search_path="planner_golog", file="steps", name="open_session")
_close_session = Entry(search_path="planner_golog", file="steps", name="close_session")
_look_ahead = Entry(search_path="planner_golog", file="planning", name="look_ahead")
_search_plan = Entry(search_path="planner_golog", file="planning", name="search_plan")


@contextmanager
def looked_ahead(job: Job, world: World) -> Iterator[str]:
    """The name of a session that may be planned."""
    _load_facts(job.yard.facts(_REVISION))
    try:
        _open_session(struct("request", "task", _REVISION, "Main", world.limit, 0))
        _look_ahead(struct("ahead", "task", 0, travel_tables(world)))
        yield "task"
    finally:
        _close_session("task")
        _drop_facts(_REVISION)


def search(session: str, max_nodes: int) -> Any:
    """What the exact search answers."""
    return _search_plan(struct("search", session, max_nodes, -1))


def robot_time_ms(answer: Any) -> int:
    """The sum of what the steps of robots take."""
    return sum(len(robots) * (end - start) for start, end, _, robots, *_ in answer["steps"])


def test_a_plan_has_the_least_makespan_and_then_the_least_robot_time(tue_lab: Snapshot) -> None:
    """Over random programs: both are those of the best of all executions; "unsolvable" where there is none."""
    statuses: Counter[str] = Counter()
    for seed in range(_CASES):
        world, body, tree = random_case(seed)
        best = least(tree, world)
        with looked_ahead(world.job(tue_lab, body), world) as session:
            answer = search(session, 200_000)
        statuses[answer["status"]] += 1
        if best is None:
            assert answer["status"] == "unsolvable_proven", f"seed {seed}"
        else:
            assert answer["status"] == "solved_optimally", f"seed {seed}"
            assert (answer["makespan"], robot_time_ms(answer)) == best, f"seed {seed}"
    assert len(statuses) == 2
    assert min(statuses.values()) > _CASES // 10, statuses


def test_with_a_small_budget_the_bound_is_below_and_the_plan_above_the_optimum(tue_lab: Snapshot) -> None:
    """Nothing is said to be optimal or unsolvable that is not."""
    statuses: Counter[str] = Counter()
    for seed in range(_CASES):
        world, body, tree = random_case(seed)
        best = least(tree, world)
        with looked_ahead(world.job(tue_lab, body), world) as session:
            answer = search(session, seed % 4)
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
