"""Watching a folder of ontologies: when a file in it is saved, all are read again, beside what goes on.

The folder is looked at again and again rather than watched through the operating system, which tells nothing of files
behind symbolic links, nor of a folder that was renamed and another put in its place.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread
from typing import Generic, TypeAlias, TypeVar

_QUIET_S = 0.25
"""So long nothing may have changed before files are read: editors save in several steps, and several files."""

Found = TypeVar("Found")

_Looks: TypeAlias = dict[str, tuple[int, int, int]]
"""Which file is there, when it was written, and how long it is, by path."""


class FolderWatch(Generic[Found]):
    """Reads a folder in a thread of its own whenever what is in it has changed; close it after use."""

    def __init__(
        self, folder: Path, read: Callable[[], Found], tell: Callable[[Found], None], *, at_once: bool = False
    ) -> None:
        """Begin to watch: what is saved from now on counts.

        Args:
            read: Called after each burst of changes, one call at a time. What it raises ends the watch.
            tell: Called with what was read, unless something has changed meanwhile: then all is read again, so that
                nobody is told of files that were half written.
            at_once: Tell also of how the folder is now.

        Raises:
            FileNotFoundError: There is no such folder.
        """
        if not folder.is_dir():
            raise FileNotFoundError(2, "no such folder", str(folder))
        self._folder = folder
        self._read = read
        self._tell = tell
        self._stop = Event()
        now = _looks(folder)
        known = None if at_once else now
        self._thread = Thread(target=self._run, args=(now, known), name=f"watch {folder}", daemon=True)
        self._thread.start()

    def _run(self, before: _Looks, known: _Looks | None) -> None:
        """Look until it is enough; `known` is how the folder looked when it was told of last."""
        while not self._stop.wait(_QUIET_S):
            looks = _looks(self._folder)
            if looks == before != known:
                found = self._read()
                looks = _looks(self._folder)
                if looks == before:
                    self._tell(found)
                    known = looks
            before = looks

    def close(self) -> None:
        """Watch no more; a call that is under way is waited for."""
        self._stop.set()
        self._thread.join()


def _looks(folder: Path) -> _Looks:
    looks: _Looks = {}
    for parent, folders, names in os.walk(folder):
        folders[:] = filter(_matters, folders)
        for name in filter(_matters, names):
            with suppress(OSError):  # gone since, or a link to nothing
                status = (path := Path(parent, name)).stat()
                looks[str(path)] = (status.st_ino, status.st_mtime_ns, status.st_size)
    return looks


def _matters(name: str) -> bool:
    """Whether a file is one that knowledge is made of, not one that an editor keeps beside it."""
    return not name.startswith((".", "~", "#")) and not name.endswith(("~", ".swp", ".tmp", ".bak"))
