"""How the command ends, and how it complains."""

from __future__ import annotations

import sys

OK = 0
FAILED = 1
"""The task failed or was canceled."""
REFUSED = 2
"""The request or the knowledge is wrong; nothing was begun."""
INTERRUPTED = 130


def complain(message: str) -> None:
    """Tell a person what is wrong, where errors go."""
    print(message, file=sys.stderr)
