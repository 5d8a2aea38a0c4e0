"""The sockets of a rosbridge server: one thread, on which also its hub and its clock live.

    hub = Hub(clock)
    with serve(hub, clock, port=9090) as server:
        ...                                # server.post(callback) is the way onto its thread

The clock is simulated time that keeps pace with the real one: what follows it, such as the simulated fleet, moves in
real time. If it cannot keep up, its time goes slower rather than in leaps.

A browser that opens the address gets the version of the protocol in JSON.
"""

from __future__ import annotations

import asyncio
import ssl
import threading
from collections.abc import Callable
from http import HTTPStatus
from types import TracebackType
from typing import Self
from urllib.parse import parse_qs, urlsplit

import orjson
from websockets.asyncio.server import ServerConnection
from websockets.asyncio.server import serve as serve_sockets
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from grounding.rosbridge.hub import Hub
from grounding.rosbridge.outbox import Outbox, Packet, ReadsTooSlowly
from grounding.rosbridge.policy import Role
from grounding.rosbridge.session import Session
from kb.clock import SimClock

_TICK_S = 0.02
_MOST_BEHIND_S = 0.1
_CLOSE_S = 1.0
_POLICY_VIOLATION = 1008
_REASON_BYTES = 123  # no more fit in the frame that closes a connection
_ABOUT = {"protocol": {"major": 2, "minor": 1, "patch": 0}, "server": "concertmaster"}


def serve(
    hub: Hub,
    clock: SimClock,
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    tls: ssl.SSLContext | None = None,
    max_sessions: int = 1000,
) -> Server:
    """Serve a hub to clients over WebSocket, until the server is closed.

    Args:
        clock: That of the hub; nobody else may run it meanwhile.
        port: 0: the system chooses, see `Server.port`.
        tls: With the certificate, for wss.
        max_sessions: Clients at a time; further ones are turned away.

    Raises:
        OSError: The address cannot be had.
    """
    return Server(hub, clock, host=host, port=port, tls=tls, max_sessions=max_sessions)


