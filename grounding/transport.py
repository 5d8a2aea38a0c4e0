"""How a service call gets to its service and the reply back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceCall:
    """A request to a service.

    Attributes:
        id: Never used again, so that a late reply is known for what it is.
        service: Full name, such as `/amigo_1/laser`.
        fields: Messages and plain values by field name.
        timeout_s: After this time the caller gives up.
    """

    id: int
    service: str
    fields: Mapping[str, object]
    timeout_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceReply:
    """A service's answer.

    Attributes:
        call_id: The call that it answers.
        fields: Messages and plain values by field name; empty if it failed.
        failure: Class of failure, such as `NoPath`; empty if it succeeded.
        reason: What the service says about its failure.
    """

    call_id: int
    fields: Mapping[str, object]
    failure: str
    reason: str


class Transport(Protocol):
    """Carries calls to services.

    `call` returns at once. The reply comes through `deliver` later, on the clock's thread, at most once. Failures
    that are the transport's: `NoSuchService`; `Lost`, where the connection is gone or there is none; `BadReply`,
    where what comes back is not of the types that it should be.
    """

    def call(self, call: ServiceCall, deliver: Callable[[ServiceReply], None]) -> None:
        """Send a call."""

    def reconcile(self, calls: Iterable[ServiceCall], told: Callable[[Mapping[int, bool | None]], None]) -> None:
        """Ask, after lost calls, whether there is somebody at the services that they went to.

        Whether a call was carried out cannot be asked: neither ROS nor rosbridge keeps that for a client that was
        gone. It shows in the world, which the executive asks next (where is the robot, what does it hold).

        Args:
            told: For each call by its id whether its service is offered; without a connection, nothing is. None where
                there is a connection and the far end does not tell.
        """
