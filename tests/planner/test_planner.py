"""Sessions on the shipped knowledge: the plan, and then outcome in, startable actions out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise, permutations, product

import numpy as np
import pytest

from kb.prolog import Entry, PrologError
from kb.store import Snapshot
from kb.terms import Action, Var, struct
from planner.plan import Plan, PlanStatus
from planner.planner import Session
from planner.progress import Begun, Ended, Progress, Started, Told
from tests.planner.conftest import Times, random_times, travel_of

ROBOTS = ("amigo_1", "pico_1")
PLACES = ("at_coffee_table", "at_dining_table")
LAB_PLACES = (*PLACES, "at_bar", "at_cabinet", "at_side_table")
# Each robot is near one of the drinks.
TIMES: Times = {
    ("amigo_1", "here", "at_coffee_table"): 4.0,
    ("amigo_1", "here", "at_dining_table"): 9.0,
    ("pico_1", "here", "at_coffee_table"): 11.0,
    ("pico_1", "here", "at_dining_table"): 6.0,
    **{(r, p, q): 0.0 if p == q else 12.0 for r in ROBOTS for p in PLACES for q in PLACES},
}
NAVIGATE_S, SEARCH_S = 1.5, 0.149
"""What the ontology gives Navigate besides the travel, and the steps of SearchDrink after it."""


@pytest.fixture
def session(tue_lab: Snapshot) -> Iterator[Session]:
    """FindEmptyDrink with both robots."""
    with_both = Session("task", tue_lab, "FindEmptyDrink", {"room": "tue_lab"}, robots=2)
    yield with_both
    with_both.close()


class Driver:
    """Reports outcomes in the order in which actions started, each 10 ms after the one before."""

    def __init__(self, session: Session, loops: int = 3) -> None:
        self.session = session
        self.loops = loops
        self.now_s = 0.0
        self.done = False
        self.running: list[Action] = []
        self.started: list[Action] = []
        self.events: list[object] = []
        self._turns: dict[str, int] = {}

    def take(self, progress: Progress) -> None:
        """Note what has started."""
        new = [event.action for event in progress.events if isinstance(event, Started)]
        self.events += progress.events
        self.running += new
        self.started += new
        self.done = progress.done
        assert progress.running == len(self.running)

    def next_actions(self) -> None:
        """Start what may start."""
        self.take(self.session.next_actions(now_s=self.now_s))

    def succeed(self, truths: Mapping[str, bool] | None = None) -> Action:
        """Report success of the action that started first; VelCmd arrives in its last loop."""
        action = self.running.pop(0)
        self.now_s += 0.01
        if action.process == "VelCmd" and truths is None:
            self._turns[action.id] = self._turns.get(action.id, 0) + 1
            truths = {"arrived": self._turns[action.id] >= self.loops, "blocked": False}
        self.take(self.session.succeeded(action, truths or {}, now_s=self.now_s))
        return action

    def fail(self) -> str | None:
        """Report failure of the action that started first."""
        self.now_s += 0.01
        return self.session.failed(self.running.pop(0), now_s=self.now_s).excluded

    def run_until(self, wanted: Callable[[Action], bool]) -> Action:
        """Go on until such an action is the next to report on."""
        while not wanted(self.running[0]):
            self.succeed()
        return self.running[0]

    def run(self) -> None:
        """Go on to the end."""
        while self.running:
            self.succeed()


def searched(plan: Plan) -> list[tuple[str | None, object]]:
    """Who looks for which drink, in order."""
    return [(s.action.robot, s.action.argument("drink")) for s in plan.steps if s.action.process == "Detection"]


# ------------------------------------------------------------------------------------------------ plans


def test_each_robot_takes_the_drink_that_it_is_near(session: Session) -> None:
    """The makespan is that of the slower one."""
    plan = session.plan(travel_of(TIMES), now_s=2.0)
    assert plan.status is PlanStatus.SOLVED_OPTIMALLY
    assert plan.made_at_s == 2.0
    assert plan.makespan_s == plan.lower_bound_s == pytest.approx(6.0 + NAVIGATE_S + SEARCH_S)
    assert sorted(searched(plan)) == [("amigo_1", "drink_1"), ("pico_1", "drink_2")]


def test_a_plan_says_the_same_every_time(tue_lab: Snapshot, session: Session) -> None:
    """Same request, same plan."""
    other = Session("task2", tue_lab, "FindEmptyDrink", {"room": "tue_lab"}, robots=2)
    one, two = session.plan(travel_of(TIMES), now_s=0.0), other.plan(travel_of(TIMES), now_s=0.0)
    assert [(s.start_s, s.end_s, str(s.action)) for s in one.steps] == [
        (s.start_s, s.end_s, str(s.action)) for s in two.steps
    ]
    other.close()


@pytest.mark.parametrize(("first", "second"), [(3.0, 8.0), (8.0, 3.0)])
def test_one_robot_does_both_in_the_better_order(tue_lab: Snapshot, first: float, second: float) -> None:
    """`robots=1`: one robot, which begins with the nearer drink and finishes with it before it goes on."""
    times = {
        ("pico_1", "here", "at_coffee_table"): first,
        ("pico_1", "here", "at_dining_table"): second,
        **{("amigo_1", "here", place): 50.0 for place in PLACES},
        **{(r, p, q): 5.0 for r in ROBOTS for p in PLACES for q in PLACES},
    }
    session = Session("alone", tue_lab, "FindEmptyDrink", {"room": "tue_lab"}, robots=1)
    plan = session.plan(travel_of(times), now_s=0.0)
    drinks = ["drink_1", "drink_2"] if first < second else ["drink_2", "drink_1"]
    assert searched(plan) == [("pico_1", drink) for drink in drinks]
    assert plan.makespan_s == pytest.approx(3.0 + 5.0 + 2 * (NAVIGATE_S + SEARCH_S))
    frames = [s.action.id.split("/")[4] for s in plan.steps]
    assert frames == sorted(frames, key=drinks.index), "steps of two searches alternate"
    session.close()


def test_plans_on_the_shipped_knowledge_are_the_best_of_all_assignments(larger_lab: Callable[..., Snapshot]) -> None:
    """Three robots, three drinks, random times with blocked ways: every assignment and order is tried here."""
    lab, rng = larger_lab(3, 3), np.random.default_rng(3)
    robots = lab.ontology.individuals("Robot")
    drinks = {str(d): str(lab.value("locatedAt", d)) for d in lab.ontology.individuals("Drink")}
    places = sorted(set(drinks.values()))
    found = {True: 0, False: 0}
    for number in range(40):
        times = random_times(rng, robots, places, 0.6 if number % 2 else 0.25)
        limit = 1 + number % 3
        session = Session("many", lab, "FindEmptyDrink", {"room": "tue_lab"}, robots=limit)
        plan = session.plan(travel_of(times), now_s=0.0)
        best = min(_makespans(robots, drinks, times, limit), default=None)
        found[plan.solved] += 1
        if best is None:
            assert plan.status is PlanStatus.UNSOLVABLE_PROVEN, number
        else:
            assert plan.status is PlanStatus.SOLVED_OPTIMALLY, number
            assert plan.makespan_s == pytest.approx(best, abs=1e-6), number
            assert len({s.action.robot for s in plan.steps}) <= limit, number
        session.close()
    assert min(found.values()) >= 5


def _makespans(robots: list[str], drinks: Mapping[str, str], times: Times, limit: int) -> Iterator[float]:
    """Of every order of the drinks and every robot for each."""
    for order in permutations(drinks):
        for chosen in product(robots, repeat=len(order)):
            if len(set(chosen)) > limit:
                continue
            at, ends = dict.fromkeys(robots, "here"), dict.fromkeys(robots, 0.0)
            for drink, robot in zip(order, chosen, strict=True):
                way = times.get((robot, at[robot], drinks[drink]), float("inf"))
                ends[robot] += way + NAVIGATE_S + SEARCH_S
                at[robot] = drinks[drink]
            if max(ends.values()) < float("inf"):
                yield max(ends.values())


def test_without_effort_the_plan_says_how_much_worse_than_the_best_it_may_be(
    larger_lab: Callable[[int, int], Snapshot],
) -> None:
    """The bound is not above the optimum, the makespan not below it."""
    rng = np.random.default_rng(5)
    snapshot, statuses = larger_lab(3, 6), set()
    robots = snapshot.ontology.individuals("Robot")
    for _ in range(10):
        times = random_times(rng, robots, LAB_PLACES, 0.95)
        session = Session("small", snapshot, "FindEmptyDrink", {"room": "tue_lab"}, robots=3)
        best = session.plan(travel_of(times), now_s=0.0)
        plan = session.plan(travel_of(times), now_s=0.0, effort=0.0)
        session.close()
        statuses.add(plan.status)
        assert best.status is PlanStatus.SOLVED_OPTIMALLY
        assert plan.lower_bound_s <= best.makespan_s <= plan.makespan_s
        assert plan.reason
    assert PlanStatus.SOLVED_SATISFICING in statuses


def test_no_way_for_anyone_is_proven_unsolvable(session: Session) -> None:
    """Where no robot reaches a drink, there is no plan, and that is known."""
    times = {key: s for key, s in TIMES.items() if key[2] != "at_dining_table"}
    plan = session.plan(travel_of(times), now_s=0.0)
    assert (plan.status, plan.steps) == (PlanStatus.UNSOLVABLE_PROVEN, ())


# --------------------------------------------------------------------------------------------- malformed


def test_a_malformed_definition_is_refused(tue_lab: Snapshot) -> None:
    """The error names the part that is wrong."""
    load = Entry(search_path="kb_rules", file="facts", name="load_facts")
    drop = Entry(search_path="kb_rules", file="facts", name="drop_facts")
    start = Entry(search_path="planner_golog", file="steps", name="open_session")
    load([struct("definition", -7, "Main", Var("F"), [struct("perhaps", "this")])])
    try:
        with pytest.raises(PrologError, match=r"malformed program: perhaps\(this\) is not a program") as raised:
            start(struct("request", "bad", -7, "Main", 1, 0))
        assert raised.value.formal[0] == "malformed_program"
    finally:
        drop(-7)


# ------------------------------------------------------------------------------------------------ online


def test_both_robots_work_side_by_side_to_the_end(session: Session) -> None:
    """Actions of both are running at once; the task ends after both drinks."""
    session.plan(travel_of(TIMES), now_s=0.0)
    driver = Driver(session)
    driver.next_actions()
    assert [a.robot for a in driver.running] == ["amigo_1", "pico_1"]
    driver.run()
    assert driver.done
    assert {(a.robot, a.argument("drink")) for a in driver.started if a.process == "Detection"} == {
        ("amigo_1", "drink_1"),
        ("pico_1", "drink_2"),
    }
    robots = [a.robot for a in driver.started]
    assert sum(one != two for one, two in pairwise(robots)) > len(robots) // 2
    begun = [e.action.id for e in driver.events if isinstance(e, Begun)]
    ended = [e.action.id for e in driver.events if isinstance(e, Ended)]
    assert sorted(begun) == sorted(ended)
    assert ended[-1] == begun[0] == "task/task"
    told = {(e.prop, e.subject) for e in driver.events if isinstance(e, Told)}
    assert {("locatedAt", "amigo_1"), ("hasDetectedPosition", "drink_2")} <= told


def test_a_robot_drives_until_it_has_arrived(session: Session) -> None:
    """As many turns of the loop as VelCmd says; then the next step."""
    session.plan(travel_of(TIMES), now_s=0.0)
    driver = Driver(session, loops=7)
    driver.next_actions()
    driver.run()
    commands = [a for a in driver.started if a.process == "VelCmd" and a.robot == "amigo_1"]
    assert len(commands) == 7
    assert len({a.id for a in commands}) == 1


def test_a_blocked_robot_asks_for_a_path_again(session: Session) -> None:
    """`blocked` leads to Path before the next turn, and only then."""
    session.plan(travel_of(TIMES), now_s=0.0)
    driver = Driver(session)
    driver.next_actions()
    driver.run_until(lambda a: a.process == "VelCmd" and a.robot == "amigo_1")
    driver.succeed({"arrived": False, "blocked": True})
    driver.run()
    after = [a.process for a in driver.started if a.robot == "amigo_1"]
    first = after.index("VelCmd")
    assert after[first + 1 : first + 3] == ["Base", "Path"]
    assert after.count("Path") == 2


def test_the_other_robot_takes_over_what_failed(session: Session) -> None:
    """A failed camera: the drink goes to the other robot, whose own work goes on meanwhile."""
    session.plan(travel_of(TIMES), now_s=0.0)
    driver = Driver(session)
    driver.next_actions()
    driver.run_until(lambda a: a.process == "Kinect" and a.robot == "amigo_1")
    busy = [a.id for a in driver.running if a.robot == "pico_1"]
    assert driver.fail() == "amigo_1"
    plan = session.plan(travel_of(TIMES), now_s=driver.now_s)
    assert plan.status is PlanStatus.SOLVED_OPTIMALLY
    assert searched(plan) == [("pico_1", "drink_2"), ("pico_1", "drink_1")]
    assert busy == [plan.steps[0].action.id], "what runs goes on"
    driver.next_actions()
    driver.run()
    assert driver.done
    assert [(a.robot, a.argument("drink")) for a in driver.started if a.process == "Detection"] == [
        ("pico_1", "drink_2"),
        ("pico_1", "drink_1"),
    ]


@pytest.mark.parametrize("process", ["NavMap", "Laser", "Pose", "Path", "VelCmd", "Base", "Kinect", "Detection"])
@pytest.mark.parametrize("nth", [0, 1])
def test_whatever_fails_can_be_planned_around(session: Session, process: str, nth: int) -> None:
    """Whichever step of whichever robot fails and whatever the other does then, there is a sound plan."""
    session.plan(travel_of(TIMES), now_s=0.0)
    driver = Driver(session)
    driver.next_actions()
    failed = driver.run_until(lambda a: a.process == process and a.robot == ROBOTS[nth])
    assert driver.fail() == failed.robot
    plan = session.plan(travel_of(TIMES), now_s=driver.now_s + 60.0)  # late: running steps are overdue
    assert plan.status is PlanStatus.SOLVED_OPTIMALLY
    driver.now_s += 60.0
    driver.next_actions()
    driver.run()
    assert driver.done
    assert {a.robot for a in driver.started if a.process == "Detection"} >= {ROBOTS[1 - nth]}


def test_when_all_robots_have_failed_there_is_no_plan(session: Session) -> None:
    """Each robot is left out after its failure; then nobody is left, which is proven."""
    session.plan(travel_of(TIMES), now_s=0.0)
    driver = Driver(session)
    driver.next_actions()
    driver.run_until(lambda a: a.process == "Kinect" and a.robot == "amigo_1")
    assert driver.fail() == "amigo_1"
    assert session.plan(travel_of(TIMES), now_s=driver.now_s).solved
    driver.next_actions()
    driver.run_until(lambda a: a.process == "Kinect" and "drink_1" in a.id)
    assert driver.fail() == "pico_1"
    plan = session.plan(travel_of(TIMES), now_s=driver.now_s)
    assert plan.status is PlanStatus.UNSOLVABLE_PROVEN


def test_a_robot_under_way_that_has_no_way_any_more_leaves_no_plan(session: Session) -> None:
    """A journey that has begun is not taken for one that can be looked into step by step."""
    session.plan(travel_of(TIMES), now_s=0.0)
    driver = Driver(session)
    driver.next_actions()
    driver.run_until(lambda a: a.process == "VelCmd")
    times = {key: s for key, s in TIMES.items() if key != ("amigo_1", "here", "at_coffee_table")}
    assert session.plan(travel_of(times), now_s=1.0).status is PlanStatus.UNSOLVABLE_PROVEN


def test_a_plan_in_the_middle_counts_from_where_the_robots_are(session: Session) -> None:
    """What is done is not planned again; a journey that has begun takes what is left of it."""
    session.plan(travel_of(TIMES), now_s=0.0)
    driver = Driver(session)
    driver.next_actions()
    driver.run_until(lambda a: a.process == "VelCmd")
    plan = session.plan(travel_of({**TIMES, ("pico_1", "here", "at_dining_table"): 1.0}), now_s=5.0)
    assert plan.makespan_s == pytest.approx(4.0 + NAVIGATE_S + SEARCH_S)
    assert [s.action.process for s in plan.steps].count("Navigate") == 2


def test_steps_begin_in_the_order_of_the_plan(tue_lab: Snapshot) -> None:
    """One robot, two drinks: the second in name comes first where the plan says so."""
    times = {**TIMES, ("pico_1", "here", "at_dining_table"): 1.0, ("pico_1", "here", "at_coffee_table"): 40.0}
    session = Session("alone", tue_lab, "FindEmptyDrink", {"room": "tue_lab"}, robots=1)
    plan = session.plan(travel_of(times), now_s=0.0)
    assert searched(plan) == [("pico_1", "drink_2"), ("pico_1", "drink_1")]
    driver = Driver(session)
    driver.next_actions()
    driver.run()
    assert driver.done
    frames = [a.id.split("/")[3] for a in driver.started]
    assert frames == sorted(frames, reverse=True)
    session.close()


def test_robots_without_the_capability_are_named(tue_lab: Snapshot, larger_lab: Callable[..., Snapshot]) -> None:
    """Both robots are fit for FindEmptyDrink; without its camera class, a robot is said to lack it."""
    fit = Session("fit", tue_lab, "FindEmptyDrink", {"room": "tue_lab"}, robots=2)
    assert fit.exclusions() == []
    fit.close()
    lab = larger_lab(2, 2)  # no other test uses this one: it gets a fact of its own
    load = Entry(search_path="kb_rules", file="facts", name="load_facts")
    load([struct("requires", lab.revision, "Kinect", "RobotWithArm")])
    unfit = Session("unfit", lab, "FindEmptyDrink", {"room": "tue_lab"}, robots=2)
    found = {(e.process, e.robot, e.capability) for e in unfit.exclusions()}
    assert found == {("Kinect", robot, "RobotWithArm") for robot in lab.ontology.individuals("Robot")}
    assert unfit.plan(travel_of(TIMES), now_s=0.0).status is PlanStatus.UNSOLVABLE_PROVEN
    unfit.close()


def test_the_five_thousandth_step_costs_as_much_as_the_first(session: Session) -> None:
    """Counted in inferences, which do not depend on the machine."""
    session.plan(travel_of(TIMES), now_s=0.0)
    driver = Driver(session, loops=100_000)
    driver.next_actions()

    statistics = Entry(search_path="planner_golog", file="steps", name="statistics")  # the builtin

    def inferences(steps: int) -> int:
        before = statistics("inferences")
        for _ in range(steps):
            driver.succeed()
        return int(statistics("inferences") - before)

    inferences(100)  # until both robots drive
    early = inferences(500)
    inferences(4_000)
    late = inferences(500)
    assert late == pytest.approx(early, rel=0.02)
