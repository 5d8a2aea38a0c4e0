"""What the tests of the loop are made of: small requests, actions, plans, outcomes."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from executive import events, loop
from executive.request import TaskRequest
from executive.state import State
from executive.trace import TraceEvent
from grounding.outcome import Outcome, OutcomeStatus
from kb.recoveries import Recovery, RecoveryKind
from kb.terms import Action, Argument
from planner.plan import Plan, PlannedStep, PlanStatus
from planner.progress import Progress, Started, StepEvent

NO_LIMITS: Mapping[str, float] = MappingProxyType({})
SUCCEEDED = Outcome(status=OutcomeStatus.SUCCEEDED, failure="", reason="", outputs={}, elapsed_s=0.5)
BROKEN = Outcome(
    status=OutcomeStatus.EXECUTION_FAILED, failure="DeviceBroken", reason="it smokes", outputs={}, elapsed_s=0.5
)
GONE = Outcome(status=OutcomeStatus.LOST, failure="Lost", reason="the connection is gone", outputs={}, elapsed_s=0.5)


def requested(task: str) -> events.Requested:
    """A request for a task."""
    return events.Requested(task=task, request=TaskRequest(process="Tidy", arguments={"room": "attic"}, robots=2))


def action(process: str, *robots: str, step: str = "task/1") -> Action:
    """An action of a robot, of several together, or of none."""
    own = tuple(Argument(name=f"robot{n or ''}", role="robot", value=robot) for n, robot in enumerate(robots))
    return Action(id=f"{step}/{process}", process=process, robots=robots, arguments=own)


def planned(
    task: str, status: PlanStatus = PlanStatus.SOLVED_OPTIMALLY, *, limits_s: Mapping[str, float] = NO_LIMITS
) -> events.PlanWasMade:
    """A plan of one step; of none where there is no solution."""
    solved = status in (PlanStatus.SOLVED_OPTIMALLY, PlanStatus.SOLVED_SATISFICING)
    steps = (PlannedStep(action=action("Sweep", "r1"), start_s=1.0, end_s=3.0),) if solved else ()
    plan = Plan(
        status=status,
        made_at_s=1.0,
        makespan_s=2.0 if solved else 0.0,
        lower_bound_s=2.0 if solved else 0.0,
        steps=steps,
        choices={},
        nodes=7,
        reason="two seconds is the least" if solved else "the program has no execution",
    )
    return events.PlanWasMade(task=task, plan=plan, lacking=() if solved else ("r1 lacks a broom",), limits_s=limits_s)


def ready(task: str, *happened: StepEvent, done: bool = False, running: int | None = None) -> events.ActionsAreReady:
    """What the planner says; so many actions run as start, unless told."""
    starts = sum(isinstance(event, Started) for event in happened)
    progress = Progress(events=happened, done=done, running=starts if running is None else running, replan=False)
    return events.ActionsAreReady(task=task, progress=progress)


def arrived(number: int, outcome: Outcome = SUCCEEDED) -> events.OutcomeArrived:
    """An outcome of an action."""
    return events.OutcomeArrived(number=number, outcome=outcome, planned_s=0.4, shown={})


def recovered(
    number: int, name: str = "", kind: RecoveryKind = RecoveryKind.RETRY, *, pause_s: float = 0.0, process: str = ""
) -> events.RecoveryWasChosen:
    """What is done about a failure: something that may help, or a plan without what has failed."""
    recovery = Recovery(name=name, kind=kind, time_s=8.0, odds=0.5, attempts=2, pause_s=pause_s, process=process)
    return events.RecoveryWasChosen(
        number=number,
        outcome=BROKEN,
        recovery=recovery if name else None,
        failure="UnknownFailure",
        reason="it is sooner",
    )


def after(*happened: events.Event, now_s: float = 1.0) -> tuple[State, list[events.Command]]:
    """The state after some events from the beginning, and the commands of the last."""
    state, commands = State(), list[events.Command]()
    for event in happened:
        state, commands = loop.step(state, event, now_s)
    return state, commands


def recorded(commands: list[events.Command]) -> list[TraceEvent]:
    """The events that commands write to the trace."""
    return [command.event for command in commands if isinstance(command, events.Record)]


def others(commands: list[events.Command]) -> list[events.Command]:
    """The commands that do more than write to the trace."""
    return [command for command in commands if not isinstance(command, events.Record)]
