"""Concertmaster's executive: takes tasks, plans them, has robots do them."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from executive.events import TaskStatus
    from executive.fleet import Fleet, TaskHandle
    from executive.results import TaskResult

__all__ = ["Fleet", "TaskHandle", "TaskResult", "TaskStatus"]

_HOME = {
    "Fleet": "executive.fleet",
    "TaskHandle": "executive.fleet",
    "TaskResult": "executive.results",
    "TaskStatus": "executive.events",
}


def __getattr__(name: str) -> object:
    """Import what is asked for when it is: planning and drawing take two seconds, which commands on knowledge spare."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
