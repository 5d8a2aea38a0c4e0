"""`concertmaster kb ask`, `explain`, `show` and `doc`: what they print, write and return."""

import csv
import io
import json
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from executive.cli import main
from executive.kb_commands.tables import table
from kb.files import SHIPPED
from tests.scenarios.laser_topic import ground_laser_in_topic

ROBOTS = "SELECT ?robot ?place { ?robot a core:Robot ; core:locatedAt ?place }"


def test_ask_prints_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    """Columns under their names, and how many rows."""
    assert main(["kb", "ask", ROBOTS]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "robot            place",
        "---------------  ------------------",
        "tue_lab:amigo_1  tue_lab:start_west",
        "tue_lab:pico_1   tue_lab:start_east",
        "2 rows",
    ]


def test_ask_answers_yes_no_and_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    """In a word."""
    for query, told in (
        ("ASK { tue_lab:drink_1 core:isEmpty true }", "yes"),
        ("ASK { tue_lab:drink_1 core:isEmpty false }", "no"),
        ("SELECT ?x { ?x a core:Sofia }", "nothing"),
    ):
        assert main(["kb", "ask", query]) == 0
        assert capsys.readouterr().out == f"{told}\n"


def test_ask_for_scripts(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """JSON and CSV in the formats of the W3C; the query from a file."""
    file = tmp_path / "robots.rq"
    file.write_text(ROBOTS, encoding="utf-8")
    assert main(["kb", "ask", f"@{file}", "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [b["robot"]["value"].rsplit("#")[-1] for b in found["results"]["bindings"]] == ["amigo_1", "pico_1"]
    assert main(["kb", "ask", ROBOTS, "--format", "csv"]) == 0
    rows = list(csv.reader(io.StringIO(capsys.readouterr().out)))
    assert rows[0] == ["robot", "place"]
    assert rows[1][0].endswith("#amigo_1")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["ask", "SELECT"], "concertmaster: line 1, column"),
        (["ask", "DELETE WHERE { ?s ?p ?o }"], "DELETE would change what is known"),
        (["ask", "@no/such/file"], "no/such/file: No such file or directory"),
        (["show", "FindEmptyDrunk"], "there is no process 'FindEmptyDrunk'; did you mean FindEmptyDrink?"),
        (["explain", "amigo"], "there is no robot or task 'amigo'; did you mean amigo_1?"),
        (["explain", "amigo_1", "Navigatee"], "there is no process 'Navigatee'; did you mean Navigate?"),
        (["explain", "drink_1", "Navigate"], "there is no robot 'drink_1'"),
    ],
)
def test_what_is_wrong_ends_with_2(arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    """One message where errors go, nothing else."""
    assert main(["kb", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert told in captured.err


def test_a_misspelt_name_is_told_where_errors_go(capsys: pytest.CaptureFixture[str]) -> None:
    """The answer is as it is."""
    assert main(["kb", "ask", "SELECT ?x { ?x a core:Robott }"]) == 0
    captured = capsys.readouterr()
    assert captured.out == "nothing\n"
    assert captured.err == "concertmaster: no file names core:Robott; did you mean core:Robot?\n"


def test_what_is_not_whole_can_be_asked_about(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A site that no fleet can use, as a grounding lacks its time limit; but not one that contradicts itself."""
    folder = Path(shutil.copytree(SHIPPED, tmp_path / "ontologies"))
    groundings = folder / "tasks" / "groundings.owl"
    lines = groundings.read_text(encoding="utf-8").splitlines(keepends=True)
    groundings.write_text("".join(line for line in lines if "timeout_s" not in line), encoding="utf-8")
    assert main(["kb", "check", "--knowledge", str(folder)]) == 2
    capsys.readouterr()
    lacking = "ASK { groundings:Laser_service a core:Grounding FILTER NOT EXISTS { ?g core:timeout_s ?t } }"
    assert main(["kb", "ask", lacking, "--knowledge", str(folder)]) == 0
    assert capsys.readouterr().out == "yes\n"
    site = folder / "sites" / "tue_lab" / "tue_lab.owl"
    text = site.read_text(encoding="utf-8")
    sofa = '<rdf:type rdf:resource="http://example.org/concertmaster/core.owl#Sofa"/>'
    beer = '<rdf:type rdf:resource="http://example.org/concertmaster/objects.owl#Beer"/>'
    assert beer in text
    site.write_text(text.replace(beer, beer + sofa), encoding="utf-8")
    assert main(["kb", "ask", "ASK {}", "--knowledge", str(folder)]) == 2
    assert "KB301" in capsys.readouterr().err


def test_a_query_file_that_is_no_text_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With its name."""
    file = tmp_path / "query.rq"
    file.write_bytes(b"SELECT \xff")
    assert main(["kb", "ask", f"@{file}"]) == 2
    assert f"concertmaster: {file} is not UTF-8 text" in capsys.readouterr().err


def test_too_many_rows_are_said(capsys: pytest.CaptureFixture[str]) -> None:
    """Where errors go, so that scripts get clean rows."""
    assert main(["kb", "ask", "SELECT * { ?s ?p ?o }", "--rows", "3", "--format", "csv"]) == 0
    captured = capsys.readouterr()
    assert len(captured.out.splitlines()) == 4
    assert "more than 3 rows" in captured.err


def test_explain_prints_the_matrix(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Robots and their classes by tasks; in parts where the terminal is narrow."""
    monkeypatch.setenv("COLUMNS", "120")
    assert main(["kb", "explain"]) == 0
    head, _, *rows = capsys.readouterr().out.splitlines()
    assert {"robot", "FindEmptyDrink", "Navigate"} <= set(head.split())
    assert [row.split()[0] for row in rows] == ["amigo_1", "pico_1", "Amigo", "Pico"]
    monkeypatch.setenv("COLUMNS", "30")
    assert main(["kb", "explain"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 30
    assert len([line for line in lines if line.startswith("robot")]) > 1


def test_what_is_missing_is_told_once_for_all_who_lack_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Robots and classes that lack the same for the same tasks, in lines that fit the terminal."""
    folder = Path(shutil.copytree(SHIPPED, tmp_path / "ontologies"))
    pico = folder / "robots" / "pico.owl"
    pico.write_text(pico.read_text(encoding="utf-8").replace('core.owl#Kinect"', 'core.owl#LaserScanner"'), "utf-8")
    monkeypatch.setenv("COLUMNS", "60")
    assert main(["kb", "explain", "--knowledge", str(folder)]) == 0
    told = capsys.readouterr().out
    assert max(map(len, told.splitlines())) <= 60
    assert " ".join(told.split("\n\n")[-1].split()) == (
        "pico_1, Pico in FindEachDrink, FindEmptyDrink, SearchDrink: it is no RobotWithKinect (hasSensor some Kinect) "
        "(asked for by Kinect)"
    )


def test_explain_derives_a_single_answer(capsys: pytest.CaptureFixture[str]) -> None:
    """Down to the lines of files; a task alone is shown for all."""
    assert main(["kb", "explain", "pico_1", "SearchDrink"]) == 0
    told = capsys.readouterr().out
    assert told.startswith("pico_1 can take part in SearchDrink as robot\n")
    assert "every Pico hasSensor some Kinect (pico.owl:" in told
    assert main(["kb", "explain", "SearchDrink", "--format", "json"]) == 0
    assert [r["robot"] for r in json.loads(capsys.readouterr().out)] == ["amigo_1", "pico_1", "Amigo", "Pico"]
    assert main(["kb", "explain", "--format", "html"]) == 0
    assert capsys.readouterr().out.startswith("<!DOCTYPE html>")


def test_show_prints_or_draws(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An outline, or a file whose name is printed."""
    assert main(["kb", "show", "SearchDrink"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "Detection [compute]"
    file = tmp_path / "chart.svg"
    assert main(["kb", "show", "SearchDrink", "--expand", "--data", "--svg", str(file)]) == 0
    assert capsys.readouterr().out == f"{file}\n"
    assert ET.parse(file).getroot().tag.endswith("svg")


def test_doc_writes_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Into a new folder; not over a file."""
    out = tmp_path / "a" / "reference"
    assert main(["kb", "doc", "--out", str(out)]) == 0
    assert capsys.readouterr().out.startswith(f"{out / 'index.html'}: ")
    assert (out / "entity" / "pico_1.html").is_file()
    assert main(["kb", "doc", "--out", str(out / "index.html")]) == 2


def test_tables_are_safe_for_terminals() -> None:
    """No line ends and no control characters in cells."""
    assert table(["a"], [["x\n\x1b[31my"]]).splitlines()[-1] == "x  [31my"


def test_services_tells_what_a_robot_must_offer(capsys: pytest.CaptureFixture[str]) -> None:
    """As ROS service definitions, under its name; of one that is none, which there are."""
    assert main(["kb", "services", "pico_1"]) == 0
    told = capsys.readouterr().out
    assert "# /pico_1/base: Base\ngeometry_msgs/Twist velocity\n---\nnav_msgs/Odometry odometry\n\n# /pico_1/" in told
    assert main(["kb", "services"]) == 0
    assert capsys.readouterr().out == told.replace("pico_1", "{robot}")
    assert main(["kb", "services", "drink_1"]) == 2
    assert "drink_1 is no robot of tue_lab; its robots are amigo_1, pico_1" in capsys.readouterr().err


def test_services_tells_which_topics_a_robot_must_speak_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By name and type, where the knowledge says that a process is done by listening."""
    knowledge = Path(shutil.copytree(SHIPPED, tmp_path / "ontologies"))
    ground_laser_in_topic(knowledge)
    assert main(["kb", "services", "pico_1", "--knowledge", str(knowledge)]) == 0
    told = capsys.readouterr().out
    assert "# /pico_1/scan: Laser, a topic of type sensor_msgs/LaserScan\n" in told
    assert "/pico_1/laser" not in told
