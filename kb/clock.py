"""Time is injected: a `Clock` tells the time and runs callbacks at given times.

`SimClock` is a discrete-event clock: time jumps from one scheduled callback to the next, and whoever
must keep pace with it (the simulator) is advanced first. `WallClock` does the same in real time.
Times are seconds since the clock was made.
"""

from __future__ import annotations

import heapq
import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Protocol

Callback = Callable[[], None]


def utc_now() -> datetime:
    """What the calendar says: for what people date, such as uploads; robots and traces go by a `Clock`."""
    return datetime.now(UTC)


class Stopwatch:
    """Real time and processor time since it was made: for what things cost, never for decisions."""

    def __init__(self) -> None:
        self._wall_s, self._cpu_s = time.perf_counter(), time.process_time()

    @property
    def wall_s(self) -> float:
        """Real time, in seconds."""
        return time.perf_counter() - self._wall_s

    @property
    def cpu_s(self) -> float:
        """Time of this process on all processors, in seconds; its threads count, its worker processes do not."""
        return time.process_time() - self._cpu_s


class Clock(Protocol):
    """What tells the time. Callbacks run on the thread that calls `run_until`, one at a time."""

    @property
    def now_s(self) -> float:
        """Seconds since the clock was made."""

    def call_at(self, t_s: float, callback: Callback) -> Callback:
        """Run `callback` at `t_s`; equal times run in the order in which they were asked for.

        Returns:
            What withdraws it; once it has run or is withdrawn, this does nothing.
        """

    def run_until(self, done: Callable[[], bool]) -> bool:
        """Run callbacks until `done()`; False if nothing is left that could make it so."""


class _Agenda:
    """Callbacks by time, equal times in order of arrival; one that is withdrawn is as if it had never been."""

    def __init__(self) -> None:
        self._heap: list[tuple[float, int]] = []
        self._callbacks: dict[int, Callback] = {}
        self._count = 0

    def add(self, t_s: float, callback: Callback) -> int:
        self._count += 1
        self._callbacks[self._count] = callback
        heapq.heappush(self._heap, (t_s, self._count))
        return self._count

    def withdraw(self, number: int) -> None:
        self._callbacks.pop(number, None)

    @property
    def next_s(self) -> float | None:
        while self._heap and self._heap[0][1] not in self._callbacks:
            heapq.heappop(self._heap)
        return self._heap[0][0] if self._heap else None

    def pop(self) -> Callback:
        """The callback of `next_s`, which has to be asked for before."""
        return self._callbacks.pop(heapq.heappop(self._heap)[1])


class SimClock:
    """Simulated time, as fast as it goes and the same every time; it ticks in nanoseconds."""

    def __init__(self) -> None:
        self._now_s = 0.0
        self._agenda = _Agenda()
        self._followers: list[Callable[[float], None]] = []

    @property
    def now_s(self) -> float:
        return self._now_s

    @property
    def next_s(self) -> float | None:
        """When the next callback is due; None if none is asked for."""
        return self._agenda.next_s

    def follow(self, advance_to: Callable[[float], None]) -> None:
        """Call `advance_to(t_s)` before the time becomes `t_s`: lockstep for the simulator."""
        self._followers.append(advance_to)

    def call_at(self, t_s: float, callback: Callback) -> Callback:
        t_s = round(t_s, 9)  # sums of delays would carry their rounding errors into every trace
        if t_s < self._now_s:
            raise ValueError(f"call_at({t_s}): the time is already {self._now_s}")
        number = self._agenda.add(t_s, callback)
        return lambda: self._agenda.withdraw(number)

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
    """Real time. Other threads hand callbacks to the one that runs the clock.

    All methods may be called from any thread; callbacks run on the thread that calls `run_until`.
    """

    def __init__(self) -> None:
        self._start = time.monotonic()
        self._agenda = _Agenda()
        self._changed = threading.Condition()
        self._listeners = 0

    @property
    def now_s(self) -> float:
        return time.monotonic() - self._start

    def call_at(self, t_s: float, callback: Callback) -> Callback:
        with self._changed:
            number = self._agenda.add(t_s, callback)
            self._changed.notify_all()

        def withdraw() -> None:
            with self._changed:
                self._agenda.withdraw(number)
                self._changed.notify_all()

        return withdraw

    def post(self, callback: Callback) -> None:
        """Run `callback` as soon as the callbacks that are due before it have run."""
        self.call_at(self.now_s, callback)

    def listen(self) -> Callback:
        """Say that callbacks may come although none is asked for, so that `run_until` goes on waiting.

        Returns:
            What ends it; calling it again does nothing.
        """
        listening = True
        with self._changed:
            self._listeners += 1

        def end() -> None:
            nonlocal listening
            with self._changed:
                self._listeners -= listening
                listening = False
                self._changed.notify_all()

        return end

    def run_until(self, done: Callable[[], bool]) -> bool:
        """Run callbacks until `done()`, which is asked after each; what makes it so elsewhere has to `post`."""
        while not done():
            callback = self._next_due()
            if callback is None:
                return False
            callback()
        return True

    def _next_due(self) -> Callback | None:
        """Wait until a callback is due; None if none is asked for and nobody listens."""
        with self._changed:
            while True:
                next_s = self._agenda.next_s
                if next_s is None and not self._listeners:
                    return None
                wait_s = threading.TIMEOUT_MAX if next_s is None else next_s - self.now_s
                if wait_s <= 0.0:
                    return self._agenda.pop()
                self._changed.wait(min(wait_s, threading.TIMEOUT_MAX))
