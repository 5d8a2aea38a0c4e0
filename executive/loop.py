"""The loop: from a request to moving robots and back, in nine stages.

    1 request    check_request      executive/request.py
    2 knowledge  ReadKnowledge      kb/store.py
    3 program    CompileProgram     kb/compiler.py (for a goal, after SolveGoal: planner/classical.py)
    4 plan       MakePlan           planner/planner.py
    5 action     AskActions         planner/golog/steps.pl
    6 ground     StartAction        grounding/ground.py
    7 call       StartAction        grounding/transport.py
    8 outcome    OutcomeArrived     grounding/outcome.py
    9 report     ReportOutcome      planner/golog/steps.pl, kb/store.py: back to 5

After a failure ChooseRecovery (executive/recovering.py) comes between 8 and 9: back to 6, where the action is tried
again, or by 9 to 4.

`step` is the whole of it: a pure function from a state and an event to the next state and the commands
to carry out. It reads no clock and does no I/O; executive/shell.py carries the commands out and feeds
what comes of them back as events, one at a time.
"""

from __future__ import annotations

from dataclasses import replace
from typing import assert_never

from executive import trace
from executive.events import (
    ActionsAreReady,
    AdoptKnowledge,
    AskActions,
    CancelAction,
    CancelRequested,
    ChooseRecovery,
    Command,
    CompileProgram,
    Event,
    FactWasTold,
    FailureWasReported,
    FinishTask,
    GoalHasEnded,
    GoalWasSent,
    GoalWasSolved,
    KnowledgeWasAccepted,
    KnowledgeWasProposed,
    KnowledgeWasRead,
    KnowledgeWasRejected,
    MakePlan,
    NewKnowledge,
    OutcomeArrived,
    PlanWasMade,
    ProgramWasCompiled,
    ReadKnowledge,
    RebaseTask,
    Record,
    RecoveryWasChosen,
    ReportChange,
    ReportOutcome,
    Requested,
    SolveGoal,
    StartAction,
    TaskStatus,
    Tell,
)
from executive.state import Running, State, Step, Task, give_up, let_go, with_task
from grounding.outcome import Outcome, OutcomeStatus
from kb.errors import InternalError
from kb.history import SourceKind
from kb.terms import Action
from kb.vocabulary import Property
from planner.planner import Abandoned, Begun, Ended, Started, StepEvent, Told


def step(state: State, event: Event, now_s: float) -> Step:
    """What an event leads to."""
    match event:
        case Requested():
            return _accept(state, event, now_s)
        case KnowledgeWasRead(task=task):
            read = trace.KnowledgeRead(t_s=now_s, task=task, facts_told=event.facts_told, revision=event.revision)
            if task in state.tasks:
                state = with_task(state, replace(state.tasks[task], revision=event.revision))
            has_goal = task in state.tasks and state.tasks[task].request.goal is not None
            following = SolveGoal(task=task) if has_goal else CompileProgram(task=task)
            return _if_alive(state, task, [Record(event=read), following])
        case GoalWasSolved():
            return _take_goal(state, event, now_s)
        case ProgramWasCompiled(task=task):
            compiled = trace.ProgramCompiled(t_s=now_s, task=task, program=event.program)
            return _if_alive(state, task, [Record(event=compiled), MakePlan(task=task)])
        case PlanWasMade():
            return _take_plan(state, event, now_s)
        case ActionsAreReady():
            return _start_actions(state, event, now_s)
        case OutcomeArrived():
            return _take_outcome(state, event, now_s)
        case RecoveryWasChosen():
            return _recover(state, event, now_s)
        case FailureWasReported():
            return _plan_without(state, event, now_s)
        case FactWasTold():
            return state, _told(state, event)
        case KnowledgeWasProposed(knowledge=new):
            changes = [*new.changes, *(f"{task} would be refused: {why}" for task, why in new.unfit.items())]
            proposed = trace.KnowledgeProposed(
                t_s=now_s, revision=new.revision, knowledge=new.digest, folder=new.folder, changes=changes
            )
            return state, [Record(event=proposed)]
        case KnowledgeWasRejected():
            wrong = trace.KnowledgeRefused(t_s=now_s, revision=0, folder=event.folder, reason=event.reason)
            return state, [Record(event=wrong)]
        case KnowledgeWasAccepted():
            return _adopt(state, event.knowledge, now_s)
        case GoalWasSent(number=number):
            return _note_goal(state, number)
        case GoalHasEnded(number=number):
            return _free(state, number)
        case CancelRequested(task=task):
            return _finish(state, task, TaskStatus.CANCELED, "canceled by request", now_s)
        case _:
            assert_never(event)


