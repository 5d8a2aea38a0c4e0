"""The Python API: opening, asking, waiting, canceling, closing."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from executive import Fleet, TaskHandle, TaskStatus
from executive.errors import BadRequest
from executive.trace import TaskAccepted, TaskFinished, read_trace, to_json
from grounding.transport import ServiceCall, ServiceReply
from kb.store import UnknownSite


@pytest.fixture
def fleet() -> Iterator[Fleet]:
    """A fleet of the shipped site."""
    with Fleet.open("tue_lab") as fleet:
        yield fleet


def localize(fleet: Fleet, robot: str = "amigo_1") -> TaskHandle:
    """The shortest task that uses a robot."""
    return fleet.request("Localize", robot=robot, area="tue_lab")


def lines(fleet: Fleet, task: TaskHandle) -> list[str]:
    """What the trace tells of a task."""
    return [to_json(event) for event in fleet.trace if getattr(event, "task", None) == task.name]


# The life of a task


def test_a_task_goes_through_its_life(fleet: Fleet) -> None:
    """Underway at once, then completed; a second is queued meanwhile."""
    first, second = localize(fleet), localize(fleet)
    assert (first.name, second.name) == ("Localize-1", "Localize-2")
    assert (first.status, second.status) == (TaskStatus.UNDERWAY, TaskStatus.QUEUED)
    assert first.wait_until(fleet.now_s) is None
    results = [first.wait()]
    assert (first.status, second.status) == (TaskStatus.COMPLETED, TaskStatus.UNDERWAY)
    results.append(second.wait())
    assert [result.status for result in results] == [first.status, second.status] == [TaskStatus.COMPLETED] * 2


def test_waiting_twice_gives_the_same_result(fleet: Fleet) -> None:
    """No time passes the second time."""
    task = localize(fleet)
    result, end_s, events = task.wait(), fleet.now_s, len(fleet.trace)
    assert task.wait() is result
    assert (fleet.now_s, len(fleet.trace)) == (end_s, events)
    assert task.wait_until(end_s) is result


def test_the_result_holds_plan_outputs_and_time(fleet: Fleet) -> None:
    """Localize gives a scan and a pose; it took as long as the trace says."""
    result = localize(fleet).wait()
    assert result.plan is not None
    assert [step.action.process for step in result.plan.steps] == ["LocMap", "Laser", "Pose"]
    assert result.outputs["pose"].header.frame_id == "map"
    assert result.outputs["scan"].header.frame_id == "amigo_1/laser"
    last = fleet.trace[-1]
    assert isinstance(last, TaskFinished)
    assert last.took_s == result.took_s == fleet.now_s


def test_waiting_up_to_a_time_stops_there(fleet: Fleet) -> None:
    """The clock shows that time, if the task has not ended before."""
    task = localize(fleet)
    assert task.wait_until(0.25) is None
    assert fleet.now_s == 0.25
    assert task.wait_until(0.1 + 0.2) is None
    assert fleet.now_s == 0.3, "the clock ticks in nanoseconds"
    assert task.wait_until(0.1) is None
    assert fleet.now_s == 0.3, "a time that is past is now"
    result = task.wait_until(60.0)
    assert result is not None
    assert fleet.now_s == result.took_s < 60.0


def test_cancel_after_the_end_does_nothing(fleet: Fleet) -> None:
    """Neither the result nor the trace changes."""
    task = localize(fleet)
    result, events = task.wait(), len(fleet.trace)
    task.cancel()
    task.cancel()
    assert task.wait() is result
    assert len(fleet.trace) == events


@pytest.mark.parametrize("until_s", [0.0, 0.3, 0.52])
def test_cancel_at_any_moment_ends_the_task_at_once(fleet: Fleet, until_s: float) -> None:
    """While it is being planned, or done; the robot is free for the next task."""
    task = localize(fleet)
    task.wait_until(until_s)
    task.cancel()
    assert task.status is TaskStatus.CANCELED
    assert task.wait().took_s == until_s
    assert localize(fleet).wait().status is TaskStatus.COMPLETED


def test_letting_time_pass_does_what_is_to_be_done(fleet: Fleet) -> None:
    """The task ends although nobody waits for it."""
    task = localize(fleet)
    fleet.let_time_pass(5.0)
    assert fleet.now_s == 5.0
    assert task.status is TaskStatus.COMPLETED
    fleet.let_time_pass(1.0)
    assert fleet.now_s == 5.0


def test_a_plan_alone_changes_nothing(fleet: Fleet) -> None:
    """No event, no time, no number taken."""
    plan, lacking = fleet.plan("Localize", robot="amigo_1", area="tue_lab")
    assert plan.solved
    assert lacking == ()
    assert (len(fleet.trace), fleet.now_s) == (1, 0.0)
    assert localize(fleet).name == "Localize-1"


def test_a_refused_request_takes_no_number(fleet: Fleet) -> None:
    """The next good one is still the first."""
    with pytest.raises(BadRequest):
        fleet.request("Localize", robot="nobody", area="tue_lab")
    assert localize(fleet).name == "Localize-1"


# Closing


def test_leaving_the_context_closes_everything(tmp_path: Path) -> None:
    """The trace is on disk, the services refuse, requests and plans are refused, closing again does nothing."""
    file = tmp_path / "trace.jsonl"
    with Fleet.open("tue_lab", trace=file) as fleet:
        localize(fleet).wait()
    assert list(read_trace(file)) == list(fleet.trace)
    replies: list[ServiceReply] = []
    call = ServiceCall(id=99, service="/amigo_1/laser", fields={}, timeout_s=1.0)
    fleet.parts.transport.call(call, replies.append)
    fleet.let_time_pass(fleet.now_s + 1.0)
    assert [reply.failure for reply in replies] == ["Closed"]
    for ask in (fleet.request, fleet.plan):
        with pytest.raises(BadRequest, match="Localize cannot be asked for: this fleet is closed; open another"):
            ask("Localize", robot="amigo_1", area="tue_lab")
    fleet.close()


def test_closing_cancels_what_has_not_ended(tmp_path: Path) -> None:
    """All its tasks end, the queued without having begun, and the trace says so."""
    file = tmp_path / "trace.jsonl"
    with Fleet.open("tue_lab", trace=file) as fleet:
        tasks = [localize(fleet) for _ in range(3)]
        tasks[0].wait_until(0.51)
    assert [task.wait().status for task in tasks] == [TaskStatus.CANCELED] * 3
    ends = [event.task for event in read_trace(file) if isinstance(event, TaskFinished)]
    assert ends == ["Localize-3", "Localize-2", "Localize-1"]
    assert fleet.now_s == 0.51


def test_an_error_in_the_context_still_closes(tmp_path: Path) -> None:
    """The error goes on; the trace up to it is on disk."""
    file = tmp_path / "trace.jsonl"
    with pytest.raises(ZeroDivisionError), Fleet.open("tue_lab", trace=file) as fleet:
        localize(fleet).wait_until(0.51 / 0)
    assert any(isinstance(event, TaskAccepted) for event in read_trace(file))


def test_what_cannot_be_opened_leaves_nothing_behind(tmp_path: Path) -> None:
    """No file, no folder; the error names the site."""
    with pytest.raises(UnknownSite, match="no site 'mars'"):
        Fleet.open("mars", trace=tmp_path / "runs" / "trace.jsonl")
    assert not list(tmp_path.iterdir())


# Two at once


def test_two_fleets_in_one_process_do_not_mix(fleet: Fleet) -> None:
    """Tasks of the same name, done in turns of a moment each, leave the traces that they leave alone."""
    alone = localize(fleet)
    alone.wait()
    with Fleet.open("tue_lab") as one, Fleet.open("tue_lab", seed=7) as other:
        in_one, in_other = localize(one), localize(other, "pico_1")
        assert in_one.name == in_other.name
        until_s = 0.0
        while not (in_one.status.is_final and in_other.status.is_final):
            until_s += 0.01
            in_one.wait_until(until_s)
            in_other.wait_until(until_s)
        assert in_other.status is TaskStatus.COMPLETED, in_other.wait().reason
        assert lines(one, in_one) == lines(fleet, alone)
        assert not any("amigo_1" in line for line in lines(other, in_other))


def test_one_fleet_goes_on_when_another_is_closed(fleet: Fleet) -> None:
    """Closed in the middle of a task of the same name."""
    task = localize(fleet)
    with Fleet.open("tue_lab") as other:
        localize(other)
    assert task.wait().status is TaskStatus.COMPLETED


def test_when_all_is_done_nothing_is_left_to_happen() -> None:
    """No timeout of a call that has long been answered keeps the clock going."""
    with Fleet.open("tue_lab") as fleet:
        fleet.request("Localize", robot="amigo_1", area="tue_lab").wait()
        done_s = fleet.now_s
        assert not fleet.parts.clock.run_until(lambda: False)
        assert fleet.now_s == done_s
