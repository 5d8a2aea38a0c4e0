"""Plain values are given on and compared."""

from __future__ import annotations

import pytest

from grounding.compute.registry import wrong_fields
from grounding.runner import compute
from kb.errors import ServiceFailed

PRICE = '{"amount": 12.5, "currency": "USD"}'


def compare(**fields: object) -> object:
    """Ask the service."""
    given = {"left": "1", "left_key": "", "comparison": "less", "right": "2", "right_key": ""} | fields
    return compute("/compute/compare", given, t_s=0.0)["result"]


@pytest.mark.parametrize("value", ["a text", 2.5, True, ""])
def test_copy(value: object) -> None:
    """What comes out is what went in."""
    assert compute("/compute/copy", {"value": value}, t_s=0.0) == {"result": value}


@pytest.mark.parametrize(
    ("comparison", "answers"),
    [
        ("less", [True, False, False]),
        ("at most", [True, True, False]),
        ("more", [False, False, True]),
        ("at least", [False, True, True]),
        ("equal", [False, True, False]),
    ],
)
def test_comparisons(comparison: str, answers: list[bool]) -> None:
    """Each comparison of ours, below, at and above; numbers and texts of numbers alike."""
    for right in (2.0, "2"):
        assert [compare(comparison=comparison, left=left, right=right) for left in (1, 2, 3.5)] == answers


def test_members() -> None:
    """A key names a member of an object in JSON."""
    assert compare(left=PRICE, left_key="amount", right="12.6") is True
    assert compare(left=PRICE, left_key="amount", right=PRICE, right_key="amount") is False


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"comparison": "nearly"}, "it can be less, at most"),
        ({"left": "cheap"}, "left is 'cheap': that is no number to compare"),
        ({"left": True}, "no number to compare"),
        ({"right": "nan"}, "right is 'nan'"),
        ({"left": "{", "left_key": "amount"}, "which is no JSON"),
        ({"left": "[]", "left_key": "amount"}, "an object without 'amount'"),
        ({"left": PRICE, "left_key": "weight"}, "an object without 'weight'"),
        ({"left": PRICE, "left_key": "currency"}, "currency is no number to compare"),
    ],
)
def test_what_cannot_be_compared(fields: dict[str, object], says: str) -> None:
    """The failure names the side and what is wrong with it."""
    with pytest.raises(ServiceFailed, match="BadInput") as raised:
        compare(**fields)
    assert says in str(raised.value)


def test_fields_are_known() -> None:
    """A grounding with other fields is found before anything is called."""
    assert wrong_fields("/compute/copy", {"value"}) == ""
    assert "takes the fields value" in wrong_fields("/compute/copy", {"values"})
    path = {"map", "start", "goal", "scan", "radius_m", "laser_x_m", "laser_y_m", "laser_yaw_rad"}
    assert wrong_fields("/compute/path", path) == wrong_fields("/compute/path", {*path, "tolerance_m"}) == ""
    assert "tolerance_m (may be left out)" in wrong_fields("/compute/path", path - {"goal"})
