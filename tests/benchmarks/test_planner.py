"""The benchmark of the planner measures what it says: its instances, its worth of plans, its peers."""

from __future__ import annotations

import dataclasses
from importlib.util import find_spec
from pathlib import Path

import pytest

from kb.store import KnowledgeBase
from tests.benchmarks.fleet_ontology import FETCH_TASK, FIND_TASK, SITE, write_ontologies
from tests.benchmarks.fleets import (
    COLLECT,
    FETCHING,
    FIND,
    LEAVE,
    OPTIMA_MS,
    RETURN,
    SERVE,
    IllegalPlan,
    draw,
    makespan_ms,
    place_names,
    travel_times,
)
from tests.benchmarks.harness import main
from tests.benchmarks.peers.processes import acts
from tests.benchmarks.peers.race import Entrant, Run, run
from tests.benchmarks.planner import ALL, ENTRANTS, OURS, Entry, measure, selected
from tests.benchmarks.planner import _better_peers as better_peers
from tests.benchmarks.planner import _wrong as wrong

PAIR = draw(2, 2)
COUPLED_PAIR = draw(2, 2, coupled=True)
COUPLED_PAIR_MS = 71_800
"""Its least makespan, proven by CP-SAT, by up-aries and by plain Golog."""


def test_instances_are_those_of_the_published_figures() -> None:
    """Places, speeds, sensors and needs of a size and seed never change, or no figure could be compared."""
    instance = draw(3, 4)
    assert instance.xy_dm[:7] == ((5, 96), (4, 49), (86, 77), (106, 11), (81, 8), (97, 14), (58, 76))
    assert instance.speed_mps == (1, 1, 1)
    assert instance.has_kinect == (True, False, True)
    assert instance.needs_kinect == (False, True, False, True)
    assert sum(instance.has_arm) == 2


