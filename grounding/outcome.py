"""What became of an action."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from grounding.errors import GroundingError
from grounding.messages import problem_with
from grounding.transport import ServiceCall, ServiceReply
from kb.groundings import Grounding


class OutcomeStatus(StrEnum):
    """How an action ended."""

    SUCCEEDED = "SUCCEEDED"
    """The service did what it was asked to."""
    EXECUTION_FAILED = "EXECUTION_FAILED"
    """The service said that it could not."""
    POSTCONDITION_FAILED = "POSTCONDITION_FAILED"
    """The service replied, but not with what its grounding promises."""
    REFUSED = "REFUSED"
    """The call was not even made: it cannot be put into the service's terms."""
    TIMED_OUT = "TIMED_OUT"
    """No reply came in time."""
    LOST = "LOST"
    """The connection to the service is gone: whether it did what it was asked to is not known."""


_STATUS_OF = {"Lost": OutcomeStatus.LOST, "BadReply": OutcomeStatus.POSTCONDITION_FAILED}
"""What the failures mean that transports find; the others are the services' own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """How an action ended, and what it found out.

    Attributes:
        failure: Class of failure, such as `NoPath`; empty if it succeeded.
        reason: In a sentence; empty if it succeeded.
        outputs: Values by output parameter: messages, or truth values.
        elapsed_s: From the call to the reply.
    """

    status: OutcomeStatus
    failure: str
    reason: str
    outputs: Mapping[str, object]
    elapsed_s: float

    @property
    def succeeded(self) -> bool:
        """Whether the action did what it should."""
        return self.status is OutcomeStatus.SUCCEEDED


def interpret(reply: ServiceReply, grounding: Grounding, *, service: str, elapsed_s: float) -> Outcome:
    """Read a reply as its grounding says: fields become output parameters, checked field by field."""
    if reply.failure:
        return Outcome(
            status=_STATUS_OF.get(reply.failure, OutcomeStatus.EXECUTION_FAILED),
            failure=reply.failure,
            reason=reply.reason,
            outputs={},
            elapsed_s=elapsed_s,
        )
    outputs: dict[str, object] = {}
    try:
        for field in grounding.reply:
            if field.name not in reply.fields:
                raise GroundingError(grounding.process, field.name, f"the reply of {service} lacks it")
            value = reply.fields[field.name]
            problem = problem_with(field.message_type, value)
            if problem:
                raise GroundingError(grounding.process, field.name, f"the reply of {service}: {problem}")
            if field.parameter is not None:
                outputs[field.parameter] = value
    except GroundingError as error:
        return Outcome(
            status=OutcomeStatus.POSTCONDITION_FAILED,
            failure="BadReply",
            reason=str(error),
            outputs={},
            elapsed_s=elapsed_s,
        )
    return Outcome(status=OutcomeStatus.SUCCEEDED, failure="", reason="", outputs=outputs, elapsed_s=elapsed_s)


def refused(error: GroundingError) -> Outcome:
    """The outcome of an action that cannot be called."""
    return Outcome(status=OutcomeStatus.REFUSED, failure="NotGrounded", reason=str(error), outputs={}, elapsed_s=0.0)


def timed_out(call: ServiceCall) -> Outcome:
    """The outcome of a call without a reply."""
    return Outcome(
        status=OutcomeStatus.TIMED_OUT,
        failure="NoReply",
        reason=f"{call.service} did not reply within {call.timeout_s:g} s",
        outputs={},
        elapsed_s=call.timeout_s,
    )
