"""The services that we offer to the far end of a link."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from grounding.inprocess import Handler
from grounding.rosbridge.connection import NotSent
from grounding.rosbridge.operations import (
    AdvertiseService,
    CallService,
    Operation,
    ServiceResponse,
    UnadvertiseService,
)
from grounding.rosbridge.types import ServiceType, Types
from grounding.rosbridge.values import BadValue, Numbers, fields_from_tree, fields_to_tree
from kb.clock import Callback, WallClock
from kb.errors import ServiceFailed


class Offers:
    """Answers calls by functions; like topics, what is offered outlives the sessions of a link.

    Args:
        send: Raises NotSent or BadFrame.
    """

    def __init__(self, send: Callable[[Operation], None], clock: WallClock, types: Types, numbers: Numbers) -> None:
        self._send, self._clock, self._types = send, clock, types
        self._numbers: Numbers = numbers
        self._offered: dict[str, tuple[ServiceType, Handler, Callback]] = {}

    def offer(self, name: str, service_type: ServiceType, handler: Handler) -> None:
        """Offer a service from now on, in every session; a new one takes the place of an old one."""
        self.withdraw(name)
        self._offered[name] = (service_type, handler, self._clock.listen())
        self._advertise(name)

    def withdraw(self, name: str) -> None:
        """Offer a service no more."""
        if name in self._offered:
            _, _, stop_listening = self._offered.pop(name)
            stop_listening()
            self._try_to_send(UnadvertiseService(service=name))

    def resume(self) -> None:
        """Say everything again to a far end that has forgotten it."""
        for name in self._offered:
            self._advertise(name)

    def take(self, call: CallService) -> str:
        """Answer a call.

        Returns:
            Why it was not served, in a sentence; empty if it was.
        """
        try:
            values = self._served(call)
        except ServiceFailed as failed:
            self._try_to_send(ServiceResponse(service=call.service, id=call.id, result=False, values=str(failed)))
            return f"call of {call.service}: {failed}"
        self._try_to_send(ServiceResponse(service=call.service, id=call.id, result=True, values=values))
        return ""

    def _served(self, call: CallService) -> dict[str, object]:
        if call.service not in self._offered:
            known = ", ".join(sorted(self._offered)) or "none"
            raise ServiceFailed("NoSuchService", f"there is no service {call.service}; there is {known}")
        service_type, handler, _ = self._offered[call.service]
        try:
            request = fields_from_tree(service_type.request, call.args, now_s=self._clock.now_s, types=self._types)
        except BadValue as error:
            raise ServiceFailed("BadRequest", str(error)) from error
        return fields_to_tree(service_type.reply, handler(request), numbers=self._numbers, types=self._types)

    def _advertise(self, name: str) -> None:
        self._try_to_send(AdvertiseService(service=name, type=self._offered[name][0].name))

    def _try_to_send(self, operation: Operation) -> None:
        with suppress(NotSent):  # `resume` makes up for it; who called is told by the broken connection
            self._send(operation)
