from __future__ import annotations

from dataclasses import replace

import cbor2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grounding.rosbridge.encoding import BadFrame, Limits, cbor_of, json_of, read_frame
from grounding.rosbridge.operations import Operation, Publish

_SMALL = Limits(max_bytes=2_000, max_depth=8, max_items=100, max_objects=50, max_unfinished=2, max_fragments=10)


@pytest.mark.parametrize(
    ("tag", "data", "expected"),
    [
        (65, "0102", [258]),
        (69, "0102", [513]),
        (73, "ff00", [-256]),
        (81, "3fc00000", [1.5]),
        (82, "3ff8000000000000", [1.5]),
        (85, "0000c03f", [1.5]),
        (80, "3e00", [1.5]),
        (84, "003e", [1.5]),
        (67, "0000000000000001" * 2, [1, 1]),
        (68, "07ff", [7, 255]),
        (79, "feffffffffffffff", [-2]),
        (86, "", []),
    ],
)
def test_typed_arrays_of_both_byte_orders_are_read(tag: int, data: str, expected: list[float]) -> None:
    """Tags and layouts are those of RFC 8746, section 2.1."""
    fields = read_frame(cbor2.dumps({"a": cbor2.CBORTag(tag, bytes.fromhex(data))}))
    array = fields["a"]
    assert isinstance(array, np.ndarray)
    assert array.tolist() == expected


def test_nan_and_infinity_that_python_writes_are_read() -> None:
    """Python's own writer of JSON, and so roslibpy, sends them bare."""
    fields = read_frame('{"xs": [NaN, Infinity, -Infinity, 1], "s": "NaN"}')
    assert repr(fields) == "{'xs': [nan, inf, -inf, 1], 's': 'NaN'}"


@pytest.mark.parametrize("operation", [Publish(topic="/a", msg={"n": 2**64}), Publish(topic="\ud800", msg={})])
def test_what_json_cannot_hold_is_refused_when_written(operation: Operation) -> None:
    """Neither larger whole numbers nor half characters leave us, in place of a frame that nobody can read."""
    with pytest.raises(BadFrame, match="cannot be written as JSON"):
        json_of(operation)


@pytest.mark.parametrize("value", ["\ud800", object()])
def test_what_cbor_cannot_hold_is_refused_when_written(value: object) -> None:
    """A value without a form in CBOR is told, with the operation that held it."""
    with pytest.raises(BadFrame, match="publish cannot be written as CBOR"):
        cbor_of(Publish(topic="/a", msg={"x": value}))


