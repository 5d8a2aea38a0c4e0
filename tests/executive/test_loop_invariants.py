"""What holds in the core of the executive whatever happens in whatever order."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from executive import events, loop
from executive.state import State
from executive.trace import ActionReady, TaskStatusChanged
from kb.errors import InternalError
from planner.plan import PlanStatus
from planner.progress import Begun, Ended, Started, StepEvent
from tests.executive.made import BROKEN, SUCCEEDED, action, arrived, planned, ready, requested

TASKS = ("one", "two", "three")
TEAMS = (("r1",), ("r2",), ("r3",), ("r2", "r3"), ())
ACTIONS = [action(process, *team) for process in ("Sweep", "Mop") for team in TEAMS]

tasks = st.sampled_from(TASKS)
step_events: st.SearchStrategy[StepEvent] = st.one_of(
    st.builds(Started, action=st.sampled_from(ACTIONS)),
    st.builds(Begun, action=st.sampled_from(ACTIONS)),
    st.builds(Ended, action=st.sampled_from(ACTIONS)),
)
random_events: st.SearchStrategy[events.Event] = st.one_of(
    st.builds(events.KnowledgeWasRead, task=tasks, facts_told=st.just(0)),
    st.builds(events.ProgramWasCompiled, task=tasks, program=st.just("")),
    st.builds(lambda task: planned(task, limits_s={ACTIONS[0].id: 2.0}), tasks),
    st.builds(planned, tasks, st.sampled_from(PlanStatus)),
    st.builds(
        lambda task, happened, done, running: ready(task, *happened, done=done, running=running),
        tasks,
        st.lists(step_events, max_size=3),
        st.sampled_from([False, False, False, True]),
        st.integers(0, 2),
    ),
    st.builds(arrived, st.integers(1, 6), st.sampled_from([SUCCEEDED, BROKEN])),
    st.builds(events.FailureWasReported, task=tasks, excluded=st.sampled_from(["r1", None])),
    st.builds(events.CancelRequested, task=tasks),
    st.builds(events.GoalWasSent, number=st.integers(1, 6)),
    st.builds(events.GoalHasEnded, number=st.integers(1, 6)),
    st.builds(
        lambda removed, keeping, unfit: events.KnowledgeWasAccepted(
            knowledge=events.NewKnowledge(
                revision=2,
                digest="",
                folder="",
                summary="",
                changes=(),
                earlier=False,
                removed=removed,
                keeping=dict.fromkeys(keeping, "another program"),
                unfit=dict.fromkeys(unfit, "no sense"),
            )
        ),
        st.frozensets(st.sampled_from(["r1", "r2", "attic"]), max_size=1),
        st.sets(tasks),
        st.sets(tasks),
    ),
)
REQUESTS: list[events.Event] = [requested(task) for task in TASKS]
histories = st.lists(random_events, max_size=30).flatmap(
    lambda later: st.permutations(REQUESTS).map(lambda r: r + later)
)


def fold(history: list[events.Event]) -> list[tuple[State, list[events.Command]]]:
    """State and commands after each event; one that would start on a leased robot is left out."""
    state, steps = State(), []
    for index, event in enumerate(history):
        try:
            state, commands = loop.step(state, event, float(index))
        except InternalError:
            assert starts_on_a_leased_robot(state, event)
            continue
        steps.append((state, commands))
    return steps


def starts_on_a_leased_robot(state: State, event: events.Event) -> bool:
    """Whether an event has an action start on a robot that is leased, or two of them on one."""
    assert isinstance(event, events.ActionsAreReady)
    robots = [robot for e in event.progress.events if isinstance(e, Started) for robot in e.action.robots]
    return len(set(robots)) < len(robots) or not state.leases.keys().isdisjoint(robots)


def task_of(command: events.Command) -> str:
    """The task that a command is about; empty if it is about none."""
    about = command.event if isinstance(command, events.Record) else command
    return getattr(about, "task", "")


@settings(max_examples=300, deadline=None)
@given(histories)
def test_running_actions_and_leases_always_agree(history: list[events.Event]) -> None:
    """Robots are leased to one running action that is theirs; each running action belongs to a living task."""
    for state, _ in fold(history):
        holders = [(robot, number) for number, r in state.running.items() for robot in r.action.robots]
        assert sorted(holders) == sorted(state.leases.items())
        assert {running.task for running in state.running.values()} <= set(state.tasks)
        assert all(number < state.next_number for number in state.running)


@settings(max_examples=300, deadline=None)
@given(histories)
def test_one_task_is_underway_and_it_is_the_first(history: list[events.Event]) -> None:
    """As long as there are tasks, the one that came first is underway and the others are queued."""
    for state, _ in fold(history):
        found = [task.status for task in state.tasks.values()]
        assert found[:1] == [events.TaskStatus.UNDERWAY][: len(found)]
        assert set(found[1:]) <= {events.TaskStatus.QUEUED}


@settings(max_examples=300, deadline=None)
@given(histories)
def test_nothing_is_done_for_a_task_after_its_end(history: list[events.Event]) -> None:
    """A task finishes once, with a final status recorded just before, and no command is about it from then on."""
    ended: set[str] = set()
    for _, commands in fold(history):
        for command in commands:
            assert task_of(command) not in ended, command
        for index, command in enumerate(commands):
            if isinstance(command, events.FinishTask):
                before = commands[index - 1]
                assert isinstance(before, events.Record)
                assert isinstance(before.event, TaskStatusChanged)
                assert (before.event.task, before.event.status) == (command.task, command.status)
                assert command.status.is_final
                assert command.task not in ended
                ended.add(command.task)
                assert all(task_of(later) != command.task for later in commands[index + 1 :])


@settings(max_examples=200, deadline=None)
@given(histories)
def test_every_action_is_ready_once_with_a_number_of_its_own(history: list[events.Event]) -> None:
    """Numbers count up over all tasks; one that has failed has another until it is decided what to do."""
    recorded = [c.event for _, commands in fold(history) for c in commands if isinstance(c, events.Record)]
    numbers = [event.number for event in recorded if isinstance(event, ActionReady)]
    assert numbers == sorted(set(numbers))
    failed = sum(isinstance(c, events.ChooseRecovery) for _, commands in fold(history) for c in commands)
    assert numbers[-1:] <= [len(numbers) + failed]


@settings(max_examples=200, deadline=None)
@given(histories)
def test_the_same_events_give_the_same_states_and_commands(history: list[events.Event]) -> None:
    """Folding twice, over the same starting state, changes nothing that was there before."""
    assert fold(history) == fold(history)
    assert State() == State(tasks={}, running={}, leases={}, next_number=1)


@settings(max_examples=300, deadline=None)
@given(histories)
def test_nothing_starts_on_a_robot_that_has_not_ended_its_goal(history: list[events.Event]) -> None:
    """Every goal that is let go of is canceled once; what waits for a robot is running, and is for one that stops."""
    canceled: list[int] = []
    for state, commands in fold(history):
        canceled += [c.number for c in commands if isinstance(c, events.CancelAction) and c.number in state.stopping]
        stopping = {robot for robots in state.stopping.values() for robot in robots}
        starts = [c for c in commands if isinstance(c, events.StartAction)]
        assert all(stopping.isdisjoint(start.action.robots) for start in starts if start.number in state.running)
        assert state.waiting.keys() <= state.running.keys()
        assert all(not stopping.isdisjoint(start.action.robots) for start in state.waiting.values())
    assert len(set(canceled)) == len(canceled)
