from __future__ import annotations

import contextlib
from typing import Any

import cbor2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from grounding.rosbridge.encoding import BadFrame, Limits, read_frame
from grounding.rosbridge.framing import Decoder, frames, raw_message
from grounding.rosbridge.images import png_of
from grounding.rosbridge.operations import BadOperation, Fragment, Operation, Png, Publish, Subscribe, written

_SMALL = Limits(max_bytes=2_000, max_depth=8, max_items=100, max_objects=50, max_unfinished=2, max_fragments=10)
_HELLO = Publish(topic="/chat", msg={"data": "Grüße, 世界 😀"}, id="p1")


def _through(operation: Operation, **how: Any) -> Operation | None:
    """What a reader makes of the frames of an operation."""
    decoder = Decoder()
    result = None
    for frame in frames(operation, **how):
        assert result is None
        result = decoder.feed(frame, 0.0)
    return result


@pytest.mark.parametrize("fragment_size", [None, 1, 7, 10_000])
@pytest.mark.parametrize("compression", ["none", "png", "cbor"])
def test_an_operation_arrives_as_it_was_sent(compression: str, fragment_size: int | None) -> None:
    """In every encoding, whole or in pieces of any size."""
    assert _through(_HELLO, compression=compression, fragment_size=fragment_size) == _HELLO


def test_frames_are_texts_of_json_bytes_of_cbor_or_fragments() -> None:
    """The kind of frame is what the subscriber asked for; small texts stay whole."""
    assert frames(_HELLO) == ['{"op":"publish","topic":"/chat","msg":{"data":"Grüße, 世界 😀"},"id":"p1"}']
    (frame,) = frames(_HELLO, compression="cbor")
    assert isinstance(frame, bytes)
    assert cbor2.loads(frame) == written(_HELLO)
    pieces = [read_frame(frame) for frame in frames(_HELLO, fragment_size=30)]
    assert [(piece["op"], piece["id"], piece["num"], piece["total"]) for piece in pieces] == [
        ("fragment", "p1", num, 3) for num in range(3)
    ]


@pytest.mark.parametrize(
    "dtype", ["int8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64"]
)
def test_arrays_of_numbers_keep_every_bit_in_cbor(dtype: str) -> None:
    """Typed arrays come back in the same type, with NaN, infinity and the outermost values."""
    kind = np.dtype(dtype)
    if kind.kind == "f":
        array = np.array([0.1, -0.0, np.nan, np.inf, -np.inf, np.finfo(kind).max, np.finfo(kind).tiny], kind)
    else:
        array = np.array([0, 1, np.iinfo(kind).min, np.iinfo(kind).max], kind)
    back = _through(Publish(topic="/a", msg={"data": array}), compression="cbor")
    assert isinstance(back, Publish)
    received = back.msg["data"]
    assert isinstance(received, np.ndarray)
    assert received.dtype == kind
    assert received.tobytes() == array.tobytes()


def test_bytes_go_as_bytes_and_truth_values_as_a_list_in_cbor() -> None:
    """As rosbridge sends uint8[] and bool[]."""
    message = {"image": np.arange(4, dtype=np.uint8), "on": np.array([True, False])}
    back = _through(Publish(topic="/a", msg=message), compression="cbor")
    assert isinstance(back, Publish)
    assert back.msg == {"image": b"\x00\x01\x02\x03", "on": [True, False]}


def test_arrays_in_any_layout_are_written_right() -> None:
    """Neither byte order nor gaps between the elements change what arrives."""
    for array in (np.arange(6, dtype=">f4")[::2], np.arange(6, dtype=np.int32)[::-1]):
        back = _through(Publish(topic="/a", msg={"x": array}), compression="cbor")
        assert isinstance(back, Publish)
        assert np.asarray(back.msg["x"]).tolist() == array.tolist()


def test_nan_and_infinity_are_null_in_json() -> None:
    """As single numbers and in arrays (rosbridge v2; JSON has no words for them)."""
    message = {"x": float("nan"), "xs": np.array([np.inf, 1.5], np.float32)}
    assert frames(Publish(topic="/a", msg=message)) == [
        '{"op":"publish","topic":"/a","msg":{"x":null,"xs":[null,1.5]}}'
    ]


def test_whole_numbers_of_64_bits_stay_exact_in_json() -> None:
    """Both ends of the 64-bit types go through a text unchanged."""
    message = {"low": -(2**63), "high": 2**64 - 1}
    back = _through(Publish(topic="/a", msg=message))
    assert isinstance(back, Publish)
    assert back.msg == message


