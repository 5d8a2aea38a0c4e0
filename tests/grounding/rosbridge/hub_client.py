"""A client of a hub, without sockets."""

from __future__ import annotations

from collections import deque

import orjson

from grounding.rosbridge.framing import Decoder, Limits
from grounding.rosbridge.hub import Hub
from grounding.rosbridge.operations import Operation, written
from grounding.rosbridge.outbox import Packet
from grounding.rosbridge.policy import Role
from grounding.rosbridge.session import Session
from kb.clock import SimClock
from tests.grounding.rosbridge.steps import matches


class Client:
    """A client of a hub, that reads at once."""

    def __init__(self, hub: Hub, clock: SimClock, role: Role | None = None) -> None:
        self.hub = hub
        self.frames: deque[str | bytes] = deque()
        self.closed = ""
        self._clock = clock
        self.decoder = Decoder(Limits())
        self.session: Session = hub.connect(self._take, self._close, role or hub.policy.default_role)

    def send(self, op: str, **fields: object) -> None:
        self.hub.take(self.session, orjson.dumps({"op": op, **fields}).decode())

    def next(self) -> tuple[Operation, str]:
        """The next operation, and in what it came."""
        while True:
            assert self.frames, "nothing has come"
            frame = self.frames.popleft()
            kind = "cbor" if isinstance(frame, bytes) else str(orjson.loads(frame)["op"])
            operation = self.decoder.feed(frame, self._clock.now_s)
            if operation is not None:
                return operation, kind if kind in ("cbor", "png", "fragment") else "json"

    def gets(self, op: str, **fields: object) -> dict[str, object]:
        """The fields of the next operation, which has these among others."""
        got = written(self.next()[0])
        assert matches({"op": op, **fields}, got, {}), got
        return got

    def leave(self) -> None:
        self.hub.leave(self.session)

    def _take(self, packet: Packet) -> None:
        self.frames += packet.frames

    def _close(self, reason: str) -> None:
        self.closed = reason
        self.leave()


def advance(clock: SimClock, t_s: float) -> None:
    """Let the time become t_s, and all happen that is due by then."""
    there: list[bool] = []
    clock.call_at(t_s, lambda: there.append(True))
    clock.run_until(lambda: bool(there))
