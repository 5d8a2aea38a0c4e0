"""The inbox: what waits to be taken, and how much of it may."""

from __future__ import annotations

import pytest

from grounding.rosbridge.connection import TooMuch
from grounding.rosbridge.inbox import Inbox
from grounding.rosbridge.operations import Operation, Publish, ServiceResponse


def reply(number: int) -> Operation:
    """A reply."""
    return ServiceResponse(service="/echo", id=number, result=True)


def message(topic: str, number: int) -> Operation:
    """A message of a topic."""
    return Publish(topic=topic, msg={"data": number})


def test_replies_are_all_kept_and_of_each_topic_the_newest() -> None:
    """In the order in which they came; a newer message comes where it came, not where the older one was."""
    inbox = Inbox(1_000_000)
    puts = [message("/a", 1), reply(1), message("/b", 1), message("/a", 2), reply(2)]
    firsts = [inbox.put(operation, 10) for operation in puts]
    assert firsts == [True, False, False, False, False]
    assert inbox.take_all() == [reply(1), message("/b", 1), message("/a", 2), reply(2)]
    assert (inbox.take_all(), inbox.superseded) == ([], 1)
    assert inbox.put(message("/a", 3), 10)


def test_it_is_bounded_in_bytes() -> None:
    """By the frames, and by their number where they are small; a topic never takes more than one message."""
    large, small = Inbox(1_000_000), Inbox(1_000_000)
    for number in range(100):
        large.put(message("/a", number), 900_000)
    with pytest.raises(TooMuch, match=r"takes 1\d+ bytes, 1000000 may"):
        large.put(reply(1), 200_000)
    with pytest.raises(TooMuch):  # noqa: PT012
        for number in range(1_001):
            small.put(reply(number), 1)


def test_what_is_taken_makes_room() -> None:
    """Also for what is as large as all."""
    inbox = Inbox(1_000_000)
    for number in range(10):
        inbox.put(reply(number), 900_000)
        inbox.take_all()
