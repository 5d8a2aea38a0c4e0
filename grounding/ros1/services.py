"""Services that we offer in ROS 1: answered on the thread of a clock, while rospy has a thread for each caller."""

from __future__ import annotations

import queue
from collections.abc import Callable, Mapping
from typing import Any

from grounding.inprocess import Handler
from grounding.ros1.installed import ros
from grounding.ros1.node import Node
from grounding.ros1.wire import Wire
from grounding.rosbridge.types import ServiceType
from grounding.rosbridge.values import BadValue
from kb.clock import Callback, Clock
from kb.errors import ServiceFailed

_Answer = Mapping[str, object] | ServiceFailed


class Services:
    """Offers services, with every master that comes.

    Args:
        post: The way from any thread onto the clock's.
        clock: Tells the handlers' time.
    """

    def __init__(self, node: Node, wire: Wire, post: Callable[[Callback], None], clock: Clock) -> None:
        self._node, self._wire, self._post, self._clock = node, wire, post, clock
        self._waiting: set[queue.SimpleQueue[_Answer]] = set()
        self._closed = False

    def offer(self, name: str, service_type: ServiceType, handler: Handler, latency_s: float = 0.0) -> None:
        """Offer a service from now on; a new one takes the place of an old one.

        Args:
            handler: Runs on the clock's thread as of the call; takes the request's fields, gives the reply's, or
                raises ServiceFailed.
            latency_s: From the call to the reply.

        Raises:
            UnknownType: ROS 1 cannot have a service of this type.
        """
        service_class = self._wire.service_class(service_type)

        def answer(request: Any) -> Any:
            return service_class._response_class(self._answer(service_type, handler, latency_s, request.data))

        rospy = ros("rospy")
        self._node.hold(
            ("service", name), lambda: rospy.Service(name, service_class, answer), lambda offered: offered.shutdown()
        )

    def withdraw(self, name: str) -> None:
        """Offer a service no more."""
        self._node.drop(("service", name))

    def close(self) -> None:
        """Tell all who wait that there will be no answer."""
        self._closed = True
        for answered in list(self._waiting):
            answered.put(_ENDED)

    def _answer(self, service_type: ServiceType, handler: Handler, latency_s: float, data: bytes) -> bytes:
        """On the thread of a caller: the reply's bytes."""
        answered: queue.SimpleQueue[_Answer] = queue.SimpleQueue()
        self._waiting.add(answered)
        try:
            request = self._wire.decode_fields(service_type.request, data)
            self._post(lambda: self._handle(handler, latency_s, request, answered.put))
            answer = _ENDED if self._closed else answered.get()
            if isinstance(answer, ServiceFailed):
                raise answer
            return self._wire.encode_fields(service_type.reply, answer)
        except (ServiceFailed, BadValue) as error:
            failed = error if isinstance(error, ServiceFailed) else ServiceFailed("BadRequest", str(error))
            raise ros("rospy").ServiceException(str(failed)) from error
        finally:
            self._waiting.discard(answered)

    def _handle(
        self, handler: Handler, latency_s: float, request: Mapping[str, object], answer: Callable[[_Answer], None]
    ) -> None:
        """On the clock's thread."""
        try:
            reply: _Answer = handler(request)
        except ServiceFailed as failed:
            reply = failed
        if latency_s > 0.0:
            self._clock.call_at(self._clock.now_s + latency_s, lambda: answer(reply))
        else:
            answer(reply)


_ENDED = ServiceFailed("Closed", "who offers the service has ended")
