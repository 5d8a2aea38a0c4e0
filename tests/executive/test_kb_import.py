"""`concertmaster kb import`: a file of others in, a file of ours and a report out."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from executive.cli import main
from kb.files import SHIPPED

ROOT = Path(__file__).parents[2]
PICO = str(ROOT / "sim" / "models" / "pico.urdf")
BOOKS = str(ROOT / "tests" / "data" / "owls" / "FindCheaperBook.owl")


def imported(*options: str) -> int:
    """The status that `concertmaster kb import` ends with."""
    return main(["kb", "import", *options])


def test_report_and_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A line for each note, then what was written; the ontology is named for the file."""
    out = tmp_path / "courier.owl"
    assert imported("urdf", PICO, "--out", str(out)) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].startswith(f"{out}: 7 entities, {len(lines) - 1} notes")
    assert "pico.urdf:41 guessed: laser: that it has a LaserScanner follows from names alone: laser" in lines
    text = out.read_text(encoding="utf-8")
    assert '<owl:Ontology rdf:about="http://example.org/concertmaster/courier.owl">' in text
    assert str(ROOT) not in text


def test_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The report as a list of objects."""
    assert imported("owls", BOOKS, "--out", str(tmp_path / "books.owl"), "--json") == 0
    notes = json.loads(capsys.readouterr().out)
    assert {"file", "line", "entity", "fate", "message"} == set(notes[0])
    assert {n["fate"] for n in notes} == {"left out", "changed", "assumed"}


def test_nothing_is_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A file that is there stays, unless --force says otherwise; the shipped ones stay in any case."""
    out = tmp_path / "courier.owl"
    out.write_text("mine", encoding="utf-8")
    assert imported("urdf", PICO, "--out", str(out)) == 2
    assert out.read_text(encoding="utf-8") == "mine"
    assert "is there already" in capsys.readouterr().err
    assert imported("urdf", PICO, "--out", str(out), "--force") == 0
    assert out.read_text(encoding="utf-8") != "mine"
    assert imported("urdf", PICO, "--out", str(SHIPPED / "robots" / "pico.owl"), "--force") == 2
    assert "the shipped ontologies are not changed" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("urdf", PICO, "--out", "my robot.owl"), "name it with letters, digits and _"),
        (("urdf", PICO, "--out", "robot.ttl"), "end it with .owl"),
        (("urdf", PICO, "--out", "no/such/robot.owl"), "there is no folder no/such"),
        (("urdf", BOOKS, "--out", "robot.owl"), "FindCheaperBook.owl:2 has a DOCTYPE"),
        (("owls", PICO, "--out", "robot.owl"), "does not parse as RDF/XML"),
        (("recipe", BOOKS, "--out", "robot.owl"), "has no recipe in it"),
        (("srdl", BOOKS, "--out", "robot.owl"), "describes no robot"),
        (("srdl", "none.owl", "--out", "robot.owl"), "none.owl is no file"),
    ],
)
def test_what_cannot_be_imported(
    arguments: tuple[str, ...],
    says: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """One message, status 2, and no file."""
    monkeypatch.chdir(tmp_path)
    assert imported(*arguments) == 2
    assert says in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
