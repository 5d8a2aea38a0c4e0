"""What the executive has to know to go on: tasks, what is running, who is busy. Values, changed by making others."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TypeAlias

from executive.events import CancelAction, Command, RecoveryWasChosen, StartAction, TaskStatus
from executive.request import TaskRequest
from kb.terms import Action


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """A task that has not ended.

    Attributes:
        troubles: What has failed so far, in order, and how often one after the other.
        awaited_plans: How many plans are still to come: the first, and one for each failure.
        revision: Number of the revision of the knowledge that it is done under; 0 before it is underway.
        robots: Who takes part in the plan that was made last.
        limits_s: How long composite steps of the plan may take, by id.
        deadlines: Those that have begun: what they are, and when they have failed, by id.
        tried: How often each recovery was tried for a step, or for a process begun again, that has not succeeded yet,
            by id.
    """

    name: str
    request: TaskRequest
    status: TaskStatus
    accepted_s: float
    troubles: tuple[tuple[str, int], ...] = ()
    awaited_plans: int = 1
    revision: int = 0
    robots: frozenset[str] = frozenset()
    limits_s: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    deadlines: Mapping[str, tuple[Action, float]] = field(default_factory=lambda: MappingProxyType({}))
    tried: Mapping[str, Mapping[str, int]] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def trouble(self) -> str:
        """What has failed so far, in a sentence; empty as long as nothing has."""
        return "; then ".join(what if count == 1 else f"{what} ({count} times)" for what, count in self.troubles)

    def with_trouble(self, what: str) -> Task:
        """The same after something has failed."""
        *before, (last, count) = self.troubles or (("", 0),)
        if last == what:
            return replace(self, troubles=(*before, (what, count + 1)))
        return replace(self, troubles=(*self.troubles, (what, 1)))

    def with_try(self, what: str, recovery: str) -> Task:
        """The same after a recovery is tried for a step or process, by its id."""
        tried = self.tried.get(what, {})
        return replace(self, tried={**self.tried, what: {**tried, recovery: tried.get(recovery, 0) + 1}})

    def with_success(self, what: str) -> Task:
        """The same after a step or process has succeeded: what was tried for it counts no more."""
        return replace(self, tried={i: t for i, t in self.tried.items() if i != what})

    def tried_around(self, step: str) -> dict[str, int]:
        """How often each recovery was tried for a step, and for the processes around it."""
        parts = [tried for what, tried in self.tried.items() if f"{step}/".startswith(f"{what}/")]
        return {name: sum(tried.get(name, 0) for tried in parts) for tried in parts for name in tried}


@dataclass(frozen=True, slots=True, kw_only=True)
class Running:
    """An action whose service has been called; or one that has failed, until it is decided what to do.

    Attributes:
        is_goal: Whether the robot goes on with it until it is told not to.
        asked: The recovery for which a person was asked, as long as there is no answer.
    """

    task: str
    action: Action
    is_goal: bool = False
    asked: RecoveryWasChosen | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """All that the executive has to know to go on.

    Attributes:
        tasks: By name, in order of arrival: the first is underway, the others are queued.
        running: By number of the action.
        leases: Number of the action that each busy robot is doing.
        next_number: Of the next action; never used twice.
        stopping: Robots by the number of the canceled goal that they have not ended yet.
        waiting: Actions whose robots have still to end a canceled goal, by number.
    """

    tasks: Mapping[str, Task] = field(default_factory=lambda: MappingProxyType({}))
    running: Mapping[int, Running] = field(default_factory=lambda: MappingProxyType({}))
    leases: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    next_number: int = 1
    stopping: Mapping[int, tuple[str, ...]] = field(default_factory=lambda: MappingProxyType({}))
    waiting: Mapping[int, StartAction] = field(default_factory=lambda: MappingProxyType({}))

    def is_stopping(self, action: Action) -> bool:
        """Whether a robot of an action has still to end a canceled goal."""
        busy = {robot for robots in self.stopping.values() for robot in robots}
        return not busy.isdisjoint(action.robots)


Step: TypeAlias = tuple[State, list[Command]]


def with_task(state: State, task: Task) -> State:
    """The same with this task."""
    return replace(state, tasks={**state.tasks, task.name: task})


def let_go(state: State, which: Callable[[int, Running], bool]) -> State:
    """Forget actions and the leases that they held."""
    gone = {number for number, running in state.running.items() if which(number, running)}
    return replace(
        state,
        running={n: r for n, r in state.running.items() if n not in gone},
        leases={robot: n for robot, n in state.leases.items() if n not in gone},
        waiting={n: start for n, start in state.waiting.items() if n not in gone},
    )


def give_up(state: State, which: Callable[[int, Running], bool]) -> Step:
    """Let go of actions that are not wanted any more; the robots still have to end those that are goals."""
    goals = {n: r.action.robots for n, r in state.running.items() if which(n, r) and r.is_goal}
    state = replace(let_go(state, which), stopping={**state.stopping, **goals})
    return state, [CancelAction(number=number) for number in goals]
