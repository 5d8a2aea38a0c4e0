"""Random small programs: whatever finds a plan, it is the one that trying every execution finds.

Exact search, run tables in Prolog, and the optimizer have no code in common beyond the meaning of the
language; brute force (brute_force.py) and the checker (planner/validate.py) share none with them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from kb.prolog import Entry
from kb.store import Snapshot
from kb.terms import render, struct
from planner.making import Making
from planner.network import Improvement, Network, read_network
from planner.optimizer import improve
from planner.plan import Plan, PlanStatus
from tests.planner.brute_force import World, least, random_case
from tests.planner.conftest import travel_of
from tests.planner.mutations import MUTATIONS, mutations
from tests.planner.test_search import looked_ahead
from tests.planner.yard import Job
from tests.planner.yard_programs import lasting, planned_steps

_EFFORT = 20.0
_INFERENCES = 10_000_000
_FAST, _ALL = 200, 1000
_MUTANTS_PER_PROGRAM = 3

_cover_plan = Entry(search_path="planner_golog", file="planning", name="cover_plan")
_task_network = Entry(search_path="planner_golog", file="planning", name="task_network")


@dataclass(frozen=True, slots=True, kw_only=True)
class Answers:
    """What is found for one program.

    Attributes:
        best_ms: The least makespan of all executions; None: there is none.
        network: None where the program has none, or where nothing can be done.
        improvements: What the optimizer told.
        plans: The last plan by what made it.
    """

    job: Job
    best_ms: int | None
    network: Network | None
    improvements: tuple[Improvement, ...]
    plans: Mapping[str, Plan]
    faults: tuple[str, ...]


class Asked:
    """Lets all that make plans work on one program."""

    def __init__(self, job: Job, world: World, session: str) -> None:
        self._job, self._world, self._session = job, world, session
        self._faults: list[str] = []
        self._improvements: list[Improvement] = []
        self._making = Making(session, now_s=0.0, steps=self._job.yard.steps, checked=self._checked)
