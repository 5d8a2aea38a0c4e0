"""Watching a folder of ontologies: when a file in it is saved, all are read again, beside what goes on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from threading import Event, Thread

from watchfiles import Change, watch

_QUIET_MS = 200
"""So long nothing may have changed before files are read: editors save in several steps, and several files."""

_STEP_MS = 50


class FolderWatch:
    """Calls a function in a thread of its own whenever what is in a folder has changed; close it after use."""

    def __init__(self, folder: Path, changed: Callable[[], None]) -> None:
        """Begin to watch.

        Args:
            changed: Called after each burst of changes, one call at a time. What it raises ends the watch.

        Raises:
            FileNotFoundError: There is no such folder.
        """
        if not folder.is_dir():
            raise FileNotFoundError(2, "no such folder", str(folder))
        self._folder = folder
        self._changed = changed
        self._stop = Event()
        self._began = Event()
        self._thread = Thread(target=self._run, name=f"watch {folder}", daemon=True)
        self._thread.start()
        self._began.wait()

    def _run(self) -> None:
        changes = watch(
            self._folder,
            watch_filter=_matters,
            debounce=_QUIET_MS,
            step=_STEP_MS,
            stop_event=self._stop,
            rust_timeout=_STEP_MS * 4,
            yield_on_timeout=True,  # the first time: from now on it sees what is saved
            raise_interrupt=False,
        )
        for found in changes:
            self._began.set()
            if found:
                self._changed()
        self._began.set()

    def close(self) -> None:
        """Watch no more; a call that is under way is waited for."""
        self._stop.set()
        self._thread.join()


def _matters(change: Change, path: str) -> bool:
    """Whether a file is one that knowledge is made of, not one that an editor keeps beside it."""
    name = Path(path).name
    return not name.startswith((".", "~", "#")) and not name.endswith(("~", ".swp", ".tmp", ".bak"))
