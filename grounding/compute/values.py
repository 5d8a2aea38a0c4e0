"""Plain values: given on, and compared. What processes need that neither sense nor move, such as those of web services.

An object is a text in JSON; a key names one of its members.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping

from kb.errors import ServiceFailed

Plain = str | float | bool

_COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "less": lambda left, right: left < right,
    "at most": lambda left, right: left <= right,
    "more": lambda left, right: left > right,
    "at least": lambda left, right: left >= right,
    "equal": lambda left, right: left == right,
}


def copy(*, value: Plain, t_s: float) -> Mapping[str, object]:
    """Give a value on: the output of one process is to be that of another.

    Returns:
        `result`: the value.
    """
    return {"result": value}


def compare(
    *, left: Plain, left_key: str, comparison: str, right: Plain, right_key: str, t_s: float
) -> Mapping[str, object]:
    """Compare two numbers, or members of two objects that are numbers.

    Args:
        left_key: Name of the member of `left`; empty where that is the number itself.
        comparison: less, at most, more, at least or equal.

    Returns:
        `result`: whether it is so.

    Raises:
        ServiceFailed: BadInput: there is no such comparison, or no such number.
    """
    if comparison not in _COMPARISONS:
        raise ServiceFailed("BadInput", f"comparison is {comparison!r}; it can be {', '.join(_COMPARISONS)}")
    return {"result": _COMPARISONS[comparison](_number("left", left, left_key), _number("right", right, right_key))}


def _number(side: str, value: Plain, key: str) -> float:
    found: object = value
    if key:
        found = _member(side, str(value), key)
    elif isinstance(value, str):
        try:
            found = float(value)
        except ValueError:
            found = value
    if isinstance(found, bool) or not isinstance(found, int | float) or not math.isfinite(found):
        raise ServiceFailed("BadInput", f"{side} is {value!r}: {key or 'that'} is no number to compare")
    return found


def _member(side: str, text: str, key: str) -> object:
    try:
        whole = json.loads(text)
    except ValueError as error:
        raise ServiceFailed("BadInput", f"{side} is {text!r}, which is no JSON: {error}") from error
    if not isinstance(whole, dict) or key not in whole:
        raise ServiceFailed("BadInput", f"{side} is {text!r}, an object without {key!r}")
    return whole[key]
