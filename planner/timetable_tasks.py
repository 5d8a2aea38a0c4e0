"""Tasks: parts of a network that are done in one go.

A step, or a held part whose steps all follow one another, needs no inner decisions beyond which mode (robot,
alternatives) it is done in: what remains is when it starts, and how long it waits for resources on the way. Only its
first travel depends on what its robot has done before.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TypeAlias

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
    StartedStep,
    Step,
    Travel,
    Underway,
)

MAX_MODES = 512
"""Parts that can be done in more ways are not taken as one task."""

NEVER = 1 << 40
"""A duration: it cannot be done. Many of them add up without overflow."""

FREE, TAKE = 0, 1
"""What happens to resources at an edge; they are freed before others are taken."""

Edge: TypeAlias = tuple[int, int]
"""The number of a piece, and TAKE: its start, or FREE: the end of the one before it."""

Symbols: TypeAlias = Mapping[str, Sequence[str]]
"""`?ID` -> robots that it may stand for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A step of a mode.

    Attributes:
        robots: Names.
        ms: How long it takes, without the mode's first travel.
        travels: It begins with that travel.
    """

    id: str
    robots: tuple[str, ...]
    ms: int
    travels: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Use:
    """A mode uses a resource from the start of a piece to the end of a piece (numbers)."""

    resource: str
    first: int
    last: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Mode:
    """One way to do a task.

    Attributes:
        robots: All that do it, the one that travels first; none: computations only.
        given: Robots by the symbols that are decided outside of the task.
        choices: Made with the mode, by id.
        goal: Where the first robot travels to first; None: no travel.
        odds: That travel takes its time divided by this.
        ends: By robot, where it is afterwards; None: where it was before.
        pieces: One after the other, at least one.
        uses: Of resources.
    """

    robots: tuple[str, ...]
    given: tuple[tuple[str, str], ...] = ()
    choices: tuple[tuple[str, Label], ...] = ()
    goal: str | None = None
    odds: float = 1.0
    ends: tuple[str | None, ...] = ()
    pieces: tuple[Piece, ...]
    uses: tuple[Use, ...] = ()

    @property
    def ms(self) -> int:
        """How long it takes at least, without the first travel."""
        return sum(piece.ms for piece in self.pieces)

    @property
    def work_ms(self) -> int:
        """How long its robots work, without the first travel."""
        return sum(piece.ms for piece in self.pieces if piece.robots)

    @property
    def workers(self) -> frozenset[str]:
        """Its robots but for those that are only held."""
        return frozenset(robot for piece in self.pieces for robot in piece.robots)

    @property
    def edges(self) -> tuple[Edge, ...]:
        """Where it may have to wait or lets go of a resource, in order; its start is the first, its end the last."""
        taken = {(use.first, TAKE) for use in self.uses} | {(0, TAKE)}
        freed = {(use.last + 1, FREE) for use in self.uses} | {(len(self.pieces), FREE)}
        return tuple(sorted(taken | freed))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Branch:
    """A node of a network.

    Attributes:
        modes: If it is one task.
        parts: Else: what it is made of, in the order of the node's parts or options.
        least_ms: It takes no less, wherever the robots are; NEVER: it cannot be done.
        kept_ms: When a known solution comes to the edges of the one mode that is left. Robots, and resources that
            only one may use, serve all tasks that have such times in their order. None: they need not.
    """

    node: Node
    modes: tuple[Mode, ...] | None = None
    parts: tuple[Branch, ...] = ()
    least_ms: int
    kept_ms: tuple[int, ...] | None = None


def is_begun(branch: Branch) -> bool:
    """Whether a step of it is under way."""
    return isinstance(branch.node, Underway) or any(map(is_begun, branch.parts))


def underway(branch: Branch) -> Iterator[Underway]:
    """All steps of it that are under way, in the order in which they are written."""
    if isinstance(branch.node, Underway):
        yield branch.node
    for part in branch.parts:
        yield from underway(part)


def grow(network: Network) -> Branch:
    """The network with its tasks."""
    return _Growth(network).branch(network.root, {}, frozenset())


def way_ms(travel: Travel, robot: str, start: str | None, goal: str, odds: float) -> int | None:
    """How long a robot travels from a place, or (None) from where it is when the plan is made; None: no way."""
    to = travel.places.index(goal)
    row = travel.here[robot] if start is None else travel.between[travel.profile[robot]][travel.places.index(start)]
    ms = int(row[to])
    return None if ms == NO_WAY else round(ms / odds)


def done_as(mode: Mode, choices: Mapping[str, Label], steps: Mapping[str, StartedStep]) -> bool:
    """Whether a solution with these choices, and steps by id, does a task in this mode."""
    return all(choices.get(choice) == label for choice, label in mode.choices) and all(
        piece.id in steps and steps[piece.id].robots == piece.robots for piece in mode.pieces
    )


def edges_ms(mode: Mode, steps: Mapping[str, StartedStep]) -> tuple[int, ...]:
    """When a solution with these steps, by id, comes to the edges of a mode in which it does a task."""
    return tuple(
        steps[mode.pieces[piece].id].start_ms if kind == TAKE else steps[mode.pieces[piece - 1].id].end_ms
        for piece, kind in mode.edges
    )


def longest_ms(root: Branch, network: Network) -> int:
    """No plan without needless waiting takes longer: all tasks one after the other, after what is under way."""
    longest, todo = max((node.left_ms for node in underway(root)), default=0), [root]
    ways: dict[tuple[str, str, float], int] = {}
    while todo:
        branch = todo.pop()
        todo += branch.parts
        took = [0]
        for mode in branch.modes or ():
            way = 0
            if mode.goal is not None:
                key = mode.robots[0], mode.goal, mode.odds
                if key not in ways:
                    starts = (None, *network.travel.places)
                    ways[key] = max(way_ms(network.travel, key[0], start, *key[1:]) or 0 for start in starts)
                way = ways[key]
            took.append(mode.ms + way)
        longest += max(took)
    return longest


class _Growth:
    """What is known of a network while its tasks are found."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self.ends = frozenset(_ends(network.root))
        self.least_way: dict[tuple[str, str], int | None] = {}

    def branch(self, node: Node, symbols: Symbols, held: frozenset[str]) -> Branch:
        """A part; robots that are `held` by what is around it are not held once more."""
        modes = _modes(node, self.network, symbols, held)
        if modes is not None and len(modes) <= MAX_MODES:
            return Branch(node=node, modes=tuple(modes), least_ms=min(map(self._least, modes), default=NEVER))
        match node:
            case InSequence(parts=nodes) | AnyOrder(parts=nodes):
                parts = tuple(self.branch(part, symbols, held) for part in nodes)
                return Branch(node=node, parts=parts, least_ms=sum(part.least_ms for part in parts))
            case SideBySide(parts=nodes):
                parts = tuple(self.branch(part, symbols, held) for part in nodes)
                return Branch(node=node, parts=parts, least_ms=max((part.least_ms for part in parts), default=0))
            case Alternatives(id=choice, options=options):
                parts = tuple(self.branch(o.node, _with(symbols, choice, o.labels), held) for o in options)
                return Branch(node=node, parts=parts, least_ms=min((part.least_ms for part in parts), default=NEVER))
            case Held(robot=robot, part=inner) if robot in held:
                return self.branch(inner, symbols, held)
            case Held(part=inner) | Claimed(part=inner) | Deadline(part=inner):
                part = self.branch(inner, symbols, held | {node.robot} if isinstance(node, Held) else held)
                return Branch(node=node, parts=(part,), least_ms=part.least_ms)
            case Underway(left_ms=left_ms):
                return Branch(node=node, least_ms=left_ms)
            case Step():
                raise AssertionError("a step is a task")

    def _least(self, mode: Mode) -> int:
        """The least time that the mode takes, wherever its first robot may come from."""
        if mode.goal is None:
            return mode.ms
        key = mode.robots[0], mode.goal
        if key not in self.least_way:
            starts = [self.network.robots[key[0]].at, *self.ends]
            ways = (way_ms(self.network.travel, key[0], start, mode.goal, 1.0) for start in starts)
            self.least_way[key] = min((way for way in ways if way is not None), default=None)
        way = self.least_way[key]
        return NEVER if way is None else round(way / mode.odds) + mode.ms


