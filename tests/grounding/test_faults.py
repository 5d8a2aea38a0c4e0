"""Faults on the way: which calls they meet, what becomes of these, and that chance can be repeated."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from grounding.actions import Goal, GoalHandle, GoalStatus
from grounding.faults import BadFaults, Fault, FaultKind, FaultyTransport, read_faults
from grounding.inprocess import InProcessTransport, Service
from grounding.transport import ServiceCall
from kb.clock import SimClock


class Trial:
    """Calls every second to a service that replies 0.25 s later, with what has become of them."""

    def __init__(self, *faults: Fault, seed: int = 1) -> None:
        self.clock = SimClock()
        self.done: list[float] = []
        self.replies: list[tuple[int, float, str]] = []
        inner = InProcessTransport(self.clock)
        for name in ("/pico_1/laser", "/amigo_1/laser", "/compute/path"):
            inner.offer(name, Service(handler=self._note, latency_s=0.25))
        self._transport = FaultyTransport(inner, self.clock, faults, np.random.default_rng(seed))

    def _note(self, fields: Mapping[str, object]) -> Mapping[str, object]:
        self.done.append(self.clock.now_s)
        return {}

    def call(self, number: int, service: str = "/pico_1/laser") -> None:
        """Call at second `number`."""

        def now() -> None:
            self._transport.call(
                ServiceCall(id=number, service=service, fields={}, timeout_s=1.0),
                lambda reply: self.replies.append((reply.call_id, self.clock.now_s, reply.failure)),
            )

        self.clock.call_at(float(number), now)

    def end(self) -> None:
        """Let all happen."""
        assert not self.clock.run_until(lambda: False)


def test_without_faults_nothing_is_changed() -> None:
    """Every call comes through in its time."""
    trial = Trial()
    for number in range(3):
        trial.call(number)
    trial.end()
    assert trial.replies == [(0, 0.25, ""), (1, 1.25, ""), (2, 2.25, "")]


@pytest.mark.parametrize(
    ("kind", "done", "replies"),
    [
        (FaultKind.FAIL, [], [(0, 0.0, "Broken")]),
        (FaultKind.HANG, [], []),
        (FaultKind.SILENCE, [0.0], []),
        (FaultKind.DELAY, [0.0], [(0, 2.25, "")]),
        (FaultKind.REPEAT, [0.0], [(0, 0.25, ""), (0, 2.25, "")]),
        (FaultKind.CUT, [], []),
    ],
)
def test_what_becomes_of_a_call(kind: FaultKind, done: list[float], replies: list[tuple[int, float, str]]) -> None:
    """Whether the service does it, and what is heard of it."""
    trial = Trial(Fault(service="*", kind=kind, code="Broken", delay_s=2.0))
    trial.call(0)
    trial.end()
    assert (trial.done, trial.replies) == (done, replies)


def test_a_fault_meets_the_calls_that_it_names() -> None:
    """By service, by number among those, and by time."""
    trial = Trial(
        Fault(service="/*/laser", kind=FaultKind.FAIL, calls=frozenset({2}), code="Second"),
        Fault(service="/amigo_1/*", kind=FaultKind.FAIL, from_s=4.0, until_s=5.0, code="AtFour"),
    )
    for number, service in enumerate(
        ["/pico_1/laser", "/compute/path", "/amigo_1/laser", "/amigo_1/laser", "/amigo_1/laser", "/amigo_1/laser"]
    ):
        trial.call(number, service)
    trial.end()
    failures = {number: failure for number, _, failure in trial.replies if failure}
    assert failures == {2: "Second", 4: "AtFour"}


def test_the_first_fault_that_strikes_counts() -> None:
    """And the one behind it counts the call nevertheless."""
    trial = Trial(
        Fault(service="*", kind=FaultKind.FAIL, calls=frozenset({1}), code="First"),
        Fault(service="*", kind=FaultKind.FAIL, calls=frozenset({1, 2}), code="Behind"),
    )
    for number in range(3):
        trial.call(number)
    trial.end()
    assert sorted((number, failure) for number, _, failure in trial.replies) == [(0, "First"), (1, "Behind"), (2, "")]


def test_what_is_cut_off_loses_replies_too() -> None:
    """Those to calls that were made before; what is heard again afterwards is as before."""
    trial = Trial(Fault(service="/pico_1/*", kind=FaultKind.CUT, from_s=1.125, until_s=2.5))
    for number in range(4):
        trial.call(number)
    trial.call(4, "/compute/path")
    trial.end()
    assert trial.done == [0.0, 1.0, 3.0, 4.0]
    assert [number for number, _, _ in trial.replies] == [0, 3, 4]


def test_chance_is_repeated_by_its_seed() -> None:
    """The same seed gives the same faults; about as many as the probability says."""

    def failed(seed: int) -> list[int]:
        trial = Trial(Fault(service="*", kind=FaultKind.FAIL, probability=0.25), seed=seed)
        for number in range(200):
            trial.call(number)
        trial.end()
        return [number for number, _, failure in trial.replies if failure]

    assert failed(1) == failed(1) != failed(2)
    assert 30 <= len(failed(1)) <= 70


@pytest.mark.parametrize(
    ("probability", "delay_s", "told"),
    [(1.5, 0.0, "probability 1.5"), (math.nan, 0.0, "probability nan"), (1.0, -1.0, "delay_s -1")],
)
def test_impossible_faults_are_refused(probability: float, delay_s: float, told: str) -> None:
    """Before anything is called."""
    with pytest.raises(ValueError, match=told):
        Fault(service="*", kind=FaultKind.DELAY, probability=probability, delay_s=delay_s)


_FILE = """
[faults.camera]
service = "/amigo_1/kinect"
kind = "fail"
calls = [1, 3]
code = "SensorSilent"

