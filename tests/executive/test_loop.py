"""The core of the executive, one event at a time: what each leads to."""

from __future__ import annotations

import pytest

from executive import trace
from executive.events import (
    ActionsAreReady,
    AskActions,
    CancelRequested,
    CompileProgram,
    FactWasTold,
    FailureWasReported,
    FinishTask,
    KnowledgeWasRead,
    MakePlan,
    ProgramWasCompiled,
    ReadKnowledge,
    ReportChange,
    ReportOutcome,
    StartAction,
    TaskStatus,
    Tell,
)
from executive.loop import step
from executive.state import State
from kb.errors import InternalError
from kb.history import SourceKind
from planner.plan import PlanStatus
from planner.progress import Abandoned, Begun, Ended, Progress, Started, StepEvent, Told
from tests.executive.made import (
    BROKEN,
    action,
    after,
    arrived,
    others,
    planned,
    ready,
    recorded,
    recovered,
    requested,
)

SWEEP, MOP = action("Sweep", "r1"), action("Mop", "r2")
THINK = action("Think")


def statuses(events: list[trace.TraceEvent]) -> list[tuple[str, str, str]]:
    """Which task has which status now, and why."""
    return [(e.task, e.status, e.reason) for e in events if isinstance(e, trace.TaskStatusChanged)]


# Stages 1 to 5


def test_the_first_request_begins_at_once() -> None:
    """A free fleet takes it underway and reads knowledge."""
    state, commands = after(requested("one"))
    accepted, *_ = recorded(commands)
    assert isinstance(accepted, trace.TaskAccepted)
    assert (accepted.task, accepted.process, accepted.arguments, accepted.robots) == (
        "one",
        "Tidy",
        {"room": "attic"},
        2,
    )
    assert statuses(recorded(commands)) == [("one", "queued", "is next"), ("one", "underway", "the fleet is free")]
    assert others(commands) == [ReadKnowledge(task="one", request=requested("one").request)]
    assert state.tasks["one"].status is TaskStatus.UNDERWAY


def test_further_requests_queue_in_order_and_say_for_whom_they_wait() -> None:
    """Nothing is begun for them."""
    state, commands = after(requested("one"), requested("two"), requested("three"))
    assert statuses(recorded(commands)) == [("three", "queued", "waits for one, two")]
    assert others(commands) == []
    assert [task.status.value for task in state.tasks.values()] == ["underway", "queued", "queued"]


def test_knowledge_leads_to_the_program_and_that_to_the_plan() -> None:
    """Stages 2 to 4 follow one another, each recorded."""
    state, commands = after(requested("one"), KnowledgeWasRead(task="one", facts_told=3))
    assert recorded(commands) == [trace.KnowledgeRead(t_s=1.0, task="one", facts_told=3)]
    assert others(commands) == [CompileProgram(task="one")]
    _, commands = step(state, ProgramWasCompiled(task="one", program="proc(tidy,[])"), 2.0)
    assert recorded(commands) == [trace.ProgramCompiled(t_s=2.0, task="one", program="proc(tidy,[])")]
    assert others(commands) == [MakePlan(task="one")]


def test_a_plan_is_recorded_and_leads_to_actions() -> None:
    """Steps are shown as [action, robot, start, end]."""
    _, commands = after(requested("one"), planned("one"))
    [made] = recorded(commands)
    assert isinstance(made, trace.PlanMade)
    assert made.steps == [("Sweep(r1)", "r1", 1.0, 3.0)]
    assert (made.status, made.makespan_s, made.lower_bound_s) == ("SOLVED_OPTIMALLY", 2.0, 2.0)
    assert others(commands) == [AskActions(task="one")]


def test_no_plan_for_a_fresh_task_refuses_it_and_says_who_lacks_what() -> None:
    """Nothing was begun, so it is a refusal; the next task begins."""
    state, commands = after(requested("one"), requested("two"), planned("one", PlanStatus.UNSOLVABLE_PROVEN))
    reason = "the program has no execution; r1 lacks a broom"
    assert recorded(commands)[0] == trace.PlanFailed(t_s=1.0, task="one", status="UNSOLVABLE_PROVEN", reason=reason)
    finish, read = others(commands)
    assert finish == FinishTask(task="one", status=TaskStatus.REFUSED, reason=reason, took_s=0.0)
    assert read == ReadKnowledge(task="two", request=requested("two").request)
    assert list(state.tasks) == ["two"]


# Leases


