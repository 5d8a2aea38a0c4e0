"""Errors of the executive."""

from __future__ import annotations

from kb.errors import ConcertmasterError


class BadRequest(ConcertmasterError):
    """A request cannot be accepted as it is; nothing was done.

    Attributes:
        culprit: The task type, argument or option at fault.
    """

    fault = "request"

    def __init__(self, culprit: str, message: str) -> None:
        self.culprit = culprit
        super().__init__(message)


class TaskRefused(ConcertmasterError):
    """A task cannot be done by this fleet; nothing has moved.

    Attributes:
        task: Name of the task.
    """

    fault = "request"

    def __init__(self, task: str, reason: str) -> None:
        self.task = task
        super().__init__(f"{task} was refused: {reason}")


class BadTrace(ConcertmasterError):
    """A file is not a trace that we can read.

    Attributes:
        line: Where, from 1.
    """

    fault = "request"

    def __init__(self, path: str, line: int, problem: str) -> None:
        self.line = line
        super().__init__(f"{path}:{line}: {problem}")
