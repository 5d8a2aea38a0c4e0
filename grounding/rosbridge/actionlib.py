"""The messages by which ROS 1 carries actions: goals, results and feedback are topics there.

An action `pkg/Move` of ROS 1 is the topics `goal`, `cancel`, `status`, `feedback` and `result` below its name, with the
messages `pkg/MoveActionGoal`, `pkg/MoveActionFeedback` and `pkg/MoveActionResult` around the parts of its type
(actionlib's genaction).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rosbags.typesys import get_types_from_msg

_AROUND = {
    "ActionGoal": "std_msgs/Header header\nactionlib_msgs/GoalID goal_id\n{name}Goal goal\n",
    "ActionResult": "std_msgs/Header header\nactionlib_msgs/GoalStatus status\n{name}Result result\n",
    "ActionFeedback": "std_msgs/Header header\nactionlib_msgs/GoalStatus status\n{name}Feedback feedback\n",
    "Action": "{name}ActionGoal action_goal\n{name}ActionResult action_result\n{name}ActionFeedback action_feedback\n",
}


def messages_of(action: str, parts: Mapping[str, Any]) -> dict[str, Any]:
    """Definitions of the seven messages of an action in ROS 1.

    Args:
        action: Full name, such as `move_base_msgs/action/MoveBase`.
        parts: Definitions as rosbags has them, of `<action>_Goal`, `_Result` and `_Feedback` among others.
    """
    package, _, simple = action.split("/")
    found = {f"{package}/msg/{simple}{part}": parts[f"{action}_{part}"] for part in ("Goal", "Result", "Feedback")}
    for suffix, text in _AROUND.items():
        found |= get_types_from_msg(text.format(name=f"{package}/{simple}"), f"{package}/msg/{simple}{suffix}")
    return found
