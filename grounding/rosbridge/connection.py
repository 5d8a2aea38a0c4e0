"""One WebSocket to a rosbridge server, kept up by a thread of its own.

It carries frames and knows nothing of what is in them. When it breaks it comes again, after delays that grow
(exponential backoff with jitter); each time it is up counts as a new session, and a frame meant for an earlier
session is not sent in a later one. Whoever uses it is told of all this on the connection's thread.
"""

from __future__ import annotations

import asyncio
import re
import ssl
import threading
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus, InvalidURI, WebSocketException
from websockets.uri import parse_uri

from kb.errors import ConcertmasterError

Frame = str | bytes

_TOKEN = re.compile(r"[!-~]+")
_POLICY_VIOLATION = 1008  # RFC 6455, section 7.4.1


class BadEndpoint(ConcertmasterError):
    """There can be no connection to what an endpoint says."""

    fault = "knowledge"


class NotSent(ConcertmasterError):
    """A frame does not go out: the session is over, or too much waits to go out already."""

    fault = "world"


class TooMuch(ConcertmasterError):
    """The far end sends more than can be taken."""

    fault = "world"


@dataclass(frozen=True, slots=True, kw_only=True)
class Endpoint:
    """Where a rosbridge server is, and how to speak to it.

    Attributes:
        uri: Such as `ws://amigo-1:9090` or `wss://fleet.example.org/rosbridge`.
        token: Sent in the header `Authorization: Bearer ...`.
        ca_file: Certificates (PEM) to trust with `wss`, in place of the system's.
        open_timeout_s: For connecting, TLS and handshake.
        heartbeat_s: Time between two pings, and time for each to be answered; else the connection counts as broken.
        first_delay_s: Before the second try to connect; it doubles from try to try.
        longest_delay_s: Between two tries, but for the jitter.
        max_bytes: Of a frame that comes in.
        outbox_bytes: Of the frames that wait to go out.
    """

    uri: str
    token: str | None = field(default=None, repr=False)
    ca_file: Path | None = None
    open_timeout_s: float = 5.0
    heartbeat_s: float = 10.0
    first_delay_s: float = 0.1
    longest_delay_s: float = 10.0
    max_bytes: int = 64_000_000
    outbox_bytes: int = 256_000_000


