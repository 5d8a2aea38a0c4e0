"""How a task ended, and what it gives back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from executive.events import TaskStatus
from kb.store import Snapshot
from kb.vocabulary import Property
from planner.classical_goal import GoalPlan
from planner.plan import Plan


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskResult:
    """How a task ended.

    Attributes:
        plan: The last plan that was made; None if it never came to that.
        goal: What led to the goal, where one was asked for.
        outputs: By output of the process; where a for-each made one for each individual, by individual.
        took_s: From acceptance to the end.
    """

    status: TaskStatus
    reason: str
    plan: Plan | None
    outputs: Mapping[str, Any]
    took_s: float
    goal: GoalPlan | None = None


def outputs_of(process: str, key: str, snapshot: Snapshot, messages: Mapping[str, object]) -> dict[str, Any]:
    """What a task's process, or a recipe of it, gives back: one message, or one for each turn of a for-each.

    Args:
        key: Of the task's session: places of its messages begin with it.
        messages: All there are, by place.
    """
    outputs = dict[str, Any]()
    for parameter in snapshot.processes[process].outputs:
        whole = messages.get(f"{key}/{parameter.name}")
        turns = {}
        for place, message in sorted(messages.items()):
            match place.removeprefix(f"{key}/task/").split("/"):
                case [*recipes, _, turn, name] if name == parameter.name:
                    if all(snapshot.ontology.values(Property.REALIZES, recipe) for recipe in recipes):
                        turns[turn] = message
                case _:
                    pass
        outputs[parameter.name] = turns or whole
    return outputs
