"""The transport within one process: services and actions are functions, replies come when the clock says so.

What is said on topics is heard by who has asked for it, and by nobody else.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from grounding.actions import Goal, GoalResult, GoalStatus, Start, result_of
from grounding.topics import Heard
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import Callback, Clock
from kb.errors import ServiceFailed

Handler = Callable[[Mapping[str, object]], Mapping[str, object]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Service:
    """A function that answers requests.

    Attributes:
        handler: Takes the request's fields, gives the reply's; raises ServiceFailed if it can't.
        latency_s: From the call to the reply.
    """

    handler: Handler
    latency_s: float


class InProcessTopics:
    """The topics of one process: who says something on them, and who listens."""

    def __init__(self) -> None:
        self._begun: dict[str, Callback] = {}
        self._heard: dict[str, Heard] = {}

    def __contains__(self, name: str) -> bool:
        return name in self._begun

    def offer(self, name: str, message_type: str, *, begun: Callback) -> None:
        """Say that a topic is spoken on; messages are handed on as they are, whatever type it has.

        Args:
            begun: Called whenever somebody begins to listen to it.
        """
        self._begun[name] = begun
        if name in self._heard:
            begun()

    def is_heard(self, name: str) -> bool:
        """Whether anybody listens to a topic."""
        return name in self._heard

    def say(self, name: str, message: object) -> None:
        """Say a message on a topic; where nobody listens it is lost."""
        if heard := self._heard.get(name):
            heard(message, "")

    def hear(self, name: str, heard: Heard) -> Callback:
        """Listen to a topic, in the place of who has listened before; see TopicTransport.hear_topic."""
        self._heard[name] = heard
        if name in self._begun:
            self._begun[name]()
        return lambda: self._forget(name)

    def _forget(self, name: str) -> None:
        del self._heard[name]


class InProcessTransport:
    """Calls functions. The handler sees the world as of the call; the reply comes `latency_s` later.

    Attributes:
        topics: What is said in this process.
    """

    def __init__(self, clock: Clock) -> None:
        self.topics = InProcessTopics()
        self._clock = clock
        self._services: dict[str, Service] = {}
        self._actions: dict[str, Start] = {}
        self._goals: dict[int, _RunningGoal] = {}

    def offer(self, name: str, service: Service) -> None:
        """Make a service known under its full name; a new one takes the place of an old one."""
        self._services[name] = service

    def offer_action(self, name: str, start: Start) -> None:
        """Make an action known under its full name; a new one takes the place of an old one."""
        self._actions[name] = start

    def offers(self, name: str) -> bool:
        """Whether there is a service, an action or a topic of this name."""
        return name in self._services or name in self._actions or name in self.topics

    def call(self, call: ServiceCall, deliver: Callable[[ServiceReply], None]) -> None:
        service = self._services.get(call.service)
        if service is None:
            known = ", ".join(sorted(self._services))
            reply = _failure(call, "NoSuchService", f"there is no service {call.service}; there is {known}")
            self._clock.call_at(self._clock.now_s, lambda: deliver(reply))
            return
        try:
            fields = service.handler(call.fields)
        except ServiceFailed as failed:
            reply = _failure(call, failed.code, failed.message)
        else:
            reply = ServiceReply(call_id=call.id, fields=fields, failure="", reason="")
        self._clock.call_at(self._clock.now_s + service.latency_s, lambda: deliver(reply))

    def reconcile(self, calls: Iterable[ServiceCall], told: Callable[[Mapping[int, bool | None]], None]) -> None:
        offered: dict[int, bool | None] = {call.id: self.offers(call.service) for call in calls}
        self._clock.call_at(self._clock.now_s, lambda: told(offered))

    def send_goal(
        self, goal: Goal, feedback: Callable[[Mapping[str, object]], None], done: Callable[[GoalResult], None]
    ) -> None:
        def ended(result: GoalResult) -> None:
            self._goals.pop(goal.id, None)
            self._clock.call_at(self._clock.now_s, lambda: done(result))

        start = self._actions.get(goal.action)
        if start is None:
            known = ", ".join(sorted(self._actions)) or "none"
            ended(_no_goal(goal, "NoSuchAction", f"there is no action {goal.action}; there is {known}"))
            return
        running = self._goals[goal.id] = _RunningGoal(goal, feedback, ended)
        try:
            start(running)
        except ServiceFailed as failed:
            running.has_ended = True
            ended(_no_goal(goal, failed.code, failed.message, GoalStatus.ABORTED))

    def cancel_goal(self, goal_id: int) -> None:
        running = self._goals.get(goal_id)
        if running is not None:
            running.canceled()

    def hear_topic(self, topic: str, message_type: str, heard: Heard) -> Callback:
        return self.topics.hear(topic, heard)


class _RunningGoal:
    """A goal in the hands of a function."""

    def __init__(
        self, goal: Goal, feedback: Callable[[Mapping[str, object]], None], ended: Callable[[GoalResult], None]
    ) -> None:
        self.fields = goal.fields
        self.canceled: Callable[[], None] = lambda: None
        self.has_ended = False
        self._goal, self._feedback, self._ended = goal, feedback, ended

    def feed(self, fields: Mapping[str, object]) -> None:
        if not self.has_ended:
            self._feedback(fields)

    def end(self, status: GoalStatus, fields: Mapping[str, object], reason: str = "") -> None:
        if not self.has_ended:
            self.has_ended = True
            self._ended(result_of(self._goal.id, self._goal.action, status, fields, reason))


def _no_goal(goal: Goal, failure: str, reason: str, status: GoalStatus = GoalStatus.UNKNOWN) -> GoalResult:
    return GoalResult(goal_id=goal.id, status=status, fields={}, failure=failure, reason=reason)


def _failure(call: ServiceCall, failure: str, reason: str) -> ServiceReply:
    return ServiceReply(call_id=call.id, fields={}, failure=failure, reason=reason)
