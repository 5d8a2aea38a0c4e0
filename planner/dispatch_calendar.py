"""What list scheduling has scheduled so far, and when a task could be done next."""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import dataclass, field

from planner.network import Claimed, Held, Label, Network, StartedStep
from planner.timetable_tasks import Branch, Mode, is_begun, underway, way_ms

TEAM = ""
"""In `Calendar.changed`: the team, which is no robot's or resource's name."""


@dataclass(frozen=True, slots=True)
class Placed:
    """A mode in time: when each piece starts and ends; `seen` steps had been scheduled when this was found out."""

    mode: Mode
    times: tuple[tuple[int, int], ...]
    start: int
    end: int
    seen: int


class Ways:
    """Travel times, each looked up once."""

    def __init__(self, network: Network) -> None:
        self._travel = network.travel
        self._known: dict[tuple[str, str | None, str, float], int | None] = {}

    def ms(self, robot: str, place: str | None, goal: str, odds: float) -> int | None:
        """As `way_ms`."""
        key = robot, place, goal, odds
        if key not in self._known:
            self._known[key] = way_ms(self._travel, *key)
        return self._known[key]


@dataclass(slots=True, kw_only=True)
class Calendar:
    """What has been scheduled.

    Attributes:
        network: Of which it is a plan.
        ways: Its travel times.
        free_ms: By robot, when it has done all that it is to do so far.
        at: By robot, where it is then.
        work_ms: By robot, how long it has worked.
        team: Robots that take part.
        used: By resource, when it is in use.
        kept: Robots and resources that parts have which are under way and not yet scheduled, and how many parts each.
        changed: By robot, resource, or for the team: how many tasks had been scheduled when it got its last one.
        choices: Made so far.
        steps: As they were scheduled.
    """

    network: Network
    ways: Ways
    free_ms: dict[str, int]
    at: dict[str, str | None]
    work_ms: dict[str, int]
    team: set[str]
    used: dict[str, list[tuple[int, int]]]
    kept: dict[str, int] = field(default_factory=dict)
    changed: dict[str, int] = field(default_factory=dict)
    choices: dict[str, Label] = field(default_factory=dict)
    steps: list[StartedStep] = field(default_factory=list)

    def copy(self) -> Calendar:
        """Another one that goes on from here."""
        return Calendar(
            network=self.network,
            ways=self.ways,
            free_ms=dict(self.free_ms),
            at=dict(self.at),
            work_ms=dict(self.work_ms),
            team=set(self.team),
            used={resource: list(times) for resource, times in self.used.items()},
            kept=dict(self.kept),
            changed=dict(self.changed),
            choices=dict(self.choices),
            steps=list(self.steps),
        )

    def place(self, mode: Mode, ready_ms: int, claims: Container[str]) -> Placed | None:
        """How a mode would be done as soon as can be, after all that its robots do already; None: it cannot.

        Args:
            ready_ms: No earlier.
            claims: What the part around has already.
        """
        if len(self.team | mode.workers) > self.network.team or not self.kept.keys().isdisjoint(mode.robots):
            return None
        way = 0
        if mode.goal is not None:
            robot = mode.robots[0]
            known = self.ways.ms(robot, self.at[robot], mode.goal, mode.odds)
            if known is None:
                return None
            way = known
        for robot in mode.robots:
            limit = self.network.robots[robot].work_ms
            if limit is not None and self.work_ms[robot] + mode.work_ms + way > limit:
                return None
            ready_ms = max(ready_ms, self.free_ms[robot])
        took = [piece.ms + way if piece.travels else piece.ms for piece in mode.pieces]
        times = self._times(mode, took, ready_ms, claims)
        return None if times is None else Placed(mode, tuple(times), times[0][0], times[-1][1], len(self.steps))

    def _times(
        self, mode: Mode, took: Sequence[int], ready_ms: int, claims: Container[str]
    ) -> list[tuple[int, int]] | None:
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
                free = start if use.resource in claims else self.free(use.resource, start, end - start)
                if free is None:
                    return None
                if free > start:
                    wait[use.first] = free
                    break
            else:
                return times

    def is_late(self, placed: Placed) -> bool:
        """Whether it may be done later than it was placed, by what was added since about resources or the team."""
        needs = (TEAM, *(use.resource for use in placed.mode.uses))
        return any(self.changed.get(what, 0) > placed.seen for what in needs)

    def free(self, resource: str, start_ms: int, ms: int) -> int | None:
        """From when on a resource can be used for so long; None: that is not known yet."""
        capacity = self.network.capacity.get(resource, 1) - self.kept.get(resource, 0)
        if capacity <= 0:
            return None
        used = [(start, end) for start, end in self.used.get(resource, ()) if end > start_ms]
        for at in sorted({start_ms, *(end for _, end in used)}):
            meanwhile = [(start, end) for start, end in used if start < at + ms and end > at]
            if len(meanwhile) < capacity or _at_once(meanwhile, at) < capacity:
                return at
        raise AssertionError("a resource is free in the end")

    def do(self, placed: Placed, claims: Container[str]) -> None:
        """Add a mode that was placed since anything was added that it needs."""
        mode = placed.mode
        for piece, (start, end) in zip(mode.pieces, placed.times, strict=True):
            self.steps.append(StartedStep(id=piece.id, robots=piece.robots, start_ms=start, end_ms=end))
            for robot in piece.robots:
                self.work_ms[robot] += end - start
        for robot, place in zip(mode.robots, mode.ends, strict=True):
            self.free_ms[robot] = placed.end
            self.at[robot] = place if place is not None else self.at[robot]
            self.changed[robot] = len(self.steps)
        if not self.team >= mode.workers:
            self.team |= mode.workers
            self.changed[TEAM] = len(self.steps)
        for use in mode.uses:
            if use.resource not in claims:
                self.use(use.resource, placed.times[use.first][0], placed.times[use.last][1])
        self.choices.update(mode.choices)

    def use(self, resource: str, start_ms: int, end_ms: int) -> None:
        """Add that a resource is in use."""
        self.used.setdefault(resource, []).append((start_ms, end_ms))
        self.changed[resource] = len(self.steps)


