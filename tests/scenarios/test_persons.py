"""A person is asked for help where nothing else is left, or where that is sooner."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from executive import Fleet, TaskStatus
from executive.cli import main
from executive.errors import BadRequest
from executive.persons import Question
from executive.replay import first_difference
from executive.trace import PersonAsked, PersonHasAnswered, RecoveryChosen
from kb.files import SHIPPED

CORRECTED = '[faults.odd]\nservice = "/compute/detection"\nkind = "fail"\ncalls = [1]\ncode = "BadRequest"\n'
"""The first call is one that the service cannot use: somebody has to correct what it is given."""


@pytest.fixture
def faults(tmp_path: Path) -> Path:
    """What goes wrong."""
    file = tmp_path / "faults.toml"
    file.write_text(CORRECTED, encoding="utf-8")
    return file


def drive(fleet: Fleet, asked: list[Question]) -> None:
    """Until a question comes up."""
    assert fleet.parts.clock.run_until(lambda: bool(asked))


@pytest.mark.slow
def test_a_person_helps_and_the_robot_goes_on(faults: Path) -> None:
    """The robot waits for the answer, does the failed step again, and a replay comes to the same."""
    asked: list[Question] = []
    with Fleet.open("tue_lab", faults=faults) as fleet:
        fleet.listen(asked.append)
        task = fleet.request("SearchDrink", robot="pico_1", area="tue_lab", drink="drink_2", location="at_dining_table")
        drive(fleet, asked)
        [question] = asked
        assert "Detection(pico_1" in question.text
        fleet.answer(question.number, helped=True, reason="the picture is bright now")
        with pytest.raises(BadRequest, match="is not open"):
            fleet.answer(question.number, helped=True)
        result = task.wait()
        assert result.status is TaskStatus.COMPLETED, result.reason
        [told] = [e for e in fleet.trace if isinstance(e, PersonHasAnswered)]
        assert (told.helped, told.reason) == (True, "the picture is bright now")
        [chosen] = [e for e in fleet.trace if isinstance(e, RecoveryChosen)]
        assert (chosen.recovery, chosen.failure) == ("ask_person", "BadRequest")
        trace = list(fleet.trace)
    assert first_difference(trace, SHIPPED) == ""


@pytest.mark.slow
@pytest.mark.parametrize(("typed", "status"), [("n\n", 1), ("why\ny\n", 0), ("", 1)])
def test_the_person_at_the_terminal(
    typed: str,
    status: int,
    faults: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """`run --ask` asks there, again until it is answered; with nobody there, nobody helps."""
    monkeypatch.setattr("sys.stdin", io.StringIO(typed))
    search = ["SearchDrink", "robot=pico_1", "area=tue_lab", "drink=drink_2", "location=at_dining_table"]
    options = ["--site", "tue_lab", "--faults", str(faults), "--out", str(tmp_path / "run"), "--ask"]
    assert main(["run", *search, *options]) == status
    told = capsys.readouterr()
    assert "a person is asked for help" in told.out
    assert ("a person was asked: nobody can help" in told.err) is bool(status)


def test_without_anybody_who_listens_nobody_is_asked(faults: Path) -> None:
    """The task fails as before, for its true reason."""
    with Fleet.open("tue_lab", faults=faults) as fleet:
        result = fleet.request(
            "SearchDrink", robot="pico_1", area="tue_lab", drink="drink_2", location="at_dining_table"
        ).wait()
        assert result.status is TaskStatus.FAILED
        assert "Detection(pico_1" in result.reason
        assert not [e for e in fleet.trace if isinstance(e, PersonAsked)]
