"""What waits to be sent to one client that reads more slowly than it is written to.

Messages of topics give way, oldest first; replies never do. A client that does not even read its replies is given up.
"""

from __future__ import annotations

from collections import Counter, OrderedDict, defaultdict, deque
from collections.abc import Mapping
from dataclasses import dataclass

from kb.errors import ConcertmasterError

_PACKET_BYTES = 500


class ReadsTooSlowly(ConcertmasterError):
    """Even without messages of topics more waits than is allowed."""

    fault = "world"


@dataclass(frozen=True, slots=True, kw_only=True)
class Packet:
    """The frames of one operation, which are sent one after the other.

    Attributes:
        topic: Of a message that may be dropped; empty for all else.
        queue_length: How many messages of this topic may wait; 0 if only the bytes count.
    """

    frames: tuple[str | bytes, ...]
    topic: str = ""
    queue_length: int = 0

    @property
    def size(self) -> int:
        """Characters and bytes, and what it takes to keep them."""
        return sum(map(len, self.frames)) + _PACKET_BYTES


class Outbox:
    """First in, first out, within limits.

    Args:
        soft_bytes: From here on the oldest messages of topics are dropped.
        hard_bytes: Replies may wait up to here.
    """

    def __init__(self, soft_bytes: int, hard_bytes: int) -> None:
        self._soft_bytes, self._hard_bytes = soft_bytes, hard_bytes
        self._packets: OrderedDict[int, Packet] = OrderedDict()
        self._droppable: deque[int] = deque()
        self._of_topic: defaultdict[str, deque[int]] = defaultdict(deque)
        self._dropped: Counter[str] = Counter()
        self._count = 0
        self.waiting_bytes = 0

    def __len__(self) -> int:
        return len(self._packets)

    def put(self, packet: Packet) -> None:
        """Add a packet at the end.

        Raises:
            ReadsTooSlowly: There is too much, and nothing that may be dropped.
        """
        self._count += 1
        self._packets[self._count] = packet
        self.waiting_bytes += packet.size
        if packet.topic:
            self._droppable.append(self._count)
            of_topic = self._of_topic[packet.topic]
            of_topic.append(self._count)
            if packet.queue_length and len(of_topic) > packet.queue_length:
                self._drop(of_topic[0])
        while self.waiting_bytes > self._soft_bytes and self._droppable and self._droppable[0] != self._count:
            self._drop(self._droppable.popleft())
        if self.waiting_bytes > self._hard_bytes:
            problem = f"{self.waiting_bytes} bytes wait to be read, {self._hard_bytes} may"
            raise ReadsTooSlowly(problem)

    def pop(self) -> Packet | None:
        """Take the first packet out; None if there is none."""
        return self._take(next(iter(self._packets))) if self._packets else None

    def take_dropped(self) -> Mapping[str, int]:
        """How many messages were dropped since this was asked last, by topic."""
        dropped, self._dropped = self._dropped, Counter()
        return dropped

    def _drop(self, number: int) -> None:
        if number in self._packets:  # else it was sent, or dropped already
            self._dropped[self._take(number).topic] += 1

    def _take(self, number: int) -> Packet:
        packet = self._packets.pop(number)
        self.waiting_bytes -= packet.size
        if packet.topic:
            of_topic = self._of_topic[packet.topic]  # its packets leave in their order
            of_topic.popleft()
            if not of_topic:
                del self._of_topic[packet.topic]
            while self._droppable and self._droppable[0] not in self._packets:
                self._droppable.popleft()
        return packet
