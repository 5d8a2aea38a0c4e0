"""The connection: frames both ways, sessions that end and come again, over real sockets."""

from __future__ import annotations

import queue
import socket
import ssl
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.sync.server import Server, ServerConnection, serve
from websockets.utils import accept_key

from grounding.rosbridge.connection import BadEndpoint, Connection, Endpoint, Frame, NotSent, TooMuch
from tests.grounding.rosbridge.certificates import self_signed

WAIT_S = 20.0

Handler = Callable[[ServerConnection], None]


def echo(peer: ServerConnection) -> None:
    """Send back what comes; end at the frame `close`."""
    try:
        for frame in peer:
            if frame == "close":
                peer.close(4001, "enough of this")
                return
            peer.send(frame)
    except ConnectionClosed:
        return


@contextmanager
def serving(
    handler: Handler,
    *,
    port: int = 0,
    tls: ssl.SSLContext | None = None,
    check: Callable[[ServerConnection, Request], Response | None] | None = None,
    max_size: int | None = None,
) -> Iterator[Server]:
    """A server on a thread of its own."""
    with serve(
        handler, "127.0.0.1", port, ssl=tls, process_request=check, max_size=max_size, compression=None
    ) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


def port_of(server: Server) -> int:
    """Where it listens."""
    port: int = server.socket.getsockname()[1]
    return port


def endpoint(port: int, *, scheme: str = "ws", token: str | None = None, ca_file: Path | None = None) -> Endpoint:
    """One with short times."""
    return Endpoint(
        uri=f"{scheme}://localhost:{port}" if scheme == "wss" else f"ws://127.0.0.1:{port}",
        token=token,
        ca_file=ca_file,
        heartbeat_s=0.2,
        first_delay_s=0.01,
        longest_delay_s=0.05,
        outbox_bytes=1_000_000,
    )


class Told:
    """What a connection tells, in order; waits with a limit."""

    def __init__(self) -> None:
        self.ups: queue.Queue[int] = queue.Queue()
        self.downs: queue.Queue[str] = queue.Queue()
        self.frames: queue.Queue[Frame] = queue.Queue()

    def connect(self, where: Endpoint) -> Connection:
        """A connection that tells this."""
        made = Connection(
            where, up=self.ups.put, down=self.downs.put, heard=self.frames.put, rng=np.random.default_rng(1)
        )
        made.open()
        return made


@pytest.fixture
def told() -> Told:
    """Nothing yet."""
    return Told()


def test_frames_go_both_ways_in_order_as_they_are(told: Told) -> None:
    """Texts stay texts and bytes bytes, also large ones."""
    sent: list[Frame] = [*(f"text {number}" for number in range(100)), b"\x00\xff", bytes(10_000_000), "the last"]
    with serving(echo) as server, closing(told.connect(endpoint(port_of(server)))) as connection:
        session = told.ups.get(timeout=WAIT_S)
        heard = []
        for frame in sent:
            connection.send(session, frame)
            heard.append(told.frames.get(timeout=WAIT_S))
        assert heard == sent


def test_the_end_of_a_session_is_told_with_its_reason_and_it_comes_again(told: Told) -> None:
    """What the far end says is in it; the next session has the next number."""
    with serving(echo) as server, closing(told.connect(endpoint(port_of(server)))) as connection:
        first = told.ups.get(timeout=WAIT_S)
        connection.send(first, "close")
        uri = f"ws://127.0.0.1:{port_of(server)}"
        assert told.downs.get(timeout=WAIT_S) == (
            f"lost the connection to {uri}: it was closed at the far end (4001: enough of this)"
        )
        second = told.ups.get(timeout=WAIT_S)
        assert second == first + 1
        connection.send(second, "hello")
        assert told.frames.get(timeout=WAIT_S) == "hello"


