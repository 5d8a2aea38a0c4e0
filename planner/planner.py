"""The planner: a time-optimal plan for a request, and online what may start now.

The program and its situation live in Prolog (planner/golog), under the key of the session. Travel
times come from a function that the caller passes in.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from kb.prolog import Entry, PrologError
from kb.store import Snapshot
from kb.terms import Action, Argument, Data, Fluent, Struct, Term, Value, struct
from planner.errors import InvalidPlan
from planner.plan import Plan, PlannedStep, PlanStatus
from planner.validate import CannotCheck, violations

HERE = "here"
"""Where a robot is when the plan is made."""

MAX_NODES = 30_000
"""Search budget: configurations, not seconds, so that the same request has the same answer everywhere."""

TravelTimes: TypeAlias = Callable[[Mapping[str, Sequence[str]]], Mapping[tuple[str, str, str], float]]
"""Robots and the locations each may travel to -> seconds by (robot, from, to); from `here` and from each
location; what can't be reached is left out."""

_MS_PER_S = 1000


def _entry(name: str) -> Entry:
    return Entry(search_path="planner_golog", file="steps", name=name)


_open_session = _entry("open_session")
_close_session = _entry("close_session")
_needed_travels = _entry("needed_travels")
_make_plan = _entry("make_plan")
_next_actions = _entry("next_actions")
_report = _entry("report")
_retry = _entry("retry")


@dataclass(frozen=True, slots=True, kw_only=True)
class Started:
    """A primitive action may start, and counts as started."""

    action: Action


@dataclass(frozen=True, slots=True, kw_only=True)
class Begun:
    """A composite process has begun with its first action."""

    action: Action


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """A composite process has ended."""

    action: Action


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """An effect: from now on, the property of the subject has this value."""

    prop: str
    subject: str
    value: Value


StepEvent: TypeAlias = Started | Begun | Ended | Told


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """What an outcome led to, in order.

    Attributes:
        done: Nothing remains of the program.
        running: How many actions are running now.
    """

    events: tuple[StepEvent, ...]
    done: bool
    running: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Exclusion:
    """A robot that cannot do a process, and the capability that it lacks."""

    process: str
    robot: str
    capability: str


