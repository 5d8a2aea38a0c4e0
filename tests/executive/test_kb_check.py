import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from executive.cli import main
from tests.kb.conftest import AMIGO, NAVIGATION, SITE, dropped, link, renamed
from tests.kb.faults import restricted
from tests.kb.test_idle_faults import IDLE

ROOT = Path(__file__).parents[2]
DOUBTFUL = next(case for case in IDLE if case.code == "KB218")


def checked(*options: str) -> int:
    """The status that `concertmaster kb check` ends with."""
    return main(["kb", "check", *options])


def second_site(folder: Path) -> None:
    """Copy the site to one of another name."""
    text = (folder / SITE).read_text(encoding="utf-8").replace("tue_lab.owl", "annex.owl")
    (folder / "sites" / "annex").mkdir()
    for file in (folder / "sites" / "tue_lab").iterdir():
        if file.suffix != ".owl":
            (folder / "sites" / "annex" / file.name).write_bytes(file.read_bytes())
    (folder / "sites" / "annex" / "annex.owl").write_text(text, encoding="utf-8")


def test_warnings_stop_nothing_unless_they_are_told_to(knowledge: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Status 0 and the count; 2 with --strict. A warning is a line like an error."""
    for edit in DOUBTFUL.edits:
        edit(knowledge)
    folder = ("--knowledge", str(knowledge))
    assert checked(*folder) == 0
    told = capsys.readouterr()
    assert told.out.startswith("tue_lab: ")
    assert told.out.endswith(" files, 1 warning\n")
    assert " KB218 warning Localize_spare: is a parameter" in told.err
    assert checked(*folder, "--strict") == 2


def test_all_sites_are_checked(knowledge: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A line for each that is right; what files that both import have wrong is told once."""
    second_site(knowledge)
    assert checked("--all-sites", "--knowledge", str(knowledge)) == 0
    assert [line.split(":")[0] for line in capsys.readouterr().out.splitlines()] == ["annex", "tue_lab", "ward"]
    renamed(NAVIGATION, "Laser", ">0.008<", ">-1.0<")(knowledge)
    assert checked("--all-sites", "--knowledge", str(knowledge)) == 2
    assert capsys.readouterr().err.count("KB163") == 1


def test_a_folder_without_sites_is_not_right(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A path that is misspelt, in a script, must not pass."""
    assert checked("--all-sites", "--knowledge", str(tmp_path / "nowhere")) == 2
    assert "there is no site in" in capsys.readouterr().err


def test_a_file_that_no_site_reads_is_told_once(knowledge: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Whatever site is checked, and however many; only --strict minds."""
    second_site(knowledge)
    text = (knowledge / AMIGO).read_text(encoding="utf-8").replace("amigo.owl", "third.owl")
    (knowledge / "robots" / "third.owl").write_text(text, encoding="utf-8")
    for sites in (("--all-sites",), ("--site", "annex")):
        assert checked(*sites, "--knowledge", str(knowledge)) == 0
        assert capsys.readouterr().err.count("third.owl KB010 warning") == 1
    assert checked("--strict", "--knowledge", str(knowledge)) == 2


def test_what_does_not_depend_on_a_fault_is_told_with_it(knowledge: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A misspelt term hides what others lack no more."""
    renamed(SITE, "drink_1", "core:isEmpty", "core:isEmty")(knowledge)
    renamed(NAVIGATION, "Laser", ">0.008<", ">-1.0<")(knowledge)
    assert checked("--knowledge", str(knowledge)) == 2
    told = capsys.readouterr().err
    assert {"KB011", "KB163"} <= set(told.split())


def test_a_place_that_lacks_something_hides_no_process(knowledge: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What robots and processes lack is told beside it."""
    for edit in (
        dropped(SITE, "at_bar", "inArea"),
        restricted(AMIGO, "radius_m", "", ""),
        renamed(NAVIGATION, "Localize_30_Pose", f"{link('hasBinding', NAVIGATION, 'Localize_30_Pose_odometry')}\n", ""),
    ):
        edit(knowledge)
    assert checked("--knowledge", str(knowledge)) == 2
    assert {"KB140", "KB131", "KB110"} <= set(capsys.readouterr().err.split())


def test_sarif_of_a_folder(knowledge: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One log, whether there is something wrong or not."""
    assert checked("--format", "sarif", "--knowledge", str(knowledge)) == 0
    assert json.loads(capsys.readouterr().out)["runs"][0]["results"] == []
    renamed(SITE, "drink_1", "core:isEmpty", "core:isEmty")(knowledge)
    assert checked("--format", "sarif", "--knowledge", str(knowledge)) == 2
    [result] = json.loads(capsys.readouterr().out)["runs"][0]["results"]
    assert result["ruleId"] == "KB011"


@pytest.mark.slow
def test_watching_tells_what_is_new_and_what_is_mended(knowledge: Path) -> None:
    """A saved file is checked again; Ctrl-C ends it quietly with status 130."""
    command = [sys.executable, "-P", "-m", "executive.cli", "kb", "check", "--watch", "--knowledge", str(knowledge)]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"}
    watching = subprocess.Popen(
        command, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True
    )
    assert watching.stdout is not None
    try:
        assert "no problems" in watching.stdout.readline()
        renamed(SITE, "drink_1", "core:isEmpty", "core:isEmty")(knowledge)
        assert "KB011 error drink_1: uses isEmty" in watching.stdout.readline()
        renamed(SITE, "drink_1", "core:isEmty", "core:isEmpty")(knowledge)
        mended = watching.stdout.readline()
        assert mended.startswith("mended: ")
        assert "isEmty" in mended
        assert "no problems" in watching.stdout.readline()
        watching.send_signal(signal.SIGINT)
        rest, _ = watching.communicate(timeout=30)
        assert (watching.returncode, rest) == (130, "")
    finally:
        watching.kill()
        watching.wait()
        watching.stdout.close()
