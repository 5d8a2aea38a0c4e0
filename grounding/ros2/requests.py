"""Calls and goals of a node of ROS 2, on the node's thread; requests and replies are bytes (CDR)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from grounding.actions import GoalStatus
from grounding.ros2.installed import ros
from kb.clock import Stopwatch

_AT_ONCE = 10
"""Requests to a service that have no reply: ROS 2 keeps so many for who serves it, and silently loses older ones."""

Do = Callable[[Callable[[], None]], None]
Done = Callable[[bytes | str], None]
"""Told the reply, or why there is none, beginning with the class of failure."""


@dataclass(slots=True, kw_only=True)
class _Call:
    """A call that has no reply; nobody waits for one after `until_s`."""

    request: bytes
    until_s: float
    done: Done


@dataclass(slots=True)
class _Service:
    """A service that has been called: what waits to be sent, and what is under way, by its future."""

    kind: Any
    client: Any
    waiting: deque[_Call] = field(default_factory=deque)
    open: dict[Any, _Call] = field(default_factory=dict)


class Calls:
    """Calls of services.

    Args:
        do: Does something on the node's thread.
        tell: Does something on the thread of who made the node.
    """

    def __init__(self, node: Any, do: Do, tell: Do) -> None:
        self._node, self._do, self._tell = node, do, tell
        self._bytes = ros("rclpy.serialization")
        self._errors = ros("rclpy.impl.implementation_singleton").rclpy_implementation
        self._watch = Stopwatch()
        self._services: dict[str, _Service] = {}

    def call(self, name: str, kind: Any, request: bytes, within_s: float, done: Done) -> None:
        """Call a service; from any thread.

        Args:
            kind: Class of its type.
            within_s: A reply that comes later is not told.
            done: Called once or never.
        """
        call = _Call(request=request, until_s=self._watch.wall_s + within_s, done=done)
        self._do(lambda: self._call(name, kind, call))

    def retry(self) -> None:
        """Begin what had to wait, and give up what is over time."""
        now_s = self._watch.wall_s
        for service in self._services.values():
            for future in [future for future, call in service.open.items() if call.until_s < now_s]:
                del service.open[future]
                service.client.remove_pending_request(future)
            self._begin(service)

    def forget(self, names: Iterable[str]) -> None:
        """These have gone, and with them what was under way."""
        for name in self._services.keys() & set(names):
            self._node.destroy_client(self._services.pop(name).client)

    def _call(self, name: str, kind: Any, call: _Call) -> None:
        if name not in self._services:
            self._services[name] = _Service(kind, self._node.create_client(kind, name))
        self._services[name].waiting.append(call)
        self._begin(self._services[name])

    def _begin(self, service: _Service) -> None:
        while service.waiting and len(service.open) < _AT_ONCE and service.client.service_is_ready():
            call = service.waiting.popleft()
            if call.until_s >= self._watch.wall_s:
                self._send(service, call)

    def _send(self, service: _Service, call: _Call) -> None:
        try:
            request = self._bytes.deserialize_message(call.request, service.kind.Request)
            future = service.client.call_async(request)
        except (self._errors.RMWError, self._errors.RCLError) as error:
            problem = _told(error, self._errors)
            self._tell(lambda: call.done(problem))
            return
        service.open[future] = call
        future.add_done_callback(lambda ended: self._answered(service, ended))

    def _answered(self, service: _Service, future: Any) -> None:
        call = service.open.pop(future, None)
        if call is not None:
            reply = self._bytes.serialize_message(future.result())
            self._tell(lambda: call.done(reply))
            self._begin(service)


Ended = Callable[[int, bytes | str], None]
"""Given the status of a goal as ROS 2 numbers it, and its result, or why there is none."""


@dataclass(slots=True)
class _Goal:
    """A goal that has not ended; `handle` once it is accepted."""

    action: str
    handle: Any = None
    unwanted: bool = False


class Goals:
    """Goals of actions; the arguments are as for calls."""

    def __init__(self, node: Any, do: Do, tell: Do) -> None:
        self._node, self._do, self._tell = node, do, tell
        self._bytes = ros("rclpy.serialization")
        self._errors = ros("rclpy.impl.implementation_singleton").rclpy_implementation
        self._clients: dict[str, Any] = {}
        self._goals: dict[str, _Goal] = {}
        self._waiting: list[tuple[str, Callable[[], None]]] = []

    def send(
        self, name: str, kind: Any, number: str, goal: bytes, feedback: Callable[[bytes], None], ended: Ended
    ) -> None:
        """Send a goal; from any thread.

        Args:
            kind: Class of the action's type.
            number: Names the goal from now on.
            ended: Told once and last, unless the action goes.
        """
        self._do(lambda: self._send_when_ready(name, kind, number, goal, feedback, ended))

    def retry(self) -> None:
        """Begin what had to wait."""
        waiting, self._waiting = self._waiting, []
        for name, start in waiting:
            self._begin(name, start)

    def forget(self, names: Iterable[str]) -> None:
        """These have gone, and with them what was under way."""
        gone = set(names)
        self._waiting = [one for one in self._waiting if one[0] not in gone]
        self._goals = {number: goal for number, goal in self._goals.items() if goal.action not in gone}
        for name in self._clients.keys() & gone:
            self._clients.pop(name).destroy()

    def cancel(self, number: str) -> None:
        """A goal is not wanted any more; from any thread."""
        self._do(lambda: self._cancel(number))

    def _send_when_ready(
        self, name: str, kind: Any, number: str, goal: bytes, feedback: Callable[[bytes], None], ended: Ended
    ) -> None:
        if name not in self._clients:
            self._clients[name] = ros("rclpy.action").ActionClient(self._node, kind, name)
        client = self._clients[name]
        self._goals[number] = _Goal(name)
        self._begin(name, lambda: self._send(client, kind, number, goal, feedback, ended))

    def _begin(self, name: str, start: Callable[[], None]) -> None:
        if self._clients[name].server_is_ready():
            start()
        else:
            self._waiting.append((name, start))

    def _send(
        self, client: Any, kind: Any, number: str, goal: bytes, feedback: Callable[[bytes], None], ended: Ended
    ) -> None:
        def fed(message: Any) -> None:
            data = self._bytes.serialize_message(message.feedback)
            self._tell(lambda: feedback(data))

        def accepted(future: Any) -> None:
            handle = future.result()
            known = self._goals.get(number)
            if known is None:
                return
            if not handle.accepted:
                del self._goals[number]
                self._tell(lambda: ended(GoalStatus.ABORTED, f"Busy: the action {known.action} has rejected the goal"))
                return
            known.handle = handle
            handle.get_result_async().add_done_callback(came_to_end)
            if known.unwanted:
                handle.cancel_goal_async()

        def came_to_end(future: Any) -> None:
            if self._goals.pop(number, None) is not None:
                status, data = future.result().status, self._bytes.serialize_message(future.result().result)
                self._tell(lambda: ended(status, data))

        try:
            request = self._bytes.deserialize_message(goal, kind.Goal)
            client.send_goal_async(request, feedback_callback=fed).add_done_callback(accepted)
        except (self._errors.RMWError, self._errors.RCLError) as error:
            problem = _told(error, self._errors)
            del self._goals[number]
            self._tell(lambda: ended(GoalStatus.ABORTED, problem))

    def _cancel(self, number: str) -> None:
        known = self._goals.get(number)
        if known is not None:
            known.unwanted = True
            if known.handle is not None:
                known.handle.cancel_goal_async()


def _told(error: Exception, errors: Any) -> str:
    """Why something is not sent: what is in it cannot be, or the far end takes no more."""
    failure = "BadRequest" if isinstance(error, errors.RMWError) else "Lost"
    return f"{failure}: ROS 2 does not take it: {error}"
