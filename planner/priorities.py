"""Several requests of different priority over one fleet: none delays a more important one.

The order is lexicographic: first the requests of the highest priority end as soon as can be, then, of all
ways in which they do, those of the next, and so on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import groupby

from planner import optimizer
from planner.network import (
    Alternatives,
    AnyOrder,
    Claimed,
    Deadline,
    Held,
    Improvement,
    InSequence,
    Network,
    Node,
    SideBySide,
    Step,
    Underway,
)


def improve(
    network: Network, priority_of: Callable[[str], int], *, effort: float, stop: Callable[[], bool]
) -> Iterator[Improvement]:
    """As planner.optimizer.improve, for a network whose parts side by side belong to requests.

    A bound is one of the executions that let every more important request end as soon as it could be shown to end.

    Args:
        priority_of: Of the request that a step belongs to, by the step's id; higher is more important.
    """
    parts = network.root.parts if isinstance(network.root, SideBySide) else (network.root,)
    ranked = sorted(((priority_of(_some_id(part)), part) for part in parts if _some_id(part)), key=lambda p: -p[0])
    levels = [[part for _, part in level] for _, level in groupby(ranked, key=lambda p: p[0])]
    placed: list[Node] = []
    proven, spent = True, 0.0
    for level in levels[:-1]:
        root = SideBySide(parts=(*placed, *level))
        found = list(optimizer.improve(replace(network, root=root), effort=effort / len(levels), stop=stop))
        best = found[-1].solution if found else None
        if best is None:
            yield from found[-1:]
            return
        proven, spent = proven and found[-1].bound_ms >= best.makespan_ms, spent + found[-1].effort
        placed += [Deadline(ms=best.makespan_ms, part=part) for part in level]
    root = SideBySide(parts=(*placed, *levels[-1]))
    for one in optimizer.improve(replace(network, root=root), effort=effort / len(levels), stop=stop):
        bound_ms = one.bound_ms
        if not proven and one.solution is not None:
            bound_ms = min(bound_ms, one.solution.makespan_ms - 1)
        yield replace(one, bound_ms=bound_ms, unsolvable=one.unsolvable and proven, effort=spent + one.effort)


def _some_id(node: Node) -> str:
    """The id of a step in a part; empty if there is none."""
    match node:
        case Step(id=id_) | Underway(id=id_):
            return id_
        case Held(part=part) | Claimed(part=part) | Deadline(part=part):
            return _some_id(part)
        case Alternatives(options=options):
            return next((found for o in options if (found := _some_id(o.node))), "")
        case InSequence(parts=parts) | SideBySide(parts=parts) | AnyOrder(parts=parts):
            return next((found for part in parts if (found := _some_id(part))), "")