class Server:
    """Serves from when it is made; see `serve`.

    Attributes:
        port: Where it listens.
    """

    def __init__(
        self, hub: Hub, clock: SimClock, *, host: str, port: int, tls: ssl.SSLContext | None, max_sessions: int
    ) -> None:
        self._hub, self._clock, self._max_sessions = hub, clock, max_sessions
        self._host, self.port, self._tls = host, port, tls
        self._error: Exception | None = None
        self._started = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._stop = asyncio.Event()
        self._origin_s = 0.0
        self._turn_timer: asyncio.TimerHandle | None = None
        self._closings: set[asyncio.Task[None]] = set()
        self._thread = threading.Thread(target=self._run, name="rosbridge server", daemon=True)
        self._thread.start()
        self._started.wait()
        if self._error is not None:
            self._thread.join()
            raise self._error

    @property
    def uri(self) -> str:
        """Where clients connect."""
        return f"{'wss' if self._tls else 'ws'}://{self._host}:{self.port}"

    def post(self, callback: Callable[[], None]) -> None:
        """Run `callback` on the thread of hub and clock, from any thread."""
        self._loop.call_soon_threadsafe(self._do, callback)

    def wait(self) -> None:
        """Wait until the server has stopped: another thread closes it, or an error ended it, which `close` raises."""
        self._thread.join()

    def close(self) -> None:
        """Send all clients away and stop; calling it again does nothing.

        Raises:
            Exception: What the clock's callbacks raised, if that is why the server stopped.
        """
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join()
        if self._error is not None:
            error, self._error = self._error, None
            raise error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _run(self) -> None:
        try:
            with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
                runner.run(self._serve())
        except Exception as error:  # noqa: BLE001 - it goes to who made or closes the server
            self._error = self._error or error
        finally:
            self._started.set()

    async def _serve(self) -> None:
        largest = 2 * self._hub.policy.allowance.frame.max_bytes  # up to here the client is told what is wrong
        async with serve_sockets(
            self._attend,
            self._host,
            self.port,
            ssl=self._tls,
            compression=None,
            max_size=largest,
            close_timeout=_CLOSE_S,
            process_request=self._greet,
        ) as sockets:
            self.port = next(iter(sockets.sockets)).getsockname()[1]
            self._origin_s = self._loop.time() - self._clock.now_s
            self._turn()
            self._started.set()
            await self._stop.wait()
            if self._turn_timer is not None:
                self._turn_timer.cancel()

    def _greet(self, connection: ServerConnection, request: Request) -> Response | None:
        """Let a client in, or answer why not."""
        if request.headers.get("Upgrade", "").lower() != "websocket":
            response = connection.respond(HTTPStatus.OK, orjson.dumps(_ABOUT).decode())
            del response.headers["Content-Type"]
            response.headers["Content-Type"] = "application/json"
            return response
        token = _token(request)
        if token and self._hub.policy.role_of_token(token) is None:
            return connection.respond(HTTPStatus.UNAUTHORIZED, "the token is not known\n")
        if self._hub.sessions >= self._max_sessions:
            return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, f"{self._max_sessions} clients are connected\n")
        return None

    def _role(self, connection: ServerConnection) -> Role | None:
        assert connection.request is not None
        token = _token(connection.request)
        policy = self._hub.policy
        return policy.role_of_token(token) if token else policy.default_role

    async def _attend(self, connection: ServerConnection) -> None:
        """One client, from when it has come until it has gone."""
        allowance = self._hub.policy.allowance
        outbox = Outbox(allowance.outbox_bytes, allowance.most_outbox_bytes)
        filled = asyncio.Event()
        closing = False

        def send(packet: Packet) -> None:
            if closing:
                return
            try:
                outbox.put(packet)
            except ReadsTooSlowly as error:
                close(str(error))
            filled.set()

        def close(reason: str) -> None:
            nonlocal closing
            closing = True
            told = reason.encode()[:_REASON_BYTES].decode(errors="ignore")
            task = self._loop.create_task(connection.close(_POLICY_VIOLATION, told))
            self._closings.add(task)
            task.add_done_callback(self._closings.discard)

        session = self._hub.connect(send, close, self._role(connection))
        writer = self._loop.create_task(_write(connection, outbox, filled, session))
        try:
            async for frame in connection:
                self._advance()
                self._hub.take(session, frame)
                self._plan_turn()
        except ConnectionClosed:
            pass  # in another way than by the book: it is gone all the same
        finally:
            writer.cancel()
            self._hub.leave(session)

    def _turn(self) -> None:
        self._do(lambda: None)

    def _do(self, work: Callable[[], None]) -> None:
        """Do something at the present time. An error in it is ours, or in what follows the clock: the server stops."""
        try:
            self._advance()
            work()
            self._plan_turn()
        except Exception as error:  # noqa: BLE001 - `close` raises it
            self._error = error
            self._stop.set()

    def _advance(self) -> None:
        """Let the clock catch up with real time."""
        clock = self._clock
        behind_s = self._loop.time() - self._origin_s - clock.now_s
        if behind_s > _MOST_BEHIND_S:
            self._origin_s += behind_s - _MOST_BEHIND_S
        t_s = max(round(self._loop.time() - self._origin_s, 9), clock.now_s)
        there: list[bool] = []
        clock.call_at(t_s, lambda: there.append(True))
        clock.run_until(lambda: bool(there))

    def _plan_turn(self) -> None:
        """Wake when the next callback is due, and often enough for what follows the clock."""
        if self._turn_timer is not None:
            self._turn_timer.cancel()
        next_s = self._clock.next_s
        in_s = _TICK_S if next_s is None else min(next_s + self._origin_s - self._loop.time(), _TICK_S)
        self._turn_timer = self._loop.call_later(max(in_s, 0.0), self._turn)


async def _write(connection: ServerConnection, outbox: Outbox, filled: asyncio.Event, session: Session) -> None:
    """Send what is in the outbox, as fast as the client reads."""
    try:
        while True:
            await filled.wait()
            filled.clear()
            while (packet := outbox.pop()) is not None:
                for frame in packet.frames:
                    await connection.send(frame)
                for topic, number in outbox.take_dropped().items():
                    session.tell("warning", f"{number} messages of {topic} were dropped: they are read too slowly")
    except ConnectionClosed:
        pass  # whoever reads from it notices too


def _token(request: Request) -> str:
    """The token of a client, in a header, or for browsers, which have none, in the address; empty if there is none."""
    kind, _, token = request.headers.get("Authorization", "").partition(" ")
    if kind.lower() == "bearer":
        return token.strip()
    return parse_qs(urlsplit(request.path).query).get("token", [""])[0]