def begin(network: Network, root: Branch, ways: Ways) -> Calendar:
    """The calendar when the plan is made: some steps are under way."""
    calendar = Calendar(
        network=network,
        ways=ways,
        free_ms=dict.fromkeys(network.robots, 0),
        at={name: robot.at for name, robot in network.robots.items()},
        work_ms=dict.fromkeys(network.robots, 0),
        team=set(),
        used={},
    )
    for node in underway(root):
        for i, robot in enumerate(node.robots):
            calendar.team.add(robot)
            calendar.free_ms[robot] = max(calendar.free_ms.get(robot, 0), node.left_ms)
            if node.ends and node.ends[i] is not None:
                calendar.at[robot] = node.ends[i]
        for claim in node.claims:
            calendar.used.setdefault(claim, []).append((0, node.left_ms))
    _keep(root, calendar, frozenset())
    return calendar


def _keep(branch: Branch, calendar: Calendar, had: frozenset[str]) -> None:
    """Note what the parts that are under way have; `had` is what is around them has."""
    if is_begun(branch):
        has = _has(branch) - had
        for name in has:
            calendar.kept[name] = calendar.kept.get(name, 0) + 1
        for part in branch.parts:
            _keep(part, calendar, had | has)


def _has(branch: Branch) -> frozenset[str]:
    """What a part has to itself from its first step to its end; robots under the names that it gives them."""
    match branch.node:
        case Held(robot=robot):
            return frozenset({robot})
        case Claimed(claims=claims):
            return frozenset(claims)
        case _:
            return frozenset()


def _at_once(used: Sequence[tuple[int, int]], since_ms: int) -> int:
    """How many use a resource at once, at most, from some time on."""
    return max(sum(a <= at < b for a, b in used) for at in [since_ms, *(start for start, _ in used)])
