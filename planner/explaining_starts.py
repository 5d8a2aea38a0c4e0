"""Why each step of a plan starts when it does: what it waits for, and which steps decide the makespan.

A plan is executed with every step as early as can be (planner/golog/replay.pl): a step that starts later
than the plan does so because of something that ended at that very moment.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from planner.making import MS_PER_S
from planner.plan import Plan, PlannedStep


class Cause(StrEnum):
    """What a step waits for."""

    BEGINNING = "beginning"
    """Nothing: it starts with the plan, or was under way."""
    ROBOT = "robot"
    """Its robot was busy."""
    RESOURCE = "resource"
    """What it uses was in use."""
    PROGRAM = "program"
    """By the program, or by a condition, something had to end before."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StartReason:
    """Why a step starts when it does.

    Attributes:
        step: Its id.
        action: For people: `Navigate(amigo_1, ...)`.
        waits_for: Ids of the steps that ended as it starts and that it waited for.
        shared: The robots or resources that it shares with them, if that is the cause.
        critical: It is on a chain of such waits to the end of the plan: later here is later there.
    """

    step: str
    action: str
    start_s: float
    end_s: float
    cause: Cause
    waits_for: tuple[str, ...]
    shared: tuple[str, ...]
    critical: bool
    text: str


def start_reasons(plan: Plan, claims: Mapping[str, Sequence[str]]) -> tuple[StartReason, ...]:
    """Why each step starts when it does, in the order of the plan.

    Args:
        claims: Resources of steps and composite processes, by id.
    """
    used = {step.action.id: _used(step.action.id, claims) for step in plan.steps}
    causes = [_cause(number, plan, used) for number in range(len(plan.steps))]
    critical = _critical(plan, causes)
    return tuple(
        StartReason(
            step=step.action.id,
            action=str(step.action),
            start_s=step.start_s,
            end_s=step.end_s,
            cause=cause,
            waits_for=tuple(plan.steps[n].action.id for n in waits),
            shared=shared,
            critical=number in critical,
            text=_text(step, cause, [plan.steps[n] for n in waits], shared),
        )
        for number, (step, (cause, waits, shared)) in enumerate(zip(plan.steps, causes, strict=True))
    )


_Found = tuple[Cause, tuple[int, ...], tuple[str, ...]]


def _cause(number: int, plan: Plan, used: Mapping[str, frozenset[str]]) -> _Found:
    """The cause, the numbers of the steps that are waited for, and what is shared with them."""
    step = plan.steps[number]
    start_ms = _ms(step.start_s)
    if start_ms <= _ms(plan.made_at_s):
        return Cause.BEGINNING, (), ()
    before = [n for n, other in enumerate(plan.steps) if _ms(other.end_s) == start_ms and _precedes(n, number, plan)]
    for cause, own in (
        (Cause.ROBOT, frozenset(step.action.robots)),
        (Cause.RESOURCE, used[step.action.id]),
    ):
        others = {
            n: own & (frozenset(plan.steps[n].action.robots) if cause is Cause.ROBOT else used[plan.steps[n].action.id])
            for n in before
        }
        waits = tuple(n for n in before if others[n])
        if waits:
            return cause, waits, tuple(sorted(frozenset[str]().union(*others.values())))
    return Cause.PROGRAM, tuple(before), ()


def _precedes(one: int, other: int, plan: Plan) -> bool:
    """Steps that take no time precede what stands behind them."""
    return one != other and (plan.steps[one].start_s < plan.steps[other].start_s or one < other)


def _used(id_: str, claims: Mapping[str, Sequence[str]]) -> frozenset[str]:
    """What a step claims, itself or by the processes that it is part of."""
    parts = id_.split("/")
    around = ("/".join(parts[:n]) for n in range(1, len(parts) + 1))
    return frozenset(resource for process in around for resource in claims.get(process, ()))


def _critical(plan: Plan, causes: Sequence[_Found]) -> frozenset[int]:
    end_ms = max((_ms(s.end_s) for s in plan.steps), default=0)
    todo = [n for n, s in enumerate(plan.steps) if _ms(s.end_s) == end_ms]
    found: set[int] = set()
    while todo:
        number = todo.pop()
        if number not in found:
            found.add(number)
            todo += causes[number][1]
    return frozenset(found)


def _text(step: PlannedStep, cause: Cause, waits: Sequence[PlannedStep], shared: Sequence[str]) -> str:
    at = f"{step.start_s:.3f} s"
    after = " and ".join(str(w.action) for w in waits)
    match cause:
        case Cause.BEGINNING:
            return f"{step.action} starts at {at}, as soon as there is a plan"
        case Cause.ROBOT:
            return f"{step.action} starts at {at}: {' and '.join(shared)} had to end {after}"
        case Cause.RESOURCE:
            return f"{step.action} starts at {at}: {' and '.join(shared)} was in use by {after}"
        case Cause.PROGRAM:
            return f"{step.action} starts at {at}: {after} had to end before"


def _ms(time_s: float) -> int:
    return round(time_s * MS_PER_S)
