"""A far end for rosbridge clients that does what a test says, also what no server should do."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Mapping, Sequence
from itertools import product
from types import TracebackType

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from grounding.inprocess import Handler
from grounding.rosbridge.framing import Decoder, Limits, frames
from grounding.rosbridge.operations import (
    CallService,
    Operation,
    Publish,
    ServiceResponse,
)
from grounding.rosbridge.types import ServiceType, Types
from grounding.rosbridge.values import Numbers, fields_from_tree, fields_to_tree, to_tree
from kb.errors import ServiceFailed

LIMITS = Limits(max_bytes=64_000_000)

Answer = Callable[[Operation], list[Operation | str | bytes] | None]
"""What to send when an operation comes; None for what the far end does by itself."""


class FarEnd:
    """Services and topics behind a real socket, on a thread of its own; what one client publishes all others get.

    Attributes:
        came: All operations that have come, in order.
        answer: May be set by a test to answer otherwise than by the services that were offered.
    """

    def __init__(self, types: Types, port: int = 0) -> None:
        self._types = types
        self.port = port
        self.came: list[Operation] = []
        self.answer: Answer = lambda operation: None
        self._services: dict[str, tuple[ServiceType, Handler, float]] = {}
        self._outboxes: dict[ServerConnection, asyncio.Queue[str | bytes]] = {}
        self._started = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()), name="far end")
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stop: asyncio.Event | None = None

    def __enter__(self) -> FarEnd:
        self._thread.start()
        assert self._started.wait(20.0)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._loop is not None
        assert self._stop is not None
        self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join()

    @property
    def uri(self) -> str:
        """Where it listens."""
        return f"ws://127.0.0.1:{self.port}"

    def offer(self, name: str, service_type: ServiceType, handler: Handler, latency_s: float = 0.0) -> None:
        """Answer the calls of a service by a function."""
        self._services[name] = (service_type, handler, latency_s)

    def send(self, *sent: Operation | str | bytes, binary: bool = True) -> None:
        """Send operations or frames to all clients, from any thread."""
        assert self._loop is not None
        self._loop.call_soon_threadsafe(lambda: self._send(list(self._outboxes), sent, binary))

    def publish(self, topic: str, message: object) -> None:
        """Send a message to all clients that are there."""
        self.send(Publish(topic=topic, msg=to_tree(message, numbers="exact", types=self._types)))

    def break_connections(self) -> None:
        """As when a cable is pulled: no farewell."""
        assert self._loop is not None
        self._loop.call_soon_threadsafe(self._abort_all)

    def _abort_all(self) -> None:
        for peer in self._outboxes:
            peer.transport.abort()

    async def _serve(self) -> None:
        self._loop, self._stop = asyncio.get_running_loop(), asyncio.Event()
        async with serve(
            self._attend, "127.0.0.1", self.port, compression=None, max_size=LIMITS.max_bytes, close_timeout=0.2
        ) as server:
            self.port = next(iter(server.sockets)).getsockname()[1]
            self._started.set()
            await self._stop.wait()

    async def _attend(self, peer: ServerConnection) -> None:
        decoder = Decoder(LIMITS)
        self._outboxes[peer] = asyncio.Queue()
        writer = asyncio.create_task(self._write(peer))
        try:
            async for frame in peer:
                operation = decoder.feed(frame, 0.0)
                if operation is not None:
                    self._take(peer, operation, binary=isinstance(frame, bytes))
        except ConnectionClosed:
            pass
        finally:
            writer.cancel()
            del self._outboxes[peer]

    def _take(self, peer: ServerConnection, operation: Operation, *, binary: bool) -> None:
        self.came.append(operation)
        answers = self.answer(operation)
        if answers is not None:
            self._send([peer], answers, binary)
        elif isinstance(operation, Publish):
            self._send([other for other in self._outboxes if other is not peer], [operation], binary)
        elif isinstance(operation, CallService):
            response, latency_s = self._response(operation, binary=binary)
            asyncio.get_running_loop().call_later(latency_s, self._send, [peer], [response], binary)

    def _response(self, call: CallService, *, binary: bool) -> tuple[ServiceResponse, float]:
        if call.service not in self._services:
            known = ", ".join(sorted(self._services))
            text = f"NoSuchService: there is no service {call.service}; there is {known}"
            return ServiceResponse(service=call.service, id=call.id, result=False, values=text), 0.0
        service_type, handler, latency_s = self._services[call.service]
        request = fields_from_tree(service_type.request, call.args, now_s=0.0, types=self._types)
        try:
            reply: Mapping[str, object] = handler(request)
        except ServiceFailed as failed:
            return ServiceResponse(service=call.service, id=call.id, result=False, values=str(failed)), latency_s
        numbers: Numbers = "exact" if binary else "json"
        tree = fields_to_tree(service_type.reply, reply, numbers=numbers, types=self._types)
        return ServiceResponse(service=call.service, id=call.id, result=True, values=tree), latency_s

    def _send(self, peers: list[ServerConnection], sent: Sequence[Operation | str | bytes], binary: bool) -> None:
        """Put frames into the order of sending, for those who are still there; a task each would not keep it."""
        for one in sent:
            written = [one] if isinstance(one, str | bytes) else frames(one, compression="cbor" if binary else "none")
            for peer, frame in product(peers, written):
                if peer in self._outboxes:
                    self._outboxes[peer].put_nowait(frame)

    async def _write(self, peer: ServerConnection) -> None:
        try:
            while True:
                await peer.send(await self._outboxes[peer].get())
        except ConnectionClosed:
            return
