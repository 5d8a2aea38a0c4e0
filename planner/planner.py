"""The planner: a time-optimal plan for a request, and online what may start now.

The program and its situation live in Prolog (planner/golog), under the key of the session. Travel
times come from a function that the caller passes in.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from enum import StrEnum
from typing import Any, Self, TypeAlias

from kb.compiler import Program
from kb.prolog import Entry, PrologError
from kb.store import Snapshot
from kb.terms import Action, Argument, Data, Fluent, Struct, Term, Value, read_term, struct
from planner import optimizer, priorities
from planner.errors import InvalidPlan
from planner.making import MS_PER_S, Making, TravelSeconds, travel_tables
from planner.network import Improvement, Network, Travel, read_network
from planner.plan import EFFORT, Plan, PlannedStep, PlanStatus
from planner.progress import (
    Abandoned,
    Begun,
    Ended,
    Exclusion,
    Progress,
    Retry,
    Started,
    StepEvent,
    Surroundings,
    Told,
)
from planner.remedy import Remedy
from planner.validate import Start, beginning, violations

_INFERENCES = 100_000_000
"""Budget of the proof in Prolog alone."""

TravelTimes: TypeAlias = Callable[[Sequence[str], Sequence[str]], Travel]
"""Robots and places -> how long each robot travels from where it is, and from each place, to each place."""


class Solver(StrEnum):
    """What makes plans; Golog decides in any case whether they are executions."""

    OPTIMIZER = "optimizer"
    """Run tables and constraint solver where the program has a task network, else the exact search."""
    PROLOG = "prolog"
    """Run tables and exact search in Prolog alone."""


def _entry(file: str, name: str) -> Entry:
    return Entry(search_path="planner_golog", file=file, name=name)


_open_session = _entry("steps", "open_session")
_add_request = _entry("steps", "add_request")
_close_session = _entry("steps", "close_session")
_next_actions = _entry("steps", "next_actions")
_report = _entry("steps", "report")
_surroundings = _entry("mending", "surroundings")
_retry = _entry("mending", "retry")
_redo = _entry("mending", "redo")
_observe = _entry("steps", "observe")
_rebase = _entry("steps", "rebase")
_release = _entry("steps", "release")
_fork_session = _entry("steps", "fork_session")
_needed_travels = _entry("planning", "needed_travels")
_look_ahead = _entry("planning", "look_ahead")
_cover_plan = _entry("planning", "cover_plan")
_task_network = _entry("planning", "task_network")
_outset = _entry("outset", "outset")


class Session:
    """One request in the planner; close it when the task has ended."""

    def __init__(
        self,
        key: str,
        snapshot: Snapshot,
        process: str,
        arguments: Mapping[str, str],
        *,
        robots: int,
        priority: int = 0,
        now_s: float = 0.0,
    ) -> None:
        """Begin with nothing done.

        Args:
            key: Name of the task; its actions' ids begin with it.
            process: The process that accomplishes the task.
            arguments: Individuals by the names of its inputs.
            robots: At most so many robots take part.
            priority: Higher is more important, where the session takes other requests too (`add_request`).
            now_s: When the request begins: its deadlines count from here.
        """
        self._key = key
        self._began_s = now_s
        self._snapshot = snapshot
        self._process = process
        self._arguments = arguments
        self._robots = robots
        self._priorities = {key: priority}
        self._programs = [snapshot.program(process)]
        head = self._head(key, process, arguments)
        self._beginning = beginning(key, head, now_s)
        self._abandoned: set[str] = set()
        self._unfit: set[str] = set()
        _open_session(struct("request", key, snapshot.revision, head, robots, round(now_s * MS_PER_S)))
        self._from_start = True

    def _head(self, frame: str, name: str, arguments: Mapping[str, str]) -> Term:
        process = self._snapshot.processes[name]
        values: list[Term] = [
            arguments[p.name] if p.name in arguments else struct("loc", frame, p.name) for p in process.arguments
        ]
        return Struct(name, tuple(values)) if values else name

    def add_request(
        self, frame: str, process: str, arguments: Mapping[str, str], *, priority: int, now_s: float
    ) -> Progress:
        """Take another request over the same robots, side by side with what is left to do; plan again then.

        What is running goes on. In the plans to come no request delays one of higher priority. Deadlines of its
        processes count from when the session began.

        Args:
            frame: Name of the request; its actions' ids begin with it.
        """
        head = self._head(frame, process, arguments)
        added = self._progress(_add_request(struct("add", self._key, round(now_s * MS_PER_S), frame, head)))
        self._priorities[frame] = priority
        self._programs.append(self._snapshot.program(process))
        self._from_start = False
        return added

    def exclusions(self) -> list[Exclusion]:
        """Robots that are no use for some step, with the capability that each lacks."""
        return [Exclusion(**excluded) for excluded in _needed_travels(self._key)["excluded"]]

    def plan(self, travel_times: TravelTimes, *, now_s: float, effort: float = EFFORT) -> Plan:
        """The best plan that `plans` finds."""
        *_, last = self.plans(travel_times, now_s=now_s, effort=effort)
        return last

    def plans(
        self,
        travel_times: TravelTimes,
        *,
        now_s: float,
        effort: float = EFFORT,
        stop: Callable[[], bool] = lambda: False,
        solver: Solver = Solver.OPTIMIZER,
    ) -> Iterator[Plan]:
        """Plans of ever smaller makespan or higher lower bound for what remains, from where the robots are now.

        Each has been executed as a Golog program and accepted by the independent checker. The last one is the best
        there is within the budget; there is always at least one, which may say that there is no plan. The one yielded
        last guides the session from the next `next_actions` on.

        Args:
            effort: Budget of the optimizer, in deterministic seconds: the same request has the same answer everywhere.
            stop: Asked often; true: take the best so far.

        Raises:
            InvalidPlan: A plan found is none; our mistake.
        """
        try:
            yield from self._plans(travel_times, now_s, effort, stop, solver)
        except PrologError as error:
            if error.formal[0] != "resource_error":
                raise
            yield Making.unsupported(
                f"{self._process} leaves too much open to be looked ahead ({error}): give it fewer alternatives, "
                "or the composite processes in it a hasDurationModel",
                now_s=now_s,
            )

    def _plans(
        self, travel_times: TravelTimes, now_s: float, effort: float, stop: Callable[[], bool], solver: Solver
    ) -> Iterator[Plan]:
        needed = _needed_travels(self._key)
        travel = travel_times(needed["robots"], needed["places"])
        _look_ahead(struct("ahead", self._key, round(now_s * MS_PER_S), travel_tables(travel)))
        start, seconds = self._start(), TravelSeconds(travel)
        making = Making(
            self._key, now_s=now_s, steps=self._steps, checked=lambda plan: self._checked(plan, start, seconds)
        )
        if solver is Solver.PROLOG:
            found = making.answered(_cover_plan(struct("cover", self._key, _INFERENCES)), "run tables in Prolog")
            yield making.searched() if found is None or not found.decided else found
            return
        best = making.present() or (making.greedy() if len(set(self._priorities.values())) == 1 else None)
        if best is not None:
            yield best
            if best.status is PlanStatus.SOLVED_OPTIMALLY:
                return
        answer = _task_network(self._key)
        if "root" in answer:
            network = read_network(answer, travel)
            yield from making.optimized(network, self._improvements(network, effort, stop), best, stop)
        else:
            yield making.impossible() if "none" in answer else making.searched(best)

    def _improvements(self, network: Network, effort: float, stop: Callable[[], bool]) -> Iterator[Improvement]:
        if len(set(self._priorities.values())) > 1:
            return priorities.improve(network, self._priority_of, effort=effort, stop=stop)
        return optimizer.improve(network, effort=effort, stop=stop)

    def _priority_of(self, step: str) -> int:
        return self._priorities[step.split("/")[0]]

    def _checked(self, plan: Plan, start: Start, travel_times: Mapping[tuple[str, str, str], float]) -> Plan:
        definitions = {str(d): d for p in self._programs for d in p.definitions}
        program = Program(name=self._process, definitions=tuple(definitions.values()))
        found = violations(plan, self._snapshot, program, start, robots=self._robots, travel_times=travel_times)
        if found:
            raise InvalidPlan(found)
        return plan

    def _start(self) -> Start:
        """What a plan begins with, for the checker."""
        if self._from_start:
            return self._beginning
        told = _outset(self._key)
        running = tuple(
            PlannedStep(action=self._action(row), start_s=0.0, end_s=end / MS_PER_S) for end, *row in told["running"]
        )
        return Start(
            remaining=read_term(told["program"]),
            began_s=told["began"] / MS_PER_S,
            fluents={(prop, subject): read_term(value) for prop, subject, value in told["fluents"]},
            truths={place: value is True for place, value in told["truths"]},
            running=running,
            held=dict(told["held"]),
            claimed={resource: tuple(ids) for resource, ids in told["claimed"]},
            team=frozenset(told["team"]),
            worked_ms=dict(told["worked"]),
            excluded=frozenset((pick, individual) for pick, individual in told["excluded"]),
            places=dict(told["places"]),
        )

    def next_actions(self, *, now_s: float) -> Progress:
        """Start all that may start now."""
        self._from_start = False
        return self._progress(_next_actions(struct("next", self._key, round(now_s * MS_PER_S))))

    def succeeded(self, action: Action, truths: Mapping[str, bool], *, now_s: float) -> Progress:
        """Report that an action has succeeded; start all that may start now.

        Args:
            truths: The truth values among its outputs, by parameter.
        """
        if action.id in self._abandoned:  # it ended before anybody could stop it
            return Progress(events=(), done=False, running=0, replan=False)
        if action.id in self._unfit:
            return self._chosen_anew(action, now_s=now_s)
        values: list[Term] = [
            struct("-", _location(action.argument(name)), value) for name, value in sorted(truths.items())
        ]
        return self._progress(_report(struct("done", self._key, round(now_s * MS_PER_S), action.id, values)))

    def observed(self, prop: str, subject: str, value: str | int | float | bool, *, now_s: float) -> Progress:
        """Tell of a change that no action of this request made; start all that may start now.

        Before anything was asked to start, the first plan is to be made anew.
        """
        self._from_start = False
        return self._progress(_observe(struct("changed", self._key, round(now_s * MS_PER_S), prop, subject, value)))

    def rebased(
        self, snapshot: Snapshot, *, forgotten: Iterable[tuple[str, str]], anew: bool, now_s: float
    ) -> Progress:
        """Go on under another revision of the knowledge; start all that may start now.

        What is running goes on. A robot that is no longer capable of what it is to do next is chosen anew: at once
        if it is idle, else when what runs has ended, and only then a plan is made. The programs of what is left to do
        must be the same in both (`kb.difference.program_changed`).

        Args:
            forgotten: The (property, individual) pairs whose told values hold no more.
            anew: The plan rests on something that has changed; without, it is still seen to whether for-eachs have
                other turns now.
        """
        keys: list[Term] = [struct("-", prop, subject) for prop, subject in forgotten]
        change = struct("rebased", self._key, round(now_s * MS_PER_S), snapshot.revision, keys, anew)
        self._snapshot, self._from_start = snapshot, False
        answer = _rebase(change)
        self._unfit = set(answer["unfit"])
        return self._progress(answer)

    def fork(self, key: str, snapshot: Snapshot, *, forgotten: Iterable[tuple[str, str]], now_s: float) -> Self:
        """A copy to plan with, as this session would be if it were rebased now; this one stays as it is.

        Args:
            key: Name of the copy; close it after use.
        """
        keys: list[Term] = [struct("-", prop, subject) for prop, subject in forgotten]
        _fork_session(struct("fork", self._key, key, round(now_s * MS_PER_S), snapshot.revision, keys))
        twin = copy.copy(self)
        twin._key, twin._snapshot, twin._from_start = key, snapshot, False
        twin._abandoned, twin._unfit = set(self._abandoned), set(self._unfit)
        twin._programs = [*self._programs]
        return twin

    def may_go_on(self, action: Action) -> bool:
        """Whether the robot of a running action is still capable of what it is to do next."""
        return action.id not in self._unfit

    def surroundings(self, action: Action) -> Surroundings:
        """Where in the program a running action stands."""
        answer = _surroundings(struct("around", self._key, action.id))
        return Surroundings(processes=tuple(map(self._action, answer["processes"])), chosen=tuple(answer["chosen"]))

    def failed(self, action: Action, *, out: int = 0, now_s: float) -> Retry:
        """Report that an action has failed, and what was chosen for it is not to be chosen again. Plan before going on.

        Args:
            out: Which choice is made again: the innermost one around the action (0), the next (1), and so on.
        """
        answer = _retry(struct("failed", self._key, round(now_s * MS_PER_S), action.id, out))
        abandoned = self._given_up(action, answer)
        return Retry(excluded=str(answer["excluded"]) if answer["retry"] else None, abandoned=abandoned)

    def redo(self, action: Action, whole: str, remedy: Remedy | None, *, now_s: float) -> tuple[Action, ...]:
        """Report that an action has failed, and that a process around it is begun again. Plan before going on.

        Args:
            whole: Id of the process, or of the action itself.
            remedy: What is done before.

        Returns:
            What else was running in the process, and is no longer wanted.
        """
        before: list[Term] = [remedy.program] if remedy else []
        found: Term = remedy.found or "none" if remedy else "none"
        if remedy:
            self._programs.append(self._snapshot.program(remedy.process))
        answer = _redo(struct("redone", self._key, round(now_s * MS_PER_S), action.id, whole, before, found))
        return self._given_up(action, answer)

    def _given_up(self, failed: Action, answer: Mapping[str, Any]) -> tuple[Action, ...]:
        events = [self._event(*row) for row in answer["events"]]
        abandoned = tuple(e.action for e in events if isinstance(e, Abandoned))
        self._abandoned |= {a.id for a in abandoned}
        self._unfit -= {failed.id, *self._abandoned}
        return abandoned

    def _chosen_anew(self, action: Action, *, now_s: float) -> Progress:
        """An action has ended whose robot must not go on; a plan is made when all such have."""
        _release(struct("ended", self._key, round(now_s * MS_PER_S), action.id))
        self._unfit.remove(action.id)
        return Progress(events=(), done=False, running=len(self._unfit), replan=not self._unfit, released=True)

    def close(self) -> None:
        """Forget the session."""
        _close_session(self._key)

    def _steps(self, rows: Sequence[Sequence[Any]]) -> tuple[PlannedStep, ...]:
        steps = [
            PlannedStep(action=self._action(action), start_s=start / MS_PER_S, end_s=end / MS_PER_S)
            for start, end, *action in rows
        ]
        return tuple(sorted(steps, key=lambda s: (s.start_s, s.action.robot or "", s.end_s)))

    def _progress(self, answer: Mapping[str, Any]) -> Progress:
        events = tuple(self._event(*row) for row in answer["events"])
        for event in events:
            if isinstance(event, Abandoned):
                self._abandoned.add(event.action.id)
            elif isinstance(event, Started):
                self._abandoned.discard(event.action.id)
        return Progress(
            events=events,
            done=answer["done"],
            running=answer["running"],
            replan=answer["replan"],
            own=answer.get("own", 0),
        )

    def _event(self, kind: str, *row: Any) -> StepEvent:
        match kind:
            case "started":
                return Started(action=self._action(row))
            case "begun":
                return Begun(action=self._action(row))
            case "ended":
                return Ended(action=self._action(row))
            case "abandoned":
                return Abandoned(action=self._action(row))
            case _:
                prop, subject, value = row
                return Told(prop=prop, subject=subject, value=_value(value))

    def _action(self, row: Sequence[Any]) -> Action:
        action_id, robots, process, *values = row
        parameters = self._snapshot.processes[process].arguments
        return Action(
            id=action_id,
            process=process,
            robots=tuple(robots),
            arguments=tuple(
                Argument(role=p.role.value, name=p.name, value=_value(value))
                for p, value in zip(parameters, values, strict=True)
            ),
        )


def _location(value: Value | None) -> Term:
    assert isinstance(value, Data), f"an output without a place: {value}"
    frame, _, name = value.place.rpartition("/")
    return struct("loc", frame, name)


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