def test_travel_takes_its_time_by_speed_and_never_goes_through_the_wall() -> None:
    """Tables hold the times of each speed, from places and docks; through the wall there is no way."""
    names = place_names(COUPLED_PAIR)
    travel = travel_times(COUPLED_PAIR)(["robot_01", "robot_02"], names[2:])
    spot, inside, outside, table = (names[2:].index(n) for n in ("spot_001", *names[-3:]))
    for robot, name in enumerate(["robot_01", "robot_02"]):
        times = travel.between[travel.profile[name]]
        assert times[spot, inside] == COUPLED_PAIR.travel_ms(robot, 2, 4)
        assert times[outside, table] == 100 * -(-40 // COUPLED_PAIR.speed_mps[robot])
        assert times[inside, outside] == -1
        assert travel.here[name][spot] == COUPLED_PAIR.travel_ms(robot, robot, 2)


def test_a_plan_is_worth_the_end_of_its_last_act() -> None:
    """Each robot drives and detects, one drink after the other."""
    both = [(FIND, 0, 0), (FIND, 0, 1)]
    takes_ms = PAIR.travel_ms(0, 0, 2) + 1000 + PAIR.travel_ms(0, 2, 3) + 1000
    assert makespan_ms(PAIR, both) == takes_ms
    apart = makespan_ms(PAIR, [(FIND, 0, 0), (FIND, 1, 1)])
    assert apart == max(PAIR.travel_ms(0, 0, 2), PAIR.travel_ms(1, 1, 3)) + 1000


@pytest.mark.parametrize(
    "plan",
    [
        [(FIND, 0, 0)],
        [(FIND, 0, 0), (FIND, 1, 1), (FIND, 1, 0)],
        [],
    ],
)
def test_a_plan_that_does_not_find_each_drink_once_is_none(plan: list[tuple[str, int, int]]) -> None:
    """Neither too little nor too much."""
    with pytest.raises(IllegalPlan):
        makespan_ms(PAIR, plan)


def test_a_robot_without_a_kinect_finds_no_drink_that_needs_one() -> None:
    """Who can do what counts."""
    instance = draw(3, 4)
    assert not instance.has_kinect[1]
    with pytest.raises(IllegalPlan, match="find 1 by 1"):
        makespan_ms(instance, [(FIND, 1, 1)])


def test_a_robot_waits_at_the_door() -> None:
    """Two robots that both have an arm and come at the same time pass one after the other."""
    twins = dataclasses.replace(
        COUPLED_PAIR, xy_dm=((0, 0), (0, 0), (9, 9), (9, 9), (9, 0), (9, -10), (9, -20)), has_arm=(True, True)
    )
    twins = dataclasses.replace(twins, speed_mps=(1, 1))
    side_by_side = [(what, robot, robot) for what in (FIND, *FETCHING) for robot in (0, 1)]
    alone_ms = 1800 + 1000 + 2000 + 900 + 2000 + 1000 + 2000 + 1000 + 2000
    assert makespan_ms(twins, side_by_side) == alone_ms + 2000


@pytest.mark.parametrize(
    "fetching",
    [
        [(COLLECT, 1, 0), (FIND, 1, 0), (LEAVE, 1, 0), (SERVE, 1, 0), (RETURN, 1, 0)],
        [(FIND, 1, 0), (COLLECT, 1, 0), (SERVE, 1, 0), (LEAVE, 1, 0), (RETURN, 1, 0)],
        [(FIND, 1, 0), (COLLECT, 1, 0), (FIND, 1, 1), (LEAVE, 1, 0), (SERVE, 1, 0), (RETURN, 1, 0)],
        [(FIND, 1, 0), (COLLECT, 0, 0), (LEAVE, 0, 0), (SERVE, 0, 0), (RETURN, 0, 0)],
    ],
)
def test_fetching_has_its_order_and_its_robot(fetching: list[tuple[str, int, int]]) -> None:
    """Not before the drink is found, in order, with nothing between, by a robot with an arm."""
    assert COUPLED_PAIR.has_arm == (False, True)
    with pytest.raises(IllegalPlan):
        makespan_ms(COUPLED_PAIR, fetching)


def test_steps_of_the_ontology_are_read_as_acts() -> None:
    """The second time that a robot passes the door, it returns."""
    steps = [
        (9.0, "PassDoor", "robot_02", "hall_door"),
        (0.0, "Navigate", "robot_02", "drink_001"),
        (1.0, "DetectByColor", "robot_02", "drink_001"),
        (3.0, "Grasp", "robot_02", "drink_001"),
        (5.0, "PassDoor", "robot_02", "hall_door"),
        (7.0, "PutDown", "robot_02", "drink_001"),
    ]
    assert acts(steps) == [(what, 1, 0) for what in (FIND, *FETCHING)]


@pytest.mark.parametrize(("coupled", "task"), [(False, FIND_TASK), (True, FETCH_TASK)])
def test_fleets_load_as_ontologies(coupled: bool, task: str, tmp_path: Path) -> None:
    """All that the product checks of an ontology holds, robots are classified, and the task compiles."""
    instance = draw(3, 4, coupled=coupled)
    write_ontologies(instance, tmp_path / "ontologies")
    knowledge = KnowledgeBase(SITE, tmp_path / "ontologies")
    snapshot = knowledge.snapshot()
    knowledge.close()
    assert len(snapshot.ontology.individuals("Drink")) == instance.drinks
    kinects = [snapshot.ontology.is_a(f"robot_0{n}", "RobotWithKinect") for n in (1, 2, 3)]
    arms = [snapshot.ontology.is_a(f"robot_0{n}", "RobotWithArm") for n in (1, 2, 3)]
    assert (tuple(kinects), tuple(arms)) == (instance.has_kinect, instance.has_arm)
    assert snapshot.program(task).text.startswith(f"proc('{task}'(Room),foreach(")


@pytest.mark.parametrize("name", ["golog", "circuit", "gtpyhop", "concertmaster"])
def test_who_proves_the_optimum_has_it(name: str) -> None:
    """Planners that share nothing agree on the smallest instance."""
    result = run(ENTRANTS[name], PAIR, limit_s=20.0)
    assert result.faults == ()
    assert result.proven_s is not None
    assert result.makespan_ms == OPTIMA_MS[2, 2]


# Its license is for education: whoever wants it installs it.
needs_tamer = pytest.mark.skipif(find_spec("up_tamer") is None, reason="up-tamer is not installed")


@pytest.mark.parametrize(
    ("name", "limit_s"),
    [("aries_flat", 2.0), ("aries_hierarchical", 10.0), pytest.param("tamer", 10.0, marks=needs_tamer)],
)
def test_planners_from_elsewhere_have_legal_plans(name: str, limit_s: float) -> None:
    """Whatever they say of them: up-tamer and flat up-aries prove nothing."""
    result = run(ENTRANTS[name], PAIR, limit_s=limit_s)
    assert result.faults == ()
    assert result.makespan_ms is not None
    assert result.makespan_ms >= OPTIMA_MS[2, 2]


def test_a_planner_is_killed_when_its_time_is_over() -> None:
    """What it has told until then counts."""
    result = run(ENTRANTS["gtpyhop"], draw(10, 20), limit_s=0.5)
    assert result.end == "killed at 0.5 s"
    assert result.makespan_ms is not None
    assert (result.proven_s, result.gap) == (None, 1.0)


def test_a_planner_that_breaks_is_told_so() -> None:
    """How a run ended is in its row."""
    result = run(Entrant(name="none", module="no_such_planner"), PAIR, limit_s=1.0)
    assert "No module named" in result.end
    assert result.plans == ()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["aries_hierarchical", "golog", "circuit", "concertmaster"])
