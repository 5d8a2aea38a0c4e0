"""What is said where ROS 2 is missing or does not come up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from grounding.ros2 import client, installed
from grounding.ros2.client import NoBridge, Ros2Transport
from grounding.rosbridge.types import Types
from kb.clock import WallClock
from kb.errors import DependencyMissing


def _transport() -> Ros2Transport:
    return Ros2Transport(WallClock(), services={}, types=Types(), rng=np.random.default_rng(1))


def test_where_it_is_missing_the_command_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The one that installs it."""
    monkeypatch.setattr(installed, "FOLDER", tmp_path / "ros2")
    with pytest.raises(DependencyMissing, match=r"ros2, which is not there: run `python -m grounding\.ros2\.install`"):
        _transport()


def test_a_process_that_does_not_come_up_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """And not waited for."""
    monkeypatch.setattr(client, "ros_2_python", lambda: Path("/bin/false"))
    with pytest.raises(NoBridge, match="the process with ROS 2 has ended"):
        _transport()
