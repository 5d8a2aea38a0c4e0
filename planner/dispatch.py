"""List scheduling: a first plan for a network, in milliseconds.

Again and again, of all tasks that may be next and all ways to do them, the one that a priority rule puts first is
appended to what its robots do: the serial schedule generation scheme of Kolisch (1996), section 2. A part that keeps a
robot, or resources, over several tasks is done as a whole before anything else is looked at, and so is each option
of alternatives that are more than one task. Nothing is taken back: there may be a plan although none is found.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from planner.dispatch_calendar import Calendar, Placed, Ways, begin
from planner.network import (
    Alternatives,
    AnyOrder,
    Claimed,
    Deadline,
    Held,
    InSequence,
    Network,
    SideBySide,
    Solution,
    Underway,
)
from planner.timetable_tasks import NEVER, Branch, grow, is_begun

Rule: TypeAlias = Callable[[int, int, int], int]
"""Start and end of a task, and what takes at least how long after it: what this is least for is next."""

RULES: tuple[Rule, ...] = (
    lambda _start, end, _tail: end,
    lambda _start, end, tail: end - tail,
    lambda start, _end, tail: start - tail,
    lambda start, _end, _tail: start,
)
"""First done, most urgent at its end, most urgent at its start, first begun."""

NOISE = 0.1
"""One sigma, as a part of what it is added to."""


def dispatch(network: Network, root: Branch | None = None) -> Solution | None:
    """The best plan that list scheduling finds; None if it finds none.

    Args:
        network: What to plan.
        root: `grow(network)`, if it is known already.
    """
    root = root or grow(network)
    ways = Ways(network)
    found = [_scheduled(network, root, ways, rule) for rule in RULES]
    return min((f for f in found if f is not None), key=lambda f: f.makespan_ms, default=None)


def sample(network: Network, root: Branch, rng: np.random.Generator) -> Iterator[Solution | None]:
    """Plans by list scheduling with noise in the rule, one after the other without end; None: it has found none.

    As many of them are as good as those of the rules, some are better: biased random sampling, Kolisch (1996),
    section 3, here with normal noise of `NOISE` on the ends of tasks.
    """
    ways = Ways(network)
    while True:
        yield _scheduled(network, root, ways, lambda _start, end, _tail: round(end * (1.0 + rng.normal(0.0, NOISE))))


def _scheduled(network: Network, root: Branch, ways: Ways, rule: Rule) -> Solution | None:
    try:
        return _Run(rule, begin(network, root, ways)).whole(root)
    except _Stuck:
        return None


class _Stuck(Exception):
    """Nothing can be next, or a deadline has passed."""


@dataclass(frozen=True, slots=True)
class _Tried:
    """A part that is more than a task, in time, and all that has been scheduled then."""

    calendar: Calendar
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class _First:
    """A way to do a part; of several parts, the one with the least key is next."""

    key: tuple[bool, int, int, int]
    found: Placed | _Tried


@dataclass(slots=True, kw_only=True)
class _Join:
    """What comes after parts that are side by side, or a part of a sequence.

    Attributes:
        missing: So many of the parts have not been scheduled to their end.
        end_ms: Latest end of those that have.
        rest: Then these follow, one after the other.
        by_ms: Then it has to be no later.
    """

    outer: _Join | None
    missing: int
    end_ms: int
    rest: tuple[Branch, ...] = ()
    tail_ms: int
    by_ms: int | None = None


@dataclass(slots=True, kw_only=True, eq=False)
class _Open:
    """A part that may be next.

    Attributes:
        by_ms: The deadline that it is under; NEVER: none.
        begun: Whether a step of it is under way.
        placed: By number of the mode, if it is a task: how it would be done when that was looked at.
        first: What the rule puts first of all ways to do it; not known if `stale`.
    """

    branch: Branch
    ready_ms: int
    join: _Join | None
    tail_ms: int
    by_ms: int
    begun: bool
    placed: dict[int, Placed | None] = field(default_factory=dict)
    first: _First | None = None
    stale: bool = True


class _Run:
    """Schedules a part of a network, from a state on.

    Args:
        symbols: `?ID` -> the robot that was chosen for it.
        claims: What the part around has already.
    """

    def __init__(
        self,
        rule: Rule,
        calendar: Calendar,
        symbols: Mapping[str, str] | None = None,
        claims: frozenset[str] = frozenset(),
    ) -> None:
        self.rule = rule
        self.calendar = calendar
        self.symbols = symbols or {}
        self.claims = claims
        self.agenda: list[_Open] = []
        self.count = len(calendar.steps)

    def whole(self, root: Branch) -> Solution:
        """Schedule it all.

        Raises:
            _Stuck: It is not found out how.
        """
        end = max([self.part(root, 0, 0), *self.calendar.free_ms.values()])
        numbered = sorted(enumerate(self.calendar.steps), key=lambda s: (s[1].start_ms, s[1].end_ms, s[0]))
        return Solution(choices=self.calendar.choices, steps=tuple(step for _, step in numbered), makespan_ms=end)

    def part(self, branch: Branch, ready_ms: int, tail_ms: int, by_ms: int = NEVER) -> int:
        """Schedule a part; when it ends."""
        last = _Join(outer=None, missing=1, end_ms=ready_ms, tail_ms=tail_ms)
        self._open(branch, ready_ms, last, tail_ms, by_ms)
        while self.agenda:
            self._next()
        return last.end_ms

    # ------------------------------------------------------------------------------------------ agenda

    def _open(self, branch: Branch, ready_ms: int, join: _Join, tail_ms: int, by_ms: int) -> None:
        """The part may begin; put what may be next on the agenda."""
        if branch.least_ms >= NEVER:
            raise _Stuck
        if branch.modes is not None:
            self._put(branch, ready_ms, join, tail_ms, by_ms)
            return
        match branch.node:
            case InSequence():
                self._close(
                    _Join(outer=join, missing=1, end_ms=ready_ms, rest=branch.parts, tail_ms=tail_ms), ready_ms, by_ms
                )
            case SideBySide() if branch.parts:
                inner = _Join(outer=join, missing=len(branch.parts), end_ms=ready_ms, tail_ms=tail_ms)
                for part in branch.parts:
                    self._open(part, ready_ms, inner, tail_ms, by_ms)
            case SideBySide():
                self._close(join, ready_ms, by_ms)
            case Deadline(ms=ms):
                inner = _Join(outer=join, missing=1, end_ms=ready_ms, tail_ms=tail_ms, by_ms=ms)
                self._open(branch.parts[0], ready_ms, inner, tail_ms, min(ms, by_ms))
            case Underway(left_ms=left_ms):
                self._close(join, max(ready_ms, left_ms), by_ms)
            case _:
                self._put(branch, ready_ms, join, tail_ms, by_ms)

    def _put(self, branch: Branch, ready_ms: int, join: _Join, tail_ms: int, by_ms: int) -> None:
        item = _Open(branch=branch, ready_ms=ready_ms, join=join, tail_ms=tail_ms, by_ms=by_ms, begun=is_begun(branch))
        self.agenda.append(item)

    def _close(self, join: _Join | None, end_ms: int, by_ms: int) -> None:
        """A part has been scheduled to its end; open what follows."""
        while join is not None:
            join.missing -= 1
            join.end_ms = end_ms = max(join.end_ms, end_ms)
            if join.missing:
                return
            if join.by_ms is not None and end_ms > join.by_ms:
                raise _Stuck
            if join.rest:
                first, *rest = join.rest
                tail_ms = join.tail_ms + sum(part.least_ms for part in rest)
                join.rest, join.missing = tuple(rest), 1
                self._open(first, end_ms, join, tail_ms, by_ms)
                return
            join = join.outer

    def _next(self) -> None:
        """Schedule what the rule puts first."""
        best: tuple[_Open, _First] | None = None
        for item in self.agenda:
            if item.stale:
                item.first, item.stale = self._first(item), False
            if item.first is not None and (best is None or item.first.key < best[1].key):
                best = item, item.first
        if best is None:
            raise _Stuck
        item, found = best[0], best[1].found
        if isinstance(found, _Tried):
            if found.calendar.kept != self.calendar.kept:
                for other in self.agenda:
                    other.placed.clear()
            self.calendar = found.calendar
        elif self.calendar.is_late(found):
            self._look(item, (item.branch.modes or ()).index(found.mode))
            item.stale = True
            return  # it may be later than it seemed, and no longer the first
        else:
            self.calendar.do(found, self.claims)
        self.agenda.remove(item)
        for other in self.agenda:
            other.stale = True
        self._close(item.join, found.end, item.by_ms)

    def _first(self, item: _Open) -> _First | None:
        """What the rule puts first of all ways to do a part."""
        rule, tail_ms = self.rule, item.tail_ms
        ranked = ((rule(found.start, found.end, tail_ms), found.end, found) for found in self._ways_to_do(item))
        order = min(ranked, key=lambda r: r[:2], default=None)
        return None if order is None else _First((not item.begun, item.by_ms, *order[:2]), order[2])

    def _ways_to_do(self, item: _Open) -> Iterator[Placed | _Tried]:
        if item.branch.modes is None:
            yield from self._tries(item)
            return
        changed, known = self.calendar.changed, item.placed
        for m, mode in enumerate(item.branch.modes):
            placed = known[m] if m in known else self._look(item, m)
            if placed is not None:
                for robot in mode.robots:
                    if changed.get(robot, 0) > placed.seen:
                        placed = self._look(item, m)
                        break
            if placed is not None:
                yield placed

    def _look(self, item: _Open, m: int) -> Placed | None:
        assert item.branch.modes is not None
        mode = item.branch.modes[m]
        fits = all(self.symbols[symbol] == robot for symbol, robot in mode.given)
        item.placed[m] = self.calendar.place(mode, item.ready_ms, self.claims) if fits else None
        return item.placed[m]

    # ----------------------------------------------------------------------------- parts with many tasks

    def _tries(self, item: _Open) -> Iterator[_Tried]:
        """Ways to do a part that is to be done as a whole."""
        match item.branch.node:
            case Alternatives(id=choice, options=options):
                for option, part in zip(options, item.branch.parts, strict=True):
                    for label in option.labels:
                        symbols = {**self.symbols, f"?{choice}": str(label)}
                        run = self._fork(symbols=symbols)
                        if choice is not None:
                            run.calendar.choices[choice] = label
                        yield from run._tried(part, item, item.ready_ms)
            case AnyOrder():
                yield from self._in_some_order(item)
            case Held(robot=holder):
                robot = self.symbols.get(holder, holder)
                ready_ms = max(item.ready_ms, self.calendar.free_ms.get(robot, 0))
                if robot in self.calendar.kept and not is_begun(item.branch):
                    return
                run = self._fork()
                if is_begun(item.branch):
                    run.calendar.kept.pop(robot, None)
                for tried in run._tried(item.branch.parts[0], item, ready_ms):
                    tried.calendar.free_ms[robot] = max(tried.calendar.free_ms.get(robot, 0), tried.end)
                    tried.calendar.changed[robot] = len(tried.calendar.steps)
                    yield tried
            case Claimed(claims=claims):
                yield from self._claimed(tuple(c for c in dict.fromkeys(claims) if c not in self.claims), item)
            case _:
                raise AssertionError(item.branch.node)

    def _fork(self, *, symbols: Mapping[str, str] | None = None, claims: Sequence[str] = ()) -> _Run:
        return _Run(
            self.rule,
            self.calendar.copy(),
            self.symbols if symbols is None else symbols,
            self.claims | set(claims),
        )

    def _tried(self, branch: Branch, item: _Open, ready_ms: int) -> Iterator[_Tried]:
        """The part as a whole, if it can be done."""
        try:
            end = self.part(branch, ready_ms, item.tail_ms, item.by_ms)
        except _Stuck:
            return
        start = min((step.start_ms for step in self.calendar.steps[self.count :]), default=end)
        yield _Tried(self.calendar, start, end)

    def _in_some_order(self, item: _Open) -> Iterator[_Tried]:
        """Of the parts that remain, the one that ends first is next."""
        node, run, ready_ms = item.branch.node, self._fork(), item.ready_ms
        assert isinstance(node, AnyOrder)
        left = dict(enumerate(item.branch.parts, start=1))
        start: int | None = None
        while left:
            tries = (
                (t.end, number, t) for number, part in left.items() for t in run._fork()._tried(part, item, ready_ms)
            )
            best = min(tries, key=lambda t: t[:2], default=None)
            if best is None:
                return
            ready_ms, number, tried = best
            tried.calendar.choices[f"{node.id}/{len(left)}"] = number
            start = tried.start if start is None else start
            run.calendar = tried.calendar
            del left[number]
        yield _Tried(run.calendar, item.ready_ms if start is None else start, ready_ms)

    def _claimed(self, claims: Sequence[str], item: _Open) -> Iterator[_Tried]:
        """The part, begun so late that all that it claims is free from its first step to its end."""
        begun, ready_ms = is_begun(item.branch), item.ready_ms
        while True:
            run = self._fork(claims=claims)
            if begun:
                run.calendar.kept = {
                    n: k - 1 if n in claims else k for n, k in run.calendar.kept.items() if k > 1 or n not in claims
                }
            tried = next(run._tried(item.branch.parts[0], item, ready_ms), None)
            if tried is None:
                return
            if begun:
                start = 0
                break
            start = tried.start
            free = [self.calendar.free(claim, start, tried.end - start) for claim in claims]
            if any(at is None for at in free):
                return
            ready_ms = max((at for at in free if at is not None), default=start)
            if ready_ms <= start:
                break
        if begun or len(tried.calendar.steps) > len(self.calendar.steps):
            for claim in claims:
                run.calendar.use(claim, start, tried.end)
        yield tried
