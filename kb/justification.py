"""A smallest set of axioms from which something follows, by asking about sets of axioms.

QuickXplain: Ulrich Junker, "QUICKXPLAIN: Preferred Explanations and Relaxations for Over-Constrained
Problems", AAAI 2004, algorithm 1. For k axioms out of n it asks about 2 k log2(n / k) + 2 k times at most,
each time about a smaller set, so that what the reasoner takes on the whole is taken only a few times.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

Axiom = TypeVar("Axiom")


def smallest(
    axioms: Sequence[Axiom], holds: Callable[[Sequence[Axiom]], bool], background: Sequence[Axiom]
) -> list[Axiom]:
    """A part of `axioms` with which `background` suffices, and from which nothing can be left out.

    Args:
        axioms: What to choose from; of several such parts, one with early axioms is preferred.
        holds: Whether it follows from some axioms; what follows from some, follows from more.
        background: What is taken for given.

    Returns:
        The part, in order; empty if the background alone suffices.
    """
    if not axioms or holds(background):
        return []
    return _part(axioms, holds, background)


def _part(
    axioms: Sequence[Axiom], holds: Callable[[Sequence[Axiom]], bool], background: Sequence[Axiom]
) -> list[Axiom]:
    """The same, where it is known that the background alone does not suffice, and with all axioms does."""
    if len(axioms) == 1:
        return list(axioms)
    middle = len(axioms) // 2
    first, second = axioms[:middle], axioms[middle:]
    given = [*background, *first]
    late = [] if holds(given) else _part(second, holds, given)
    given = [*background, *late]
    early = [] if late and holds(given) else _part(first, holds, given)
    return [*early, *late]
