"""The transport within one process: services are functions, replies come when the clock says so."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from grounding.transport import ServiceCall, ServiceReply
from kb.clock import Clock
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


class InProcessTransport:
    """Calls functions. The handler sees the world as of the call; the reply comes `latency_s` later."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._services: dict[str, Service] = {}

    def offer(self, name: str, service: Service) -> None:
        """Make a service known under its full name; a new one takes the place of an old one."""
        self._services[name] = service

    def offers(self, name: str) -> bool:
        """Whether there is a service of this name."""
        return name in self._services

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


def _failure(call: ServiceCall, failure: str, reason: str) -> ServiceReply:
    return ServiceReply(call_id=call.id, fields={}, failure=failure, reason=reason)
