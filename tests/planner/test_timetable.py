from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.dispatch import dispatch
from planner.network import (
    Alternatives,
    AnyOrder,
    Claimed,
    Deadline,
    Held,
    Improvement,
    InSequence,
    Network,
    Node,
    Option,
    SideBySide,
    Solution,
    StartedStep,
    Step,
    Underway,
)
from planner.timetable import improve
from tests.planner.all_schedules import best_makespan, replayed_makespan
from tests.planner.coupled_networks import RandomNetwork, coupled, is_small, line_network


def run(network: Network, effort: float = 20.0, start: Solution | None = None) -> list[Improvement]:
    """All that is told, after it has been checked: makespans fall, bounds rise, all plans are executable."""
    told = list(improve(network, effort=effort, stop=lambda: False, start=start))
    last: Improvement | None = None
    for item in told:
        if item.solution is not None:
            assert item.bound_ms <= item.solution.makespan_ms
        if last is not None:
            assert item.bound_ms >= last.bound_ms
            assert item.effort >= last.effort
            if last.solution is not None:
                assert item.solution is not None
                assert item.solution.makespan_ms <= last.solution.makespan_ms
        last = item
    return told


def optimum(network: Network) -> int | None:
    """The proven least makespan; None: proven that there is none. Checked against brute force."""
    last = run(network)[-1]
    least = best_makespan(network)
    if last.unsolvable:
        assert least is None
        return None
    assert last.solution is not None
    assert last.bound_ms == last.solution.makespan_ms == least
    assert replayed_makespan(network, last.solution) == least
    return least


def step(id_: str, *robots: str, ms: int = 10, goal: str | None = None, claims: tuple[str, ...] = ()) -> Step:
    """A step that leaves its robots at its goal, if it has one."""
    return Step(id=id_, robots=robots, fixed_ms=ms, goal=goal, ends=(goal,) * len(robots), claims=claims)


def someone(choice: str, node: Node) -> Node:
    """r0 or r1 does it."""
    return Alternatives(id=choice, options=(Option(labels=("r0", "r1"), node=node),))


def test_a_robot_sets_off_only_when_it_is_its_turn() -> None:
    """Who fetches does not drive ahead while another one still searches: travel is part of the step."""
    network = line_network(InSequence(parts=(step("find", "r0", goal="p4"), step("fetch", "r1", goal="p4"))))
    assert optimum(network) == 40 + 10 + 50 + 10


def test_any_order_is_chosen_for_the_way() -> None:
    """Parts in any order do not overlap, and the robot takes the shorter way around; choices count down."""
    parts = tuple(step(f"s{i}", "r0", goal=place) for i, place in enumerate(["p5", "p1", "p3"]))
    network = line_network(AnyOrder(id="o", parts=parts))
    assert optimum(network) == 50 + 3 * 10
    last = run(network)[-1].solution
    assert last is not None
    assert last.choices == {"o/3": 2, "o/2": 3, "o/1": 1}


@pytest.mark.parametrize(("resource", "expected"), [("door", 30), ("hall", 20)])
def test_resources_have_a_capacity(resource: str, expected: int) -> None:
    """Of three computations that use a resource, one or two run at once."""
    assert optimum(line_network(*(step(f"s{i}", claims=(resource,)) for i in range(3)))) == expected


def test_a_part_may_claim_over_several_steps() -> None:
    """What is claimed by a part is not free between its steps, and its steps need not claim it again."""
    inner = InSequence(parts=(step("a", "r0", claims=("door",)), step("think", ms=50), step("b", "r0")))
    network = line_network(Claimed(id="k", claims=("door",), part=inner), step("c", "r1", claims=("door",)))
    assert optimum(network) == 80


def test_a_held_robot_waits_at_the_door() -> None:
    """Within held parts robots wait for a resource where they need it, and do not before."""

    def carry(job: str, robot: str, place: str) -> Node:
        parts = (step(f"{job}/go", robot, goal=place), step(f"{job}/pass", robot, ms=40, claims=("door",)))
        return Held(id=job, robot=robot, part=InSequence(parts=parts))

    network = line_network(carry("a", "r0", "p1"), carry("b", "r1", "p8"))
    assert optimum(network) == 20 + 40 + 40


