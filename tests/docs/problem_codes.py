"""Writes the page of problem codes: what each means, and how the shortest edit of the corpus is mended."""

from __future__ import annotations

import difflib
import shutil
import textwrap
from pathlib import Path

from kb.codes import CODES
from kb.files import SHIPPED
from tests.docs.generated import MARK
from tests.kb.corpus import CORPUS
from tests.kb.faults import Fault

_LONGEST_LINE = 200
_LARGEST_BYTES = 1_000_000
_MOST_LINES = 30
_INTRODUCTION = """\
What `concertmaster kb check` reports, and every command that loads the knowledge base. A problem is one line:
`file:line CODE severity Entity: what is wrong; what would be right`. With an error the files are not used; a warning
stops nothing. How to run the check: [Check a knowledge base](../how-to/check-a-knowledge-base.md).
"""
_EXAMPLES = """\
## Examples

Each shows a change of the shipped files: lines that are wrong begin with `-`, what is right begins with `+`. Tests make
each change and look for the code, the file, the line and the entity.
"""


def problem_codes_page(scratch: Path) -> str:
    """docs/reference/problem-codes.md.

    Args:
        scratch: An empty folder, to make the mistakes in.
    """
    lines = [
        "# Problem codes",
        "",
        MARK,
        _INTRODUCTION,
        "| code | severity | meaning | what to do |",
        "|---|---|---|---|",
    ]
    lines += [f"| {code} | {about.severity} | {about.meaning} | {about.advice} |" for code, about in CODES.items()]
    lines += ["", _EXAMPLES]
    shortest: dict[str, list[str]] = {}
    for number, case in enumerate(c for c in CORPUS if c.edits):
        mended = _mended(case, scratch / str(number))
        if case.code not in shortest or len("".join(mended)) < len("".join(shortest[case.code])):
            shortest[case.code] = mended
    for code, mended in sorted(shortest.items()):
        lines += [f"### {code}", "", "```diff", *mended, "```", ""]
    return "\n".join(lines)


def _mended(case: Fault, folder: Path) -> list[str]:
    """From wrong to right, file by file."""
    shutil.copytree(SHIPPED, folder)
    for edit in case.edits:
        edit(folder)
    names = {str(p.relative_to(root)) for root in (SHIPPED, folder) for p in root.rglob("*") if p.is_file()}
    lines: list[str] = []
    for name in sorted(names):
        changes = _changes(folder / name, SHIPPED / name)
        if changes:
            lines += [f"{name}, {case.entity}" if case.entity and name == case.file else name, *changes]
    shutil.rmtree(folder)
    return lines


def _changes(wrong: Path, right: Path) -> list[str]:
    """What becomes of the lines of a file; of whole files, that they do."""
    if not wrong.exists():
        return ["- (no such file)", "+ (the shipped file)"]
    if not right.exists():
        return ["- (a second file)", "+ (no such file)"]
    if wrong.stat().st_size > _LARGEST_BYTES:
        return [f"- (a file of {wrong.stat().st_size // 1_000_000} MB)", "+ (the shipped file)"]
    if wrong.read_bytes() == right.read_bytes():
        return []
    difference = difflib.unified_diff(_lines(wrong), _lines(right), lineterm="", n=0)
    changes = [line for line in list(difference)[2:] if not line.startswith("@@")]
    if sum(line.startswith("+") for line in changes) > _MOST_LINES:
        changes = [*(line for line in changes if line.startswith("-")), "+(the shipped file)"]
    return _dedented(changes)


def _lines(file: Path) -> list[str]:
    return file.read_bytes().decode(errors="replace").replace("\x00", "\ufffd").splitlines()


def _dedented(changes: list[str]) -> list[str]:
    texts = textwrap.dedent("\n".join(line[1:] for line in changes)).split("\n")
    signed = [f"{change[0]} {text}".rstrip() for change, text in zip(changes, texts, strict=True)]
    return [line if len(line) <= _LONGEST_LINE else f"{line[:_LONGEST_LINE]}..." for line in signed]
