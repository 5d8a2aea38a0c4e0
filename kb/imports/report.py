"""What became of a file of others: the ontology file that we made of it, and what a person has to know of that."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from kb.errors import KnowledgeError
from kb.writing import Entity, ontology_text


class Fate(StrEnum):
    """What happened to something on its way into our model."""

    LEFT_OUT = "left out"
    """It is in the source, and not in the result."""
    CHANGED = "changed"
    """It is in the result in another form."""
    ASSUMED = "assumed"
    """It is not in the source; the result needs it, so it was added. To be reviewed."""
    GUESSED = "guessed"
    """The source only hints at it, by a name. To be reviewed first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Note:
    """One thing that is not the same in the result.

    Attributes:
        file: Name of the source file, without its folder.
        line: Where the entity is described; 0 if that is not known.
        entity: Its name in the source.
    """

    file: str
    line: int
    entity: str
    fate: Fate
    message: str

    def __str__(self) -> str:
        where = f"{self.file}:{self.line}" if self.line else self.file
        return f"{where} {self.fate}: {self.entity}: {self.message}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Imported:
    """A file of others in our form.

    Attributes:
        iri: Of the ontology that it became.
        entities: All that it declares.
        comments: What the ontology says of itself: where it came from.
        imports: IRIs of the ontologies that it needs.
        notes: What is not the same, in order of file and line.
    """

    iri: str
    entities: tuple[Entity, ...]
    imports: tuple[str, ...]
    comments: tuple[str, ...]
    label: str
    notes: tuple[Note, ...]

    @property
    def text(self) -> str:
        """The ontology file, RDF/XML."""
        return ontology_text(self.iri, self.entities, imports=self.imports, comments=self.comments, label=self.label)


class NotImportable(KnowledgeError):
    """A file of others is not what it was said to be, or broken.

    Attributes:
        file: Its name.
        line: Where, as far as that is known; 0 if not.
    """

    def __init__(self, file: Path, line: int, message: str) -> None:
        self.file, self.line = file, line
        where = f"{file}:{line}" if line else str(file)
        super().__init__(f"{where} {message}")


def in_order(notes: list[Note]) -> tuple[Note, ...]:
    """Each note once, in order of file and line."""
    return tuple(sorted(set(notes), key=lambda n: (n.file, n.line, n.entity, n.fate, n.message)))
