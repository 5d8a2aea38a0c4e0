"""The topics that one hears and speaks on over a link."""

from __future__ import annotations

from collections.abc import Callable

from grounding.rosbridge.connection import NotSent
from grounding.rosbridge.dropped import Dropped
from grounding.rosbridge.operations import (
    Advertise,
    Operation,
    Publish,
    Subscribe,
    Unadvertise,
    Unsubscribe,
)
from grounding.rosbridge.types import Types
from grounding.rosbridge.values import BadValue, Numbers, from_tree, to_tree
from kb.clock import Callback, WallClock

Take = Callable[[object], None]


class Subscription:
    """A topic of which the newest message is kept.

    Attributes:
        newest: The newest message; None before the first.
        problem: Why the last that came could not be read; empty if it could.
        refused: Told that as well.
    """

    def __init__(self, topic: str, message_type: str, clock: WallClock, take: Take | None) -> None:
        self.topic, self.message_type = topic, message_type
        self._clock, self._take = clock, take
        self._came_s: float | None = None
        self.newest: object | None = None
        self.problem = ""
        self.refused: Callable[[str], None] = lambda problem: None

    @property
    def age_s(self) -> float | None:
        """Time since the newest message came, by our clock; None before the first."""
        return None if self._came_s is None else self._clock.now_s - self._came_s

    def receive(self, message: object) -> None:
        """Take note of a message."""
        self.newest, self._came_s, self.problem = message, self._clock.now_s, ""
        if self._take is not None:
            self._take(message)

    def refuse(self, problem: str) -> None:
        """Take note of a message that cannot be read."""
        self.problem = problem
        self.refused(problem)


class Topics:
    """Subscriptions and advertised topics, which outlive the sessions of a link.

    Args:
        send: Raises NotSent or BadFrame.
        dropped: Told of messages of topics that are not subscribed to, or of another type.
    """

    def __init__(
        self,
        send: Callable[[Operation], None],
        clock: WallClock,
        types: Types,
        numbers: Numbers,
        dropped: Dropped,
    ) -> None:
        self._send, self._clock, self._types = send, clock, types
        self._numbers: Numbers = numbers
        self._dropped = dropped
        self._heard: dict[str, tuple[Subscription, Subscribe]] = {}
        self._stop_listening: dict[str, Callback] = {}
        self._spoken: dict[str, Advertise] = {}

    def subscribe(self, topic: str, message_type: str, take: Take | None, throttle_s: float) -> Subscription:
        """Hear a topic from now on, in every session; a new subscription takes the place of an old one.

        Raises:
            UnknownType: There is no such type.
        """
        full_type = self._types.message(message_type)
        subscription = Subscription(topic, full_type, self._clock, take)
        operation = Subscribe(
            topic=topic,
            type=full_type,
            id=f"subscribe:{topic}",
            throttle_rate=round(throttle_s * 1000.0),
            queue_length=1,
            compression="cbor",
        )
        if topic not in self._heard:
            self._stop_listening[topic] = self._clock.listen()
        self._heard[topic] = (subscription, operation)
        self._try_to_send(operation)
        return subscription

    def unsubscribe(self, topic: str) -> None:
        """Hear a topic no more."""
        if self._heard.pop(topic, None) is not None:
            self._stop_listening.pop(topic)()
            self._try_to_send(Unsubscribe(topic=topic, id=f"subscribe:{topic}"))

    def advertise(self, topic: str, message_type: str, latch: bool) -> None:
        """Speak on a topic from now on, in every session.

        Raises:
            UnknownType: There is no such type.
        """
        full_type = self._types.message(message_type)
        self._spoken[topic] = Advertise(topic=topic, type=full_type, id=f"advertise:{topic}", latch=latch)
        self._try_to_send(self._spoken[topic])

    def unadvertise(self, topic: str) -> None:
        """Speak on a topic no more."""
        if self._spoken.pop(topic, None) is not None:
            self._try_to_send(Unadvertise(topic=topic, id=f"advertise:{topic}"))

    def publish(self, topic: str, message: object) -> bool:
        """Send a message on an advertised topic.

        Returns:
            Whether there is a connection that takes it: what is said without one is not kept for later.

        Raises:
            BadValue: The message does not hold what its type says.
        """
        tree = to_tree(message, numbers=self._numbers, types=self._types)
        return self._try_to_send(Publish(topic=topic, msg=tree, latch=self._spoken[topic].latch))

    def take(self, operation: Publish) -> None:
        """Give a message to who hears its topic."""
        heard = self._heard.get(operation.topic)
        if heard is None:
            self._dropped.note(f"message of {operation.topic}, which is not subscribed to")
            return
        subscription, _ = heard
        try:
            message = from_tree(subscription.message_type, operation.msg, now_s=self._clock.now_s, types=self._types)
        except BadValue as error:
            subscription.refuse(f"message of {operation.topic}: {error}")
            self._dropped.note(subscription.problem)
        else:
            subscription.receive(message)

    def resume(self) -> None:
        """Say everything again to a far end that has forgotten it."""
        for advertise in self._spoken.values():
            self._try_to_send(advertise)
        for _, subscribe in self._heard.values():
            self._try_to_send(subscribe)

    def _try_to_send(self, operation: Operation) -> bool:
        try:
            self._send(operation)
        except NotSent:
            return False  # `resume` makes up for it
        return True
