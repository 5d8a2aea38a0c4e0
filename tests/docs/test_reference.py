"""The reference says what the code says: nothing is missing, nothing is left over."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from executive import Fleet, TaskHandle, TaskResult, TaskStatus
from executive.cli import main
from kb.files import SHIPPED
from planner.plan import Plan, PlannedStep, PlanStatus
from tests.docs.generated import trace_page, vocabulary_page
from tests.docs.pages import ROOT

REFERENCE = ROOT / "docs" / "reference"
_CODE = re.compile(r"\bKB\d{3}\b")
Golden = Callable[[Path, str], None]


def read(page: str) -> str:
    """A page of the reference."""
    return (REFERENCE / page).read_text(encoding="utf-8")


def test_the_trace_page_is_current(golden: Golden) -> None:
    """docs/reference/trace.md is what executive/trace.py says; `pytest --update-golden` writes it."""
    golden(REFERENCE / "trace.md", trace_page())


def test_the_vocabulary_page_is_current(golden: Golden) -> None:
    """docs/reference/vocabulary.md is what core.owl says; `pytest --update-golden` writes it."""
    golden(REFERENCE / "vocabulary.md", vocabulary_page(SHIPPED / "core" / "core.owl"))


@pytest.mark.parametrize(
    "command", [[], ["run"], ["plan"], ["explain"], ["trace"], ["kb"], ["kb", "check"]], ids=" ".join
)
def test_the_page_of_commands_has_the_help_of_each(
    command: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """docs/reference/cli.md shows what `--help` prints, word for word."""
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit) as ended:
        main([*command, "--help"])
    assert ended.value.code == 0
    assert f"```text\n{capsys.readouterr().out}```" in read("cli.md")


def test_no_command_is_missing_from_the_page_of_commands(capsys: pytest.CaptureFixture[str]) -> None:
    """The commands that the test above goes through are all there are."""
    found = []
    for group in ([], ["kb"]):
        with pytest.raises(SystemExit):
            main([*group, "--help"])
        names = re.findall(r"^    (\w+) ", capsys.readouterr().out, re.MULTILINE)
        found += [[*group, name] for name in names]
    assert found == [["run"], ["plan"], ["explain"], ["trace"], ["kb"], ["kb", "check"]]


def test_the_problem_codes_are_those_of_the_code() -> None:
    """Every code that the knowledge base reports is explained, in order, and none else is."""
    sources = [*(ROOT / "kb").glob("*.py"), ROOT / "kb" / "shapes.ttl"]
    used = {code for source in sources for code in _CODE.findall(source.read_text(encoding="utf-8"))}
    explained = re.findall(r"^\| (KB\d{3}) \|", read("problem-codes.md"), re.MULTILINE)
    assert explained == sorted(used)


def test_the_golog_page_has_every_construct() -> None:
    """Every program term to which trans/4 or final/2 gives a meaning is on the page, and none else."""
    transition = (ROOT / "planner" / "golog" / "transition.pl").read_text(encoding="utf-8")
    meant = set(re.findall(r"^(?:trans|final)\((\w+)\(", transition, re.MULTILINE))
    section = read("golog.md").split("## Constructs\n")[1].split("\n## ")[0]
    rows = re.findall(r"^\| `(\w+)\(", section, re.MULTILINE)
    assert len(rows) == len(set(rows))
    assert set(rows) == meant


def public_names(thing: type) -> set[str]:
    """The attributes, methods and members of a class that users may name."""
    own = {name for name, value in vars(thing).items() if not name.startswith("_") and not inspect.ismodule(value)}
    return own | {field.name for field in dataclasses.fields(thing)} if dataclasses.is_dataclass(thing) else own


@pytest.mark.parametrize("thing", [Fleet, TaskHandle, TaskResult, TaskStatus, Plan, PlannedStep, PlanStatus])
def test_the_page_of_the_python_api_has_every_public_name(thing: type) -> None:
    """Below the heading of each class stand all of its public names."""
    page = read("python-api.md")
    assert f"## {thing.__name__}\n" in page
    section = page.split(f"## {thing.__name__}\n")[1].split("\n## ")[0]
    for name in public_names(thing):
        assert re.search(rf"`{name}\b", section), f"{thing.__name__}.{name} is missing"