[faults.lost]
service = "/amigo_1/*"
kind = "cut"
from_s = 3.0
until_s = 9

[faults.slow]
service = "*"
kind = "delay"
probability = 0.1
delay_s = 0.5
"""


def test_a_file_of_faults_is_read(tmp_path: Path) -> None:
    """In its order."""
    (tmp_path / "faults.toml").write_text(_FILE)
    assert read_faults(tmp_path / "faults.toml") == (
        Fault(service="/amigo_1/kinect", kind=FaultKind.FAIL, calls=frozenset({1, 3}), code="SensorSilent"),
        Fault(service="/amigo_1/*", kind=FaultKind.CUT, from_s=3.0, until_s=9.0),
        Fault(service="*", kind=FaultKind.DELAY, probability=0.1, delay_s=0.5),
    )


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('"fail"', '"explode"', "faults.camera.kind: unknown: 'explode'; known are cut, delay, fail, hang"),
        ("[1, 3]", "[0]", "faults.camera.calls: 0 is not a whole number >= 1"),
        ("[1, 3]", "1", "faults.camera.calls: 1 is not a list of whole numbers >= 1"),
        ("0.1", "1.1", "faults.slow.probability: 1.1 is not from 0 to 1"),
        ("delay_s", "delay", "faults.slow.delay: unknown field"),
        ('service = "*"', "", "faults.slow.service: missing"),
        ("[faults.", "[fault.", "faults: missing"),
    ],
)
def test_wrong_faults_are_refused_with_their_field(tmp_path: Path, old: str, new: str, told: str) -> None:
    """And what would be right."""
    (tmp_path / "faults.toml").write_text(_FILE.replace(old, new))
    with pytest.raises(BadFaults) as caught:
        read_faults(tmp_path / "faults.toml")
    assert told in str(caught.value)


@pytest.mark.parametrize(
    ("kind", "began", "came"),
    [
        (FaultKind.FAIL, 0, [(0.0, GoalStatus.ABORTED, "NO_VALID_PATH")]),
        (FaultKind.HANG, 0, []),
        (FaultKind.CUT, 0, []),
        (FaultKind.SILENCE, 1, []),
        (FaultKind.DELAY, 1, [(1.5, GoalStatus.SUCCEEDED, "")]),
        (FaultKind.REPEAT, 1, [(1.0, GoalStatus.SUCCEEDED, ""), (1.5, GoalStatus.SUCCEEDED, "")]),
    ],
)
def test_goals_meet_the_same_faults(kind: FaultKind, began: int, came: list[tuple[float, GoalStatus, str]]) -> None:
    """Each kind, on a goal that would be reached after a second; the next goal is as ever."""
    clock, handles, results = SimClock(), list[GoalHandle](), list[tuple[float, GoalStatus, str]]()
    inner = InProcessTransport(clock)

    def start(goal: GoalHandle) -> None:
        handles.append(goal)
        clock.call_at(clock.now_s + 1.0, lambda: goal.end(GoalStatus.SUCCEEDED, {}))

    inner.offer_action("/drive", start)
    fault = Fault(service="/drive", kind=kind, calls=frozenset({1}), code="NO_VALID_PATH", delay_s=0.5, until_s=5.0)
    transport = FaultyTransport(inner, clock, (fault,), np.random.default_rng(1))

    def send(number: int) -> None:
        goal = Goal(id=number, action="/drive", fields={})
        transport.send_goal(
            goal, lambda fields: None, lambda result: results.append((clock.now_s, result.status, result.failure))
        )

    send(1)
    assert not clock.run_until(lambda: False)
    assert (len(handles), results) == (began, came)
    results.clear()
    clock.call_at(10.0, lambda: send(2))
    assert not clock.run_until(lambda: False)
    assert results == [(11.0, GoalStatus.SUCCEEDED, "")]


def test_the_end_of_a_goal_is_asked_for_through_what_is_not_cut() -> None:
    """A robot that cannot be reached goes on with its goal."""
    clock, canceled = SimClock(), list[float]()
    inner = InProcessTransport(clock)

    def start(goal: GoalHandle) -> None:
        goal.canceled = lambda: canceled.append(clock.now_s)

    inner.offer_action("/drive", start)
    cut = Fault(service="/drive", kind=FaultKind.CUT, from_s=2.0, until_s=4.0)
    transport = FaultyTransport(inner, clock, (cut,), np.random.default_rng(1))
    transport.send_goal(Goal(id=1, action="/drive", fields={}), lambda fields: None, lambda result: None)
    for t_s in (1.0, 3.0, 5.0):
        clock.call_at(t_s, lambda: transport.cancel_goal(1))
    assert not clock.run_until(lambda: False)
    assert canceled == [1.0, 5.0]
