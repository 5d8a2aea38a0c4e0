"""What is answered to questions about a plan: as data, and in sentences for people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, TypeAlias

from planner.explaining_starts import StartReason
from planner.hypotheses import Change
from planner.network import Label
from planner.obstacles import Obstacle
from planner.plan import Plan, PlanStatus

MOST_REMEDIES = 5
"""So many are told at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Remedy:
    """Changes of facts that make something possible, proven by a plan.

    Attributes:
        makespan_s: Of the plan with these changes.
    """

    changes: tuple[Change, ...]
    makespan_s: float

    @property
    def text(self) -> str:
        """One clause for people."""
        return " and ".join(change.text for change in self.changes)


@dataclass(frozen=True, slots=True, kw_only=True)
class Alternative:
    """What comes of choosing otherwise.

    Attributes:
        label: What would be chosen; `name` is what it is called.
        status: Of planning with this choice; None: not tried, as the budget of plans was spent.
        makespan_s: The best with this choice; None: there is no plan with it, or it is not known.
        lower_bound_s: With this choice, no execution takes less.
        obstacles: Facts in the way, where there is no plan.
        remedies: The smallest changes of facts that would make it possible, where there is no plan.
    """

    choice: str
    label: Label
    name: str
    status: PlanStatus | None
    makespan_s: float | None
    lower_bound_s: float
    obstacles: tuple[Obstacle, ...]
    remedies: tuple[Remedy, ...]
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ChoiceReason:
    """Why something is chosen: what comes of each alternative.

    Attributes:
        chosen: In order of being taken: a loop comes to the same choice several times.
    """

    choice: str
    chosen: tuple[Label, ...]
    name: str
    alternatives: tuple[Alternative, ...]
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanExplanation:
    """Why a plan is as it is.

    Attributes:
        obstacles: Facts that keep robots and branches from the request, each once.
    """

    status: PlanStatus
    makespan_s: float
    reason: str
    starts: tuple[StartReason, ...]
    choices: tuple[ChoiceReason, ...]
    obstacles: tuple[Obstacle, ...]

    @property
    def critical(self) -> tuple[StartReason, ...]:
        """The steps that decide the makespan, in order."""
        return tuple(s for s in self.starts if s.critical)

    @property
    def text(self) -> str:
        """For people, a line each: how good it is, the choices, who is kept from what, what decides the makespan."""
        lines = [f"{self.status}: {self.reason}", *(c.text for c in self.choices), *lasting_texts(self.obstacles)]
        return "\n".join([*lines, "What decides the makespan:", *(f"  {s.text}" for s in self.critical)])


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderAlternative:
    """What comes of doing one part of a plan before another, all else being as planned.

    Attributes:
        makespan_s: None: that order comes to no end.
    """

    first: str
    before: str
    makespan_s: float | None
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Help:
    """What would make a request possible.

    Attributes:
        status: Of planning the request as it is.
        obstacles: Facts that keep robots and branches from the request.
        remedies: All of the least size, the fastest first, at most MOST_REMEDIES; empty if the request is possible
            as it is or no change that was tried helps.
        complete: Everything up to two changes was tried.
    """

    status: PlanStatus
    obstacles: tuple[Obstacle, ...]
    remedies: tuple[Remedy, ...]
    complete: bool
    text: str


Answer: TypeAlias = PlanExplanation | Alternative | OrderAlternative | Help


def as_data(answer: Answer) -> dict[str, Any]:
    """An answer as what JSON can hold."""
    return asdict(answer)


def lasting_texts(obstacles: Sequence[Obstacle]) -> list[str]:
    """What keeps robots and branches from a request for good, a sentence each."""
    return [o.text for o in obstacles if o.lasting]


def alternative_text(
    name: str,
    plan: Plan,
    found: Plan | None,
    obstacles: Sequence[Obstacle],
    remedies: Sequence[Remedy],
    *,
    complete: bool,
) -> str:
    """What comes of choosing otherwise.

    Args:
        found: The best plan with it; None: not tried.
        complete: All that may help was tried.
    """
    if found is None:
        return f"{name} was not tried"
    if found.solved:
        least = "" if found.status is PlanStatus.SOLVED_OPTIMALLY else ", or less"
        if found.makespan_s == plan.makespan_s:
            return f"{name} would take as long{least}"
        return f"{name} would take {found.makespan_s:.3f} s{least} instead of {plan.makespan_s:.3f} s"
    if found.status is not PlanStatus.UNSOLVABLE_PROVEN:
        return f"with {name} no plan was found within the budget"
    why = "; ".join(lasting_texts(obstacles))
    told = f"{name} is not possible" + (f": {why}" if why else "")
    if remedies:
        return f"{told} (it would be if {' or if '.join(r.text for r in remedies)})"
    return told if complete else f"{told} (what would help was not tried)"


def possible_text(plan: Plan | None) -> str:
    """Why a request needs no help, as far as that is known."""
    if plan is None:
        return "the request was not planned: the budget of plans is spent"
    return "the request is possible as it is" if plan.solved else f"not known to be impossible: {plan.reason}"


def help_text(obstacles: Sequence[Obstacle], remedies: Sequence[Remedy], *, complete: bool) -> str:
    """What is in the way of a request, a line each, and what would make it possible."""
    if remedies:
        told = f"the request would be possible if {' or if '.join(r.text for r in remedies)}"
    else:
        tried = "no one or two changes" if complete else "no changes that were tried within the budget"
        told = f"{tried} of facts would make the request possible"
    return "\n".join([*lasting_texts(obstacles), told])
