"""The same seed gives the same trace, byte for byte; another seed gives another."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path


def run(out: Path, *options: str) -> bytes:
    """The trace of one run of the command line, in a process of its own."""
    command = [
        sys.executable,
        "-m",
        "executive.cli",
        "run",
        "FindEmptyDrink",
        "room=kitchen",
        "--out",
        str(out),
        *options,
    ]
    subprocess.run(command, check=True, capture_output=True, cwd=Path(__file__).parents[2])
    return (out / "trace.jsonl").read_bytes()


def test_same_seed_same_bytes(tmp_path: Path) -> None:
    """Trace, Gantt picture and top view of two runs are the same; with another seed the trace is not."""
    one, two = run(tmp_path / "one"), run(tmp_path / "two")
    assert one == two
    for picture in ("gantt.png", "top_view.png"):
        assert (tmp_path / "one" / picture).read_bytes() == (tmp_path / "two" / picture).read_bytes()
    assert run(tmp_path / "three", "--seed", "2") != one
