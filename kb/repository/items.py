"""What the repository keeps: items, their versions, their files; and what can be wrong with them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import PurePosixPath

from kb.errors import ConcertmasterError

_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}/[A-Za-z0-9][A-Za-z0-9_.-]{0,127}")
_PART = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_. -]{0,127}")
_LONGEST_TEXT = 10_000


class ItemKind(StrEnum):
    """What an item is, which is checked: see kb/repository/contents.py."""

    RECIPE = "recipe"
    """How something is done: at least one composite process."""
    ROBOT = "robot"
    """A model of robots: at least one class of them."""
    OBJECT = "object"
    """A model of objects: at least one class of them."""
    ENVIRONMENT = "environment"
    """A site or part of one: at least one area or location, with its maps."""
    ONTOLOGY = "ontology"
    """Any other ontology file."""


class BadItem(ConcertmasterError):
    """What is given cannot be taken in; nothing was.

    Attributes:
        item: Its name.
    """

    fault = "request"

    def __init__(self, item: str, message: str) -> None:
        self.item = item
        super().__init__(f"{item}: {message}")


class NoSuchItem(ConcertmasterError, LookupError):
    """The repository has no such item, version or file, or none that the user may see."""

    fault = "request"


class RepositoryDamaged(ConcertmasterError):
    """What was stored has changed on the disk, or is gone."""

    fault = "world"


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """What people say of an item.

    Attributes:
        name: `namespace/name`, such as `tue/FindBoth`.
        site: Where it was made.
        author: Who made it.
        licence: An SPDX expression, such as `Apache-2.0`.
        tags: Words to find it by.
    """

    name: str
    kind: ItemKind
    site: str = ""
    author: str = ""
    licence: str = ""
    description: str = ""
    tags: tuple[str, ...] = ()

    @property
    def namespace(self) -> str:
        """The part of the name that rights are given for."""
        return self.name.partition("/")[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredFile:
    """A file of an item.

    Attributes:
        path: Where it belongs in a folder of ontologies, such as `tasks/find_both.owl`.
        sha256: Of its content, in hexadecimal digits: the name under which that is kept.
        size: In bytes.
        iri: Of the ontology; empty if it is none.
    """

    path: str
    sha256: str
    size: int
    iri: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Item:
    """One version of an item; it never changes, but may be retired.

    Attributes:
        version: Counts from 1.
        created: When it was taken in, in UTC, as ISO 8601 writes it.
        uploaded_by: The user who did it.
        files: By path.
        needs: Versions of the items whose ontologies it imports, as `namespace/name@version`, sorted.
        capabilities: Classes that its processes require of robots.
        retired: Why it is not to be used any more; None: it is.
        superseded_by: The name of the item to be used instead; empty if there is none.
    """

    about: Description
    version: int
    created: str
    uploaded_by: str
    files: tuple[StoredFile, ...]
    needs: tuple[str, ...] = ()
    capabilities: tuple[str, ...] = ()
    retired: str | None = None
    superseded_by: str = ""

    @property
    def id(self) -> str:
        """Such as `tue/FindBoth@2`."""
        return f"{self.about.name}@{self.version}"


def check_description(about: Description) -> None:
    """Check what people say of an item.

    Raises:
        BadItem: The name is none, or a text is too long or cannot be shown.
    """
    if not _NAME.fullmatch(about.name):
        told = "name items namespace/name, such as tue/FindBoth: the namespace of small letters, digits, _ and -"
        raise BadItem(repr(about.name)[:80], told)
    for text in (about.site, about.author, about.licence, about.description, *about.tags):
        if len(text) > _LONGEST_TEXT:
            raise BadItem(about.name, f"a text is longer than {_LONGEST_TEXT} characters: {text[:40]!r}...")
        if not text.replace("\n", " ").isprintable():
            raise BadItem(about.name, f"a text holds what cannot be printed: {text[:40]!r}")


def check_paths(item: str, paths: Iterable[str]) -> None:
    """Check that files stay inside the folder that they are put in, on every file system.

    Raises:
        BadItem: A path leads out, is hidden, or differs from another in nothing but capitals.
    """
    seen: dict[str, str] = {}
    for path in paths:
        parts = path.split("/")
        if not all(_PART.fullmatch(part) and not part.endswith((".", " ")) for part in parts) or len(parts) > 10:
            told = "give a path below the folder, such as tasks/find_both.owl: letters, digits and _ . - between /"
            raise BadItem(item, f"{path[:80]!r} is no place for a file; {told}")
        other = seen.setdefault(path.lower(), path)
        if other != path:
            raise BadItem(item, f"{path} and {other} are the same file to some systems; rename one")
    for path in seen:
        above = [str(p) for p in PurePosixPath(path).parents]
        if taken := [p for p in above if p in seen]:
            raise BadItem(item, f"{taken[0]} cannot be a file and a folder")
    if not seen:
        raise BadItem(item, "has no files; give at least an ontology")