def test_a_started_action_leases_its_robot_until_its_outcome() -> None:
    """The lease is held by number and released when the outcome arrives, which is reported."""
    state, commands = after(requested("one"), planned("one"), ready("one", Started(action=SWEEP), Started(action=MOP)))
    assert others(commands) == [
        StartAction(number=1, task="one", action=SWEEP),
        StartAction(number=2, task="one", action=MOP),
    ]
    assert state.leases == {"r1": 1, "r2": 2}
    state, commands = step(state, arrived(1), 2.0)
    assert state.leases == {"r2": 2}
    assert list(state.running) == [2]
    [finished] = recorded(commands)
    assert isinstance(finished, trace.ActionFinished)
    assert (finished.number, finished.outcome, finished.planned_s, finished.elapsed_s) == (1, "SUCCEEDED", 0.4, 0.5)
    [report] = others(commands)
    assert isinstance(report, ReportOutcome)
    assert report.action == SWEEP


def test_an_action_of_two_robots_leases_both() -> None:
    """Neither does anything else until the outcome, which releases both."""
    carry = action("Carry", "r1", "r2")
    state, _ = after(requested("one"), planned("one"), ready("one", Started(action=carry)))
    assert state.leases == {"r1": 1, "r2": 1}
    with pytest.raises(InternalError, match="r2 is still busy"):
        step(state, ready("one", Started(action=MOP)), 2.0)
    state, _ = step(state, arrived(1), 2.0)
    assert state.leases == {}


def test_an_action_without_a_robot_needs_no_lease() -> None:
    """Two of them may run at once."""
    state, _ = after(requested("one"), planned("one"), ready("one", Started(action=THINK), Started(action=THINK)))
    assert state.leases == {}
    assert list(state.running) == [1, 2]


def test_starting_on_a_leased_robot_is_our_mistake() -> None:
    """InternalError names the robot."""
    state, _ = after(requested("one"), planned("one"), ready("one", Started(action=SWEEP)))
    with pytest.raises(InternalError, match=r"Sweep\(r1\) is to start, but r1 is still busy"):
        step(state, ready("one", Started(action=SWEEP)), 2.0)


def test_numbers_are_never_used_again() -> None:
    """Also not after the actions have ended."""
    state, _ = after(requested("one"), planned("one"), ready("one", Started(action=SWEEP)), arrived(1))
    state, commands = step(state, ready("one", Started(action=SWEEP)), 2.0)
    assert others(commands) == [StartAction(number=2, task="one", action=SWEEP)]


@pytest.mark.parametrize("number", [1, 99])
def test_a_late_or_unknown_outcome_leads_to_nothing(number: int) -> None:
    """State and commands stay as they are."""
    state, _ = after(requested("one"), planned("one"), ready("one", Started(action=SWEEP)), arrived(1))
    assert step(state, arrived(number), 5.0) == (state, [])


# What the planner tells along the way


def test_effects_and_composites_are_passed_on_in_order() -> None:
    """Begun, told, ended; no action needs to start for them."""
    tidy = action("Tidy", "r1")
    told = Told(prop="isClean", subject="attic", value=True)
    _, commands = after(
        requested("one"), planned("one"), ready("one", Begun(action=tidy), told, Ended(action=tidy), running=1)
    )
    begun, ended = recorded(commands)
    assert begun == trace.ProcessBegun(t_s=1.0, task="one", process="Tidy(r1)", robot="r1")
    assert ended == trace.ProcessEnded(t_s=1.0, task="one", process="Tidy(r1)", robot="r1")
    assert others(commands) == [Tell(task="one", prop="isClean", subject="attic", value=True, source=tidy)]


def test_nothing_left_completes_the_task() -> None:
    """It took from its acceptance to now."""
    state, _ = after(requested("one"), planned("one"))
    state, commands = step(state, ready("one", done=True), 3.5)
    assert state == State(next_number=1)
    reason = "everything asked for is done"
    assert others(commands) == [FinishTask(task="one", status=TaskStatus.COMPLETED, reason=reason, took_s=2.5)]
    assert statuses(recorded(commands)) == [("one", "completed", reason)]


def test_a_program_that_can_neither_go_on_nor_end_fails() -> None:
    """Nothing runs, nothing starts, something remains."""
    _, commands = after(requested("one"), planned("one"), ready("one"))
    [finish] = others(commands)
    assert isinstance(finish, FinishTask)
    assert (finish.status, finish.reason) == (TaskStatus.FAILED, "the program can neither go on nor end")


