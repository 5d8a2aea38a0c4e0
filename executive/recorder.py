"""Writes the trace; the one place where events leave the executive."""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

from executive.trace import TraceEvent, to_json


class Recorder:
    """Keeps all events, and writes each to a file as it comes, if there is one."""

    def __init__(self, path: Path | None) -> None:
        self.events: list[TraceEvent] = []
        self.path = path
        self._stream: TextIO | None = None
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = path.open("w", encoding="utf-8")

    def record(self, event: TraceEvent) -> None:
        """Append an event."""
        self.events.append(event)
        if self._stream is not None:
            self._stream.write(to_json(event) + "\n")

    def close(self) -> None:
        """Write everything out."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None
