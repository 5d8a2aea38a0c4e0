"""The services of `canned` in ROS 1: as a program it offers them with the master whose address it is given.

It prints when all are there, and goes on until its standard input ends.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from grounding.ros1.node import Master, Node
from grounding.ros1.services import Services
from grounding.ros1.wire import Wire
from kb.clock import WallClock
from tests.benchmarks.canned import Canned
from tests.contracts.ros_master import HOST, RosMaster


@contextmanager
def far_end_in_ros_1() -> Iterator[Master]:
    """A master, with which a process of its own has registered these services."""
    command = [sys.executable, "-m", "tests.benchmarks.canned_ros1"]
    with (
        tempfile.TemporaryDirectory() as logs,
        RosMaster(Path(logs)) as master,
        subprocess.Popen(
            [*command, master.uri], env=master.environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        ) as server,
    ):
        assert server.stdin is not None
        assert server.stdout is not None
        try:
            server.stdout.readline()
            yield Master(uri=master.uri, host=HOST)
        finally:
            server.stdin.close()


def _serve(uri: str) -> None:
    canned, clock, over = Canned(), WallClock(), threading.Event()
    node = Node(Master(uri=uri, host=HOST), complain=print)
    services = Services(node, Wire(canned.types), clock.post, clock)
    for name, reply in canned.by_service().items():
        services.offer(name, canned.services[name], lambda fields, reply=reply: reply)  # type: ignore[misc]
    node.do(lambda: print("ready", flush=True))
    node.open()

    def wait_for_the_end() -> None:
        sys.stdin.read()
        over.set()
        clock.post(lambda: None)

    threading.Thread(target=wait_for_the_end, daemon=True).start()
    stop_listening = clock.listen()
    clock.run_until(over.is_set)
    stop_listening()
    services.close()
    node.close()


if __name__ == "__main__":
    _serve(sys.argv[1])
