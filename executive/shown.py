"""How messages and reasons are shown in traces and results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from grounding.messages import PointStamped, PoseStamped, xyyaw
from kb.store import Snapshot
from kb.vocabulary import Property
from planner.progress import Exclusion


def lacking(exclusions: Sequence[Exclusion], snapshot: Snapshot) -> tuple[str, ...]:
    """Which robots lack what for which processes, a sentence for each robot and capability; and which do not answer."""
    processes: dict[tuple[str, str], list[str]] = {}
    silent = sorted({excluded.robot for excluded in exclusions if excluded.capability == Property.IS_REACHABLE})
    for excluded in exclusions:
        if excluded.robot in silent:
            continue
        processes.setdefault((excluded.robot, excluded.capability), []).append(excluded.process)
    sentences = [f"{robot} does not answer" for robot in silent]
    for (robot, capability), names in sorted(processes.items()):
        means = snapshot.ontology.definition(capability)
        told = f" ({means})" if means else ""
        sentences.append(f"{robot} cannot do {' or '.join(sorted(names))}: it is no {capability}{told}")
    return tuple(sentences)


def shown(message: object) -> bool | list[float] | None:
    """A message as the trace shows it, if it does."""
    match message:
        case bool():
            return message
        case PoseStamped():
            return [round(v, 6) for v in xyyaw(message.pose)]
        case PointStamped():
            return [round(v, 6) for v in (message.point.x, message.point.y, message.point.z)]
        case _:
            return None


def shown_output(value: Any) -> Any:
    """The same for the output of a task: a message, or one for each individual."""
    return {name: shown(v) for name, v in value.items()} if isinstance(value, dict) else shown(value)
