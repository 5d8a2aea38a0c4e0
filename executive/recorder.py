"""Writes the trace; the one place where events leave the executive."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import TextIO, overload

from executive.trace import FleetOpened, TraceEvent, read_trace, to_json
from kb.revisions import Revision, write_copy

IN_MEMORY = 10_000
"""So many events are kept in memory where the others can be read from a file; about 5 MB."""

KNOWLEDGE = "knowledge"
"""Name of the folder beside a trace for the files of the revisions that it tells of, by their hashes."""


class Recorder:
    """Keeps all events, and writes each to a file as it comes, if there is one.

    The file is made with the first task: a fleet that was opened in vain leaves nothing behind. Without a file, all
    events stay in memory; with one, the last `in_memory` of them at least, and at most twice as many.

    Attributes:
        events: All so far, in order.
    """

    def __init__(self, path: Path | None, *, in_memory: int = IN_MEMORY) -> None:
        self.events: Sequence[TraceEvent] = (events := _Events(path))
        self._events = events
        self._in_memory = in_memory
        self._path = path
        self._stream: TextIO | None = None

    def record(self, event: TraceEvent) -> None:
        """Append an event."""
        events = self._events
        events.recent.append(event)
        if self._stream is not None:
            self._stream.write(to_json(event) + "\n")
            if len(events.recent) >= 2 * self._in_memory:
                events.in_file += self._in_memory
                del events.recent[: self._in_memory]
        elif self._path is not None and not isinstance(event, FleetOpened):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = self._path.open("w", encoding="utf-8", buffering=1)  # a killed process leaves its trace
            self._stream.writelines(to_json(earlier) + "\n" for earlier in events.recent)

    def keep(self, revision: Revision) -> None:
        """Write the files of a revision beside the trace: they may be others by the time when it is replayed."""
        if self._path is not None:
            folder = self._path.parent / KNOWLEDGE
            folder.mkdir(parents=True, exist_ok=True)
            write_copy(revision, folder / revision.digest)

    def close(self) -> None:
        """Write everything out."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None
            self._path = None


class _Events(Sequence[TraceEvent]):
    """The events of a recorder: the recent ones as they are, those before from the file.

    Attributes:
        in_file: So many, the first, are in the file alone.
        recent: Those after them.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self.in_file = 0
        self.recent: list[TraceEvent] = []

    def __len__(self) -> int:
        return self.in_file + len(self.recent)

    def __iter__(self) -> Iterator[TraceEvent]:
        return chain(self._from_file(0, self.in_file), self.recent)

    @overload
    def __getitem__(self, index: int) -> TraceEvent: ...

    @overload
    def __getitem__(self, index: slice) -> list[TraceEvent]: ...

    def __getitem__(self, index: int | slice) -> TraceEvent | list[TraceEvent]:
        chosen = range(len(self))[index]
        if isinstance(chosen, int):
            return self._between(chosen, chosen + 1)[0]
        if not chosen:
            return []
        first, last = sorted((chosen[0], chosen[-1]))
        found = self._between(first, last + 1)
        return [found[number - first] for number in chosen]

    def _between(self, begin: int, end: int) -> list[TraceEvent]:
        recent = self.recent[max(0, begin - self.in_file) : max(0, end - self.in_file)]
        return [*self._from_file(begin, min(end, self.in_file)), *recent]

    def _from_file(self, begin: int, end: int) -> Iterator[TraceEvent]:
        if self._path is None or begin >= end:
            return iter(())
        return islice(read_trace(self._path), begin, end)