def _told(state: State, fact: FactWasTold, besides: str = "") -> list[Command]:
    """A fact for the tasks that are underway, but for one that sees to it itself, and for the knowledge base.

    In this order: what is so already is nothing new to a task.
    """
    underway = [t.name for t in state.tasks.values() if t.status is TaskStatus.UNDERWAY and t.name != besides]
    told = Tell(task="", prop=fact.prop, subject=fact.subject, value=fact.value, source=fact.source)
    return [*(ReportChange(task=name, change=fact) for name in underway), told]


def _if_alive(state: State, task: str, commands: list[Command]) -> Step:
    """What comes of a task that has ended meanwhile leads to nothing."""
    return state, commands if task in state.tasks else []


def _accept(state: State, event: Requested, now_s: float) -> Step:
    request = event.request
    task = Task(name=event.task, request=request, status=TaskStatus.QUEUED, accepted_s=now_s)
    accepted = trace.TaskAccepted(
        t_s=now_s,
        task=task.name,
        process=request.process,
        arguments=dict(request.arguments),
        robots=request.robots,
        goal=request.goal.text if request.goal else "",
    )
    ahead = ", ".join(state.tasks)
    reason = f"waits for {ahead}" if ahead else "is next"
    state = replace(state, tasks={**state.tasks, task.name: task})
    commands: list[Command] = [Record(event=accepted), _status(task.name, TaskStatus.QUEUED, reason, now_s)]
    return (state, commands) if ahead else _begin_next(state, commands, now_s)


def _begin_next(state: State, commands: list[Command], now_s: float) -> Step:
    """The fleet is free: the task that has waited longest goes on to stage 2."""
    for task in state.tasks.values():
        underway = replace(task, status=TaskStatus.UNDERWAY)
        commands += [
            _status(task.name, TaskStatus.UNDERWAY, "the fleet is free", now_s),
            ReadKnowledge(task=task.name, request=task.request),
        ]
        return replace(state, tasks={**state.tasks, task.name: underway}), commands
    return state, commands


def _take_goal(state: State, event: GoalWasSolved, now_s: float) -> Step:
    """What leads to a goal is a process from here on; without steps, there is nothing to do or nothing to be done."""
    plan, name = event.plan, event.task
    if name not in state.tasks:
        return state, []
    if plan.program is None:
        failed = trace.PlanFailed(t_s=now_s, task=name, status=plan.status, reason=plan.reason)
        state, ending = _finish(state, name, TaskStatus.REFUSED, plan.reason, now_s)
        return state, [Record(event=failed), *ending]
    solved = trace.GoalSolved(
        t_s=now_s,
        task=name,
        status=plan.status,
        engine=plan.engine,
        makespan_s=plan.makespan_ms / 1000,
        lower_bound_s=plan.bound_ms / 1000,
        reason=plan.reason,
    )
    if plan.steps:
        return state, [Record(event=solved), CompileProgram(task=name)]
    state, ending = _finish(state, name, TaskStatus.COMPLETED, plan.reason, now_s)
    return state, [Record(event=solved), *ending]