def _ends(node: Node) -> Iterator[str]:
    """All places where a step of the part leaves a robot."""
    match node:
        case Step(ends=ends) | Underway(ends=ends):
            yield from (end for end in ends if end is not None)
        case InSequence(parts=parts) | SideBySide(parts=parts) | AnyOrder(parts=parts):
            for part in parts:
                yield from _ends(part)
        case Alternatives(options=options):
            for option in options:
                yield from _ends(option.node)
        case Held(part=part) | Claimed(part=part) | Deadline(part=part):
            yield from _ends(part)


def full(parts: Sequence[Node]) -> list[Node]:
    """The parts in which there is something to do."""
    return [part for part in parts if not (isinstance(part, InSequence | SideBySide) and not full(part.parts))]


def _modes(node: Node, network: Network, symbols: Symbols, held: frozenset[str]) -> list[Mode] | None:
    """All modes of a part that is one task, possibly none; None where it is not one task."""
    match node:
        case Held(robot=robot, part=part) if robot in held:
            return _modes(part, network, symbols, held)
        case Step() | Held():
            lines = _lines(node, network, symbols)
            holder = [node.robot] if isinstance(node, Held) else []
            if lines is None or (holder and not _is_alone(holder[0], lines)):
                return None
            return [
                mode for line in lines for crew in _crews(line, holder, symbols) for mode in _mode(line, crew, network)
            ]
        case InSequence(parts=parts) | SideBySide(parts=parts) if len(full(parts)) == 1:
            return _modes(full(parts)[0], network, symbols, held)
        case Claimed(claims=claims, part=part):
            modes = _modes(part, network, symbols, held)
            return modes and [replace(m, uses=_merged(claims, len(m.pieces), m.uses)) for m in modes]
        case Alternatives(id=choice, options=options):
            found: list[Mode] = []
            for option in options:
                inner = _modes(option.node, network, _with(symbols, choice, option.labels), held)
                if inner is None:
                    return None
                found += (_chosen(mode, choice, option.labels) for mode in inner)
            return found
        case _:
            return None


