"""The command line: what it prints, writes and returns."""

from __future__ import annotations

import argparse
import json
import re
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from executive import Fleet
from executive.cli import main
from executive.task_commands import run
from executive.task_commands.asked import open_fleet
from executive.trace import TaskFinished, TraceEvent, narrate, read_trace
from grounding.inprocess import Service

COMMANDS = (
    ["run"],
    ["plan"],
    ["trace"],
    ["simulate"],
    ["kb"],
    ["kb", "check"],
    ["kb", "ask"],
    ["kb", "explain"],
    ["kb", "show"],
    ["kb", "doc"],
)


@pytest.mark.parametrize("command", [[], *COMMANDS], ids=" ".join)
def test_help_tells_and_ends_with_0(command: Sequence[str], capsys: pytest.CaptureFixture[str]) -> None:
    """Every command has its help, with a line on each option."""
    with pytest.raises(SystemExit) as left:
        main([*command, "--help"])
    assert left.value.code == 0
    told = capsys.readouterr().out
    assert told.startswith(" ".join(["usage: concertmaster", *command]))


@pytest.mark.parametrize(
    "arguments",
    [[], ["dance"], ["kb"], ["kb", "dance"], ["run"], ["plan", "X", "--robots", "two"], ["trace", "f", "-x"]],
)
def test_what_is_no_command_ends_with_2(arguments: Sequence[str], capsys: pytest.CaptureFixture[str]) -> None:
    """The usage is on stderr, nothing on stdout."""
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("usage: concertmaster")


def test_plan_prints_status_and_steps_and_moves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line a step, with its times; nothing is left in the folder."""
    monkeypatch.chdir(tmp_path)
    assert main(["plan", "FindEmptyDrink", "room=kitchen"]) == 0
    status, *steps = capsys.readouterr().out.splitlines()
    assert status.startswith("SOLVED_OPTIMALLY: makespan ")
    assert re.fullmatch(r'  \[Navigate\(pico_1,"kitchen","at_dining_table"\)\] from \d+\.\d\d to \d+\.\d\d', steps[0])
    assert any(step.startswith('  [Detection(pico_1,"drink_2")]') for step in steps)
    assert not list(tmp_path.iterdir())


def test_trace_prints_the_narration(trace_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a file that `run` wrote."""
    assert main(["trace", str(trace_file)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines == list(narrate(read_trace(trace_file)))
    assert any(re.fullmatch(r"do \[Laser\(amigo_1\)\] at time \d+\.\d\d", line) for line in lines)


def test_trace_draws_what_run_drew(run_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`--gantt` and `--top-view` give the pictures of the run, byte by byte, and print their names alone."""
    gantt, top_view = tmp_path / "g.png", tmp_path / "t.png"
    trace = str(run_folder / "trace.jsonl")
    assert main(["trace", trace, "--gantt", str(gantt), "--top-view", str(top_view)]) == 0
    assert capsys.readouterr().out.splitlines() == [str(gantt), str(top_view)]
    assert gantt.read_bytes() == (run_folder / "gantt.png").read_bytes()
    assert top_view.read_bytes() == (run_folder / "top_view.png").read_bytes()


def test_a_trace_without_a_fleet_has_no_top_view(
    trace_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The site is not known, so neither is its map; the message says so."""
    file = tmp_path / "headless.jsonl"
    _, *rest = trace_file.read_text(encoding="utf-8").splitlines(keepends=True)
    file.write_text("".join(rest), encoding="utf-8")
    assert main(["trace", str(file), "--top-view", str(tmp_path / "t.png")]) == 2
    assert "does not tell the site" in capsys.readouterr().err
    assert not (tmp_path / "t.png").exists()


def test_kb_check_of_good_files(capsys: pytest.CaptureFixture[str]) -> None:
    """A line for people; an empty list as JSON."""
    assert main(["kb", "check"]) == 0
    assert re.fullmatch(r"tue_lab: \d+ files, no problems\n", capsys.readouterr().out)
    assert main(["kb", "check", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out) == []


def test_kb_check_tells_problems_as_json(knowledge: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """File, line, code, severity, entity and message of each; exit status 2."""
    file = knowledge / "tasks" / "navigation.owl"
    file.write_text(file.read_text(encoding="utf-8")[:5000], encoding="utf-8")
    assert main(["kb", "check", "--format", "json", "--knowledge", str(knowledge)]) == 2
    problems = json.loads(capsys.readouterr().out)
    assert all(set(problem) == {"file", "line", "code", "severity", "entity", "message"} for problem in problems)
    assert ("navigation.owl", "KB001") in {(Path(problem["file"]).name, problem["code"]) for problem in problems}


def test_run_writes_to_the_next_free_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """runs/TASK-1, then runs/TASK-2: no run overwrites another."""
    monkeypatch.chdir(tmp_path)
    for number in (1, 2):
        assert main(["run", "Localize", "robot=pico_1", "area=tue_lab", "--verbose"]) == 0
        out = capsys.readouterr().out
        assert "do [Laser(pico_1)] at time" in out
        assert f"trace:    runs/Localize-{number}/trace.jsonl" in out
    for number in (1, 2):
        files = sorted(path.name for path in (tmp_path / "runs" / f"Localize-{number}").iterdir())
        assert files == ["gantt.png", "metrics.json", "top_view.png", "trace.jsonl"]


def canceled(events: Sequence[TraceEvent]) -> None:
    """Check that a trace ends with its task canceled."""
    last = events[-1]
    assert isinstance(last, TaskFinished)
    assert (last.status, last.reason) == ("canceled", "canceled by request")


def test_an_interrupt_within_a_call_cancels_the_task(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ctrl-C may come at any moment, also while a service is being called: trace and pictures are still written."""

    def interrupt(fields: Mapping[str, object]) -> Mapping[str, object]:
        raise KeyboardInterrupt

    def open_with_interrupt(options: argparse.Namespace, trace: Path, **files: Any) -> Fleet:
        fleet = open_fleet(options, trace, **files)
        fleet.parts.transport.offer("/amigo_1/laser", Service(handler=interrupt, latency_s=0.0))
        return fleet

    monkeypatch.setattr(run, "open_fleet", open_with_interrupt)
    assert main(["run", "Localize", "robot=amigo_1", "area=tue_lab", "--out", str(tmp_path)]) == 130
    canceled(list(read_trace(tmp_path / "trace.jsonl")))
    assert {path.name for path in tmp_path.iterdir()} == {"trace.jsonl", "metrics.json", "gantt.png", "top_view.png"}
    assert capsys.readouterr().err == "concertmaster: Localize-1 canceled: canceled by request\n"


def test_ctrl_c_cancels_the_task(tmp_path: Path) -> None:
    """A real signal to a real process after its first line: status 130, no traceback, a whole trace."""
    command = [sys.executable, "-m", "executive.cli", "run", "FindEmptyDrink", "room=tue_lab", "--out", str(tmp_path)]
    root = Path(__file__).parents[2]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=root) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.send_signal(signal.SIGINT)
        _, complaints = process.communicate(timeout=30)
    assert process.returncode == 130
    assert complaints == "concertmaster: FindEmptyDrink-1 canceled: canceled by request\n"
    canceled(list(read_trace(tmp_path / "trace.jsonl")))
    assert (tmp_path / "gantt.png").is_file()
