"""What happens to the executive, and what it has done about it: the events and commands of the loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

from executive.request import TaskRequest
from executive.trace import TraceEvent
from grounding.outcome import Outcome
from kb.history import SourceKind
from kb.recoveries import Recovery
from kb.terms import Action, Value
from planner.classical_goal import GoalPlan
from planner.plan import Plan
from planner.progress import Progress


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
    """The task has its snapshot, of a revision by its number."""

    task: str
    facts_told: int
    revision: int = 1


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
        cause: The action that has succeeded, if that is why.
    """

    task: str
    progress: Progress
    change: str = ""
    cause: Action | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class OutcomeArrived:
    """An action has ended.

    Attributes:
        planned_s: How long it was expected to take.
        shown: Its outputs as far as the trace shows them.
        overdue: The composite process that it is part of and that has taken too long, if that is why it failed.
    """

    number: int
    outcome: Outcome
    planned_s: float
    shown: Mapping[str, bool | list[float]]
    overdue: Action | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoveryWasChosen:
    """It is decided what to do about an action that has failed.

    Attributes:
        number: Under which it is held: the number of the next try.
        recovery: What is tried; None to plan without what has failed.
        failure: The class of its failure.
        reason: What was compared.
        whole: The process that is begun again; None for the action alone.
        out: Which choice is made again to plan without what has failed, counted from the innermost one.
        overdue: As in the outcome.
    """

    number: int
    outcome: Outcome
    recovery: Recovery | None
    failure: str
    reason: str
    whole: Action | None = None
    out: int = 0
    overdue: Action | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PersonAnswered:
    """Somebody has helped, or nobody will.

    Attributes:
        number: That of the question.
        reason: In a sentence.
        in_time: Whether it is an answer; else the time for one is over.
    """

    number: int
    helped: bool
    reason: str
    in_time: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessWasRedone:
    """The planner has taken in that something is to be begun again.

    Attributes:
        whole: What it is.
        process: What is done before; empty where nothing is.
        abandoned: Ids of the actions that were running in it; they are no longer wanted.
    """

    task: str
    whole: Action
    process: str
    abandoned: tuple[str, ...]


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
    """A change in the world that no action has made: a person tells of it, or it shows in a connection."""

    prop: str
    subject: str
    value: str | int | float | bool
    source: SourceKind = SourceKind.PERSON


@dataclass(frozen=True, slots=True, kw_only=True)
class NewKnowledge:
    """A revision that may come into force, as far as tasks are concerned.

    Attributes:
        revision: Its number.
        digest: Hash of its files.
        folder: Where they are, as it was given; empty where they need not be read again.
        summary: What is different, in one clause.
        changes: The same at length, in sentences.
        earlier: It was in force before.
        removed: Individuals that it does not know any more.
        keeping: Why tasks that are underway finish under the revision they have, by name; the others go over.
        unfit: Why queued tasks make no sense under it, by name.
    """

    revision: int
    digest: str
    folder: str
    summary: str
    changes: tuple[str, ...]
    earlier: bool
    removed: frozenset[str]
    keeping: Mapping[str, str]
    unfit: Mapping[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class KnowledgeWasProposed:
    """Files were read and can be used; nothing has changed."""

    knowledge: NewKnowledge


@dataclass(frozen=True, slots=True, kw_only=True)
class KnowledgeWasRejected:
    """Files were read and cannot be used."""

    folder: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class KnowledgeWasAccepted:
    """A person, or who watches a folder for one, wants a proposed revision to be in force."""

    knowledge: NewKnowledge


@dataclass(frozen=True, slots=True, kw_only=True)
class CancelRequested:
    """A person wants a task to end."""

    task: str


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalWasSent:
    """An action that was started is a goal, which has to be canceled if it is not wanted any more."""

    number: int


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalHasEnded:
    """A goal that was canceled has ended: its robots are free."""

    number: int


Event: TypeAlias = (
    Requested
    | KnowledgeWasRead
    | GoalWasSolved
    | ProgramWasCompiled
    | PlanWasMade
    | ActionsAreReady
    | OutcomeArrived
    | RecoveryWasChosen
    | PersonAnswered
    | ProcessWasRedone
    | FailureWasReported
    | FactWasTold
    | KnowledgeWasProposed
    | KnowledgeWasRejected
    | KnowledgeWasAccepted
    | CancelRequested
    | GoalWasSent
    | GoalHasEnded
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
    """Ground an action and call its service or send its goal, after a pause: OutcomeArrived follows in any case."""

    number: int
    task: str
    action: Action
    pause_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CancelAction:
    """Cancel the goal of an action that is not wanted any more: GoalHasEnded follows, whatever happens."""

    number: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ChooseRecovery:
    """Find out what to do about an action that has failed: RecoveryWasChosen follows.

    Attributes:
        tried: How often each recovery has been tried for it, and for the processes that it is part of, by name.
        overdue: As in the outcome.
    """

    number: int
    task: str
    action: Action
    outcome: Outcome
    tried: Mapping[str, int]
    overdue: Action | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RedoProcess:
    """Tell the planner that an action has failed, and what is begun again: ProcessWasRedone follows.

    Attributes:
        whole: The process, or the action itself.
        process: What is done before; empty where nothing is.
    """

    task: str
    action: Action
    whole: Action
    process: str


@dataclass(frozen=True, slots=True, kw_only=True)
class AskPerson:
    """Ask whoever listens for help: PersonAnswered follows, after `limit_s` at the latest."""

    number: int
    task: str
    question: str
    limit_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportOutcome:
    """Tell the planner how an action ended: ActionsAreReady or FailureWasReported follows.

    Attributes:
        out: After a failure, which choice is made again, counted from the innermost one.
    """

    task: str
    action: Action
    outcome: Outcome
    out: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportChange:
    """Tell the planner of a change that no action has made: ActionsAreReady follows, if the task has a program yet."""

    task: str
    change: FactWasTold


@dataclass(frozen=True, slots=True, kw_only=True)
class Tell:
    """Tell the knowledge base a fact.

    Attributes:
        task: Whose effect it is; empty if it is no effect.
        source: The action or process whose effect it is, or who else tells it.
    """

    task: str
    prop: str
    subject: str
    value: Value
    source: Action | SourceKind


@dataclass(frozen=True, slots=True, kw_only=True)
class AdoptKnowledge:
    """Put the proposed revision in force."""

    revision: int


@dataclass(frozen=True, slots=True, kw_only=True)
class RebaseTask:
    """Let the rest of a task go on under the revision in force: ActionsAreReady follows."""

    task: str


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
    | CancelAction
    | ChooseRecovery
    | RedoProcess
    | AskPerson
    | ReportOutcome
    | ReportChange
    | Tell
    | AdoptKnowledge
    | RebaseTask
    | Record
    | FinishTask
)
