"""What remains of a program while the checker replays a plan: a tree of what has begun, over terms that have not.

Only the shape is here; planner/checking/walk.py says what may begin and what has ended. The terms of programs are
listed in planner/golog/syntax.pl.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from kb.terms import Struct, Term
from planner.checking.moment import Binding, bound


@dataclass(frozen=True, slots=True)
class Todo:
    """Nothing of it has begun, but for the turns that a loop has had."""

    term: Term
    binding: Binding


@dataclass(frozen=True, slots=True)
class Running:
    """A step has started, and may have ended by now."""

    id: str


@dataclass(frozen=True, slots=True)
class Scope:
    """A composite process has begun."""

    id: str
    name: str
    arguments: tuple[Term, ...]
    body: Node


@dataclass(frozen=True, slots=True)
class Row:
    """One after the other; nothing of the rest has begun."""

    first: Node
    rest: tuple[Todo, ...]


@dataclass(frozen=True, slots=True)
class Side:
    """Side by side.

    Attributes:
        parts: What has not ended, by number.
        frames: Numbers of the parts, by what the ids of their steps begin with; None for parts without steps. A part
            keeps its frame.
        restless: The parts in which something may end though no step of theirs does.
    """

    parts: Mapping[int, Node]
    frames: Mapping[str | None, tuple[int, ...]]
    restless: frozenset[int]

    def around(self, frames: Iterable[str]) -> list[int]:
        """The parts that may have steps in any of these frames, by number."""
        return [n for frame in frames for n in self.frames.get(frame, ()) if n in self.parts]

    def changed(self, number: int, part: Node, *, restless: bool) -> Node:
        """With another state of one part; without it if nothing remains of it."""
        others = self.restless if restless or number not in self.restless else self.restless - {number}
        if part is not DONE:
            return Side({**self.parts, number: part}, self.frames, others | {number} if restless else others)
        parts = {n: p for n, p in self.parts.items() if n != number}
        return Side(parts, self.frames, others) if parts else DONE


@dataclass(frozen=True, slots=True)
class Ranked:
    """Side by side; a part makes a step only if none before it can."""

    parts: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class Limited:
    """Ends by a time, in milliseconds since the clock was made."""

    by_ms: int
    body: Node


Node: TypeAlias = Todo | Running | Scope | Row | Side | Ranked | Limited

DONE: Node = Todo([], {})
"""Nothing remains; there is but one."""


def side(parts: Sequence[Node], restless: Callable[[Node], bool]) -> Node:
    """Side by side."""
    left = [part for part in parts if part is not DONE]
    frames: dict[str | None, tuple[int, ...]] = {}
    for number, part in enumerate(left):
        frame = frame_of(part)
        frames[frame] = (*frames.get(frame, ()), number)
    alert = frozenset([number for number, part in enumerate(left) if restless(part)])
    return Side(dict(enumerate(left)), frames, alert) if left else DONE


def frame_of(node: Node) -> str | None:
    """What the ids of all steps of a part begin with, up to a slash; None if it has no steps."""
    match node:
        case Todo(term, binding):
            return _frame(term, binding)
        case Running(step_id) | Scope(step_id):
            return step_id.rpartition("/")[0]
        case Row(first, rest):
            return _outermost([first, *rest])
        case Side(parts):
            return _outermost(parts.values())
        case Ranked(ranked):
            return _outermost(ranked)
        case Limited(_, body):
            return frame_of(body)


def _outermost(nodes: Iterable[Node]) -> str | None:
    """Frames lie within one another: the shortest is around all."""
    return min((f for f in map(frame_of, nodes) if f is not None), key=len, default=None)


def _frame(term: Term, binding: Binding) -> str | None:
    match term:
        case Struct("call" | "choice" | "pick" | "foreach" | "star" | "any_order" | "interrupt", (frame, *_)):
            return str(bound(frame, binding))
        case Struct(_, parts) | list(parts):
            frames = (_frame(part, binding) for part in parts)
            return next((f for f in frames if f is not None), None)
        case _:
            return None


def frames_of(step_id: str) -> tuple[str, ...]:
    """All frames that a step may be in."""
    parts = step_id.split("/")
    return tuple(["/".join(parts[:n]) for n in range(1, len(parts))])
