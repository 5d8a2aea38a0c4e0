"""Values of frames in messages for people."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

_LONGEST = 60


def shown(value: object) -> str:
    """A value as JSON calls it, cut short if it is long, and by its kind if it is large."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, Mapping):
        return "an object"
    if isinstance(value, list):
        return "a list"
    if isinstance(value, str):
        return repr(value[:_LONGEST]) + "..." * (len(value) > _LONGEST)
    if isinstance(value, int):
        return str(value) if abs(value) < 10**20 else "a very large number"
    if isinstance(value, float | np.number):
        return str(value)
    return str(getattr(value, "__msgtype__", f"a {type(value).__name__}"))


def shortened(text: str) -> str:
    """A text of somebody else as part of a message: not longer than a line."""
    return text[:_LONGEST] + "..." * (len(text) > _LONGEST)