def _with(symbols: Symbols, choice: str | None, labels: Sequence[Label]) -> Symbols:
    return {**symbols, f"?{choice}": [str(label) for label in labels]} if len(labels) > 1 else symbols


def _chosen(mode: Mode, choice: str | None, labels: Sequence[Label]) -> Mode:
    """The mode, when it includes a choice."""
    if choice is None:
        return mode
    given = dict(mode.given)
    label = given.pop(f"?{choice}", labels[0])
    return replace(mode, given=tuple(given.items()), choices=((choice, label), *mode.choices))


def _merged(claims: Sequence[str], size: int, uses: Sequence[Use]) -> tuple[Use, ...]:
    """Uses, within a part of so many pieces that has the claims: what it has, its steps need not claim."""
    outer = [Use(resource=claim, first=0, last=size - 1) for claim in dict.fromkeys(claims)]
    return (*outer, *(use for use in uses if use.resource not in claims))


# ------------------------------------------------------------------------------------------- lines of steps


@dataclass(frozen=True, slots=True, kw_only=True)
class _Line:
    """Steps one after the other, with the choices that lead to them; symbols stand for robots."""

    steps: tuple[Step, ...] = ()
    uses: tuple[Use, ...] = ()
    choices: tuple[tuple[str, Label], ...] = ()

    def then(self, other: _Line) -> _Line:
        n = len(self.steps)
        later = (replace(use, first=use.first + n, last=use.last + n) for use in other.uses)
        return _Line(steps=self.steps + other.steps, uses=(*self.uses, *later), choices=self.choices + other.choices)


