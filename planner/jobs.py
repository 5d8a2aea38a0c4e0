"""Coupling analysis: does a network fall apart into jobs that robots do on their own?

It does if its parts are side by side and each is done by one robot in one go, with nothing to wait for. Then a
plan is one run (jobs one after the other) for each robot, and all that ties robots is who does what.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from planner.network import (
    NO_WAY,
    Alternatives,
    InSequence,
    Label,
    Milliseconds,
    Network,
    Node,
    Option,
    SideBySide,
    StartedStep,
    Step,
    Underway,
)
from planner.ways import Coupled, Way, is_empty, ways_through

NEVER = 1 << 60
"""A duration: it cannot be done. Two of them add up without overflow."""

SAME_ROW = -1
"""In `Crew.end`: the robot stays where it was."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LegStep:
    """A step of a leg.

    Attributes:
        ms: Without the leg's first travel.
        robot: Whether the robot does it; else it is a computation.
        travels: It begins with the leg's first travel.
    """

    id: str
    ms: int
    robot: bool
    travels: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """One way for a robot to do a job, in one go.

    Attributes:
        job: Number of the job.
        goal: Where it travels to first; None: no travel.
        odds: Of that travel's step: it takes the travel time divided by this.
        ms: Everything but that travel.
        computing_ms: How much of `ms` is computations.
        end: The place where the robot is afterwards; None: where it was before.
        choices: Labels by the id of alternatives.
        own: Ids of alternatives at which the robot itself is the label.
        steps: In order, without pauses.
    """

    job: int
    goal: int | None
    odds: float
    ms: int
    computing_ms: int
    end: int | None
    choices: tuple[tuple[str, Label], ...]
    own: tuple[str, ...]
    steps: tuple[LegStep, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """How a robot's run begins.

    Attributes:
        ms: When it is free.
        work_ms: How much work it does until then.
        place: Where it is then; None: where it is when the plan is made.
        begun: Whether a step of it is under way, so that it takes part in any case.
        leg: What remains of the job that it is at.
        leg_ms: When that begins.
    """

    ms: int = 0
    work_ms: int = 0
    place: int | None = None
    begun: bool = False
    leg: Leg | None = None
    leg_ms: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Crew:
    """Robots that are alike: whatever one of them can do, so can the others, in the same time.

    Attributes:
        robots: Their names.
        legs: All that each can do.
        job: By leg, the number of its job.
        ms: Shape (places, legs): duration of each leg from each place; NEVER where there is no way.
        first_ms: Shape (legs,): the same from where the robots are at the start.
        end: By leg, the row of `ms` that holds after it; SAME_ROW: the one that held before it.
        computing_ms: By leg, how much of it is computations.
        start: How their runs begin.
        work_ms: How long each can work in all.
    """

    robots: tuple[str, ...]
    legs: tuple[Leg, ...]
    job: Milliseconds
    ms: Milliseconds
    first_ms: Milliseconds
    end: Milliseconds
    computing_ms: Milliseconds
    start: Start
    work_ms: int | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Jobs:
    """A network that has fallen apart.

    Attributes:
        count: Of jobs that need a robot.
        crews: Every robot that can do something or is at something is in one.
        team: At most so many robots have a run; those that are at something count.
        least_ms: How long it takes in any case: what needs no robot, and what has begun.
        choices: Those that are the same whoever does what.
        steps: Those that need no robot.
    """

    count: int
    crews: tuple[Crew, ...]
    team: int
    least_ms: int
    choices: Mapping[str, Label]
    steps: tuple[StartedStep, ...]


def separate(network: Network) -> Jobs | None:
    """Take a network apart; None if it does not fall apart."""
    try:
        return _Separation(network).jobs()
    except Coupled:
        return None


@dataclass(slots=True)
class _Separation:
    """What has been found out about a network so far."""

    network: Network
    count: int = 0
    choices: dict[str, Label] = field(default_factory=dict)
    least_ms: int = 0
    steps: list[StartedStep] = field(default_factory=list)
    starts: dict[str, Start] = field(default_factory=dict)
    legs: dict[str, list[Leg]] = field(default_factory=dict)
    places: dict[str, int] = field(default_factory=dict)

    def jobs(self) -> Jobs:
        self.legs = {name: [] for name in self.network.robots}
        self.places = {place: i for i, place in enumerate(self.network.travel.places)}
        for part in self._parts(self.network.root):
            if isinstance(part, Underway):
                self._wait_for(part)
            else:
                self._add(list(ways_through(part)))
        return Jobs(
            count=self.count,
            crews=tuple(self._crews()),
            team=self.network.team,
            least_ms=self.least_ms,
            choices=self.choices,
            steps=tuple(self.steps),
        )

    def _parts(self, node: Node) -> Iterator[Node]:
        """What is side by side, however deep it is nested."""
        match node:
            case SideBySide(parts=parts):
                for part in parts:
                    yield from self._parts(part)
            case InSequence(parts=parts) if len(full := [part for part in parts if not is_empty(part)]) <= 1:
                for part in full:
                    yield from self._parts(part)
            case Alternatives(id=choice, options=(Option(labels=(int(label),), node=inner),)):
                if choice is not None:
                    self.choices[choice] = label
                yield from self._parts(inner)
            case _:
                yield node

    def _wait_for(self, underway: Underway) -> None:
        """Take in a step that is under way and that nothing else of the network follows."""
        self.least_ms = max(self.least_ms, underway.left_ms)
        for i, robot in enumerate(underway.robots):
            start = replace(self._start(robot), ms=underway.left_ms, begun=True)
            place = underway.ends[i] if underway.ends else None
            self._begin(robot, start if place is None else replace(start, place=self.places[place]))

    def _start(self, robot: str) -> Start:
        at = self.network.robots[robot].at
        return Start(place=None if at is None else self.places[at])

    def _begin(self, robot: str, start: Start) -> None:
        if robot in self.starts:
            raise Coupled
        self.starts[robot] = start
        self.least_ms = max(self.least_ms, start.ms)

    def _add(self, ways: Sequence[Way]) -> None:
        """Take in a job, given all ways to do it."""
        if any(isinstance(step, Underway) for way in ways for step in way.steps):
            self._go_on(ways)
            return
        computed = [way for way in ways if way.robot is None]
        if computed:
            self._compute(min(computed, key=_computing_ms), alone=len(computed) == len(ways))
            return
        for way in ways:
            alike: dict[int | None, Leg | None] = {}
            for robot in way.robots or (str(way.robot),):
                if robot in self.legs:
                    profile = self.network.travel.profile.get(robot)
                    if profile not in alike:
                        alike[profile] = self._leg(way, robot)
                    leg = alike[profile]
                    if leg is not None:
                        self.legs[robot].append(leg)
        self.count += 1

    def _compute(self, way: Way, *, alone: bool) -> None:
        """Take in a job without a robot; it begins at once."""
        at = _computing_ms(way)
        if at > 0 and not alone:
            raise Coupled  # whether it is better done by a robot depends on all the rest
        self.least_ms = max(self.least_ms, at)
        self.choices.update(way.choices)
        at = 0
        for step in way.steps:
            assert isinstance(step, Step)
            self.steps.append(StartedStep(id=step.id, robots=(), start_ms=at, end_ms=at + step.fixed_ms))
            at += step.fixed_ms

    def _go_on(self, ways: Sequence[Way]) -> None:
        """Take in a job that a robot is at: it ends it before it does anything else."""
        underway = ways[0].steps[0] if ways[0].steps else None
        if not isinstance(underway, Underway) or any(way.steps[:1] != (underway,) for way in ways):
            raise Coupled
        if len(underway.robots) != 1:
            raise Coupled
        (robot,) = underway.robots
        start = self._start(robot)
        if underway.ends and underway.ends[0] is not None:
            start = replace(start, place=self.places[underway.ends[0]])
        made = [self._leg(replace(way, steps=way.steps[1:]), robot, start) for way in ways]
        legs = _undominated([leg for leg in made if leg is not None], limited=self._limited(robot))
        if len(legs) != 1:
            raise Coupled  # which of them is best depends on what it does next
        leg = legs[0]
        work_ms = leg.ms - leg.computing_ms  # what is under way was counted when it began
        start = replace(start, ms=underway.left_ms + leg.ms, work_ms=work_ms, begun=True)
        self._begin(robot, replace(start, place=leg.end, leg=leg, leg_ms=underway.left_ms))

    def _limited(self, robot: str) -> bool:
        return self.network.robots[robot].work_ms is not None

    def _leg(self, way: Way, robot: str, start: Start | None = None) -> Leg | None:
        """What a way comes to for a robot and all that travel like it.

        Args:
            way: Its steps must not be under way.
            robot: Who does it.
            start: Where the robot is; None: anywhere.

        Returns:
            None: there is no way.
        """
        if way.loose and not _is_one_go(way.steps, begun=start is not None):
            raise Coupled
        goal, odds, ms, computing_ms, steps = None, 1.0, 0, 0, []
        end = None if start is None else start.place
        known = start is not None
        for step in way.steps:
            assert isinstance(step, Step)
            took_ms, travels = step.fixed_ms, False
            if step.robots and step.goal is not None:
                to = self.places[step.goal]
                if known:
                    travel_ms = int(self._from(robot, end)[to])
                    if travel_ms == NO_WAY:
                        return None
                    took_ms += round(travel_ms / step.odds)
                elif goal is None:
                    goal, odds, travels = to, step.odds, True
                else:
                    raise Coupled  # two travels from a place that is not known
            if step.robots and step.ends and step.ends[0] is not None:
                known, end = True, self.places[step.ends[0]]
            ms += took_ms
            computing_ms += 0 if step.robots else took_ms
            steps.append(LegStep(id=step.id, ms=took_ms, robot=bool(step.robots), travels=travels))
        return Leg(
            job=self.count,
            goal=goal,
            odds=odds,
            ms=ms,
            computing_ms=computing_ms,
            end=end,
            choices=way.choices,
            own=way.own,
            steps=tuple(steps),
        )

    def _from(self, robot: str, place: int | None) -> Milliseconds:
        """Travel times to all places."""
        travel = self.network.travel
        if robot not in travel.profile:
            return np.full(len(self.places), NO_WAY, dtype=np.int64)
        return travel.here[robot] if place is None else travel.between[travel.profile[robot]][place]

    def _crews(self) -> Iterator[Crew]:
        """Robots with the same legs and the same start, together."""
        matrices: dict[tuple[int | None, tuple[int, ...]], Milliseconds] = {}
        kept: dict[tuple[int, ...], list[Leg]] = {}
        crews: dict[object, Crew] = {}
        for name in sorted(self.network.robots):
            limit = self.network.robots[name].work_ms
            legs = self._best(self.legs[name], kept, limited=limit is not None)
            start = self.starts.get(name) or self._start(name)
            if not legs and not start.begun:
                continue
            profile = self.network.travel.profile.get(name)
            alike = profile, tuple(map(id, legs))
            if alike not in matrices:
                rows = [self._from(name, place) for place in range(len(self.places))]
                square = np.array(rows, dtype=np.int64).reshape(len(rows), len(rows))
                matrices[alike] = _durations(square, legs)
            ms = matrices[alike]
            first_ms = _durations(self._from(name, None)[None], legs)[0] if start.place is None else ms[start.place]
            key: object = name if start.begun else (*alike, start.place, limit, first_ms.tobytes())
            if key in crews:
                crews[key] = replace(crews[key], robots=(*crews[key].robots, name))
                continue
            crews[key] = Crew(
                robots=(name,),
                legs=tuple(legs),
                job=np.array([leg.job for leg in legs], dtype=np.int64),
                ms=ms,
                first_ms=first_ms,
                end=np.array([SAME_ROW if leg.end is None else leg.end for leg in legs], dtype=np.int64),
                computing_ms=np.array([leg.computing_ms for leg in legs], dtype=np.int64),
                start=start,
                work_ms=limit,
            )
        return iter(crews.values())

    def _best(self, legs: Sequence[Leg], kept: dict[tuple[int, ...], list[Leg]], *, limited: bool) -> list[Leg]:
        """A robot's legs without those that are no use."""
        by_job: dict[int, list[Leg]] = {}
        for leg in legs:
            by_job.setdefault(leg.job, []).append(leg)
        best = []
        for same in by_job.values():
            if len(same) > 1:
                key = tuple(map(id, same))
                if key not in kept:
                    kept[key] = _undominated(same, limited=limited)
                same = kept[key]
                if limited and len({leg.computing_ms for leg in same}) > 1:
                    raise Coupled  # of two runs over the same jobs, the shorter one may be more work
            best += same
        return best


def _undominated(legs: Sequence[Leg], *, limited: bool) -> list[Leg]:
    """Of legs for the same job, those that are no longer (and, for a limited robot, no more work) than one like it."""

    def size(leg: Leg) -> tuple[int, int]:
        return leg.ms, leg.ms - leg.computing_ms if limited else 0

    best: list[Leg] = []
    for leg in sorted(legs, key=size):
        if not any(
            (other.goal, other.odds, other.end) == (leg.goal, leg.odds, leg.end) and size(other)[1] <= size(leg)[1]
            for other in best
        ):
            best.append(leg)
    return best


def _durations(travel_ms: Milliseconds, legs: Sequence[Leg]) -> Milliseconds:
    """Durations of legs, shape (n, legs), given travel times from n places to all, shape (n, places)."""
    goals = np.array([-1 if leg.goal is None else leg.goal for leg in legs], dtype=np.int64)
    odds = np.array([leg.odds for leg in legs])
    ms = np.array([leg.ms for leg in legs], dtype=np.int64)
    way = travel_ms[:, goals] if travel_ms.shape[1] else np.zeros((len(travel_ms), len(legs)), dtype=np.int64)
    took = np.where(goals < 0, 0, np.rint(way / odds).astype(np.int64))
    return np.where((goals >= 0) & (way == NO_WAY), NEVER, took + ms)


def _computing_ms(way: Way) -> int:
    return sum(step.fixed_ms for step in way.steps if isinstance(step, Step))


def _is_one_go(steps: Sequence[Step | Underway], *, begun: bool) -> bool:
    """Whether nothing is gained by doing something else between these steps: only the first one moves the robot."""
    later = steps if begun else steps[1:]
    return all(step.robots for step in steps) and not any(
        isinstance(step, Step) and (step.goal is not None or any(end is not None for end in step.ends))
        for step in later
    )