def test_freed_before_the_next_is_taken() -> None:
    """Between two uses that follow each other, a robot waits without either resource."""
    parts = (step("a", "r0", claims=("door",)), step("b", "r0", claims=("gate",)))
    held = Held(id="h", robot="r0", part=InSequence(parts=parts))
    network = line_network(held, step("c", "r1", ms=25, claims=("gate",)), step("d", ms=10, claims=("door",)))
    assert optimum(network) == 35


def test_joint_steps_need_all_robots() -> None:
    """Two robots carry together once both are free; the way of the first one counts, and both are there after."""
    carry = step("carry", "r0", "r1", goal="p3")
    network = line_network(InSequence(parts=(carry, step("on", "r1", goal="p4"))), step("other", "r1", ms=35))
    assert optimum(network) == 35 + 40 + 20


@pytest.mark.parametrize(("ms", "expected"), [(80, 70), (60, 110), (59, None)])
def test_deadlines(ms: int, expected: int | None) -> None:
    """A deadline decides the order, or is proven impossible."""
    late = Deadline(ms=ms, part=step("a", "r0", goal="p5"))
    network = line_network(late, step("b", "r0", goal="p1"))
    told = run(network)
    if expected is None:
        assert told[-1].unsolvable
        assert told[-1].solution is None
    assert optimum(network) == expected


def test_team() -> None:
    """One robot does what two could do at once, if only one may take part."""
    parts = [someone(f"c{i}", step(f"s{i}", f"?c{i}")) for i in range(2)]
    assert optimum(line_network(*parts)) == 10
    assert optimum(replace(line_network(*parts), team=1)) == 20


def test_work() -> None:
    """A robot's energy is enough for one of two tasks with their ways, which need not be the first choice."""
    network = line_network(*(someone(f"c{i}", step(f"s{i}", f"?c{i}", goal="p0")) for i in range(2)))
    assert optimum(network) == 20
    robots = {**network.robots, "r0": replace(network.robots["r0"], work_ms=10)}
    assert optimum(replace(network, robots=robots)) == 100


def test_work_of_who_goes_along() -> None:
    """The way of the one that travels first is work for the other one too."""
    network = line_network(step("carry", "r0", "r1", goal="p5"))
    robots = {**network.robots, "r1": replace(network.robots["r1"], work_ms=59)}
    assert optimum(network) == 60
    assert optimum(replace(network, robots=robots)) is None


def test_what_is_under_way() -> None:
    """A step that has begun ends when it does, where it ends; what it holds is held until the part is done."""
    begun = Underway(id="u", robots=("r0",), left_ms=15, ends=("p4",), claims=("door",))
    held = Held(id="h", robot="r0", part=InSequence(parts=(begun, step("think", ms=30), step("a", "r0", goal="p5"))))
    network = line_network(held, step("b", "r0"), step("c", "r1", claims=("door",)))
    assert optimum(network) == 15 + 30 + 20 + 10


def test_claimed_parts_under_way() -> None:
    """A part that has begun has its resource until it is done, even before its next step starts."""
    begun = InSequence(parts=(Underway(id="u", robots=(), left_ms=0), step("a", "r0", goal="p2")))
    network = line_network(Claimed(id="k", claims=("door",), part=begun), step("b", claims=("door",)), step("c", "r0"))
    assert optimum(network) == 40


def test_no_way() -> None:
    """What cannot be reached is left to who can, or is proven impossible."""
    assert optimum(line_network(step("a", "r0", goal="nowhere"))) is None
    parts = (step("a", "r1"), someone("c", step("b", "?c", goal="nowhere")))
    other = Alternatives(id="x", options=(Option(labels=(1,), node=parts[1]), Option(labels=(2,), node=parts[0])))
    assert optimum(line_network(other)) == 10


def test_expected_times_are_rounded_half_to_even() -> None:
    """A way of 30 ms with odds 0.8 takes 37.5 -> 38 ms, one of 50 ms takes 62.5 -> 62 ms."""
    for goal, expected in (("p3", 38), ("p5", 62)):
        network = line_network(Step(id="s", robots=("r0",), fixed_ms=0, goal=goal, odds=0.8, ends=(goal,)))
        assert optimum(network) == expected


