"""Where ROS 2 is: in a Python environment of its own, as its packages have the names of those of ROS 1."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

from kb.errors import DependencyMissing

FOLDER = Path(sys.prefix) / "ros2"
"""Of the environment, inside the one that runs us."""


def ros(module: str) -> Any:
    """A module of ROS 2, such as `rclpy`, in the process that has it; imported when it is first asked for.

    Raises:
        DependencyMissing: This is another process.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise DependencyMissing(f"{module} of ROS 2 is not in this environment, but in that at {FOLDER}") from error


def ros_2_python() -> Path:
    """The Python of the environment in which ROS 2 is installed.

    Raises:
        DependencyMissing: There is none; with the command that makes it.
    """
    python = FOLDER / "bin" / "python"
    if not python.exists():
        told = f"ROS 2 needs a Python environment of its own at {FOLDER}, which is not there"
        raise DependencyMissing(f"{told}: run `python -m grounding.ros2.install`")
    return python