def _take_plan(state: State, event: PlanWasMade, now_s: float) -> Step:
    task, plan = state.tasks.get(event.task), event.plan
    if task is None:
        return state, []
    task = replace(task, awaited_plans=task.awaited_plans - 1)
    if task.awaited_plans > 0:  # something has happened since: the plan for that is still to come
        return with_task(state, task), []
    if plan.solved:
        steps = [(str(s.action), s.action.robot or "", s.start_s, s.end_s) for s in plan.steps]
        made = trace.PlanMade(
            t_s=now_s,
            task=task.name,
            status=plan.status,
            makespan_s=plan.makespan_s,
            lower_bound_s=plan.lower_bound_s,
            steps=steps,
            reason=plan.reason,
            search=[
                (p.phase, round(p.effort, 3), p.nodes, p.pruned, p.makespan_s, p.lower_bound_s) for p in plan.history
            ],
        )
        robots = frozenset(robot for s in plan.steps for robot in s.action.robots)
        planned = replace(task, limits_s=event.limits_s, robots=robots)
        return with_task(state, planned), [Record(event=made), AskActions(task=task.name)]
    reason = "; ".join([*([task.trouble] if task.trouble else []), plan.reason, *event.lacking])
    failed = trace.PlanFailed(t_s=now_s, task=task.name, status=plan.status, reason=reason)
    begun = bool(task.trouble or task.robots)
    status = TaskStatus.FAILED if begun else TaskStatus.REFUSED
    state, commands = _finish(state, task.name, status, reason, now_s)
    return state, [Record(event=failed), *commands]


def _start_actions(state: State, event: ActionsAreReady, now_s: float) -> Step:
    if event.task not in state.tasks:
        return state, []
    commands: list[Command] = []
    sources = _sources(event)
    for happened, source in zip(event.progress.events, sources, strict=True):
        state, more = _take_progress(state, event.task, happened, source, now_s)
        commands += more
    if event.progress.done:
        state, ending = _finish(state, event.task, TaskStatus.COMPLETED, "everything asked for is done", now_s)
        return state, commands + ending
    task = state.tasks[event.task]
    if event.progress.replan:
        reason = "the plan waited for what is known now, or was made before it changed"
        if event.progress.released:
            reason = f"{event.cause} has ended, and its robot is no longer capable of what it was to do next"
        elif event.change:
            reason = f"{event.change}, for which the plan was not made"
        anew = trace.Replanned(t_s=now_s, task=task.name, reason=reason)
        state = with_task(state, replace(task, awaited_plans=task.awaited_plans + 1))
        return state, [*commands, Record(event=anew), MakePlan(task=task.name)]
    if event.progress.running == 0 and task.awaited_plans == 0:
        dead_end = "the program can neither go on nor end"
        reason = f"{task.trouble}; {dead_end}" if task.trouble else dead_end
        state, ending = _finish(state, event.task, TaskStatus.FAILED, reason, now_s)
        return state, commands + ending
    return state, commands


def _sources(event: ActionsAreReady) -> list[Action | None]:
    """Whose effect each fact is that is told: of the action that has succeeded, or of the process that ends next."""
    sources: list[Action | None] = []
    ending, told = None, sum(isinstance(e, Told) for e in event.progress.events)
    for happened in reversed(event.progress.events):
        if isinstance(happened, Ended):
            ending = happened.action
        told -= isinstance(happened, Told)
        sources.append(event.cause if told < event.progress.own else ending)
    return sources[::-1]


def _take_progress(state: State, name: str, happened: StepEvent, source: Action | None, now_s: float) -> Step:
    task = state.tasks[name]
    match happened:
        case Begun(action=action):
            begun = trace.ProcessBegun(t_s=now_s, task=name, process=str(action), robot=action.robot or "")
            if action.id in task.limits_s:
                deadline = (action, now_s + task.limits_s[action.id])
                state = with_task(state, replace(task, deadlines={**task.deadlines, action.id: deadline}))
            return state, [Record(event=begun)]
        case Ended(action=action):
            ended = trace.ProcessEnded(t_s=now_s, task=name, process=str(action), robot=action.robot or "")
            if action.id in task.deadlines:
                deadlines = {i: d for i, d in task.deadlines.items() if i != action.id}
                state = with_task(state, replace(task, deadlines=deadlines))
            return state, [Record(event=ended)]
        case Told():
            by = source or SourceKind.PERSON
            told = Tell(task=name, prop=happened.prop, subject=happened.subject, value=happened.value, source=by)
            return state, [told]
        case Started(action=action):
            return _start_action(state, task, action, now_s)
        case Abandoned(action=action):
            given_up = [n for n, r in state.running.items() if r.task == name and r.action.id == action.id]
            return give_up(state, lambda number, _: number in given_up)
        case _:
            assert_never(happened)