def _lines(node: Node, network: Network, symbols: Symbols) -> list[_Line] | None:
    """All lines that a part may come to; None where it is not just one step after the other."""
    match node:
        case Step(claims=claims):
            return [_Line(steps=(node,), uses=_merged(claims, 1, ()))]
        case Held(part=part):
            return _lines(part, network, symbols)
        case Claimed(claims=claims, part=part):
            lines = _lines(part, network, symbols)
            if lines is None or not all(line.steps for line in lines):
                return None
            return [replace(line, uses=_merged(claims, len(line.steps), line.uses)) for line in lines]
        case InSequence(parts=parts):
            all_lines = [_lines(part, network, symbols) for part in parts]
            joined = [_Line()]
            for lines in all_lines:
                if lines is None or len(joined) * len(lines) > MAX_MODES:
                    return None
                joined = [one.then(other) for one, other in product(joined, lines)]
            return joined
        case SideBySide(parts=parts) if len(full(parts)) <= 1:
            return _lines(InSequence(parts=parts), network, symbols)
        case Alternatives(id=choice, options=options) if all(len(option.labels) == 1 for option in options):
            found: list[_Line] = []
            for option in options:
                inner = _lines(option.node, network, symbols)
                if inner is None:
                    return None
                made = () if choice is None else ((choice, option.labels[0]),)
                found += (replace(line, choices=made + line.choices) for line in inner)
            return found
        case _:
            return None


def _is_alone(robot: str, lines: Sequence[_Line]) -> bool:
    """Whether the robot does it all, but for computations, and where it goes is known but for the first travel."""
    for line in lines:
        if not line.steps or any(step.robots not in ((), (robot,)) for step in line.steps):
            return False
        known, traveled = False, False
        for step in line.steps:
            if step.goal is not None:
                if traveled and not known:
                    return False
                traveled = True
            known = known or any(end is not None for end in step.ends)
    return True


def _crews(line: _Line, holder: Sequence[str], symbols: Symbols) -> Iterator[dict[str, str]]:
    """Different robots for the names and symbols of a line, and of who is held meanwhile."""
    named = list(dict.fromkeys([*holder, *(robot for step in line.steps for robot in step.robots)]))
    for crew in product(*(symbols.get(robot, [robot]) for robot in named)):
        if len(set(crew)) == len(crew):
            yield dict(zip(named, crew, strict=True))


def _mode(line: _Line, robots: Mapping[str, str], network: Network) -> Iterator[Mode]:
    """The line, done by these robots, if there is a way."""
    crew = tuple(robots.values())
    if any(robot not in network.robots for robot in crew):
        return
    goal, odds = None, 1.0
    ends: dict[str, str | None] = dict.fromkeys(crew)
    pieces = []
    for step in line.steps:
        names = tuple(robots[robot] for robot in step.robots)
        ms, travels = step.fixed_ms, False
        if step.goal is not None:
            start = ends[names[0]]
            if start is None:
                goal, odds, travels = step.goal, step.odds, True
            else:
                way = way_ms(network.travel, names[0], start, step.goal, step.odds)
                if way is None:
                    return
                ms += way
        for name, end in zip(names, step.ends, strict=False):
            ends[name] = end if end is not None else ends[name]
        pieces.append(Piece(id=step.id, robots=names, ms=ms, travels=travels))
    yield Mode(
        robots=crew,
        given=tuple((symbol, name) for symbol, name in robots.items() if symbol.startswith("?")),
        choices=line.choices,
        goal=goal,
        odds=odds,
        ends=tuple(ends.values()),
        pieces=tuple(pieces),
        uses=line.uses,
    )
