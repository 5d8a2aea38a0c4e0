"""The processes of the ontology (fleet_ontology.py) as acts."""

from __future__ import annotations

from collections.abc import Iterable

from tests.benchmarks.fleets import COLLECT, FIND, LEAVE, RETURN, SERVE, Act

_ACTS = {"DetectByKinect": FIND, "DetectByColor": FIND, "Grasp": COLLECT, "PutDown": SERVE}
PASS = "PassDoor"


def acts(steps: Iterable[tuple[float, str, str, str]]) -> list[Act]:
    """Acts of steps, each (start, process, robot, and drink or other object), in order of start.

    To drive is part of the act whose robot then looks, grasps or puts down.
    """
    found: list[Act] = []
    fetches: dict[int, int] = {}
    """By robot, the drink that it has grasped last."""
    left: set[int] = set()
    for _, process, robot_name, object_name in sorted(steps):
        robot = _number(robot_name)
        if process == PASS:
            found.append((RETURN if robot in left else LEAVE, robot, fetches[robot]))
            left ^= {robot}
        elif process in _ACTS:
            drink = fetches[robot] = _number(object_name)
            found.append((_ACTS[process], robot, drink))
    return found


def _number(name: str) -> int:
    return int(name.rpartition("_")[2]) - 1
