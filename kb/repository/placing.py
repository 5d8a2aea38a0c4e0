"""Files of items into a folder of ontologies: whole or not at all, and never over somebody's own."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from kb.parsing import header_iri
from kb.repository.blobs import Blobs
from kb.repository.items import BadItem, Item, StoredFile


@dataclass(frozen=True, slots=True, kw_only=True)
class Placed:
    """What came of a download.

    Attributes:
        items: What was asked for and what it needs, as `namespace/name@version`.
        written: The new files.
        kept: Files that were there before, and stay as they are.
    """

    items: tuple[str, ...]
    written: tuple[Path, ...]
    kept: tuple[Path, ...]


def place_new(folder: Path, asked: Item, needed: Iterable[Item], blobs: Blobs) -> Placed:
    """Make a folder of the files of items.

    Raises:
        BadItem: Two items have different files of one path.
    """
    items = [asked, *needed]
    files: dict[str, StoredFile] = {}
    for item in items:
        for file in item.files:
            if files.setdefault(file.path, file).sha256 != file.sha256:
                told = f"{file.path} is another file in another of the items that {asked.id} needs"
                raise BadItem(item.id, f"{told}; download them into folders of their own")
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}.") as temporary:
        whole = Path(temporary) / "whole"
        for path, file in files.items():
            (whole / path).parent.mkdir(parents=True, exist_ok=True)
            blobs.copy(file.sha256, whole / path)
        whole.rename(folder)
    return Placed(
        items=tuple(item.id for item in items), written=tuple(folder / path for path in sorted(files)), kept=()
    )


def place_into(folder: Path, asked: Item, needed: Iterable[Item], blobs: Blobs) -> Placed:
    """Put the files of items into a folder beside what is there.

    Raises:
        BadItem: A file that was asked for is in the way of another, or would come to stand outside the folder.
    """
    items = [asked, *needed]
    there = {iri: path for path in sorted(folder.rglob("*.owl")) if (iri := header_iri(path))}
    new: dict[Path, StoredFile] = {}
    kept: set[Path] = set()
    for item in items:
        for file in item.files:
            target = folder / file.path
            if not target.resolve().is_relative_to(folder.resolve()):
                raise BadItem(item.id, f"{file.path} would stand outside of {folder}: a link leads there")
            present = target if target.exists() else there.get(file.iri) if file.iri else None
            if present is None:
                new.setdefault(target, file)
            elif item is not asked or _hash(present) == file.sha256:
                kept.add(present)
            else:
                told = f"{present} is in the way of {file.path}, which is another file"
                raise BadItem(item.id, f"{told}; move it, or download into a new folder")
    with ExitStack() as undo:
        temporary = Path(undo.enter_context(tempfile.TemporaryDirectory(dir=folder, prefix=".download.")))
        for number, file in enumerate(new.values()):
            blobs.copy(file.sha256, temporary / str(number))
        with ExitStack() as placing:
            for number, target in enumerate(new):
                target.parent.mkdir(parents=True, exist_ok=True)
                os.link(temporary / str(number), target)  # fails if a file has come there meanwhile
                placing.callback(target.unlink)
            placing.pop_all()
    return Placed(items=tuple(item.id for item in items), written=tuple(sorted(new)), kept=tuple(sorted(kept)))


def _hash(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
