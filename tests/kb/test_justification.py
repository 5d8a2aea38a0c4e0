from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st

from kb.justification import smallest

AXIOMS = st.integers(1, 60).flatmap(
    lambda n: st.tuples(
        st.just(list(range(n))),
        st.lists(st.sets(st.integers(0, n - 1), min_size=1, max_size=6), min_size=1, max_size=4),
    )
)


@given(AXIOMS)
def test_a_part_suffices_and_nothing_can_be_left_out(case: tuple[list[int], list[set[int]]]) -> None:
    """What is found is one of the sets from which it follows, and no larger."""
    axioms, reasons = case

    def holds(some: Sequence[int]) -> bool:
        return any(reason <= set(some) for reason in reasons)

    found = smallest(axioms, holds, [])
    assert holds(found)
    assert found == sorted(found)
    assert not any(holds([a for a in found if a != left_out]) for left_out in found)


def test_what_is_given_is_not_found() -> None:
    """The background counts, and is no part of the answer."""
    assert smallest([1, 2, 3], lambda some: {0, 2} <= set(some), [0]) == [2]
    assert smallest([1, 2, 3], lambda some: 0 in some, [0]) == []


def test_few_questions_are_asked() -> None:
    """Of 1,000 axioms, 4 are found by fewer than 60 questions."""
    asked = []

    def holds(some: Sequence[int]) -> bool:
        asked.append(len(some))
        return {7, 300, 301, 999} <= set(some)

    assert smallest(range(1000), holds, []) == [7, 300, 301, 999]
    assert len(asked) < 2 * 4 * 8 + 2 * 4
