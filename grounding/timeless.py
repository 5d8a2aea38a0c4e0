"""Fields of requests and replies as bytes, with the time of the call taken out of them.

Two calls that differ in nothing but when they are made have equal bytes, and the bytes of a reply give the reply to the
same call at another time: a stamp that is the time of the call is written as "now". Any other stamp is a value like
any other. The bytes are CBOR and run nothing when they are read.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import cbor2
import numpy as np

from grounding.messages import Time, class_of, stamp_of

# Tags of our own (CBOR's way to say what kind of value follows); these bytes are for nobody else.
_MESSAGE, _ARRAY, _NOW = 65_501, 65_502, 65_503


class Unreadable(Exception):
    """These bytes are not fields."""


def to_bytes(fields: Mapping[str, object], t_s: float) -> bytes:
    """Fields of a call at `t_s` seconds; equal ones, in equal order, have equal bytes.

    Raises:
        TypeError: One is neither a message nor an array, a plain value, a list or a mapping of such.
    """
    return cbor2.dumps(_plain(dict(fields), stamp_of(t_s)))


def from_bytes(data: bytes, t_s: float) -> dict[str, object]:
    """The fields of a call at `t_s` seconds. Their arrays are read-only.

    Raises:
        Unreadable: `to_bytes` has not made these bytes.
    """
    try:
        fields = _whole(cbor2.loads(data), stamp_of(t_s))
    except (cbor2.CBORDecodeError, ValueError, TypeError, KeyError) as error:
        raise Unreadable(str(error)) from error
    if not isinstance(fields, dict):
        raise Unreadable(f"holds {type(fields).__name__}, not fields")
    return fields


def _plain(value: Any, now: Time) -> object:
    match value:
        case np.generic() | np.ndarray() if value.dtype.hasobject:
            raise TypeError(f"an array of {value.dtype} has no bytes of its own")
        case np.generic() | np.ndarray():
            return cbor2.CBORTag(_ARRAY, [value.dtype.str, list(value.shape), value.tobytes()])
        case None | bool() | int() | float() | str() | bytes():
            return value
        case list():
            return [_plain(item, now) for item in value]
        case dict():
            return {str(name): _plain(item, now) for name, item in value.items()}
        case Time() if value == now:
            return cbor2.CBORTag(_NOW, None)
        case _:
            name = str(getattr(value, "__msgtype__", ""))
            if type(value) is not class_of(name):
                raise TypeError(f"{type(value).__name__} is no message")
            parts = [_plain(getattr(value, field.name), now) for field in dataclasses.fields(value)]
            return cbor2.CBORTag(_MESSAGE, [name, parts])


def _whole(value: Any, now: Time) -> object:
    if isinstance(value, list | tuple):  # cbor2 gives tuples below a tag
        return [_whole(item, now) for item in value]
    if isinstance(value, Mapping):
        return {name: _whole(item, now) for name, item in value.items()}
    if not isinstance(value, cbor2.CBORTag):
        return value
    if value.tag == _NOW:
        return dataclasses.replace(now)
    if value.tag == _ARRAY:
        dtype, shape, content = value.value
        array = np.frombuffer(content, dtype=dtype).reshape(shape)
        # A single number such as numpy.float32 was written as an array without dimensions; [()] takes it out.
        return array if shape else array[()]
    name, parts = value.value
    kind = class_of(name)
    if value.tag != _MESSAGE or kind is None:
        raise TypeError(f"tag {value.tag} with {name} is not of ours")
    return kind(*(_whole(part, now) for part in parts))
