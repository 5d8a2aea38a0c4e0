"""Writes the trace; the one place where events leave the executive."""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

from executive.trace import FleetOpened, TraceEvent, to_json


class Recorder:
    """Keeps all events, and writes each to a file as it comes, if there is one.

    The file is made with the first task: a fleet that was opened in vain leaves nothing behind.
    """

    def __init__(self, path: Path | None) -> None:
        self.events: list[TraceEvent] = []
        self._path = path
        self._stream: TextIO | None = None

    def record(self, event: TraceEvent) -> None:
        """Append an event."""
        self.events.append(event)
        if self._stream is not None:
            self._stream.write(to_json(event) + "\n")
        elif self._path is not None and not isinstance(event, FleetOpened):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = self._path.open("w", encoding="utf-8", buffering=1)  # a killed process leaves its trace
            self._stream.writelines(to_json(earlier) + "\n" for earlier in self.events)

    def close(self) -> None:
        """Write everything out."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None
            self._path = None
