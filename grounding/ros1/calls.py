"""Calls of services in ROS 1, over connections that are kept: a new one takes ten times as long as a call.

A connection carries one call at a time, so a service has as many as it has calls at once; each has its thread, as
rospy waits for replies. What is open belongs to the clock's thread.
"""

from __future__ import annotations

import itertools
import queue
import re
import select
import socket
import threading
from collections import defaultdict
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from grounding.ros1.installed import ros
from grounding.ros1.node import MasterRefuses, Node
from grounding.ros1.wire import Wire
from grounding.rosbridge.calls import Deliver, coded, failed
from grounding.rosbridge.dropped import Dropped
from grounding.rosbridge.types import ServiceType, UnknownType
from grounding.rosbridge.values import BadValue
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import Callback, WallClock

_CONNECT_S = 5.0
_ERROR = re.compile(
    r".*? responded with an error: (?:service cannot process request: |error processing request: )?(.*)", re.DOTALL
)


@dataclass(frozen=True, slots=True)
class _Failure:
    """Why there is no reply: class and reason."""

    failure: str
    reason: str


@dataclass(frozen=True, slots=True)
class _Open:
    call: ServiceCall
    deliver: Deliver
    line: _Line
    withdraw_timeout: Callback
    stop_listening: Callback


class Calls:
    """Makes calls and knows which are open.

    Args:
        services: The types of the services, by their full names.
        dropped: Told of replies to calls whose time was over.
    """

    def __init__(
        self, node: Node, clock: WallClock, services: Mapping[str, ServiceType], wire: Wire, dropped: Dropped
    ) -> None:
        self._node, self._clock, self._services, self._wire = node, clock, services, wire
        self._dropped = dropped
        self._open: dict[int, _Open] = {}
        self._idle: defaultdict[str, list[_Line]] = defaultdict(list)
        self._numbers = itertools.count()
        self._closed = False

    def call(self, call: ServiceCall, deliver: Deliver) -> None:
        """Make a call. Without a reply in its time its connection ends; telling the caller so is not done here."""
        service_type = self._services.get(call.service)
        if service_type is None:
            known = ", ".join(sorted(self._services)) or "none"
            self._fail_later(call, deliver, "NoSuchService", f"there is no service {call.service}; there is {known}")
            return
        if self._closed or not (self._node.connected or self._idle[call.service]):
            self._fail_later(call, deliver, "Lost", self._node.problem or "the transport is closed")
            return
        given = {name: value for name, value in call.fields.items() if value is not None}
        try:
            request = self._wire.service_class(service_type)._request_class(
                self._wire.encode_fields(service_type.request, given)
            )
        except (BadValue, UnknownType) as error:
            self._fail_later(call, deliver, "BadRequest", f"{call.service}: {error}")
            return
        idle = self._idle[call.service]
        line = idle.pop() if idle else _Line(call.service, self._wire.service_class(service_type), self._node)
        number = next(self._numbers)
        self._open[number] = _Open(
            call,
            deliver,
            line,
            self._clock.call_at(self._clock.now_s + call.timeout_s, lambda: self._forget(number)),
            self._clock.listen(),
        )
        line.carry(request, lambda answer: self._clock.post(lambda: self._take(number, line, answer)))

    def close(self, reason: str) -> None:
        """End all connections; open calls are answered as lost when the clock runs again."""
        self._closed = True
        for line in [*(opened.line for opened in self._open.values()), *itertools.chain(*self._idle.values())]:
            line.end()
        self._idle.clear()
        self._clock.post(lambda: self._lose(reason))

    def _lose(self, reason: str) -> None:
        for number in list(self._open):
            opened = self._close(number)
            opened.deliver(failed(opened.call, "Lost", reason))

    def _take(self, number: int, line: _Line, answer: bytes | _Failure) -> None:
        if number not in self._open:
            if isinstance(answer, bytes):
                self._dropped.note(f"reply of {line.service}, for which no call is open")
            return
        opened = self._close(number)
        if not self._closed:
            self._idle[line.service].append(line)
        opened.deliver(self._reply(opened.call, answer))

    def _reply(self, call: ServiceCall, answer: bytes | _Failure) -> ServiceReply:
        if isinstance(answer, _Failure):
            return failed(call, answer.failure, answer.reason)
        try:
            fields = self._wire.decode_fields(self._services[call.service].reply, answer)
        except BadValue as error:
            return failed(call, "BadReply", f"the reply of {call.service}: {error}")
        return ServiceReply(call_id=call.id, fields=fields, failure="", reason="")

    def _forget(self, number: int) -> None:
        self._close(number).line.end()

    def _close(self, number: int) -> _Open:
        opened = self._open.pop(number)
        opened.withdraw_timeout()
        opened.stop_listening()
        return opened

    def _fail_later(self, call: ServiceCall, deliver: Deliver, failure: str, reason: str) -> None:
        self._clock.post(lambda: deliver(failed(call, failure, reason)))


