"""The queue of tasks: which one is underway, and how one ends."""

from __future__ import annotations

from dataclasses import replace

from executive import trace
from executive.events import Command, FinishTask, ReadKnowledge, Record, TaskStatus
from executive.state import State, Step, give_up


def begin_next(state: State, commands: list[Command], now_s: float) -> Step:
    """The fleet is free: the task that has waited longest goes on to stage 2."""
    for task in state.tasks.values():
        underway = replace(task, status=TaskStatus.UNDERWAY)
        commands += [
            status_changed(task.name, TaskStatus.UNDERWAY, "the fleet is free", now_s),
            ReadKnowledge(task=task.name, request=task.request),
        ]
        return replace(state, tasks={**state.tasks, task.name: underway}), commands
    return state, commands


def finish(state: State, name: str, status: TaskStatus, reason: str, now_s: float) -> Step:
    """A task has ended: what it runs is given up, and the next one is underway."""
    task = state.tasks.get(name)
    if task is None:
        return state, []
    state, stops = give_up(state, lambda _, running: running.task == name)
    state = replace(state, tasks={n: t for n, t in state.tasks.items() if n != name})
    took_s = round(now_s - task.accepted_s, 9)
    commands: list[Command] = [
        *stops,
        status_changed(name, status, reason, now_s),
        FinishTask(task=name, status=status, reason=reason, took_s=took_s),
    ]
    return begin_next(state, commands, now_s) if task.status is TaskStatus.UNDERWAY else (state, commands)


def status_changed(task: str, status: TaskStatus, reason: str, now_s: float) -> Record:
    """Where a task is in its life from now on."""
    return Record(event=trace.TaskStatusChanged(t_s=now_s, task=task, status=status, reason=reason))
