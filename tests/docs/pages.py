"""The pages of the documentation, and what in them is a command, a file or a link."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]

_FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_DIRECTIVE = re.compile(r"<!-- test: (write|insert into) (\S+?)(?: before (.+?))? -->\n\n?\Z")
_STATUS = re.compile(r"\s+# exit status (\d+)$")


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A fenced block.

    Attributes:
        language: What stands behind the fence.
        action: What a reader does with the text: `write` it to a file, `insert into` a file; empty if nothing.
        file: That file.
        before: The text that the inserted one comes before.
    """

    language: str
    text: str
    action: str
    file: str
    before: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """A command line, the exit status that the page says it has, and the lines that it shows as output."""

    line: str
    status: int
    output: tuple[str, ...]


def page_id(page: Path) -> str:
    """Path of a page in the repository."""
    return str(page.relative_to(ROOT))


def blocks_of(page: Path) -> Iterator[Block]:
    """The fenced blocks of a page, in order. A comment `<!-- test: ... -->` before one says what it is for."""
    text = page.read_text(encoding="utf-8")
    for fence in _FENCE.finditer(text):
        directive = _DIRECTIVE.search(text[: fence.start()])
        action, file, before = directive.groups(default="") if directive else ("", "", "")
        yield Block(language=fence[1], text=fence[2], action=action, file=file, before=before)


def commands_of(block: Block) -> Iterator[Command]:
    """The commands of a block: of `sh` every line, of `console` those after `$ `, with the output below them."""
    if block.language == "sh":
        for line in block.text.splitlines():
            yield _command(line, ())
    if block.language == "console":
        for part in re.split(r"^\$ ", block.text, flags=re.MULTILINE)[1:]:
            line, *output = part.splitlines()
            yield _command(line, tuple(output))


def _command(line: str, output: tuple[str, ...]) -> Command:
    status = _STATUS.search(line)
    return Command(line=_STATUS.sub("", line), status=int(status[1]) if status else 0, output=output)
