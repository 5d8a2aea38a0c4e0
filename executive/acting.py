"""Actions: from what the planner says may start to what became of it, and what is done about a failure."""

from __future__ import annotations

from dataclasses import replace

from executive import trace
from executive.events import (
    AskPerson,
    CancelAction,
    ChooseRecovery,
    Command,
    FactWasTold,
    FailureWasReported,
    MakePlan,
    OutcomeArrived,
    PersonAnswered,
    ProcessWasRedone,
    Record,
    RecoveryWasChosen,
    RedoProcess,
    ReportChange,
    ReportOutcome,
    StartAction,
    TaskStatus,
    Tell,
)
from executive.queue import finish
from executive.state import Running, State, Step, Task, give_up, let_go, with_task
from grounding.outcome import Outcome, OutcomeStatus
from kb.errors import InternalError
from kb.history import SourceKind
from kb.recoveries import RecoveryKind
from kb.terms import Action
from kb.vocabulary import Property

PATIENCE = 3.0
"""A person who does not answer is waited for so many times as long as the recovery takes as a rule."""


def start_action(state: State, task: Task, action: Action, now_s: float) -> Step:
    """The robots of an action are its own from now on, and it is started."""
    state, number = _leased(state, task, action)
    return _begin(state, task, number, action, now_s)


def _leased(state: State, task: Task, action: Action) -> tuple[State, int]:
    """An action has a number and its robots, which are free."""
    number, leases = state.next_number, dict(state.leases)
    for robot in action.robots:
        if robot in leases:
            raise InternalError(f"{action} is to start, but {robot} is still busy")
        leases[robot] = number
    running = {**state.running, number: Running(task=task.name, action=action)}
    return replace(state, running=running, leases=leases, next_number=number + 1), number


def _begin(state: State, task: Task, number: int, action: Action, now_s: float, pause_s: float = 0.0) -> Step:
    ready = Record(
        event=trace.ActionReady(t_s=now_s, task=task.name, action=str(action), robot=action.robot or "", number=number)
    )
    for overdue, deadline_s in task.deadlines.values():
        if now_s > deadline_s and action.id.startswith(f"{overdue.id}/"):
            state, commands = take_outcome(state, _given_up(number, task, overdue), now_s)
            return state, [ready, *commands]
    start = StartAction(number=number, task=task.name, action=action, pause_s=pause_s)
    if state.is_stopping(action):
        return replace(state, waiting={**state.waiting, number: start}), [ready]
    return state, [ready, start]


def note_goal(state: State, number: int) -> Step:
    """A goal was sent; if nobody wants it any more by now, it is canceled, once."""
    running = state.running.get(number)
    if running is None:
        return state, [] if number in state.stopping else [CancelAction(number=number)]
    return replace(state, running={**state.running, number: replace(running, is_goal=True)}), []


def free(state: State, number: int) -> Step:
    """A canceled goal has ended: what waited for its robots starts."""
    state = replace(state, stopping={n: robots for n, robots in state.stopping.items() if n != number})
    starts = [start for start in state.waiting.values() if not state.is_stopping(start.action)]
    begun = {start.number for start in starts}
    return replace(state, waiting={n: s for n, s in state.waiting.items() if n not in begun}), [*starts]


def told_to_all(state: State, fact: FactWasTold, besides: str = "") -> list[Command]:
    """A fact for the tasks that are underway, but for one that sees to it itself, and for the knowledge base.

    In this order: what is so already is nothing new to a task.
    """
    underway = [t.name for t in state.tasks.values() if t.status is TaskStatus.UNDERWAY and t.name != besides]
    told = Tell(task="", prop=fact.prop, subject=fact.subject, value=fact.value, source=fact.source)
    return [*(ReportChange(task=name, change=fact) for name in underway), told]


def _given_up(number: int, task: Task, overdue: Action) -> OutcomeArrived:
    """A composite process has taken too long: its next action fails instead of being started."""
    reason = f"{overdue} has not ended after {task.limits_s[overdue.id]:.1f} s, which is all the time it has"
    outcome = Outcome(status=OutcomeStatus.TIMED_OUT, failure="TookTooLong", reason=reason, outputs={}, elapsed_s=0.0)
    return OutcomeArrived(number=number, outcome=outcome, planned_s=0.0, shown={}, overdue=overdue)


def take_outcome(state: State, event: OutcomeArrived, now_s: float) -> Step:
    """An action has ended: the planner is told if it succeeded, else it is found out what to do about it."""
    ended = state.running.get(event.number)
    if ended is None:  # a late reply, or one to a task that has ended
        return state, []
    action, outcome = ended.action, event.outcome
    finished = trace.ActionFinished(
        t_s=now_s,
        task=ended.task,
        action=str(action),
        robot=action.robot or "",
        number=event.number,
        outcome=outcome.status,
        failure=outcome.failure,
        reason=outcome.reason,
        planned_s=event.planned_s,
        elapsed_s=outcome.elapsed_s,
        outputs=dict(event.shown),
    )
    state, task = let_go(state, lambda number, _: number == event.number), state.tasks[ended.task]
    if outcome.succeeded:
        if action.id in task.tried:  # the next turn of a loop has the same id
            state = with_task(state, task.with_success(action.id))
        return state, [Record(event=finished), ReportOutcome(task=task.name, action=action, outcome=outcome)]
    task = task.with_trouble(f"{action} {outcome.status}: {outcome.failure}, {outcome.reason}")
    state, number = _leased(with_task(state, task), task, action)  # nobody else takes its robots meanwhile
    lost: list[Command] = []
    if outcome.status is OutcomeStatus.LOST and action.robot:
        gone = FactWasTold(prop=Property.IS_REACHABLE, subject=action.robot, value=False, source=SourceKind.CONNECTION)
        lost = told_to_all(state, gone, besides=task.name)  # this one's plan is made without the robot, or waits for it
    return state, [Record(event=finished), *lost, _choose(task, number, action, outcome, event.overdue)]


