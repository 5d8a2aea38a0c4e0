"""Which networks fall apart into jobs, and into which."""

from __future__ import annotations

import numpy as np
import pytest

from planner.jobs import NEVER, SAME_ROW, separate
from planner.network import (
    NO_WAY,
    Alternatives,
    AnyOrder,
    Claimed,
    Deadline,
    Held,
    InSequence,
    Network,
    Node,
    Option,
    SideBySide,
    Step,
    Underway,
)
from tests.planner.fleet_networks import LOOK_MS, find, network

PLACES = ("a", "b", "c")
TABLE = np.array([[0, 10, NO_WAY], [10, 0, 7], [20, 7, 0]])


def asked(*parts: Node, work_ms: dict[str, int] | None = None) -> Network:
    """Parts side by side for three robots; r1 and r2 are alike."""
    here = np.array([5, 6, 8])
    robots = {"r1": (0, here), "r2": (0, here), "r3": (0, here + 1)}
    return network(parts, PLACES, [TABLE], robots, work_ms=work_ms)


def step(name: str, *robots: str, ms: int = 3, goal: str | None = None, end: str | None = None) -> Step:
    """A step that ends at a place, if one is given."""
    return Step(id=name, robots=robots, fixed_ms=ms, goal=goal, ends=(end, *[None] * (len(robots) - 1)) if end else ())


def held(robot: str, *parts: Node) -> Held:
    """Parts one after the other, which the robot does not leave."""
    return Held(id="held", robot=robot, part=InSequence(parts=parts))


def test_a_choice_of_robot_is_a_leg_for_each_robot() -> None:
    """Robots that are alike are one crew, which shares its legs."""
    jobs = separate(asked(find("x", ["r1", "r2", "r3"], "a"), find("y", ["r1", "r2"], "c")))
    assert jobs is not None
    assert [crew.robots for crew in jobs.crews] == [("r1", "r2"), ("r3",)]
    alike, other = jobs.crews
    assert alike.job.tolist() == [0, 1]
    assert alike.first_ms.tolist() == [5 + LOOK_MS, 8 + LOOK_MS]
    assert alike.ms.tolist() == [[LOOK_MS, NEVER], [10 + LOOK_MS, 7 + LOOK_MS], [20 + LOOK_MS, LOOK_MS]]
    assert alike.end.tolist() == [0, 2]
    assert other.first_ms.tolist() == [6 + LOOK_MS]


def test_only_the_first_travel_of_a_held_part_is_open() -> None:
    """What follows it is fixed: inner travels with their odds, computations, and where the robot ends."""
    way = held(
        "r1",
        step("think", ms=100),
        Step(id="go", robots=("r1",), fixed_ms=1, goal="a", odds=0.8, ends=("a",)),
        Step(id="carry", robots=("r1",), fixed_ms=2, goal="b", odds=0.4, ends=("b",)),
    )
    jobs = separate(asked(way))
    assert jobs is not None
    (crew,) = jobs.crews
    (leg,) = crew.legs
    assert (leg.goal, leg.odds, leg.ms, leg.computing_ms, leg.end) == (0, 0.8, 100 + 1 + 2 + 25, 100, 1)
    assert crew.first_ms.tolist() == [128 + round(5 / 0.8)]
    assert [(s.id, s.ms, s.robot, s.travels) for s in leg.steps] == [
        ("think", 100, False, False),
        ("go", 1, True, True),
        ("carry", 27, True, False),
    ]


def test_a_leg_with_an_inner_travel_that_is_no_way_is_left_out() -> None:
    """From a there is no way to c, so that the job is for nobody."""
    way = held("r1", step("go", "r1", goal="a", end="a"), step("on", "r1", goal="c", end="c"))
    jobs = separate(asked(way))
    assert jobs is not None
    assert (jobs.count, jobs.crews) == (1, ())


def test_of_ways_that_differ_in_time_alone_the_shortest_stays() -> None:
    """With its choices; a way that ends elsewhere stays too."""
    how = Alternatives(
        id="how",
        options=(
            Option(labels=(1,), node=step("slow", "r1", ms=9)),
            Option(labels=(2,), node=step("fast", "r1", ms=4)),
            Option(labels=(3,), node=step("away", "r1", ms=50, end="b")),
        ),
    )
    jobs = separate(asked(held("r1", step("go", "r1", goal="a", end="a"), how)))
    assert jobs is not None
    assert [(leg.choices, leg.end) for leg in jobs.crews[0].legs] == [((("how", 2),), 0), ((("how", 3),), 1)]


