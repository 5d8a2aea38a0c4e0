"""A node of ROS 2 on a thread of its own. What it takes and gives are the bytes that ROS 2 itself sends (CDR).

Only for the process that has ROS 2 (see bridge.py). Methods may be called from any thread and do not wait; what they
lead to is told on the thread of who made the node. One who listens too slowly loses the oldest messages.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from grounding.ros2.installed import ros
from grounding.ros2.requests import Calls, Goals

_TICK_S = 0.05
_TICKS_OF_GRAPH = 4
_DEPTH = 5
"""Messages of a topic that may wait, as ROS 2 has it for sensors."""

_MOST_WAITING_BYTES = 64_000_000
"""Of messages that go out."""

Callback = Callable[[], None]
Tell = Callable[[Callback], None]
Take = Callable[[bytes], None]


@dataclass(frozen=True, slots=True)
class Graph:
    """What other nodes offer, speak and listen on: types (`std_srvs/srv/Trigger`) by name."""

    services: Mapping[str, str] = field(default_factory=dict)
    actions: Mapping[str, str] = field(default_factory=dict)
    topics: Mapping[str, str] = field(default_factory=dict)


@dataclass(slots=True)
class _Heard:
    """A topic that is listened to; `waiting` are its messages that have not been told."""

    kind: Any
    take: Take
    qos: tuple[bool, bool]
    subscription: Any
    waiting: deque[bytes]


class Node:
    """Runs from `start` until `close`.

    Args:
        name: Of the node.
        tell: Runs a callback on the thread of who made the node.

    Attributes:
        calls: Of services.
        goals: Of actions.
    """

    def __init__(self, name: str, tell: Tell) -> None:
        self._rclpy, self._profiles = ros("rclpy"), ros("rclpy.qos")
        self._errors = ros("rclpy.impl.implementation_singleton").rclpy_implementation
        self._rclpy.init(signal_handler_options=ros("rclpy.signals").SignalHandlerOptions.NO)
        self._node = self._rclpy.create_node(
            name,
            start_parameter_services=False,
            enable_rosout=False,
            parameter_overrides=[ros("rclpy.parameter").Parameter("start_type_description_service", value=False)],
        )
        self._tell, self._name = tell, name
        self._work: deque[Callback] = deque()
        self._outgoing: deque[tuple[str, bytes]] = deque()
        self._outgoing_bytes = 0
        self._lock = threading.Lock()
        self._wake = self._node.create_guard_condition(self._do_work)
        self._node.create_timer(_TICK_S, self._tick)
        self.calls = Calls(self._node, self.do, tell)
        self.goals = Goals(self._node, self.do, tell)
        self._graph = Graph()
        self._ticks = 0
        self._publishers: dict[str, Any] = {}
        self._heard: dict[str, _Heard] = {}
        self._over = False
        self._follow: Callable[[Graph], None] = lambda graph: None
        self._thread = threading.Thread(target=self._run, name="ROS 2")

    def start(self, follow: Callable[[Graph], None]) -> None:
        """Begin.

        Args:
            follow: Told what there is, whenever that has changed.
        """
        self._follow = follow
        self._thread.start()

    def do(self, work: Callback) -> None:
        """Do something on the node's thread, after all that was asked for before."""
        self._work.append(work)
        with suppress(self._errors.InvalidHandle):  # the thread has ended
            self._wake.trigger()

    def close(self) -> None:
        """Do what has been asked for, and leave the graph."""
        self.do(self._end)
        self._thread.join()

    def can_name(self, topic: str) -> bool:
        """Whether ROS 2 allows the name of a topic."""
        try:
            ros("rclpy.validate_full_topic_name").validate_full_topic_name(topic)
        except ros("rclpy.exceptions").InvalidTopicNameException:
            return False
        return True

    def subscribe(self, topic: str, kind: Any, take: Take) -> None:
        """Listen to a topic, with the quality of service that its publishers have."""
        self.do(lambda: self._subscribe(topic, kind, take))

    def unsubscribe(self, topic: str) -> None:
        """Listen no more."""
        self.do(lambda: self._node.destroy_subscription(self._heard.pop(topic).subscription))

    def advertise(self, topic: str, kind: Any, *, latch: bool) -> None:
        """Speak on a topic; with `latch`, who comes later gets the last message."""
        qos = self._profile(reliable=True, kept=latch, depth=1 if latch else _DEPTH)

        def make() -> None:
            self._publishers[topic] = self._node.create_publisher(kind, topic, qos)

        self.do(make)

    def unadvertise(self, topic: str) -> None:
        """Speak no more."""
        self.do(lambda: self._node.destroy_publisher(self._publishers.pop(topic)))

    def publish(self, topic: str, message: bytes) -> None:
        """Say something on an advertised topic."""
        with self._lock:
            self._outgoing.append((topic, message))
            self._outgoing_bytes += len(message)
            while self._outgoing_bytes > _MOST_WAITING_BYTES:
                self._outgoing_bytes -= len(self._outgoing.popleft()[1])
        self.do(self._publish_next)

    def _run(self) -> None:
        executor = ros("rclpy.executors").SingleThreadedExecutor()
        executor.add_node(self._node)
        try:
            while not self._over:
                executor.spin_once()
        except Exception as error:  # noqa: BLE001 - it ends who made the node
            self._tell(_raising(error))
        finally:
            executor.shutdown()
            self._node.destroy_node()
            self._rclpy.try_shutdown()

    def _end(self) -> None:
        self._over = True

    def _do_work(self) -> None:
        while self._work:
            self._work.popleft()()

    def _tick(self) -> None:
        self.calls.retry()
        self.goals.retry()
        self._ticks += 1
        if self._ticks % _TICKS_OF_GRAPH == 0:
            self._look()

    def _look(self) -> None:
        graph = Graph(*self._offered(), dict(self._spoken()))
        for topic, heard in self._heard.items():
            if self._qos(topic) != heard.qos:
                self._node.destroy_subscription(heard.subscription)
                self._listen(topic, heard)
        if graph != self._graph:
            self.calls.forget(self._graph.services.keys() - graph.services.keys())
            self.goals.forget(self._graph.actions.keys() - graph.actions.keys())
            self._graph = graph
            self._tell(lambda: self._follow(graph))

    def _offered(self) -> tuple[dict[str, str], dict[str, str]]:
        """The services and the actions. ROS 2 lists also services that somebody only calls, so it is asked again."""
        services, actions = {}, {}
        for name, kinds in self._node.get_service_names_and_types():
            action, hidden, part = name.partition("/_action/")
            if not self._node.count_services(name):
                continue
            if not hidden:
                services[name] = kinds[0]
            elif part == "send_goal":
                actions[action] = kinds[0].removesuffix("_SendGoal")
        return services, actions

    def _spoken(self) -> Iterator[tuple[str, str]]:
        """The topics of others, and their types."""
        for name, kinds in self._node.get_topic_names_and_types():
            if "/_" in name:
                continue
            ends = self._node.get_publishers_info_by_topic(name) + self._node.get_subscriptions_info_by_topic(name)
            if any(end.node_name != self._name for end in ends):
                yield name, kinds[0]

    def _subscribe(self, topic: str, kind: Any, take: Take) -> None:
        heard = _Heard(kind, take, (False, False), None, deque(maxlen=_DEPTH))
        self._heard[topic] = heard
        self._listen(topic, heard)

    def _listen(self, topic: str, heard: _Heard) -> None:
        heard.qos = self._qos(topic)
        reliable, kept = heard.qos
        qos = self._profile(reliable=reliable, kept=kept, depth=_DEPTH)

        def came(message: bytes) -> None:
            heard.waiting.append(message)
            if len(heard.waiting) == 1:  # else it is told already, and takes this one along
                self._tell(lambda: _drain(heard))

        heard.subscription = self._node.create_subscription(heard.kind, topic, came, qos, raw=True)

    def _qos(self, topic: str) -> tuple[bool, bool]:
        """The best that all who speak on a topic offer: whether it is reliable, and whether the last words are kept.

        Who asks for more than one of them offers does not hear it.
        """
        ends = self._node.get_publishers_info_by_topic(topic)
        offered = [end.qos_profile for end in ends if end.node_name != self._name]
        reliable = self._profiles.ReliabilityPolicy.RELIABLE
        kept = self._profiles.DurabilityPolicy.TRANSIENT_LOCAL
        return (
            bool(offered) and all(qos.reliability == reliable for qos in offered),
            bool(offered) and all(qos.durability == kept for qos in offered),
        )

    def _profile(self, *, reliable: bool, kept: bool, depth: int) -> Any:
        reliability, durability = self._profiles.ReliabilityPolicy, self._profiles.DurabilityPolicy
        return self._profiles.QoSProfile(
            depth=depth,
            reliability=reliability.RELIABLE if reliable else reliability.BEST_EFFORT,
            durability=durability.TRANSIENT_LOCAL if kept else durability.VOLATILE,
        )

    def _publish_next(self) -> None:
        with self._lock:
            if not self._outgoing:
                return  # dropped
            topic, message = self._outgoing.popleft()
            self._outgoing_bytes -= len(message)
        if topic in self._publishers:
            with suppress(self._errors.RCLError):  # those who listen are too slow for it: it is lost, as on any topic
                self._publishers[topic].publish(message)


def _drain(heard: _Heard) -> None:
    while heard.waiting:
        heard.take(heard.waiting.popleft())


def _raising(error: Exception) -> Callback:
    def fail() -> None:
        raise error

    return fail
