from __future__ import annotations

import numpy as np
import pytest

from grounding.messages import planar_pose
from grounding.rosbridge.wording import shortened, shown


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (None, "null"),
        (True, "true"),
        (3, "3"),
        (-(10**19), "-10000000000000000000"),
        (10**20, "a very large number"),
        (1.5, "1.5"),
        (np.float32(1.5), "1.5"),
        ("it's", '"it\'s"'),
        ("x" * 61, "'" + "x" * 60 + "'..."),
        ({"a": 1}, "an object"),
        ([1], "a list"),
        (planar_pose(0.0, 0.0, 0.0), "geometry_msgs/msg/Pose"),
        (b"ab", "a bytes"),
        (np.zeros(3), "a ndarray"),
    ],
)
def test_values_are_shown_as_json_calls_them_and_short(value: object, words: str) -> None:
    """Numbers and texts as they are, large things by their kind."""
    assert shown(value) == words


def test_long_texts_are_cut() -> None:
    """After sixty characters, visibly."""
    assert shortened("x" * 60) == "x" * 60
    assert shortened("x" * 61) == "x" * 60 + "..."
