"""The services of a rosbridge server: functions of this process, and those that clients offer.

A call is answered once: by its provider, or with the reason why it will not be. The texts of failures begin with their
class: `NoSuchService: there is no service /lamp`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from grounding.rosbridge.forms import BadValue
from grounding.rosbridge.operations import AdvertiseService, CallService, ServiceResponse, UnadvertiseService
from grounding.rosbridge.policy import resolved
from grounding.rosbridge.session import Refused, Session, numbers_in
from grounding.rosbridge.types import ServiceType, Types
from grounding.rosbridge.values import fields_from_tree, fields_to_tree
from kb.clock import Callback, Clock
from kb.errors import ConcertmasterError, ServiceFailed

Handler = Callable[[Mapping[str, object]], Mapping[str, object]]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Service:
    """Of this process, with handler, or of a client."""

    type: ServiceType
    handler: Handler | None = None
    latency_s: float = 0.0
    provider: Session | None = None
    advertised_as: str = ""  # clients take calls by the very name that they gave


@dataclass(slots=True, kw_only=True)
class _Call:
    """A call that a client has to answer; its arguments, which may be large, are not kept."""

    id: str
    caller: Session
    asked: CallService
    service: _Service
    withdraw_timeout: Callback


class Services:
    """All services of a server.

    Args:
        timeout_s: Of calls to clients that do not say how long they wait.
        node: Name of this process among the providers.

    Attributes:
        out_of_reach: Why services that there are cannot be called, by name.
    """

    def __init__(self, types: Types, clock: Clock, node: str, timeout_s: float) -> None:
        self._types, self._clock, self._node, self._timeout_s = types, clock, node, timeout_s
        self.out_of_reach: Mapping[str, str] = {}
        self._services: dict[str, _Service] = {}
        self._calls: dict[str, _Call] = {}
        self._count = 0

    def offer(self, name: str, service_type: str, handler: Handler, latency_s: float = 0.0) -> None:
        """Offer a function as a service.

        Args:
            handler: Takes the fields of the request and gives those of the reply, as of now; raises ServiceFailed.
            latency_s: The reply goes out so much later.

        Raises:
            UnknownType: There is no such type.
        """
        found = self._types.service(service_type)
        self._services[resolved(name)] = _Service(type=found, handler=handler, latency_s=latency_s)

    def told(self) -> list[tuple[str, str, str]]:
        """Name, type and provider of all services, by name."""
        return [
            (name, service.type.name, service.provider.name if service.provider else self._node)
            for name, service in sorted(self._services.items())
        ]

    @property
    def open_calls(self) -> int:
        """How many calls wait for a client's answer."""
        return len(self._calls)

    def advertise(self, session: Session, operation: AdvertiseService) -> None:
        service_type = self._types.service(operation.type)
        name = resolved(operation.service)
        present = self._services.get(name)
        if present is not None and present.provider is not session:
            raise Refused("NameTaken", f"service {operation.service} is offered by somebody else")
        session.hold("service", name)
        self._services[name] = _Service(type=service_type, provider=session, advertised_as=operation.service)

    def unadvertise(self, session: Session, operation: UnadvertiseService) -> None:
        service = self._services.get(resolved(operation.service))
        if service is None or service.provider is not session:
            session.tell("warning", f"service {operation.service} is not offered by this client", operation.id)
            return
        self._withdraw(resolved(operation.service), session)

    def call(self, session: Session, operation: CallService) -> None:
        service = self._services.get(resolved(operation.service))
        if service is None:
            why = self.out_of_reach.get(resolved(operation.service), "")
            raise Refused("NoSuchService", why or f"there is no service {operation.service}")
        now_s = self._clock.now_s
        fields = fields_from_tree(service.type.request, operation.args, now_s=now_s, types=self._types)
        self._count += 1
        number = f"service_request:{operation.service}:{self._count}"
        session.hold("call", number)
        if service.handler is not None:
            self._run(session, operation, service, service.handler, fields, number)
            return
        assert service.provider is not None
        wait_s = self._timeout_s if operation.timeout is None else operation.timeout
        withdraw = self._clock.call_at(now_s + wait_s, lambda: self._time_out(number, wait_s))
        self._calls[number] = _Call(
            id=number, caller=session, asked=replace(operation, args=None), service=service, withdraw_timeout=withdraw
        )
        encoding = service.provider.encoding("none")
        tree = fields_to_tree(service.type.request, fields, numbers=numbers_in(encoding), types=self._types)
        forwarded = CallService(service=service.advertised_as, id=number, args=tree, timeout=wait_s)
        service.provider.answer(forwarded, compression=encoding)

    def answered(self, session: Session, operation: ServiceResponse) -> None:
        call = self._calls.get(str(operation.id))
        if call is None or call.service.provider is not session:
            session.tell("warning", f"there is no open call with id {operation.id}", operation.id)
            return
        if not operation.result:
            said = operation.values if isinstance(operation.values, str) and operation.values else "gave no reason"
            self._finish(call, said)
            return
        try:
            fields = fields_from_tree(
                call.service.type.reply, operation.values, now_s=self._clock.now_s, types=self._types
            )
        except BadValue as error:
            session.tell("warning", f"reply of {operation.service}: {error}", operation.id)
            self._finish(call, f"BadReply: {operation.service}: {error}")
            return
        self._finish(call, fields)

    def leave(self, session: Session) -> None:
        """The client is gone: what it offered ends, what it asked is not answered any more."""
        for name in [name for name, service in self._services.items() if service.provider is session]:
            self._withdraw(name, session)
        for call in [call for call in self._calls.values() if call.caller is session]:
            call.withdraw_timeout()
            del self._calls[call.id]

    def _run(
        self,
        session: Session,
        asked: CallService,
        service: _Service,
        handler: Handler,
        fields: Mapping[str, object],
        number: str,
    ) -> None:
        """Call a function of this process; its reply goes out after its latency, or the failure at the timeout."""
        result: Mapping[str, object] | str
        try:
            result = handler(fields)
        except ServiceFailed as failed:
            result = str(failed)
        except ConcertmasterError as wrong:
            result = f"BadRequest: {wrong}"
        latency_s = service.latency_s
        if asked.timeout is not None and asked.timeout < latency_s:
            latency_s, result = asked.timeout, _too_late(asked.service, asked.timeout)

        def reply() -> None:
            session.release("call", number)
            self._reply(session, asked, service, result)

        if latency_s > 0.0:
            self._clock.call_at(self._clock.now_s + latency_s, reply)
        else:
            reply()

    def _time_out(self, number: str, wait_s: float) -> None:
        call = self._calls[number]
        self._finish(call, _too_late(call.asked.service, wait_s))

    def _finish(self, call: _Call, result: Mapping[str, object] | str) -> None:
        call.withdraw_timeout()
        del self._calls[call.id]
        call.caller.release("call", call.id)
        self._reply(call.caller, call.asked, call.service, result)

    def _reply(
        self, session: Session, asked: CallService, service: _Service, result: Mapping[str, object] | str
    ) -> None:
        """Send the fields of a reply, or the reason why there are none."""
        encoding = session.encoding(asked.compression)
        values: Mapping[str, object] | str = result
        if not isinstance(result, str):
            try:
                values = fields_to_tree(service.type.reply, result, numbers=numbers_in(encoding), types=self._types)
            except BadValue as error:
                values = f"BadReply: {asked.service}: {error}"
        succeeded = not isinstance(values, str)
        response = ServiceResponse(service=asked.service, id=asked.id, result=succeeded, values=values)
        session.answer(response, compression=encoding, fragment_size=asked.fragment_size)

    def _withdraw(self, name: str, session: Session) -> None:
        del self._services[name]
        session.release("service", name)
        for call in [call for call in self._calls.values() if resolved(call.asked.service) == name]:
            self._finish(call, f"Lost: who offered service {name} is gone")


def _too_late(service: str, wait_s: float) -> str:
    return f"TimedOut: service {service} did not answer within {wait_s:g} s"
