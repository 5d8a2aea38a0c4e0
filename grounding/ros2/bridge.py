"""The process that has ROS 2: a rosbridge server on the loopback, behind which is the graph of ROS 2.

Run by client.py with the Python of ROS 2's own environment. It reads the token of its only client from its input,
tells the address of the server once it knows who is in the graph, and ends when its input does: so it never outlives
who started it.
"""

from __future__ import annotations

import hashlib
import os
import sys
import threading
from contextlib import suppress

from grounding.ros2.graph import Follower
from grounding.ros2.interfaces import InstalledTypes
from grounding.ros2.node import Callback, Graph, Node
from grounding.rosbridge.framing import Limits
from grounding.rosbridge.hub import Hub
from grounding.rosbridge.policy import Allowance, Policy, Role
from grounding.rosbridge.server import Server, serve
from kb.clock import SimClock, Stopwatch

_LIMITS = Limits(max_bytes=64_000_000)
_HELD = 10_000
"""Of services and actions in the graph, and of calls and goals that are open."""

_DISCOVERY_S = 4.0
"""Fast DDS says every 3 s who is there: by then all have, and told what they offer."""

_SETTLED_S = 1.0
"""And the graph has not changed for so long."""

_UNSETTLED_S = 10.0
"""A graph that keeps changing is used all the same."""


class _Settling:
    """Waits until a graph changes no more."""

    def __init__(self) -> None:
        self._changed = threading.Event()
        self._over = False

    def note(self) -> None:
        self._changed.set()

    def end(self) -> None:
        """Wait no more."""
        self._over = True
        self._changed.set()

    def wait(self) -> None:
        watch = Stopwatch()
        while self._changed.wait(_SETTLED_S) or watch.wall_s < _DISCOVERY_S:
            self._changed.clear()
            if self._over or watch.wall_s > _UNSETTLED_S:
                return


def main() -> None:
    """Serve until the input ends."""
    token = sys.stdin.readline().strip()
    role = Role(name="executive", offer=())
    policy = Policy(
        roles={role.name: role},
        tokens={hashlib.sha256(token.encode()).hexdigest(): role.name},
        anybody="",
        allowance=Allowance(frame=_LIMITS, held=_HELD),
    )
    clock, types, settling = SimClock(), InstalledTypes(), _Settling()
    hub = Hub(clock, policy=policy, types=types)

    def tell(callback: Callback) -> None:
        with suppress(RuntimeError):  # the server has stopped
            server.post(callback)

    node = Node(f"concertmaster_{os.getpid()}", tell)
    follower = Follower(hub, types, clock, _LIMITS, node)

    def follow(graph: Graph) -> None:
        settling.note()
        follower.follow(graph)

    server = serve(hub, clock)
    node.start(follow)
    threading.Thread(target=_close_at_end_of_input, args=(server, settling), daemon=True).start()
    settling.wait()
    with suppress(BrokenPipeError):  # who started us is gone, as our input says too
        sys.stdout.write(f"{server.uri}\n")
        sys.stdout.flush()
    server.wait()
    node.close()
    server.close()


def _close_at_end_of_input(server: Server, settling: _Settling) -> None:
    while os.read(sys.stdin.fileno(), 1024):
        pass
    settling.end()
    server.close()
