"""The independent checker: it accepts what the planner finds and nothing else."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from kb.store import Snapshot
from kb.terms import Argument, struct
from planner.plan import Plan, PlannedStep, PlanStatus
from planner.planner import Session
from planner.validate import violations
from tests.planner.conftest import Times, random_times, travel_of

_PLANS = 120


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A plan and what it was made for."""

    plan: Plan
    lab: Snapshot
    times: Times
    robots: int

    def violations(self, plan: Plan, *, robots: int | None = None) -> list[str]:
        """What the checker says of a plan for the same request."""
        return violations(
            plan,
            self.lab,
            self.lab.program("FindEmptyDrink"),
            struct("FindEmptyDrink", "tue_lab", struct("loc", "task", "position")),
            key="task",
            robots=self.robots if robots is None else robots,
            travel_times=self.times,
            from_start=True,
        )


@pytest.fixture(scope="module")
def cases(larger_lab: Callable[[int, int], Snapshot]) -> list[Case]:
    """Plans for random travel times and numbers of robots."""
    lab = larger_lab(3, 3)
    rng = np.random.default_rng(7)
    found: list[Case] = []
    robots = lab.ontology.individuals("Robot")
    places = sorted({str(lab.value("locatedAt", d)) for d in lab.ontology.individuals("Drink")})
    while len(found) < _PLANS:
        times = random_times(rng, robots, places, 0.9)
        limit = int(rng.integers(1, 4))
        session = Session("task", lab, "FindEmptyDrink", {"room": "tue_lab"}, robots=limit)
        plan = session.plan(travel_of(times), now_s=float(rng.integers(0, 100)))
        session.close()
        if plan.solved:
            found.append(Case(plan=plan, lab=lab, times=times, robots=limit))
    return found


# ------------------------------------------------------------------------------ ways to break a plan


def with_steps(plan: Plan, steps: list[PlannedStep]) -> Plan:
    """The plan with other steps, and the makespan that goes with them."""
    makespan_s = max(s.end_s for s in steps) - plan.made_at_s
    ordered = sorted(steps, key=lambda s: (s.start_s, s.action.robot or "", s.end_s))
    return replace(plan, steps=tuple(ordered), makespan_s=makespan_s, lower_bound_s=makespan_s)


def shifted(step: PlannedStep, by_s: float) -> PlannedStep:
    """The step, so much later."""
    return replace(step, start_s=step.start_s + by_s, end_s=step.end_s + by_s)


def turns(plan: Plan) -> dict[str, list[int]]:
    """The numbers of the steps of each drink."""
    found: dict[str, list[int]] = {}
    for number, step in enumerate(plan.steps):
        found.setdefault(step.action.id.split("/")[3], []).append(number)
    return found


def two_turns_of_one(plan: Plan) -> tuple[list[int], list[int]] | None:
    """Two turns that a robot does one after the other."""
    own = sorted(turns(plan).values(), key=lambda numbers: plan.steps[numbers[0]].start_s)
    for number, one in enumerate(own):
        for other in own[number + 1 :]:
            if plan.steps[one[0]].action.robot == plan.steps[other[0]].action.robot:
                return one, other
    return None


def other_robot(plan: Plan, robot: str | None) -> str:
    """A robot that is not this one."""
    return "pico_1" if robot == "amigo_1" else "amigo_1"


