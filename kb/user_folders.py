"""Where files of a user belong (XDG base directory specification)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

_OURS = "concertmaster"


def cache_folder(environment: Mapping[str, str]) -> Path:
    """Of what can be computed again."""
    return Path(environment.get("XDG_CACHE_HOME") or Path.home() / ".cache") / _OURS


def data_folder(environment: Mapping[str, str]) -> Path:
    """Of what the user gathers."""
    return Path(environment.get("XDG_DATA_HOME") or Path.home() / ".local" / "share") / _OURS
