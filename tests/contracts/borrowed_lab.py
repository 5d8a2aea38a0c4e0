"""An installed package that offers compute services, good ones and bad ones."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from grounding.compute import registry

_PACKAGE = """
import os
import time
from pathlib import Path

def double(*, number: float, t_s: float):
    return {"twice": 2 * number, "t_s": t_s, "process": os.getpid()}

def see(*, variable: str, t_s: float):
    return {"value": os.environ.get(variable, "")}

def note(*, log_file: Path, t_s: float):
    with log_file.open("a") as log:
        log.write("x")
    os._exit(3)

def once(*, flag_file: Path, t_s: float):
    if not flag_file.exists():
        flag_file.touch()
        os._exit(3)
    return {"process": os.getpid()}

def crash(*, t_s: float):
    os._exit(3)

def hang(*, t_s: float):
    while True:
        pass

def hoard(*, t_s: float):
    return {"bytes": len(bytearray(8 << 30))}

def stumble(*, t_s: float):
    return {"x": 1 / 0}

def timeless():
    return {}

def loose(*fields, t_s: float):
    return {}

NOTHING = 3
"""
_SERVICES = (
    *("double", "see", "note", "once", "crash", "hang", "hoard", "stumble", "timeless", "loose", "NOTHING", "missing"),
)


@contextmanager
def borrowed_lab(folder: Path) -> Iterator[None]:
    """Have it installed below `folder`."""
    (folder / "borrowed_lab.py").write_text(_PACKAGE)
    info = folder / "borrowed_lab-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: borrowed_lab\nVersion: 1.0\n")
    lines = [f"{name.lower()} = borrowed_lab:{name}" for name in _SERVICES] + ["elsewhere = no_such_module:f"]
    (info / "entry_points.txt").write_text("[concertmaster.compute]\n" + "\n".join(lines) + "\n")
    sys.path.insert(0, str(folder))
    _forget()
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        _forget()


def _forget() -> None:
    registry._installed.cache_clear()
    registry._loaded.cache_clear()
