"""The command `concertmaster explain`."""

from __future__ import annotations

import json

import pytest

from executive.cli import main
from executive.exit_codes import OK, REFUSED

TASK = ("explain", "FindEmptyDrink", "room=tue_lab")


def test_it_tells_why(capsys: pytest.CaptureFixture[str]) -> None:
    """The status, a line for each choice, and the steps that decide."""
    assert main(TASK) == OK
    first, *lines = capsys.readouterr().out.splitlines()
    assert first.startswith("SOLVED_OPTIMALLY: makespan ")
    assert lines[0] == "FindEachDrink at recipe: there is no other choice"
    assert [line.split(" ")[0] for line in lines[1:3]] == ["amigo_1", "pico_1"]
    assert all(" would take " in line for line in lines[1:3])
    assert lines[3] == "What decides the makespan:"


def test_it_tells_why_not_as_data(capsys: pytest.CaptureFixture[str]) -> None:
    """Both questions at once, one answer each."""
    assert main([*TASK, "--robots", "1", "--not", "drink_1=pico_1", "--first", "drink_2=drink_1", "--json"]) == OK
    not_so, swapped = json.loads(capsys.readouterr().out)
    assert (not_so["label"], not_so["status"]) == ("pico_1", "SOLVED_OPTIMALLY")
    assert (swapped["first"], swapped["before"]) == ("drink_2", "drink_1")
    assert swapped["makespan_s"] > 0


@pytest.mark.parametrize(
    ("option", "given", "told"),
    [
        ("--not", "drink_1", "--not drink_1 names one thing; name two"),
        ("--not", "nothing=pico_1", "no choice of the plan belongs to 'nothing'; there is "),
        ("--not", "drink_1=sofa", "sofa cannot be chosen at "),
        ("--not", "FindEachDrink_pick=pico_1", "'FindEachDrink_pick' stands for several choices: "),
        ("--first", "drink_1=nothing", "no step of the plan belongs to 'nothing'"),
    ],
)
def test_what_cannot_be_asked(option: str, given: str, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Is refused with what could be."""
    assert main([*TASK, option, given]) == REFUSED
    assert told in capsys.readouterr().err
