"""Names that are not known, and what a person may have meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence

from kb.errors import ConcertmasterError

_MOST = 12


class UnknownName(ConcertmasterError, LookupError):
    """Nothing that is known has this name.

    Attributes:
        name: What was asked for.
    """

    fault = "request"

    def __init__(self, name: str, what: str, known: Iterable[str]) -> None:
        self.name = name
        super().__init__(f"there is no {what} {name!r}; {near(name, sorted(known))}")


def near(wrong: str, right: Sequence[str]) -> str:
    """The nearest name, or what there is: `did you mean pico_1?`."""
    found = difflib.get_close_matches(wrong, right, n=1)
    if found:
        return f"did you mean {found[0]}?"
    listed = ", ".join(right[:_MOST]) + (f" and {len(right) - _MOST} more" if len(right) > _MOST else "")
    return f"there is {listed or 'none'}"
