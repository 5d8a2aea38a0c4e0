"""The topics that one hears and speaks on in ROS 1."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from grounding.ros1.installed import ros
from grounding.ros1.node import Node
from grounding.ros1.wire import Wire
from grounding.rosbridge.dropped import Dropped
from grounding.rosbridge.topics import Subscription, Take
from grounding.rosbridge.types import Types
from grounding.rosbridge.values import BadValue
from kb.clock import Callback, WallClock

_QUEUED = 10


class Topics:
    """Subscriptions and advertised topics, with every master that comes.

    Args:
        dropped: Told of messages that cannot be read.
    """

    def __init__(self, node: Node, clock: WallClock, types: Types, wire: Wire, dropped: Dropped) -> None:
        self._node, self._clock, self._types, self._wire, self._dropped = node, clock, types, wire, dropped
        self._stop_listening: dict[str, Callback] = {}
        self._spoken: dict[str, str] = {}

    def subscribe(self, topic: str, message_type: str, take: Take | None, throttle_s: float) -> Subscription:
        """Hear a topic from now on; a new subscription takes the place of an old one.

        Raises:
            UnknownType: There is no such type, or ROS 1 has it otherwise.
        """
        full_type = self._types.message(message_type)
        subscription = Subscription(topic, full_type, self._clock, take)

        def receive(data: bytes) -> None:
            if topic not in self._stop_listening:
                return  # it came while the topic was left
            if subscription.age_s is not None and subscription.age_s < throttle_s:
                return
            try:
                message = self._wire.decode(full_type, data)
            except BadValue as error:
                subscription.refuse(f"message of {topic}: {error}")
                self._dropped.note(subscription.problem)
            else:
                subscription.receive(message)

        if topic not in self._stop_listening:
            self._stop_listening[topic] = self._clock.listen()
        self.hear(topic, full_type, Newest(self._clock, receive))
        return subscription

    def unsubscribe(self, topic: str) -> None:
        """Hear a topic no more."""
        if topic in self._stop_listening:
            self._stop_listening.pop(topic)()
            self._node.drop(("heard", topic))

    def advertise(self, topic: str, message_type: str, latch: bool) -> None:
        """Speak on a topic from now on.

        Raises:
            UnknownType: There is no such type, or ROS 1 has it otherwise.
        """
        self._spoken[topic] = self._types.message(message_type)
        made = self._wire.message_class(message_type)
        rospy = ros("rospy")
        self._node.hold(
            ("spoken", topic),
            lambda: rospy.Publisher(topic, made, queue_size=_QUEUED, latch=latch),
            lambda publisher: publisher.unregister(),
        )

    def unadvertise(self, topic: str) -> None:
        """Speak on a topic no more."""
        if self._spoken.pop(topic, None) is not None:
            self._node.drop(("spoken", topic))

    def publish(self, topic: str, message: object) -> bool:
        """Send a message on an advertised topic.

        Returns:
            Whether it is known to a master, so that others may hear it: what is said before is not kept for later.

        Raises:
            BadValue: The message does not hold what the topic's type says.
        """
        wanted, given = self._spoken[topic], str(getattr(message, "__msgtype__", type(message).__name__))
        if given != wanted:
            raise BadValue("", f"is {given}, {topic} has {wanted}")
        return self.speak(topic, self._wire.encode(message))

    def hear(self, topic: str, message_type: str, take: Callable[[Any], None]) -> None:
        """Have rospy give the messages of a topic to `take`, on its threads."""
        made = self._wire.message_class(message_type)
        rospy = ros("rospy")
        self._node.hold(
            ("heard", topic),
            lambda: rospy.Subscriber(topic, made, take, queue_size=_QUEUED, buff_size=_BUFFER_BYTES),
            lambda subscriber: subscriber.unregister(),
        )

    def speak(self, topic: str, data: bytes) -> bool:
        """Send the bytes of a message; whether the topic is known to a master."""
        publisher = self._node.held(("spoken", topic))
        if publisher is None:
            return False
        try:
            publisher.publish(publisher.data_class(data))
        except ros("rospy").ROSException:
            return False  # it was being taken back on the node's thread
        return True

    def partners(self, topic: str) -> int:
        """How many others hear what we say on a topic, or speak on one that we hear."""
        found = [self._node.held((kind, topic)) for kind in ("spoken", "heard")]
        return sum(one.get_num_connections() for one in found if one is not None)


_BUFFER_BYTES = 1 << 20  # with rospy's own 64 KiB, queue_size does not hold for images


class Newest:
    """Hands the newest message over to the clock's thread: those between are not read."""

    def __init__(self, clock: WallClock, receive: Callable[[bytes], None]) -> None:
        self._clock, self._receive = clock, receive
        self._lock = threading.Lock()
        self._data: bytes | None = None

    def __call__(self, message: Any) -> None:
        with self._lock:
            first, self._data = self._data is None, message.data
        if first:
            self._clock.post(self.hand_over)

    def hand_over(self) -> None:
        """On the clock's thread: have what has come read, if it is not yet."""
        with self._lock:
            data, self._data = self._data, None
        if data is not None:
            self._receive(data)
