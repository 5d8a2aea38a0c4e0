"""How many bytes of data messages hold."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping

import numpy as np


def payload_bytes(value: object) -> int:
    """The data in a message, or in the fields of a request: numbers, texts, arrays, without what a transport adds.

    A number counts as 8 bytes, a truth value as 1, a text as its UTF-8, an array as its elements.
    """
    match value:
        case None:
            return 0
        case np.ndarray():
            return int(value.nbytes)
        case bytes() | bytearray() | memoryview():
            return len(value)
        case str():
            return len(value.encode())
        case bool():
            return 1
        case int() | float():
            return 8
        case Mapping():
            return sum(map(payload_bytes, value.values()))
        case Iterable():
            return sum(map(payload_bytes, value))
        case _ if dataclasses.is_dataclass(value):
            names = (field.name for field in dataclasses.fields(value) if not field.name.startswith("__"))  # its type
            return sum(payload_bytes(getattr(value, name)) for name in names)
        case _:
            raise TypeError(f"no message: {type(value).__name__}")
