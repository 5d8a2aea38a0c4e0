"""What waits for a slow reader: what gives way, and what does not."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grounding.rosbridge.outbox import Outbox, Packet, ReadsTooSlowly


def _message(text: str, topic: str = "/scan", queue_length: int = 0) -> Packet:
    return Packet(frames=(text,), topic=topic, queue_length=queue_length)


def _all(outbox: Outbox) -> list[str | bytes]:
    texts: list[str | bytes] = []
    while (packet := outbox.pop()) is not None:
        texts += packet.frames
    return texts


def test_the_oldest_messages_give_way_and_replies_stay() -> None:
    """Order is kept among what is left; what was dropped is counted by topic, once."""
    outbox = Outbox(soft_bytes=4000, hard_bytes=100_000)
    outbox.put(_message("old" + "x" * 1000))
    outbox.put(Packet(frames=("reply",)))
    outbox.put(_message("map" + "x" * 1000, topic="/map"))
    outbox.put(_message("new" + "x" * 1000))
    assert outbox.take_dropped() == {"/scan": 1}
    assert outbox.take_dropped() == {}
    assert [text[:5] for text in _all(outbox)] == ["reply", "mapxx", "newxx"]
    assert outbox.waiting_bytes == 0


def test_a_queue_length_bounds_its_own_topic() -> None:
    """Of this topic the newest stay, others are left alone."""
    outbox = Outbox(soft_bytes=100_000, hard_bytes=200_000)
    for number in range(4):
        outbox.put(_message(f"a{number}", queue_length=2))
        outbox.put(_message(f"b{number}", topic="/odom"))
    assert _all(outbox) == ["b0", "b1", "a2", "b2", "a3", "b3"]
    assert outbox.take_dropped() == {"/scan": 2}


def test_replies_that_nobody_reads_are_too_much_at_last() -> None:
    """Messages of topics make room first."""
    outbox = Outbox(soft_bytes=2000, hard_bytes=4000)
    outbox.put(_message("x" * 1000))
    for _ in range(2):
        outbox.put(Packet(frames=("y" * 1000,)))
    assert outbox.take_dropped() == {"/scan": 1}
    with pytest.raises(ReadsTooSlowly, match="bytes wait to be read, 4000 may"):
        outbox.put(Packet(frames=("y" * 1000,)))


@given(
    st.lists(
        st.none() | st.tuples(st.sampled_from(["", "/a", "/b"]), st.integers(0, 800), st.integers(0, 3)),
        max_size=60,
    )
)
def test_whatever_happens_the_count_is_right_and_messages_stay_within_the_limit(
    deeds: list[tuple[str, int, int] | None],
) -> None:
    """Everything put in is taken out, dropped or waiting; replies come out complete and in order."""
    outbox = Outbox(soft_bytes=5000, hard_bytes=10**9)
    put: list[Packet] = []
    out: list[Packet] = []
    dropped = 0
    for number, deed in enumerate(deeds):
        if deed is None:
            out += [packet] if (packet := outbox.pop()) else []
        else:
            topic, size, queue_length = deed
            put.append(Packet(frames=(f"{number}:" + "x" * size,), topic=topic, queue_length=queue_length))
            outbox.put(put[-1])
        dropped += sum(outbox.take_dropped().values())
        assert len(put) == len(out) + dropped + len(outbox)
    while (packet := outbox.pop()) is not None:
        out.append(packet)
    assert outbox.waiting_bytes == 0
    order = [put.index(packet) for packet in out]
    assert order == sorted(order)
    assert [packet for packet in out if not packet.topic] == [packet for packet in put if not packet.topic]