class Connection:
    """A WebSocket that comes again.

    Args:
        up: Told the number of a session that begins: 1, 2, ...
        down: Told why a session ended, or why a try to begin one failed.
        heard: Takes each frame; raises TooMuch to end the session.
        rng: For the jitter.

    The three run on the connection's thread and must not block. `down` is told once more when the thread ends.

    Raises:
        BadEndpoint: The address is none, the token cannot stand in a header, or the certificates cannot be read.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        *,
        up: Callable[[int], None],
        down: Callable[[str], None],
        heard: Callable[[Frame], None],
        rng: np.random.Generator,
    ) -> None:
        self._endpoint, self._up, self._down, self._heard, self._rng = endpoint, up, down, heard, rng
        self._tls = _tls_of(endpoint)
        self._thread = threading.Thread(target=self._main, name=f"rosbridge {endpoint.uri}", daemon=True)
        self._lock = threading.Lock()
        self._session: int | None = None  # the one that is up
        self._sessions = 0
        self._outbox: deque[Frame] = deque()
        self._outbox_bytes = 0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._waiting: asyncio.Event | None = None  # frames wait in the outbox
        self._task: asyncio.Task[None] | None = None
        self._started = threading.Event()

    def open(self) -> None:
        """Begin to connect; `up` tells when it is."""
        self._thread.start()
        self._started.wait()

    def close(self) -> None:
        """End it, for good, and wait until it has ended; frames that wait to go out do not."""
        if self._loop is None or self._task is None or not self._thread.is_alive():
            return
        self._loop.call_soon_threadsafe(self._task.cancel)
        self._thread.join()

    def send(self, session: int, frame: Frame) -> None:
        """Put a frame into the outbox, from any thread.

        Raises:
            NotSent: The session is not up any more, or the outbox is full.
        """
        with self._lock:
            if session != self._session or self._loop is None or self._waiting is None:
                raise NotSent(f"there is no connection to {self._endpoint.uri}")
            if self._outbox and self._outbox_bytes + len(frame) > self._endpoint.outbox_bytes:
                raise NotSent(
                    f"{self._endpoint.uri} takes too slowly what it is sent: {self._outbox_bytes} bytes wait to go out"
                )
            first = not self._outbox
            self._outbox.append(frame)
            self._outbox_bytes += len(frame)
            if first:
                self._loop.call_soon_threadsafe(self._waiting.set)

    def _main(self) -> None:
        try:
            asyncio.run(self._keep_up())
        finally:
            self._started.set()

    async def _keep_up(self) -> None:
        self._loop, self._waiting, self._task = asyncio.get_running_loop(), asyncio.Event(), asyncio.current_task()
        self._started.set()
        delays = self._delays()
        try:
            while True:
                begun_s = self._loop.time()
                reason = await self._one_session()
                self._down(reason)
                if self._loop.time() - begun_s > self._endpoint.longest_delay_s:
                    delays = self._delays()  # only now: a server that shuts at once is tried ever more rarely
                await asyncio.sleep(next(delays))
        except asyncio.CancelledError:
            self._down(f"the connection to {self._endpoint.uri} was closed")

    def _delays(self) -> Iterator[float]:
        delay_s = self._endpoint.first_delay_s
        while True:
            yield delay_s * self._rng.uniform(0.5, 1.5)
            delay_s = min(2.0 * delay_s, self._endpoint.longest_delay_s)

    async def _one_session(self) -> str:
        """Connect, and stay so as long as it goes; the reason why it went no further."""
        endpoint = self._endpoint
        headers = {} if endpoint.token is None else {"Authorization": f"Bearer {endpoint.token}"}
        try:
            async with connect(
                endpoint.uri,
                ssl=self._tls,
                additional_headers=headers,
                compression=None,  # costs more time than it saves on the networks of robots
                proxy=None,
                open_timeout=endpoint.open_timeout_s,
                ping_interval=endpoint.heartbeat_s,
                ping_timeout=endpoint.heartbeat_s,
                close_timeout=1.0,
                max_size=endpoint.max_bytes,
            ) as socket:
                return await self._carry(socket)
        except (OSError, EOFError, WebSocketException) as error:
            return f"no connection to {endpoint.uri}: {_reason_of(error)}"

    async def _carry(self, socket: ClientConnection) -> str:
        """Frames both ways until the session ends."""
        with self._lock:
            self._sessions += 1
            self._session = self._sessions
        self._up(self._sessions)
        writer = asyncio.create_task(self._write(socket))
        try:
            async for frame in socket:
                self._heard(frame)
            ended: ConnectionClosed | None = None
        except ConnectionClosed as closed:
            ended = closed
        except TooMuch as much:
            await socket.close(_POLICY_VIOLATION, str(much)[:100])
            return f"gave up the connection to {self._endpoint.uri}: {much}"
        finally:
            with self._lock:
                self._session = None
                self._outbox.clear()
                self._outbox_bytes = 0
            writer.cancel()
            await asyncio.gather(writer, return_exceptions=True)
        why = _reason_of(ended) if ended is not None else "it was closed at the far end"
        return f"lost the connection to {self._endpoint.uri}: {why}"

    async def _write(self, socket: ClientConnection) -> None:
        """Send what is in the outbox; ends with the session, of which reading tells."""
        assert self._waiting is not None
        while True:
            frame = self._take()
            if frame is None:
                await self._waiting.wait()
                continue
            try:
                await socket.send(frame)
            except ConnectionClosed:
                return

    def _take(self) -> Frame | None:
        assert self._waiting is not None
        with self._lock:
            if not self._outbox:
                self._waiting.clear()
                return None
            frame = self._outbox.popleft()
            self._outbox_bytes -= len(frame)
            return frame


def _tls_of(endpoint: Endpoint) -> ssl.SSLContext | None:
    try:
        secure = parse_uri(endpoint.uri).secure
    except InvalidURI as error:
        raise BadEndpoint(f"{endpoint.uri} is no address of a rosbridge server: {error.msg}") from error
    if endpoint.token is not None and not _TOKEN.fullmatch(endpoint.token):
        raise BadEndpoint(f"the token for {endpoint.uri} has spaces, line ends or other characters than ASCII")
    if not secure:
        return None
    try:
        return ssl.create_default_context(cafile=endpoint.ca_file)
    except OSError as error:
        raise BadEndpoint(f"{endpoint.ca_file} holds no certificates to trust: {error}") from error


def _reason_of(error: Exception) -> str:
    match error:
        case ConnectionClosed(rcvd=close) if close is not None:
            return f"it was closed at the far end ({close.code}{': ' if close.reason else ''}{close.reason})"
        case ConnectionClosed(sent=close) if close is not None:
            return f"{close.reason or 'protocol error'} ({close.code})"
        case InvalidStatus():
            return f"the server answers HTTP {error.response.status_code} {error.response.reason_phrase}".rstrip()
        case TimeoutError():
            return "no answer in time"
        case ssl.SSLCertVerificationError():
            return f"its certificate is not trusted: {error.verify_message}"
        case _:
            return str(error) or type(error).__name__
