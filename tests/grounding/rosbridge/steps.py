"""The words in which exchanges of the rosbridge protocol are written; `exchanges` tells what they mean."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

Encoding = Literal["json", "cbor", "png", "fragment"]


@dataclass(frozen=True, slots=True)
class Like:
    """Stands for any value that a test holds for; `words` say which."""

    holds: Callable[[Any], bool]
    words: str

    def __repr__(self) -> str:
        return f"<{self.words}>"


@dataclass(frozen=True, slots=True)
class Saved:
    """Stands for the id that a step before got and saved under this name."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Sends:
    """A client sends the fields as JSON, or a frame as it is."""

    client: str
    fields: Mapping[str, object] | None = None
    frame: str | bytes | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Gets:
    """A client's next operation has these fields among others.

    Attributes:
        encoding: Of the frame, or of each frame, that brings it.
        save: Name under which its id is kept for `Saved`; None if it is not needed.
    """

    client: str
    fields: Mapping[str, object]
    encoding: Encoding = "json"
    save: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Leaves:
    """A client's connection ends."""

    client: str


Step = Sends | Gets | Leaves


@dataclass(frozen=True, slots=True, kw_only=True)
class Exchange:
    """One example of what the protocol says.

    Attributes:
        ops: The operations that it is about.
        valid: Whether all that is sent is right.
    """

    name: str
    ops: tuple[str, ...]
    steps: tuple[Step, ...]
    valid: bool = True


def matches(expected: object, actual: object, saved: Mapping[str, object]) -> bool:
    """Whether a value is what an exchange expects: objects may have further fields, all else is equal."""
    match expected:
        case Like():
            return expected.holds(actual)
        case Saved():
            return actual == saved[expected.name]
        case Mapping():
            return isinstance(actual, Mapping) and all(
                key in actual and matches(value, actual[key], saved) for key, value in expected.items()
            )
        case list():
            elements = actual if isinstance(actual, list) else getattr(actual, "tolist", lambda: None)()
            return (
                isinstance(elements, list)
                and len(elements) == len(expected)
                and all(matches(one, other, saved) for one, other in zip(expected, elements, strict=True))
            )
        case _:
            return type(expected) is type(actual) and expected == actual


def filled_in(value: object, saved: Mapping[str, object]) -> Any:
    """What is to be sent, with the saved ids in their places."""
    match value:
        case Saved():
            return saved[value.name]
        case Mapping():
            return {key: filled_in(inner, saved) for key, inner in value.items()}
        case _:
            return value


def tells(*words: str) -> Like:
    """A text with all of these words."""
    return Like(lambda v: isinstance(v, str) and all(word in v for word in words), f"a text with {', '.join(words)}")


WHOLE = Like(lambda v: isinstance(v, int) and not isinstance(v, bool), "a whole number")
ANY_TEXT = Like(lambda v: isinstance(v, str) and v != "", "a text")
FRESH_ID = Like(lambda v: isinstance(v, str | int) and v not in ("", "c1", "g1"), "an id of the server's own")
NOT_SUCCEEDED = Like(lambda v: v in (0, 6), "the status 0 or 6")


def sends(client: str, op: str, /, **fields: object) -> Sends:
    """A step: the client sends an operation."""
    return Sends(client=client, fields={"op": op, **fields})


def gets(client: str, op: str, /, *, encoding: Encoding = "json", save: str | None = None, **fields: object) -> Gets:
    """A step: the client gets an operation."""
    return Gets(client=client, fields={"op": op, **fields}, encoding=encoding, save=save)


def is_told(client: str, *words: str, id: object = None) -> Gets:  # noqa: A002 - the protocol's word
    """A step: the client gets a status of level error with these words, and the id if one is given."""
    fields = {"op": "status", "level": "error", "msg": tells(*words)}
    return Gets(client=client, fields=fields if id is None else {**fields, "id": id})


def nothing_before(client: str) -> tuple[Step, Step]:
    """Two steps: the client asks for the time and gets it, so nothing else was on its way."""
    return (
        sends(client, "call_service", service="/rosapi/get_time", id="mark"),
        gets(client, "service_response", id="mark", result=True, values={"time": {"sec": WHOLE, "nanosec": WHOLE}}),
    )


def exchange(name: str, ops: str, *steps: Step | tuple[Step, ...], valid: bool = True) -> Exchange:
    """An exchange about these operations, divided by spaces."""
    flat = [one for step in steps for one in (step if isinstance(step, tuple) else (step,))]
    return Exchange(name=name, ops=tuple(ops.split()), steps=tuple(flat), valid=valid)


def wrong(name: str, ops: str, *steps: Step | tuple[Step, ...]) -> Exchange:
    """An exchange in which something is wrong."""
    return exchange(name, ops, *steps, valid=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class FromServer:
    """A frame that a server may send out of turn.

    Attributes:
        problem: A word that the client's reason for passing it over holds; empty if it is right.
    """

    name: str
    frame: str | bytes
    problem: str
