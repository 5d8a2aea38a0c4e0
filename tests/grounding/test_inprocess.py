"""What is the in-process transport's own; what all transports keep to is in tests/contracts."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from grounding.inprocess import InProcessTransport, Service
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import SimClock

CALL = ServiceCall(id=1, service="/greet", fields={}, timeout_s=1.0)


def test_a_new_service_takes_the_place_of_an_old_one() -> None:
    """A call that is under way already has its answer; the next goes to the new one."""
    clock, replies = SimClock(), list[ServiceReply]()
    transport = InProcessTransport(clock)
    transport.offer("/greet", Service(handler=lambda fields: {"text": "old"}, latency_s=0.5))
    transport.call(CALL, replies.append)
    transport.offer("/greet", Service(handler=lambda fields: {"text": "new"}, latency_s=0.25))
    transport.call(CALL, replies.append)
    clock.run_until(lambda: False)
    assert [reply.fields["text"] for reply in replies] == ["new", "old"]


def test_a_mistake_within_a_service_is_not_taken_for_its_failure() -> None:
    """Only ServiceFailed is an answer; anything else is a bug, and is heard."""

    def mistaken(fields: Mapping[str, object]) -> Mapping[str, object]:
        return {"value": fields["missing"]}

    transport = InProcessTransport(SimClock())
    transport.offer("/greet", Service(handler=mistaken, latency_s=0.5))
    with pytest.raises(KeyError, match="missing"):
        transport.call(CALL, lambda reply: None)


def test_an_unknown_service_is_told_with_the_known() -> None:
    """They are few, and nobody's secret."""
    clock, replies = SimClock(), list[ServiceReply]()
    transport = InProcessTransport(clock)
    for name in ("/wave", "/bow"):
        transport.offer(name, Service(handler=lambda fields: {}, latency_s=0.5))
    transport.call(CALL, replies.append)
    clock.run_until(lambda: False)
    assert replies[0].reason == "there is no service /greet; there is /bow, /wave"


def test_who_speaks_on_a_topic_is_told_when_somebody_begins_to_listen() -> None:
    """Also where somebody does already; what nobody hears is lost, and of two who listen the second does."""
    transport, begun = InProcessTransport(SimClock()), list[str]()
    heard: dict[str, list[object]] = {"first": [], "second": []}
    transport.topics.say("/speed", 0)
    assert not transport.offers("/speed")
    transport.hear_topic("/speed", "std_msgs/Int8", lambda message, problem: heard["first"].append(message))
    transport.topics.offer("/speed", "std_msgs/Int8", begun=lambda: begun.append("/speed"))
    assert transport.offers("/speed")
    transport.topics.say("/speed", 1)
    end = transport.hear_topic("/speed", "std_msgs/Int8", lambda message, problem: heard["second"].append(message))
    transport.topics.say("/speed", 2)
    assert transport.topics.is_heard("/speed")
    end()
    assert not transport.topics.is_heard("/speed")
    transport.topics.say("/speed", 3)
    assert heard == {"first": [1], "second": [2]}
    assert begun == ["/speed", "/speed"]
