"""Goals of actions that groundings call for: sent, watched, canceled; what came of them is an outcome.

A goal that is canceled still has a result: only then, or when some seconds have passed, does its robot stand still.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from executive.events import Event, GoalHasEnded, GoalWasSent
from grounding.actions import Carrier, Goal, GoalResult, GoalStatus
from grounding.outcome import Outcome, interpret, timed_out
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import Callback, Clock
from kb.groundings import Grounding
from kb.recoveries import Recoveries

CANCEL_S = 5.0
"""For a robot to say that a goal which was canceled has ended; after that it is taken to stand still."""

_CODES = (("error_code", "error_msg"), ("outcome", "message"))
"""The fields of a result that tell its code, 0 for success, and a sentence: Nav2's, and those of mbf."""

Came = Callable[[Outcome, Mapping[str, object]], None]
"""Told how a goal has ended, and with what fields."""


@dataclass(slots=True, kw_only=True)
class _Open:
    call: ServiceCall
    grounding: Grounding
    recoveries: Recoveries
    came: Came
    sent_s: float
    feedback: Mapping[str, object] = field(default_factory=dict)
    is_late: bool = False
    is_wanted: bool = True
    forget_timer: Callback = lambda: None


class GoalCalls:
    """The goals that have not ended, by the number of their action.

    Args:
        post: Told that a goal was sent, and that one which is not wanted any more has ended.
    """

    def __init__(self, transport: Carrier, clock: Clock, post: Callable[[Event], None]) -> None:
        self._transport, self._clock, self._post = transport, clock, post
        self._open: dict[int, _Open] = {}

    def send(self, call: ServiceCall, grounding: Grounding, recoveries: Recoveries, came: Came) -> None:
        """Send a goal. If its time is over, it is canceled, and has timed out once the robot says that it has ended."""
        now_s = self._clock.now_s
        opened = _Open(call=call, grounding=grounding, recoveries=recoveries, came=came, sent_s=now_s)
        self._open[call.id] = opened
        opened.forget_timer = self._clock.call_at(now_s + call.timeout_s, lambda: self._too_late(opened))
        self._post(GoalWasSent(number=call.id))

        def keep(fields: Mapping[str, object]) -> None:
            opened.feedback = fields

        goal = Goal(id=call.id, action=call.service, fields=call.fields)
        self._transport.send_goal(goal, keep, lambda result: self._done(opened, result))

    def cancel(self, number: int) -> None:
        """A goal is not wanted any more; nothing happens if it has ended."""
        opened = self._open.get(number)
        if opened is None:
            self._post(GoalHasEnded(number=number))
        elif opened.is_wanted:
            opened.is_wanted = False
            self._stop(opened)

    def _too_late(self, opened: _Open) -> None:
        opened.is_late = True
        self._stop(opened)

    def _stop(self, opened: _Open) -> None:
        opened.forget_timer()
        opened.forget_timer = self._clock.call_at(self._clock.now_s + CANCEL_S, lambda: self._done(opened, None))
        self._transport.cancel_goal(opened.call.id)

    def _done(self, opened: _Open, result: GoalResult | None) -> None:
        """A goal has ended; None: nothing has been heard of it since it was canceled."""
        if self._open.get(opened.call.id) is not opened:
            return  # a second result, or one that comes when nobody waits any more
        del self._open[opened.call.id]
        opened.forget_timer()
        if not opened.is_wanted:
            self._post(GoalHasEnded(number=opened.call.id))
        elif result is None or (opened.is_late and result.status is not GoalStatus.SUCCEEDED):
            opened.came(timed_out(opened.call), {} if result is None else result.fields)
        else:
            self._tell(opened, result)

    def _tell(self, opened: _Open, result: GoalResult) -> None:
        call, grounding = opened.call, opened.grounding
        failure, reason = _failure(result, grounding, opened.recoveries)
        if failure and opened.feedback:
            seen = {name: value for name, value in opened.feedback.items() if isinstance(value, int | float)}
            reason = "; ".join([reason, *(f"{name} was {value:g}" for name, value in sorted(seen.items()))])
        fields = {**opened.feedback, **result.fields}
        reply = ServiceReply(call_id=call.id, fields=fields, failure=failure, reason=reason)
        elapsed_s = round(self._clock.now_s - opened.sent_s, 9)
        opened.came(interpret(reply, grounding, service=call.service, elapsed_s=elapsed_s), result.fields)


def _failure(result: GoalResult, grounding: Grounding, recoveries: Recoveries) -> tuple[str, str]:
    """The failure that a result tells, and why; both empty for success. A code says more than a status."""
    for code_field, reason_field in _CODES:
        code = result.fields.get(code_field, 0)
        if isinstance(code, int) and code != 0:
            name = recoveries.code_name(grounding.action_type, code)
            told = f"{grounding.action_type} {code}"
            return name, f"{told}: {result.fields.get(reason_field) or result.reason or 'it does not say why'}"
    return result.failure, result.reason
