"""Problems as SARIF 2.1.0, which code hosts and editors show beside the lines.

Field names and required parts after the OASIS standard "Static Analysis Results Interchange Format (SARIF)
Version 2.1.0", sections 3.13 (sarifLog), 3.14 (run), 3.19 (toolComponent), 3.27 (result), 3.49 (reportingDescriptor).
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any
from urllib.parse import quote

from kb.codes import CODES
from kb.problems import Problem, in_order


def sarif(problems: Iterable[Problem], base: Path) -> dict[str, Any]:
    """One log with one run.

    Args:
        base: Files below it are named from there; others by their whole path.
    """
    found = in_order(problems)
    codes = sorted({p.code for p in found})
    driver = {"name": "concertmaster", "rules": [_rule(code) for code in codes]}
    return {
        "version": "2.1.0",
        "runs": [
            {
                "tool": {"driver": driver},
                "columnKind": "unicodeCodePoints",
                "results": [_result(p, codes.index(p.code), base) for p in found],
            }
        ],
    }


def _rule(code: str) -> dict[str, Any]:
    about = CODES[code]
    return {
        "id": code,
        "shortDescription": {"text": about.meaning},
        "help": {"text": about.advice},
        "defaultConfiguration": {"level": str(about.severity)},
    }


def _result(problem: Problem, rule: int, base: Path) -> dict[str, Any]:
    place: dict[str, Any] = {"artifactLocation": {"uri": _uri(problem.file, base)}}
    if problem.line:
        place["region"] = {"startLine": problem.line}
    location: dict[str, Any] = {"physicalLocation": place}
    if problem.entity:
        location["logicalLocations"] = [{"name": problem.entity}]
    return {
        "ruleId": problem.code,
        "ruleIndex": rule,
        "level": str(problem.severity),
        "message": {"text": f"{problem.entity}: {problem.message}" if problem.entity else problem.message},
        "locations": [location],
    }


def _uri(file: Path, base: Path) -> str:
    whole, base = file.resolve(), base.resolve()
    return quote(whole.relative_to(base).as_posix()) if whole.is_relative_to(base) else whole.as_uri()
