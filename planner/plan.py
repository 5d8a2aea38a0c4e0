"""Plans: which robot does what when, how long the whole takes, and how good that is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from kb.terms import Action

EFFORT = 5.0
"""Budget of the optimizer, in deterministic seconds."""


class PlanStatus(StrEnum):
    """How planning ended (the words of unified-planning)."""

    SOLVED_OPTIMALLY = "SOLVED_OPTIMALLY"
    """No execution of the program takes less time: the lower bound equals the makespan."""
    SOLVED_SATISFICING = "SOLVED_SATISFICING"
    """An execution; whether another takes less time is not known."""
    UNSOLVABLE_PROVEN = "UNSOLVABLE_PROVEN"
    """The program has no execution."""
    UNSOLVABLE_INCOMPLETELY = "UNSOLVABLE_INCOMPLETELY"
    """None was found within the budget."""
    TIMEOUT = "TIMEOUT"
    """It was stopped before one was found."""
    UNSUPPORTED = "UNSUPPORTED"
    """The program cannot be looked ahead."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedStep:
    """One durative step of a plan; times in seconds since the clock was made."""

    action: Action
    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far planning was at one time.

    Attributes:
        phase: What was being done.
        effort: Work of the optimizer until then, in deterministic seconds.
        nodes: Configurations that the exact search had looked into; `pruned`: those that it had left out.
        makespan_s: Of the best plan so far.
        lower_bound_s: No execution takes less, as far as was known.
    """

    phase: str
    effort: float
    nodes: int
    pruned: int
    makespan_s: float
    lower_bound_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """What the planner decided.

    Attributes:
        made_at_s: When; makespan and bound count from here.
        makespan_s: From then to the end of the last step, expected; 0 where there is no plan.
        lower_bound_s: No execution takes less.
        steps: Ordered by start, then robot.
        choices: Which individual (or branch, from 1) is chosen at which point of the program, in the order in which
            they are taken: a loop comes to the same point several times.
        waits_for: Places of what only acting finds out, where the program goes on by it: the plan ends there, and its
            makespan and bound are those of the way to there. Empty if the plan goes to the end.
        nodes: How many configurations the exact search looked into.
        effort: Work of the optimizer, in deterministic seconds.
        phase: What found the plan or raised the bound last.
        history: How makespan and bound came about.
        reason: Why there is no plan, or why it is as good as it is.
    """

    status: PlanStatus
    made_at_s: float
    makespan_s: float
    lower_bound_s: float
    steps: tuple[PlannedStep, ...]
    choices: Mapping[str, tuple[str | int, ...]]
    nodes: int
    reason: str
    waits_for: tuple[str, ...] = ()
    effort: float = 0.0
    phase: str = ""
    history: tuple[Progress, ...] = ()

    @property
    def decided(self) -> bool:
        """Whether there are steps to do, or it is proven that there are none."""
        return self.solved or self.status is PlanStatus.UNSOLVABLE_PROVEN

    @property
    def gap(self) -> float:
        """By how much of the makespan the plan may be longer than need be; 0 if it is proven optimal."""
        return (self.makespan_s - self.lower_bound_s) / self.makespan_s if self.makespan_s else 0.0

    @property
    def solved(self) -> bool:
        """Whether there are steps to do."""
        return self.status in (PlanStatus.SOLVED_OPTIMALLY, PlanStatus.SOLVED_SATISFICING)
