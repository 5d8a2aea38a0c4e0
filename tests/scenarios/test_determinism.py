"""The same seed gives the same trace, byte for byte; another seed gives another."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from executive import Fleet
from executive.replay import first_difference
from kb.files import SHIPPED


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


@pytest.mark.parametrize("events", [1000, 1001, 1002, 1003, 1004, 1005])
def test_a_run_that_was_canceled_between_two_events_of_one_instant_replays_the_same(events: int) -> None:
    """A cancel is repeated where it came in the order of events, not only at its time."""
    with Fleet.open("tue_lab") as fleet:
        task = fleet.request("FindEmptyDrink", room="tue_lab")
        fleet.parts.clock.run_until(lambda: len(fleet.trace) >= events)
        task.cancel()
        recorded = list(fleet.trace)
    assert first_difference(recorded, SHIPPED) == ""
