"""Terms: what Python and Prolog say to each other, and the only place that quotes.

A term is a `str` (an atom: the name of an individual, class, property or process), an `int`, a
`float`, a `bool` (the atoms true and false), a `Var`, a `Struct` or a list of terms. `render` writes
it as Prolog text that reads back as the same term, whatever characters it holds.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TypeAlias, Union

_UNQUOTED = re.compile(r"[a-z][A-Za-z0-9_]*\Z")


@dataclass(frozen=True, slots=True)
class Var:
    """A logical variable, named for people: `Robot`, `Location`."""

    name: str


@dataclass(frozen=True, slots=True)
class Struct:
    """A compound term `functor(args...)` with at least one argument."""

    functor: str
    args: tuple[Term, ...]


Term: TypeAlias = Union[str, int, float, Var, Struct, "list[Term]"]


def struct(functor: str, *args: Term) -> Struct:
    """A compound term."""
    return Struct(functor, args)


def render(term: Term) -> str:
    """Write a term as Prolog text.

    Raises:
        ValueError: A number that Prolog cannot read (inf, nan), or a variable without a proper name.
    """
    match term:
        case bool():
            return "true" if term else "false"
        case int():
            return str(term)
        case float():
            if not math.isfinite(term):
                raise ValueError(f"no Prolog term for the number {term}")
            text = repr(term)
            return text if "." in text else text.replace("e", ".0e")
        case str():
            return quote(term)
        case Var(name):
            if not re.fullmatch(r"[A-Z_][A-Za-z0-9_]*", name):
                raise ValueError(f"not the name of a Prolog variable: {name!r}")
            return name
        case Struct(functor, args):
            return f"{quote(functor)}({','.join(map(render, args))})"
        case list():
            return f"[{','.join(map(render, term))}]"


def quote(atom: str) -> str:
    """Write an atom, in quotes where it needs them."""
    if _UNQUOTED.match(atom):
        return atom
    return "'" + "".join(_escape(character) for character in atom) + "'"


def _escape(character: str) -> str:
    if character in "'\\":
        return "\\" + character
    if character.isprintable():
        return character
    return f"\\x{ord(character):x}\\"
