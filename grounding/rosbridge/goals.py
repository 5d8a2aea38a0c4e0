"""The goals that are open on a link."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass

from grounding.actions import Goal, GoalResult, GoalStatus, result_of
from grounding.rosbridge.calls import coded
from grounding.rosbridge.connection import NotSent
from grounding.rosbridge.dropped import Dropped
from grounding.rosbridge.framing import BadFrame
from grounding.rosbridge.operations import ActionFeedback, ActionResult, CancelActionGoal, Operation, SendActionGoal
from grounding.rosbridge.types import ActionType, Types
from grounding.rosbridge.values import BadValue, Numbers, fields_from_tree, fields_to_tree
from kb.clock import Callback, WallClock

Feedback = Callable[[Mapping[str, object]], None]
Done = Callable[[GoalResult], None]


@dataclass(frozen=True, slots=True)
class _Open:
    goal: Goal
    feedback: Feedback
    done: Done
    action_type: ActionType
    stop_listening: Callback


class Goals:
    """Sends goals and knows which are open.

    Args:
        send: Raises NotSent or BadFrame.
        actions: The types of the actions, by their full names.
        dropped: Told of results and feedback for no open goal, and of feedback of another type.
    """

    def __init__(
        self,
        send: Callable[[Operation], None],
        clock: WallClock,
        actions: Mapping[str, ActionType],
        types: Types,
        numbers: Numbers,
        dropped: Dropped,
    ) -> None:
        self._send, self._clock, self._actions, self._types = send, clock, actions, types
        self._numbers: Numbers = numbers
        self._dropped = dropped
        self._open: dict[str, _Open] = {}

    def send_goal(self, goal: Goal, feedback: Feedback, done: Done) -> None:
        """Send a goal; see `ActionTransport`."""
        action_type = self._actions.get(goal.action)
        if action_type is None:
            known = ", ".join(sorted(self._actions)) or "none"
            self._end_later(goal, done, "NoSuchAction", f"there is no action {goal.action}; there is {known}")
            return
        try:
            self._send(
                SendActionGoal(
                    action=goal.action,
                    action_type=action_type.name,
                    id=_wire_id(goal.id),
                    args=fields_to_tree(action_type.goal, goal.fields, numbers=self._numbers, types=self._types),
                    feedback=True,
                    compression="cbor" if self._numbers == "exact" else "none",
                )
            )
        except NotSent as error:
            self._end_later(goal, done, "Lost", str(error))
        except (BadValue, BadFrame) as error:
            self._end_later(goal, done, "BadRequest", f"{goal.action}: {error}")
        else:
            self._open[_wire_id(goal.id)] = _Open(goal, feedback, done, action_type, self._clock.listen())

    def cancel_goal(self, goal_id: int) -> None:
        """Ask for the end of a goal; without a connection it is lost anyway."""
        opened = self._open.get(_wire_id(goal_id))
        if opened is not None:
            with suppress(NotSent):
                self._send(CancelActionGoal(action=opened.goal.action, id=_wire_id(goal_id)))

    def take_feedback(self, operation: ActionFeedback) -> None:
        """Tell who waits how far a goal has come."""
        opened = self._open.get(str(operation.id))
        if opened is None:
            self._dropped.note(f"feedback of {operation.action} on {operation.id!r}, which is no open goal")
            return
        fields = self._read(opened.action_type.feedback, operation.values)
        if isinstance(fields, BadValue):
            self._dropped.note(f"feedback of {operation.action}: {fields}")
        else:
            opened.feedback(fields)

    def take_result(self, operation: ActionResult) -> None:
        """Tell who waits how a goal ended."""
        opened = self._open.pop(str(operation.id), None)
        if opened is None:
            self._dropped.note(f"result of {operation.action} for {operation.id!r}, which is no open goal")
            return
        opened.stop_listening()
        opened.done(self._result(opened, operation))

    def lose(self, reason: str) -> None:
        """End all open goals: the connection is gone."""
        lost, self._open = self._open, {}
        for opened in lost.values():
            opened.stop_listening()
            opened.done(ended(opened.goal, "Lost", reason))

    def _result(self, opened: _Open, operation: ActionResult) -> GoalResult:
        goal, status = opened.goal, GoalStatus(operation.status)
        if not operation.result or isinstance(operation.values, str):
            failure, reason = coded(str(operation.values or f"{goal.action} does not say why"))
            return ended(goal, failure, reason, GoalStatus.ABORTED)
        fields = self._read(opened.action_type.result, operation.values or {})
        if isinstance(fields, BadValue):
            return ended(goal, "BadReply", f"the result of {goal.action}: {fields}", status)
        return result_of(goal.id, goal.action, status, fields)

    def _read(self, message_type: str, values: object) -> Mapping[str, object] | BadValue:
        """Values by field, or why they are not of the type."""
        try:
            return fields_from_tree(message_type, values, now_s=self._clock.now_s, types=self._types)
        except BadValue as error:
            return error

    def _end_later(self, goal: Goal, done: Done, failure: str, reason: str) -> None:
        self._clock.post(lambda: done(ended(goal, failure, reason)))


def ended(goal: Goal, failure: str, reason: str, status: GoalStatus = GoalStatus.UNKNOWN) -> GoalResult:
    """The result of a goal that has none of its own."""
    return GoalResult(goal_id=goal.id, status=status, fields={}, failure=failure, reason=reason)


def _wire_id(goal_id: int) -> str:
    return f"goal:{goal_id}"
