"""Random small programs: whatever looks for a plan finds the one that trying every execution finds.

Exact search, run tables in Prolog and the optimizer each go their own way; brute force (brute_force.py) and
the checker (planner/validate.py) share no code with them, nor with each other.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from kb.prolog import Entry
from kb.store import Snapshot
from kb.terms import render, struct
from planner.classical import solve
from planner.classical_export import agrees
from planner.classical_goal import parse_goal
from planner.making import MS_PER_S, Making
from planner.network import Improvement, Network, read_network
from planner.optimizer import improve
from planner.plan import Plan, PlannedStep, PlanStatus
from tests.planner.brute_force import PLACES, World, least, random_case
from tests.planner.conftest import random_times, travel_of
from tests.planner.mutations import mutations
from tests.planner.test_search import looked_ahead
from tests.planner.yard import Job, Timetable
from tests.planner.yard_programs import lasting

_EFFORT = 20.0
_INFERENCES = 10_000_000
_FEW, _ALL, _MUTANTS = range(200), range(200, 1000), 1000

_cover_plan = Entry(search_path="planner_golog", file="planning", name="cover_plan")
_task_network = Entry(search_path="planner_golog", file="planning", name="task_network")


def never() -> bool:
    """Do not stop."""
    return False


@dataclass(slots=True)
class Case:
    """A program, and what is found for it.

    Attributes:
        best_ms: The least makespan of all executions; None: there is none.
        told: What the optimizer tells, if there is a network.
    """

    seed: int
    job: Job
    world: World
    best_ms: int | None
    told: list[Improvement] = field(default_factory=list)

    def __str__(self) -> str:
        """For messages."""
        return f"seed {self.seed}, {render(self.job.yard.definitions[-1])}, {self.world}"

    def steps(self, rows: Sequence[Sequence[Any]]) -> tuple[PlannedStep, ...]:
        """Steps as the planner answers them."""
        table = Timetable(self.job.yard)
        for start, end, step_id, _, name, *values in rows:
            action = table.action(step_id, name, values)
            table.steps.append(PlannedStep(action=action, start_s=start / MS_PER_S, end_s=end / MS_PER_S))
        return table.plan().steps

    def checked(self, plan: Plan) -> Plan:
        """Every plan is one."""
        assert self.job.violations(plan) == [], (str(self), plan)
        return plan

    def settles(self, plan: Plan) -> None:
        """It is the best one, and proven to be; or it is proven that there is none."""
        if self.best_ms is None:
            assert plan.status is PlanStatus.UNSOLVABLE_PROVEN, (str(self), plan)
        else:
            assert plan.status is PlanStatus.SOLVED_OPTIMALLY, (str(self), plan)
            assert round(plan.makespan_s * MS_PER_S) == self.best_ms, (str(self), plan)

    def optimized(self, making: Making, network: Network) -> Plan:
        """What comes of what the optimizer tells, from the plan that is made at once unless that is the best."""
        greedy = making.greedy()
        best = None if greedy is None or greedy.status is PlanStatus.SOLVED_OPTIMALLY else greedy
        plans = [best, *making.optimized(network, self._noted(network), best, never)]
        assert plans[-1] is not None, str(self)
        return plans[-1]

    def _noted(self, network: Network) -> Iterator[Improvement]:
        for found in improve(network, effort=_EFFORT, stop=never):
            self.told.append(found)
            yield found


def agreed(seed: int, lab: Snapshot) -> tuple[str, Plan]:
    """Ask everyone; what the program has (a network that is exact, one that is not, none), and the plan."""
    world, body, tree = random_case(seed)
    best = least(tree, world)
    job = world.job(lab, body)
    case = Case(seed, job, world, None if best is None else best[0])
    with looked_ahead(job, world) as session:
        making = Making(session, now_s=0.0, steps=case.steps, checked=case.checked)
        plan = making.searched()
        case.settles(plan)
        answer = _task_network(session)
        if "root" not in answer:
            assert "none" not in answer or case.best_ms is None, str(case)
            return "none", plan
        network = read_network(answer, travel_of(job.times)(world.robots, PLACES))
        covered = making.answered(_cover_plan(struct("cover", session, _INFERENCES)), "run tables in Prolog")
        if covered is not None and (network.exact or covered.status is PlanStatus.SOLVED_OPTIMALLY):
            case.settles(covered)
        case.settles(case.optimized(making, network))
    for found in case.told:
        assert not found.unsolvable or case.best_ms is None, (str(case), found)
        assert case.best_ms is None or found.bound_ms <= case.best_ms, (str(case), found)
    if network.exact and case.best_ms is None:
        assert case.told[-1].unsolvable, str(case)
    elif network.exact and case.told:
        solution = case.told[-1].solution
        assert solution is not None, str(case)
        assert solution.makespan_ms == case.told[-1].bound_ms == case.best_ms, str(case)
    return ("exact" if network.exact else "relaxed"), plan


def ask(seeds: range, lab: Snapshot) -> None:
    """Let all agree on these programs, of each sort and outcome enough."""
    sorts: Counter[tuple[str, bool]] = Counter()
    for seed in seeds:
        sort, plan = agreed(seed, lab)
        sorts[sort, plan.solved] += 1
    for wanted in (("exact", True), ("exact", False), ("relaxed", True), ("relaxed", False), ("none", False)):
        assert sorts[wanted] >= len(seeds) // 50, sorts


def test_all_find_the_least_makespan(tue_lab: Snapshot) -> None:
    """Exact search, run tables, optimizer and brute force; and the checker accepts all plans."""
    ask(_FEW, tue_lab)


@pytest.mark.slow
def test_all_find_the_least_makespan_of_a_thousand_programs(tue_lab: Snapshot) -> None:
    """The same for the others of a thousand."""
    ask(_ALL, tue_lab)


def test_a_thousand_mutants_are_refused(tue_lab: Snapshot) -> None:
    """Of the plans for these programs, with all the ways there are to break one."""
    rng, refused, seed = np.random.default_rng(7), Counter[str](), 0
    while refused.total() < _MUTANTS:
        world, body, _ = random_case(seed)
        job = world.job(tue_lab, body)
        with looked_ahead(job, world) as session:
            case = Case(seed, job, world, None)
            plan = Making(session, now_s=0.0, steps=case.steps, checked=case.checked).searched()
        seed += 1
        for kind, mutant in mutations(plan, rng, lasting=lasting(job)) if plan.solved else ():
            assert job.violations(mutant) != [], (kind, str(case), mutant)
            refused[kind] += 1
    assert len(refused) > 20, refused


@pytest.mark.slow
def test_another_validator_agrees_on_random_goals(tue_lab: Snapshot) -> None:
    """unified-planning's: it accepts the plans for what can be exported, and none without its last step."""
    rng = np.random.default_rng(1)
    robots, places = tue_lab.ontology.individuals("Robot"), tue_lab.ontology.individuals("Location")
    for _ in range(10):
        goals = [f"locatedAt({robot})={rng.choice(places)}" for robot in robots if rng.random() < 0.6]
        drinks = [d for d in tue_lab.ontology.individuals("Drink") if rng.random() < 0.6 or not goals]
        goals += [f"hasDetectedPosition({drink})" for drink in drinks]
        travel = travel_of(random_times(rng, robots, places, 1.0))(robots, places)
        plan = solve(parse_goal(goals, tue_lab), tue_lab, travel)
        assert plan.steps, goals
        assert agrees(plan, tue_lab, travel) == "", (goals, plan)
        assert agrees(replace(plan, steps=plan.steps[:-1]), tue_lab, travel) != "", (goals, plan)