def _start_action(state: State, task: Task, action: Action, now_s: float) -> Step:
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
            state, commands = _take_outcome(state, _given_up(number, task, overdue), now_s)
            return state, [ready, *commands]
    start = StartAction(number=number, task=task.name, action=action, pause_s=pause_s)
    if state.is_stopping(action):
        return replace(state, waiting={**state.waiting, number: start}), [ready]
    return state, [ready, start]


def _note_goal(state: State, number: int) -> Step:
    """A goal was sent; if nobody wants it any more by now, it is canceled, once."""
    running = state.running.get(number)
    if running is None:
        return state, [] if number in state.stopping else [CancelAction(number=number)]
    return replace(state, running={**state.running, number: replace(running, is_goal=True)}), []


def _free(state: State, number: int) -> Step:
    """A canceled goal has ended: what waited for its robots starts."""
    state = replace(state, stopping={n: robots for n, robots in state.stopping.items() if n != number})
    starts = [start for start in state.waiting.values() if not state.is_stopping(start.action)]
    begun = {start.number for start in starts}
    return replace(state, waiting={n: s for n, s in state.waiting.items() if n not in begun}), [*starts]


def _given_up(number: int, task: Task, overdue: Action) -> OutcomeArrived:
    """A composite process has taken too long: its next action fails instead of being started."""
    reason = f"{overdue} has not ended after {task.limits_s[overdue.id]:.1f} s, which is all the time it has"
    outcome = Outcome(status=OutcomeStatus.TIMED_OUT, failure="TookTooLong", reason=reason, outputs={}, elapsed_s=0.0)
    return OutcomeArrived(number=number, outcome=outcome, planned_s=0.0, shown={})


def _take_outcome(state: State, event: OutcomeArrived, now_s: float) -> Step:
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
    tried = task.tried.get(action.id, {})
    if outcome.succeeded:
        if tried:  # the next turn of a loop has the same id
            state = with_task(state, replace(task, tried={i: t for i, t in task.tried.items() if i != action.id}))
        return state, [Record(event=finished), ReportOutcome(task=task.name, action=action, outcome=outcome)]
    task = task.with_trouble(f"{action} {outcome.status}: {outcome.failure}, {outcome.reason}")
    state, number = _leased(with_task(state, task), task, action)  # nobody else takes its robots meanwhile
    choose = ChooseRecovery(number=number, task=task.name, action=action, outcome=outcome, tried=tried)
    lost: list[Command] = []
    if outcome.status is OutcomeStatus.LOST and action.robot:
        gone = FactWasTold(prop=Property.IS_REACHABLE, subject=action.robot, value=False, source=SourceKind.CONNECTION)
        lost = _told(state, gone, besides=task.name)  # this one's plan is made without the robot, or waits for it
    return state, [Record(event=finished), *lost, choose]


def _recover(state: State, event: RecoveryWasChosen, now_s: float) -> Step:
    failed = state.running.get(event.number)
    if failed is None:  # it is no longer wanted
        return state, []
    task, action = state.tasks[failed.task], failed.action
    chosen = Record(
        event=trace.RecoveryChosen(
            t_s=now_s,
            task=task.name,
            action=str(action),
            robot=action.robot or "",
            number=event.number,
            failure=event.failure,
            recovery=event.retry,
            reason=event.reason,
        )
    )
    if event.retry:
        tried = task.tried.get(action.id, {})
        tried = {**tried, event.retry: tried.get(event.retry, 0) + 1}
        task = replace(task, tried={**task.tried, action.id: tried})
        state, commands = _begin(with_task(state, task), task, event.number, action, now_s, event.pause_s)
        return state, [chosen, *commands]
    state = let_go(state, lambda number, _: number == event.number)
    state = with_task(state, replace(task, awaited_plans=task.awaited_plans + 1))
    return state, [chosen, ReportOutcome(task=task.name, action=action, outcome=event.outcome)]


