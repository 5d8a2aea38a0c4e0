"""Errors of grounding."""

from __future__ import annotations

from kb.errors import ConcertmasterError


class GroundingError(ConcertmasterError):
    """An action cannot be turned into a service call, or a reply does not hold what its grounding says.

    Attributes:
        process: The atomic process.
        field: The field at fault.
    """

    fault = "knowledge"

    def __init__(self, process: str, field: str, problem: str) -> None:
        self.process, self.field = process, field
        super().__init__(f"{process}, field {field}: {problem}")
