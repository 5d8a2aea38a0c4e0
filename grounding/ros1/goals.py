"""Goals of actions in ROS 1: actionlib's protocol, which is five topics below the name of an action.

A goal is sent once an action server hears it and is heard. It is over with its result, which carries its status; it is
lost if for some seconds the server does not list it among the goals that it knows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from grounding.actions import Goal, GoalResult, GoalStatus
from grounding.ros1.node import Node
from grounding.ros1.topics import Newest, Topics
from grounding.ros1.wire import Wire
from grounding.rosbridge.calls import coded
from grounding.rosbridge.dropped import Dropped
from grounding.rosbridge.goals import Done, Feedback, ended
from grounding.rosbridge.types import ActionType, Types, UnknownType
from grounding.rosbridge.values import BadValue, fields_to_tree
from kb.clock import Callback, WallClock

FIND_S = 5.0
LOST_S = 5.0
"""Action servers list their goals five times a second, and keep those that have ended for five seconds."""

_LOOK_S = 0.05
_HEARD = ("status", "feedback", "result")
_SPOKEN = ("goal", "cancel")

_ENDS: Mapping[int, tuple[GoalStatus, str]] = {
    2: (GoalStatus.CANCELED, "Canceled"),  # PREEMPTED
    3: (GoalStatus.SUCCEEDED, ""),
    4: (GoalStatus.ABORTED, "GoalFailed"),
    5: (GoalStatus.ABORTED, "Busy"),  # REJECTED
    8: (GoalStatus.CANCELED, "Canceled"),  # RECALLED
    9: (GoalStatus.UNKNOWN, "Lost"),
}
"""By `actionlib_msgs/GoalStatus`: how a goal ended, and the failure if the action does not name one."""


@dataclass(slots=True)
class _Open:
    goal: Goal
    data: bytes
    feedback: Feedback
    done: Done
    stop_listening: Callback
    due_s: float
    sent: bool = False


class Goals:
    """Sends goals and knows which are open; all on the clock's thread.

    Args:
        actions: The types of the actions, by their full names.
        dropped: Told of messages that cannot be read.
    """

    def __init__(
        self,
        node: Node,
        topics: Topics,
        clock: WallClock,
        actions: Mapping[str, ActionType],
        types: Types,
        wire: Wire,
        dropped: Dropped,
    ) -> None:
        self._node, self._topics, self._clock, self._actions = node, topics, clock, actions
        self._types, self._wire, self._dropped = types, wire, dropped
        self._open: dict[str, _Open] = {}
        self._wrappers: dict[str, Mapping[str, str]] = {}
        self._statuses: dict[str, Newest] = {}

    def send_goal(self, goal: Goal, feedback: Feedback, done: Done) -> None:
        """Send a goal; see `ActionTransport`."""
        action_type = self._actions.get(goal.action)
        if action_type is None:
            known = ", ".join(sorted(self._actions)) or "none"
            told = f"there is no action {goal.action}; there is {known}"
            self._clock.post(lambda: done(ended(goal, "NoSuchAction", told)))
            return
        if not self._node.connected and goal.action not in self._wrappers:
            problem = self._node.problem
            self._clock.post(lambda: done(ended(goal, "Lost", problem)))
            return
        wire_id = self._wire_id(goal.id)
        try:
            self._attend(goal.action, action_type)
            fields = fields_to_tree(action_type.goal, goal.fields, numbers="exact", types=self._types)
            tree = {"goal_id": {"id": wire_id}, "goal": fields}
            data = self._wire.encode_tree(self._wrappers[goal.action]["goal"], tree)
        except (BadValue, UnknownType) as error:
            problem = f"{goal.action}: {error}"
            self._clock.post(lambda: done(ended(goal, "BadRequest", problem)))
            return
        stop_listening, due_s = self._clock.listen(), self._clock.now_s + FIND_S
        self._open[wire_id] = _Open(goal, data, feedback, done, stop_listening, due_s)
        self._look(wire_id)

    def cancel_goal(self, goal_id: int) -> None:
        """Ask for the end of a goal; one that no server has got yet is over."""
        wire_id = self._wire_id(goal_id)
        opened = self._open.get(wire_id)
        if opened is None:
            return
        action = opened.goal.action
        if opened.sent:
            data = self._wire.encode_tree(self._wrappers[action]["cancel"], {"id": wire_id})
            self._topics.speak(f"{action}/cancel", data)
        else:
            reason = f"{action} was canceled before it began"
            self._clock.post(lambda: self._end(wire_id, "Canceled", reason, GoalStatus.CANCELED))

    def lose(self, reason: str) -> None:
        """End all open goals."""
        for wire_id in list(self._open):
            self._end(wire_id, "Lost", reason)

    def _wire_id(self, goal_id: int) -> str:
        """Goals of all clients go over the same topics, so it begins with the name of this node."""
        return f"{self._node.name}-{goal_id}"

    def _attend(self, action: str, action_type: ActionType) -> None:
        """Hear and speak on the topics of an action from its first goal on."""
        if action in self._wrappers:
            return
        wrappers = self._wire.wrappers(action_type)
        status = Newest(self._clock, self._read(wrappers["status"], self._take_status))
        feedback = self._read(wrappers["feedback"], partial(self._take_feedback, action_type))
        result = self._read(wrappers["result"], partial(self._take_result, action_type))
        takes: Mapping[str, Callable[[Any], None]] = {
            "status": status,
            "feedback": lambda raw: self._clock.post(lambda: feedback(raw.data)),
            "result": lambda raw: self._clock.post(lambda: result(raw.data)),
        }
        for part in _HEARD:
            self._topics.hear(f"{action}/{part}", wrappers[part], takes[part])
        for part in _SPOKEN:
            self._topics.advertise(f"{action}/{part}", wrappers[part], latch=False)
        self._wrappers[action], self._statuses[action] = wrappers, status

    def _read(self, message_type: str, take: Callable[[Any], None]) -> Callable[[bytes], None]:
        def read(data: bytes) -> None:
            try:
                message = self._wire.decode(message_type, data)
            except BadValue as error:
                self._dropped.note(f"message of an action: {error}")
            else:
                take(message)

        return read

    def _look(self, wire_id: str) -> None:
        """Send a goal when there is a server, and end it when there is none, or none any more."""
        opened = self._open.get(wire_id)
        if opened is None:
            return
        action, now_s = opened.goal.action, self._clock.now_s
        self._statuses[action].hand_over()  # what came while the clock stood still counts
        if not opened.sent and all(self._topics.partners(f"{action}/{part}") for part in (*_HEARD, *_SPOKEN)):
            opened.sent, opened.due_s = self._topics.speak(f"{action}/goal", opened.data), now_s + LOST_S
        elif now_s >= opened.due_s and opened.sent:
            self._end(wire_id, "Lost", f"{action} has told nothing of the goal for {LOST_S:g} s")
            return
        elif now_s >= opened.due_s:
            self._end(wire_id, "NoSuchAction", f"there is no action {action}: no server for it came in {FIND_S:g} s")
            return
        self._clock.call_at(now_s + _LOOK_S, lambda: self._look(wire_id))

    def _take_status(self, message: Any) -> None:
        for status in message.status_list:
            opened = self._open.get(status.goal_id.id)
            if opened is not None:
                opened.due_s = self._clock.now_s + LOST_S

    def _take_feedback(self, action_type: ActionType, message: Any) -> None:
        opened = self._open.get(message.status.goal_id.id)
        if opened is not None:
            opened.feedback(self._wire.values(action_type.feedback, message.feedback))

    def _take_result(self, action_type: ActionType, message: Any) -> None:
        opened = self._open.pop(message.status.goal_id.id, None)
        if opened is None:
            return  # that of another client's goal
        opened.stop_listening()
        number, text = int(message.status.status), str(message.status.text)
        status, failure = _ENDS.get(number, (GoalStatus.UNKNOWN, "GoalFailed"))
        reason = text or f"{opened.goal.action} ended with actionlib's status {number}"
        if status is GoalStatus.ABORTED and coded(text)[0] != "ServiceError":
            failure, reason = coded(text)
        fields = self._wire.values(action_type.result, message.result)
        opened.done(
            GoalResult(
                goal_id=opened.goal.id,
                status=status,
                fields=fields,
                failure=failure,
                reason=reason if failure else "",
            )
        )

    def _end(self, wire_id: str, failure: str, reason: str, status: GoalStatus = GoalStatus.UNKNOWN) -> None:
        opened = self._open.pop(wire_id, None)
        if opened is not None:
            opened.stop_listening()
            opened.done(ended(opened.goal, failure, reason, status))
