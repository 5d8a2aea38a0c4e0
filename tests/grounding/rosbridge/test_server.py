"""The rosbridge server over real sockets: who gets in, HTTP, TLS, slow readers, and the simulated fleet behind it."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import ssl
import urllib.request
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import cbor2
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from grounding.rosbridge.framing import Limits
from grounding.rosbridge.hub import Hub
from grounding.rosbridge.policy import Allowance, Policy, Role
from grounding.rosbridge.server import Server, serve
from grounding.rosbridge.types import Types
from grounding.rosbridge.values import default
from kb.clock import SimClock
from tests.grounding.rosbridge.certificates import self_signed

WAIT_S = 20.0


@pytest.fixture(scope="module")
def types() -> Types:
    """The types, which take a while to read."""
    return Types(2)


@contextmanager
def serving(types: Types, policy: Policy | None = None, **options: Any) -> Iterator[tuple[Hub, Server]]:
    """A hub behind a socket."""
    clock = SimClock()
    hub = Hub(clock, policy=policy, types=types)
    with serve(hub, clock, **options) as server:
        yield hub, server


def on(server: Server, work: Callable[[], Any]) -> Any:
    """Do something on the server's thread."""
    done: Future[Any] = Future()

    def run() -> None:
        done.set_result(work())

    server.post(run)
    return done.result(timeout=WAIT_S)


def ask(client: ClientConnection, op: str, **fields: object) -> None:
    """Send an operation."""
    client.send(json.dumps({"op": op, **fields}))


def get(client: ClientConnection) -> dict[str, Any]:
    """The next operation in JSON."""
    got: dict[str, Any] = json.loads(client.recv(timeout=WAIT_S))
    return got


def call(client: ClientConnection, service: str, **args: object) -> dict[str, Any]:
    """Call a service and wait for the reply."""
    ask(client, "call_service", service=service, id="call", args=args)
    return get(client)


def test_a_call_over_a_socket(types: Types) -> None:
    """A client connects, asks, and gets its answer."""
    with serving(types) as (_, server), connect(server.uri, compression=None) as client:
        assert call(client, "/rosapi/get_ros_version")["values"] == {"version": 2, "distro": "humble"}


def test_a_browser_gets_the_version(types: Types) -> None:
    """A plain HTTP GET is answered in JSON."""
    with serving(types) as (_, server), urllib.request.urlopen(f"http://127.0.0.1:{server.port}/") as response:
        assert response.headers["Content-Type"] == "application/json"
        assert json.load(response)["protocol"] == {"major": 2, "minor": 1, "patch": 0}


def test_a_token_gives_a_role_and_a_wrong_one_is_turned_away(types: Types) -> None:
    """Tokens count in the header and in the address; without one the client is nobody, and is told so."""
    digest = hashlib.sha256(b"hush").hexdigest()
    reader = Role(name="reader", call=("/rosapi/*",), publish=())
    policy = Policy(roles={"reader": reader}, tokens={digest: "reader"}, anybody="")
    with serving(types, policy) as (_, server):
        in_header = connect(server.uri, compression=None, additional_headers={"Authorization": "Bearer hush"})
        in_address = connect(f"{server.uri}/?token=hush", compression=None)
        for client in (in_header, in_address):
            with client:
                assert call(client, "/rosapi/get_time")["result"] is True
                ask(client, "advertise", topic="/x", type="std_msgs/String", id="a1")
                assert "role reader may not publish on topic /x" in get(client)["msg"]
        with pytest.raises(InvalidStatus, match="401"), connect(f"{server.uri}/?token=guess", compression=None):
            pass
        with connect(server.uri, compression=None) as client:
            assert call(client, "/rosapi/get_time")["values"].startswith("NotAllowed: say first who you are")


def test_tls(types: Types, tmp_path: Path) -> None:
    """With a certificate it speaks wss."""
    certificate_file, key_file = self_signed(tmp_path)
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    tls.load_cert_chain(certificate_file, key_file)
    trusting = ssl.create_default_context(cafile=certificate_file)
    with serving(types, tls=tls) as (_, server), connect(server.uri, ssl=trusting, compression=None) as client:
        assert server.uri.startswith("wss://")
        assert call(client, "/rosapi/get_time")["result"] is True


def test_further_clients_than_allowed_are_turned_away(types: Types) -> None:
    """They get an answer of HTTP, and may come again when another has gone."""
    with serving(types, max_sessions=1) as (_, server):
        with (
            connect(server.uri, compression=None),
            pytest.raises(InvalidStatus, match="503"),
            connect(server.uri, compression=None),
        ):
            pass
        # The server notices when its side of the closing is done, which is before the client's.
        with connect(server.uri, compression=None) as client:
            assert call(client, "/rosapi/get_time")["result"] is True


