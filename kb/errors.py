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


class BadFile(ConcertmasterError):
    """A file of settings, of a scenario or the like is wrong.

    Args:
        file: The file at fault.
        field: Dotted path of the field at fault, such as `robots.amigo_1.model`.
        problem: What is wrong and what would be right.
    """

    fault = "request"

    def __init__(self, file: str, field: str, problem: str) -> None:
        super().__init__(f"{file}: {field}: {problem}")
        self.file = file
        self.field = field
        self.problem = problem


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
