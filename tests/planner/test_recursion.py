"""Processes that perform themselves: the planner finds the best of all their executions, and the checker follows it."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
import pytest

from kb.prolog import Entry
from kb.store import Snapshot
from kb.terms import Term, Var, struct
from planner.plan import PlanStatus
from tests.planner.conftest import Times, random_times
from tests.planner.yard import Job, Yard, call
from tests.planner.yard_programs import found

_ROBOTS = ("ann", "bob")
_PLACES = ("a", "b", "c")
_REVISION = -91
_NODES = 20_000

_load_facts = Entry(search_path="kb_rules", file="facts", name="load_facts")
_drop_facts = Entry(search_path="kb_rules", file="facts", name="drop_facts")
_open_session = Entry(search_path="planner_golog", file="steps", name="open_session")
_close_session = Entry(search_path="planner_golog", file="steps", name="close_session")
_needed_travels = Entry(search_path="planner_golog", file="planning", name="needed_travels")
_prospects = Entry(search_path="planner_golog", file="hypotheses", name="prospects")
_look_ahead = Entry(search_path="planner_golog", file="planning", name="look_ahead")
_cover_plan = Entry(search_path="planner_golog", file="planning", name="cover_plan")

_SEEN = struct("holds", "seen", Var("Place"), True)
_UNSEEN_LEFT = struct(
    "some", [struct("-", Var("_1_"), "Place")], struct("not", struct("holds", "seen", Var("_1_"), True))
)


_ROUND = call("round", "Round")


def rounds(base: Snapshot, ending: Term, main: Term = _ROUND) -> Yard:
    """See(robot, place), once each place; Round: see one place and then the rest, or the ending; Think."""
    made = Yard(base)
    for robot in _ROBOTS:
        made.add(robot, "Robot")
    for place in _PLACES:
        made.add(place, "Place")
    made.process(
        "See",
        "robot",
        "place",
        to="place",
        duration_s=0.5,
        needs=[struct("not", struct("holds", "seen", Var("place"), True))],
        effects=[("locatedAt", "robot", "place"), ("seen", "place", True)],
    )
    made.definitions.append(struct("proc", struct("See", Var("Robot"), Var("Place")), []))
    see = call("see", "See", Var("Robot"), Var("Place"))
    one = struct("pick", Var("Frame"), "which", Var("Place"), "Place",
                 struct("pick", Var("Frame"), "who", Var("Robot"), "Robot", see))  # fmt: skip
    made.process("Round", body=struct("choice", Var("Frame"), "more", [ending, [one, call("rest", "Round")]]))
    made.process("Think", duration_s=1.0)
    made.process("Main", body=[main])
    return made


def best_s(times: Times) -> float | None:
    """The least time in which robots see all places, one after the other, found by trying all ways."""
    found: list[float] = []
    for order in permutations(_PLACES):
        for robots in product(_ROBOTS, repeat=len(order)):
            at = dict.fromkeys(_ROBOTS, "here")
            ways: list[float | None] = []
            for robot, place in zip(robots, order, strict=True):
                ways.append(times.get((robot, at[robot], place)))
                at[robot] = place
            if None not in ways:
                found.append(sum(way + 0.5 for way in ways if way is not None))
    return round(min(found), 3) if found else None


@pytest.mark.parametrize("seed", range(12))
def test_until_nothing_is_left(tue_lab: Snapshot, seed: int) -> None:
    """A robot sees a place and then the rest, or it is done where all is seen: order and robots take least time."""
    times = random_times(np.random.default_rng(seed), _ROBOTS, _PLACES, 0.8)
    job = Job(yard=rounds(tue_lab, struct("test", struct("not", _UNSEEN_LEFT))), robots=2, times=times)
    plans = found(job, max_nodes=_NODES)
    best = best_s(times)
    if best is None:
        assert plans is None
        return
    assert plans is not None
    plan, again = plans
    assert plan.status is PlanStatus.SOLVED_OPTIMALLY
    assert plan.makespan_s == pytest.approx(best, abs=1e-6)
    assert job.violations(plan) == []
    assert again is not None
    assert job.violations(again) == []


def test_as_often_as_it_pays(tue_lab: Snapshot) -> None:
    """Where it may be done at any time, it is done at once."""
    plans = found(Job(yard=rounds(tue_lab, []), robots=2), max_nodes=_NODES)
    assert plans is not None
    assert plans[0].status is PlanStatus.SOLVED_OPTIMALLY
    assert plans[0].steps == ()


def test_a_call_may_take_less_than_its_turns(tue_lab: Snapshot) -> None:
    """It is not left out for something else that looks shorter."""
    think, again = call("think", "Think"), call("again", "Think")
    either = struct("choice", Var("Frame"), "best", [[think, again], [think, _ROUND]])
    plans = found(Job(yard=rounds(tue_lab, [], either), robots=2), max_nodes=_NODES)
    assert plans is not None
    assert plans[0].makespan_s == 1.0


def test_what_cannot_end_is_given_up(tue_lab: Snapshot) -> None:
    """Where no execution ends, all are tried, or as many as there may be: no plan, and no loop without end."""
    never = struct("test", struct("holds", "seen", "a", "never"))
    assert found(Job(yard=rounds(tue_lab, never), robots=2), max_nodes=_NODES) is None


def test_what_is_asked_of_a_program_without_executing_it(tue_lab: Snapshot) -> None:
    """Its travels, its choices, and that no network has all its turns."""
    job = Job(yard=rounds(tue_lab, []), robots=2)
    _load_facts(job.yard.facts(_REVISION))
    try:
        _open_session(struct("request", "task", _REVISION, "Main", 2, 0))
        travels = _needed_travels("task")
        assert (travels["robots"], travels["places"]) == (list(_ROBOTS), list(_PLACES))
        _look_ahead(struct("ahead", "task", 0, struct("tables", [], [], [])))
        assert _cover_plan(struct("cover", "task", 1_000_000))["status"] == "no_network"
        choices = _prospects(struct("prospects", "task", "all"))["choices"]
        assert [labels for _, _, labels, _ in choices] == [[1, 2], list(_PLACES), list(_ROBOTS)]
    finally:
        _close_session("task")
        _drop_facts(_REVISION)
