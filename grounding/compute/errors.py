"""Why a compute service could not do its job."""

from __future__ import annotations

import pathlib
from typing import ClassVar, Literal

from kb.errors import Fault, ServiceFailed

Code = Literal["NoPath", "NotLocalized", "ObjectNotFound", "BadInput"]


class ComputeFailed(ServiceFailed):
    """A compute service has no result; the executive makes an outcome with failure class `code` of it.

    Args:
        code: `NoPath` (no way to the goal), `NotLocalized` (the scan does not fit the map), `ObjectNotFound`
            (it is not in the picture), `BadInput` (a request field or a file it names is wrong).
        message: What is wrong, where, and what would be right.
    """

    def __init__(self, code: Code, message: str) -> None:
        super().__init__(code, message)


class MapFileError(ComputeFailed):
    """A file of a map cannot be used.

    Attributes:
        file: The file to mend.
        field: The field, or the part of the file, that is wrong.
        problem: What is wrong with it and what would be right.
    """

    fault: ClassVar[Fault] = "knowledge"

    def __init__(self, file: pathlib.Path, field: str, problem: str) -> None:
        super().__init__("BadInput", f"map file {file}, {field}: {problem}")
        self.args = (file, field, problem)  # what pickle makes it again from, on its way out of a worker process
        self.file = file
        self.field = field
        self.problem = problem