def test_a_step_without_goal_leaves_the_robot_where_it_was() -> None:
    """So that its duration is the same from everywhere."""
    jobs = separate(asked(step("look", "r1")))
    assert jobs is not None
    assert jobs.crews[0].end.tolist() == [SAME_ROW]
    assert jobs.crews[0].ms.tolist() == [[3], [3], [3]]


def test_computations_alone_begin_at_once_and_bound_the_makespan() -> None:
    """They take no robot."""
    jobs = separate(asked(InSequence(parts=(step("think", ms=40), step("more", ms=2))), find("x", ["r1"], "a")))
    assert jobs is not None
    assert (jobs.least_ms, jobs.count) == (42, 1)
    assert [(s.id, s.start_ms, s.end_ms) for s in jobs.steps] == [("think", 0, 40), ("more", 40, 42)]


def test_choices_with_one_option_around_all_jobs_are_gone_into() -> None:
    """The recipe that is left of a task is no choice any more."""
    inner = SideBySide(parts=(find("x", ["r1"], "a"), InSequence(parts=(find("y", ["r2"], "b"), SideBySide(parts=())))))
    jobs = separate(asked(Alternatives(id="recipe", options=(Option(labels=(3,), node=inner),))))
    assert jobs is not None
    assert (jobs.count, dict(jobs.choices)) == (2, {"recipe": 3})


def test_what_is_under_way_is_the_beginning_of_a_run() -> None:
    """On its own, or as the beginning of a job that the robot then brings to its end."""
    alone = Underway(id="drive", robots=("r1",), left_ms=50, ends=("b",))
    drive = Underway(id="go", robots=("r2",), left_ms=30, ends=("a",))
    jobs = separate(asked(alone, held("r2", drive, step("look", "r2", ms=9), step("back", "r2", goal="b", end="b"))))
    assert jobs is not None
    assert jobs.count == 0
    assert jobs.least_ms == 52
    first, second = jobs.crews
    assert (first.start.ms, first.start.place, first.start.begun) == (50, 1, True)
    assert (second.start.ms, second.start.work_ms, second.start.place, second.start.leg_ms) == (52, 22, 1, 30)


@pytest.mark.parametrize(
    "part",
    [
        step("lift", "r1", "r2"),
        Step(id="pass", robots=("r1",), fixed_ms=1, claims=("door",)),
        Claimed(id="room", claims=("room",), part=step("look", "r1")),
        Deadline(ms=100, part=step("look", "r1")),
        AnyOrder(id="any", parts=(step("look", "r1"), step("see", "r1"))),
        InSequence(parts=(step("look", "r1"), step("fetch", "r2"))),
        InSequence(parts=(step("think"), step("look", "r1"))),
        InSequence(parts=(step("go", "r1", goal="a", end="a"), step("on", "r1", goal="b", end="b"))),
        held("r1", step("look", "r2")),
        held("r1", step("go", "r1", goal="a"), step("on", "r1", goal="b")),
        Alternatives(
            id="x", options=(Option(labels=(1,), node=step("look", "r1")), Option(labels=(2,), node=step("t")))
        ),
        InSequence(parts=(SideBySide(parts=(step("look", "r1"), step("see", "r2"))), step("look", "r1"))),
        SideBySide(parts=(Underway(id="u", robots=("r1",), left_ms=1), Underway(id="v", robots=("r1",), left_ms=1))),
    ],
)
def test_networks_that_tie_robots_do_not_fall_apart(part: Node) -> None:
    """Joint steps, claims, deadlines, orders, sequences over robots, pauses and ways that depend on what was before."""
    assert separate(asked(find("x", ["r1"], "a"), part)) is None


def test_a_limited_robot_with_ways_of_unlike_work_is_not_taken_apart() -> None:
    """The shortest run would not be the one of least work."""
    how = Alternatives(
        id="how",
        options=(
            Option(labels=(1,), node=step("look", "r1", ms=9)),
            Option(labels=(2,), node=step("think", ms=12)),
        ),
    )
    part = held("r1", step("go", "r1", goal="a", end="a"), how)
    assert separate(asked(part)) is not None
    assert separate(asked(part, work_ms={"r1": 1000})) is None
