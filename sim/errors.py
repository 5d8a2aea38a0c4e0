"""What can go wrong in the simulator."""

from __future__ import annotations

from kb.errors import ConcertmasterError, ServiceFailed


class BadScenario(ConcertmasterError):
    """A scenario, world or model file is wrong, or does not fit where the robots are told to stand.

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


class ServiceRefused(ServiceFailed):
    """A robot does not do what it is asked, because the request is wrong.

    Args:
        code: `BadRequest` (a field is missing, unknown or has no usable value) or `Closed` (the simulator ended).
        message: What is wrong and what would be right.
    """

    fault = "request"
