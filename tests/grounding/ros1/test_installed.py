"""Where ROS 1 is not installed, it is said what to install."""

from __future__ import annotations

from pathlib import Path

import pytest

from grounding.ros1 import installed
from kb.errors import DependencyMissing


def test_what_is_missing_is_named_with_the_command_that_installs_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Not before it is used: the module itself is imported without."""
    monkeypatch.setattr(installed, "_SYSTEM", tmp_path)
    with pytest.raises(
        DependencyMissing, match=r"rospy_of_nobody, which is not installed: run `apt-get install python3-rospy"
    ):
        installed.ros("rospy_of_nobody")
