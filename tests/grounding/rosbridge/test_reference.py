"""The reference page of the wire format says what the code does."""

from __future__ import annotations

import re
from dataclasses import MISSING, fields
from pathlib import Path

from grounding.rosbridge.framing import Limits
from grounding.rosbridge.operations import OPERATIONS

_PAGE = (Path(__file__).parents[3] / "docs" / "reference" / "rosbridge.md").read_text(encoding="utf-8")


def test_the_page_lists_each_operation_with_its_fields() -> None:
    """Those that must be there and those that may."""
    rows = re.findall(r"^\| `(\w+)` \| ([^|]*)\| ([^|]*)\|$", _PAGE.split("## Operations")[1], re.MULTILINE)
    told = {op: (set(re.findall(r"`(\w+)`", must)), set(re.findall(r"`(\w+)`", may))) for op, must, may in rows}
    true = {
        op: (
            {field.name for field in fields(kind) if field.default is MISSING},
            {field.name for field in fields(kind) if field.default is not MISSING},
        )
        for op, kind in OPERATIONS.items()
    }
    assert {op: told[op] for op in true} == true


def test_the_page_s_limits_are_the_defaults() -> None:
    """Sizes, depth, numbers and the time that fragments are kept."""
    limits = Limits()
    for number in (limits.max_bytes, limits.max_objects, limits.max_items):
        assert f"{number:,}" in _PAGE
    for words in (
        f"{limits.max_depth} objects and lists in each other",
        f"at most {limits.max_unfinished} unfinished texts",
        f"forgotten {limits.fragment_timeout_s:g} s after",
    ):
        assert words in _PAGE
