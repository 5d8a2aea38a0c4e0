"""Brute force over networks: all choices, all orders in which steps can start. For very small ones.

It shares no code with the solvers. A schedule in which nothing could start earlier is given by who does what and by
the order in which steps start; so it is enough to try all of these, each step as early as can be.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import permutations

from planner.network import (
    NO_WAY,
    Alternatives,
    AnyOrder,
    Claimed,
    Deadline,
    Held,
    InSequence,
    Label,
    Network,
    Node,
    SideBySide,
    Solution,
    Step,
    Underway,
)


@dataclass(slots=True)
class Group:
    """Steps during which a robot is held or a resource is used, from the first start to the last end."""

    kind: str
    what: str
    steps: frozenset[int]


@dataclass(slots=True)
class Chosen:
    """A network without choices: its steps, by number."""

    steps: list[Step | Underway] = field(default_factory=list)
    before: list[frozenset[int]] = field(default_factory=list)
    groups: list[Group] = field(default_factory=list)
    deadlines: list[tuple[int, frozenset[int]]] = field(default_factory=list)


def best_makespan(network: Network) -> int | None:
    """The least makespan; None if there is no schedule at all."""
    found = [m for _, node in ways(network.root) if (m := _least(network, _flat(node), None)) is not None]
    return min(found, default=None)


def replayed_makespan(network: Network, solution: Solution) -> int | None:
    """The makespan if all steps start as early as can be, with the choices and in the order of a solution.

    None: it is not a solution.
    """
    for choices, node in ways(network.root):
        if choices == dict(solution.choices):
            chosen = _flat(node)
            ids = [step.id for step in chosen.steps]
            order = [step.id for step in solution.steps]
            begun = [i for i, step in enumerate(chosen.steps) if isinstance(step, Underway)]
            if sorted(order) == sorted(ids[i] for i in range(len(ids)) if i not in begun):
                makespan = _least(network, chosen, begun + [ids.index(id_) for id_ in order])
                if makespan is not None:
                    return makespan
    return None


def ways(node: Node) -> Iterator[tuple[dict[str, Label], Node]]:
    """All ways to choose, and what remains of the part then."""
    match node:
        case Step() | Underway():
            yield {}, node
        case InSequence(parts=parts) | SideBySide(parts=parts):
            for choices, chosen in _ways_of(parts):
                yield choices, replace(node, parts=chosen)
        case AnyOrder(id=id_, parts=parts):
            for choices, chosen in _ways_of(parts):
                for order in permutations(range(len(parts))):
                    numbers: dict[str, Label] = {f"{id_}/{len(parts) - k}": n + 1 for k, n in enumerate(order)}
                    yield choices | numbers, InSequence(parts=tuple(chosen[n] for n in order))
        case Alternatives(id=id_, options=options):
            for option in options:
                for label in option.labels:
                    inner = named(option.node, f"?{id_}", str(label)) if len(option.labels) > 1 else option.node
                    for choices, chosen_node in ways(inner):
                        yield choices | ({} if id_ is None else {id_: label}), chosen_node
        case Held(part=part) | Claimed(part=part) | Deadline(part=part):
            for choices, chosen_node in ways(part):
                yield choices, replace(node, part=chosen_node)


def _ways_of(parts: tuple[Node, ...]) -> Iterator[tuple[dict[str, Label], tuple[Node, ...]]]:
    if not parts:
        yield {}, ()
        return
    for choices, first in ways(parts[0]):
        for more, rest in _ways_of(parts[1:]):
            yield choices | more, (first, *rest)


def named(node: Node, symbol: str, robot: str) -> Node:
    """The part with a robot for a symbol."""

    def name(part: Node) -> Node:
        return named(part, symbol, robot)

    match node:
        case Step() | Underway():
            return replace(node, robots=tuple(robot if r == symbol else r for r in node.robots))
        case InSequence(parts=parts) | SideBySide(parts=parts) | AnyOrder(parts=parts):
            return replace(node, parts=tuple(map(name, parts)))
        case Alternatives(options=options):
            return replace(node, options=tuple(replace(o, node=name(o.node)) for o in options))
        case Held(robot=holder, part=part):
            return replace(node, robot=robot if holder == symbol else holder, part=name(part))
        case Claimed(part=part) | Deadline(part=part):
            return replace(node, part=name(part))


def _flat(node: Node) -> Chosen:
    flat = Chosen()
    _flatten(node, frozenset(), flat, frozenset(), frozenset())
    return flat


def _flatten(
    node: Node, before: frozenset[int], flat: Chosen, holders: frozenset[str], claims: frozenset[str]
) -> frozenset[int]:
    """Add the steps of a part; all that must have ended before what comes after it."""
    match node:
        case Step() | Underway():
            number = frozenset({len(flat.steps)})
            flat.steps.append(node)
            flat.before.append(before)
            flat.groups += (Group("claim", claim, number) for claim in node.claims if claim not in claims)
            return before | number
        case InSequence(parts=parts):
            for part in parts:
                before = _flatten(part, before, flat, holders, claims)
            return before
        case SideBySide(parts=parts):
            return frozenset().union(before, *(_flatten(part, before, flat, holders, claims) for part in parts))
        case Held(robot=robot, part=part):
            return _flatten_group(Group("robot", robot, frozenset()), part, before, flat, holders, claims)
        case Claimed(claims=names, part=part):
            inner = claims | set(names)
            since = len(flat.steps)
            after = _flatten(part, before, flat, holders, inner)
            inside = frozenset(range(since, len(flat.steps)))
            flat.groups += (Group("claim", name, inside) for name in dict.fromkeys(names) if name not in claims)
            return after
        case Deadline(ms=ms, part=part):
            since = len(flat.steps)
            after = _flatten(part, before, flat, holders, claims)
            flat.deadlines.append((ms, frozenset(range(since, len(flat.steps)))))
            return after
        case _:
            raise AssertionError(node)


def _flatten_group(
    group: Group, part: Node, before: frozenset[int], flat: Chosen, holders: frozenset[str], claims: frozenset[str]
) -> frozenset[int]:
    since = len(flat.steps)
    after = _flatten(part, before, flat, holders | {group.what}, claims)
    if group.what not in holders:
        flat.groups.append(replace(group, steps=frozenset(range(since, len(flat.steps)))))
    return after


@dataclass(slots=True)
class _Search:
    """Depth first, over the order in which steps start."""

    network: Network
    flat: Chosen
    order: list[int] | None
    best: int | None = None

    def go(self, times: dict[int, tuple[int, int]], now: int, place: Mapping[str, str | None]) -> None:
        flat = self.flat
        if len(times) == len(flat.steps):
            makespan = max((end for _, end in times.values()), default=0)
            if all(times[i][1] <= ms for ms, steps in flat.deadlines for i in steps) and self._works(times):
                self.best = makespan if self.best is None else min(self.best, makespan)
            return
        if self.best is not None and max((end for _, end in times.values()), default=0) >= self.best:
            return
        nexts = range(len(flat.steps)) if self.order is None else [self.order[len(times)]]
        for i in nexts:
            if i in times or any(b not in times for b in flat.before[i]):
                continue
            placed = self._place(i, times, now, place)
            if placed is not None:
                start, end, places = placed
                self.go({**times, i: (start, end)}, start, places)

    def _place(
        self, i: int, times: dict[int, tuple[int, int]], now: int, place: Mapping[str, str | None]
    ) -> tuple[int, int, Mapping[str, str | None]] | None:
        step = self.flat.steps[i]
        start = max([now, *(times[b][1] for b in self.flat.before[i])])
        held = {g.what for g in self.flat.groups if g.kind == "robot" and i in g.steps and not g.steps & times.keys()}
        for robot in {*step.robots, *held}:
            start = max([start, *(times[j][1] for j in times if robot in self.flat.steps[j].robots)])
            for group in self.flat.groups:
                if (group.kind, group.what) == ("robot", robot) and i not in group.steps and group.steps & times.keys():
                    if not group.steps <= times.keys():
                        return None
                    start = max(start, *(times[j][1] for j in group.steps))
        claimed = [g for g in self.flat.groups if g.kind == "claim" and i in g.steps and not g.steps & times.keys()]
        for group in claimed:
            others = [g for g in self.flat.groups if (g.kind, g.what) == ("claim", group.what) and g is not group]
            others = [g for g in others if g.steps & times.keys()]
            ends = [max(times[j][1] for j in g.steps) if g.steps <= times.keys() else None for g in others]
            known = sorted(end for end in ends if end is not None)
            room = self.network.capacity.get(group.what, 1) - (len(ends) - len(known))
            if room <= 0:
                return None
            start = max([start, *known[: max(0, len(known) - room + 1)]])
        places = dict(place)
        if isinstance(step, Underway):
            if start > 0:
                return None
            ms = step.left_ms
        else:
            ms = step.fixed_ms
            if step.goal is not None:
                travel = self.network.travel
                robot = step.robots[0]
                at = place[robot]
                row = (
                    travel.here[robot] if at is None else travel.between[travel.profile[robot]][travel.places.index(at)]
                )
                way = int(row[travel.places.index(step.goal)])
                if way == NO_WAY:
                    return None
                ms += round(way / step.odds)
        for robot, end in zip(step.robots, step.ends, strict=False):
            places[robot] = places[robot] if end is None else end
        return start, start + ms, places

    def _works(self, times: dict[int, tuple[int, int]]) -> bool:
        """Whether no robot works too long, no more robots than may take part, and nobody is two at once."""
        work: dict[str, int] = {}
        for i, (start, end) in times.items():
            step = self.flat.steps[i]
            if len(set(step.robots)) != len(step.robots):
                return False
            for robot in step.robots:
                work[robot] = work.get(robot, 0) + (0 if isinstance(step, Underway) else end - start)
        limits = {name: robot.work_ms for name, robot in self.network.robots.items()}
        return len(work) <= self.network.team and all(
            (limit := limits[robot]) is None or ms <= limit for robot, ms in work.items()
        )


def _least(network: Network, flat: Chosen, order: list[int] | None) -> int | None:
    search = _Search(network, flat, order)
    begun = {i: (0, step.left_ms) for i, step in enumerate(flat.steps) if isinstance(step, Underway)}
    place: dict[str, str | None] = {name: robot.at for name, robot in network.robots.items()}
    for i in begun:
        step = flat.steps[i]
        for robot, end in zip(step.robots, step.ends, strict=False):
            place[robot] = place[robot] if end is None else end
    search.go(begun, 0, place)
    return search.best
