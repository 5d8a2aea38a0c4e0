"""The core of the executive: actions that fail, what is tried then, and goals that have still to end."""

from __future__ import annotations

from dataclasses import replace

from executive import trace
from executive.events import (
    AskPerson,
    CancelAction,
    CancelRequested,
    ChooseRecovery,
    FactWasTold,
    FailureWasReported,
    FinishTask,
    GoalHasEnded,
    GoalWasSent,
    MakePlan,
    PersonAnswered,
    ProcessWasRedone,
    RedoProcess,
    ReportChange,
    ReportOutcome,
    StartAction,
    TaskStatus,
    Tell,
)
from executive.loop import step
from executive.state import State
from kb.history import SourceKind
from kb.recoveries import RecoveryKind
from kb.vocabulary import Property
from planner.plan import PlanStatus
from planner.progress import Abandoned, Begun, Ended, Started
from tests.executive.made import (
    BROKEN,
    GONE,
    SUCCEEDED,
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


# Failures


def test_a_robot_that_is_lost_is_told_of_before_it_is_decided_what_to_do() -> None:
    """The knowledge base and other tasks know then that it does not answer; its own is planned without it, or waits."""
    state, commands = after(requested("one"), planned("one"), ready("one", Started(action=SWEEP)), arrived(1, GONE))
    told = Tell(task="", prop=Property.IS_REACHABLE, subject="r1", value=False, source=SourceKind.CONNECTION)
    assert others(commands) == [
        told,
        ChooseRecovery(number=2, task="one", action=SWEEP, outcome=GONE, tried={}),
    ]
    back = FactWasTold(prop=Property.IS_REACHABLE, subject="r1", value=True, source=SourceKind.CONNECTION)
    _, commands = step(state, back, 5.0)
    assert others(commands) == [ReportChange(task="one", change=back), replace(told, value=True)]


def test_a_failure_frees_the_robot_and_is_planned_around() -> None:
    """Outcome, what to do about it, report, Replanned with the reason, MakePlan."""
    state, commands = after(requested("one"), planned("one"), ready("one", Started(action=SWEEP)), arrived(1, BROKEN))
    assert state.leases == {"r1": 2}, "nobody else takes the robot while it is decided what to do"
    assert others(commands) == [ChooseRecovery(number=2, task="one", action=SWEEP, outcome=BROKEN, tried={})]
    state, commands = step(state, recovered(2), 1.5)
    assert state.leases == {}
    assert others(commands) == [ReportOutcome(task="one", action=SWEEP, outcome=BROKEN)]
    [chosen] = recorded(commands)
    assert isinstance(chosen, trace.RecoveryChosen)
    assert (chosen.failure, chosen.recovery, chosen.reason) == ("UnknownFailure", "", "it is sooner")
    _, commands = step(state, FailureWasReported(task="one", excluded="r1"), 2.0)
    reason = "Sweep(r1) EXECUTION_FAILED: DeviceBroken, it smokes; r1 is not tried again for this"
    assert recorded(commands) == [trace.Replanned(t_s=2.0, task="one", reason=reason)]
    assert others(commands) == [MakePlan(task="one")]


def test_a_failed_action_is_tried_again() -> None:
    """Under a number of its own, after a pause; how often each way was tried is counted until it has succeeded."""
    begun = (requested("one"), planned("one"), ready("one", Started(action=SWEEP)), arrived(1, BROKEN))
    state, commands = after(*begun, recovered(2, "look_again", pause_s=3.0))
    assert others(commands) == [StartAction(number=2, task="one", action=SWEEP, pause_s=3.0)]
    assert [type(event) for event in recorded(commands)] == [trace.RecoveryChosen, trace.ActionReady]
    assert state.leases == {"r1": 2}
    assert step(state, arrived(1), 2.0) == (state, []), "a late reply to the first try"
    failed, commands = step(state, arrived(2, BROKEN), 2.0)
    [choose] = others(commands)
    assert isinstance(choose, ChooseRecovery)
    assert (choose.number, choose.tried) == (3, {"look_again": 1})
    again, _ = step(failed, recovered(3, "wait"), 2.0)
    assert again.tasks["one"].tried == {SWEEP.id: {"look_again": 1, "wait": 1}}
    done, commands = step(again, arrived(3), 3.0)
    assert others(commands) == [ReportOutcome(task="one", action=SWEEP, outcome=SUCCEEDED)]
    assert (done.tasks["one"].tried, done.leases) == ({}, {})


def test_a_process_around_a_failed_action_is_begun_again() -> None:
    """Its robots are free and a plan is awaited; what else ran in it is given up, and its time counts anew."""
    tidy, inner = action("Tidy", "r1"), action("Sweep", "r1", step="task/1/Tidy")
    other = action("Sing", "r2", step="task/1/Tidy")
    begun = ready("one", Begun(action=tidy), Started(action=inner), Started(action=other), running=2)
    chosen = replace(recovered(3, "open_door", RecoveryKind.PROCESS, process="Look"), whole=tidy)
    state, commands = after(
        requested("one"), planned("one", limits_s={tidy.id: 5.0}), begun, arrived(1, BROKEN), chosen
    )
    assert others(commands) == [RedoProcess(task="one", action=inner, whole=tidy, process="Look")]
    [told] = recorded(commands)
    assert isinstance(told, trace.RecoveryChosen)
    assert (told.recovery, told.again) == ("open_door", "Tidy(r1)")
    assert state.leases == {"r2": 2}
    assert state.tasks["one"].tried == {tidy.id: {"open_door": 1}}
    redone = ProcessWasRedone(task="one", whole=tidy, process="Look", abandoned=(other.id,))
    again, commands = step(state, redone, 2.0)
    assert (again.leases, again.tasks["one"].deadlines) == ({}, {})
    reason = "Sweep(r1) EXECUTION_FAILED: DeviceBroken, it smokes; Tidy(r1) begins again after Look"
    assert recorded(commands) == [trace.Replanned(t_s=2.0, task="one", reason=reason)]
    assert others(commands) == [MakePlan(task="one")]
    started, _ = step(again, planned("one"), 2.5)
    once_more, _ = step(started, ready("one", Begun(action=tidy), Started(action=inner), running=1), 2.5)
    _, commands = step(once_more, arrived(4, BROKEN), 3.0)
    [choose] = others(commands)
    assert isinstance(choose, ChooseRecovery)
    assert choose.tried == {"open_door": 1}, "what was tried for the process counts for its actions"
    ended, _ = step(once_more, ready("one", Ended(action=tidy), running=1), 3.0)
    assert ended.tasks["one"].tried == {}


def asked_for_help() -> State:
    """A person is asked for help with the first action."""
    begun = (requested("one"), planned("one"), ready("one", Started(action=SWEEP)), arrived(1, BROKEN))
    state, commands = after(*begun, recovered(2, "ask_person", RecoveryKind.ASK_PERSON))
    question = "one cannot go on: Sweep(r1) EXECUTION_FAILED, it smokes"
    asked = trace.PersonAsked(t_s=1.0, task="one", number=2, question=question, until_s=25.0)
    assert recorded(commands)[1:] == [asked]
    assert others(commands) == [AskPerson(number=2, task="one", question=question, limit_s=24.0)]
    assert state.leases == {"r1": 2}, "the robot waits for the person"
    return state


def test_a_person_who_has_helped_lets_the_action_be_done_again() -> None:
    """It is planned anew, as the world is another one."""
    state, commands = step(asked_for_help(), PersonAnswered(number=2, helped=True, reason="put out"), 9.0)
    answered = trace.PersonHasAnswered(t_s=9.0, task="one", number=2, helped=True, reason="put out")
    assert recorded(commands) == [answered]
    assert others(commands) == [RedoProcess(task="one", action=SWEEP, whole=SWEEP, process="")]
    assert state.leases == {}
    assert step(state, PersonAnswered(number=2, helped=True, reason="again"), 9.0) == (state, [])


def test_a_person_who_does_not_help_leaves_the_other_ways() -> None:
    """What was asked for counts as tried, and as trouble; a second answer leads to nothing."""
    late = PersonAnswered(number=2, helped=False, reason="nobody has answered for 24 s", in_time=False)
    state, commands = step(asked_for_help(), late, 25.0)
    [choose] = others(commands)
    assert choose == ChooseRecovery(number=2, task="one", action=SWEEP, outcome=BROKEN, tried={"ask_person": 1})
    assert state.tasks["one"].trouble.endswith("it smokes; then a person was asked: nobody has answered for 24 s")
    assert state.leases == {"r1": 2}
    assert step(state, PersonAnswered(number=2, helped=True, reason="late"), 26.0) == (state, [])


def test_what_is_no_longer_wanted_is_not_tried_again() -> None:
    """It was given up, or its task has ended, while it was decided what to do."""
    failed, _ = after(requested("one"), planned("one"), ready("one", Started(action=SWEEP)), arrived(1, BROKEN))
    given_up, _ = step(failed, ready("one", Abandoned(action=SWEEP), running=1), 2.0)
    canceled, _ = step(failed, CancelRequested(task="one"), 2.0)
    for state in (given_up, canceled):
        assert state.leases == {}
        assert step(state, recovered(2, "retry"), 3.0) == (state, [])
    canceled, _ = step(asked_for_help(), CancelRequested(task="one"), 2.0)
    assert step(canceled, PersonAnswered(number=2, helped=True, reason="done"), 3.0) == (canceled, [])
    gone = ProcessWasRedone(task="one", whole=SWEEP, process="", abandoned=())
    assert step(canceled, gone, 3.0) == (canceled, [])


def test_an_overdue_action_is_not_tried_again() -> None:
    """The time of the process around it has run out meanwhile: that is the failure then."""
    tidy, inner = action("Tidy", "r1"), action("Sweep", "r1", step="task/1/Tidy/2")
    begun = ready("one", Begun(action=tidy), Started(action=inner), running=1)
    failed, _ = after(requested("one"), planned("one", limits_s={tidy.id: 5.0}), begun, arrived(1, BROKEN))
    _, commands = step(failed, recovered(2, "retry"), 6.5)
    [choose] = others(commands)
    assert isinstance(choose, ChooseRecovery)
    assert choose.outcome.failure == "TookTooLong"


def test_without_another_way_the_task_fails_with_all_that_went_wrong() -> None:
    """Two failures one after the other are both in the reason; what still runs is let go of."""
    state, commands = after(
        requested("one"),
        planned("one"),
        ready("one", Started(action=SWEEP), Started(action=MOP)),
        arrived(1, BROKEN),
        recovered(3),
        FailureWasReported(task="one", excluded="r1"),
        planned("one"),
        ready("one", Started(action=THINK)),
        arrived(2, BROKEN),
        recovered(5),
        FailureWasReported(task="one", excluded=None),
    )
    trouble = "EXECUTION_FAILED: DeviceBroken, it smokes"
    reason = f"Sweep(r1) {trouble}; then Mop(r2) {trouble}; there is no other way to do it"
    assert others(commands) == [FinishTask(task="one", status=TaskStatus.FAILED, reason=reason, took_s=0.0)]
    assert state == State(next_number=6)


def test_no_plan_after_a_failure_fails_the_task_with_the_failure_first() -> None:
    """It is no refusal any more, as something was begun."""
    _, commands = after(
        requested("one"),
        planned("one"),
        ready("one", Started(action=SWEEP)),
        arrived(1, BROKEN),
        recovered(2),
        FailureWasReported(task="one", excluded="r1"),
        planned("one", PlanStatus.UNSOLVABLE_PROVEN),
    )
    [finish] = others(commands)
    assert isinstance(finish, FinishTask)
    assert finish.status is TaskStatus.FAILED
    assert finish.reason == (
        "Sweep(r1) EXECUTION_FAILED: DeviceBroken, it smokes; the program has no execution; r1 lacks a broom"
    )


# Composite steps that take too long


def test_an_overdue_composite_gives_its_next_action_up() -> None:
    """Its next action fails with TookTooLong instead of being started; actions of others go on."""
    tidy, inner = action("Tidy", "r1"), action("Sweep", "r1", step="task/1/Tidy/2")
    state, _ = after(
        requested("one"), planned("one", limits_s={tidy.id: 5.0}), ready("one", Begun(action=tidy), running=1)
    )
    _, commands = step(state, ready("one", Started(action=inner)), 6.0)
    assert others(commands) == [StartAction(number=1, task="one", action=inner)], "in time, to the last moment"
    late, commands = step(state, ready("one", Started(action=inner), Started(action=MOP)), 6.5)
    choose, start = others(commands)
    assert isinstance(choose, ChooseRecovery)
    assert choose.outcome.failure == "TookTooLong"
    assert choose.outcome.reason == "Tidy(r1) has not ended after 5.0 s, which is all the time it has"
    assert start == StartAction(number=3, task="one", action=MOP)
    assert late.leases == {"r1": 2, "r2": 3}
    assert "TIMED_OUT: TookTooLong" in late.tasks["one"].trouble


def test_a_composite_that_has_ended_has_no_deadline() -> None:
    """A later turn of the same step counts from its own beginning."""
    tidy, inner = action("Tidy", "r1"), action("Sweep", "r1", step="task/1/Tidy/2")
    limits = planned("one", limits_s={tidy.id: 5.0})
    state, _ = after(
        requested("one"),
        limits,
        ready("one", Begun(action=tidy), running=1),
        ready("one", Ended(action=tidy), running=1),
    )
    assert state.tasks["one"].deadlines == {}
    state, _ = step(state, ready("one", Begun(action=tidy), running=1), 8.0)
    _, commands = step(state, ready("one", Started(action=inner)), 12.0)
    assert others(commands) == [StartAction(number=1, task="one", action=inner)]


# Goals: robots go on with them until they are told not to


def test_the_goal_of_a_canceled_task_is_canceled_and_its_robot_is_not_free_before_it_has_ended() -> None:
    """What the next task wants of the robot waits; of another robot it does not."""
    begun = (requested("one"), requested("two"), planned("one"), ready("one", Started(action=SWEEP)))
    state, commands = after(*begun, GoalWasSent(number=1), CancelRequested(task="one"))
    assert others(commands)[0] == CancelAction(number=1)
    assert state.leases == {}
    state, commands = step(state, ready("two", Started(action=SWEEP), Started(action=MOP)), 2.0)
    assert others(commands) == [StartAction(number=3, task="two", action=MOP)]
    state, commands = step(state, GoalHasEnded(number=1), 3.0)
    assert others(commands) == [StartAction(number=2, task="two", action=SWEEP)]
    assert step(state, GoalHasEnded(number=1), 4.0) == (state, [])


def test_an_action_that_waited_for_its_robot_and_is_not_wanted_any_more_never_starts() -> None:
    """Its task is canceled too."""
    begun = (requested("one"), requested("two"), planned("one"), ready("one", Started(action=SWEEP)))
    state, _ = after(*begun, GoalWasSent(number=1), CancelRequested(task="one"), ready("two", Started(action=SWEEP)))
    state, commands = step(state, CancelRequested(task="two"), 2.0)
    assert not [c for c in commands if isinstance(c, CancelAction | StartAction)]
    assert step(state, GoalHasEnded(number=1), 3.0)[1] == []


def test_abandoned_goals_are_canceled_and_services_are_not() -> None:
    """A service ends by itself."""
    begun = (requested("one"), planned("one"), ready("one", Started(action=SWEEP), Started(action=MOP)))
    state, _ = after(*begun, GoalWasSent(number=1))
    _, commands = step(state, ready("one", Abandoned(action=SWEEP), Abandoned(action=MOP), running=1), 2.0)
    assert others(commands) == [CancelAction(number=1)]
    _, commands = step(state, FailureWasReported(task="one", excluded="r1", abandoned=(SWEEP.id, MOP.id)), 2.0)
    assert others(commands) == [CancelAction(number=1), MakePlan(task="one")]


def test_a_goal_that_nobody_wants_when_it_was_sent_is_canceled() -> None:
    """Its task ended in the same moment."""
    begun = (requested("one"), planned("one"), ready("one", Started(action=SWEEP)))
    _, commands = after(*begun, CancelRequested(task="one"), GoalWasSent(number=1))
    assert commands == [CancelAction(number=1)]