def test_nothing_to_do() -> None:
    """An empty network takes no time; so does one in which all is up to the program and empty."""
    assert optimum(line_network()) == 0
    empty = Alternatives(id=None, options=(Option(labels=(1,), node=InSequence(parts=())),))
    assert optimum(line_network(empty)) == 0


def test_a_place_that_steps_do_not_change() -> None:
    """After a way that leaves no trace, and steps without a way, travel counts from where the robot was before."""
    loop = Step(id="loop", robots=("r0",), fixed_ms=0, goal="p4", ends=(None,))
    network = line_network(InSequence(parts=(loop, step("rest", "r0"), step("go", "r0", goal="p1"))))
    assert optimum(network) == 40 + 10 + 10 + 10


def test_symbols_reach_into_parts() -> None:
    """Who is picked for several parts does all of them, with other things between."""
    body = InSequence(parts=(step("go", "?c", goal="p2"), SideBySide(parts=(step("x", "?c"), step("y", ms=30)))))
    network = line_network(someone("c", body), step("z", "r0", ms=60))
    assert optimum(network) == 100


@pytest.mark.parametrize("block", range(4))
def test_random_networks_agree_with_brute_force(block: int) -> None:
    """The optimum of small networks with every kind of node is that of trying all schedules."""
    solved = 0
    for seed in range(60 * block, 60 * (block + 1)):
        network = RandomNetwork(np.random.default_rng(seed), begun=seed % 3 == 0).network()
        if is_small(network):
            solved += optimum(network) is not None
    assert solved > 20


def test_the_same_each_time() -> None:
    """The same network, the same improvements, one by one, up to the same effort."""
    network = coupled(6, 10)
    first, second = run(network, effort=1.5), run(network, effort=1.5)
    assert first == second
    assert len(first) > 3
    assert {item.phase for item in first} >= {"list schedule", "timetable"}


def test_stop() -> None:
    """It ends soon after it is told to, with what it has."""
    asked = []

    def stop() -> bool:
        asked.append(True)
        return len(asked) > 3

    told = list(improve(coupled(10, 20), effort=1000.0, stop=stop))
    assert len(asked) < 20
    assert told[-1].solution is not None


def test_closing_ends_it() -> None:
    """Who has enough after the first plan closes the stream, and no thread goes on."""
    told = improve(coupled(10, 20), effort=1000.0, stop=lambda: False)
    assert next(told).solution is not None
    assert next(told).bound_ms > 0
    told.close()  # type: ignore[attr-defined]


def test_a_plan_from_elsewhere() -> None:
    """A start that is better is taken, and told at once; one that is no plan of the network is not."""
    network = coupled(4, 6)
    best = run(network)[-1].solution
    first = dispatch(network)
    assert best is not None
    assert first is not None
    assert best.makespan_ms < first.makespan_ms
    given = [item for item in run(network, start=best, effort=0.1) if item.phase == "given"]
    assert given[0].solution is not None
    assert given[0].solution.makespan_ms == best.makespan_ms
    strange = Solution(choices={}, steps=(StartedStep(id="x", robots=("r0",), start_ms=0, end_ms=1),), makespan_ms=1)
    assert not [item for item in run(network, start=strange, effort=0.1) if item.phase == "given"]


@pytest.mark.parametrize(("doors", "least_ms"), [(1, 86_400), (2, 96_000)])
@pytest.mark.slow
def test_a_small_coupled_fleet_is_proven(doors: int, least_ms: int) -> None:
    """Four robots find six drinks and fetch them through one or two doors."""
    last = run(coupled(4, 6, doors=doors))[-1]
    assert last.solution is not None
    assert last.bound_ms == last.solution.makespan_ms == least_ms


@pytest.mark.slow
def test_a_coupled_fleet_is_within_a_few_percent() -> None:
    """Ten robots and twenty drinks: the plan is proven to be at most 15 % above the optimum."""
    network = coupled(10, 20)
    for item in improve(network, effort=30.0, stop=lambda: False):
        assert item.solution is not None
        if item.bound_ms >= 0.85 * item.solution.makespan_ms:
            return
    pytest.fail("the gap stays above 15 %")
