from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grounding.rosbridge.encoding import BadFrame, Limits
from grounding.rosbridge.fragments import Reassembler, split
from grounding.rosbridge.operations import Fragment

_SMALL = Limits(max_bytes=2_000, max_depth=8, max_items=100, max_objects=50, max_unfinished=2, max_fragments=10)


@settings(deadline=None, derandomize=True)
@given(st.text(min_size=1), st.integers(1, 20), st.randoms(use_true_random=False))
def test_fragments_in_any_order_are_the_text_again(text: str, size: int, random: Any) -> None:
    """Also when some come twice; the text is there with the last that was missing."""
    parts = split(text, size, "f")
    assert all(len(part.data) <= size for part in parts)
    order = parts + parts[: len(parts) // 2]
    random.shuffle(order)
    reassembler = Reassembler(Limits())
    seen: set[int] = set()
    for part in order:
        whole = reassembler.add(part, 0.0)
        seen.add(part.num)
        assert whole == (text if len(seen) == len(parts) else None)
        if whole is not None:
            break
    assert reassembler.unfinished == 0


def _part(id_: str, num: int, total: int, data: str = "x") -> Fragment:
    return Fragment(id=id_, data=data, num=num, total=total)


@pytest.mark.parametrize(
    ("parts", "reason"),
    [
        ([_part("a", 0, 2), _part("a", 1, 3)], "has total 3, was 2 before"),
        ([_part("a", 0, 2, "x"), _part("a", 0, 2, "y")], "has two different parts 0"),
        ([_part("a", 0, 11)], "makes more than 10 fragments"),
        ([_part("a", n, 10) for n in range(8)] + [_part("b", n, 10) for n in range(3)], "makes more than 10 fragments"),
        ([_part("a", 0, 2), _part("b", 0, 2), _part("c", 0, 2)], "2 fragmented texts are unfinished"),
        ([_part("a", 0, 2, "x" * 1_500), _part("b", 0, 2, "x" * 501)], "hold 2001 bytes, 2000 are allowed"),
    ],
)  # fmt: skip
def test_fragments_that_do_not_fit_or_are_too_many_are_refused(parts: list[Fragment], reason: str) -> None:
    """The last of them is refused, and what there was of its text is forgotten."""
    reassembler = Reassembler(_SMALL)
    for part in parts[:-1]:
        assert reassembler.add(part, 0.0) is None
    with pytest.raises(BadFrame, match=reason):
        reassembler.add(parts[-1], 0.0)
    assert reassembler.unfinished == len({part.id for part in parts[:-1]} - {parts[-1].id})


def test_fragments_are_forgotten_when_the_rest_does_not_come() -> None:
    """600 s after the last part that came, and not before; each part begins the wait anew."""
    reassembler = Reassembler(Limits())
    assert reassembler.add(_part("a", 0, 3), 0.0) is None
    assert reassembler.add(_part("a", 1, 3), 500.0) is None
    assert reassembler.add(_part("b", 0, 2), 1_100.0) is None
    assert reassembler.unfinished == 2
    assert reassembler.add(_part("c", 0, 2), 1_101.0) is None
    assert reassembler.unfinished == 2
    assert reassembler.add(_part("a", 2, 3), 1_102.0) is None


def test_twenty_thousand_fragments_are_put_together() -> None:
    """As many as are allowed, with the work for each that does not grow with their number."""
    text = "0123456789" * 2_000
    reassembler = Reassembler(Limits())
    parts = split(text, 1, "f")
    assert len(parts) == Limits().max_fragments
    assert [reassembler.add(part, 0.0) for part in parts][-1] == text
