"""Where results are kept: in memory or on disk, so many bytes at most; what was not used for longest goes first."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections import OrderedDict
from pathlib import Path
from typing import Protocol

_CHECKSUM_BYTES = 32
_LEFT_AFTER_CLEARING = 0.9  # of the bound, so that not every further entry clears again


class Kept(Protocol):
    """Bytes by key. One thread at a time."""

    def get(self, key: str) -> bytes | None:
        """What is kept under a key; None if nothing is, or it is damaged."""

    def put(self, key: str, data: bytes) -> None:
        """Keep this, if there is room for it."""

    def drop(self, key: str) -> None:
        """Keep it no longer."""


class InMemory:
    """Kept as long as the process lives."""

    def __init__(self, most_bytes: int) -> None:
        self._most_bytes = most_bytes
        self._bytes = 0
        self._entries = OrderedDict[str, bytes]()

    def get(self, key: str) -> bytes | None:
        data = self._entries.get(key)
        if data is not None:
            self._entries.move_to_end(key)
        return data

    def put(self, key: str, data: bytes) -> None:
        self.drop(key)
        self._entries[key] = data
        self._bytes += len(data)
        while self._bytes > self._most_bytes:
            _, oldest = self._entries.popitem(last=False)
            self._bytes -= len(oldest)

    def drop(self, key: str) -> None:
        self._bytes -= len(self._entries.pop(key, b""))


class OnDisk:
    """A file for each result, which several processes may share: an entry appears whole or not at all.

    An entry begins with the checksum of the rest. A disk that is full, or that cannot be written any more, keeps
    nothing new: a result that is lost is computed again.
    """

    def __init__(self, folder: Path, most_bytes: int) -> None:
        """Open the folder, or make it, for its owner only.

        Raises:
            OSError: That is not possible.
        """
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._folder = folder
        self._most_bytes = most_bytes
        self._bytes = sum(size for _, size, _ in self._files())

    def get(self, key: str) -> bytes | None:
        file = self._folder / key
        try:
            content = file.read_bytes()
            os.utime(file)  # used just now
        except OSError:
            return None
        data = content[_CHECKSUM_BYTES:]
        return data if content[:_CHECKSUM_BYTES] == hashlib.sha256(data).digest() else None

    def put(self, key: str, data: bytes) -> None:
        try:
            with tempfile.NamedTemporaryFile(dir=self._folder, prefix=_UNFINISHED, delete=False) as new:
                new.write(hashlib.sha256(data).digest() + data)
            Path(new.name).replace(self._folder / key)
        except OSError:
            return
        self._bytes += _CHECKSUM_BYTES + len(data)
        if self._bytes > self._most_bytes:
            self._clear()

    def drop(self, key: str) -> None:
        (self._folder / key).unlink(missing_ok=True)

    def _clear(self) -> None:
        files = sorted(self._files())
        self._bytes = sum(size for _, size, _ in files)
        for _, size, file in files:
            if self._bytes <= _LEFT_AFTER_CLEARING * self._most_bytes:
                break
            file.unlink(missing_ok=True)
            self._bytes -= size

    def _files(self) -> list[tuple[int, int, Path]]:
        """When each file was last used (ns), its size in bytes, and where it is."""
        files = []
        for file in self._folder.iterdir():
            try:
                stat = file.stat()
            except FileNotFoundError:  # another process has just cleared
                continue
            files.append((stat.st_mtime_ns, stat.st_size, file))
        return files


_UNFINISHED = "new-"
