"""Whether conditions hold in a snapshot, of some individuals, with the values that decide it.

For readiness only: what robots wait for while they work is decided by the planner's own projection.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from kb.ontology import Value
from kb.processes import Process
from kb.store import Snapshot
from kb.terms import Struct, Term, Var

MOST_COMBINATIONS = 20_000
"""So many combinations of individuals are looked at; after that, it is not known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Held:
    """Whether a condition holds.

    Attributes:
        holds: Of some individuals; None if it cannot be told: it asks for data that a step makes, or there are too many
            combinations.
        values: What decides it, where it does not hold and only one combination was looked at: `payload_kg(pico_1) is
            1`.
    """

    holds: bool | None
    values: tuple[str, ...] = ()


def held(snapshot: Snapshot, process: Process, condition: Term, given: Mapping[str, str]) -> Held:
    """Whether a condition of a process can hold now.

    Args:
        given: Individuals by the names of the parameters that are decided; for others all of their class are tried.
    """
    own = set(_variables(condition))
    known = {_variable(name): value for name, value in given.items()}
    open_names = [p for p in process.parameters if _variable(p.name) in own - set(known)]
    choices = [snapshot.ontology.individuals(p.kind) for p in open_names]
    total = 1
    for choice in choices:
        total *= len(choice)
    if total > MOST_COMBINATIONS:
        return Held(holds=None)
    unknown = False
    for combination in itertools.product(*choices):
        bound = known | {_variable(p.name): i for p, i in zip(open_names, combination, strict=True)}
        found = _holds(snapshot, condition, bound)
        if found:
            return Held(holds=True)
        unknown = unknown or found is None
    if unknown:
        return Held(holds=None)
    return Held(holds=False, values=tuple(dict.fromkeys(_decisive(snapshot, condition, known))) if not choices else ())


def _holds(snapshot: Snapshot, condition: Term, bound: Mapping[str, Value]) -> bool | None:
    """Three-valued (Kleene): None where it is not known, because a step finds it out."""
    match condition:
        case Struct("all", (list(parts),)):
            return _together([_holds(snapshot, p, bound) for p in parts], decisive=False)
        case Struct("any", (list(parts),)):
            return _together([_holds(snapshot, p, bound) for p in parts], decisive=True)
        case Struct("not", (part,)):
            found = _holds(snapshot, part, bound)
            return None if found is None else not found
        case Struct("holds", (str(prop), subject, value)):
            who, what = _value(snapshot, subject, bound), _value(snapshot, value, bound)
            if who is None or what is None:
                return None
            return what in _values(snapshot, prop, str(who))
        case Struct("compare", (str(word), left, right)):
            return _compared(word, _value(snapshot, left, bound), _value(snapshot, right, bound))
        case Struct("is_a", (thing, str(kind))):
            who = _value(snapshot, thing, bound)
            return None if who is None else snapshot.ontology.is_a(str(who), kind)
        case Struct("same", (left, right)):
            one, other = _value(snapshot, left, bound), _value(snapshot, right, bound)
            return None if one is None or other is None else one == other
        case Struct("some", (list(variables), part)):
            return _some(snapshot, variables, part, bound)
        case _:
            return None


def _some(snapshot: Snapshot, variables: list[Term], part: Term, bound: Mapping[str, Value]) -> bool | None:
    ranges: list[tuple[str, list[str]]] = []
    for variable in variables:
        match variable:
            case Struct("-", (Var(name), str(kind))):
                ranges.append((name, snapshot.ontology.individuals(kind)))
            case _:
                return None  # drawn from a value: the planner's business
    total = 1
    for _, individuals in ranges:
        total *= len(individuals)
    if total > MOST_COMBINATIONS:
        return None
    found = [
        _holds(snapshot, part, {**bound, **dict(zip([n for n, _ in ranges], combination, strict=True))})
        for combination in itertools.product(*(i for _, i in ranges))
    ]
    return _together(found, decisive=True)


def _together(found: list[bool | None], *, decisive: bool) -> bool | None:
    """One decisive part decides; else what is not known leaves it open."""
    if decisive in found:
        return decisive
    return None if None in found else not decisive


def _compared(word: str, left: Value | None, right: Value | None) -> bool | None:
    if not isinstance(left, int | float) or not isinstance(right, int | float):
        return False if left is None or right is None else left == right if word == "equal" else None
    match word:
        case "less":
            return left < right
        case "at_most":
            return left <= right
        case "more":
            return left > right
        case "at_least":
            return left >= right
        case _:
            return left == right


def _value(snapshot: Snapshot, term: Term, bound: Mapping[str, Value]) -> Value | None:
    match term:
        case Var(name):
            return bound.get(name)
        case Struct("value", (str(prop), subject)):
            who = _value(snapshot, subject, bound)
            return None if who is None else snapshot.value(prop, str(who))
        case Struct("plus" | "minus" | "times" as word, (left, right)):
            one, other = _value(snapshot, left, bound), _value(snapshot, right, bound)
            if not isinstance(one, int | float) or not isinstance(other, int | float):
                return None
            return one + other if word == "plus" else one - other if word == "minus" else one * other
        case bool() | int() | float() | str():
            return term
        case _:
            return None


def _values(snapshot: Snapshot, prop: str, subject: str) -> tuple[Value, ...]:
    told = snapshot.fluents.get((prop, subject))
    return snapshot.ontology.values(prop, subject) if told is None else (told,)


def _decisive(snapshot: Snapshot, condition: Term, bound: Mapping[str, Value]) -> Iterator[str]:
    """The present values that a condition asks for, told."""
    match condition:
        case Struct("holds" | "value", (str(prop), subject, *_)):
            who = _value(snapshot, subject, bound)
            if who is not None:
                values = _values(snapshot, prop, str(who))
                yield f"{prop}({who}) is {', '.join(map(_shown, values)) if values else 'not known'}"
        case Struct("is_a", (thing, str(kind))):
            yield f"{_value(snapshot, thing, bound)} is no {kind}"
        case Struct(_, arguments):
            for argument in arguments:
                yield from _decisive(snapshot, argument, bound)
        case list():
            for part in condition:
                yield from _decisive(snapshot, part, bound)
        case _:
            pass


def _shown(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _variables(term: Term) -> Iterator[str]:
    match term:
        case Var(name):
            yield name
        case Struct(_, arguments):
            for argument in arguments:
                yield from _variables(argument)
        case list():
            for part in term:
                yield from _variables(part)
        case _:
            pass


def _variable(parameter: str) -> str:
    return parameter[0].upper() + parameter[1:]