def test_a_frame_that_is_too_large_is_answered_and_a_huge_one_ends_the_connection(types: Types) -> None:
    """The client is told what is wrong as long as the frame can be read at all."""
    policy = Policy(allowance=Allowance(frame=Limits(max_bytes=10_000)))
    with serving(types, policy) as (_, server), connect(server.uri, compression=None) as client:
        client.send("x" * 15_000)
        assert "the frame has 15000 bytes, 10000 are allowed" in get(client)["msg"]
        assert call(client, "/rosapi/get_time")["result"] is True
        client.send("x" * 30_000)
        with pytest.raises(ConnectionClosed) as closed:
            client.recv(timeout=WAIT_S)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1009


def _image(number: int, types: Types) -> object:
    """An image of 400,000 bytes, with its number in the height."""
    message = default("sensor_msgs/Image", types=types)
    return dataclasses.replace(message, height=number, data=np.zeros(400_000, np.uint8))  # type: ignore[type-var]


def test_a_slow_reader_loses_old_messages_but_no_reply(types: Types) -> None:
    """Memory stays bounded; what comes at last is the newest; the client is told how much it missed."""
    allowance = Allowance(outbox_bytes=2_000_000)
    with (
        serving(types, Policy(allowance=allowance)) as (hub, server),
        connect(server.uri, compression=None, max_queue=1, max_size=None) as client,
    ):
        on(server, lambda: hub.topics.offer("/image", "sensor_msgs/Image"))
        ask(client, "subscribe", topic="/image", id="s1", compression="cbor")
        assert call(client, "/rosapi/get_time")["result"] is True
        ask(client, "call_service", service="/rosapi/get_time", id="first")
        for number in range(100):
            on(server, partial(hub.topics.say, "/image", _image(number, types)))
        ask(client, "call_service", service="/rosapi/get_time", id="last")
        before = list(_until(client, "last"))
        ask(client, "call_service", service="/rosapi/get_time", id="end")  # behind what is told of the messages lost
        got = before + list(_until(client, "end"))
    heights = [fields["msg"]["height"] for fields in got if fields["op"] == "publish"]
    assert [fields["id"] for fields in got if fields["op"] == "service_response"] == ["first", "last", "end"]
    assert heights == sorted(heights)
    assert heights[-1] == 99
    assert len(heights) < 100
    lost = [int(fields["msg"].split()[0]) for fields in got if fields["op"] == "status"]
    assert sum(lost) == 100 - len(heights)


def _until(client: ClientConnection, id_: str) -> Iterator[dict[str, Any]]:
    """All that comes up to the reply with this id."""
    while True:
        frame = client.recv(timeout=WAIT_S)
        fields: dict[str, Any] = cbor2.loads(frame) if isinstance(frame, bytes) else json.loads(frame)
        yield fields
        if fields["op"] == "service_response" and fields["id"] == id_:
            return


def _read_on(client: ClientConnection) -> None:
    while True:
        client.recv(timeout=WAIT_S)


def test_who_does_not_read_its_replies_is_sent_away_and_others_are_served(types: Types) -> None:
    """The connection is closed with the reason, within bounded memory."""
    policy = Policy(allowance=Allowance(outbox_bytes=1_000_000, most_outbox_bytes=3_000_000))
    with (
        serving(types, policy) as (hub, server),
        connect(server.uri, compression=None, max_queue=1, max_size=None) as deaf,
        connect(server.uri, compression=None) as other,
    ):
        blob = partial(hub.offer_service, "/blob", {}, {"data": "string"}, lambda _: {"data": "x" * 500_000}, 0.0)
        on(server, blob)
        for _ in range(40):
            ask(deaf, "call_service", service="/blob", args={})
        assert call(other, "/rosapi/get_time")["result"] is True
        with pytest.raises(ConnectionClosed) as closed:
            _read_on(deaf)
        assert call(other, "/rosapi/get_time")["result"] is True
        assert on(server, lambda: hub.sessions) == 1
    if closed.value.rcvd is not None:  # the reason arrives if the client reads on in time
        assert "bytes wait to be read" in closed.value.rcvd.reason


def test_an_error_in_what_follows_the_clock_stops_the_server_and_is_told() -> None:
    """It is not lost in a thread: closing raises it."""
    clock = SimClock()
    server = serve(Hub(clock), clock)

    def fail() -> None:
        raise ZeroDivisionError("the world has ended")

    server.post(fail)
    with pytest.raises(ZeroDivisionError, match="the world has ended"):
        server.close()
    server.close()  # told once


def test_an_address_that_is_taken_is_told_at_once(types: Types) -> None:
    """Making the server raises the system's error."""
    with serving(types) as (_, server):
        clock = SimClock()
        with pytest.raises(OSError, match="address already in use"):
            serve(Hub(clock, types=types), clock, port=server.port)


def test_latency_is_kept_in_real_time(types: Types) -> None:
    """A reply comes no earlier than the service takes."""
    clock = SimClock()
    hub = Hub(clock, types=types)
    hub.offer_service("/slow", {}, {"begun_s": "float64"}, lambda _: {"begun_s": clock.now_s}, 0.2)
    with serve(hub, clock) as server, connect(server.uri, compression=None) as client:
        begun_s = call(client, "/slow")["values"]["begun_s"]
        assert 0.2 <= on(server, lambda: clock.now_s) - begun_s < 5.0
