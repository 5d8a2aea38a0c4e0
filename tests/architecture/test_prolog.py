"""How Prolog modules are named, what they may use, and that each loads cleanly by itself."""

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SEARCH_PATH = {"kb_rules": "kb/rules", "planner_golog": "planner/golog"}
# The packages whose Prolog a package may use: its own, and those below it.
MAY_USE = {"kb": {"kb"}, "planner": {"planner", "kb"}}
FILES = sorted(file.relative_to(ROOT) for package in MAY_USE for file in (ROOT / package).rglob("*.pl"))

# Facts come in by one door, and only facts change.
MAY_CHANGE_FACTS = {Path("kb/rules/facts.pl")}
CHANGES_FACTS = re.compile(r"\b(assert|asserta|assertz|retract|retractall|abolish)\(")
HAS_EFFECTS = re.compile(r"\b(halt|writeln?|print|consult|ensure_loaded)\(")


def code_of(file: Path) -> str:
    """The text of a Prolog file without comments and quoted texts."""
    text = (ROOT / file).read_text(encoding="utf-8")
    return re.sub(r"0'.|\"(?:\\.|[^\"\\])*\"|'(?:\\.|[^'\\])*'|/\*.*?\*/|%[^\n]*", " ", text, flags=re.DOTALL)


def test_there_are_prolog_files_to_check() -> None:
    """The folders were found: the tests below check something."""
    assert {str(file.parent) for file in FILES} >= set(SEARCH_PATH.values())


@pytest.mark.parametrize("file", FILES, ids=str)
def test_a_file_is_the_module_of_its_package(file: Path) -> None:
    """`planner/golog/search.pl` is module `planner_search`: module names are global in SWI-Prolog."""
    assert re.match(r"\s*:-\s*module\((\w+)\s*,", code_of(file)), f"{file} does not start with a module header"
    assert re.findall(r":-\s*module\((\w+)", code_of(file)) == [f"{file.parts[0]}_{file.stem}"]


@pytest.mark.parametrize("file", FILES, ids=str)
def test_modules_are_used_by_alias_and_downward(file: Path) -> None:
    """`use_module(kb_rules(...))`, of the own package or one below it."""
    code = code_of(file)
    for alias, argument in re.findall(r"\buse_module\((\w+)\((\w+)", code):
        if alias != "library":
            assert alias in SEARCH_PATH, f"{file} uses {alias}({argument}): the aliases are {sorted(SEARCH_PATH)}"
            assert alias.split("_")[0] in MAY_USE[file.parts[0]], f"{file} uses {alias}({argument}), which is above it"
    without_alias = re.findall(r"\buse_module\(\w+\s*[,)]", code)
    assert not without_alias, f"{file}: refer to files by alias: {without_alias}"


@pytest.mark.parametrize("file", FILES, ids=str)
def test_rules_are_pure(file: Path) -> None:
    """Only the module of facts changes facts; none writes, halts or loads by hand."""
    code = code_of(file)
    if file not in MAY_CHANGE_FACTS:
        assert not CHANGES_FACTS.findall(code), f"{file} changes facts: {sorted(MAY_CHANGE_FACTS)[0]} does that"
    assert not HAS_EFFECTS.findall(code)


@pytest.mark.parametrize("file", FILES, ids=str)
def test_a_module_loads_by_itself(file: Path, swipl: Callable[..., subprocess.CompletedProcess[str]]) -> None:
    """No warning, no error, no undefined predicate, whichever module is loaded first."""
    done = swipl("-g", "list_undefined", "-t", "halt", str(ROOT / file))
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
