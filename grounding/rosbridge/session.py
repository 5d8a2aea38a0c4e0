"""One client of a rosbridge server: who it is, what it may still take, and how it is told something."""

from __future__ import annotations

from collections.abc import Callable, Hashable

from grounding.rosbridge.framing import Decoder, frames
from grounding.rosbridge.operations import Operation, Status
from grounding.rosbridge.outbox import Packet
from grounding.rosbridge.policy import Allowance, Role
from grounding.rosbridge.values import Numbers
from kb.errors import ServiceFailed

_LEVELS = ("info", "warning", "error", "none")

Send = Callable[[Packet], None]
Close = Callable[[str], None]


class Refused(ServiceFailed):
    """What a client asks for is not done; `code` is the class of failure that its callers see."""

    fault = "request"


def numbers_in(encoding: str) -> Numbers:
    """What numbers become in trees that go out in an encoding."""
    return "exact" if encoding == "cbor" else "json"


class Session:
    """What the hub knows of a client, as long as it is connected.

    Args:
        name: Its node name, such as `/client_3`.
        role: None if it has not yet said who it is.
        send: Takes what is to be sent to it.
        close: Ends its connection, with the reason.
        now_s: Of the clock.

    Attributes:
        binary: Whether it has sent frames of CBOR, and so reads them.
        throttled_bytes: Of messages that wait for their time, of all its subscriptions.
    """

    def __init__(
        self, name: str, role: Role | None, allowance: Allowance, send: Send, close: Close, now_s: float
    ) -> None:
        self.name, self.role, self.close = name, role, close
        self.decoder = Decoder(allowance.frame)
        self.binary = False
        self.level = "warning"
        self.open = True
        self.throttled_bytes = 0
        self._allowance = allowance
        self._send = send
        self._held: set[Hashable] = set()
        self._spent_s = now_s
        self._messages = allowance.messages_per_s or 0.0
        self._bytes = allowance.bytes_per_s or 0.0
        self._sent = 0

    def spend(self, size: int, now_s: float) -> None:
        """Count a frame of so many bytes.

        Raises:
            Refused: It comes too soon after others.
        """
        allowance, passed_s = self._allowance, now_s - self._spent_s
        self._spent_s = now_s
        if (most := allowance.messages_per_s) is not None:
            self._messages = min(most, self._messages + passed_s * most)
            if self._messages < 1.0:
                raise Refused("TooManyRequests", f"more than {most:g} messages/s come from {self.name}")
            self._messages -= 1.0
        if (most := allowance.bytes_per_s) is not None:
            self._bytes = min(most, self._bytes + passed_s * most)
            if self._bytes < 0.0:
                raise Refused("TooManyRequests", f"more than {most:g} bytes/s come from {self.name}")
            self._bytes -= size

    def hold(self, *key: Hashable) -> None:
        """Count something that takes memory until it is released.

        Raises:
            Refused: There is too much of it.
        """
        if key not in self._held and len(self._held) >= self._allowance.held:
            problem = f"{self.name} has {len(self._held)} subscriptions, offers, calls and goals; end one first"
            raise Refused("TooManyRequests", problem)
        self._held.add(key)

    def release(self, *key: Hashable) -> None:
        """The end of what `hold` counted."""
        self._held.discard(key)

    @property
    def most_throttled_bytes(self) -> int:
        """How much may wait for its time."""
        return self._allowance.outbox_bytes

    def encoding(self, compression: str) -> str:
        """In what a reply goes: as asked for, and in CBOR where nothing is said and the client is known to read it."""
        return "cbor" if compression == "none" and self.binary else compression

    def tell(self, level: str, msg: str, id: str | int | None = None) -> None:  # noqa: A002 - the protocol's word
        """Send a status message, if the client wants those of this level."""
        if _LEVELS.index(level) >= _LEVELS.index(self.level):
            self.answer(Status(level=level, msg=msg, id=id))

    def answer(self, operation: Operation, *, compression: str = "none", fragment_size: int | None = None) -> None:
        """Send what is never dropped."""
        self._sent += 1
        fragment_id = f"{self.name}:{self._sent}"
        parts = frames(operation, compression=compression, fragment_size=fragment_size, fragment_id=fragment_id)
        self.deliver(Packet(frames=tuple(parts)))

    def deliver(self, packet: Packet) -> None:
        """Send a packet, if the client is still there."""
        if self.open:
            self._send(packet)
