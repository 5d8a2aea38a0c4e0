"""How many bytes messages hold."""

from __future__ import annotations

import numpy as np
import pytest

from grounding.messages import pose_stamped
from grounding.sizes import payload_bytes


@pytest.mark.parametrize(
    ("value", "size"),
    [
        (None, 0),
        (True, 1),
        (7, 8),
        (0.5, 8),
        ("b\u00f6g", 4),
        (b"abc", 3),
        (np.zeros((4, 5), dtype=np.float32), 80),
        ([1, 2.0, "x"], 17),
        ({"a": 1, "b": [True]}, 9),
    ],
)
def test_what_counts_how_much(value: object, size: int) -> None:
    """Numbers, texts, arrays, and what is made of them."""
    assert payload_bytes(value) == size


def test_a_message_is_the_sum_of_its_fields() -> None:
    """A stamp of two numbers, the frame, a position of three, an orientation of four."""
    assert payload_bytes(pose_stamped(1.0, 2.0, 0.5, t_s=3.0)) == 9 * 8 + len("map")


def test_what_is_no_message_is_refused() -> None:
    """It would not get over any transport."""
    with pytest.raises(TypeError, match="no message: object"):
        payload_bytes(object())
