"""Greedy plans, and the ejection pool: all jobs into runs that end by a given time.

The search for such runs is that of Nagata and Bräysy, "A powerful route minimization heuristic for the vehicle
routing problem with time windows", Operations Research Letters 37 (2009): jobs that fit nowhere wait in a pool; the
next one pushes others out, those that have been hard to place least of all; in between, jobs change places at random.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TypeAlias

import numpy as np

from planner.jobs import NEVER, SAME_ROW, Crew, Jobs
from planner.runs import earliest_ms

Runs: TypeAlias = tuple[tuple[int, ...], ...]
"""By robot (crew by crew), the legs of its crew that it does, in order."""

EFFORT_PER_LOOK_S = 6e-7
"""What trying out one place in one run counts for."""

_SHUFFLES = 20
"""Moves at random after an ejection."""

_EJECTED = 2
"""So many jobs may be pushed out for one."""


@dataclass(slots=True)
class _Seat:
    """A robot and the run it has so far.

    Attributes:
        crew: What it can do.
        rows: `Crew.ms` as lists.
        first: `Crew.first_ms`.
        end: `Crew.end`.
        options: By job, the legs for it.
        legs: The run.
        ms: When it ends.
        limit_ms: When it must end, for its work, if there are no computations in it.
    """

    crew: Crew
    rows: list[list[int]]
    first: list[int]
    end: list[int]
    computing_ms: list[int]
    options: dict[int, list[int]]
    legs: list[int]
    ms: int
    limit_ms: int
    plain: bool

    def time(self, legs: Sequence[int]) -> int:
        """When a run ends."""
        row, ms = self.first, self.crew.start.ms
        for leg in legs:
            ms += row[leg]
            if self.end[leg] != SAME_ROW:
                row = self.rows[self.end[leg]]
        return ms

    def allowed(self, legs: Sequence[int], ms: int) -> bool:
        """Whether the robot's work is not too much."""
        return ms <= self.limit_ms + sum(self.computing_ms[leg] for leg in legs)

    def insertion(self, legs: Sequence[int], ms: int, job: int) -> tuple[int, int, int]:
        """Where a job adds least to a run that ends at `ms`: the new end, the position and the leg."""
        best = (NEVER, 0, 0)
        options = self.options.get(job)
        if options is None:
            return best
        if not self.plain:
            for leg in options:
                for at in range(len(legs) + 1):
                    end_ms = self.time([*legs[:at], leg, *legs[at:]])
                    if end_ms < best[0]:
                        best = (end_ms, at, leg)
            return best
        rows, end = self.rows, self.end
        for leg in options:
            row, after = self.first, rows[end[leg]]
            for at, following in enumerate(legs):
                end_ms = ms + row[leg] + after[following] - row[following]
                if end_ms < best[0]:
                    best = (end_ms, at, leg)
                row = rows[end[following]]
            end_ms = ms + row[leg]
            if end_ms < best[0]:
                best = (end_ms, len(legs), leg)
        return best


