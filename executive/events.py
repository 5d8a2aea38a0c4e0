"""What happens to the executive, and what it has done about it: the events and commands of the loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

from executive.request import TaskRequest
from executive.trace import TraceEvent
from grounding.outcome import Outcome
from kb.terms import Action, Value
from planner.classical_goal import GoalPlan
from planner.plan import Plan
from planner.planner import Progress


class TaskStatus(StrEnum):
    """Where a task is in its life (the words of Open-RMF)."""

    QUEUED = "queued"
    UNDERWAY = "underway"
    COMPLETED = "completed"
    FAILED = "failed"
    CANCELED = "canceled"
    REFUSED = "refused"
    """No robot of the fleet is capable, so nothing was begun."""

    @property
    def is_final(self) -> bool:
        """Whether nothing more will happen to the task."""
        return self not in (TaskStatus.QUEUED, TaskStatus.UNDERWAY)


# Events


@dataclass(frozen=True, slots=True, kw_only=True)
class Requested:
    """A person asks for a task; the request is well formed."""

    task: str
    request: TaskRequest


@dataclass(frozen=True, slots=True, kw_only=True)
class KnowledgeWasRead:
    """The task has its snapshot."""

    task: str
    facts_told: int


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalWasSolved:
    """It is known what leads to the task's goal; or that it holds already, or is out of reach."""

    task: str
    plan: GoalPlan


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramWasCompiled:
    """The task has its Golog program."""

    task: str
    program: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanWasMade:
    """The planner has decided, or found that there is nothing to decide.

    Attributes:
        lacking: Which robots lack which capability, a sentence each.
        limits_s: How long composite steps may take before they have failed, by id.
    """

    task: str
    plan: Plan
    lacking: tuple[str, ...]
    limits_s: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionsAreReady:
    """The planner says what may start now.

    Attributes:
        change: The change that it was told of, if that is why it says so.
    """

    task: str
    progress: Progress
    change: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class OutcomeArrived:
    """An action has ended.

    Attributes:
        planned_s: How long it was expected to take.
        shown: Its outputs as far as the trace shows them.
    """

    number: int
    outcome: Outcome
    planned_s: float
    shown: Mapping[str, bool | list[float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class FailureWasReported:
    """The planner has taken a failure in.

    Attributes:
        excluded: The individual that is not chosen again for this; None if the program leaves no choice.
        abandoned: Ids of the actions that were running for the same choice; they are no longer wanted.
    """

    task: str
    excluded: str | None
    abandoned: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class FactWasTold:
    """A person tells of a change in the world that no action has made."""

    prop: str
    subject: str
    value: str | int | float | bool


@dataclass(frozen=True, slots=True, kw_only=True)
class CancelRequested:
    """A person wants a task to end."""

    task: str


Event: TypeAlias = (
    Requested
    | KnowledgeWasRead
    | GoalWasSolved
    | ProgramWasCompiled
    | PlanWasMade
    | ActionsAreReady
    | OutcomeArrived
    | FailureWasReported
    | FactWasTold
    | CancelRequested
)


# Commands


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadKnowledge:
    """Take a snapshot for a task: KnowledgeWasRead follows."""

    task: str
    request: TaskRequest


@dataclass(frozen=True, slots=True, kw_only=True)
class SolveGoal:
    """Find out what leads to the task's goal, and make it the task's process: GoalWasSolved follows."""

    task: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CompileProgram:
    """Compile the task's process: ProgramWasCompiled follows."""

    task: str


@dataclass(frozen=True, slots=True, kw_only=True)
class MakePlan:
    """Plan what remains of a task: PlanWasMade follows."""

    task: str


@dataclass(frozen=True, slots=True, kw_only=True)
class AskActions:
    """Ask what may start now: ActionsAreReady follows."""

    task: str


@dataclass(frozen=True, slots=True, kw_only=True)
class StartAction:
    """Ground an action and call its service: OutcomeArrived follows, whatever happens."""

    number: int
    task: str
    action: Action


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportOutcome:
    """Tell the planner how an action ended: ActionsAreReady or FailureWasReported follows."""

    task: str
    action: Action
    outcome: Outcome


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportChange:
    """Tell the planner of a change that no action has made: ActionsAreReady follows, if the task has a program yet."""

    task: str
    change: FactWasTold


@dataclass(frozen=True, slots=True, kw_only=True)
class Tell:
    """Tell the knowledge base a fact; `task` is empty if a person tells it."""

    task: str
    prop: str
    subject: str
    value: Value


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """Write an event to the trace."""

    event: TraceEvent


@dataclass(frozen=True, slots=True, kw_only=True)
class FinishTask:
    """A task has ended: keep its result, let go of what it used."""

    task: str
    status: TaskStatus
    reason: str
    took_s: float


Command: TypeAlias = (
    ReadKnowledge
    | SolveGoal
    | CompileProgram
    | MakePlan
    | AskActions
    | StartAction
    | ReportOutcome
    | ReportChange
    | Tell
    | Record
    | FinishTask
)
