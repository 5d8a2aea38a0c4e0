"""The transport to what speaks rosbridge v2: robots behind rosbridge_server, or the simulated fleet.

    clock = WallClock()
    types = Types()
    services = service_types(snapshot.groundings.values(), robots, types)
    with RosbridgeTransport(Endpoint(uri="ws://amigo-1:9090"), clock, services=services, types=types, rng=rng) as robot:
        robot.wait_connected(5.0)
        robot.call(call, deliver)
        clock.run_until(lambda: bool(replies))

Everything happens on the thread that runs the clock, but for the socket. The connection comes again by itself; what
was under way when it broke is answered `Lost`, subscriptions and advertised topics are said again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import TracebackType

import numpy as np

from grounding.actions import Goal
from grounding.inprocess import Handler
from grounding.rosbridge import operations as op
from grounding.rosbridge.calls import Calls, Deliver
from grounding.rosbridge.connection import Endpoint
from grounding.rosbridge.dropped import Dropped
from grounding.rosbridge.goals import Done, Feedback, Goals
from grounding.rosbridge.link import Link, Traffic
from grounding.rosbridge.offers import Offers
from grounding.rosbridge.topics import Subscription, Take, Topics
from grounding.rosbridge.types import ActionType, ServiceType, Types
from grounding.rosbridge.values import Numbers
from grounding.topics import Heard
from grounding.transport import ServiceCall
from kb.clock import Callback, WallClock
from kb.groundings import Grounding

_SERVICES = "/rosapi/services"
_ASKING_S = 5.0


def service_types(groundings: Iterable[Grounding], robots: Iterable[str], types: Types) -> dict[str, ServiceType]:
    """The types of the services that groundings call, by full name: made of their fields, and added to `types`.

    Args:
        robots: Stand for `{robot}` in the names of services.
    """
    found: dict[str, ServiceType] = {}
    names = sorted(robots)
    for grounding in sorted((g for g in groundings if not (g.action_type or g.is_topic)), key=lambda g: g.process):
        made = types.add_service_of(
            grounding.process,
            {field.name: field.message_type for field in grounding.request},
            {field.name: field.message_type for field in grounding.reply},
        )
        for robot in names if grounding.on_robot else ("",):
            found[grounding.service.replace("{robot}", robot)] = made
    return found


def action_types(groundings: Iterable[Grounding], robots: Iterable[str], types: Types) -> dict[str, ActionType]:
    """The types of the actions that groundings send goals to, by full name.

    Args:
        robots: Stand for `{robot}` in the names of actions.

    Raises:
        UnknownType: There is no such type of actions.
    """
    return {
        grounding.service.replace("{robot}", robot): types.action(grounding.action_type)
        for grounding in groundings
        if grounding.action_type
        for robot in robots
    }


class RosbridgeTransport:
    """Calls, goals and topics over one connection to a rosbridge server.

    Args:
        services: The types of the services, by full name; see `service_types`.
        actions: The types of the actions, by full name.
        types: Those that the names above are of.
        binary: Calls and goals go as CBOR, so that infinity stays infinity and images stay bytes. For our own server;
            others take text, in which NaN and infinity are the same, null. What topics bring is CBOR either way.
        rng: For the jitter of the delays between tries to connect.

    Attributes:
        dropped: What came and was thrown away: frames that cannot be read, late and second replies, replies to
            nothing, messages of another type.
        last_status: What the far end told last that is about no call.

    Raises:
        BadEndpoint: The endpoint's address is none, or its certificates cannot be read.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        clock: WallClock,
        *,
        services: Mapping[str, ServiceType],
        actions: Mapping[str, ActionType] | None = None,
        types: Types,
        binary: bool = False,
        rng: np.random.Generator,
    ) -> None:
        self._clock = clock
        self._actions = frozenset(actions or {})
        self.dropped = Dropped()
        self._link = Link(
            endpoint,
            clock,
            rng,
            binary=binary,
            began=self._began,
            ended=self._ended,
            take=self._take,
            dropped=self.dropped,
        )
        numbers: Numbers = "exact" if binary else "json"
        send = self._link.send
        rosapi = {_SERVICES: types.service("rosapi_msgs/Services")}
        self._calls = Calls(send, clock, {**services, **rosapi}, types, numbers, self.dropped)
        self._goals = Goals(send, clock, actions or {}, types, numbers, self.dropped)
        self._topics = Topics(send, clock, types, numbers, self.dropped)
        self._offers = Offers(send, clock, types, numbers)
        self._asked = 0
        self.last_status: op.Status | None = None

    def __enter__(self) -> RosbridgeTransport:
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def open(self) -> None:
        """Begin to connect."""
        self._link.open()

    def close(self) -> None:
        """End the connection for good; what is under way is answered as lost."""
        self._link.close()

    @property
    def connected(self) -> bool:
        """Whether calls reach the far end, as far as is known."""
        return self._link.connected

    @property
    def problem(self) -> str:
        """Why there is, or was last, no connection."""
        return self._link.problem

    @property
    def traffic(self) -> Traffic:
        """What has gone over the connection until now."""
        return self._link.traffic

    def wait_connected(self, timeout_s: float) -> bool:
        """Run the clock until there is a connection; False if there is none in time."""
        over = False

        def end() -> None:
            nonlocal over
            over = True

        withdraw = self._clock.call_at(self._clock.now_s + timeout_s, end)
        self._clock.run_until(lambda: over or self.connected)
        withdraw()
        return self.connected

    def call(self, call: ServiceCall, deliver: Deliver) -> None:
        self._calls.call(call, deliver)

    def send_goal(self, goal: Goal, feedback: Feedback, done: Done) -> None:
        self._goals.send_goal(goal, feedback, done)

    def cancel_goal(self, goal_id: int) -> None:
        self._goals.cancel_goal(goal_id)

    def hear_topic(self, topic: str, message_type: str, heard: Heard) -> Callback:
        subscription = self.subscribe(topic, message_type, lambda message: heard(message, ""))
        subscription.refused = lambda problem: heard(None, problem)
        return lambda: self.unsubscribe(topic)

    def subscribe(
        self, topic: str, message_type: str, take: Take | None = None, *, throttle_s: float = 0.0
    ) -> Subscription:
        """Hear a topic, in every session; a new subscription takes the place of an old one.

        Args:
            take: Given each message. Of those that come while the clock does not run only the newest is.
            throttle_s: At least so much time between two messages.

        Raises:
            UnknownType: There is no such type.
        """
        return self._topics.subscribe(topic, message_type, take, throttle_s)

    def unsubscribe(self, topic: str) -> None:
        """Hear a topic no more."""
        self._topics.unsubscribe(topic)

    def advertise(self, topic: str, message_type: str, *, latch: bool = False) -> None:
        """Speak on a topic from now on, in every session.

        Args:
            latch: Who subscribes later is given the last message.

        Raises:
            UnknownType: There is no such type.
        """
        self._topics.advertise(topic, message_type, latch)

    def unadvertise(self, topic: str) -> None:
        """Speak on a topic no more."""
        self._topics.unadvertise(topic)

    def publish(self, topic: str, message: object) -> bool:
        """Send a message on an advertised topic.

        Returns:
            Whether there is a connection that takes it: what is said without one is not kept for later.

        Raises:
            BadValue: The message does not hold what its type says.
        """
        return self._topics.publish(topic, message)

    def offer(self, name: str, service_type: ServiceType, handler: Handler) -> None:
        """Offer a service to the far end, in every session; a new one takes the place of an old one.

        Args:
            handler: Runs on the clock's thread; takes the request's fields, gives the reply's, or raises ServiceFailed.
        """
        self._offers.offer(name, service_type, handler)

    def withdraw(self, name: str) -> None:
        """Offer a service no more."""
        self._offers.withdraw(name)

    def reconcile(self, calls: Iterable[ServiceCall], told: Callable[[Mapping[int, bool | None]], None]) -> None:
        asked = tuple(calls)

        def answered(offered: Sequence[str] | None) -> None:
            unknown = None if self.connected else False
            told(
                {
                    call.id: unknown if offered is None or call.service in self._actions else call.service in offered
                    for call in asked
                }
            )

        self.services(answered)

    def services(self, told: Callable[[Sequence[str] | None], None]) -> None:
        """Ask what services there are at the far end.

        Args:
            told: Their full names; None where that could not be learned in some seconds.
        """
        over = False

        def answered(offered: object) -> None:
            nonlocal over
            if not over:
                over = True
                withdraw()
                told(offered if isinstance(offered, list) else None)

        withdraw = self._clock.call_at(self._clock.now_s + _ASKING_S, lambda: answered(None))
        self._asked += 1
        call = ServiceCall(id=-self._asked, service=_SERVICES, fields={}, timeout_s=_ASKING_S)
        self.call(call, lambda reply: answered(reply.fields.get("services")))

    def _began(self) -> None:
        self._topics.resume()
        self._offers.resume()

    def _ended(self, reason: str) -> None:
        self._calls.lose(reason)
        self._goals.lose(reason)

    def _take(self, operation: op.Operation) -> None:
        match operation:
            case op.Publish():
                self._topics.take(operation)
            case op.ServiceResponse():
                self._calls.take(operation)
            case op.ActionFeedback():
                self._goals.take_feedback(operation)
            case op.ActionResult():
                self._goals.take_result(operation)
            case op.Status():
                self.last_status = operation
                if operation.level == "error":
                    self._calls.take(operation)
            case op.CallService():
                problem = self._offers.take(operation)
                if problem:
                    self.dropped.note(problem)
            case _:
                self.dropped.note(f"{operation.OP}, which is not for a client")
