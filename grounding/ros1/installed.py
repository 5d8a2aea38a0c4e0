"""ROS 1's own Python packages, which Debian installs for the system's Python, and which cannot be had from PyPI."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

from kb.errors import DependencyMissing

_SYSTEM = Path("/usr/lib/python3/dist-packages")


def ros(module: str) -> Any:
    """A module of ROS 1, such as `rospy`; imported when it is first asked for, as most users have none.

    Where this Python does not know it but the system's does, the system's packages are looked up too, after all
    others: they are pure Python and the project's own versions of libraries stay in force.

    Raises:
        DependencyMissing: It is not installed; with the command that installs it.
    """
    system = str(_SYSTEM)
    if not _found("rospy") and (_SYSTEM / "rospy").is_dir() and system not in sys.path:
        sys.path.append(system)
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        told = f"ROS 1 needs the Python package {error.name}, which is not installed"
        raise DependencyMissing(f"{told}: run `apt-get install python3-rospy python3-std-msgs`") from error


def _found(module: str) -> bool:
    return importlib.util.find_spec(module) is not None
