"""Fields in JSON texts and CBOR bytes: what a single frame holds, and how much it may hold.

Typed arrays of CBOR (RFC 8746, both byte orders) become numpy arrays over the bytes, without a copy. Numpy arrays go
out as such (little-endian), or in JSON as lists, with null for NaN and infinity.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import cbor2
import numpy as np
import orjson

from grounding.rosbridge.operations import Operation, written
from kb.errors import ConcertmasterError


class BadFrame(ConcertmasterError):
    """Bytes or text that are no frame, or more than is allowed.

    Attributes:
        reason: One sentence: what is wrong, and what would be right.
    """

    fault = "request"

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What a frame, and what all half-finished ones of a connection together, may take.

    Attributes:
        max_bytes: Of a frame, and of a text put together from fragments or taken out of an image.
        max_depth: Of objects and lists in each other.
        max_objects: Objects, lists and typed arrays: each takes many times the memory of its characters.
        max_items: Elements of objects and lists; typed arrays and base64 texts count as one.
        max_unfinished: Texts of which some fragments are missing.
        max_fragments: Of one text.
        fragment_timeout_s: After this time without a further fragment what there is of the text is thrown away.
    """

    max_bytes: int = 10_000_000
    max_depth: int = 32
    max_objects: int = 100_000
    max_items: int = 2_000_000
    max_unfinished: int = 16
    max_fragments: int = 20_000
    fragment_timeout_s: float = 600.0


_TYPED_ARRAYS: Mapping[int, np.dtype[Any]] = {
    first + number: np.dtype(name)
    for first, names in {
        64: ("u1", ">u2", ">u4", ">u8", "u1", "<u2", "<u4", "<u8"),
        72: ("i1", ">i2", ">i4", ">i8"),
        77: ("<i2", "<i4", "<i8", ">f2", ">f4", ">f8"),
        84: ("<f2", "<f4", "<f8"),
    }.items()
    for number, name in enumerate(names)
}
"""Tags of RFC 8746, section 2.1; float128 has no type here."""

_TAGS = {dtype: tag for tag, dtype in _TYPED_ARRAYS.items() if tag != 68 and dtype.str[0] != ">"}  # 68 is "clamped"

_STRINGS = re.compile(r'"(?:[^"\\]|\\.)*+(?:"|\\?\Z)', re.DOTALL)  # also one without end, so that no text takes long


def read_frame(frame: str | bytes, limits: Limits = Limits()) -> dict[str, object]:
    """The fields in a frame: an object of JSON (text) or CBOR (bytes).

    Raises:
        BadFrame: It is none, or larger, deeper or longer than allowed.
    """
    size = len(frame)
    if size > limits.max_bytes:
        raise BadFrame(f"the frame has {size} bytes, {limits.max_bytes} are allowed")
    if isinstance(frame, str):
        brackets = _count_brackets(frame, limits)
        tree = _read_json(frame)
    else:
        brackets = 0
        tree = _read_cbor(bytes(frame), limits)
    if not isinstance(tree, dict):
        raise BadFrame(f"the frame holds a {type(tree).__name__}, should be an object with the field op")
    # Most frames need no walk: few brackets cannot nest deep, cbor2 looks after depth itself, each thing takes a byte.
    if brackets > limits.max_depth or size > limits.max_objects:
        _check_size(tree, limits)
    return tree


def _count_brackets(text: str, limits: Limits) -> int:
    """About how many objects and lists a text has, counted before they take memory; refuses too many."""
    brackets = text.count("{") + text.count("[")
    if brackets > limits.max_objects or text.count(",") > limits.max_items:
        bare = _STRINGS.sub("", text)
        brackets = bare.count("{") + bare.count("[")
        _refuse_many(brackets, bare.count(","), limits)
    return brackets


def _refuse_many(objects: int, items: int, limits: Limits) -> None:
    if objects > limits.max_objects:
        raise BadFrame(f"the frame has more than {limits.max_objects} objects and lists")
    if items > limits.max_items:
        raise BadFrame(f"the frame has more than {limits.max_items} elements; large arrays should be bytes")


def _read_json(text: str) -> object:
    try:
        return orjson.loads(text)
    except orjson.JSONDecodeError as error:
        if "NaN" not in text and "Infinity" not in text:
            raise BadFrame(f"the frame is no JSON: {error}") from None
    # Python's own writer, and so roslibpy, writes NaN and Infinity, which JSON has not.
    try:
        tree: object = json.loads(text)
        orjson.dumps(tree)  # nor does JSON have half characters or very large numbers, which `json` lets pass
        return tree
    except (ValueError, TypeError, RecursionError) as error:
        raise BadFrame(f"the frame is no JSON: {error}") from None