@pytest.mark.parametrize("text", ["[{,}]" * 100, '\\"[{,}]' * 100, "\\\\"])
def test_brackets_and_commas_in_texts_are_not_counted(text: str) -> None:
    """They are no objects, lists or elements; also where quotes in the text are escaped."""
    (frame,) = frames(Publish(topic="/a", msg={"data": text}))
    assert Decoder(_SMALL).feed(frame, 0.0) == Publish(topic="/a", msg={"data": text})


@settings(deadline=None, derandomize=True)
@given(st.binary(max_size=300))
@example(b"\xd8\x1c\xd8\x1d\x00")
@example(b"\xa1\xf9\x7e\x00\x00")
@example(b"\xa1\x7f\xff\x00")
@example(bytes.fromhex("a16161d81c81d81d00"))  # a list in itself
def test_any_bytes_are_an_operation_or_a_reason(frame: bytes) -> None:
    """Nothing but BadFrame and BadOperation comes out of a reader, whatever went in."""
    with contextlib.suppress(BadFrame, BadOperation):
        assert not isinstance(Decoder(_SMALL).feed(frame, 0.0), Fragment | Png)


@settings(deadline=None, derandomize=True)
@given(st.text(max_size=200) | st.from_regex(r'\{("[a-z]{1,3}":[\[\]{}",:0-9a-zN\\]{0,20},?){0,5}\}', fullmatch=True))
@example('{"op":"png","data":"' + png_of('{"op":"png","data":""}') + '"}')
@example('{"a":NaN,"b":1e999}')
@example('{"a":-NaN}')
def test_any_text_is_an_operation_or_a_reason(frame: str) -> None:
    """Likewise for texts."""
    with contextlib.suppress(BadFrame, BadOperation):
        Decoder(_SMALL).feed(frame, 0.0)


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats(allow_nan=False) | st.text() | st.binary(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)


@settings(deadline=None, derandomize=True)
@given(st.dictionaries(st.text(), _VALUES, max_size=4))
def test_any_message_arrives_in_cbor(message: dict[str, object]) -> None:
    """Everything that a tree may hold survives."""
    back = _through(Publish(topic="/a", msg=message), compression="cbor")
    assert isinstance(back, Publish)
    assert back.msg == message


@settings(deadline=None, derandomize=True)
@given(st.dictionaries(st.text(), _VALUES, max_size=4), st.data())
def test_frames_that_were_changed_on_the_way_do_no_harm(message: dict[str, object], data: st.DataObject) -> None:
    """A CBOR frame with a byte changed, dropped or doubled: an operation or a reason."""
    (frame,) = frames(Publish(topic="/a", msg=message), compression="cbor")
    assert isinstance(frame, bytes)
    at = data.draw(st.integers(0, len(frame) - 1))
    broken = frame[:at] + data.draw(st.binary(max_size=3)) + frame[at + data.draw(st.integers(0, 3)) :]
    with contextlib.suppress(BadFrame, BadOperation):
        Decoder(_SMALL).feed(broken, 0.0)


def test_parts_of_an_image_are_put_together_like_fragments() -> None:
    """The protocol has both, and they do not mix: a fragment and an image may have the same id."""
    data = png_of('{"op":"subscribe","topic":"/chat"}')
    decoder = Decoder()
    assert decoder.feed(frames(Fragment(id="a", data="x", num=0, total=2))[0], 0.0) is None
    assert decoder.feed(frames(Png(id="a", data=data[:50], num=0, total=2))[0], 0.0) is None
    assert decoder.feed(frames(Png(id="a", data=data[50:], num=1, total=2))[0], 0.0) == Subscribe(topic="/chat")


def test_a_fragment_in_a_fragment_is_refused() -> None:
    """So is an image in an image; nothing of the protocol makes one, and it would be work without end."""
    inner = frames(Fragment(id="b", data='{"op":"subscribe","topic":"/chat"}', num=0, total=1))[0]
    assert isinstance(inner, str)
    with pytest.raises(BadFrame, match="a fragment inside a fragment"):
        Decoder().feed(frames(Fragment(id="a", data=inner, num=0, total=1))[0], 0.0)
    image = '{"op":"png","data":"' + png_of("{}") + '"}'
    with pytest.raises(BadFrame, match="a png inside a png"):
        Decoder().feed(frames(Png(data=png_of(image)))[0], 0.0)


def test_raw_messages_carry_their_time_in_ros_1_words() -> None:
    """The protocol's section 3.1.4 calls the fields secs, nsecs and bytes, in ROS 2 too."""
    assert raw_message(memoryview(b"abc"), 12.5) == {"secs": 12, "nsecs": 500_000_000, "bytes": b"abc"}
