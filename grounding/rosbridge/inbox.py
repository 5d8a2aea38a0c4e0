"""What has come in and is not taken yet: bounded, and of each topic only the newest message.

The connection's thread puts, the clock's takes. Who plans for ten seconds and then drives wants to know where the
robot is, not where it was ten seconds ago; replies, results and feedback are all kept.
"""

from __future__ import annotations

import threading

from grounding.rosbridge.connection import TooMuch
from grounding.rosbridge.operations import Operation, Publish

_OBJECTS_BYTES = 1000
"""What an operation takes in memory beside its frame, roughly."""


class Inbox:
    """Operations that wait to be taken.

    Args:
        limit_bytes: Of all that waits: its frames, and what small ones take in memory beside.

    Attributes:
        superseded: Messages that were not taken because a newer one of their topic came before.
    """

    def __init__(self, limit_bytes: int) -> None:
        self._limit_bytes = limit_bytes
        self._lock = threading.Lock()
        self._waiting: dict[object, tuple[Operation, int]] = {}
        self._bytes = 0
        self._count = 0
        self.superseded = 0

    def put(self, operation: Operation, size_bytes: int) -> bool:
        """Add an operation whose frame had this size.

        Returns:
            Whether it is the only one: then somebody has to be sent to take it.

        Raises:
            TooMuch: There is no room for it.
        """
        with self._lock:
            self._count += 1
            key: object = operation.topic if isinstance(operation, Publish) else self._count
            _, old_bytes = self._waiting.pop(key, (None, 0))
            self.superseded += old_bytes > 0
            size_bytes += _OBJECTS_BYTES
            self._bytes += size_bytes - old_bytes
            if self._bytes > self._limit_bytes:
                raise TooMuch(f"what came in and is not taken takes {self._bytes} bytes, {self._limit_bytes} may")
            self._waiting[key] = (operation, size_bytes)
            return len(self._waiting) == 1

    def take_all(self) -> list[Operation]:
        """All that waits, in the order in which it came."""
        with self._lock:
            waiting, self._waiting, self._bytes = self._waiting, {}, 0
        return [operation for operation, _ in waiting.values()]
