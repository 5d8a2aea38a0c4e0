"""Plans: which robot does what when, how long the whole takes, and how good that is."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from kb.terms import Action


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
    UNSUPPORTED = "UNSUPPORTED"
    """The program cannot be looked ahead: it decides on what only acting finds out, or loops."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedStep:
    """One durative step of a plan; times in seconds since the clock was made."""

    action: Action
    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """What the planner decided.

    Attributes:
        made_at_s: When; makespan and bound count from here.
        makespan_s: From then to the end of the last step; 0 where there is no plan.
        lower_bound_s: No execution takes less.
        steps: Ordered by start, then robot.
        choices: Which individual (or branch, from 1) was chosen at which point of the program.
        nodes: How many configurations the search looked into.
        reason: Why there is no plan, or why it is as good as it is.
    """

    status: PlanStatus
    made_at_s: float
    makespan_s: float
    lower_bound_s: float
    steps: tuple[PlannedStep, ...]
    choices: dict[str, str | int]
    nodes: int
    reason: str

    @property
    def solved(self) -> bool:
        """Whether there are steps to do."""
        return self.status in (PlanStatus.SOLVED_OPTIMALLY, PlanStatus.SOLVED_SATISFICING)
