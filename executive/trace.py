"""The trace: every event that an executive records, each declared once.

A trace file holds one event a line, as JSON with its `kind`. Fields may be added, with a default;
their meaning never changes, and a kind is never used again for something else. Times are seconds since
the fleet was opened; wall times never enter a trace, so that the same seed gives the same bytes.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import UnionType
from typing import Any, ClassVar, Literal, TypeAlias, get_args, get_origin, get_type_hints

from executive.errors import BadTrace
from kb.vocabulary import Property


@dataclass(frozen=True, slots=True, kw_only=True)
class FleetOpened:
    """The executive is ready: which knowledge (hash of its files), scenario, chance, settings and faults (files).

    With `connect`, its robots are not simulated here: there is no scenario then.
    """

    kind: ClassVar[Literal["fleet_opened"]] = "fleet_opened"
    t_s: float
    site: str
    robots: list[str]
    knowledge: str
    scenario: str
    seed: int
    compute: str = ""
    faults: str = ""
    connect: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskAccepted:
    """A request is well formed; it waits for its turn."""

    kind: ClassVar[Literal["task_accepted"]] = "task_accepted"
    t_s: float
    task: str
    process: str
    arguments: dict[str, str]
    robots: int
    goal: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskStatusChanged:
    """A task has another status now, and why."""

    kind: ClassVar[Literal["task_status_changed"]] = "task_status_changed"
    t_s: float
    task: str
    status: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class KnowledgeRead:
    """The snapshot of facts that a task is planned on."""

    kind: ClassVar[Literal["knowledge_read"]] = "knowledge_read"
    t_s: float
    task: str
    facts_told: int
    revision: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalSolved:
    """What leads to the goal of a task was found by an engine, or the goal holds already. The program follows."""

    kind: ClassVar[Literal["goal_solved"]] = "goal_solved"
    t_s: float
    task: str
    status: str
    engine: str
    makespan_s: float
    lower_bound_s: float
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramCompiled:
    """The Golog program of a task."""

    kind: ClassVar[Literal["program_compiled"]] = "program_compiled"
    t_s: float
    task: str
    program: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanMade:
    """A plan: its steps as [action, robot, start, end], and how good it is.

    `search` tells how it came about, as [phase, effort, nodes, pruned, makespan, lower bound].
    """

    kind: ClassVar[Literal["plan_made"]] = "plan_made"
    t_s: float
    task: str
    status: str
    makespan_s: float
    lower_bound_s: float
    steps: list[tuple[str, str, float, float]]
    reason: str
    search: list[tuple[str, float, int, int, float, float]] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanFailed:
    """There is no plan, and why."""

    kind: ClassVar[Literal["plan_failed"]] = "plan_failed"
    t_s: float
    task: str
    status: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessBegun:
    """A composite process has begun with its first action."""

    kind: ClassVar[Literal["process_begun"]] = "process_begun"
    t_s: float
    task: str
    process: str
    robot: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessEnded:
    """A composite process has ended."""

    kind: ClassVar[Literal["process_ended"]] = "process_ended"
    t_s: float
    task: str
    process: str
    robot: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionReady:
    """The planner says that an action may start."""

    kind: ClassVar[Literal["action_ready"]] = "action_ready"
    t_s: float
    task: str
    action: str
    robot: str
    number: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionStarted:
    """An action's service has been called."""

    kind: ClassVar[Literal["action_started"]] = "action_started"
    t_s: float
    task: str
    action: str
    robot: str
    number: int
    service: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionFinished:
    """An action has ended: how, how long it took, and what it found out.

    `outputs` holds truth values, poses [x, y, yaw] and points [x, y, z]; other messages are left out.
    """

    kind: ClassVar[Literal["action_finished"]] = "action_finished"
    t_s: float
    task: str
    action: str
    robot: str
    number: int
    outcome: str
    failure: str
    reason: str
    planned_s: float
    elapsed_s: float
    outputs: dict[str, bool | list[float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class FactsTold:
    """What is true from now on: an effect of an action or process of a task, or what a person or the files tell.

    Where it is no effect, `task` is empty.
    """

    kind: ClassVar[Literal["facts_told"]] = "facts_told"
    t_s: float
    task: str
    prop: str
    subject: str
    value: str | float | bool | list[float] | None
    source: str = ""
    robot: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoveryChosen:
    """What is done about an action that has failed: what may help, or the rest planned without what has failed.

    `recovery` is what is tried, of the ontology; empty for a plan without. `again` is the process around the action
    that is begun again for it; empty for the action alone.
    """

    kind: ClassVar[Literal["recovery_chosen"]] = "recovery_chosen"
    t_s: float
    task: str
    action: str
    robot: str
    number: int
    failure: str
    recovery: str
    reason: str
    again: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class PersonAsked:
    """A person is asked for help with an action that has failed, and may answer until `until_s`."""

    kind: ClassVar[Literal["person_asked"]] = "person_asked"
    t_s: float
    task: str
    number: int
    question: str
    until_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PersonHasAnswered:
    """A person has helped, or has not, or has not answered in time."""

    kind: ClassVar[Literal["person_has_answered"]] = "person_has_answered"
    t_s: float
    task: str
    number: int
    helped: bool
    reason: str
    in_time: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Replanned:
    """After a failure or a change in the world, the rest of a task is planned anew."""

    kind: ClassVar[Literal["replanned"]] = "replanned"
    t_s: float
    task: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class KnowledgeProposed:
    """Files were read beside the revision in force and can be used; what would change, in sentences."""

    kind: ClassVar[Literal["knowledge_proposed"]] = "knowledge_proposed"
    t_s: float
    revision: int
    knowledge: str
    folder: str
    changes: list[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class KnowledgeAccepted:
    """A revision of the knowledge is in force from now on; what is different from the one before."""

    kind: ClassVar[Literal["knowledge_accepted"]] = "knowledge_accepted"
    t_s: float
    revision: int
    knowledge: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class KnowledgeRolledBack:
    """An earlier revision of the knowledge is in force again; what is different from the one before."""

    kind: ClassVar[Literal["knowledge_rolled_back"]] = "knowledge_rolled_back"
    t_s: float
    revision: int
    knowledge: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class KnowledgeRefused:
    """The revision in force stays: files are wrong (then `revision` is 0), or a task uses what would be missing."""

    kind: ClassVar[Literal["knowledge_refused"]] = "knowledge_refused"
    t_s: float
    revision: int
    folder: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskCarriedOver:
    """Another revision came into force while a task was underway: under which one it goes on, and why."""

    kind: ClassVar[Literal["task_carried_over"]] = "task_carried_over"
    t_s: float
    task: str
    revision: int
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskFinished:
    """A task has ended; its outputs."""

    kind: ClassVar[Literal["task_finished"]] = "task_finished"
    t_s: float
    task: str
    status: str
    reason: str
    took_s: float
    outputs: dict[str, Any]


TraceEvent: TypeAlias = (
    FleetOpened
    | TaskAccepted
    | TaskStatusChanged
    | KnowledgeRead
    | GoalSolved
    | ProgramCompiled
    | PlanMade
    | PlanFailed
    | ProcessBegun
    | ProcessEnded
    | ActionReady
    | ActionStarted
    | ActionFinished
    | FactsTold
    | RecoveryChosen
    | PersonAsked
    | PersonHasAnswered
    | Replanned
    | KnowledgeProposed
    | KnowledgeAccepted
    | KnowledgeRolledBack
    | KnowledgeRefused
    | TaskCarriedOver
    | TaskFinished
)

BY_KIND: dict[str, type[TraceEvent]] = {event.kind: event for event in get_args(TraceEvent)}
_HINTS = {event: get_type_hints(event) for event in get_args(TraceEvent)}
_FIELDS = {event: tuple(f.name for f in fields(event)) for event in get_args(TraceEvent)}


def to_json(event: TraceEvent) -> str:
    """One line of a trace file."""
    values = {name: getattr(event, name) for name in _FIELDS[type(event)]}
    return json.dumps({"kind": event.kind, **values}, ensure_ascii=False, separators=(",", ":"))


def read_trace(path: Path) -> Iterator[TraceEvent]:
    """The events of a trace file, in order.

    Raises:
        BadTrace: The file is missing, or a line is no event.
    """
    for number, line in enumerate(_lines(path), start=1):
        try:
            values = json.loads(line)
            event = _parsed_event(BY_KIND[values.pop("kind")], values)
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            raise BadTrace(str(path), number, f"is no event of a trace: {error}") from error
        yield event


def _lines(path: Path) -> Iterator[str]:
    try:
        with path.open(encoding="utf-8") as stream:
            yield from stream
    except (OSError, UnicodeDecodeError) as error:
        raise BadTrace(str(path), 0, f"cannot be read: {error}") from error


def _parsed_event(kind: type[TraceEvent], values: dict[str, Any]) -> TraceEvent:
    return kind(**{name: _parsed(value, _HINTS[kind].get(name, Any), name) for name, value in values.items()})


def _parsed(value: Any, hint: Any, name: str) -> Any:
    """The value of a field from JSON, where tuples are lists.

    Raises:
        TypeError: It is not of the field's type.
    """
    inner = get_args(hint)
    match get_origin(hint):
        case None:
            wanted: Any = {float: (int, float), Any: object}.get(hint, hint)
            if isinstance(value, wanted) and (hint in (bool, Any) or not isinstance(value, bool)):
                return value
        case origin if origin is UnionType:
            for one in inner:
                with suppress(TypeError):
                    return _parsed(value, one, name)
        case origin if origin is list and isinstance(value, list):
            return [_parsed(one, inner[0], name) for one in value]
        case origin if origin is dict and isinstance(value, dict):
            return {key: _parsed(one, inner[1], name) for key, one in value.items()}
        case origin if origin is tuple and isinstance(value, list):
            return tuple(_parsed(one, its, name) for one, its in zip(value, inner, strict=True))
    raise TypeError(f"{name} cannot be {value!r:.80}")


def narrate(events: Iterable[TraceEvent]) -> Iterator[str]:
    """The trace for people, actions as [RoboEarth] Listing 7 prints them."""
    for event in events:
        match event:
            case FleetOpened():
                yield f"fleet of {event.site} opened: {', '.join(event.robots)}"
            case TaskAccepted() if event.goal:
                yield f"{event.task} accepted: {event.goal}, at most {event.robots} robots"
            case TaskAccepted():
                arguments = ", ".join(f"{name}={value}" for name, value in event.arguments.items())
                yield f"{event.task} accepted: {event.process}({arguments}), at most {event.robots} robots"
            case GoalSolved():
                yield f"{event.task} solved at time {event.t_s:.2f}: {event.status}, {event.reason}"
            case PlanMade():
                yield f"{event.task} planned at time {event.t_s:.2f}: {event.status}, {event.reason}"
                for action, _, start_s, end_s in event.steps:
                    yield f"  plan [{action}] from {start_s:.2f} to {end_s:.2f}"
            case PlanFailed():
                yield f"{event.task} has no plan: {event.status}, {event.reason}"
            case ActionStarted():
                yield f"do [{event.action}] at time {event.t_s:.2f}"
            case ActionFinished() if event.failure:
                yield f"  [{event.action}] {event.outcome} at time {event.t_s:.2f}: {event.failure}, {event.reason}"
            case FactsTold() if event.value is not None and event.prop not in _FREQUENT:
                yield f"  now {event.prop}({event.subject}) = {event.value}"
            case RecoveryChosen() if event.recovery:
                yield f"  [{event.action}] {event.recovery} at time {event.t_s:.2f}: {event.failure}; {event.reason}"
            case PersonAsked():
                yield f"{event.question}: a person is asked for help at time {event.t_s:.2f}"
            case PersonHasAnswered():
                answer = "has helped" if event.helped else "has not helped"
                yield f"  a person {answer} at time {event.t_s:.2f}: {event.reason}"
            case Replanned():
                yield f"{event.task} is planned anew at time {event.t_s:.2f}: {event.reason}"
            case KnowledgeProposed():
                origin = f", from {event.folder}" if event.folder else ", as it was before"
                yield f"revision {event.revision} proposed at time {event.t_s:.2f}{origin}"
                yield from (f"  {line}" for line in event.changes)
            case KnowledgeAccepted():
                yield f"revision {event.revision} in force at time {event.t_s:.2f}: {event.reason}"
            case KnowledgeRolledBack():
                yield f"revision {event.revision} in force again at time {event.t_s:.2f}: {event.reason}"
            case KnowledgeRefused():
                yield f"knowledge of {event.folder} refused at time {event.t_s:.2f}: {event.reason}"
            case TaskCarriedOver():
                yield f"  {event.task} goes on under revision {event.revision}: {event.reason}"
            case TaskFinished():
                yield f"{event.task} {event.status} at time {event.t_s:.2f} after {event.took_s:.2f} s: {event.reason}"
            case _:
                pass


_FREQUENT = frozenset({Property.HAS_POSE_ESTIMATE, Property.HAS_ODOMETRY})
"""Told with every cycle; people read them from the pictures."""