class Session:
    """One request in the planner; close it when the task has ended."""

    def __init__(
        self, key: str, snapshot: Snapshot, process: str, arguments: Mapping[str, str], *, robots: int
    ) -> None:
        """Begin with nothing done.

        Args:
            key: Name of the task; its actions' ids begin with it.
            process: The process that accomplishes the task.
            arguments: Individuals by the names of its inputs.
            robots: At most so many robots take part.
        """
        self._key = key
        self._snapshot = snapshot
        self._process = process
        self._arguments = arguments
        self._robots = robots
        head = self._head()
        _open_session(struct("request", key, snapshot.revision, head, robots, 0))
        self._from_start = True

    def _head(self) -> Term:
        process = self._snapshot.processes[self._process]
        values: list[Term] = [
            self._arguments[p.name] if p.name in self._arguments else struct("loc", self._key, p.name)
            for p in process.arguments
        ]
        return Struct(self._process, tuple(values)) if values else self._process

    def exclusions(self) -> list[Exclusion]:
        """Robots that are no use for some step, with the capability that each lacks."""
        return [Exclusion(**excluded) for excluded in _needed_travels(self._key)["excluded"]]

    def plan(self, travel_times: TravelTimes, *, now_s: float) -> Plan:
        """Find the plan of least makespan for what remains, from where the robots are now.

        Raises:
            InvalidPlan: The plan found is none; our mistake.
        """
        goals: dict[str, list[str]] = {}
        for travel in _needed_travels(self._key)["travels"]:
            goals.setdefault(travel["robot"], []).append(travel["to"])
        times = dict(travel_times(goals)) if goals else {}
        table: list[Term] = [
            struct("travel", robot, origin, goal, round(seconds * _MS_PER_S))
            for (robot, origin, goal), seconds in sorted(times.items())
        ]
        try:
            answer = _make_plan(struct("plan", self._key, round(now_s * _MS_PER_S), table, MAX_NODES))
        except PrologError as error:
            if error.formal[0] != "depends_on_sensing":
                raise
            return self._unsupported("it decides on what only acting finds out", now_s)
        plan = self._read_plan(answer, now_s)
        if plan.solved:
            try:
                found = self._violations(plan, times, answer["under_way"])
            except CannotCheck as cannot:
                return self._unsupported(str(cannot), now_s)
            if found:
                raise InvalidPlan(found)
        return plan

    def _violations(
        self, plan: Plan, times: Mapping[tuple[str, str, str], float], under_way: Sequence[str]
    ) -> list[str]:
        return violations(
            plan,
            self._snapshot,
            self._snapshot.program(self._process),
            self._head(),
            key=self._key,
            robots=self._robots,
            travel_times=times,
            from_start=self._from_start,
            under_way=frozenset(under_way),
        )

    def _unsupported(self, why: str, now_s: float) -> Plan:
        return Plan(
            status=PlanStatus.UNSUPPORTED,
            made_at_s=now_s,
            makespan_s=0.0,
            lower_bound_s=0.0,
            steps=(),
            choices={},
            nodes=0,
            reason=f"{self._process} cannot be looked ahead: {why}; "
            "give the composite process that does so a hasDurationModel, so that it is planned as one step",
        )

    def next_actions(self, *, now_s: float) -> Progress:
        """Start all that may start now."""
        self._from_start = False
        return self._progress(_next_actions(struct("next", self._key, round(now_s * _MS_PER_S))))

    def succeeded(self, action: Action, truths: Mapping[str, bool], *, now_s: float) -> Progress:
        """Report that an action has succeeded; start all that may start now.

        Args:
            truths: The truth values among its outputs, by parameter.
        """
        values: list[Term] = [
            struct("-", _location(action.argument(name)), value) for name, value in sorted(truths.items())
        ]
        return self._progress(_report(struct("done", self._key, round(now_s * _MS_PER_S), action.id, values)))

    def failed(self, action: Action, *, now_s: float) -> str | None:
        """Report that an action has failed.

        Returns:
            The individual (the robot, as a rule) that is chosen no more where it had been chosen; None if
            the program leaves no other choice. Plan again before going on.
        """
        answer = _retry(struct("failed", self._key, round(now_s * _MS_PER_S), action.id))
        return str(answer["excluded"]) if answer["retry"] else None

    def close(self) -> None:
        """Forget the session."""
        _close_session(self._key)

    def _read_plan(self, answer: Mapping[str, Any], now_s: float) -> Plan:
        status = PlanStatus(answer["status"].upper())
        steps = [
            PlannedStep(action=self._action(action), start_s=start / _MS_PER_S, end_s=end / _MS_PER_S)
            for start, end, *action in answer.get("steps", ())
        ]
        makespan_s, bound_s = answer.get("makespan", 0) / _MS_PER_S, answer.get("bound", 0) / _MS_PER_S
        return Plan(
            status=status,
            made_at_s=now_s,
            makespan_s=makespan_s,
            lower_bound_s=bound_s,
            steps=tuple(sorted(steps, key=lambda s: (s.start_s, s.action.robot or "", s.end_s))),
            choices={choice["id"]: choice["chosen"] for choice in answer.get("choices", ())},
            nodes=answer["nodes"],
            reason=_reason(status, makespan_s, bound_s, answer["nodes"]),
        )

    def _progress(self, answer: Mapping[str, Any]) -> Progress:
        events = tuple(self._event(*row) for row in answer["events"])
        return Progress(events=events, done=answer["done"], running=answer["running"])

    def _event(self, kind: str, *row: Any) -> StepEvent:
        match kind:
            case "started":
                return Started(action=self._action(row))
            case "begun":
                return Begun(action=self._action(row))
            case "ended":
                return Ended(action=self._action(row))
            case _:
                prop, subject, value = row
                return Told(prop=prop, subject=subject, value=_value(value))

    def _action(self, row: Sequence[Any]) -> Action:
        action_id, robot, process, *values = row
        parameters = self._snapshot.processes[process].arguments
        return Action(
            id=action_id,
            process=process,
            robot=None if robot == "none" else robot,
            arguments=tuple(
                Argument(role=p.role.value, name=p.name, value=_value(value))
                for p, value in zip(parameters, values, strict=True)
            ),
        )


def _location(value: Value | None) -> Term:
    assert isinstance(value, Data), f"an output without a place: {value}"
    frame, _, name = value.place.rpartition("/")
    return struct("loc", frame, name)


def _reason(status: PlanStatus, makespan_s: float, bound_s: float, nodes: int) -> str:
    match status:
        case PlanStatus.SOLVED_OPTIMALLY:
            return (
                f"makespan {makespan_s:.3f} s is the least: every other execution takes at least {bound_s:.3f} s "
                f"(best-first search, {nodes} configurations)"
            )
        case PlanStatus.SOLVED_SATISFICING:
            gap = (makespan_s - bound_s) / makespan_s if makespan_s else 0.0
            return (
                f"makespan {makespan_s:.3f} s; no execution takes less than {bound_s:.3f} s (gap {gap:.0%}); "
                f"the search ended at its budget of {nodes} configurations"
            )
        case PlanStatus.UNSOLVABLE_PROVEN:
            return f"the program has no execution ({nodes} configurations, all looked into)"
        case PlanStatus.UNSOLVABLE_INCOMPLETELY:
            return f"no execution was found within the budget of {nodes} configurations"
        case PlanStatus.UNSUPPORTED:
            return "the program cannot be looked ahead"


def _value(row: Any) -> Value:
    match row:
        case [place]:
            return Data(place)
        case [prop, subject]:
            return Fluent(prop, subject)
        case str() | int() | float():
            return row
        case _:
            raise ValueError(f"no value: {row!r}")
