"""Terms: what Python and Prolog say to each other, and the only place that quotes.

A term is a `str` (an atom: the name of an individual, class, property or process), an `int`, a
`float`, a `bool` (the atoms true and false), a `Var`, a `Struct` or a list of terms. `render` writes
it as Prolog text that reads back as the same term, whatever characters it holds.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any, TypeAlias, Union

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
        ValueError: What Prolog cannot read: inf, nan, half a surrogate pair, a variable without a proper name.
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
    if atom.isascii() and atom.isprintable():  # most are, and 300 actions a second cross over
        return "'" + atom.replace("\\", "\\\\").replace("'", "\\'") + "'"
    return "'" + "".join(_escape(character) for character in atom) + "'"


def _escape(character: str) -> str:
    if character in "'\\":
        return "\\" + character
    # SWI-Prolog 9.0 refuses the escapes of some characters beyond 16 bits, but reads all of them as they are.
    if character.isprintable() or character > "\uffff":
        return character
    if "\ud800" <= character <= "\udfff":
        raise ValueError(f"no Prolog atom has the character {character!r}: half a surrogate pair")
    return f"\\x{ord(character):x}\\"


def read_term(told: Any) -> Term:
    """The term that Prolog tells as JSON: {"f": functor, "a": arguments}, {"v": number} for a variable."""
    match told:
        case {"f": functor, "a": arguments}:
            return Struct(functor, tuple(map(read_term, arguments)))
        case {"v": number}:
            return Var(f"V{number}")
        case list():
            return [read_term(t) for t in told]
        case str() | int() | float():
            return told
        case _:
            raise ValueError(f"no term: {told!r}")


@dataclass(frozen=True, slots=True)
class Data:
    """A message that only the executive holds, by the place where it is kept."""

    place: str


@dataclass(frozen=True, slots=True)
class Fluent:
    """The present value of a property of an individual."""

    prop: str
    subject: str

    @property
    def place(self) -> str:
        """Where the executive keeps the value if it is a message."""
        return f"{self.prop}({self.subject})"


Value: TypeAlias = str | int | float | bool | Data | Fluent


@dataclass(frozen=True, slots=True, kw_only=True)
class Argument:
    """A parameter of a process and its value."""

    name: str
    role: str
    value: Value


@dataclass(frozen=True, slots=True, kw_only=True)
class Action:
    """A process bound to its arguments: a primitive action, or a composite one.

    Attributes:
        id: Names the step within its task; the same step of a loop has the same id every time.
        robots: Who does it, together, the one that travels first; none for what needs no robot.
    """

    id: str
    process: str
    robots: tuple[str, ...]
    arguments: tuple[Argument, ...]

    @property
    def robot(self) -> str | None:
        """Who does it, or the first of several; None for what needs no robot."""
        return next(iter(self.robots), None)

    def argument(self, name: str) -> Value | None:
        """The value of a parameter."""
        return next((a.value for a in self.arguments if a.name == name), None)

    def __str__(self) -> str:
        """As [RoboEarth] Listing 7 writes it: `NavMap(amigo_1,"tue_lab")`; data are left out."""
        shown = [
            str(a.value) if a.role == "robot" else f'"{a.value}"'
            for a in self.arguments
            if a.role != "output" and not isinstance(a.value, Data | Fluent)
        ]
        return f"{self.process}({','.join(shown)})"
