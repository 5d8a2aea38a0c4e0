"""What to do about a failed action: what is expected to be over soonest.

The ontology says what may help, how long that takes as a rule, how often it helps and how often it may be tried. With a
recovery that takes t, has odds p, and after which the task is done `helped_s` from now if it has helped, all is over
after

    p helped_s + (1 - p) (t + V),

V being the best that can be done after that (Bellman's principle, Dynamic Programming, 1957, chapter 3). Without any,
it is over after `other_s`: what was chosen for the action is chosen anew, such as another robot. Which sequence of
recoveries is the best is found by trying all: there are few. Whatever is begun again, or chosen anew, is really
planned, on a copy of the session.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cache

from executive.events import ChooseRecovery, RecoveryWasChosen
from grounding.outcome import OutcomeStatus
from kb.recoveries import Recoveries, Recovery, RecoveryKind
from kb.store import Snapshot
from kb.terms import Action
from kb.vocabulary import Property
from planner.plan import Plan
from planner.planner import Session
from planner.remedy import remedy

UNDONE_S = 86_400.0
"""A task that fails counts as one that is done in a day: any way that may help is worth a try."""

Forecast = Callable[[Session], Plan]
"""Plans roughly what a session has left."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """What to do about a failure.

    Attributes:
        recovery: What to try; None to plan without what has failed.
        reason: What was compared, in a sentence.
    """

    recovery: Recovery | None
    reason: str


_FUTILE = frozenset({"TookTooLong", "NotGrounded"})
"""Failures of what is around a step, or of what it is given: trying the step again changes nothing."""

_NOTHING = Decision(recovery=None, reason="nothing is known to help but to plan without what has failed")


def choose(
    asked: ChooseRecovery,
    session: Session,
    plan: Plan,
    snapshot: Snapshot,
    forecast: Forecast,
    *,
    can_ask: bool,
    now_s: float,
) -> tuple[RecoveryWasChosen, bool]:
    """What to do about an action that has failed.

    Args:
        session: Of its task; it stays as it is.
        plan: The one that is followed.
        can_ask: Whether there is a person to ask for help.

    Returns:
        What is chosen, and whether it took a plan to find out.
    """
    recoveries = Recoveries(snapshot.ontology)
    failure = _failure_class(asked, recoveries, snapshot)
    around = session.surroundings(asked.action)
    whole = _restartable(asked, around.processes, snapshot)
    ways = [
        way
        for way in recoveries.against(failure)
        if asked.tried.get(way.name, 0) < way.attempts and _may_help(way, asked, whole, can_ask=can_ask)
    ]
    order = _in_order(around.chosen, asked.action, of_robot=recoveries.is_of_robot(failure))
    decision, out = _NOTHING, next(iter(order), 0)
    foreseen = bool(ways or len(order) > 1) and session.may_go_on(asked.action)
    if foreseen:
        remaining_s = max(plan.made_at_s + plan.makespan_s - now_s, 0.0)
        copies = _Copies(asked.action, session, snapshot, forecast, now_s)
        helped_s: dict[str, float] = {}
        for way in ways:
            takes_s = way.time_s + remaining_s
            if way.kind in (RecoveryKind.REPLAN, RecoveryKind.PROCESS):
                takes_s = copies.takes_again(way, whole or asked.action, around.processes, takes_s)
            helped_s[way.name] = takes_s
        ways = [way for way in ways if helped_s[way.name] < UNDONE_S]
        other_s, out = copies.takes_without(order, _step_of(asked.action, plan))
        decision = decide(ways, asked.tried, helped_s=helped_s, other_s=other_s)
    recovery = decision.recovery
    chosen = RecoveryWasChosen(
        number=asked.number,
        outcome=asked.outcome,
        recovery=recovery,
        failure=failure,
        reason=decision.reason,
        whole=whole if recovery and recovery.kind is not RecoveryKind.RETRY else None,
        out=out,
        overdue=asked.overdue,
    )
    return chosen, foreseen


def _failure_class(asked: ChooseRecovery, recoveries: Recoveries, snapshot: Snapshot) -> str:
    late = recoveries.failure_if_late(asked.overdue.process) if asked.overdue else ""
    return late or recoveries.failure_class(
        asked.outcome.failure, snapshot.groundings[asked.action.process].action_type
    )


def _restartable(asked: ChooseRecovery, processes: Sequence[Action], snapshot: Snapshot) -> Action | None:
    """The outermost process around an action such that all within may be begun again; None if there is none.

    An overdue process has to be within it.
    """
    whole = None
    for process in reversed(processes):
        if snapshot.ontology.value(Property.IS_RESTARTABLE, process.process) is not True:
            break
        whole = process
    if whole and asked.overdue and not f"{asked.overdue.id}/".startswith(f"{whole.id}/"):
        return None
    return whole


def _in_order(chosen: Sequence[str | int], action: Action, *, of_robot: bool) -> list[int]:
    """Which of the choices around an action, counted from the innermost, is made anew first: that of its robot.

    Args:
        of_robot: No other one comes into question, if there is one of a robot.
    """
    robots = [n for n, what in enumerate(chosen) if what in action.robots]
    others = [n for n in range(len(chosen)) if n not in robots]
    return robots if robots and of_robot else [*robots, *others]


def _step_of(action: Action, plan: Plan) -> Action:
    """The step of a plan that an action is part of."""
    steps = (step.action for step in plan.steps)
    return next((step for step in steps if f"{action.id}/".startswith(f"{step.id}/")), action)


def _may_help(way: Recovery, asked: ChooseRecovery, whole: Action | None, *, can_ask: bool) -> bool:
    if asked.overdue and whole is None:
        return False  # its time stays over
    if way.kind is RecoveryKind.ASK_PERSON:
        return can_ask
    if way.kind is RecoveryKind.RETRY and asked.outcome.failure in _FUTILE:
        return False
    return asked.outcome.status is not OutcomeStatus.LOST or way.pause_s > 0.0  # only time brings a robot back


@dataclass(frozen=True, slots=True)
class _Copies:
    """Copies of a session to look ahead with, each as if something were decided now."""

    action: Action
    session: Session
    snapshot: Snapshot
    forecast: Forecast
    now_s: float

    def takes_again(self, way: Recovery, whole: Action, around: Sequence[Action], usual_s: float) -> float:
        """Until the task is done, if a process is begun again after what a recovery does before.

        Args:
            usual_s: What it takes as a rule, for what only acting finds out.
        """
        before = None
        if way.process:
            before = remedy(way.process, whole.id, [self.action, *reversed(around)], self.snapshot)
            if before is None:
                return UNDONE_S
        with closing(self._copy(way.name)) as twin:
            twin.redo(self.action, whole.id, before, now_s=self.now_s)
            plan = self.forecast(twin)
        if not plan.solved:
            return UNDONE_S
        return max(usual_s, plan.makespan_s) if plan.waits_for else plan.makespan_s

    def takes_without(self, order: Sequence[int], failed: Action) -> tuple[float | None, int]:
        """Until the task is done, if what was chosen for the action is chosen anew, and which choice is.

        It is the first that leaves another way: one on which the robot does not begin with the step that has failed.
        None for the time if there is none.

        Args:
            order: In which choices come into question.
            failed: The step.
        """
        for out in order:
            with closing(self._copy(f"without@{out}")) as twin:
                if twin.failed(self.action, out=out, now_s=self.now_s).excluded is None:
                    continue
                plan = self.forecast(twin)
            first = next((step.action for step in plan.steps if set(step.action.robots) & set(failed.robots)), None)
            if plan.solved and str(first) != str(failed):
                return plan.makespan_s, out
        return None, next(iter(order), 0)

    def _copy(self, name: str) -> Session:
        return self.session.fork(f"{name}@{self.snapshot.revision}", self.snapshot, forgotten=(), now_s=self.now_s)


def decide(
    ways: Sequence[Recovery], tried: Mapping[str, int], *, helped_s: Mapping[str, float], other_s: float | None
) -> Decision:
    """What is expected to be over first.

    Args:
        tried: How often each recovery has been tried for this, by name.
        helped_s: Until the task is done if it has helped, by name.
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
        return way.odds * helped_s[way.name] + (1.0 - way.odds) * (way.time_s + expected_s(after))

    left = tuple(max(0, way.attempts - tried.get(way.name, 0)) for way in ordered)
    costs = {n: with_way_s(n, left) for n, count in enumerate(left) if count}
    best = min(costs, key=lambda n: costs[n], default=None)
    without = "nobody else can do it" if other_s is None else f"{other_s:.1f} s without what has failed"
    told = [f"{costs[n]:.1f} s with {ordered[n].name}" for n in costs] if other_s is not None else []
    compared = " or ".join([*told, without]) if costs else f"{without}, and nothing is left to try"
    if best is None or costs[best] > without_s:
        return Decision(recovery=None, reason=compared)
    return Decision(recovery=ordered[best], reason=compared)
