"""Topics on which a simulated fleet speaks and listens in ROS 1, on the thread of its clock."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from grounding.ros1.installed import ros
from grounding.ros1.node import Node
from grounding.ros1.wire import Wire
from grounding.rosbridge.values import BadValue
from kb.clock import Callback

_QUEUED = 10


class Ros1Board:
    """Says and hears, with every master that comes; see `grounding.topics.Board`.

    Args:
        post: The way from any thread onto the clock's.
    """

    def __init__(self, node: Node, wire: Wire, post: Callable[[Callback], None]) -> None:
        self._node, self._wire, self._post = node, wire, post

    def offer(self, name: str, message_type: str, *, begun: Callback) -> None:
        """Say that a topic is spoken on.

        Args:
            begun: Called, on the clock's thread, whenever somebody begins to listen to it.

        Raises:
            UnknownType: There is no such type, or ROS 1 has it otherwise.
        """
        made, rospy = self._wire.message_class(message_type), ros("rospy")
        listener = rospy.SubscribeListener()
        listener.peer_subscribe = lambda *_: self._post(begun)
        self._node.hold(
            ("said", name),
            lambda: rospy.Publisher(name, made, subscriber_listener=listener, queue_size=_QUEUED),
            lambda publisher: publisher.unregister(),
        )

    def is_heard(self, name: str) -> bool:
        """Whether anybody listens to a topic."""
        publisher = self._node.held(("said", name))
        return publisher is not None and publisher.get_num_connections() > 0

    def say(self, name: str, message: object) -> None:
        """Say a message on a topic that was offered; while there is no master it is lost."""
        publisher = self._node.held(("said", name))
        if publisher is not None:
            with suppress(ros("rospy").ROSException):  # it was being taken back on the node's thread
                publisher.publish(publisher.data_class(self._wire.encode(message)))

    def listen(self, name: str, message_type: str, listener: Callable[[object], None]) -> None:
        """Call `listener`, on the clock's thread, with every message of a topic that can be read.

        Raises:
            UnknownType: There is no such type, or ROS 1 has it otherwise.
        """
        made, rospy = self._wire.message_class(message_type), ros("rospy")

        def take(came: Any) -> None:
            with suppress(BadValue):  # the sum of the type was right, so that nobody does this by mistake
                message = self._wire.decode(message_type, came.data)
                self._post(lambda: listener(message))

        self._node.hold(
            ("listened", name),
            lambda: rospy.Subscriber(name, made, take, queue_size=_QUEUED),
            lambda subscriber: subscriber.unregister(),
        )
