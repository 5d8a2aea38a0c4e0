"""The calls of services that are open on a link."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from grounding.rosbridge.connection import NotSent
from grounding.rosbridge.dropped import Dropped
from grounding.rosbridge.framing import BadFrame
from grounding.rosbridge.operations import CallService, Operation, ServiceResponse, Status
from grounding.rosbridge.types import ServiceType, Types
from grounding.rosbridge.values import BadValue, Numbers, fields_from_tree, fields_to_tree
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import Callback, WallClock

Deliver = Callable[[ServiceReply], None]

_CODED = re.compile(r"([A-Z][A-Za-z0-9]*): (.+)", re.DOTALL)
_NO_SERVICE = re.compile(r"service \S+ (does not exist|is not advertised)", re.IGNORECASE)  # rosbridge_suite


@dataclass(frozen=True, slots=True)
class _Open:
    call: ServiceCall
    deliver: Deliver
    reply_type: str
    withdraw_timeout: Callback
    stop_listening: Callback


class Calls:
    """Sends calls and knows which are open.

    Args:
        send: Raises NotSent or BadFrame.
        services: The types of the services, by their full names.
        numbers: How messages are written; `exact` on a binary link.
        dropped: Told of replies to no open call: second ones, late ones, or such as were never asked for.
    """

    def __init__(
        self,
        send: Callable[[Operation], None],
        clock: WallClock,
        services: Mapping[str, ServiceType],
        types: Types,
        numbers: Numbers,
        dropped: Dropped,
    ) -> None:
        self._send, self._clock, self._services, self._types = send, clock, services, types
        self._numbers: Numbers = numbers
        self._dropped = dropped
        self._open: dict[str, _Open] = {}
        self._made = 0

    def call(self, call: ServiceCall, deliver: Deliver) -> None:
        """Send a call. Without a reply in its time it is forgotten; telling the caller so is not done here."""
        service_type = self._services.get(call.service)
        if service_type is None:
            known = ", ".join(sorted(name for name in self._services if not name.startswith("/rosapi/")))
            self._fail_later(call, deliver, "NoSuchService", f"there is no service {call.service}; there is {known}")
            return
        self._made += 1
        wire_id = f"call_service:{call.service}:{self._made}"
        given = {name: value for name, value in call.fields.items() if value is not None}
        try:
            self._send(
                CallService(
                    service=call.service,
                    id=wire_id,
                    args=fields_to_tree(service_type.request, given, numbers=self._numbers, types=self._types),
                    compression="cbor" if self._numbers == "exact" else "none",
                    timeout=call.timeout_s,
                )
            )
        except NotSent as error:
            self._fail_later(call, deliver, "Lost", str(error))
        except (BadValue, BadFrame) as error:
            self._fail_later(call, deliver, "BadRequest", f"{call.service}: {error}")
        else:
            self._open[wire_id] = _Open(
                call,
                deliver,
                service_type.reply,
                self._clock.call_at(self._clock.now_s + call.timeout_s, lambda: self._forget(wire_id)),
                self._clock.listen(),
            )

    def take(self, operation: ServiceResponse | Status) -> None:
        """Give a reply to who waits for it; a status that names a call says that there will be none."""
        opened = self._close(str(operation.id))
        if opened is None:
            if isinstance(operation, ServiceResponse):
                named = "without an id" if operation.id is None else f"with the id {operation.id!r}"
                self._dropped.note(f"reply of {operation.service} {named}, for which no call is open")
            return
        if isinstance(operation, Status):
            reply = failed(opened.call, *coded(operation.msg))
        elif operation.result:
            reply = self._reply(opened, operation.values)
        else:
            reply = failed(opened.call, *coded(str(operation.values or f"{opened.call.service} does not say why")))
        opened.deliver(reply)

    def lose(self, reason: str) -> None:
        """Answer all open calls: the connection is gone."""
        for wire_id in list(self._open):
            opened = self._close(wire_id)
            if opened is not None:
                opened.deliver(failed(opened.call, "Lost", reason))

    def _forget(self, wire_id: str) -> None:
        self._close(wire_id)

    def _close(self, wire_id: str) -> _Open | None:
        opened = self._open.pop(wire_id, None)
        if opened is not None:
            opened.withdraw_timeout()
            opened.stop_listening()
        return opened

    def _reply(self, opened: _Open, values: object) -> ServiceReply:
        """A good reply, if it is of the right type; what it holds beyond its type is passed over."""
        names = {field.name for field in self._types.fields(opened.reply_type)}
        known = {name: tree for name, tree in values.items() if name in names} if isinstance(values, dict) else values
        try:
            fields = fields_from_tree(
                opened.reply_type, known, now_s=self._clock.now_s, optional=names, types=self._types
            )
        except BadValue as error:
            return failed(opened.call, "BadReply", f"the reply of {opened.call.service}: {error}")
        return ServiceReply(call_id=opened.call.id, fields=fields, failure="", reason="")

    def _fail_later(self, call: ServiceCall, deliver: Deliver, failure: str, reason: str) -> None:
        self._clock.post(lambda: deliver(failed(call, failure, reason)))


def failed(call: ServiceCall, failure: str, reason: str) -> ServiceReply:
    """The reply that a call has failed."""
    return ServiceReply(call_id=call.id, fields={}, failure=failure, reason=reason)


def coded(text: str) -> tuple[str, str]:
    """Class of failure and reason in the text of a failed call: `NoPath: there is a wall`, or free text."""
    match = _CODED.fullmatch(text)
    if match:
        return match[1], match[2]
    return ("NoSuchService" if _NO_SERVICE.search(text) else "ServiceError"), text
