"""What is wrong with ontology files, said so that a person can mend it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

from kb.errors import KnowledgeError


class Severity(StrEnum):
    """How much a problem matters."""

    ERROR = "error"
    """The files cannot be used."""
    WARNING = "warning"
    """They can, but probably do not say what was meant."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """One thing that is wrong: where, what, and what would be right.

    Attributes:
        line: Where the entity is described, from 1; 0 where that is not known.
        entity: Its name; empty if it is the file itself.
    """

    code: str
    file: Path
    line: int
    entity: str
    message: str
    severity: Severity = Severity.ERROR

    def __str__(self) -> str:
        where = f"{self.file}:{self.line}" if self.line else str(self.file)
        subject = f" {self.entity}:" if self.entity else ""
        return f"{where} {self.code} {self.severity}{subject} {self.message}"


class OntologyRejected(KnowledgeError):
    """Ontology files are wrong; nothing was loaded.

    Attributes:
        problems: Everything that was found, warnings too, each once, in order of file and line.
    """

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = in_order(problems)
        super().__init__("\n".join(map(str, self.problems)))


def in_order(problems: Iterable[Problem]) -> list[Problem]:
    """Each problem once, in order of file and line."""
    return sorted(set(problems), key=lambda p: (str(p.file), p.line, p.code, p.entity, p.message))


def errors(problems: Iterable[Problem]) -> list[Problem]:
    """The problems for which files cannot be used."""
    return [p for p in problems if p.severity is Severity.ERROR]


def reject_errors(problems: Iterable[Problem]) -> None:
    """Go on where there is nothing worse than warnings.

    Raises:
        OntologyRejected: There is an error; with the warnings beside it.
    """
    found = list(problems)
    if errors(found):
        raise OntologyRejected(found)


def warn(problem: Problem) -> Problem:
    """The same as a warning."""
    return replace(problem, severity=Severity.WARNING)
