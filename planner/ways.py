"""All ways for one robot through a part of a network, in one go."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

from planner.network import Alternatives, Held, InSequence, Label, Node, SideBySide, Step, Underway

MAX_WAYS = 256
"""A job with more ways to do it than this is left to the other optimizer."""


class Coupled(Exception):
    """The network does not fall apart."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """One way through a part of the network.

    Attributes:
        robot: Name, or `?ID`, of who does it; None: computations only.
        robots: For whom `robot` stands, once that is known.
        loose: The robot may do something else between the steps.
    """

    robot: str | None = None
    robots: tuple[str, ...] = ()
    choices: tuple[tuple[str, Label], ...] = ()
    own: tuple[str, ...] = ()
    steps: tuple[Step | Underway, ...] = ()
    loose: bool = False


def is_empty(node: Node) -> bool:
    """Whether there is no step in it."""
    return isinstance(node, InSequence | SideBySide) and all(map(is_empty, node.parts))


def ways_through(node: Node) -> Iterator[Way]:
    """All ways through a part.

    Raises:
        Coupled: It is not for one robot in one go, or there are too many ways.
    """
    match node:
        case Step(robots=robots, claims=()) if len(robots) <= 1:
            yield Way(robot=robots[0] if robots else None, steps=(node,))
        case Underway(robots=(robot,), claims=()):
            yield Way(robot=robot, steps=(node,))
        case InSequence(parts=parts):
            yield from _sequences(parts)
        case SideBySide(parts=parts) if len(full := [part for part in parts if not is_empty(part)]) <= 1:
            yield from _sequences(full)
        case Held(robot=robot, part=part):
            for way in ways_through(part):
                if way.robot not in (None, robot):
                    raise Coupled
                yield replace(way, robot=robot, loose=False)
        case Alternatives(id=choice, options=options):
            for option in options:
                for way in ways_through(option.node):
                    yield way if choice is None else _chosen(way, choice, option.labels)
        case _:
            raise Coupled


def _sequences(parts: Sequence[Node]) -> Iterator[Way]:
    """All ways through parts one after the other."""
    every = [list(ways_through(part)) for part in parts]
    count = 1
    for ways in every:
        count *= len(ways)
    if count > MAX_WAYS:
        raise Coupled
    for combined in product(*every):
        robots = {way.robot for way in combined} - {None}
        named = {way.robots for way in combined} - {()}
        doing = bool(robots)
        if len(robots) > 1 or len(named) > 1:
            raise Coupled
        steps = tuple(step for way in combined for step in way.steps)
        yield Way(
            robot=robots.pop() if robots else None,
            robots=named.pop() if named else (),
            choices=tuple(choice for way in combined for choice in way.choices),
            own=tuple(choice for way in combined for choice in way.own),
            steps=steps,
            loose=any(way.loose for way in combined) or (doing and sum(bool(way.steps) for way in combined) > 1),
        )


def _chosen(way: Way, choice: str, labels: Sequence[Label]) -> Way:
    """The way, after a choice has been made for it."""
    if way.robot == f"?{choice}":
        return replace(way, robots=tuple(map(str, labels)), own=(choice, *way.own))
    return replace(way, choices=((choice, labels[0]), *way.choices))
