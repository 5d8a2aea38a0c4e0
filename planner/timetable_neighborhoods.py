"""Neighborhoods of a solution: most tasks stay with whom they are, some may be done by others; all may be reordered.

Large-neighborhood search [Shaw 1998]: a network in which most tasks have one mode left makes a small model.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.network import Alternatives, Label, Solution, StartedStep
from planner.timetable_tasks import NEVER, Branch, Mode, done_as, edges_ms


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Doing:
    """What a solution does about a task.

    Attributes:
        edges_ms: When it comes to the edges of the mode.
    """

    task: Branch
    mode: Mode
    edges_ms: tuple[int, ...]


def doings(root: Branch, solution: Solution) -> list[Doing] | None:
    """All tasks that a solution does, as they are written; None if it is not one of this network."""
    steps = {step.id: step for step in solution.steps}
    found: list[Doing] = []
    return found if _collect(root, solution.choices, steps, found) else None


def _collect(
    branch: Branch, choices: Mapping[str, Label], steps: Mapping[str, StartedStep], found: list[Doing]
) -> bool:
    """Whether the solution does the part; what it does goes to `found`."""
    if branch.modes is not None:
        for mode in branch.modes:
            if done_as(mode, choices, steps):
                found.append(Doing(task=branch, mode=mode, edges_ms=edges_ms(mode, steps)))
                return True
        return False
    if isinstance(branch.node, Alternatives):
        before = len(found)
        for option, part in zip(branch.node.options, branch.parts, strict=True):
            if branch.node.id is None or choices.get(branch.node.id) in option.labels:
                if _collect(part, choices, steps, found):
                    return True
                del found[before:]
        return False
    return all(_collect(part, choices, steps, found) for part in branch.parts)


def neighborhood(root: Branch, done: Sequence[Doing], free: frozenset[int]) -> Branch:
    """The network in which all tasks but some (numbers in `done`) have the one mode in which they are done.

    Alternatives that are not within a task are open only as far as all that they come to is free.
    """
    kept = {id(doing.task): doing for i, doing in enumerate(done) if i not in free}
    reached = {id(doing.task) for doing in done}
    return _narrowed(root, kept, reached)


def _narrowed(branch: Branch, kept: Mapping[int, Doing], reached: set[int]) -> Branch:
    if branch.modes is not None:
        if id(branch) not in kept:
            return branch
        return replace(branch, modes=(kept[id(branch)].mode,), kept_ms=kept[id(branch)].edges_ms)
    parts = [_narrowed(part, kept, reached) for part in branch.parts]
    if isinstance(branch.node, Alternatives) and any(_has(part, kept) for part in branch.parts):
        taken = [_has(part, reached) for part in branch.parts]
        parts = [
            part if is_taken else replace(part, least_ms=NEVER) for part, is_taken in zip(parts, taken, strict=True)
        ]
    return replace(branch, parts=tuple(parts))


def _has(branch: Branch, tasks: Container[int]) -> bool:
    return id(branch) in tasks or any(_has(part, tasks) for part in branch.parts)


def pick(rng: np.random.Generator, done: Sequence[Doing], size: int) -> frozenset[int]:
    """Draw tasks to be free: those of a few robots, or about the same time, or any; `size` at most."""
    kind = rng.integers(3)
    order: list[int] = rng.permutation(len(done)).tolist()
    if kind == 0:
        robots = sorted({robot for doing in done for robot in doing.mode.robots})
        rank = {robots[r]: n for n, r in enumerate(rng.permutation(len(robots)))}
        order = sorted(order, key=lambda i: min((rank[r] for r in done[i].mode.robots), default=len(rank)))
    elif kind == 1:
        about_ms = done[order[0]].edges_ms[0]
        order = sorted(order, key=lambda i: abs(done[i].edges_ms[0] - about_ms))
    return frozenset(order[:size])