def step_before_its_predecessor(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A step begins before the one that it follows has ended."""
    steps = list(plan.steps)
    number = next(n for n in rng.permutation(len(steps)) if steps[n].action.process != "Navigate")
    steps[number] = shifted(steps[number], -0.05)
    return with_steps(plan, steps)


def step_before_the_plan(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """The first step begins before the plan is made."""
    steps = list(plan.steps)
    steps[0] = shifted(steps[0], -0.05)
    return with_steps(plan, steps)


def robot_swapped(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Another robot does one of the steps."""
    steps = list(plan.steps)
    number = int(rng.integers(len(steps)))
    action = steps[number].action
    robot = other_robot(plan, action.robot)
    arguments = (Argument(name="robot", role="robot", value=robot), *action.arguments[1:])
    steps[number] = replace(steps[number], action=replace(action, robot=robot, arguments=arguments))
    return with_steps(plan, steps)


def turns_overlap(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A robot turns to the next drink before it is done with the first; None if no robot has two."""
    two = two_turns_of_one(plan)
    if two is None:
        return None
    return with_steps(plan, [shifted(s, -0.06) if n in two[1] else s for n, s in enumerate(plan.steps)])


def step_of_another_turn_between(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A robot leaves the last step for one drink for after the next; None if no robot has two."""
    two = two_turns_of_one(plan)
    if two is None:
        return None
    steps = list(plan.steps)
    last = steps[two[0][-1]]
    steps[two[0][-1]] = shifted(last, max(s.end_s for s in steps) - last.start_s)
    return with_steps(plan, steps)


def step_missing(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """One step is left out."""
    steps = list(plan.steps)
    del steps[int(rng.integers(len(steps)))]
    return with_steps(plan, steps)


def turn_missing(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """One drink is left out."""
    numbers = next(iter(turns(plan).values()))
    return with_steps(plan, [s for n, s in enumerate(plan.steps) if n not in numbers])


def duration_wrong(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A step takes longer or shorter than it does."""
    steps = list(plan.steps)
    number = int(rng.integers(len(steps)))
    steps[number] = replace(steps[number], end_s=steps[number].end_s + float(rng.choice([-0.9, 0.01, 3.0])))
    return with_steps(plan, steps)


def makespan_understated(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """The plan claims to be over earlier."""
    return replace(plan, makespan_s=plan.makespan_s - 0.1, lower_bound_s=plan.makespan_s - 0.1)


def bound_overstated(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """The bound is above the makespan."""
    return replace(plan, lower_bound_s=plan.makespan_s + 0.1)


def called_optimal_without_proof(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """The bound is below the makespan of what is called optimal."""
    assert plan.status is PlanStatus.SOLVED_OPTIMALLY
    return replace(plan, lower_bound_s=plan.makespan_s - 0.1)


def robot_incapable(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """The sofa does it all."""
    steps = [
        replace(
            s,
            action=replace(
                s.action,
                robot="sofa_1",
                arguments=(replace(s.action.arguments[0], value="sofa_1"), *s.action.arguments[1:]),
            ),
        )
        for s in plan.steps
    ]
    return with_steps(replace(plan, choices=dict.fromkeys(plan.choices, "sofa_1")), steps)


def individual_of_another_class_picked(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A drink is picked for a robot."""
    return replace(plan, choices=dict.fromkeys(plan.choices, "drink_1"))


def wrong_individual_picked(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Another robot is picked than does the steps."""
    choice = str(rng.choice(sorted(plan.choices)))
    chosen = str(plan.choices[choice])
    return replace(plan, choices={**plan.choices, choice: other_robot(plan, chosen)})


def choice_missing(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """One choice is left open."""
    return replace(plan, choices=dict(sorted(plan.choices.items())[1:]))


def step_foreign(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """There is a step that nobody asked for."""
    kinect = next(s for s in plan.steps if s.action.process == "Kinect")
    later = shifted(kinect, max(s.end_s for s in plan.steps) - kinect.start_s)
    return with_steps(plan, [*plan.steps, replace(later, action=replace(kinect.action, id="task/elsewhere"))])


def object_wrong(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A step is done with something else."""
    steps = list(plan.steps)
    number = next(n for n, s in enumerate(steps) if s.action.process == "Detection")
    action = steps[number].action
    arguments = tuple(replace(a, value="sofa_1") if a.name == "drink" else a for a in action.arguments)
    steps[number] = replace(steps[number], action=replace(action, arguments=arguments))
    return with_steps(plan, steps)


BROKEN: dict[Callable[[Plan, np.random.Generator], Plan | None], str] = {
    step_before_its_predecessor: "before",
    step_before_the_plan: "before the plan is made",
    robot_swapped: "where the program asks for",
    turns_overlap: "at once",
    step_of_another_turn_between: "comes between the steps of SearchDrink",
    step_missing: "the plan lacks",
    turn_missing: "the plan lacks",
    duration_wrong: "takes",
    makespan_understated: "the makespan is",
    bound_overstated: "is above the makespan",
    called_optimal_without_proof: "does not prove",
    robot_incapable: "but is no RobotWithBase",
    individual_of_another_class_picked: "drink_1 is no Robot",
    wrong_individual_picked: "where the program asks for",
    choice_missing: "the plan does not choose at",
    step_foreign: "the program does not ask for",
    object_wrong: "where the program asks for",
}


def test_every_plan_is_accepted_and_every_broken_one_refused(cases: list[Case]) -> None:
    """Over random plans; each kind of fault is named for what it is."""
    rng, broken = np.random.default_rng(11), Counter[str]()
    for number, case in enumerate(cases):
        assert case.violations(case.plan) == []
        for fault, message in BROKEN.items():
            plan = fault(case.plan, rng)
            if plan is not None:
                found = case.violations(plan)
                assert any(message in violation for violation in found), (number, fault.__name__, found)
                broken[fault.__name__] += 1
    assert len(broken) == len(BROKEN)
    assert min(broken.values()) > _PLANS // 4, broken


def test_more_robots_than_may_take_part_are_refused(cases: list[Case]) -> None:
    """A plan for two robots is none for one."""
    tried = 0
    for case in cases:
        used = len({step.action.robot for step in case.plan.steps})
        if used > 1:
            tried += 1
            assert case.violations(case.plan, robots=used - 1) == [f"{used} robots take part; at most {used - 1} may"]
    assert tried > _PLANS // 4


def test_a_step_under_way_may_take_what_is_left_of_it_but_not_more(tue_lab: Snapshot) -> None:
    """What had begun before the plan was made is not held against it."""
    times = random_times(np.random.default_rng(1), ("amigo_1", "pico_1"), ("at_coffee_table", "at_dining_table"), 1.0)
    session = Session("task", tue_lab, "FindEmptyDrink", {"room": "tue_lab"}, robots=2)
    plan = session.plan(travel_of(times), now_s=0.0)
    session.close()
    kinect = next(s for s in plan.steps if s.action.process == "Kinect")

    def taking(seconds: float, under_way: frozenset[str]) -> list[str]:
        step = replace(kinect, start_s=0.0, end_s=seconds)
        single = replace(plan, steps=(step,), makespan_s=seconds, lower_bound_s=seconds)
        program = tue_lab.program("FindEmptyDrink")
        return violations(
            single,
            tue_lab,
            program,
            "FindEmptyDrink",
            key="task",
            robots=2,
            travel_times=times,
            from_start=False,
            under_way=under_way,
        )

    running = frozenset({kinect.action.id})
    assert taking(0.03, running) == []
    assert taking(0.03, frozenset()) != []
    assert taking(0.2, running) != []
