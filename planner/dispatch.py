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

from planner.network import (
    Alternatives,
    AnyOrder,
    Claimed,
    Deadline,
    Held,
    InSequence,
    Label,
    Network,
    SideBySide,
    Solution,
    StartedStep,
    Underway,
)
from planner.timetable_tasks import NEVER, Branch, Mode, grow, is_begun, underway, way_ms

Rule: TypeAlias = Callable[[int, int, int], int]
"""Start and end of a task, and what takes at least how long after it: what this is least for is next."""

RULES: tuple[Rule, ...] = (
    lambda _start, end, _tail: end,
    lambda _start, end, tail: end - tail,
    lambda start, _end, tail: start - tail,
    lambda start, _end, _tail: start,
)
"""First done, most urgent at its end, most urgent at its start, first begun."""


def dispatch(network: Network, root: Branch | None = None) -> Solution | None:
    """The best plan that list scheduling finds; None if it finds none.

    Args:
        network: What to plan.
        root: `grow(network)`, if it is known already.
    """
    root = root or grow(network)
    ways = _Ways(network)
    best: Solution | None = None
    for rule in RULES:
        try:
            found = _Run(network, ways, rule, _begin(network, root)).whole(root)
        except _Stuck:
            continue
        if best is None or found.makespan_ms < best.makespan_ms:
            best = found
    return best


_TEAM = ""
"""In `_State.changed`: the team, which is no robot's or resource's name."""


class _Stuck(Exception):
    """Nothing can be next, or a deadline has passed."""


class _Ways:
    """Travel times, each looked up once."""

    def __init__(self, network: Network) -> None:
        self._travel = network.travel
        self._known: dict[tuple[str, str | None, str, float], int | None] = {}

    def ms(self, robot: str, place: str | None, goal: str, odds: float) -> int | None:
        key = robot, place, goal, odds
        if key not in self._known:
            self._known[key] = way_ms(self._travel, *key)
        return self._known[key]


@dataclass(slots=True, kw_only=True)
class _State:
    """What has been scheduled.

    Attributes:
        free_ms: By robot, when it has done all that it is to do so far.
        place: By robot, where it is then.
        work_ms: By robot, how long it has worked.
        team: Robots that take part.
        used: By resource, when it is in use.
        kept: Robots and resources that parts have which are under way and not yet scheduled, and how many parts each.
        changed: By robot, resource, or for the team: how many tasks had been scheduled when it got its last one.
        choices: Made so far.
        steps: As they were scheduled.
    """

    free_ms: dict[str, int]
    place: dict[str, str | None]
    work_ms: dict[str, int]
    team: set[str]
    used: dict[str, list[tuple[int, int]]]
    kept: dict[str, int] = field(default_factory=dict)
    changed: dict[str, int] = field(default_factory=dict)
    choices: dict[str, Label] = field(default_factory=dict)
    steps: list[StartedStep] = field(default_factory=list)

    def copy(self) -> _State:
        return _State(
            free_ms=dict(self.free_ms),
            place=dict(self.place),
            work_ms=dict(self.work_ms),
            team=set(self.team),
            used={resource: list(times) for resource, times in self.used.items()},
            kept=dict(self.kept),
            changed=dict(self.changed),
            choices=dict(self.choices),
            steps=list(self.steps),
        )


def _begin(network: Network, root: Branch) -> _State:
    """The state when the plan is made: some steps are under way."""
    state = _State(
        free_ms=dict.fromkeys(network.robots, 0),
        place={name: robot.at for name, robot in network.robots.items()},
        work_ms=dict.fromkeys(network.robots, 0),
        team=set(),
        used={},
    )
    for node in underway(root):
        for i, robot in enumerate(node.robots):
            state.team.add(robot)
            state.free_ms[robot] = max(state.free_ms.get(robot, 0), node.left_ms)
            if node.ends and node.ends[i] is not None:
                state.place[robot] = node.ends[i]
        for claim in node.claims:
            state.used.setdefault(claim, []).append((0, node.left_ms))
    _keep(root, state, frozenset())
    return state


def _keep(branch: Branch, state: _State, had: frozenset[str]) -> None:
    """Note what the parts that are under way have; `had` is what is around them has."""
    if is_begun(branch):
        has = _has(branch) - had
        for name in has:
            state.kept[name] = state.kept.get(name, 0) + 1
        for part in branch.parts:
            _keep(part, state, had | has)


def _has(branch: Branch) -> frozenset[str]:
    """What a part has to itself from its first step to its end; robots under the names that it gives them."""
    match branch.node:
        case Held(robot=robot):
            return frozenset({robot})
        case Claimed(claims=claims):
            return frozenset(claims)
        case _:
            return frozenset()


@dataclass(frozen=True, slots=True)
class _Placed:
    """A mode in time: when each piece starts and ends."""

    mode: Mode
    times: tuple[tuple[int, int], ...]
    seen: int

    @property
    def start(self) -> int:
        return self.times[0][0]

    @property
    def end(self) -> int:
        return self.times[-1][1]


