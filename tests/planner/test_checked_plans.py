"""The checker and the exact search, which share no code, agree on random programs of all constructs."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
import pytest

from kb.store import Snapshot
from kb.terms import render, struct
from planner.plan import Plan
from planner.validate import beginning, violations
from tests.planner.conftest import Times, random_times
from tests.planner.mutations import MUTATIONS, mutations
from tests.planner.tours import lab_with, tours_plan
from tests.planner.yard import Job
from tests.planner.yard_programs import found, lasting, random_job

_PROGRAMS = 300
_MUTANTS = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """Plans for a random program.

    Attributes:
        plan: Of the exact search.
        earliest: The same choices and orders, with every step begun as early as it can; None if it relies on waiting.
    """

    job: Job
    plan: Plan
    earliest: Plan | None

    @property
    def program(self) -> str:
        """For messages."""
        return render(self.job.yard.definitions[-1])


@pytest.fixture(scope="module")
def plans(tue_lab: Snapshot) -> list[Found]:
    """Plans for random programs; those that are refused or have none are left out."""
    made: list[Found] = []
    for seed in range(_PROGRAMS):
        job = random_job(tue_lab, seed)
        both = found(job, made_at_s=float(seed % 7))
        if both is not None:
            made.append(Found(job=job, plan=both[0], earliest=both[1]))
    return made


def test_what_the_exact_search_finds_is_accepted(plans: list[Found]) -> None:
    """Every plan; of the programs, enough have plans of several steps."""
    for case in plans:
        assert case.job.violations(case.plan) == [], case.program
    assert sum(len(case.plan.steps) > 1 for case in plans) > _PROGRAMS // 4


def test_what_is_executed_along_a_plan_is_accepted(plans: list[Found]) -> None:
    """Unless priorities are at stake: there, the execution takes the plan's choices for all that could be chosen."""
    executed = [case for case in plans if case.earliest is not None and "pconc(" not in case.program]
    for case in executed:
        assert case.earliest is not None
        assert case.job.violations(case.earliest) == [], case.program
    assert len(executed) > _PROGRAMS // 3


def test_every_mutant_is_refused(plans: list[Found]) -> None:
    """Over a thousand, of every kind at least ten."""
    rng, refused = np.random.default_rng(5), Counter[str]()
    for case in plans:
        earliest = case.earliest is not None and case.job.violations(case.earliest) == []
        plan = case.earliest if earliest and case.earliest is not None else case.plan
        for kind, mutant in mutations(plan, rng, lasting=lasting(case.job), earliest=earliest):
            assert case.job.violations(mutant) != [], (kind, case.program, mutant)
            refused[kind] += 1
    assert refused.total() >= _MUTANTS
    kinds = [*(mutation.__name__ for mutation in MUTATIONS), "step_missing", "begun_earlier"]
    assert min(refused[kind] for kind in kinds) >= 10, refused


def tour_faults(lab: Snapshot, plan: Plan, times: Times) -> list[str]:
    """What the checker says of a plan for FindEmptyDrink."""
    request = struct("FindEmptyDrink", "tue_lab", struct("loc", "task", "position"))
    program = lab.program("FindEmptyDrink")
    return violations(plan, lab, program, beginning("task", request, 0.0), robots=3, travel_times=times)


def test_tours_through_the_lab(tue_lab: Snapshot) -> None:
    """Of the shipped task as it is compiled, for three robots and seven drinks: accepted, and mutants refused."""
    lab, rng, refused = lab_with(tue_lab, 3, 7), np.random.default_rng(3), Counter[str]()
    for _ in range(10):
        times = random_times(rng, ["amigo_1", "amigo_2", "amigo_3"], [f"spot_{n}" for n in range(1, 8)], 1.0)
        drinks = [f"drink_{n}" for n in rng.permutation(7) + 1]
        plan = tours_plan(lab, {"amigo_1": drinks[:3], "amigo_2": drinks[3:5], "amigo_3": drinks[5:]}, times)
        assert tour_faults(lab, plan, times) == []
        for kind, mutant in mutations(plan, rng, lasting=lambda step: True, earliest=True):
            assert tour_faults(lab, mutant, times) != [], kind
            refused[kind] += 1
    assert len(refused) == len(MUTATIONS) + 2


def test_a_robot_without_sensors_tours_no_lab(tue_lab: Snapshot) -> None:
    """Nor does what is no robot."""
    lab = lab_with(tue_lab, 1, 2)
    lab = replace(lab, ontology=replace(lab.ontology, kinds={**lab.ontology.kinds, "bare_1": frozenset({"Robot"})}))
    for robot, why in (
        ("bare_1", "bare_1 does SearchDrink but is no "),
        ("sofa_1", "chooses sofa_1, which is none of"),
    ):
        times = {(robot, at, f"spot_{n}"): 1.0 for at in ("here", "spot_1", "spot_2") for n in (1, 2)}
        plan = tours_plan(lab, {robot: ["drink_1", "drink_2"]}, times)
        assert why in tour_faults(lab, plan, times)[0]
