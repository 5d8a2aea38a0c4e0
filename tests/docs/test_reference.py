"""The reference says what the code says: nothing is missing, nothing is left over."""

from __future__ import annotations

import argparse
import dataclasses
import inspect
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from executive import Fleet, TaskHandle, TaskResult, TaskStatus
from executive.cli import main, make_parser
from kb.files import SHIPPED
from planner.plan import Plan, PlannedStep, PlanStatus
from tests.docs.generated import failures_page, trace_page, vocabulary_page
from tests.docs.pages import ROOT
from tests.docs.problem_codes import problem_codes_page

REFERENCE = ROOT / "docs" / "reference"
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


def test_the_page_of_failures_is_current(golden: Golden) -> None:
    """docs/reference/failures.md is what failures.owl says; `pytest --update-golden` writes it."""
    golden(REFERENCE / "failures.md", failures_page(SHIPPED / "failures" / "failures.owl"))


def commands(parser: argparse.ArgumentParser, *above: str) -> Iterator[tuple[str, ...]]:
    """All commands, those within commands too."""
    yield above
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, within in action.choices.items():
                yield from commands(within, *above, name)


@pytest.mark.parametrize("command", list(commands(make_parser())), ids=" ".join)
def test_the_page_of_commands_has_the_help_of_each(
    command: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """docs/reference/cli.md shows what `--help` prints, word for word."""
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit) as ended:
        main([*command, "--help"])
    assert ended.value.code == 0
    assert f"```text\n{capsys.readouterr().out}```" in read("cli.md")


def test_the_page_of_problem_codes_is_current(golden: Golden, tmp_path: Path) -> None:
    """docs/reference/problem-codes.md is what kb/codes.py says, with examples of the corpus of faults."""
    golden(REFERENCE / "problem-codes.md", problem_codes_page(tmp_path))


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
