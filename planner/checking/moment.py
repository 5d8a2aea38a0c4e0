"""A moment of a plan as the checker replays it: what is true then, who is busy, what is in use."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from kb.terms import Struct, Term, Var

Binding: TypeAlias = Mapping[str, Term]
"""Values of variables by name."""


class CannotCheck(Exception):
    """The program has a term that no reading is known of; the text says which. Compiled programs have none."""


class OnlyActingTells(Exception):
    """A condition depends on what only acting finds out.

    Attributes:
        place: Where the executive will keep the truth value: `Frame/Name`.
    """

    def __init__(self, place: str) -> None:
        super().__init__(place)
        self.place = place


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A step that is running, or a composite process that has begun."""

    name: str
    arguments: tuple[Term, ...]
    robots: tuple[str, ...]
    end_ms: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """Times in milliseconds since the clock was made.

    Attributes:
        fluents: Values that effects have set, by (property, subject).
        running: Steps by id.
        busy: The step that each robot does, by robot.
        held: What keeps a robot, by robot.
        claimed: Ids of what uses a resource, by resource.
        team: All robots that have taken part.
        worked_ms: How long each robot has been busy with steps, those that run taken whole.
        taken: How many of the plan's answers to each choice have been used, by id of the choice.
    """

    now_ms: int
    fluents: Mapping[tuple[str, str], Term]
    running: Mapping[str, Run]
    busy: Mapping[str, str]
    held: Mapping[str, str]
    claimed: Mapping[str, tuple[str, ...]]
    team: frozenset[str]
    worked_ms: Mapping[str, int]
    taken: Mapping[str, int]


def bound(term: Term, binding: Binding) -> Term:
    """A term with the values of its variables."""
    if isinstance(term, str):
        return term
    if isinstance(term, Var):
        return binding.get(term.name, term)
    if isinstance(term, Struct):
        return Struct(term.functor, tuple([bound(a, binding) for a in term.args]))
    return [bound(a, binding) for a in term] if isinstance(term, list) else term


def shown(value: Term) -> str:
    """An argument as plans show it: an individual by name, data by where they are."""
    match value:
        case Struct("loc", (frame, name)):
            return f"{frame}/{name}"
        case Struct("fluent", (prop, subject)):
            return f"{prop}({subject})"
        case Var(name):
            return name
        case _:
            return str(value)


def same(one: Term, other: Term) -> bool:
    """Whether two values are one; true is not 1, and 1 is not 1.0."""
    return type(one) is type(other) and one == other
