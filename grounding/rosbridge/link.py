"""From operations to the frames of one connection and back, on the clock's thread."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from grounding.rosbridge.connection import Connection, Endpoint, Frame, NotSent
from grounding.rosbridge.dropped import Dropped
from grounding.rosbridge.framing import BadFrame, Decoder, Limits, frames
from grounding.rosbridge.inbox import Inbox
from grounding.rosbridge.operations import BadOperation, Operation
from kb.clock import WallClock

INBOX_BYTES = 256_000_000
FRAGMENT_CHARACTERS = 1_000_000
"""Longer texts go in fragments: servers limit the size of a frame, not that of a message."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Traffic:
    """What has gone over a link since it was made.

    Attributes:
        sent: Frames; so `received`.
        superseded: Messages of topics that were not taken because a newer one came before.
    """

    sent: int
    sent_bytes: int
    received: int
    received_bytes: int
    superseded: int


class Link:
    """Sends operations, and tells of those that come, of sessions that begin, and of sessions that end.

    Args:
        binary: Write frames as CBOR. It is what keeps every bit of a number, but servers other than ours take texts
            only; what comes in is read either way.
        began: Told that a session has begun: nothing of an earlier one holds any more.
        ended: Told why the session is over, or why there is none yet.
        take: Given each operation that comes in.
        dropped: Told of frames that cannot be read.

    All but `close` belongs to the clock's thread, on which also the callbacks run.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        clock: WallClock,
        rng: np.random.Generator,
        *,
        binary: bool,
        began: Callable[[], None],
        ended: Callable[[str], None],
        take: Callable[[Operation], None],
        dropped: Dropped,
    ) -> None:
        self._endpoint, self._clock, self._binary, self._dropped = endpoint, clock, binary, dropped
        self._began, self._ended, self._take = began, ended, take
        self._limits = Limits(max_bytes=endpoint.max_bytes)
        self._decoder = Decoder(self._limits)
        self._inbox = Inbox(INBOX_BYTES)
        self._session: int | None = None
        self._fragmented = 0
        self._sent = self._sent_bytes = 0
        # These are written by the connection's thread alone.
        self._received = self._received_bytes = 0
        self.problem = f"there is no connection to {endpoint.uri} yet"
        self._connection = Connection(endpoint, up=self._up, down=self._down, heard=self._heard, rng=rng)

    def open(self) -> None:
        """Begin to connect."""
        self._connection.open()

    def close(self) -> None:
        """End the connection for good."""
        self._connection.close()

    @property
    def connected(self) -> bool:
        """Whether there is a session, as far as the clock's thread knows."""
        return self._session is not None

    @property
    def traffic(self) -> Traffic:
        """What has gone over it until now."""
        return Traffic(
            sent=self._sent,
            sent_bytes=self._sent_bytes,
            received=self._received,
            received_bytes=self._received_bytes,
            superseded=self._inbox.superseded,
        )

    def send(self, operation: Operation) -> None:
        """Send an operation.

        Raises:
            NotSent: There is no connection, or too much waits to go out.
            BadFrame: It holds what cannot be written.
        """
        if self._session is None:
            raise NotSent(self.problem)
        if self._binary:
            written = frames(operation, compression="cbor")
        else:
            self._fragmented += 1
            name = f"fragment:{self._fragmented}"
            written = frames(operation, fragment_size=FRAGMENT_CHARACTERS, fragment_id=name)
        for frame in written:
            self._connection.send(self._session, frame)
        self._sent += len(written)
        self._sent_bytes += sum(map(len, written))

    # The next three run on the connection's thread.

    def _up(self, session: int) -> None:
        self._decoder = Decoder(self._limits)
        self._clock.post(lambda: self._begin(session))

    def _down(self, reason: str) -> None:
        self._clock.post(lambda: self._end(reason))

    def _heard(self, frame: Frame) -> None:
        self._received += 1
        self._received_bytes += len(frame)
        try:
            operation = self._decoder.feed(frame, self._clock.now_s)
        except (BadFrame, BadOperation) as error:
            self._dropped.note(error.reason)
            return
        if operation is not None and self._inbox.put(operation, len(frame)):
            self._clock.post(self._take_all)

    def _begin(self, session: int) -> None:
        self._session = session
        self._began()

    def _end(self, reason: str) -> None:
        self._session, self.problem = None, reason
        self._ended(reason)

    def _take_all(self) -> None:
        for operation in self._inbox.take_all():
            self._take(operation)