@dataclass(frozen=True, slots=True)
class _Tried:
    """A part that is more than a task, in time, and all that has been scheduled then."""

    state: _State
    start: int
    end: int


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
        placed: By number of the mode, if it is a task: how it would be done when that was looked at.
    """

    branch: Branch
    ready_ms: int
    join: _Join | None
    tail_ms: int
    by_ms: int
    placed: dict[int, _Placed | None] = field(default_factory=dict)


class _Run:
    """Schedules a part of a network, from a state on.

    Args:
        symbols: `?ID` -> the robot that was chosen for it.
        claims: What the part around has already.
    """

    def __init__(
        self,
        network: Network,
        ways: _Ways,
        rule: Rule,
        state: _State,
        symbols: Mapping[str, str] | None = None,
        claims: frozenset[str] = frozenset(),
    ) -> None:
        self.network = network
        self.ways = ways
        self.rule = rule
        self.state = state
        self.symbols = symbols or {}
        self.claims = claims
        self.agenda: list[_Open] = []
        self.count = len(state.steps)

    def whole(self, root: Branch) -> Solution:
        """Schedule it all.

        Raises:
            _Stuck: It is not found out how.
        """
        end = max(self.part(root, 0, 0), *self.state.free_ms.values())
        numbered = sorted(enumerate(self.state.steps), key=lambda s: (s[1].start_ms, s[1].end_ms, s[0]))
        return Solution(choices=self.state.choices, steps=tuple(step for _, step in numbered), makespan_ms=end)

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
            self.agenda.append(_Open(branch=branch, ready_ms=ready_ms, join=join, tail_ms=tail_ms, by_ms=by_ms))
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
                self.agenda.append(_Open(branch=branch, ready_ms=ready_ms, join=join, tail_ms=tail_ms, by_ms=by_ms))

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
        best: tuple[tuple[bool, int, int, int], _Open, _Placed | _Tried] | None = None
        for item in self.agenda:
            for found in self._ways_to_do(item):
                order = self.rule(found.start, found.end, item.tail_ms)
                key = not is_begun(item.branch), item.by_ms, order, found.end
                if best is None or key < best[0]:
                    best = key, item, found
        if best is None:
            raise _Stuck
        _, item, found = best
        if isinstance(found, _Tried):
            if found.state.kept != self.state.kept:
                for other in self.agenda:
                    other.placed.clear()
            self.state = found.state
        elif any(
            self.state.changed.get(what, 0) > found.seen for what in (_TEAM, *(u.resource for u in found.mode.uses))
        ):
            modes = item.branch.modes or ()
            item.placed[modes.index(found.mode)] = self._place(found.mode, item.ready_ms)
            return  # it may be later than it seemed, and no longer the first
        else:
            self._do(found)
        self.agenda.remove(item)
        self._close(item.join, found.end, item.by_ms)

    def _ways_to_do(self, item: _Open) -> Iterator[_Placed | _Tried]:
        if item.branch.modes is None:
            yield from self._tries(item)
            return
        changed = self.state.changed
        for m, mode in enumerate(item.branch.modes):
            placed = item.placed.get(m)
            if m not in item.placed or (
                placed is not None and any(changed.get(robot, 0) > placed.seen for robot in mode.robots)
            ):
                placed = item.placed[m] = self._place(mode, item.ready_ms)
            if placed is not None:
                yield placed

    # ------------------------------------------------------------------------------------------- tasks

    def _place(self, mode: Mode, ready_ms: int) -> _Placed | None:
        """How a mode would be done as soon as can be, after all that its robots do already; None: it cannot."""
        state = self.state
        if any(self.symbols[symbol] != robot for symbol, robot in mode.given):
            return None
        if len(state.team | mode.workers) > self.network.team or not state.kept.keys().isdisjoint(mode.robots):
            return None
        way = 0
        if mode.goal is not None:
            robot = mode.robots[0]
            known = self.ways.ms(robot, state.place[robot], mode.goal, mode.odds)
            if known is None:
                return None
            way = known
        for robot in mode.robots:
            limit = self.network.robots[robot].work_ms
            if limit is not None and state.work_ms[robot] + mode.work_ms + way > limit:
                return None
            ready_ms = max(ready_ms, state.free_ms[robot])
        took = [piece.ms + way if piece.travels else piece.ms for piece in mode.pieces]
        times = self._times(mode, took, ready_ms)
        return None if times is None else _Placed(mode, tuple(times), len(state.steps))

    def _times(self, mode: Mode, took: Sequence[int], ready_ms: int) -> list[tuple[int, int]] | None:
        """When its pieces start and end: each waits for the resources whose use starts with it."""
        wait = [0] * len(took)
        while True:
            times: list[tuple[int, int]] = []
            at = ready_ms
            for ms, earliest in zip(took, wait, strict=True):
                at = max(at, earliest)
                times.append((at, at + ms))
                at += ms
            for use in mode.uses:
                start, end = times[use.first][0], times[use.last][1]
                free = start if use.resource in self.claims else self._free(use.resource, start, end - start)
                if free is None:
                    return None
                if free > start:
                    wait[use.first] = free
                    break
            else:
                return times

    def _free(self, resource: str, start_ms: int, ms: int) -> int | None:
        """From when on a resource can be used for so long; None: that is not known yet."""
        used = self.state.used.get(resource, ())
        capacity = self.network.capacity.get(resource, 1) - self.state.kept.get(resource, 0)
        if capacity <= 0:
            return None
        for start in sorted({start_ms, *(end for _, end in used if end > start_ms)}):
            meanwhile = [(a, b) for a, b in used if a < start + ms and b > start]
            if (
                max((sum(a <= at < b for a, b in meanwhile) for at in [start, *(a for a, _ in meanwhile)]), default=0)
                < capacity
            ):
                return start
        raise AssertionError("a resource is free in the end")

    def _do(self, placed: _Placed) -> None:
        state, mode = self.state, placed.mode
        for piece, (start, end) in zip(mode.pieces, placed.times, strict=True):
            state.steps.append(StartedStep(id=piece.id, robots=piece.robots, start_ms=start, end_ms=end))
            for robot in piece.robots:
                state.work_ms[robot] += end - start
        for robot, place in zip(mode.robots, mode.ends, strict=True):
            state.free_ms[robot] = placed.end
            state.place[robot] = place if place is not None else state.place[robot]
            state.changed[robot] = len(state.steps)
        if not state.team >= mode.workers:
            state.team |= mode.workers
            state.changed[_TEAM] = len(state.steps)
        for use in mode.uses:
            if use.resource not in self.claims:
                self._use(use.resource, placed.times[use.first][0], placed.times[use.last][1])
        state.choices.update(mode.choices)

    def _use(self, resource: str, start_ms: int, end_ms: int) -> None:
        self.state.used.setdefault(resource, []).append((start_ms, end_ms))
        self.state.changed[resource] = len(self.state.steps)

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
                            run.state.choices[choice] = label
                        yield from run._tried(part, item, item.ready_ms)
            case AnyOrder():
                yield from self._in_some_order(item)
            case Held(robot=holder):
                robot = self.symbols.get(holder, holder)
                ready_ms = max(item.ready_ms, self.state.free_ms.get(robot, 0))
                if robot in self.state.kept and not is_begun(item.branch):
                    return
                run = self._fork()
                if is_begun(item.branch):
                    run.state.kept.pop(robot, None)
                for tried in run._tried(item.branch.parts[0], item, ready_ms):
                    tried.state.free_ms[robot] = max(tried.state.free_ms.get(robot, 0), tried.end)
                    tried.state.changed[robot] = len(tried.state.steps)
                    yield tried
            case Claimed(claims=claims):
                yield from self._claimed(tuple(c for c in dict.fromkeys(claims) if c not in self.claims), item)
            case _:
                raise AssertionError(item.branch.node)

    def _fork(self, *, symbols: Mapping[str, str] | None = None, claims: Sequence[str] = ()) -> _Run:
        return _Run(
            self.network,
            self.ways,
            self.rule,
            self.state.copy(),
            self.symbols if symbols is None else symbols,
            self.claims | set(claims),
        )

    def _tried(self, branch: Branch, item: _Open, ready_ms: int) -> Iterator[_Tried]:
        """The part as a whole, if it can be done."""
        try:
            end = self.part(branch, ready_ms, item.tail_ms, item.by_ms)
        except _Stuck:
            return
        start = min((step.start_ms for step in self.state.steps[self.count :]), default=end)
        yield _Tried(self.state, start, end)

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
            tried.state.choices[f"{node.id}/{len(left)}"] = number
            start = tried.start if start is None else start
            run.state = tried.state
            del left[number]
        yield _Tried(run.state, item.ready_ms if start is None else start, ready_ms)

    def _claimed(self, claims: Sequence[str], item: _Open) -> Iterator[_Tried]:
        """The part, begun so late that all that it claims is free from its first step to its end."""
        begun, ready_ms = is_begun(item.branch), item.ready_ms
        while True:
            run = self._fork(claims=claims)
            if begun:
                run.state.kept = {
                    n: k - 1 if n in claims else k for n, k in run.state.kept.items() if k > 1 or n not in claims
                }
            tried = next(run._tried(item.branch.parts[0], item, ready_ms), None)
            if tried is None:
                return
            if begun:
                start = 0
                break
            start = tried.start
            free = [self._free(claim, start, tried.end - start) for claim in claims]
            if any(at is None for at in free):
                return
            ready_ms = max((at for at in free if at is not None), default=start)
            if ready_ms <= start:
                break
        if begun or len(tried.state.steps) > len(self.state.steps):
            for claim in claims:
                run._use(claim, start, tried.end)
        yield tried
