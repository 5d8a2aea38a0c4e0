"""What robots say by themselves, again and again: topics, whose newest message stands in for a call."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from grounding.transport import Transport
from kb.clock import Callback

Heard = Callable[[object, str], None]
"""Told each message, with an empty text; or None, and why what has come cannot be read, in a sentence."""


class TopicTransport(Transport, Protocol):
    """Carries what is said on topics."""

    def hear_topic(self, topic: str, message_type: str, heard: Heard) -> Callback:
        """Hear a topic from now on, over all connections to come; who heard it before hears it no more.

        Messages come later, on the clock's thread, and none while there is no connection. Of those that come faster
        than they are taken some are left out, never the newest.

        Args:
            topic: Full name, such as `/amigo_1/scan`.
            message_type: Such as `sensor_msgs/LaserScan`.

        Returns:
            What ends it; to be called once, and before the topic is heard anew.

        Raises:
            ConcertmasterError: There is no such type here.
        """


class Board(Protocol):
    """Where simulated robots say what their sensors measure."""

    def offer(self, name: str, message_type: str, *, begun: Callback) -> None:
        """Say that a topic is spoken on.

        Args:
            begun: Called whenever somebody begins to listen to it.
        """

    def is_heard(self, name: str) -> bool:
        """Whether anybody listens to a topic."""

    def say(self, name: str, message: object) -> None:
        """Say a message on a topic that was offered."""


class HearingBoard(Board, Protocol):
    """The same where others may say something to the robots, too."""

    def listen(self, name: str, message_type: str, listener: Callable[[object], None]) -> object:
        """Call `listener` with every message that others say on a topic."""
