"""What another revision of the knowledge means for tasks that have not ended: whether they go over, and their plans."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass

from executive.events import NewKnowledge, TaskStatus
from executive.goals import check_goal
from executive.request import TaskRequest, check_request
from kb.difference import concerned, program_changed
from kb.errors import ConcertmasterError
from kb.store import Proposal, Snapshot
from planner.plan import Plan
from planner.planner import Session


@dataclass(frozen=True, slots=True, kw_only=True)
class Unfinished:
    """A task that has not ended.

    Attributes:
        snapshot: What it is done under; None as long as it is queued.
        session: What is left of it, as the planner knows it; None as long as it has no program.
    """

    name: str
    status: TaskStatus
    request: TaskRequest
    snapshot: Snapshot | None
    session: Session | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Forecast:
    """How a task would end.

    Attributes:
        makespan_s: From now, for what is left of it; None if it could not be done, or is not known.
        steps: Each step of the plan with the robot that does it, in order.
        reason: Why it could not be done, or is not known.
    """

    makespan_s: float | None
    steps: tuple[tuple[str, str], ...] = ()
    reason: str = ""

    @property
    def text(self) -> str:
        """A clause for people."""
        if self.makespan_s is None:
            return self.reason
        robots = sorted({robot for robot, _ in self.steps if robot})
        return f"{self.makespan_s:.2f} s" + (f" by {', '.join(robots)}" if robots else "")


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskEffect:
    """What a revision changes for a task."""

    task: str
    before: Forecast
    after: Forecast

    @property
    def text(self) -> str:
        """A sentence for people."""
        if self.before == self.after:
            return f"{self.task}: {self.before.text}, as before"
        others = [step for step in self.after.steps if step not in self.before.steps]
        told = f"{self.task}: {self.before.text} before, {self.after.text} then"
        return told + "".join(f"; {robot or 'a service'} does {step}" for robot, step in others)


Plans = Callable[[Session, Snapshot], tuple[Plan, tuple[str, ...]]]
"""Plans what a session has left, under a snapshot; with what robots lack, if there is no plan."""


def new_knowledge(proposal: Proposal, tasks: Sequence[Unfinished], effects: Sequence[TaskEffect]) -> NewKnowledge:
    """A proposal as far as the tasks that have not ended are concerned."""
    keeping, unfit = dict[str, str](), dict[str, str]()
    for task in tasks:
        if task.snapshot is None:
            why = _senseless(task.request, proposal.snapshot)
            unfit |= {task.name: f"revision {proposal.revision.number}: {why}"} if why else {}
        else:
            why = _keeps(task, task.snapshot, proposal)
            keeping |= {task.name: why} if why else {}
    return NewKnowledge(
        revision=proposal.revision.number,
        digest=proposal.revision.digest,
        folder="" if proposal.earlier else str(proposal.revision.folder),
        summary=proposal.difference.summary,
        changes=(*proposal.difference.lines, *proposal.carry.sentences, *(e.text for e in effects)),
        earlier=proposal.earlier,
        removed=frozenset(proposal.difference.individuals_removed),
        keeping=keeping,
        unfit=unfit,
    )


def _keeps(task: Unfinished, own: Snapshot, proposal: Proposal) -> str:
    """Why a task that is underway finishes under the revision it has; empty if it goes over."""
    if task.request.goal is not None or task.session is None:
        return "what leads to its goal was found under this revision"
    if own.revision != proposal.base.key:
        return f"it has kept revision {own.number} before"
    changed = program_changed(task.request.process, proposal.base, proposal.revision)
    if changed:
        return f"the program of {changed} is another one in revision {proposal.revision.number}"
    return _senseless(task.request, proposal.snapshot)


def _senseless(request: TaskRequest, snapshot: Snapshot) -> str:
    """Why a request makes no sense under a snapshot; empty if it does."""
    try:
        if request.goal is not None:
            check_goal(request.goal.text, snapshot)
        else:
            check_request(request.process, request.arguments, request.robots, snapshot)
    except ConcertmasterError as error:
        return str(error)
    return ""


def effects_on(
    tasks: Sequence[Unfinished], now: Snapshot, proposal: Proposal, plans: Plans, *, now_s: float
) -> tuple[TaskEffect, ...]:
    """Plan each task under what is in force, and under what is proposed where that matters to it; no plan is kept.

    Args:
        now: What is known now.
    """
    effects = []
    for task in tasks:
        if task.request.goal is not None and task.session is None:
            later = Forecast(makespan_s=None, reason="not known, as a goal is solved when its turn comes")
            effects.append(TaskEffect(task=task.name, before=later, after=later))
            continue
        if task.session is None or task.snapshot is None:
            before = _queued(task, now, plans, now_s)
            same = _same_plan(task.request, now, proposal)
            after = before if same else _queued(task, proposal.snapshot, plans, now_s)
        else:
            before = _left(task.name, task.session, task.snapshot, (), plans, now_s)
            same = bool(_keeps(task, task.snapshot, proposal)) or _same_plan(task.request, task.snapshot, proposal)
            forgotten = tuple(proposal.carry.dropped)
            after = before if same else _left(task.name, task.session, proposal.snapshot, forgotten, plans, now_s)
        effects.append(TaskEffect(task=task.name, before=before, after=after))
    return tuple(effects)


def _same_plan(request: TaskRequest, now: Snapshot, proposal: Proposal) -> bool:
    """Whether nothing that plans for a request rest on is different."""
    if _senseless(request, now) or _senseless(request, proposal.snapshot):
        return False
    task, old, new = request.process, proposal.base, proposal.revision
    return not program_changed(task, old, new) and not concerned(task, old, new, proposal.carry.changed)


def _queued(task: Unfinished, snapshot: Snapshot, plans: Plans, now_s: float) -> Forecast:
    why = _senseless(task.request, snapshot)
    if why:
        return Forecast(makespan_s=None, reason=f"refused ({why})")
    key, request = f"{task.name}?{snapshot.revision}", task.request
    session = Session(key, snapshot, request.process, request.arguments, robots=request.robots, now_s=now_s)
    with closing(session):
        return _forecast(*plans(session, snapshot))


def _left(
    name: str,
    session: Session,
    snapshot: Snapshot,
    forgotten: tuple[tuple[str, str], ...],
    plans: Plans,
    now_s: float,
) -> Forecast:
    with closing(session.fork(f"{name}?{snapshot.revision}", snapshot, forgotten=forgotten, now_s=now_s)) as copy:
        return _forecast(*plans(copy, snapshot))


def _forecast(plan: Plan, lacking: tuple[str, ...]) -> Forecast:
    if not plan.solved:
        return Forecast(makespan_s=None, reason=f"no plan ({'; '.join([plan.reason, *lacking])})")
    steps = tuple((s.action.robot or "", str(s.action)) for s in plan.steps)
    return Forecast(makespan_s=round(plan.makespan_s, 3), steps=steps)