def test_who_proves_the_coupled_optimum_has_it(name: str) -> None:
    """Planners that share nothing agree on the smallest coupled instance."""
    result = run(ENTRANTS[name], COUPLED_PAIR, limit_s=30.0)
    assert result.faults == ()
    assert result.proven_s is not None
    assert result.makespan_ms == COUPLED_PAIR_MS


@pytest.mark.slow
def test_the_quick_benchmark_holds_its_bars() -> None:
    """As far as they do not depend on the machine."""
    assert main("planner", lambda quick: measure(ALL, quick), ["--quick", "--check"]) == 0


def told(
    planner: str, plans: list[tuple[float, int]], bound_ms: float, faults: tuple[str, ...] = (), end: str = "done"
) -> Entry:
    """A run on the smallest instance, as if it had gone like that."""
    bounds = ((0.0, bound_ms),)
    what = Run(plans=tuple(plans), bounds=bounds, proven_s=None, loading_s=0.0, cpu_s=0.0, end=end, faults=faults)
    return Entry(variant="separable", size=(2, 2), seed=1, planner=planner, run=what)


def test_a_peer_that_is_better_for_a_while_is_named() -> None:
    """After 1 s it was, after 10 s no more."""
    ours = told(OURS.name, [(0.5, 9_000), (5.0, 5_700)], 0.0)
    theirs = told("circuit", [(0.9, 8_900)], 0.0)
    assert better_peers([ours, theirs]) == [
        "better: separable (2, 2) after 1 s: circuit 8900 ms, ours 9000 ms",
    ]


def test_a_bound_above_a_plan_is_wrong_whoever_made_the_plan() -> None:
    """The known optimum counts as a plan."""
    assert wrong([told("circuit", [(0.1, 8_000)], 5_700)]) == []
    assert len(wrong([told("circuit", [(0.1, 8_000)], 5_800)])) == 1
    assert len(wrong([told("circuit", [(0.1, 8_000)], 0, faults=("illegal plan",))])) == 1


def test_ours_must_not_break_down() -> None:
    """That it ended with an error is counted, where a peer's is only told."""
    assert len(wrong([told(OURS.name, [], 0.0, end="failed: InvalidPlan")])) == 1
    assert wrong([told("tamer", [], 0.0, end="failed: out of memory")]) == []


def test_the_command_line_selects_and_leaves_the_rest_to_the_harness() -> None:
    """Sizes, variants and planners."""
    assert selected(["--quick"]) == (ALL, ["--quick"])
    chosen, rest = selected(["--check", "--coupled", "--sizes", "2,2", "4,6", "--json"])
    assert (chosen.variants, chosen.sizes, rest) == (("coupled",), ((2, 2), (4, 6)), ["--check", "--json"])
    assert selected(["--prolog-alone"])[0].planners == ("prolog_alone",)
