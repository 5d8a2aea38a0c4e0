"""What came over a connection and was thrown away: how much, and why the last of it."""

from __future__ import annotations

import threading


class Dropped:
    """Counts what is thrown away; any thread may note it.

    Attributes:
        last: What was thrown away last, and why, in a sentence; empty if nothing was.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.count = 0
        self.last = ""

    def note(self, what: str) -> None:
        """Count one more."""
        with self._lock:
            self.count += 1
            self.last = what