def test_a_frame_for_a_session_that_is_over_is_not_sent(told: Told) -> None:
    """Neither before the first, nor in a later one, nor after the end."""
    with serving(echo) as server:
        connection = told.connect(endpoint(port_of(server)))
        with pytest.raises(NotSent, match="there is no connection to ws://127"):
            connection.send(0, "too early")
        first = told.ups.get(timeout=WAIT_S)
        connection.send(first, "close")
        told.ups.get(timeout=WAIT_S)
        with pytest.raises(NotSent):
            connection.send(first, "too late")
        connection.close()
        with pytest.raises(NotSent):
            connection.send(first + 1, "after the end")
        assert told.frames.empty()


def test_it_is_tried_again_until_there_is_a_server(told: Told) -> None:
    """Each failed try says why."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with closing(told.connect(endpoint(port))):
        for _ in range(2):
            reason = told.downs.get(timeout=WAIT_S)
            assert reason.startswith(f"no connection to ws://127.0.0.1:{port}: ")
            assert "refused" in reason.lower() or "Connect call failed" in reason
        with serving(echo, port=port):
            assert told.ups.get(timeout=WAIT_S) == 1


def test_a_server_that_has_died_is_noticed_by_the_heartbeat(told: Told) -> None:
    """It took the connection and says nothing more, as a robot out of reach."""
    dead = threading.Event()

    def handshake_only(listener: socket.socket) -> None:
        peer, _ = listener.accept()
        with peer:
            request = peer.recv(65536).decode()
            key = next(line.split(": ")[1] for line in request.split("\r\n") if line.startswith("Sec-WebSocket-Key"))
            accept = accept_key(key)
            peer.sendall(
                f"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                f"Sec-WebSocket-Accept: {accept}\r\n\r\n".encode()
            )
            dead.wait(WAIT_S)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=handshake_only, args=(listener,))
        thread.start()
        with closing(told.connect(endpoint(listener.getsockname()[1]))):
            told.ups.get(timeout=WAIT_S)
            assert "ping timeout" in told.downs.get(timeout=WAIT_S)
            dead.set()
    thread.join()


def test_the_outbox_is_bounded(told: Told) -> None:
    """Towards one who does not read, sending is refused at the limit, with the reason."""
    stop = threading.Event()

    def reads_nothing(peer: ServerConnection) -> None:
        stop.wait(WAIT_S)

    with serving(reads_nothing) as server, closing(told.connect(endpoint(port_of(server)))) as connection:
        session = told.ups.get(timeout=WAIT_S)
        with pytest.raises(NotSent, match=r"takes too slowly what it is sent: \d+ bytes wait to go out"):  # noqa: PT012
            for _ in range(1000):
                connection.send(session, bytes(100_000))
        stop.set()


def test_what_has_gone_out_makes_room_in_the_outbox(told: Told) -> None:
    """Over time more goes out than may wait at once."""
    with serving(echo) as server, closing(told.connect(endpoint(port_of(server)))) as connection:
        session = told.ups.get(timeout=WAIT_S)
        for _ in range(30):
            connection.send(session, bytes(100_000))
            connection.send(session, bytes(100_000))
            told.frames.get(timeout=WAIT_S)
            told.frames.get(timeout=WAIT_S)


def test_what_waits_to_go_out_is_gone_with_its_session(told: Told) -> None:
    """The next begins with nothing."""
    stop, got, visits = threading.Event(), queue.Queue[Frame](), count(1)

    def reads_only_the_second_time(peer: ServerConnection) -> None:
        if next(visits) == 1:
            stop.wait(WAIT_S)
            peer.socket.shutdown(socket.SHUT_RDWR)
            return
        got.put(peer.recv())

    with serving(reads_only_the_second_time) as server:
        patient = replace(endpoint(port_of(server)), heartbeat_s=WAIT_S)
        connection = told.connect(patient)
        first = told.ups.get(timeout=WAIT_S)
        with suppress(NotSent):
            for _ in range(1000):
                connection.send(first, bytes(100_000))
        stop.set()
        connection.send(told.ups.get(timeout=WAIT_S), "hello")
        assert got.get(timeout=WAIT_S) == "hello"
        connection.close()


def test_who_hears_too_much_ends_the_session() -> None:
    """The far end is told why."""
    told, said = Told(), queue.Queue[str]()

    def babble(peer: ServerConnection) -> None:
        try:
            while True:
                peer.send("blah")
        except ConnectionClosed as closed:
            said.put(closed.rcvd.reason if closed.rcvd else "")

    def heard(frame: Frame) -> None:
        raise TooMuch("it babbles")

    with serving(babble) as server:
        connection = Connection(
            endpoint(port_of(server)), up=told.ups.put, down=told.downs.put, heard=heard, rng=np.random.default_rng(1)
        )
        connection.open()
        with closing(connection):
            assert told.downs.get(timeout=WAIT_S).startswith("gave up the connection to ws://127")
            assert said.get(timeout=WAIT_S) == "it babbles"


def test_the_token_goes_with_the_handshake(told: Told) -> None:
    """A wrong one is told as what the server answers; it is not shown where the endpoint is."""

    def check(peer: ServerConnection, request: Request) -> Response | None:
        return None if request.headers.get("Authorization") == "Bearer right" else peer.respond(401, "who are you?")

    with serving(echo, check=check) as server:
        right, wrong = (endpoint(port_of(server), token=token) for token in ("right", "wrong"))
        assert "right" not in repr(right)
        with closing(told.connect(right)):
            assert told.ups.get(timeout=WAIT_S) == 1
        told.downs.get(timeout=WAIT_S)
        with closing(told.connect(wrong)):
            assert told.downs.get(timeout=WAIT_S).endswith("the server answers HTTP 401 Unauthorized")


def test_tls_trusts_what_it_is_told_to_and_nothing_else(told: Told, tmp_path: Path) -> None:
    """A certificate that is not trusted is told as such."""
    certificate_file, key_file = self_signed(tmp_path)
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    tls.load_cert_chain(certificate_file, key_file)
    with serving(echo, tls=tls) as server:
        trusting = endpoint(port_of(server), scheme="wss", ca_file=certificate_file)
        with closing(told.connect(trusting)) as connection:
            connection.send(told.ups.get(timeout=WAIT_S), "secret")
            assert told.frames.get(timeout=WAIT_S) == "secret"
        told.downs.get(timeout=WAIT_S)
        with closing(told.connect(endpoint(port_of(server), scheme="wss"))):
            assert "its certificate is not trusted: self" in told.downs.get(timeout=WAIT_S)


@pytest.mark.parametrize("uri", ["http://localhost:9090", "localhost:9090", "ws://"])
def test_an_address_that_is_none_is_refused_at_once(uri: str) -> None:
    """By its name."""
    with pytest.raises(BadEndpoint, match=f"^{uri} is no address of a rosbridge server: "):
        Told().connect(Endpoint(uri=uri))


def test_a_token_that_would_break_the_header_is_refused_at_once() -> None:
    """Such as one read from a file with its line end; it is not shown."""
    with pytest.raises(BadEndpoint, match=r"^the token for ws://localhost has spaces, line ends") as caught:
        Told().connect(Endpoint(uri="ws://localhost", token="secret\n"))
    assert "secret" not in str(caught.value)


def test_a_missing_file_of_certificates_is_refused_at_once(tmp_path: Path) -> None:
    """By its name."""
    with pytest.raises(BadEndpoint, match=r"absent\.pem holds no certificates to trust: "):
        Told().connect(Endpoint(uri="wss://localhost", ca_file=tmp_path / "absent.pem"))


def test_close_ends_the_thread_whatever_it_does(told: Told) -> None:
    """While connected, while waiting to try again, and twice."""
    with serving(echo) as server:
        connection = told.connect(endpoint(port_of(server)))
        told.ups.get(timeout=WAIT_S)
    told.downs.get(timeout=WAIT_S)
    connection.close()
    connection.close()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("rosbridge")]
