"""A real rosmaster for tests, on a port of its own."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Self

from kb.clock import WallClock

HOST = "127.0.0.1"
START_S = 20.0
_STOP_S = 10.0


_LOOK_S = 0.02


def until(clock: WallClock, done: Callable[[], bool], within_s: float, problem: str) -> None:
    """Run the clock until something holds that nobody tells of."""
    late_s = clock.now_s + within_s
    while not done():
        assert clock.now_s < late_s, problem
        looked: list[bool] = []
        clock.call_at(clock.now_s + _LOOK_S, partial(looked.append, True))
        clock.run_until(partial(bool, looked))


class RosMaster:
    """A rosmaster in a process, until the end of `with`.

    Args:
        folder: Where ROS writes its logs.
    """

    def __init__(self, folder: Path) -> None:
        with socket.socket() as free:
            free.bind((HOST, 0))
            self.port = int(free.getsockname()[1])
        self._folder = folder
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def uri(self) -> str:
        """Its address."""
        return f"http://{HOST}:{self.port}"

    @property
    def environment(self) -> dict[str, str]:
        """For processes that shall use it."""
        return {**os.environ, "ROS_MASTER_URI": self.uri, "ROS_IP": HOST, "ROS_HOME": str(self._folder)}

    def start(self) -> None:
        """Start it; it listens when this returns."""
        program = shutil.which("rosmaster")
        assert program is not None, "rosmaster is missing: run `make extras`, or leave out -m ros1"
        self._process = subprocess.Popen(
            [program, "--core", "-p", str(self.port)],
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        clock = WallClock()
        until(clock, self._listens, START_S, "rosmaster does not listen")

    def _listens(self) -> bool:
        assert self._process is not None
        assert self._process.poll() is None, "rosmaster has ended"
        with suppress(ConnectionRefusedError), socket.create_connection((HOST, self.port)):
            return True
        return False

    def stop(self) -> None:
        """End it at once, as when its computer goes off."""
        if self._process is not None:
            self._process.kill()
            self._process.wait(_STOP_S)
            self._process = None

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
