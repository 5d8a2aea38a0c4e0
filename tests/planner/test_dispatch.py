from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from planner.dispatch import dispatch, sample
from planner.network import (
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
from planner.timetable_tasks import grow
from tests.planner.all_schedules import best_makespan, replayed_makespan
from tests.planner.coupled_networks import RandomNetwork, coupled, is_small, line_network


def makespan(network: Network) -> int | None:
    """Of what is dispatched, after it has been checked."""
    solution = dispatch(network)
    if solution is None:
        return None
    replayed = replayed_makespan(network, solution)
    assert replayed is not None
    assert replayed <= solution.makespan_ms
    return solution.makespan_ms


def step(id_: str, *robots: str, ms: int = 10, goal: str | None = None, claims: tuple[str, ...] = ()) -> Step:
    """A step that leaves its robots at its goal, if it has one."""
    return Step(id=id_, robots=robots, fixed_ms=ms, goal=goal, ends=(goal,) * len(robots), claims=claims)


def someone(choice: str, node: Node) -> Node:
    """r0 or r1 does it."""
    return Alternatives(id=choice, options=(Option(labels=("r0", "r1"), node=node),))


def test_each_task_goes_to_who_is_done_first() -> None:
    """Two robots share two tasks, each the one next to it."""
    parts = [someone(f"c{i}", step(f"s{i}", f"?c{i}", goal=place)) for i, place in enumerate(["p1", "p9"])]
    network = line_network(*parts)
    solution = dispatch(network)
    assert solution is not None
    assert solution.choices == {"c0": "r0", "c1": "r1"}
    assert makespan(network) == 20


@pytest.mark.parametrize(
    ("node", "expected"),
    [
        (InSequence(parts=(step("a", "r0"), step("b", "r1"))), 20),
        (SideBySide(parts=(step("a", "r0"), step("b", "r1"))), 10),
        (SideBySide(parts=(step("a", "r0"), step("b", "r0"))), 20),
        (AnyOrder(id="o", parts=(step("a", "r0"), step("b", "r1"))), 20),
        (SideBySide(parts=(step("a", "r0", claims=("door",)), step("b", "r1", claims=("door",)))), 20),
        (SideBySide(parts=(step("a", "r0", claims=("hall",)), step("b", "r1", claims=("hall",)))), 10),
        (step("a", "r1", "r0", goal="p7"), 30),
        (
            SideBySide(
                parts=(
                    Claimed(id="k", claims=("door",), part=InSequence(parts=(step("a", "r0"), step("b", "r0")))),
                    step("c", "r1", claims=("door",)),
                )
            ),
            30,
        ),
        (Deadline(ms=10, part=step("a", "r0")), 10),
        (Deadline(ms=9, part=step("a", "r0")), None),
        (step("a", "r0", goal="nowhere"), None),
        (InSequence(parts=()), 0),
        (InSequence(parts=(Underway(id="u", robots=("r0",), left_ms=7, ends=("p5",)), step("a", "r0", goal="p5"))), 17),
    ],
)
def test_each_kind_of_node(node: Node, expected: int | None) -> None:
    """The makespan is what the meaning of the node says."""
    assert makespan(line_network(node)) == expected


def test_a_held_robot_does_nothing_else_between() -> None:
    """A held part is done as a whole, although its robot could do something else while it computes."""
    held = Held(id="h", robot="r0", part=InSequence(parts=(step("a", "r0"), step("think"), step("b", "r0"))))
    assert makespan(line_network(held, step("c", "r0"))) == 40


def test_a_robot_that_is_held_already_ends_that_first() -> None:
    """What a robot has begun holds it until it is done, whatever else waits for it."""
    begun = Underway(id="u", robots=("r0",), left_ms=5)
    held = Held(id="h", robot="r0", part=InSequence(parts=(begun, step("a", "r1", ms=30))))
    assert makespan(line_network(held, step("b", "r0"))) == 45


def test_no_more_robots_than_may_take_part() -> None:
    """With a team of one, one robot does both tasks."""
    parts = [someone(f"c{i}", step(f"s{i}", f"?c{i}")) for i in range(2)]
    assert makespan(line_network(*parts)) == 10
    assert makespan(replace(line_network(*parts), team=1)) == 20


def test_no_robot_works_longer_than_it_can() -> None:
    """The nearer robot has no energy left for the way and the task."""
    network = line_network(someone("c", step("s", "?c", goal="p1")))
    robots = {**network.robots, "r0": replace(network.robots["r0"], work_ms=19)}
    assert makespan(network) == 20
    assert makespan(replace(network, robots=robots)) == 90


def test_random_networks() -> None:
    """Whatever is dispatched is a schedule, of no less than the least makespan, which is often met."""
    best = found = 0
    for seed in range(200):
        network = RandomNetwork(np.random.default_rng(seed), begun=seed % 3 == 0).network()
        if not is_small(network):
            continue
        least, ours = best_makespan(network), makespan(network)
        assert ours is None or (least is not None and ours >= least)
        found += ours is not None
        best += ours is not None and ours == least
    assert best >= 0.7 * found > 0


def test_the_same_each_time() -> None:
    """The same network, the same plan, with the steps in order of time."""
    first, second = dispatch(coupled(6, 10, doors=2)), dispatch(coupled(6, 10, doors=2))
    assert first is not None
    assert first == second
    assert [s.start_ms for s in first.steps] == sorted(s.start_ms for s in first.steps)


def test_coupled_fleet() -> None:
    """A fleet with two doors has a plan, which is executable."""
    solution = dispatch(coupled(10, 20, doors=2))
    assert solution is not None
    assert len(solution.steps) == 20 * 10
    assert solution.makespan_ms < 200_000


def test_sampled_schedules_are_plans_that_come_again_and_may_be_better() -> None:
    """With the same seed the same ones; each is executed, and some beat the rules where robots wait for each other."""
    better = 0
    for seed in range(1, 5):
        network = coupled(3, 4, seed)
        root = grow(network)
        first, again = (list(islice(sample(network, root, np.random.default_rng(5)), 4)) for _ in range(2))
        assert first == again
        found = [s for s in first if s is not None]
        for solution in found:
            replayed = replayed_makespan(network, solution)
            assert replayed is not None
            assert replayed <= solution.makespan_ms
        by_rule = dispatch(network, root)
        if found and by_rule is not None:
            better += min(s.makespan_ms for s in found) < by_rule.makespan_ms
    assert better
