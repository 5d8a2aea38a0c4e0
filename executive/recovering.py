"""Whether to try a failed step again or to plan for another robot: what is expected to be over sooner.

A step may be tried again in several ways, each as often as the ontology allows. With a way of time t and odds p, the
rest of the task, which takes `remaining_s` once the step has succeeded, is over after

    t + p remaining_s + (1 - p) V,

V being the best that can be done after that (Bellman's principle, Dynamic Programming, 1957, chapter 3); another robot
is over with it all after `other_s`. Which sequence of ways is the best is found by trying all: there are few.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cache

from executive.events import ChooseRecovery, RecoveryWasChosen
from grounding.outcome import OutcomeStatus
from kb.recoveries import Recoveries, Retry
from kb.store import Snapshot
from kb.terms import Action
from planner.plan import Plan
from planner.planner import Session

UNDONE_S = 86_400.0
"""A task that fails counts as one that is done in a day: any way that may help is worth a try."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """What to do about a failure.

    Attributes:
        retry: The way to try again; None to plan without what has failed.
        reason: What was compared, in a sentence.
    """

    retry: Retry | None
    reason: str


_FUTILE = frozenset({"TookTooLong", "NotGrounded"})
"""Failures of what is around a step, or of what it is given: trying the step again changes nothing."""


def choose(
    asked: ChooseRecovery,
    session: Session,
    plan: Plan,
    snapshot: Snapshot,
    forecast: Callable[[Session], Plan],
    *,
    now_s: float,
) -> tuple[RecoveryWasChosen, bool]:
    """What to do about an action that has failed.

    Args:
        session: Of its task; it stays as it is.
        plan: The one that is followed.
        forecast: Plans roughly what a session has left.

    Returns:
        What is chosen, and whether it took a plan to find out.
    """
    recoveries = Recoveries(snapshot.ontology)
    failure = recoveries.failure_class(asked.outcome.failure, snapshot.groundings[asked.action.process].action_type)
    lost = asked.outcome.status is OutcomeStatus.LOST
    ways = [
        way
        for way in recoveries.retries(failure)
        if asked.tried.get(way.name, 0) < way.attempts and (way.pause_s or not lost)  # only time brings a robot back
    ]
    decision = Decision(retry=None, reason="nothing is known to help but to plan without what has failed")
    foreseen = bool(ways) and asked.outcome.failure not in _FUTILE and session.may_go_on(asked.action)
    if foreseen:
        decision = decide(
            ways,
            asked.tried,
            remaining_s=max(plan.made_at_s + plan.makespan_s - now_s, 0.0),
            other_s=_takes_without(asked.action, session, snapshot, forecast, now_s=now_s),
        )
    chosen = RecoveryWasChosen(
        number=asked.number,
        outcome=asked.outcome,
        retry=decision.retry.name if decision.retry else "",
        failure=failure,
        reason=decision.reason,
        pause_s=decision.retry.pause_s if decision.retry else 0.0,
    )
    return chosen, foreseen


def _takes_without(
    action: Action, session: Session, snapshot: Snapshot, forecast: Callable[[Session], Plan], *, now_s: float
) -> float | None:
    """How long the rest of a task would take without what has failed; None if it could not be done."""
    with closing(session.fork(f"without@{snapshot.revision}", snapshot, forgotten=(), now_s=now_s)) as twin:
        if twin.failed(action, now_s=now_s).excluded is None:
            return None
        plan = forecast(twin)
    return plan.makespan_s if plan.solved else None


def decide(ways: Sequence[Retry], tried: Mapping[str, int], *, remaining_s: float, other_s: float | None) -> Decision:
    """What is expected to be over first.

    Args:
        tried: How often each way has been tried for this step, by name.
        remaining_s: From the step's success until the task is done, as planned.
        other_s: Until the task is done without what has failed; None if that is impossible.
    """
    without_s = UNDONE_S if other_s is None else other_s
    ordered = sorted(ways, key=lambda way: way.name)

    @cache
    def expected_s(left: tuple[int, ...]) -> float:
        return min([without_s, *(with_way_s(n, left) for n, count in enumerate(left) if count)])

    def with_way_s(n: int, left: tuple[int, ...]) -> float:
        way = ordered[n]
        after = (*left[:n], left[n] - 1, *left[n + 1 :])
        return way.time_s + way.odds * remaining_s + (1.0 - way.odds) * expected_s(after)

    left = tuple(max(0, way.attempts - tried.get(way.name, 0)) for way in ordered)
    costs = {n: with_way_s(n, left) for n, count in enumerate(left) if count}
    best = min(costs, key=lambda n: costs[n], default=None)
    without = "nobody else can do it" if other_s is None else f"{other_s:.1f} s without what has failed"
    told = [f"{costs[n]:.1f} s with {ordered[n].name}" for n in costs] if other_s is not None else []
    compared = " or ".join([*told, without]) if costs else f"{without}, and nothing is left to try"
    if best is None or costs[best] > without_s:
        return Decision(retry=None, reason=compared)
    return Decision(retry=ordered[best], reason=compared)
