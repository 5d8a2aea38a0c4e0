"""Time is injected: a `Clock` tells the time and runs callbacks at given times.

`SimClock` is a discrete-event clock: time jumps from one scheduled callback to the next, and whoever
must keep pace with it (the simulator) is advanced first. `WallClock` does the same in real time.
Times are seconds since the clock was made.
"""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Protocol

Callback = Callable[[], None]


def utc_now() -> datetime:
    """What the calendar says: for what people date, such as uploads; robots and traces go by a `Clock`."""
    return datetime.now(UTC)


class Clock(Protocol):
    """What tells the time. Callbacks run on the thread that calls `run_until`, one at a time."""

    @property
    def now_s(self) -> float:
        """Seconds since the clock was made."""

    def call_at(self, t_s: float, callback: Callback) -> None:
        """Run `callback` at `t_s`; equal times run in the order in which they were asked for."""

    def run_until(self, done: Callable[[], bool]) -> bool:
        """Run callbacks until `done()`; False if nothing is left that could make it so."""


class _Agenda:
    """Callbacks by time, equal times in order of arrival."""

    def __init__(self) -> None:
        self._heap: list[tuple[float, int, Callback]] = []
        self._count = 0

    def add(self, t_s: float, callback: Callback) -> None:
        self._count += 1
        heapq.heappush(self._heap, (t_s, self._count, callback))

    @property
    def next_s(self) -> float | None:
        return self._heap[0][0] if self._heap else None

    def pop(self) -> Callback:
        return heapq.heappop(self._heap)[2]


class SimClock:
    """Simulated time, as fast as it goes and the same every time; it ticks in nanoseconds."""

    def __init__(self) -> None:
        self._now_s = 0.0
        self._agenda = _Agenda()
        self._followers: list[Callable[[float], None]] = []

    @property
    def now_s(self) -> float:
        return self._now_s

    def follow(self, advance_to: Callable[[float], None]) -> None:
        """Call `advance_to(t_s)` before the time becomes `t_s`: lockstep for the simulator."""
        self._followers.append(advance_to)

    def call_at(self, t_s: float, callback: Callback) -> None:
        t_s = round(t_s, 9)  # sums of delays would carry their rounding errors into every trace
        if t_s < self._now_s:
            raise ValueError(f"call_at({t_s}): the time is already {self._now_s}")
        self._agenda.add(t_s, callback)

    def run_until(self, done: Callable[[], bool]) -> bool:
        while not done():
            next_s = self._agenda.next_s
            if next_s is None:
                return False
            for advance_to in self._followers:
                advance_to(next_s)
            self._now_s = next_s
            self._agenda.pop()()
        return True


class WallClock:
    """Real time."""

    def __init__(self) -> None:
        self._start = time.monotonic()
        self._agenda = _Agenda()

    @property
    def now_s(self) -> float:
        return time.monotonic() - self._start

    def call_at(self, t_s: float, callback: Callback) -> None:
        self._agenda.add(t_s, callback)

    def run_until(self, done: Callable[[], bool]) -> bool:
        while not done():
            next_s = self._agenda.next_s
            if next_s is None:
                return False
            time.sleep(max(0.0, next_s - self.now_s))
            self._agenda.pop()()
        return True
