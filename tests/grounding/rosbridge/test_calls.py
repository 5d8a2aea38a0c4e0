"""Open calls, whatever comes in whatever order."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grounding.rosbridge.calls import Calls, coded
from grounding.rosbridge.connection import NotSent
from grounding.rosbridge.dropped import Dropped
from grounding.rosbridge.operations import CallService, Operation, ServiceResponse, Status
from grounding.rosbridge.types import Types
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import WallClock

TYPES = Types()
SERVICES = {"/echo": TYPES.add_service_of("Echo", {"text": "string"}, {"text": "string"})}

Happening = tuple[str, int]
HAPPENINGS = st.lists(
    st.tuples(st.sampled_from(["call", "reply", "failure", "nonsense", "status", "break", "mend"]), st.integers(0, 9)),
    max_size=40,
)


@given(HAPPENINGS)
def test_every_call_is_answered_at_most_once_and_those_that_break_at_once(happenings: list[Happening]) -> None:
    """Replies, second ones, failures, breaks and calls without a connection in any order; the clock ends by itself."""
    clock, sent, broken = WallClock(), list[CallService](), False
    replies: list[ServiceReply] = []
    replied: set[object] = set()  # ids on the wire that have had an answer, or were lost
    dropped = Dropped()

    def send(operation: Operation) -> None:
        if broken:
            raise NotSent("there is no connection")
        assert isinstance(operation, CallService)
        sent.append(operation)

    calls = Calls(send, clock, SERVICES, TYPES, "json", dropped)
    made = unexpected = 0
    for kind, number in happenings:
        wire_id = sent[number].id if number < len(sent) else number
        if kind == "call":
            calls.call(ServiceCall(id=made, service="/echo", fields={"text": "x"}, timeout_s=1000.0), replies.append)
            made += 1
        elif kind == "break":
            calls.lose("the cable was pulled")
            replied |= {call.id for call in sent}
            broken = True
        elif kind == "mend":
            broken = False
        elif kind == "status":
            calls.take(Status(level="error", msg="no", id=wire_id))
            replied.add(wire_id)
        else:
            values: object = {"reply": {"text": "x"}, "failure": "NoPath: a wall", "nonsense": [[]]}[kind]
            unexpected += wire_id in replied or number >= len(sent)
            calls.take(ServiceResponse(service="/echo", id=wire_id, result=kind != "failure", values=values))  # type: ignore[arg-type]
            replied.add(wire_id)
    calls.lose("this is the end")
    assert not clock.run_until(lambda: False)
    assert Counter(reply.call_id for reply in replies) == Counter(range(made))
    assert dropped.count == unexpected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("NoPath: there is a wall", ("NoPath", "there is a wall")),
        ("NoPath: two\nlines", ("NoPath", "two\nlines")),
        ("no path: there is a wall", ("ServiceError", "no path: there is a wall")),
        ("NoPath:", ("ServiceError", "NoPath:")),
        ("", ("ServiceError", "")),
        ("Service /a/b does not exist", ("NoSuchService", "Service /a/b does not exist")),
    ],
)
def test_texts_of_failures_have_a_class_where_they_name_one(text: str, expected: tuple[str, str]) -> None:
    """As our server writes them, and as rosbridge_suite does."""
    assert coded(text) == expected
