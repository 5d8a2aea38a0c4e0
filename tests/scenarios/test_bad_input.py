"""Bad input at every door: one message that names the culprit and what would be right; nothing has changed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from executive import Fleet
from executive.cli import main
from executive.errors import BadRequest
from tests.scenarios.conftest import NO_KINECT, Edit

RUN = ["run", "FindEmptyDrink", "room=tue_lab"]


@pytest.mark.parametrize(
    ("process", "arguments", "told"),
    [
        ("FindEmptyDrnk", {"room": "tue_lab"}, "no task type 'FindEmptyDrnk'; did you mean FindEmptyDrink?"),
        ("FindEmptyDrink", {}, "needs the argument 'room', an Area"),
        ("FindEmptyDrink", {"room": "tue_lab", "when": "now"}, "has no argument 'when'; it takes room (an Area)"),
        ("FindEmptyDrink", {"room": "kichen"}, "room='kichen' of FindEmptyDrink is not known; did you mean kitchen?"),
        ("FindEmptyDrink", {"room": "drink_1"}, "room='drink_1' of FindEmptyDrink is a Beer, not an Area"),
        ("FindEmptyDrink", {"room": 7}, "room=7 of FindEmptyDrink is a int; give the name of an Area"),
        ("Path", {"robot": "amigo_1", "location": "at_bar"}, "needs the argument 'navMap'"),
    ],
)
def test_a_wrong_request_names_the_culprit(
    open_fleet: Fleet, process: str, arguments: dict[str, str], told: str
) -> None:
    """The message says what is wrong and what would be right; no event was recorded."""
    before = len(open_fleet.trace)
    with pytest.raises(BadRequest) as caught:
        open_fleet.request(process, robots=None, **arguments)
    assert told in str(caught.value)
    assert len(open_fleet.trace) == before


@pytest.mark.parametrize("robots", [0, -1, True, 1.5])
def test_a_wrong_number_of_robots_is_refused(open_fleet: Fleet, robots: int) -> None:
    """`robots` is an upper limit: a whole number from 1."""
    with pytest.raises(BadRequest, match="no upper limit of robots; give a number from 1 to 2"):
        open_fleet.request("FindEmptyDrink", room="tue_lab", robots=robots)


@pytest.fixture(scope="module")
def open_fleet() -> Fleet:
    """A fleet that only refuses."""
    return Fleet.open("tue_lab")


def cut_short(knowledge: Path, edit: Edit) -> None:
    """A file that ends in the middle."""
    file = knowledge / "tasks" / "navigation.owl"
    file.write_text(file.read_text(encoding="utf-8")[:5000], encoding="utf-8")


def contradiction(knowledge: Path, edit: Edit) -> None:
    """A drink that is a sofa as well."""
    beer = '<rdf:type rdf:resource="http://example.org/concertmaster/objects.owl#Beer"/>'
    sofa = '<rdf:type rdf:resource="http://example.org/concertmaster/core.owl#Sofa"/>'
    edit(knowledge / "sites" / "tue_lab" / "tue_lab.owl", beer, beer + sofa)


def no_grounding(knowledge: Path, edit: Edit) -> None:
    """Detection is grounded no more."""
    grounds = '<core:grounds rdf:resource="http://example.org/concertmaster/find_empty_drink.owl#Detection"/>'
    edit(knowledge / "tasks" / "groundings.owl", grounds, "")


def no_kinect(knowledge: Path, edit: Edit) -> None:
    """No robot has a Kinect."""
    for robot in ("amigo", "pico"):
        edit(knowledge / "robots" / f"{robot}.owl", NO_KINECT, "")


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (cut_short, ["navigation.owl:", "KB001", "does not parse as RDF/XML"]),
        (contradiction, ["tue_lab.owl:", "KB301", "drink_1", "contradicts itself", "Sofa SubClassOf Furniture"]),
        (no_grounding, ["find_empty_drink.owl:", "KB101", "Detection", "has no grounding"]),
        (no_kinect, ["amigo_1 cannot do Kinect or SearchDrink", "RobotWithKinect (hasSensor some Kinect)", "pico_1"]),
    ],
)
def test_wrong_knowledge_ends_the_command_with_status_2(
    knowledge: Path,
    edit: Edit,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    spoil: Callable[[Path, Edit], None],
    told: list[str],
) -> None:
    """The message names file, entity and what is wrong; nothing was run, no picture drawn."""
    spoil(knowledge, edit)
    out = tmp_path / "out"
    assert main([*RUN, "--knowledge", str(knowledge), "--out", str(out)]) == 2
    message = capsys.readouterr().err
    for words in told:
        assert words in message
    assert not (out / "gantt.png").exists()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["run", "FindEmptyDrink", "tue_lab"], "'tue_lab' is no argument; write name=value"),
        (
            ["run", "FindEmptyDrink", "room=tue_lab", "robots=2"],
            "'robots=2' is no argument of the task; write --robots 2",
        ),
        (
            ["run", "FindEmptyDrink", "room=tue_lab", "room=kitchen"],
            "room is given twice, as 'tue_lab' and as 'kitchen'",
        ),
        ([*RUN, "--seed", "-1"], "seed=-1 is no seed"),
        ([*RUN, "--out", "/dev/null"], "--out /dev/null is a file; give a folder"),
        (["run", "FindEmptyDrink", "room=mars"], "room='mars' of FindEmptyDrink is not known"),
        ([*RUN, "--site", "tue_lob"], "no site 'tue_lob'"),
        ([*RUN, "--scenario", "tuelab"], "tuelab"),
        ([*RUN, "--scenario", "nowhere.toml"], "nowhere.toml"),
        (["plan", "Dance"], "no task type 'Dance'"),
        (["trace", "nothing.jsonl"], "nothing.jsonl"),
        (["kb", "check", "--knowledge", "nowhere"], "no site 'tue_lab'"),
    ],
)
def test_wrong_commands_end_with_status_2_and_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], arguments: list[str], told: str
) -> None:
    """One line on stderr, nothing on stdout, no folder left behind."""
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert told in captured.err
    assert len(captured.err.strip().splitlines()) == 1
    assert captured.out == ""
    assert not list(tmp_path.iterdir())