def _choose(task: Task, number: int, action: Action, outcome: Outcome, overdue: Action | None) -> ChooseRecovery:
    tried = task.tried_around(action.id)
    return ChooseRecovery(number=number, task=task.name, action=action, outcome=outcome, tried=tried, overdue=overdue)


def recover(state: State, event: RecoveryWasChosen, now_s: float) -> Step:
    """It is decided what to do about a failure."""
    failed = state.running.get(event.number)
    if failed is None:  # it is no longer wanted
        return state, []
    task, action, recovery = state.tasks[failed.task], failed.action, event.recovery
    chosen = Record(
        event=trace.RecoveryChosen(
            t_s=now_s,
            task=task.name,
            action=str(action),
            robot=action.robot or "",
            number=event.number,
            failure=event.failure,
            recovery=recovery.name if recovery else "",
            reason=event.reason,
            again=str(event.whole) if event.whole else "",
        )
    )
    if recovery is None:
        state = let_go(state, lambda number, _: number == event.number)
        state = with_task(state, replace(task, awaited_plans=task.awaited_plans + 1))
        return state, [chosen, ReportOutcome(task=task.name, action=action, outcome=event.outcome, out=event.out)]
    task = task.with_try((event.whole or action).id, recovery.name)
    state = with_task(state, task)
    if recovery.kind is RecoveryKind.RETRY:
        state, commands = _begin(state, task, event.number, action, now_s, recovery.pause_s)
        return state, [chosen, *commands]
    if recovery.kind is RecoveryKind.ASK_PERSON:
        asking = replace(failed, asked=event)
        state = replace(state, running={**state.running, event.number: asking})
        limit_s = PATIENCE * recovery.time_s
        question = f"{task.name} cannot go on: {action} {event.outcome.status}, {event.outcome.reason}"
        asked = trace.PersonAsked(
            t_s=now_s, task=task.name, number=event.number, question=question, until_s=now_s + limit_s
        )
        return state, [
            chosen,
            Record(event=asked),
            AskPerson(number=event.number, task=task.name, question=question, limit_s=limit_s),
        ]
    state, commands = _redo(state, event)
    return state, [chosen, *commands]


def _redo(state: State, event: RecoveryWasChosen) -> Step:
    """A process around a failed action, or the action itself, is begun again, for what may help to be done before."""
    failed = state.running[event.number]
    task, recovery = state.tasks[failed.task], event.recovery
    state = let_go(state, lambda number, _: number == event.number)
    state = with_task(state, replace(task, awaited_plans=task.awaited_plans + 1))
    process = recovery.process if recovery else ""
    return state, [
        RedoProcess(task=task.name, action=failed.action, whole=event.whole or failed.action, process=process)
    ]


def take_answer(state: State, event: PersonAnswered, now_s: float) -> Step:
    """A person has helped, or has not, or does not answer in time."""
    asking = state.running.get(event.number)
    if asking is None or asking.asked is None:  # it is no longer wanted, or was answered before
        return state, []
    asked, task = asking.asked, state.tasks[asking.task]
    answered = Record(
        event=trace.PersonHasAnswered(
            t_s=now_s,
            task=task.name,
            number=event.number,
            helped=event.helped,
            reason=event.reason,
            in_time=event.in_time,
        )
    )
    if event.helped:
        state, commands = _redo(state, asked)
        return state, [answered, *commands]
    task = task.with_trouble(f"a person was asked: {event.reason}")
    state = with_task(state, task)
    state = replace(state, running={**state.running, event.number: replace(asking, asked=None)})
    return state, [answered, _choose(task, event.number, asking.action, asked.outcome, asked.overdue)]


def begin_again(state: State, event: ProcessWasRedone, now_s: float) -> Step:
    """The planner has what is left of the task, with a process to be begun again: it is planned."""
    task = state.tasks.get(event.task)
    if task is None:
        return state, []
    state, stops = give_up(state, lambda _, running: running.task == task.name and running.action.id in event.abandoned)
    deadlines = {i: late for i, late in task.deadlines.items() if not f"{i}/".startswith(f"{event.whole.id}/")}
    state = with_task(state, replace(task, deadlines=deadlines))
    before = f" after {event.process}" if event.process else ""
    anew = trace.Replanned(t_s=now_s, task=task.name, reason=f"{task.trouble}; {event.whole} begins again{before}")
    return state, [*stops, Record(event=anew), MakePlan(task=task.name)]


def plan_without(state: State, event: FailureWasReported, now_s: float) -> Step:
    """The rest of a task is planned without what has failed, if there is anything else."""
    task = state.tasks.get(event.task)
    if task is None:
        return state, []
    if event.excluded is None:
        return finish(state, task.name, TaskStatus.FAILED, f"{task.trouble}; there is no other way to do it", now_s)
    state, stops = give_up(state, lambda _, running: running.task == task.name and running.action.id in event.abandoned)
    reason = f"{task.trouble}; {event.excluded} is not tried again for this"
    anew = trace.Replanned(t_s=now_s, task=task.name, reason=reason)
    return state, [*stops, Record(event=anew), MakePlan(task=task.name)]
