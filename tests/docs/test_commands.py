"""What the pages tell a reader to do is done, page by page, in order, in a folder of its own."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.pages import PAGES, ROOT, Block, Command, blocks_of, commands_of, page_id

RUN_HERE = ("concertmaster", "cp", "python", "sed")
RUN_ELSEWHERE = {
    "git": "clones the repository that the tests stand in",
    "make": "tests run inside what `make` sets up; CI calls it (.ci/run)",
    "pytest": "would run these tests once more",
    "source": "enters the environment that the tests run in",
}
"""First words of the commands that are not run here, and why."""

MANY_COMMANDS = 7
"""A command takes about 3 s, most of it to read the knowledge base; the test of a page with more is slow."""


def is_run(block: Block) -> bool:
    """Whether a block has something to do."""
    commands = [c.line.split()[0] in RUN_HERE for c in commands_of(block)]
    return any(commands) or bool(block.action) or block.language == "python"


def moves_robots(block: Block) -> bool:
    """Whether a block runs the simulated fleet, which takes a while."""
    return "concertmaster run" in block.text or ".wait()" in block.text


def marks_of(page: Path) -> list[pytest.MarkDecorator]:
    """Those of the test of a page."""
    blocks = list(blocks_of(page))
    commands = [command for block in blocks for command in commands_of(block)]
    slow = [pytest.mark.slow] if any(map(moves_robots, blocks)) or len(commands) > MANY_COMMANDS else []
    extras = [
        getattr(pytest.mark, name)
        for name in ("ros1", "ros2")
        if any(f"grounding.{name}." in block.text for block in blocks)
    ]
    return [*slow, *extras]


RUNNABLE = [
    pytest.param(page, id=page_id(page), marks=marks_of(page)) for page in PAGES if any(map(is_run, blocks_of(page)))
]


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the reasoner has found out stays here, not in the reader's home."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def environment(tmp_path: Path, cache: Path) -> dict[str, str]:
    """An environment in which `concertmaster` and `python` are those of this repository."""
    commands = tmp_path / "bin"
    commands.mkdir()
    # -P: the folder of the page links to the packages, which must not be imported from there.
    for name, arguments in (("python", ""), ("concertmaster", "-m executive.cli")):
        command = commands / name
        command.write_text(f'#!/bin/sh\nexec {sys.executable} -P {arguments} "$@"\n', encoding="utf-8")
        command.chmod(0o755)
    path = f"{commands}{os.pathsep}{os.environ.get('PATH', os.defpath)}"
    return os.environ | {"PATH": path, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(cache), "COLUMNS": "80"}


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A folder that looks like the checkout to a reader who only reads from it."""
    folder = tmp_path / "checkout"
    folder.mkdir()
    for name in ("kb", "sim"):
        (folder / name).symlink_to(ROOT / name)
    return folder


@pytest.mark.parametrize("page", RUNNABLE)
def test_a_page_does_what_it_shows(page: Path, checkout: Path, environment: dict[str, str]) -> None:
    """Every command ends with the status that the page says, after the output that the page shows."""
    blocks = list(blocks_of(page))
    for block, after in zip(blocks, [*blocks[1:], None], strict=True):
        if block.action:
            edit(checkout, block)
        elif block.language == "python":
            shown = after.text.splitlines() if after and after.language == "text" else []
            script = Command(line="python -", status=0, output=tuple(shown))
            check(script, checkout, environment, block.text)
        for command in commands_of(block):
            if command.line.split()[0] in RUN_HERE:
                check(command, checkout, environment, "")


def edit(folder: Path, block: Block) -> None:
    """Do to a file what the page says."""
    file = folder / block.file
    assert folder.resolve() in file.resolve().parents, f"the page would change {file}, which is not the reader's"
    if block.action == "write":
        file.write_text(block.text, encoding="utf-8")
        return
    text = file.read_text(encoding="utf-8")
    assert text.count(block.before) == 1, f"{block.file} has {text.count(block.before)} times: {block.before}"
    file.write_text(text.replace(block.before, block.text + block.before), encoding="utf-8")


def check(command: Command, folder: Path, environment: dict[str, str], script: str) -> None:
    """Run a command and compare what comes of it with what the page says."""
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command.line],
        cwd=folder,
        env=environment,
        input=script,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert done.returncode == command.status, f"{command.line}: status {done.returncode}\n{done.stdout}"
    remaining = iter(done.stdout.splitlines())
    for wanted in command.output:
        if wanted.strip() == "...":
            continue
        pattern = re.escape(wanted.rstrip()).replace(r"\.\.\.", ".*")
        assert any(re.fullmatch(pattern, line.rstrip()) for line in remaining), (
            f"{command.line} does not print, or not in this place:\n{wanted}\nit prints:\n{done.stdout}"
        )


@pytest.mark.parametrize("page", PAGES, ids=page_id)
def test_every_command_is_run_or_listed_with_a_reason(page: Path) -> None:
    """No command in a page is left out by mistake."""
    for block in blocks_of(page):
        for command in commands_of(block):
            assert command.line.split()[0] in {*RUN_HERE, *RUN_ELSEWHERE}, command.line


@pytest.mark.slow
def test_the_demo_prints_what_the_readme_shows(checkout: Path, environment: dict[str, str]) -> None:
    """The first output in the README is that of the command behind `make demo`."""
    [line] = re.findall(r"^demo:.*\n\t(.+)$", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    shown = next(block for block in blocks_of(ROOT / "README.md") if block.language == "text")
    check(Command(line=line, status=0, output=tuple(shown.text.splitlines())), checkout, environment, "")


def test_there_are_commands_to_run() -> None:
    """The pages were found and read: tutorial, README and how-to guides have commands."""
    names = {str(parameter.id) for parameter in RUNNABLE}
    assert {"README.md", "docs/tutorial/find-empty-drink.md", "docs/how-to/add-a-task.md"} <= names


def test_wrong_output_is_noticed(checkout: Path, environment: dict[str, str]) -> None:
    """A line that a command does not print, a wrong order and a wrong status each fail."""
    says = "python -c 'print(1); print(2)'"
    check(Command(line=says, status=0, output=("1", "...", "2")), checkout, environment, "")
    for wrong in (
        Command(line=says, status=0, output=("3",)),
        Command(line=says, status=0, output=("2", "1")),
        Command(line=says, status=2, output=()),
    ):
        with pytest.raises(AssertionError):
            check(wrong, checkout, environment, "")
