"""Long-running work: goals, how far they have come, and how they ended (ROS actions)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

from grounding.topics import TopicTransport


class GoalStatus(IntEnum):
    """Where a goal is in its life, in the numbers of `action_msgs/GoalStatus`."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """What an action shall bring about.

    Attributes:
        id: Never used again, as that of a call.
        action: Full name, such as `/amigo_1/navigate_to_pose`.
        fields: Messages and plain values by field name.
    """

    id: int
    action: str
    fields: Mapping[str, object]


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalResult:
    """How a goal ended.

    Attributes:
        status: SUCCEEDED, CANCELED or ABORTED; UNKNOWN where nothing is heard of it any more.
        fields: Messages and plain values by field name; a goal that was canceled or aborted may have some too.
        failure: Class of failure, such as `Canceled`; empty if it succeeded.
        reason: In a sentence; empty if it succeeded.
    """

    goal_id: int
    status: GoalStatus
    fields: Mapping[str, object]
    failure: str
    reason: str


class ActionTransport(Protocol):
    """Carries goals to actions.

    `send_goal` returns at once; feedback and, exactly once and last, the result come later, on the clock's thread. A
    goal whose connection is gone ends in the failure `Lost`.
    """

    def send_goal(
        self, goal: Goal, feedback: Callable[[Mapping[str, object]], None], done: Callable[[GoalResult], None]
    ) -> None:
        """Send a goal."""

    def cancel_goal(self, goal_id: int) -> None:
        """Ask for the end of a goal, which still has a result; one that has ended already is left alone."""


class Carrier(TopicTransport, ActionTransport, Protocol):
    """Carries all: calls to services, goals to actions, and what is said on topics."""


class GoalHandle(Protocol):
    """A goal as who carries it out sees it.

    Attributes:
        fields: Of the goal: messages and plain values.
        canceled: Called when the goal is not wanted any more; it then ends by `end`, mostly as CANCELED.
    """

    fields: Mapping[str, object]
    canceled: Callable[[], None]

    def feed(self, fields: Mapping[str, object]) -> None:
        """Tell how far it has come; nothing happens if it has ended."""

    def end(self, status: GoalStatus, fields: Mapping[str, object], reason: str = "") -> None:
        """Tell how it ended; nothing happens if it has ended before.

        Args:
            status: SUCCEEDED, CANCELED or ABORTED.
            reason: Why it was aborted, in a sentence.
        """


Start = Callable[[GoalHandle], None]
"""Begins to carry out a goal; raises ServiceFailed if it does not."""


def result_of(
    goal_id: int, action: str, status: GoalStatus, fields: Mapping[str, object], reason: str = ""
) -> GoalResult:
    """The result of a goal whose action has told its status."""
    failure, told = {
        GoalStatus.SUCCEEDED: ("", ""),
        GoalStatus.CANCELED: ("Canceled", f"{action} was canceled"),
    }.get(status, ("GoalFailed", reason or f"{action} ended with status {status.value}, {status.name}"))
    return GoalResult(goal_id=goal_id, status=status, fields=fields, failure=failure, reason=told)
