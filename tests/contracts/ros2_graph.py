"""A graph of ROS 2 for tests, with a robot of rclpy in it."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

from grounding.ros2.installed import ros_2_python

_ROBOT = Path(__file__).parents[1] / "grounding" / "ros2" / "stock_robot.py"
_DOMAINS = 50


@contextmanager
def graph(number: int = 0) -> Iterator[None]:
    """For the processes that are started within: one of this process alone, of two that it may have, 0 and 1."""
    domain = 1 + number * _DOMAINS + os.getpid() % _DOMAINS
    with patch.dict(os.environ, ROS_DOMAIN_ID=str(domain), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST"):
        yield


@contextmanager
def stock_robot() -> Iterator[subprocess.Popen[str]]:
    """A robot that is ready."""
    with subprocess.Popen([str(ros_2_python()), "-P", str(_ROBOT)], stdout=subprocess.PIPE, text=True) as robot:
        try:
            assert robot.stdout is not None
            assert robot.stdout.readline() == "ready\n"
            yield robot
        finally:
            robot.kill()
