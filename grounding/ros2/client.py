"""The transport to a graph of ROS 2: our rosbridge client, and a process of its own that has ROS 2 at the other end."""

from __future__ import annotations

import os
import secrets
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Self

import numpy as np

from grounding.ros2.installed import ros_2_python
from grounding.rosbridge.client import RosbridgeTransport
from grounding.rosbridge.connection import Endpoint
from grounding.rosbridge.types import ActionType, ServiceType, Types
from kb.clock import WallClock
from kb.errors import ConcertmasterError

_PROGRAM = "import sys; sys.path += sys.argv[1:]; from grounding.ros2.bridge import main; main()"
_STOP_S = 5.0


class NoBridge(ConcertmasterError):
    """The process that has ROS 2 does not come up."""

    fault = "world"


class Ros2Transport(RosbridgeTransport):
    """Calls, goals and topics of the nodes of ROS 2 that are in reach: those of the environment's ROS_DOMAIN_ID.

    Making one starts the process and waits some seconds, until the nodes are known. For the arguments and the rest see
    RosbridgeTransport.

    Raises:
        DependencyMissing: ROS 2 is not installed.
        NoBridge: The process does not come up.
    """

    def __init__(
        self,
        clock: WallClock,
        *,
        services: Mapping[str, ServiceType],
        actions: Mapping[str, ActionType] | None = None,
        types: Types,
        rng: np.random.Generator,
    ) -> None:
        self._bridge = _Bridge()
        endpoint = Endpoint(uri=self._bridge.uri, token=self._bridge.token)
        super().__init__(endpoint, clock, services=services, actions=actions, types=types, binary=True, rng=rng)

    def __enter__(self) -> Self:
        super().__enter__()
        return self

    def close(self) -> None:
        super().close()
        self._bridge.close()


class _Bridge:
    """The process; it ends with us, however we end, as its input does.

    Attributes:
        uri: Of its server.
        token: For it: others on this machine shall not drive our robots.
    """

    def __init__(self) -> None:
        python = ros_2_python()
        self.token = secrets.token_urlsafe()
        # What ROS 2 does not bring comes from the environment that runs us, which has the same version of Python.
        roots = [str(Path(__file__).parents[2]), *(path for path in sys.path if path.endswith("site-packages"))]
        self._process = subprocess.Popen(
            [str(python), "-P", "-c", _PROGRAM, *roots],
            env={name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,  # Ctrl-C is for us; it ends when we say so
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            self._process.stdin.write(f"{self.token}\n")
            self._process.stdin.flush()
            self.uri = self._process.stdout.readline().strip()
        except BaseException as error:
            self.close()
            if isinstance(error, BrokenPipeError):
                raise NoBridge("the process with ROS 2 has ended before it could be used (see above)") from error
            raise
        if not self.uri:
            self.close()
            raise NoBridge(f"the process with ROS 2 has ended with status {self._process.returncode} (see above)")

    def close(self) -> None:
        """End it; calling this again does nothing."""
        try:
            self._process.communicate(timeout=_STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.communicate()
