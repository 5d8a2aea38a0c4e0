"""Contents of files, each kept once, under its SHA-256.

A content is written to a folder of its own below `incoming/`, which the writer keeps locked, and moved to its
place when it is whole. What a killed writer leaves is not locked any more, and swept out by the next.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path
from typing import BinaryIO

from kb.repository.items import BadItem, RepositoryDamaged

_PIECE = 1 << 20
_LOCK = ".lock"
_HEALED_BY = "upload the same again, or bring it back from a copy of the repository"


@dataclass(frozen=True, slots=True, kw_only=True)
class Staged:
    """A content that was written but does not belong to the repository yet."""

    path: Path
    sha256: str
    size: int


class Blobs:
    """A folder of contents."""

    def __init__(self, folder: Path) -> None:
        self._blobs, self._incoming = folder / "blobs", folder / "incoming"
        self._blobs.mkdir(parents=True, exist_ok=True)
        self._incoming.mkdir(exist_ok=True)

    @contextmanager
    def staging(self) -> Iterator[Path]:
        """A folder to write to; it is gone afterwards, also after a crash of ours, when the next one writes."""
        self._sweep()
        with ExitStack() as leaving:
            folder = self._locked(leaving)
            leaving.callback(shutil.rmtree, folder)
            yield folder

    def _locked(self, leaving: ExitStack) -> Path:
        """A new folder that nobody else sweeps until `leaving`."""
        while True:
            folder = Path(tempfile.mkdtemp(dir=self._incoming))
            lock = (folder / _LOCK).open("wb")
            fcntl.flock(lock, fcntl.LOCK_EX)
            if (folder / _LOCK).exists():
                leaving.enter_context(lock)
                return folder
            lock.close()  # swept between its making and its locking

    def _sweep(self) -> None:
        for folder in self._incoming.iterdir():
            try:
                with (folder / _LOCK).open("rb") as lock:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(folder, ignore_errors=True)
            except (BlockingIOError, FileNotFoundError):
                continue  # somebody is writing, about to write, or sweeping

    def keep(self, staged: Staged) -> None:
        """Move a content to its place, if it is not there already; in place of what has been damaged there, too."""
        place = self._place(staged.sha256)
        if place.exists() and _sha256_of(place) == staged.sha256:
            return
        if not place.parent.exists():
            place.parent.mkdir(exist_ok=True)
            _sync_folder(self._blobs)
        staged.path.chmod(0o444)
        staged.path.replace(place)
        _sync_folder(place.parent)

    def open(self, sha256: str) -> BinaryIO:
        """A content, to read.

        Raises:
            RepositoryDamaged: It is gone, or is not what it was.
        """
        stream = self._found(sha256)
        if (found := hashlib.file_digest(stream, "sha256").hexdigest()) != sha256:
            stream.close()
            raise self._changed(sha256, found)
        stream.seek(0)
        return stream

    def copy(self, sha256: str, to: Path) -> None:
        """Write a content to a new file.

        Raises:
            RepositoryDamaged: It is gone, or is not what it was.
        """
        with self._found(sha256) as stream:
            found = write_hashed(stream, to, limit=None, item=sha256)
        if found.sha256 != sha256:
            to.unlink()
            raise self._changed(sha256, found.sha256)

    def drop_all_but(self, needed: Iterable[str]) -> int:
        """Take away contents that nothing needs; returns how many. Nothing may be kept meanwhile."""
        kept = set(needed)
        unneeded = [p for p in self._blobs.glob("*/*") if p.parent.name + p.name not in kept]
        for path in unneeded:
            path.unlink()
        return len(unneeded)

    def _found(self, sha256: str) -> BufferedReader:
        try:
            return self._place(sha256).open("rb")
        except FileNotFoundError as error:
            told = f"the content {sha256} is gone: {self._place(sha256)} does not exist"
            raise RepositoryDamaged(f"{told}; {_HEALED_BY}") from error

    def _changed(self, sha256: str, found: str) -> RepositoryDamaged:
        return RepositoryDamaged(f"{self._place(sha256)} has changed: its hash is {found}; {_HEALED_BY}")

    def _place(self, sha256: str) -> Path:
        return self._blobs / sha256[:2] / sha256[2:]


def write_hashed(stream: BinaryIO, to: Path, *, limit: int | None, item: str) -> Staged:
    """Write a stream to a new file, piece by piece, to the disk.

    Args:
        limit: In bytes; None for none.
        item: Whose it is, for messages.

    Raises:
        BadItem: It is longer than the limit; nothing is left of it.
    """
    digest, size = hashlib.sha256(), 0
    to.parent.mkdir(parents=True, exist_ok=True)
    with to.open("xb") as out:
        while piece := stream.read(_PIECE):
            size += len(piece)
            if limit is not None and size > limit:
                to.unlink()
                raise BadItem(item, f"{to.name} is larger than {limit} bytes, which is all that is taken")
            digest.update(piece)
            out.write(piece)
        out.flush()
        os.fsync(out.fileno())
    return Staged(path=to, sha256=digest.hexdigest(), size=size)


def _sha256_of(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _sync_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
