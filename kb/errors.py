"""The one error tree: every error we raise on purpose is a ConcertmasterError.

Outcomes (no plan, a robot refused, a call timed out) are values, not exceptions. An exception says
that a request, a file, the world or our own code broke a promise; `fault` says which.
"""

from __future__ import annotations

from typing import ClassVar, Literal

Fault = Literal["request", "knowledge", "world", "us"]


class ConcertmasterError(Exception):
    """Root of all our errors. `str(error)` is one message for a person."""

    fault: ClassVar[Fault] = "us"


class KnowledgeError(ConcertmasterError):
    """An ontology file, or a term asked of the knowledge base, is wrong."""

    fault = "knowledge"


class InternalError(ConcertmasterError):
    """Our own mistake: never expected, always worth a report."""


class DependencyMissing(ConcertmasterError):
    """Something that has to be installed is not."""

    fault = "world"


class ServiceFailed(ConcertmasterError):
    """A service did not do what it was asked to.

    Attributes:
        code: Name of the failure class, such as `NoPath`.
        message: What is wrong, where, and what would be right.
    """

    fault: ClassVar[Fault] = "world"

    def __init__(self, code: str, message: str) -> None:
        super().__init__(code, message)
        self.code = code
        self.message = message

    def __str__(self) -> str:
        return f"{self.code}: {self.message}"
