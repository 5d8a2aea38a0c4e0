"""Steps with ordering constraints -> layers, one after the other, each in any order."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter


@dataclass(frozen=True, slots=True, kw_only=True)
class Arranged:
    """Steps in layers.

    Attributes:
        added: Pairs in order that no constraint asked for: layers cannot say every partial order.
        cycle: Steps whose constraints contradict each other; then there is one layer, as if there were none.
    """

    layers: list[list[str]]
    added: list[tuple[str, str]]
    cycle: list[str]


def arrange(steps: Sequence[str], before: Collection[tuple[str, str]]) -> Arranged:
    """Put each step into the first layer after all that must come before it.

    Args:
        steps: Each once; steps of one layer keep this order.
        before: Pairs of steps, the earlier one first.
    """
    sorter: TopologicalSorter[str] = TopologicalSorter({s: [a for a, b in before if b == s] for s in steps})
    layers: list[list[str]] = []
    try:
        sorter.prepare()
    except CycleError as error:
        return Arranged(layers=[list(steps)], added=[], cycle=list(reversed(error.args[1])))
    while sorter.is_active():
        ready = sorter.get_ready()
        layers.append([s for s in steps if s in ready])
        sorter.done(*ready)
    asked = _closure(steps, before)
    pairs = [(a, b) for n, layer in enumerate(layers) for a in layer for later in layers[n + 1 :] for b in later]
    return Arranged(layers=layers, added=[p for p in pairs if p not in asked], cycle=[])


def _closure(steps: Sequence[str], before: Collection[tuple[str, str]]) -> set[tuple[str, str]]:
    closed = set(before)
    for middle in steps:  # Warshall, "A theorem on Boolean matrices", JACM 1962
        closed |= {(a, b) for a, m in closed if m == middle for n, b in closed if n == middle}
    return closed
