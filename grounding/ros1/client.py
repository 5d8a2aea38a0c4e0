"""The transport over ROS 1: this process becomes a node, which calls services, hears topics and sends goals.

    clock = WallClock()
    types = Types()
    services = service_types(snapshot.groundings.values(), robots, types)
    with Ros1Transport(Master(uri="http://amigo-1:11311"), clock, services=services, types=types) as robots:
        robots.wait_connected(5.0)
        robots.call(call, deliver)
        clock.run_until(lambda: bool(replies))

Everything happens on the thread that runs the clock, but for rospy, which has many. A process has one node, so all
transports in it are for one master; what is registered there is said again to a master that comes anew.

A service that ends, or its computer, answers what is under way with `Lost`; so does a master that is away, but only
where a service has to be looked up: connections that exist go on without it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import TracebackType

from grounding.actions import Goal
from grounding.inprocess import Handler
from grounding.ros1.calls import Calls
from grounding.ros1.goals import Goals
from grounding.ros1.node import Master, MasterRefuses, Node
from grounding.ros1.services import Services
from grounding.ros1.topics import Topics
from grounding.ros1.wire import Wire
from grounding.rosbridge.calls import Deliver
from grounding.rosbridge.dropped import Dropped
from grounding.rosbridge.goals import Done, Feedback
from grounding.rosbridge.topics import Subscription, Take
from grounding.rosbridge.types import ActionType, ServiceType, Types
from grounding.topics import Heard
from grounding.transport import ServiceCall
from kb.clock import Callback, WallClock


class Ros1Transport:
    """Calls, goals, topics and offered services of one node.

    Args:
        services: The types of the services, by full name; see `grounding.rosbridge.client.service_types`.
        actions: The types of the actions, by full name.
        types: Those that the names above are of, of ROS 2: a type that ROS 1 has otherwise fails when it is used.

    Attributes:
        dropped: What came and was thrown away, and what could not be registered.

    Raises:
        BadMaster: The master's address is none, or this process has a node with another master.
        DependencyMissing: ROS 1 is not installed.
    """

    def __init__(
        self,
        master: Master,
        clock: WallClock,
        *,
        services: Mapping[str, ServiceType],
        actions: Mapping[str, ActionType] | None = None,
        types: Types,
    ) -> None:
        self._clock = clock
        self._actions = frozenset(actions or {})
        self.dropped = Dropped()
        self._node = Node(master, complain=self.dropped.note, changed=lambda: clock.post(lambda: None))
        wire = Wire(types)
        self._calls = Calls(self._node, clock, services, wire, self.dropped)
        self._topics = Topics(self._node, clock, types, wire, self.dropped)
        self._goals = Goals(self._node, self._topics, clock, actions or {}, types, wire, self.dropped)
        self._services = Services(self._node, wire, clock.post, clock)
        self._stop_listening: dict[str, Callback] = {}

    def __enter__(self) -> Ros1Transport:
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def open(self) -> None:
        """Begin to look for the master."""
        self._node.open()

    def close(self) -> None:
        """End all connections and registrations; the node itself stays.

        What is under way is answered as lost when the clock runs again.
        """
        reason = "the transport is closed"
        self._calls.close(reason)
        self._clock.post(lambda: self._goals.lose(reason))
        self._services.close()
        self._node.close()

    @property
    def connected(self) -> bool:
        """Whether the master answers, as far as is known; connections that exist do not depend on it."""
        return self._node.connected

    @property
    def problem(self) -> str:
        """Why the master does not answer; empty if it does."""
        return self._node.problem

    def wait_connected(self, timeout_s: float) -> bool:
        """Run the clock until the master answers; False if it does not in time."""
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
        """Hear a topic; a new subscription takes the place of an old one.

        Args:
            take: Given each message. Of those that come while the clock does not run only the newest is.
            throttle_s: At least so much time between two messages; those between are received but not read.

        Raises:
            UnknownType: There is no such type, or ROS 1 has it otherwise.
        """
        return self._topics.subscribe(topic, message_type, take, throttle_s)

    def unsubscribe(self, topic: str) -> None:
        """Hear a topic no more."""
        self._topics.unsubscribe(topic)

    def advertise(self, topic: str, message_type: str, *, latch: bool = False) -> None:
        """Speak on a topic from now on.

        Args:
            latch: Who subscribes later is given the last message.

        Raises:
            UnknownType: There is no such type, or ROS 1 has it otherwise.
        """
        self._topics.advertise(topic, message_type, latch)

    def unadvertise(self, topic: str) -> None:
        """Speak on a topic no more."""
        self._topics.unadvertise(topic)

    def publish(self, topic: str, message: object) -> bool:
        """Send a message on an advertised topic.

        Returns:
            Whether the topic is known to a master: what is said before is not kept for later.

        Raises:
            BadValue: The message does not hold what its type says.
        """
        return self._topics.publish(topic, message)

    def offer(self, name: str, service_type: ServiceType, handler: Handler) -> None:
        """Offer a service; a new one takes the place of an old one.

        Args:
            handler: Runs on the clock's thread; takes the request's fields, gives the reply's, or raises ServiceFailed.

        Raises:
            UnknownType: ROS 1 cannot have a service of this type.
        """
        self._services.offer(name, service_type, handler)
        self._stop_listening.setdefault(name, self._clock.listen())

    def withdraw(self, name: str) -> None:
        """Offer a service no more."""
        self._services.withdraw(name)
        if name in self._stop_listening:
            self._stop_listening.pop(name)()

    def reconcile(self, calls: Iterable[ServiceCall], told: Callable[[Mapping[int, bool | None]], None]) -> None:
        asked = tuple(calls)

        def answered(offered: Sequence[str] | None) -> None:
            told({call.id: self._is_there(call.service, offered) for call in asked})

        self.services(answered)

    def _is_there(self, name: str, offered: Sequence[str] | None) -> bool | None:
        if offered is None:
            return False
        return None if name in self._actions else name in offered

    def services(self, told: Callable[[Sequence[str] | None], None]) -> None:
        """Ask the master what services there are.

        Args:
            told: Their full names; None where that could not be learned.
        """
        stop_listening = self._clock.listen()

        def ask() -> None:
            try:
                offered: Sequence[str] | None = sorted(self._node.offered())
            except (OSError, MasterRefuses):
                offered = None
            self._clock.post(lambda: answer(offered))

        def answer(offered: Sequence[str] | None) -> None:
            stop_listening()
            told(offered)

        threading.Thread(target=ask, name="ros1 services", daemon=True).start()
