"""The recorder: file and memory tell the same."""

from __future__ import annotations

from pathlib import Path

import pytest

from executive.recorder import Recorder
from executive.trace import FleetOpened, Replanned, TraceEvent, read_trace, to_json

OPENED = FleetOpened(t_s=0.0, site="lab", robots=["r1"], knowledge="ab", scenario="lab", seed=1)
EVENTS = [Replanned(t_s=float(i), task="one", reason=f"reason {i}\nin two lines") for i in range(5)]


def test_a_fleet_opened_in_vain_leaves_nothing_behind(tmp_path: Path) -> None:
    """No file and no folder are made for the opening alone."""
    recorder = Recorder(tmp_path / "deep" / "trace.jsonl")
    recorder.record(OPENED)
    recorder.close()
    assert list(recorder.events) == [OPENED]
    assert list(tmp_path.iterdir()) == []


def test_the_file_holds_what_memory_holds_in_order(tmp_path: Path) -> None:
    """The opening comes first, though it was written with the first event after it."""
    file = tmp_path / "deep" / "trace.jsonl"
    recorder = Recorder(file)
    recorder.record(OPENED)
    for event in EVENTS:
        recorder.record(event)
    recorder.close()
    assert list(recorder.events) == [OPENED, *EVENTS]
    assert list(read_trace(file)) == list(recorder.events)
    assert file.read_text(encoding="utf-8") == "".join(to_json(event) + "\n" for event in recorder.events)


def test_of_a_long_run_only_the_last_events_are_in_memory(tmp_path: Path) -> None:
    """The others are read from the file when they are asked for: by number, in slices, in order, and after the end."""
    recorder, kept = Recorder(tmp_path / "trace.jsonl", in_memory=10), list[TraceEvent]()
    for i in range(57):
        kept.append(event := Replanned(t_s=float(i), task="one", reason=""))
        recorder.record(event)
        assert len(recorder.events) == i + 1
    alive = {id(event) for event in recorder.events}
    assert 10 <= sum(id(event) in alive for event in kept) < 20
    for whole in (kept, recorder.events):
        assert [whole[i].t_s for i in (0, 56, -1, -57, 30)] == [0.0, 56.0, 56.0, 0.0, 30.0]
    for part in (slice(None), slice(3, 5), slice(30, 50), slice(55, None), slice(50, 2, -7), slice(60, None)):
        assert list(recorder.events[part]) == kept[part]
    recorder.close()
    assert list(recorder.events) == kept
    assert next(iter(reversed(recorder.events))) == kept[-1]
    with pytest.raises(IndexError):
        recorder.events[57]


def test_without_a_file_events_are_in_memory_alone(tmp_path: Path) -> None:
    """Closing does nothing then, however often."""
    recorder = Recorder(None)
    recorder.record(EVENTS[0])
    recorder.close()
    recorder.close()
    assert list(recorder.events) == EVENTS[:1]


def test_after_closing_the_file_stays_as_it_is(tmp_path: Path) -> None:
    """Later events are kept in memory; the file is neither reopened nor overwritten."""
    file = tmp_path / "trace.jsonl"
    recorder = Recorder(file)
    recorder.record(EVENTS[0])
    recorder.close()
    recorder.record(EVENTS[1])
    recorder.close()
    assert list(read_trace(file)) == EVENTS[:1]
    assert list(recorder.events) == EVENTS[:2]


def test_an_older_trace_is_replaced(tmp_path: Path) -> None:
    """One file tells one run."""
    file = tmp_path / "trace.jsonl"
    file.write_text("something older\n" * 100, encoding="utf-8")
    recorder = Recorder(file)
    recorder.record(EVENTS[0])
    recorder.close()
    assert list(read_trace(file)) == EVENTS[:1]
