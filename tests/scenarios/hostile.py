"""Stands between the executive and a rosbridge server, and spoils what the server says."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.sync.server import ServerConnection, serve

Spoil = Callable[[str], list[str]]
"""What is passed on instead of a frame of the server."""


@dataclass(kw_only=True)
class Hostile:
    """Listens on a port of its own, and passes all on to another server.

    Attributes:
        port: Where it listens, on the loopback.
        spoil: Applied to what the server says; may be changed while connections are there.
    """

    port: int
    spoil: Spoil


@contextmanager
def hostile(to_port: int) -> Iterator[Hostile]:
    """Spoil nothing at first."""
    between = Hostile(port=0, spoil=lambda frame: [frame])

    def connected(executive: ServerConnection) -> None:
        with connect(f"ws://127.0.0.1:{to_port}", max_size=None) as robots:
            back = threading.Thread(target=_pass_back, args=[robots, executive, between])
            back.start()
            with suppress(ConnectionClosed):  # the executive has had enough
                for frame in executive:
                    robots.send(frame)
        back.join()

    with serve(connected, "127.0.0.1", 0, max_size=None) as server:
        between.port = server.socket.getsockname()[1]
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield between
        finally:
            server.shutdown()
            thread.join()


def _pass_back(robots: ClientConnection, executive: ServerConnection, between: Hostile) -> None:
    with suppress(ConnectionClosed):
        for frame in robots:
            assert isinstance(frame, str), "the executive has asked for text"
            for spoiled in between.spoil(frame):
                executive.send(spoiled)
