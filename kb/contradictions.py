"""Conditions that exclude each other, as far as their terms show it; and conditions for people.

Only what is certain is found: a condition and its negation, two values of a property that has one, numbers
that no number is between.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from kb.terms import Struct, Term, Var, render, struct


def contradiction(conditions: list[Term], functional: set[str]) -> str:
    """Two conditions that never hold together, as text; empty if none were found."""
    found = [atom for condition in conditions for atom in atoms(condition)]
    texts = {render(atom) for atom in found}
    for atom in found:
        if render(struct("not", atom)) in texts:
            return f"{shown(atom)} and not {shown(atom)}"
    for number, one in enumerate(found):
        for other in found[:number]:
            if _exclude(one, other, functional):
                return f"{shown(other)} and {shown(one)}"
    return ""


def atoms(condition: Term) -> Iterator[Term]:
    """Conditions that all hold where a condition holds."""
    match condition:
        case Struct("all", (list(parts),)):
            for part in parts:
                yield from atoms(part)
        case Struct("not", (Struct("any", (list(parts),)),)):
            for part in parts:
                yield from atoms(struct("not", part))
        case Struct("not", (Struct("not", (part,)),)):
            yield from atoms(part)
        case _:
            yield condition


def _exclude(one: Term, other: Term, functional: set[str]) -> bool:
    """Whether one value cannot be as both conditions say."""
    match one, other:
        case Struct("holds", (str(prop), subject, value)), Struct("holds", (str(same), whose, wanted)):
            literal = not isinstance(value, Var | Struct) and not isinstance(wanted, Var | Struct)
            return prop == same and prop in functional and subject == whose and literal and value != wanted
        case (
            Struct("compare", (str(op), Struct("value", (str(prop), subject)), int(limit) | float(limit))),
            Struct("compare", (str(op2), Struct("value", (str(same), whose)), int(limit2) | float(limit2))),
        ):
            (low, high), (low2, high2) = _range(op, limit), _range(op2, limit2)
            lowest, highest = max(low, low2), min(high, high2)
            return prop == same and prop in functional and subject == whose and lowest > highest
        case _:
            return False


def _range(comparison: str, limit: float) -> tuple[float, float]:
    """The least and the greatest number that compares so; next to the limit where that itself does not."""
    match comparison:
        case "less":
            return -math.inf, math.nextafter(limit, -math.inf)
        case "at_most":
            return -math.inf, limit
        case "more":
            return math.nextafter(limit, math.inf), math.inf
        case "at_least":
            return limit, math.inf
        case _:
            return limit, limit


def shown(condition: Term) -> str:
    """A condition for people: `isEmpty(drink, true)`."""
    match condition:
        case Struct("holds", (str(prop), subject, value)):
            return f"{prop}({shown(subject)}, {shown(value)})"
        case Struct("compare", (str(comparison), left, right)):
            return f"{shown(left)} {comparison.replace('_', ' ')} {shown(right)}"
        case Struct("value", (str(prop), subject)):
            return f"{prop}({shown(subject)})"
        case Struct("is_true", (place,)):
            return place_of(place)
        case Struct("not", (part,)):
            return f"not {shown(part)}"
        case Struct("all" | "any" as word, (list(parts),)):
            return f"{word} of ({', '.join(map(shown, parts))})"
        case Struct("some", (_, part)):
            return f"some ({shown(part)})"
        case Struct("is_a", (individual, str(kind))):
            return f"{kind}({shown(individual)})"
        case Struct("same", (one, other)):
            return f"{shown(one)} is {shown(other)}"
        case Struct("plus" | "minus" | "times" as word, (one, other)):
            return f"({shown(one)} {word} {shown(other)})"
        case Var(name) if name.startswith("_"):  # of a rule: _1_place
            return f"?{name.rpartition('_')[2]}"
        case Var():
            return place_of(condition)
        case _:
            return render(condition)


def place_of(term: Term) -> str:
    """The name of the parameter that a place or variable stands for; see kb/constructs.py."""
    match term:
        case Struct("loc", (_, str(name))):
            return name
        case Var(name):
            return name[0].lower() + name[1:]
        case _:
            raise AssertionError(f"no place for data: {render(term)}")