_CYCLE = bytes.fromhex("a16161d81c81d81d00")


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        ("", "is no JSON"),
        ("{", "is no JSON"),
        ("[1]", "holds a list, should be an object"),
        ("null", "should be an object"),
        ('{"a": \ud800}', "is no JSON"),
        ('{"a": NaN, "b": "\\ud800"}', "is no JSON"),
        ('{"a": NaN, "b": 99999999999999999999999}', "is no JSON"),
        ('{"a": NaN, "b": ' + "1" * 1900 + "}", "is no JSON"),
        ('{"a":' * 9 + "1" + "}" * 9, "deeper than 8"),
        ('{"a": NaN, "b":' + "[" * 900 + "]" * 900 + "}", "more than 50 objects and lists"),
        ('{"a":' + "[" * 20 + "]" * 20 + "}", "deeper than 8"),
        ('{"a": [' + "0," * 150 + "0]}", "more than 100 elements"),
        ('{"a": "' + "x" * 2_000 + '"}', "has 2009 bytes, 2000 are allowed"),
        ('{"a": [' + "{}," * 60 + "0]}", "more than 50 objects and lists"),
        (b"", "is no CBOR"),
        (b"\xa1\x61a\x98\x3c" + b"\x80" * 60, "more than 50 objects and lists"),
        (b"\xa1\x61a\x98\x3c" + b"\xd8\x40\x40" * 60, "more than 50 objects and lists"),
        (b"\xff", "is no CBOR"),
        (b"\x01", "holds a int, should be an object"),
        (b"\xa1\x01\x02", "is no CBOR"),
        (b"\x9b\x0f" + b"\xff" * 7, "is no CBOR"),
        (b"\x5b\x0f" + b"\xff" * 7, "is no CBOR"),
        (b"\xbb\x0f" + b"\xff" * 7, "is no CBOR"),
        (b"\xa1\x61a" + b"\x81" * 1_900 + b"\x00", "more than 50 objects and lists"),
        (b"\xa1\x61a" + b"\x81" * 8 + b"\x00", "is no CBOR: maximum container nesting depth"),
        (b"\xa1\x61a\x9f" + b"\x9f\xff" * 60 + b"\xff", "more than 50 objects and lists"),
        (_CYCLE, "CBOR tag|is no CBOR"),
        (bytes.fromhex("a16161c11a514b67b0"), "a CBOR tag"),
        (bytes.fromhex("a16161c249010000000000000000"), "a CBOR tag"),
        (bytes.fromhex("a16161d9123400"), "CBOR tag 4660, only typed arrays"),
        (bytes.fromhex("a16161d85543010203"), "typed array of float32 that is no whole number of elements"),
        (bytes.fromhex("a16161d85581f6"), "typed array of float32 that is no whole number of elements"),
        (bytes.fromhex("a16161d853f6"), "CBOR tag 83"),
    ],
)
def test_bad_frames_are_told(frame: str | bytes, reason: str) -> None:
    """Malformed, too large, too deep, too many, cyclic, or of tags that no message has: one reason each."""
    with pytest.raises(BadFrame, match=reason) as caught:
        read_frame(frame, _SMALL)
    assert len(caught.value.reason) < 300


@pytest.mark.parametrize("start", ['{"a":', '{"b": NaN, "a":'])
@pytest.mark.parametrize("depth", [33, 500, 5_000, 90_000])
def test_no_depth_is_too_deep_for_a_reason(start: str, depth: int) -> None:
    """Neither parser runs out of stack, whatever nests."""
    with pytest.raises(BadFrame, match=r"deeper than 32|is no JSON"):
        read_frame(start + "[" * depth + "]" * depth + "}")


@pytest.mark.parametrize("kind", [bytes, str])
def test_bytes_of_a_text_that_look_like_lists_are_not_counted(kind: type) -> None:
    """What is inside of byte and text strings is no object; nor are numbers, whatever their bytes."""
    content = b"\x80" * 200 if kind is bytes else "\u0400" * 200
    message = {"a": content, "b": [2**31 + 2**23 + 2**15 + 2**7] * 40, "c": 1.5, "d": [None, True]}
    assert read_frame(cbor2.dumps(message), _SMALL) == message


@settings(deadline=None, derandomize=True)
@given(
    st.recursive(
        st.integers(-(2**63), 2**64 - 1) | st.floats() | st.binary() | st.text(),
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
        max_leaves=10,
    )
)
def test_objects_are_counted_exactly_in_cbor(value: object) -> None:
    """A frame with as many objects and lists as are allowed is read, with one less allowed it is not."""
    tree = {"x": value, "padding": [b"\x80" * 300]}
    whole = [tree, *(_inside(tree))]
    limits = replace(Limits(), max_depth=100, max_objects=len(whole))
    assert repr(read_frame(cbor2.dumps(tree), limits)) == repr(tree)
    with pytest.raises(BadFrame, match="objects and lists"):
        read_frame(cbor2.dumps(tree), replace(limits, max_objects=len(whole) - 1))


def _inside(node: object) -> list[object]:
    """All objects and lists in an object or list."""
    children = node.values() if isinstance(node, dict) else node if isinstance(node, list) else ()
    found = [child for child in children if isinstance(child, dict | list)]
    return found + [inner for child in found for inner in _inside(child)]