class _Line:
    """A connection to a service, made when it is first needed and made again when the service ended it."""

    def __init__(self, service: str, service_class: Any, node: Node) -> None:
        self.service, self._service_class, self._node = service, service_class, node
        self._jobs: queue.SimpleQueue[tuple[Any, Callable[[bytes | _Failure], None]] | None] = queue.SimpleQueue()
        self._ended = False
        self._transport: Any = None
        threading.Thread(target=self._run, name=f"ros1 {service}", daemon=True).start()

    def carry(self, request: Any, answer: Callable[[bytes | _Failure], None]) -> None:
        """Send a request; `answer` gets the reply on the line's thread."""
        self._jobs.put((request, answer))

    def end(self) -> None:
        """End connection and thread, from any thread; a call under way gets a failure."""
        self._ended = True
        self._jobs.put(None)
        transport = self._transport
        wire = None if transport is None else transport.socket
        if wire is not None:
            with suppress(OSError):
                wire.shutdown(socket.SHUT_RDWR)  # wakes the thread that waits for a reply

    def _run(self) -> None:
        while (job := self._jobs.get()) is not None:
            request, answer = job
            answer(self._answered(request))
        self._hang_up()

    def _answered(self, request: Any) -> bytes | _Failure:
        rospy = ros("rospy")
        try:
            if self._transport is None or _is_over(self._transport.socket):
                problem = self._connect()
                if problem is not None:
                    return problem
            self._transport.send_message(request, 0)
            (reply,) = self._transport.receive_once()
        except rospy.ServiceException as error:
            told = _ERROR.fullmatch(str(error))
            return _Failure(*coded((told[1] if told else str(error)) or f"{self.service} does not say why"))
        except (rospy.exceptions.TransportException, OSError, ValueError) as error:
            self._hang_up()
            return _Failure("Lost", f"the connection to {self.service} ended: {error}")
        return bytes(reply.data)

    def _connect(self) -> _Failure | None:
        self._hang_up()
        try:
            uri = self._node.ask("lookupService", self.service)
        except MasterRefuses:
            known = ", ".join(sorted(self._node.offered()))
            return _Failure("NoSuchService", f"there is no service {self.service}; there is {known}")
        rospy = ros("rospy")
        host, port = rospy.core.parse_rosrpc_uri(uri)
        transport = ros("rospy.impl.tcpros_base").TCPROSTransport(
            _client(self.service, self._service_class), self.service
        )
        self._transport = transport
        try:
            transport.connect(host, port, uri, timeout=_CONNECT_S)
        except rospy.exceptions.TransportInitError as error:
            self._hang_up()
            other_type = "md5sum" in str(error)
            return _Failure("BadRequest" if other_type else "Lost", f"{self.service} does not take the call: {error}")
        return _Failure("Lost", "the transport is closed") if self._ended else None

    def _hang_up(self) -> None:
        transport, self._transport = self._transport, None
        if transport is not None:
            transport.close()


def _is_over(wire: socket.socket | None) -> bool:
    """Whether the other end has ended a connection on which nothing is awaited."""
    return wire is None or bool(select.select([wire], [], [], 0.0)[0])


def _client(service: str, service_class: Any) -> Any:
    """What rospy does for a call, on a connection that is kept, with the texts of failures as texts."""
    made = ros("rospy.impl.tcpros_service").TCPROSServiceClient(service, service_class, headers={"persistent": "1"})
    read = made._read_service_error
    made._read_service_error = lambda wire, buffer: read(wire, buffer).decode(errors="replace")
    return made
