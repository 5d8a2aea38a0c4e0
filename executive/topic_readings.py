"""Actions that are readings of topics: the newest message, if it is new enough, else the next one.

Each topic is subscribed to once, when it is first read, and of what it brings the newest message alone is kept. How
old a message is follows from when it came, by our clock: what robots say of the time is not asked, as their clocks may
differ.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from grounding.errors import GroundingError
from grounding.outcome import Outcome, OutcomeStatus, interpret, refused
from grounding.topics import TopicTransport
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import Callback, Clock
from kb.errors import ConcertmasterError
from kb.groundings import Field, Grounding

Came = Callable[[Outcome, Mapping[str, object]], None]
"""Told how a reading has ended, and with what fields."""


@dataclass(slots=True, kw_only=True)
class _Topic:
    """A topic that is heard.

    Attributes:
        came_s: When the newest message came; None before the first.
        problem: Why the newest cannot be read; empty if it can.
        waiting: Who waits for the next one, in order.
    """

    message_type: str
    end: Callback
    came_s: float | None = None
    message: object = None
    problem: str = ""
    waiting: list[Callback] = field(default_factory=list)


class TopicReadings:
    """The newest messages of the topics in which processes are grounded."""

    def __init__(self, transport: TopicTransport, clock: Clock) -> None:
        self._transport, self._clock = transport, clock
        self._topics: dict[str, _Topic] = {}

    def read(self, call: ServiceCall, grounding: Grounding, came: Came) -> None:
        """Take the newest message of a topic, or wait for the next one if it is too old.

        Args:
            call: Its service is the topic; it gives up after its `timeout_s`.
            came: Told later, once: of success, of a message that is not what the grounding says, or that none came.
        """
        asked_s = self._clock.now_s
        try:
            topic = self._heard(call.service, _message(grounding))
        except ConcertmasterError as error:  # where the robot is there is no such type
            outcome = refused(GroundingError(grounding.process, _message(grounding).name, str(error)))
            self._clock.call_at(asked_s, lambda: came(outcome, {}))
            return

        def take() -> None:
            fields = {} if topic.problem else {_message(grounding).name: topic.message}
            failure = "BadReply" if topic.problem else ""
            reply = ServiceReply(call_id=call.id, fields=fields, failure=failure, reason=topic.problem)
            elapsed_s = round(self._clock.now_s - asked_s, 9)
            came(interpret(reply, grounding, service=call.service, elapsed_s=elapsed_s), fields)

        if _age_s(topic, asked_s) <= (grounding.max_age_s or 0.0):
            self._clock.call_at(asked_s, take)
            return

        def take_next() -> None:
            forget_timeout()
            take()

        def give_up() -> None:
            topic.waiting.remove(take_next)
            came(_no_message(call, grounding, topic, self._clock.now_s), {})

        topic.waiting.append(take_next)
        forget_timeout = self._clock.call_at(asked_s + call.timeout_s, give_up)

    def _heard(self, name: str, message: Field) -> _Topic:
        """The topic, subscribed to if it is not; anew if knowledge that has come into force gives it another type."""
        known = self._topics.get(name)
        if known is not None and known.message_type == message.message_type:
            return known
        if known is not None:
            self._topics.pop(name).end()
        topic = _Topic(message_type=message.message_type, end=lambda: None)

        def heard(message: object, problem: str) -> None:
            topic.came_s, topic.message, topic.problem = self._clock.now_s, message, problem
            waiting, topic.waiting = topic.waiting, []
            for take in waiting:
                take()

        topic.end = self._transport.hear_topic(name, message.message_type, heard)
        self._topics[name] = topic
        return topic


def _message(grounding: Grounding) -> Field:
    """The one field of a grounding in a topic."""
    [message] = grounding.reply
    return message


def _age_s(topic: _Topic, now_s: float) -> float:
    """How long ago the newest message came; without end before the first."""
    return float("inf") if topic.came_s is None else round(now_s - topic.came_s, 9)


def _no_message(call: ServiceCall, grounding: Grounding, topic: _Topic, now_s: float) -> Outcome:
    newest = "there has been none"
    if topic.came_s is not None:
        newest = f"the newest is {_age_s(topic, now_s):.3g} s old, and may be {grounding.max_age_s:g} s"
    return Outcome(
        status=OutcomeStatus.TIMED_OUT,
        failure="NoMessage",
        reason=f"no message of {call.service} came within {call.timeout_s:g} s; {newest}",
        outputs={},
        elapsed_s=call.timeout_s,
    )
