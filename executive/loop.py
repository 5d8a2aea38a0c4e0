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
again, or to 4, where a process around it is begun again or the rest is planned without what has failed
(executive/acting.py).

`step` is the whole of it: a pure function from a state and an event to the next state and the commands
to carry out. It reads no clock and does no I/O; executive/shell.py carries the commands out and feeds
what comes of them back as events, one at a time.
"""

from __future__ import annotations

from dataclasses import replace
from typing import assert_never

from executive import trace
from executive.acting import (
    begin_again,
    free,
    note_goal,
    plan_without,
    recover,
    start_action,
    take_answer,
    take_outcome,
    told_to_all,
)
from executive.events import (
    ActionsAreReady,
    AdoptKnowledge,
    AskActions,
    CancelRequested,
    Command,
    CompileProgram,
    Event,
    FactWasTold,
    FailureWasReported,
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
    PersonAnswered,
    PlanWasMade,
    ProcessWasRedone,
    ProgramWasCompiled,
    RebaseTask,
    Record,
    RecoveryWasChosen,
    Requested,
    SolveGoal,
    TaskStatus,
    Tell,
)
from executive.queue import begin_next, finish, status_changed
from executive.state import State, Step, Task, give_up, with_task
from kb.history import SourceKind
from kb.terms import Action
from planner.progress import Abandoned, Begun, Ended, Started, StepEvent, Told


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
            return take_outcome(state, event, now_s)
        case RecoveryWasChosen():
            return recover(state, event, now_s)
        case PersonAnswered():
            return take_answer(state, event, now_s)
        case ProcessWasRedone():
            return begin_again(state, event, now_s)
        case FailureWasReported():
            return plan_without(state, event, now_s)
        case FactWasTold():
            return state, told_to_all(state, event)
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
            return note_goal(state, number)
        case GoalHasEnded(number=number):
            return free(state, number)
        case CancelRequested(task=task):
            return finish(state, task, TaskStatus.CANCELED, "canceled by request", now_s)
        case _:
            assert_never(event)


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
    commands: list[Command] = [Record(event=accepted), status_changed(task.name, TaskStatus.QUEUED, reason, now_s)]
    return (state, commands) if ahead else begin_next(state, commands, now_s)


def _take_goal(state: State, event: GoalWasSolved, now_s: float) -> Step:
    """What leads to a goal is a process from here on; without steps, there is nothing to do or nothing to be done."""
    plan, name = event.plan, event.task
    if name not in state.tasks:
        return state, []
    if plan.program is None:
        failed = trace.PlanFailed(t_s=now_s, task=name, status=plan.status, reason=plan.reason)
        state, ending = finish(state, name, TaskStatus.REFUSED, plan.reason, now_s)
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
    state, ending = finish(state, name, TaskStatus.COMPLETED, plan.reason, now_s)
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
    state, commands = finish(state, task.name, status, reason, now_s)
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
        state, ending = finish(state, event.task, TaskStatus.COMPLETED, "everything asked for is done", now_s)
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
        state, ending = finish(state, event.task, TaskStatus.FAILED, reason, now_s)
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
            deadlines = {i: d for i, d in task.deadlines.items() if i != action.id}
            state = with_task(state, replace(task.with_success(action.id), deadlines=deadlines))
            return state, [Record(event=ended)]
        case Told():
            by = source or SourceKind.PERSON
            told = Tell(task=name, prop=happened.prop, subject=happened.subject, value=happened.value, source=by)
            return state, [told]
        case Started(action=action):
            return start_action(state, task, action, now_s)
        case Abandoned(action=action):
            given_up = [n for n, r in state.running.items() if r.task == name and r.action.id == action.id]
            return give_up(state, lambda number, _: number in given_up)
        case _:
            assert_never(happened)


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
            state, more = finish(state, task.name, TaskStatus.REFUSED, new.unfit[task.name], now_s)
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
