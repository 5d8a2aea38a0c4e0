"""What every transport keeps to, whatever carries its calls."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import pytest

from grounding.inprocess import Handler, InProcessTransport, Service
from grounding.transport import ServiceCall, ServiceReply, Transport
from kb.clock import SimClock
from kb.errors import ServiceFailed


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """A transport under test.

    Attributes:
        offer: Makes a service known at the far end: name, handler, latency in seconds.
    """

    clock: SimClock
    transport: Transport
    offer: Callable[[str, Handler, float], None]


def in_process() -> Setup:
    """Services are functions in this process."""
    clock = SimClock()
    transport = InProcessTransport(clock)
    return Setup(
        clock=clock,
        transport=transport,
        offer=lambda name, handler, latency_s: transport.offer(name, Service(handler=handler, latency_s=latency_s)),
    )


@pytest.fixture(params=[in_process])
def setup(request: pytest.FixtureRequest) -> Setup:
    """Each transport in turn; the tests below hold for all."""
    made: Setup = request.param()
    made.offer("/echo", lambda fields: {"echo": dict(fields)}, 0.25)
    made.offer("/broken", broken, 0.25)
    return made


def broken(fields: Mapping[str, object]) -> Mapping[str, object]:
    """A service that fails."""
    raise ServiceFailed("DeviceBroken", "it smokes")


class Inbox:
    """Takes replies, and notes when they come."""

    def __init__(self, clock: SimClock) -> None:
        self.replies: list[ServiceReply] = []
        self.times_s: list[float] = []
        self._clock = clock

    def __call__(self, reply: ServiceReply) -> None:
        self.replies.append(reply)
        self.times_s.append(self._clock.now_s)


def call(number: int, service: str, /, **fields: object) -> ServiceCall:
    """A call."""
    return ServiceCall(id=number, service=service, fields=fields, timeout_s=1.0)


def let_all_happen(setup: Setup) -> None:
    """Until nothing is left to happen."""
    assert not setup.clock.run_until(lambda: False)


def test_the_reply_comes_later_once_and_on_the_clock(setup: Setup) -> None:
    """Not during the call: the caller has taken note of it before. It holds what the service said."""
    inbox = Inbox(setup.clock)
    setup.transport.call(call(7, "/echo", text="hello", number=3), inbox)
    assert inbox.replies == []
    let_all_happen(setup)
    echoed = {"text": "hello", "number": 3}
    assert inbox.replies == [ServiceReply(call_id=7, fields={"echo": echoed}, failure="", reason="")]


def test_the_latency_is_honored(setup: Setup) -> None:
    """From the call to the reply, whenever the call is made; a failure takes as long as a success."""
    inbox = Inbox(setup.clock)
    setup.clock.call_at(2.0, lambda: setup.transport.call(call(1, "/echo"), inbox))
    setup.clock.call_at(5.0, lambda: setup.transport.call(call(2, "/broken"), inbox))
    let_all_happen(setup)
    assert inbox.times_s == [2.25, 5.25]


def test_no_latency_is_still_later(setup: Setup) -> None:
    """At the time of the call, but not within it."""
    setup.offer("/quick", lambda fields: {}, 0.0)
    inbox = Inbox(setup.clock)
    setup.transport.call(call(1, "/quick"), inbox)
    assert inbox.replies == []
    let_all_happen(setup)
    assert inbox.times_s == [0.0]


def test_a_failure_comes_through_with_its_code(setup: Setup) -> None:
    """As a reply, not as an exception."""
    inbox = Inbox(setup.clock)
    setup.transport.call(call(1, "/broken"), inbox)
    let_all_happen(setup)
    assert inbox.replies == [ServiceReply(call_id=1, fields={}, failure="DeviceBroken", reason="it smokes")]


def test_an_unknown_service_is_a_failure_that_names_the_known(setup: Setup) -> None:
    """It comes like any other reply: later."""
    inbox = Inbox(setup.clock)
    setup.transport.call(call(1, "/eco"), inbox)
    assert inbox.replies == []
    let_all_happen(setup)
    [reply] = inbox.replies
    assert (reply.call_id, reply.fields, reply.failure) == (1, {}, "NoSuchService")
    assert reply.reason == "there is no service /eco; there is /broken, /echo"


def test_replies_of_one_time_keep_the_order_of_their_calls(setup: Setup) -> None:
    """Also where some fail."""
    inbox = Inbox(setup.clock)
    for number in range(10):
        setup.transport.call(call(number, "/broken" if number % 3 == 0 else "/echo"), inbox)
    let_all_happen(setup)
    assert [reply.call_id for reply in inbox.replies] == list(range(10))


def test_a_quicker_service_overtakes_a_slower_one(setup: Setup) -> None:
    """Replies are told apart by the id of the call."""
    setup.offer("/quick", lambda fields: {}, 0.125)
    inbox = Inbox(setup.clock)
    setup.transport.call(call(1, "/echo"), inbox)
    setup.transport.call(call(2, "/quick"), inbox)
    let_all_happen(setup)
    assert [reply.call_id for reply in inbox.replies] == [2, 1]
    assert inbox.times_s == [0.125, 0.25]


def test_the_service_sees_the_world_as_of_the_call(setup: Setup) -> None:
    """A laser reading is of the moment of the request, not of that of the reply."""
    world = {"door": "open"}
    setup.offer("/look", lambda fields: {"door": world["door"]}, 1.0)
    setup.clock.call_at(0.5, lambda: world.update(door="closed"))
    inbox = Inbox(setup.clock)
    setup.transport.call(call(1, "/look"), inbox)
    let_all_happen(setup)
    assert inbox.replies[0].fields == {"door": "open"}
    setup.transport.call(call(2, "/look"), inbox)
    let_all_happen(setup)
    assert inbox.replies[1].fields == {"door": "closed"}


def test_calls_may_be_made_while_a_reply_is_taken(setup: Setup) -> None:
    """A chain of calls, each made from the reply to the one before."""
    times_s: list[float] = []

    def again(reply: ServiceReply) -> None:
        times_s.append(setup.clock.now_s)
        if reply.call_id < 4:
            setup.transport.call(call(reply.call_id + 1, "/echo"), again)

    setup.transport.call(call(1, "/echo"), again)
    let_all_happen(setup)
    assert times_s == [0.25, 0.5, 0.75, 1.0]