class Pool:
    """Runs that end by a time, and the jobs that are not in them yet."""

    def __init__(self, jobs: Jobs, runs: Runs, horizon_ms: int, rng: np.random.Generator) -> None:
        """Begin with runs, from which jobs are taken until they end by the horizon.

        Args:
            jobs: All jobs and robots.
            runs: Legs by robot, or () for none.
            horizon_ms: When runs must end.
            rng: For ties and shuffles.
        """
        self.looks = 0
        self._jobs = jobs
        self._rng = rng
        self._seats = _seats(jobs)
        self._horizon_ms = horizon_ms
        self._tries = [1] * jobs.count
        self._used = sum(seat.crew.start.begun for seat in self._seats)
        for seat, legs in zip(self._seats, runs, strict=False):
            self._put(seat, list(legs))
        for seat in self._seats:
            self._shorten(seat)
        there = {int(seat.crew.job[leg]) for seat in self._seats for leg in seat.legs}
        missing = [job for job in range(jobs.count) if job not in there]
        # Hard jobs first: those that take long even for the robot that is best at them. (The pool is a stack.)
        self._waiting = missing if runs else sorted(missing, key=least_ms(jobs).__getitem__)

    @property
    def runs(self) -> Runs:
        """The runs as they are."""
        return tuple(tuple(seat.legs) for seat in self._seats)

    @property
    def makespan_ms(self) -> int:
        """When the last run ends."""
        return max((seat.ms for seat in self._seats), default=0)

    @property
    def total_ms(self) -> int:
        """How long the robots are busy in all."""
        return sum(seat.ms - seat.crew.start.ms for seat in self._seats)

    @property
    def robots(self) -> int:
        """How many take part."""
        return self._used

    @property
    def complete(self) -> bool:
        """Whether all jobs are in runs."""
        return not self._waiting

    def greedy(self) -> None:
        """Put jobs where they end first, as long as they fit somewhere."""
        while self._waiting and self._insert(self._waiting[-1]):
            self._waiting.pop()

    def step(self) -> None:
        """Put the next job somewhere, even if others have to leave."""
        job = self._waiting.pop()
        if self._insert(job):
            return
        self._tries[job] += 1
        if not self._eject_for(job):
            self._waiting.insert(0, job)
        self._shuffle(_SHUFFLES)

    def tidy(self, shuffles: int) -> None:
        """Move and swap jobs at random where that makes the runs shorter in all."""
        self._shuffle(shuffles, shorter=True)

    def _put(self, seat: _Seat, legs: list[int]) -> None:
        self._used += (bool(legs) - bool(seat.legs)) * (not seat.crew.start.begun)
        seat.legs, seat.ms = legs, seat.time(legs)

    def _fits(self, seat: _Seat, legs: Sequence[int], ms: int) -> bool:
        return ms <= self._horizon_ms and seat.allowed(legs, ms)

    def _free(self, seat: _Seat) -> bool:
        """Whether the robot may take part."""
        return bool(seat.legs) or seat.crew.start.begun or self._used < self._jobs.team

    def _shorten(self, seat: _Seat) -> None:
        """Take out jobs until the run is short enough, each time that by which it gets shortest."""
        while seat.legs and not self._fits(seat, seat.legs, seat.ms):
            without = [seat.legs[:i] + seat.legs[i + 1 :] for i in range(len(seat.legs))]
            self._put(seat, min(without, key=seat.time))

    def _insert(self, job: int) -> bool:
        """Put a job where it ends first."""
        best: tuple[int, int, int, _Seat] | None = None
        for seat in self._seats:
            self.looks += len(seat.legs) + 1
            if self._free(seat):
                ms, at, leg = seat.insertion(seat.legs, seat.ms, job)
                if ms <= self._horizon_ms and (best is None or ms < best[0]) and seat.allowed([*seat.legs, leg], ms):
                    best = ms, at, leg, seat
        if best is None:
            return False
        _, at, leg, seat = best
        self._put(seat, [*seat.legs[:at], leg, *seat.legs[at:]])
        return True

    def _eject_for(self, job: int) -> bool:
        """Put a job into the run where those that must leave for it are the easiest to place elsewhere."""
        best: tuple[int, int] | None = None
        chosen: tuple[_Seat, list[int], list[int]] | None = None
        for seat in self._seats:
            if job not in seat.options or not self._free(seat):
                continue
            tries = [self._tries[seat.crew.job[leg]] for leg in seat.legs]
            for size in range(1, min(_EJECTED, len(seat.legs)) + 1):
                for out in combinations(range(len(seat.legs)), size):
                    weight = sum(tries[i] for i in out)
                    if best is not None and weight > best[0]:
                        continue
                    kept = [leg for i, leg in enumerate(seat.legs) if i not in out]
                    self.looks += len(kept) + 1
                    ms, at, leg = seat.insertion(kept, seat.time(kept), job)
                    if (best is None or (weight, ms) < best) and self._fits(seat, [*kept, leg], ms):
                        best = weight, ms
                        chosen = seat, [*kept[:at], leg, *kept[at:]], [seat.legs[i] for i in out]
        if chosen is None:
            return False
        seat, legs, out_legs = chosen
        self._put(seat, legs)
        self._waiting += [int(seat.crew.job[leg]) for leg in out_legs]
        return True

    def _shuffle(self, count: int, *, shorter: bool = False) -> None:
        """So many times: move a job to another run, or swap two, if that fits; and `shorter`: shortens the sum."""
        for first, second, out, back in self._rng.random((count, 4)).tolist():
            self.looks += 1
            a, b = self._seats[int(first * len(self._seats))], self._seats[int(second * len(self._seats))]
            if a is b or not a.legs or not self._free(b):
                continue
            i, j = int(out * len(a.legs)), int(2 * back * len(b.legs))
            a_rest, b_rest = a.legs[:i] + a.legs[i + 1 :], b.legs[:j] + b.legs[j + 1 :]  # half the time j is none
            a_legs, a_ms = a_rest, a.time(a_rest)
            b_legs, b_ms = self._inserted(b, b_rest, int(a.crew.job[a.legs[i]]))
            if b_legs and j < len(b.legs):
                a_legs, a_ms = self._inserted(a, a_rest, int(b.crew.job[b.legs[j]]))
            if b_legs and (a_legs or j >= len(b.legs)) and (not shorter or a_ms + b_ms < a.ms + b.ms):
                self._put(a, a_legs)
                self._put(b, b_legs)

    def _inserted(self, seat: _Seat, legs: list[int], job: int) -> tuple[list[int], int]:
        """A run with a job more, and when it ends; [] if that does not fit."""
        self.looks += len(legs) + 1
        ms, at, leg = seat.insertion(legs, seat.time(legs), job)
        longer = [*legs[:at], leg, *legs[at:]]
        return (longer, ms) if self._fits(seat, longer, ms) else ([], NEVER)


def least_ms(jobs: Jobs) -> list[int]:
    """By job, when it can end at the earliest, whatever is done before it; NEVER: no robot can do it."""
    least = np.full(jobs.count, NEVER, dtype=np.int64)
    for crew in jobs.crews:
        np.minimum.at(least, crew.job, crew.start.ms + earliest_ms(crew))
    return [int(ms) for ms in least]


def _seats(jobs: Jobs) -> list[_Seat]:
    lists: dict[int, list[list[int]]] = {}
    options: dict[int, dict[int, list[int]]] = {}
    seats = []
    for crew in jobs.crews:
        if id(crew.ms) not in lists:  # crews share tables
            lists[id(crew.ms)] = crew.ms.tolist()
            by_job: dict[int, list[int]] = {}
            for leg, job in enumerate(crew.job.tolist()):
                by_job.setdefault(job, []).append(leg)
            options[id(crew.ms)] = by_job
        limit_ms = NEVER if crew.work_ms is None else crew.work_ms - crew.start.work_ms + crew.start.ms
        end = crew.end.tolist()
        seats += [
            _Seat(
                crew=crew,
                rows=lists[id(crew.ms)],
                first=crew.first_ms.tolist(),
                end=end,
                computing_ms=crew.computing_ms.tolist(),
                options=options[id(crew.ms)],
                legs=[],
                ms=crew.start.ms,
                limit_ms=limit_ms,
                plain=SAME_ROW not in end,
            )
            for _ in crew.robots
        ]
    return seats
