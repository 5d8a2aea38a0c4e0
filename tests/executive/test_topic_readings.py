"""Readings of topics: the newest message, the next one, or none."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from executive.topic_readings import TopicReadings
from grounding.faults import Fault, FaultKind, FaultyTransport
from grounding.inprocess import InProcessTransport
from grounding.messages import Float64MultiArray, MultiArrayLayout, PoseStamped, pose_stamped
from grounding.outcome import Outcome, OutcomeStatus
from grounding.topics import Heard
from grounding.transport import ServiceCall
from kb.clock import Callback, SimClock
from kb.errors import ConcertmasterError
from kb.groundings import Grounding
from tests.executive.topic_grounding import topic_grounding

TOPIC = "/r1/pose"
HOUR_S = 3600.0


def grounding(max_age_s: float = 0.15, timeout_s: float = 1.0, of: str = "geometry_msgs/PoseStamped") -> Grounding:
    """Of a process that tells where a robot is."""
    return topic_grounding(of, max_age_s=max_age_s, timeout_s=timeout_s)


class Robot(InProcessTransport):
    """Says where it is.

    Attributes:
        log: Subscriptions by type, and that they have ended.
    """

    def __init__(self, clock: SimClock) -> None:
        super().__init__(clock)
        self.log: list[str] = []
        self.heard: Heard = lambda message, problem: None

    def hear_topic(self, topic: str, message_type: str, heard: Heard) -> Callback:
        if message_type.startswith("moon_msgs/"):
            raise ConcertmasterError(f"there is no type {message_type}")
        self.log.append(message_type)
        self.heard = heard
        end = super().hear_topic(topic, message_type, heard)

        def ended() -> None:
            self.log.append("end")
            end()

        return ended


class Trial:
    """A robot and who reads what it says; messages are told apart by x, in m."""

    def __init__(self, *faults: Fault) -> None:
        self.clock = SimClock()
        self.robot = Robot(self.clock)
        faulty = FaultyTransport(self.robot, self.clock, faults, np.random.default_rng(1))
        self.readings = TopicReadings(faulty, self.clock)
        self._asked: list[float] = []
        self._came: dict[int, tuple[float, Outcome]] = {}

    def say(self, t_s: float, message: object) -> None:
        """Say something at a time."""
        self.clock.call_at(t_s, lambda: self.robot.topics.say(TOPIC, message))

    def read(self, t_s: float, by: Grounding | None = None) -> int:
        """Read at a time; the number of the reading."""
        number, grounded = len(self._asked), by or grounding()
        self._asked.append(t_s)
        call = ServiceCall(id=number, service=TOPIC, fields={}, timeout_s=grounded.timeout_s)

        def came(outcome: Outcome, fields: Mapping[str, object]) -> None:
            assert number not in self._came, "told once"
            self._came[number] = (self.clock.now_s, outcome)

        def ask() -> None:
            self.readings.read(call, grounded, came)
            assert number not in self._came, "told later"

        self.clock.call_at(t_s, ask)
        return number

    def outcome(self, number: int) -> Outcome:
        """How a reading ended, after all has happened."""
        assert not self.clock.run_until(lambda: False)
        t_s, outcome = self._came[number]
        assert t_s == pytest.approx(self._asked[number] + outcome.elapsed_s)
        return outcome

    def x_m(self, number: int) -> float:
        """Which message a reading took."""
        outcome = self.outcome(number)
        assert outcome.succeeded, outcome.reason
        pose = outcome.outputs["at"]
        assert isinstance(pose, PoseStamped)
        return pose.pose.position.x


def at(x_m: float, t_s: float = 0.0) -> PoseStamped:
    """A message."""
    return pose_stamped(x_m, 0.0, 0.0, t_s=t_s)


def test_the_newest_message_is_taken_at_once() -> None:
    """If it is as old as it may be, or newer; whoever reads, there is one subscription."""
    trial = Trial()
    first = trial.read(0.0)
    for number, t_s in enumerate((0.1, 0.2, 0.3)):
        trial.say(t_s, at(float(number)))
    readings = [trial.read(t_s) for t_s in (0.25, 0.31, 0.45)]
    assert trial.x_m(first) == 0.0
    assert [trial.x_m(number) for number in readings] == [1.0, 2.0, 2.0]
    assert [trial.outcome(number).elapsed_s for number in readings] == [0.0, 0.0, 0.0]
    assert trial.robot.log == ["geometry_msgs/PoseStamped"]


def test_what_is_too_old_is_not_taken_but_the_next_one_is() -> None:
    """All who wait get it."""
    trial = Trial()
    trial.read(0.0)
    trial.say(0.1, at(1.0))
    trial.say(0.9, at(2.0))
    late = [trial.read(0.26), trial.read(0.5)]
    assert [trial.x_m(number) for number in late] == [2.0, 2.0]
    assert [trial.outcome(number).elapsed_s for number in late] == [0.64, 0.4]


@pytest.mark.parametrize(
    ("said_s", "newest"),
    [(None, "there has been none"), (0.1, "the newest is 2.9 s old, and may be 0.15 s")],
)
def test_if_none_comes_the_reading_fails(said_s: float | None, newest: str) -> None:
    """The reason names the topic, and how old the newest message is by then."""
    trial = Trial()
    trial.read(0.0)
    if said_s is not None:
        trial.say(said_s, at(1.0))
    outcome = trial.outcome(trial.read(2.0))
    assert (outcome.status, outcome.failure) == (OutcomeStatus.TIMED_OUT, "NoMessage")
    assert outcome.reason == f"no message of /r1/pose came within 1 s; {newest}"


def test_a_message_of_another_type_fails_the_reading() -> None:
    """At once; the next right one is taken as if nothing had been."""
    trial = Trial()
    wrong = trial.read(0.0)
    trial.say(0.1, Float64MultiArray(layout=MultiArrayLayout(dim=[], data_offset=0), data=np.zeros(3)))
    trial.say(0.2, at(2.0))
    right = trial.read(0.21)
    outcome = trial.outcome(wrong)
    assert (outcome.status, outcome.failure) == (OutcomeStatus.POSTCONDITION_FAILED, "BadReply")
    assert "/r1/pose: is std_msgs/Float64MultiArray, not geometry_msgs/PoseStamped" in outcome.reason
    assert trial.x_m(right) == 2.0


def test_what_cannot_be_read_fails_the_reading() -> None:
    """With what the transport says of it; the message before it is not taken in its place."""
    trial = Trial()
    trial.read(0.0)
    trial.say(0.1, at(1.0))
    trial.clock.call_at(0.2, lambda: trial.robot.heard(None, "message of /r1/pose: pose.x is text"))
    outcome = trial.outcome(trial.read(0.21))
    assert (outcome.failure, outcome.reason) == ("BadReply", "message of /r1/pose: pose.x is text")


@pytest.mark.parametrize("off_s", [-HOUR_S, HOUR_S])
def test_the_time_that_a_robot_tells_is_not_asked(off_s: float) -> None:
    """How old a message is follows from when it came."""
    trial = Trial()
    trial.read(HOUR_S)
    trial.say(HOUR_S + 0.1, at(1.0, HOUR_S + off_s))
    fresh, old = trial.read(HOUR_S + 0.2), trial.read(HOUR_S + 0.3)
    assert trial.x_m(fresh) == 1.0
    assert trial.outcome(old).failure == "NoMessage"


def test_a_topic_that_is_cut_is_silent() -> None:
    """And is heard again after that, by the same subscription."""
    trial = Trial(Fault(service="/r1/*", kind=FaultKind.CUT, from_s=0.15, until_s=2.0))
    trial.read(0.0)
    for tenth in range(1, 40):
        trial.say(tenth / 10, at(tenth / 10))
    before, during, after = trial.read(0.2), trial.read(0.5), trial.read(1.5)
    assert trial.x_m(before) == 0.1
    assert trial.outcome(during).failure == "NoMessage"
    assert trial.x_m(after) == 2.0
    assert trial.robot.log == ["geometry_msgs/PoseStamped"]


def test_knowledge_may_give_a_topic_another_type() -> None:
    """It is subscribed to anew; what came before is of no use."""
    trial = Trial()
    trial.read(0.0)
    trial.say(0.1, at(1.0))
    other = trial.read(0.2, grounding(of="nav_msgs/Odometry"))
    assert trial.outcome(other).failure == "NoMessage"
    assert trial.robot.log == ["geometry_msgs/PoseStamped", "end", "nav_msgs/Odometry"]


def test_a_type_that_the_robot_does_not_have_is_refused() -> None:
    """As an outcome like any other."""
    trial = Trial()
    outcome = trial.outcome(trial.read(0.5, grounding(of="moon_msgs/Phase")))
    assert (outcome.status, outcome.failure) == (OutcomeStatus.REFUSED, "NotGrounded")
    assert outcome.reason == "Read, field message: there is no type moon_msgs/Phase"


EVEN_MS = st.integers(0, 400).map(lambda n: 2 * n)


@given(
    said=st.sets(EVEN_MS),
    read=st.lists(EVEN_MS.map(lambda n: n + 1), min_size=1, max_size=12),
    max_age=EVEN_MS.filter(bool),
    timeout=EVEN_MS.filter(bool),
)
def test_as_a_list_of_all_messages_would_tell(said: set[int], read: list[int], max_age: int, timeout: int) -> None:
    """Of what came since the first reading: the newest if it is new enough, else the next one in time, else none."""
    trial, by = Trial(), grounding(max_age / 1000, timeout / 1000)
    numbers = {trial.read(t_ms / 1000, by): t_ms for t_ms in read}
    for t_ms in sorted(said):
        trial.say(t_ms / 1000, at(float(t_ms)))
    heard = sorted(t_ms for t_ms in said if t_ms > min(read))
    for number, t_ms in numbers.items():
        fresh = [m for m in heard if t_ms - max_age <= m < t_ms]
        later = [m for m in heard if t_ms < m < t_ms + timeout]
        if fresh or later:
            assert trial.x_m(number) == (fresh[-1] if fresh else later[0])
        else:
            assert trial.outcome(number).failure == "NoMessage"
    assert len(trial.robot.log) == 1
