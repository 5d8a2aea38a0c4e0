"""What is wrong with ontology files, said so that a person can mend it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from kb.errors import KnowledgeError


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """One thing that is wrong: where, what, and what would be right."""

    code: str
    file: Path
    line: int
    entity: str
    message: str

    def __str__(self) -> str:
        where = f"{self.file}:{self.line}" if self.line else str(self.file)
        subject = f" {self.entity}:" if self.entity else ""
        return f"{where} {self.code} error{subject} {self.message}"


class OntologyRejected(KnowledgeError):
    """Ontology files are wrong; nothing was loaded.

    Attributes:
        problems: Everything that was found, each once, in order of file and line.
    """

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = sorted(set(problems), key=lambda p: (str(p.file), p.line, p.code, p.entity, p.message))
        super().__init__("\n".join(map(str, self.problems)))
