"""The topics of a rosbridge server: who publishes, who listens, and how often and in what form."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from grounding.rosbridge.framing import frames, raw_message
from grounding.rosbridge.operations import Advertise, Publish, Subscribe, Unadvertise, Unsubscribe
from grounding.rosbridge.outbox import Packet
from grounding.rosbridge.policy import resolved
from grounding.rosbridge.session import Refused, Session, numbers_in
from grounding.rosbridge.types import Types
from grounding.rosbridge.values import from_tree, to_bytes, to_tree
from kb.clock import Callback, Clock

Listener = Callable[[object], None]

_COMPRESSIONS = ("none", "png", "cbor", "cbor-raw")
_MOST_LATCHED_BYTES = 256_000_000


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """A topic as rosapi tells of it; publishers and subscribers by their node names.

    Attributes:
        latched: Whether a client keeps its messages for who comes later.
    """

    name: str
    type: str
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]
    latched: bool = False


class _Message:
    """A message on its way: encoded once for all who want it in the same form."""

    def __init__(self, topic: str, value: object, types: Types, now_s: float, number: int) -> None:
        self.topic, self.value = topic, value
        self._types, self._now_s, self._number = types, now_s, number
        self._frames: dict[tuple[str, str, int | None], tuple[str | bytes, ...]] = {}

    def frames(self, topic: str, compression: str, fragment_size: int | None) -> tuple[str | bytes, ...]:
        key = (topic, compression, fragment_size)
        if key not in self._frames:
            operation = Publish(topic=topic, msg=self._tree(compression))
            parts = frames(
                operation, compression=compression, fragment_size=fragment_size, fragment_id=f"message:{self._number}"
            )
            self._frames[key] = tuple(parts)
        return self._frames[key]

    def _tree(self, compression: str) -> Mapping[str, object]:
        if compression == "cbor-raw":
            return raw_message(to_bytes(self.value, types=self._types), self._now_s)
        return to_tree(self.value, numbers=numbers_in(compression), types=self._types)


class _Subscriber:
    """A client that listens to a topic, by one subscription or several, which bring each message once.

    Of several the lowest throttle rate and fragment size count, the highest queue length, the last of the compressions
    in their order. A message that comes before `throttle_rate` has passed waits if there is a queue, else it is lost.
    """

    def __init__(self, session: Session, clock: Clock) -> None:
        self.session = session
        self.wishes: dict[str | int | None, Subscribe] = {}
        self._clock = clock
        self._next_s = clock.now_s
        self._waiting: deque[Packet] = deque()
        self._withdraw: Callback | None = None

    def offer(self, message: _Message) -> None:
        throttle_s = min(wish.throttle_rate for wish in self.wishes.values()) / 1000.0
        if not throttle_s or (self._withdraw is None and self._clock.now_s >= self._next_s):
            self._send(self._packet(message), throttle_s)
            return
        queue_length = max(wish.queue_length for wish in self.wishes.values())
        if not queue_length:
            return
        packet, session = self._packet(message), self.session
        room = session.most_throttled_bytes - packet.size
        while self._waiting and (len(self._waiting) >= queue_length or session.throttled_bytes > room):
            self._take_first()
        if session.throttled_bytes <= room:  # else other topics of this client take it all
            session.throttled_bytes += packet.size
            self._waiting.append(packet)
        self._wait()

    def stop(self) -> None:
        """Nothing more is sent."""
        while self._waiting:
            self._take_first()
        if self._withdraw is not None:
            self._withdraw()

    def _take_first(self) -> Packet:
        packet = self._waiting.popleft()
        self.session.throttled_bytes -= packet.size
        return packet

    def _wait(self) -> None:
        if self._withdraw is None and self._waiting:
            self._withdraw = self._clock.call_at(max(self._next_s, self._clock.now_s), self._due)

    def _due(self) -> None:
        self._withdraw = None
        throttle_s = min(wish.throttle_rate for wish in self.wishes.values()) / 1000.0
        self._send(self._take_first(), throttle_s)
        self._wait()

    def _send(self, packet: Packet, throttle_s: float) -> None:
        self._next_s = self._clock.now_s + throttle_s
        self.session.deliver(packet)

    def _packet(self, message: _Message) -> Packet:
        wishes = self.wishes.values()
        compression = max((wish.compression for wish in wishes), key=_COMPRESSIONS.index)
        fragment_size = min((w.fragment_size for w in wishes if w.fragment_size is not None), default=None)
        asked_as = next(iter(wishes)).topic
        parts = message.frames(asked_as, compression, fragment_size)
        queue_length = max(wish.queue_length for wish in wishes)
        return Packet(frames=parts, topic=message.topic, queue_length=queue_length)


@dataclass(slots=True)
class _Topic:
    """A topic exists while somebody publishes or listens.

    Attributes:
        publishers: By client whether its messages are kept for who comes later.
        local: Whether this process publishes; None, else whether its messages are kept.
        begun: Called when somebody begins to listen.
        latched: The message that who comes later gets.
    """

    name: str
    type: str
    publishers: dict[Session, bool] = field(default_factory=dict)
    subscribers: dict[Session, _Subscriber] = field(default_factory=dict)
    listeners: list[Listener] = field(default_factory=list)
    local: bool | None = None
    latched: _Message | None = None
    latched_bytes: int = 0
    begun: Callback = lambda: None

    @property
    def idle(self) -> bool:
        return not (self.publishers or self.subscribers or self.listeners or self.local is not None)


class Topics:
    """All topics of a server. Methods raise Refused, BadValue or UnknownType where a client asks for what cannot be.

    Args:
        node: Name of this process among the publishers and subscribers.

    Attributes:
        changed: Called when a client has begun or ended to publish or to listen.
    """

    def __init__(self, types: Types, clock: Clock, node: str) -> None:
        self._types, self._clock, self._node = types, clock, node
        self.changed: Callable[[], None] = lambda: None
        self._topics: dict[str, _Topic] = {}
        self._count = 0

    def offer(self, name: str, message_type: str, *, latch: bool = False, begun: Callback = lambda: None) -> None:
        """Say that this process publishes on a topic.

        Args:
            begun: Called whenever somebody begins to listen to it.

        Raises:
            Refused: The topic has another type.
            UnknownType: There is no such type.
        """
        topic = self._topic(name, message_type)
        topic.local, topic.begun = latch, begun
        if self.is_heard(name):
            begun()

    def withdraw(self, name: str) -> None:
        """Say that this process publishes no more on a topic that was offered."""
        topic = self._topics[resolved(name)]
        topic.local, topic.begun = None, lambda: None
        self._forget_if_idle(topic)

    def say(self, name: str, message: object) -> None:
        """Publish a ROS message from this process, on a topic that was offered."""
        topic = self._topics[resolved(name)]
        self._spread(topic, message, bool(topic.local))

    def listen(self, name: str, message_type: str, listener: Listener) -> Callback:
        """Call `listener` with every message that a client publishes on a topic.

        Returns:
            What ends it.
        """
        topic = self._topic(name, message_type)
        topic.listeners.append(listener)
        topic.begun()

        def end() -> None:
            topic.listeners.remove(listener)
            self._forget_if_idle(topic)

        return end

    def is_heard(self, name: str) -> bool:
        """Whether anybody listens to a topic."""
        topic = self._topics.get(resolved(name))
        return topic is not None and bool(topic.subscribers or topic.listeners)

    def told(self) -> list[TopicInfo]:
        """All topics, by name."""
        own = (self._node,)
        return [
            TopicInfo(
                topic.name,
                topic.type,
                own * (topic.local is not None) + tuple(s.name for s in topic.publishers),
                own * bool(topic.listeners) + tuple(s.name for s in topic.subscribers),
                any(topic.publishers.values()),
            )
            for _, topic in sorted(self._topics.items())
        ]

    def advertise(self, session: Session, operation: Advertise) -> None:
        message_type = self._types.message(operation.type)
        session.hold("publisher", resolved(operation.topic))
        self._topic(operation.topic, message_type).publishers[session] = operation.latch
        self.changed()

    def unadvertise(self, session: Session, operation: Unadvertise) -> None:
        topic = self._topics.get(resolved(operation.topic))
        if topic is None or session not in topic.publishers:
            session.tell("warning", f"topic {operation.topic} is not advertised by this client", operation.id)
            return
        self._remove_publisher(topic, session)

    def publish(self, session: Session, operation: Publish, size: int) -> None:
        """Spread a message; `size` of its frame tells how much memory it takes if it is kept."""
        topic = self._topics.get(resolved(operation.topic))
        if topic is None:
            raise Refused("NoSuchTopic", f"there is no topic {operation.topic}; advertise it first")
        message = from_tree(topic.type, operation.msg, now_s=self._clock.now_s, types=self._types)
        latch = operation.latch or topic.publishers.get(session, False)
        if latch:
            others = sum(other.latched_bytes for other in self._topics.values() if other is not topic)
            if others + size > _MOST_LATCHED_BYTES:
                raise Refused("TooMuch", f"kept messages hold {others} bytes, {_MOST_LATCHED_BYTES} are allowed")
            topic.latched_bytes = size
        self._spread(topic, message, latch)

    def subscribe(self, session: Session, operation: Subscribe) -> None:
        if operation.type is None and resolved(operation.topic) not in self._topics:
            raise Refused("NoSuchTopic", f"there is no topic {operation.topic}; a subscription with a type makes it")
        session.hold("subscription", resolved(operation.topic), operation.id)
        topic = self._topic(operation.topic, operation.type and self._types.message(operation.type))
        is_new = session not in topic.subscribers
        subscriber = topic.subscribers.setdefault(session, _Subscriber(session, self._clock))
        subscriber.wishes[operation.id] = operation
        if is_new and topic.latched is not None:
            subscriber.offer(topic.latched)
        if is_new:
            topic.begun()
        self.changed()

    def unsubscribe(self, session: Session, operation: Unsubscribe) -> None:
        topic = self._topics.get(resolved(operation.topic))
        subscriber = topic.subscribers.get(session) if topic else None
        if topic is None or subscriber is None or (operation.id is not None and operation.id not in subscriber.wishes):
            named = f" with id {operation.id}" if operation.id is not None else ""
            session.tell("warning", f"there is no subscription to {operation.topic}{named}", operation.id)
            return
        ended = list(subscriber.wishes) if operation.id is None else [operation.id]
        for wish in ended:
            del subscriber.wishes[wish]
            session.release("subscription", resolved(operation.topic), wish)
        if not subscriber.wishes:
            self._remove_subscriber(topic, session)

    def leave(self, session: Session) -> None:
        """The client is gone."""
        for topic in list(self._topics.values()):
            if session in topic.subscribers:
                self._remove_subscriber(topic, session)
            if session in topic.publishers:
                self._remove_publisher(topic, session)

    def _topic(self, name: str, message_type: str | None) -> _Topic:
        """The topic, made if there is none."""
        name = resolved(name)
        topic = self._topics.get(name)
        if message_type is None:
            assert topic is not None
            return topic
        message_type = self._types.message(message_type)
        if topic is None:
            topic = self._topics[name] = _Topic(name, message_type)
        elif topic.type != message_type:
            raise Refused("BadRequest", f"topic {name} has type {topic.type}, not {message_type}")
        return topic

    def _spread(self, topic: _Topic, value: object, latch: bool) -> None:
        self._count += 1
        message = _Message(topic.name, value, self._types, self._clock.now_s, self._count)
        if latch:
            topic.latched = message
        for listener in tuple(topic.listeners):
            listener(value)
        for subscriber in tuple(topic.subscribers.values()):
            subscriber.offer(message)

    def _remove_publisher(self, topic: _Topic, session: Session) -> None:
        del topic.publishers[session]
        session.release("publisher", topic.name)
        if not topic.publishers and topic.local is None:
            topic.latched, topic.latched_bytes = None, 0
        self._forget_if_idle(topic)
        self.changed()

    def _remove_subscriber(self, topic: _Topic, session: Session) -> None:
        topic.subscribers.pop(session).stop()
        self._forget_if_idle(topic)
        self.changed()

    def _forget_if_idle(self, topic: _Topic) -> None:
        if topic.idle and self._topics.get(topic.name) is topic:
            del self._topics[topic.name]