def _read_cbor(data: bytes, limits: Limits) -> object:
    _count_heads(data, limits)
    try:
        return cbor2.loads(
            data,
            tag_hook=_array_of_tag,
            semantic_decoders=_NO_DECODERS,
            max_depth=limits.max_depth,
            strict_hashable_types=True,
        )
    except Exception as error:  # noqa: BLE001 - whatever the bytes were, they are no frame
        cause = error.__cause__
        if isinstance(cause, BadFrame):
            raise cause from None
        raise BadFrame(f"the frame is no CBOR: {str(error) or type(error).__name__}") from None


def _count_heads(data: bytes, limits: Limits) -> None:
    """Refuse too many objects, lists and typed arrays before they take memory.

    Items stand one after the other in CBOR, however they nest (RFC 8949, section 3): no recursion is needed.
    """
    # Lists begin with 0x80, then come objects and tags to 0xdf; the difference wraps around below 0.
    if np.count_nonzero(np.frombuffer(data, np.uint8) - np.uint8(0x80) < 0x60) <= limits.max_objects:
        return
    objects = at = 0
    while at < len(data) and (data[at] & 31) not in (28, 29, 30):
        kind, low = data[at] >> 5, data[at] & 31
        length = 1 << (low - 24) if 24 <= low < 28 else 0
        number = int.from_bytes(data[at + 1 : at + 1 + length], "big") if length else low % 31
        at += 1 + length + (number if kind in (2, 3) else 0)
        objects += kind in (4, 5, 6)
        _refuse_many(objects, 0, limits)


def _array_of_tag(tag: cbor2.CBORTag, _immutable: bool) -> object:
    dtype = _TYPED_ARRAYS.get(tag.tag)
    if dtype is None:
        raise BadFrame(f"the frame has CBOR tag {tag.tag}, only typed arrays (RFC 8746) are read")
    if not isinstance(tag.value, bytes) or len(tag.value) % dtype.itemsize:
        raise BadFrame(f"the frame has a typed array of {dtype.name} that is no whole number of elements")
    return np.frombuffer(tag.value, dtype)


def _refuse_tag(_value: object, _immutable: bool) -> object:
    raise BadFrame("the frame has a CBOR tag, only those of typed arrays (RFC 8746) are read")


# What cbor2 reads of itself and no ROS message holds: dates, big numbers, patterns, sets, shared and cyclic values.
_REFUSED_TAGS = (0, 1, 2, 3, 4, 5, 25, 28, 29, 30, 35, 36, 37, 52, 54, 100, 256, 258, 260, 261, 1004, 43000, 55799)
_NO_DECODERS = dict.fromkeys(_REFUSED_TAGS, _refuse_tag)


def _check_size(tree: dict[Any, Any], limits: Limits) -> None:
    """Check depth, number of objects and of elements, without recursion."""
    objects = items = 0
    level: list[dict[Any, Any] | list[Any]] = [tree]
    for _ in range(limits.max_depth):
        objects += len(level)
        items += sum(map(len, level))
        _refuse_many(objects, items, limits)
        level = [
            child
            for node in level
            for child in (node.values() if type(node) is dict else node)
            if type(child) is dict or type(child) is list
        ]
        if not level:
            return
    raise BadFrame(f"the frame nests objects and lists deeper than {limits.max_depth}")


def json_of(operation: Operation) -> str:
    """The frame of an operation in JSON.

    Raises:
        BadFrame: It holds what JSON has no words for.
    """
    try:
        return orjson.dumps(written(operation), option=orjson.OPT_SERIALIZE_NUMPY).decode()
    except TypeError as error:
        raise BadFrame(f"{operation.OP} cannot be written as JSON: {error}") from None


def cbor_of(operation: Operation) -> bytes:
    """The frame of an operation in CBOR.

    Raises:
        BadFrame: It holds what CBOR has no form for.
    """
    try:
        return cbor2.dumps(written(operation), default=_write_array)
    except (cbor2.CBOREncodeError, UnicodeEncodeError) as error:
        raise BadFrame(f"{operation.OP} cannot be written as CBOR: {error}") from None


def _write_array(encoder: cbor2.CBOREncoder, value: object) -> None:
    """Write a numpy array: uint8 as plain bytes, as rosbridge does, bool as a list, others as typed arrays."""
    if not isinstance(value, np.ndarray):
        raise cbor2.CBOREncodeTypeError(f"a {type(value).__name__} has no CBOR form")
    dtype = value.dtype.newbyteorder("<")
    if value.dtype == np.uint8:
        encoder.encode(value.tobytes())
    elif dtype in _TAGS:
        encoder.encode(cbor2.CBORTag(_TAGS[dtype], value.astype(dtype, copy=False).tobytes()))
    else:
        encoder.encode(value.tolist())