def _plan_without(state: State, event: FailureWasReported, now_s: float) -> Step:
    task = state.tasks.get(event.task)
    if task is None:
        return state, []
    if event.excluded is None:
        return _finish(state, task.name, TaskStatus.FAILED, f"{task.trouble}; there is no other way to do it", now_s)
    state, stops = give_up(state, lambda _, running: running.task == task.name and running.action.id in event.abandoned)
    reason = f"{task.trouble}; {event.excluded} is not tried again for this"
    anew = trace.Replanned(t_s=now_s, task=task.name, reason=reason)
    return state, [*stops, Record(event=anew), MakePlan(task=task.name)]


def _adopt(state: State, new: NewKnowledge, now_s: float) -> Step:
    """Another revision comes into force, between two events: never in the middle of one, and actions go on as begun.

    Tasks that are underway go over to it if their programs are the same; queued ones that make no sense under it are
    refused. If a robot or anything else is gone that a task uses, all stays as it is.
    """
    used = _in_use(state, new)
    if used:
        reason = f"revision {new.revision} does not know {used}"
        refused = trace.KnowledgeRefused(t_s=now_s, revision=new.revision, folder=new.folder, reason=reason)
        return state, [Record(event=refused)]
    kind = trace.KnowledgeRolledBack if new.earlier else trace.KnowledgeAccepted
    adopted = kind(t_s=now_s, revision=new.revision, knowledge=new.digest, reason=new.summary)
    commands: list[Command] = [Record(event=adopted), AdoptKnowledge(revision=new.revision)]
    for task in list(state.tasks.values()):
        if task.status is TaskStatus.UNDERWAY:
            state, more = _carry_over(state, task, new, now_s)
        elif task.name in new.unfit:
            state, more = _finish(state, task.name, TaskStatus.REFUSED, new.unfit[task.name], now_s)
        else:
            more = []
        commands += more
    return state, commands


def _in_use(state: State, new: NewKnowledge) -> str:
    """What a task uses of what would be missing, and which task; empty if nothing is."""
    for task in state.tasks.values():
        if task.status is TaskStatus.UNDERWAY:
            leased = {
                r for running in state.running.values() if running.task == task.name for r in running.action.robots
            }
            gone = new.removed & (task.robots | leased | set(task.request.arguments.values()))
            if gone:
                return f"{', '.join(sorted(gone))}, used by {task.name}; let it end, or cancel it"
    return ""


def _carry_over(state: State, task: Task, new: NewKnowledge, now_s: float) -> Step:
    if task.name in new.keeping:
        reason = new.keeping[task.name]
        kept = trace.TaskCarriedOver(t_s=now_s, task=task.name, revision=task.revision, reason=reason)
        return state, [Record(event=kept)]
    reason = "what it may come to is done in the same way"
    over = trace.TaskCarriedOver(t_s=now_s, task=task.name, revision=new.revision, reason=reason)
    state = with_task(state, replace(task, revision=new.revision))
    return state, [Record(event=over), RebaseTask(task=task.name)]


def _finish(state: State, name: str, status: TaskStatus, reason: str, now_s: float) -> Step:
    task = state.tasks.get(name)
    if task is None:
        return state, []
    state, stops = give_up(state, lambda _, running: running.task == name)
    state = replace(state, tasks={n: t for n, t in state.tasks.items() if n != name})
    took_s = round(now_s - task.accepted_s, 9)
    commands: list[Command] = [
        *stops,
        _status(name, status, reason, now_s),
        FinishTask(task=name, status=status, reason=reason, took_s=took_s),
    ]
    return _begin_next(state, commands, now_s) if task.status is TaskStatus.UNDERWAY else (state, commands)


def _status(task: str, status: TaskStatus, reason: str, now_s: float) -> Record:
    return Record(event=trace.TaskStatusChanged(t_s=now_s, task=task, status=status, reason=reason))