def test_while_a_new_plan_is_awaited_nothing_running_is_no_dead_end() -> None:
    """The last other action ends just after a failure, and before the plan that gets around it is there."""
    state, _ = after(
        requested("one"),
        planned("one"),
        ready("one", Started(action=SWEEP), Started(action=MOP)),
        arrived(1, BROKEN),
        recovered(3),
        FailureWasReported(task="one", excluded="r1"),
        arrived(2),
        ready("one"),
    )
    assert state.tasks["one"].status is TaskStatus.UNDERWAY
    state, commands = step(state, planned("one"), 2.0)
    assert others(commands) == [AskActions(task="one")]
    _, commands = step(state, ready("one"), 2.0)
    [finish] = others(commands)
    assert isinstance(finish, FinishTask)
    assert finish.reason.startswith("Sweep(r1) EXECUTION_FAILED: DeviceBroken, it smokes; the program can neither")


# Changes

MOVED = FactWasTold(prop="standsAt", subject="broom", value="attic")


def replanning(task: str, *happened: StepEvent, running: int) -> ActionsAreReady:
    """The planner says that its plan was made for something else."""
    progress = Progress(events=happened, done=False, running=running, replan=True)
    return ActionsAreReady(task=task, progress=progress, change="standsAt(broom) is attic now")


def test_a_change_is_told_to_knowledge_and_to_the_task_underway() -> None:
    """Queued tasks begin with what is so by then."""
    state, _ = after(requested("one"), requested("two"))
    told = Tell(task="", prop="standsAt", subject="broom", value="attic", source=SourceKind.PERSON)
    assert step(state, MOVED, 2.0) == (state, [ReportChange(task="one", change=MOVED), told])
    idle = State()
    assert step(idle, MOVED, 2.0) == (idle, [told])


def test_a_change_that_matters_is_planned_around() -> None:
    """What is abandoned frees its robot, what runs goes on; the trace says which change it was."""
    state, _ = after(requested("one"), planned("one"), ready("one", Started(action=SWEEP), Started(action=MOP)), MOVED)
    state, commands = step(state, replanning("one", Abandoned(action=SWEEP), running=1), 2.0)
    assert [r.action for r in state.running.values()] == [MOP]
    assert list(state.leases.values()) == [2]
    reason = "standsAt(broom) is attic now, for which the plan was not made"
    assert recorded(commands) == [trace.Replanned(t_s=2.0, task="one", reason=reason)]
    assert others(commands) == [MakePlan(task="one")]
    _, commands = step(state, planned("one"), 3.0)
    assert others(commands) == [AskActions(task="one")]


def test_that_there_was_no_plan_before_a_change_says_nothing_of_after() -> None:
    """The plan that takes the change in decides."""
    state, _ = after(requested("one"), MOVED, replanning("one", running=0))
    state, commands = step(state, planned("one", PlanStatus.UNSOLVABLE_PROVEN), 2.0)
    assert commands == []
    _, commands = step(state, planned("one"), 3.0)
    assert others(commands) == [AskActions(task="one")]
    _, commands = step(state, planned("one", PlanStatus.UNSOLVABLE_PROVEN), 3.0)
    assert isinstance(others(commands)[0], FinishTask)


# Cancel


def test_canceling_the_task_underway_frees_its_robots_and_begins_the_next() -> None:
    """Replies still to come lead to nothing."""
    state, commands = after(
        requested("one"),
        requested("two"),
        planned("one"),
        ready("one", Started(action=SWEEP)),
        CancelRequested(task="one"),
    )
    assert statuses(recorded(commands)) == [
        ("one", "canceled", "canceled by request"),
        ("two", "underway", "the fleet is free"),
    ]
    assert (state.leases, state.running) == ({}, {})
    assert step(state, arrived(1), 2.0) == (state, [])


def test_canceling_a_queued_task_leaves_the_others_alone() -> None:
    """The one underway keeps its lease, the queue its order."""
    state, commands = after(
        requested("one"),
        requested("two"),
        requested("three"),
        planned("one"),
        ready("one", Started(action=SWEEP)),
        CancelRequested(task="two"),
    )
    assert [type(command) for command in others(commands)] == [FinishTask]
    assert state.leases == {"r1": 1}
    assert list(state.tasks) == ["one", "three"]


@pytest.mark.parametrize(
    "event",
    [
        KnowledgeWasRead(task="one", facts_told=0),
        ProgramWasCompiled(task="one", program=""),
        planned("one"),
        ready("one", Started(action=SWEEP)),
        FailureWasReported(task="one", excluded="r1"),
        FailureWasReported(task="one", excluded=None),
        CancelRequested(task="one"),
    ],
    ids=lambda event: type(event).__name__,
)
def test_what_comes_after_the_end_of_a_task_leads_to_nothing(event: object) -> None:
    """The other task is not disturbed."""
    state, _ = after(requested("one"), requested("two"), CancelRequested(task="one"))
    assert step(state, event, 9.0) == (state, [])  # type: ignore[arg-type]
