"""Run tables: all that one robot can do within a horizon.

A run is a sequence of legs, each for another job. Of the runs over the same jobs only the shortest is of interest,
so a table is a list of sets of jobs. It is filled layer by layer: the undominated runs of k + 1 jobs (of those over
the same jobs that end at the same place, the shortest) are undominated ones of k jobs and one job more (Held and
Karp 1962), all of a layer at once with numpy.

A set of jobs is one word: the numbers of its jobs, counted among those that the robot can do within the horizon, in
ascending order, are the digits of a number, the base of which is how many those are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from planner.jobs import NEVER, SAME_ROW, Crew
from planner.network import Milliseconds

Integers: TypeAlias = npt.NDArray[np.int64]

_MAX_WORD = 2**63 - 1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Layer:
    """Undominated runs of equally many jobs, ordered by `word`, then `row`.

    Attributes:
        word: The jobs.
        row: Of the durations that hold after it.
        ms: How long it takes, from when the plan is made.
        computing_ms: How much of it is computations.
        before: The run without its last leg: index in the layer before this one.
        leg: The last leg.
    """

    word: Integers
    row: Integers
    ms: Milliseconds
    computing_ms: Milliseconds
    before: Integers
    leg: Integers


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunTable:
    """All sets of jobs that a robot of a crew can do within a horizon; the empty one is not listed.

    Attributes:
        horizon_ms: No run takes longer.
        jobs: Shape (sets, most jobs in one), ascending; filled up with `Jobs.count`, which is no job.
        size: Shape (sets,): how many jobs.
        ms: Shape (sets,): how long the shortest run takes, from when the plan is made.
        longer_ms: Shape (sets,): how long the shortest run over these jobs and one more takes; NEVER if more than the
            horizon. Within any T <= horizon, the largest sets are those with ms <= T < longer_ms.
        closed: With every set all its subsets are there, and take no longer.
        labels: How many undominated runs it is made of.
    """

    horizon_ms: int
    jobs: Integers
    size: Integers
    ms: Milliseconds
    longer_ms: Milliseconds
    closed: bool
    labels: int
    _layers: tuple[_Layer, ...]
    _label: Integers

    def find(self, jobs: list[int]) -> int | None:
        """The index of a set, given its jobs in ascending order; None if it is not there."""
        same = self.size == len(jobs)
        for slot, job in enumerate(jobs):
            same &= self.jobs[:, slot] == job
        found = np.flatnonzero(same)
        return int(found[0]) if len(found) else None

    def legs(self, index: int) -> tuple[int, ...]:
        """The shortest run over a set: legs of the crew, in order."""
        at, legs = int(self._label[index]), []
        for layer in reversed(self._layers[: int(self.size[index])]):
            legs.append(int(layer.leg[at]))
            at = int(layer.before[at])
        return tuple(reversed(legs))


def fill(crew: Crew, count: int, horizon_ms: int, max_labels: int) -> RunTable | None:
    """Make the table of a crew.

    Args:
        crew: The robots.
        count: How many jobs there are in all.
        horizon_ms: For runs that end by then.
        max_labels: Give up at a layer with more runs to look at than this.

    Returns:
        None: given up, for the number of runs or because a run has too many jobs for a word.
    """
    filling = _Filling(crew, horizon_ms, max_labels)
    layer = filling.first()
    layers: list[_Layer] = []
    tables: list[tuple[Integers, Milliseconds, Integers]] = []
    longer: list[Milliseconds] = []
    closed = True
    while len(layer.word):
        layers.append(layer)
        depth = len(layers)
        word, ms, label = _sets(layer)
        if tables:
            longer_ms, all_there = _compare(tables[-1][0], tables[-1][1], word, ms, depth, filling.base)
            longer.append(longer_ms)
            closed = closed and all_there
        tables.append((word, ms, label))
        extended = filling.extend(layer, depth)
        if extended is None:
            return None
        layer = extended
    if tables:
        longer.append(np.full(len(tables[-1][0]), NEVER, dtype=np.int64))
    return RunTable(
        horizon_ms=horizon_ms,
        jobs=_unpack([word for word, _, _ in tables], filling.jobs, filling.base, count),
        size=np.repeat(np.arange(1, len(tables) + 1), [len(word) for word, _, _ in tables]),
        ms=_joined([ms for _, ms, _ in tables]),
        longer_ms=_joined(longer),
        closed=closed,
        labels=sum(len(layer.word) for layer in layers),
        _layers=tuple(layers),
        _label=_joined([label for _, _, label in tables]),
    )


def earliest_ms(crew: Crew) -> Milliseconds:
    """By leg, when it can be done at the earliest, after whatever else, from the start of the run."""
    legs_ms = crew.first_ms
    rows_ms = np.full(len(crew.ms), NEVER, dtype=np.int64)
    moves = np.flatnonzero(crew.end != SAME_ROW)
    while True:
        reached_ms = rows_ms.copy()
        np.minimum.at(reached_ms, crew.end[moves], legs_ms[moves])
        if (reached_ms == rows_ms).all():
            return legs_ms
        changed = np.flatnonzero(reached_ms < rows_ms)
        rows_ms = reached_ms
        via_ms = (rows_ms[changed, None] + crew.ms[changed]).min(axis=0)
        legs_ms = np.minimum(legs_ms, via_ms)


class _Filling:
    """What all layers of a table have in common.

    Attributes:
        jobs: By number in this table, the job; ascending.
        base: Of words.
    """

    def __init__(self, crew: Crew, horizon_ms: int, max_labels: int) -> None:
        self._limit_ms = NEVER if crew.work_ms is None else crew.work_ms - crew.start.work_ms
        self._left_ms = horizon_ms - crew.start.ms
        self._start_ms = crew.start.ms
        self._max_labels = max_labels
        self._legs = np.flatnonzero(earliest_ms(crew) <= self._left_ms)
        self.jobs, self._number = np.unique(crew.job[self._legs], return_inverse=True)
        self.base = max(2, len(self.jobs))
        self._end = crew.end[self._legs]
        self._computing_ms = crew.computing_ms[self._legs]
        self._ms = np.vstack((crew.ms, crew.first_ms))[:, self._legs]
        # Legs from every place by duration, so that those within a rest of time are a slice.
        self._by_ms = np.argsort(self._ms, axis=1, kind="stable")
        span = self._left_ms + 2
        sorted_ms = np.minimum(np.take_along_axis(self._ms, self._by_ms, axis=1), span - 1)
        self._span = span
        self._flat = (sorted_ms + np.arange(len(self._ms))[:, None] * span).ravel()

    def first(self) -> _Layer:
        """Runs of one job."""
        none = np.zeros(1, dtype=np.int64)
        start = _Layer(word=none, row=none + len(self._ms) - 1, ms=none, computing_ms=none, before=none, leg=none)
        layer = self.extend(start, 0)
        assert layer is not None, "more jobs than runs"
        return layer

    def extend(self, layer: _Layer, depth: int) -> _Layer | None:
        """Runs of one job more; None: too many."""
        legs = len(self._legs)
        slices = np.searchsorted(self._flat, layer.row * self._span + (self._left_ms - layer.ms), side="right")
        counts = slices - layer.row * legs
        total = int(counts.sum())
        if total > self._max_labels:
            return None
        before = np.repeat(np.arange(len(counts)), counts)
        leg = self._by_ms[layer.row[before], np.arange(total) - np.repeat(np.cumsum(counts) - counts, counts)]
        # Where the job belongs in the word, and whether it is there already.
        number, word, base = self._number[leg], layer.word[before], self.base
        after, new = np.zeros(total, dtype=np.int64), np.ones(total, dtype=bool)
        for slot in range(depth):
            there = word // base**slot % base
            after += there > number
            new &= there != number
        ms = layer.ms[before] + self._ms[layer.row[before], leg]
        computing_ms = layer.computing_ms[before] + self._computing_ms[leg]
        new &= ms - computing_ms <= self._limit_ms
        kept = np.flatnonzero(new)
        if len(kept) and base ** (depth + 1) > _MAX_WORD:
            return None
        high, low = np.divmod(word[kept], powers := np.array([base**i for i in range(depth + 1)])[after[kept]])
        word = (high * base + number[kept]) * powers + low
        before, leg, ms = before[kept], leg[kept], ms[kept]
        row = np.where(self._end[leg] == SAME_ROW, layer.row[before], self._end[leg])
        order = np.lexsort((ms, row, word))
        best = order[_firsts(word[order], row[order])]
        return _Layer(
            word=word[best],
            row=row[best],
            ms=ms[best],
            computing_ms=computing_ms[kept][best],
            before=before[best],
            leg=self._legs[leg[best]],
        )


def _firsts(*columns: Integers) -> Integers:
    """Indices at which a value differs from the one before, in any column."""
    if not len(columns[0]):
        return np.zeros(0, dtype=np.int64)
    changed = np.zeros(len(columns[0]), dtype=bool)
    changed[0] = True
    for column in columns:
        changed[1:] |= column[1:] != column[:-1]
    return np.flatnonzero(changed)


def _sets(layer: _Layer) -> tuple[Integers, Milliseconds, Integers]:
    """The sets of a layer, ascending: word, least time, and the run that takes it."""
    order = np.lexsort((layer.ms, layer.word))
    best = order[_firsts(layer.word[order])]
    return layer.word[best], layer.ms[best], best


def _compare(
    words: Integers, ms: Milliseconds, longer_words: Integers, longer_ms: Milliseconds, depth: int, base: int
) -> tuple[Milliseconds, bool]:
    """By set, the least time of those with one job more; and whether none of those lacks a subset or is shorter.

    Args:
        words: Sets of `depth` - 1 jobs, ascending.
        ms: Their times.
        longer_words: Sets of `depth` jobs.
        longer_ms: Their times.
        depth: How many jobs.
        base: Of the words.
    """
    least_ms, closed = np.full(len(words), NEVER, dtype=np.int64), True
    for slot in range(depth):
        subset = longer_words // base ** (slot + 1) * base**slot + longer_words % base**slot
        at = np.minimum(np.searchsorted(words, subset), len(words) - 1)
        there = words[at] == subset
        closed = closed and bool(there.all()) and bool((ms[at] <= longer_ms).all())
        np.minimum.at(least_ms, at[there], longer_ms[there])
    return least_ms, closed


def _unpack(words: list[Integers], jobs: Integers, base: int, none: int) -> Integers:
    """Jobs by set, shape (sets, most jobs), given the words layer by layer."""
    rows = np.full((sum(map(len, words)), len(words)), none, dtype=np.int64)
    begin = 0
    for depth, layer in enumerate(words, start=1):
        for slot in range(depth):
            rows[begin : begin + len(layer), slot] = jobs[layer // base ** (depth - 1 - slot) % base]
        begin += len(layer)
    return rows


def _joined(arrays: list[Integers]) -> Integers:
    return np.concatenate(arrays) if arrays else np.zeros(0, dtype=np.int64)
