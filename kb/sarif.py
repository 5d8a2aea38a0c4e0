"""Problems as SARIF 2.1.0, which code hosts and editors show beside the lines.

Field names and required parts after the OASIS standard "Static Analysis Results Interchange Format (SARIF)
Version 2.1.0", sections 3.4 (artifactLocation), 3.13 (sarifLog), 3.14 (run), 3.19 (toolComponent), 3.27 (result),
3.49 (reportingDescriptor). GitHub's code scanning asks for more than that: `$schema`, a full description and help of
each rule, a line of each result. It makes fingerprints itself, from the lines.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any
from urllib.parse import quote

from kb.codes import CODES
from kb.problems import Problem, in_order

_SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
_BASE = "%SRCROOT%"


def sarif(problems: Iterable[Problem], base: Path) -> dict[str, Any]:
    """One log with one run.

    Args:
        base: Files below it are named from there; others by their whole path.
    """
    found = in_order(problems)
    codes = sorted({p.code for p in found})
    driver = {"name": "concertmaster", "rules": [_rule(code) for code in codes]}
    return {
        "$schema": _SCHEMA,
        "version": "2.1.0",
        "runs": [
            {
                "tool": {"driver": driver},
                "columnKind": "unicodeCodePoints",
                # Where that is, whoever reads the log knows: with the path, logs would differ from machine to machine.
                "originalUriBaseIds": {_BASE: {"description": {"text": "The folder in which the check was run."}}},
                "results": [_result(p, codes.index(p.code), base) for p in found],
            }
        ],
    }


def _rule(code: str) -> dict[str, Any]:
    about = CODES[code]
    return {
        "id": code,
        "shortDescription": {"text": about.meaning},
        "fullDescription": {"text": f"{about.meaning} {about.advice}"},
        "help": {"text": about.advice, "markdown": about.advice},
        "defaultConfiguration": {"level": str(about.severity)},
    }


def _result(problem: Problem, rule: int, base: Path) -> dict[str, Any]:
    # Of a problem with a whole file, the first line is as good as any.
    place = {"artifactLocation": _location(problem.file, base), "region": {"startLine": max(1, problem.line)}}
    location: dict[str, Any] = {"physicalLocation": place}
    if problem.entity:
        location["logicalLocations"] = [{"name": problem.entity}]
    return {
        "ruleId": problem.code,
        "ruleIndex": rule,
        "level": str(problem.severity),
        "message": {"text": _text(problem)},
        "locations": [location],
    }


def _text(problem: Problem) -> str:
    """A message, with braces as the standard wants them, which takes `{0}` for a place to fill in (3.11.5)."""
    told = f"{problem.entity}: {problem.message}" if problem.entity else problem.message
    return told.replace("{", "{{").replace("}", "}}")


def _location(file: Path, base: Path) -> dict[str, str]:
    whole, base = file.resolve(), base.resolve()
    if whole.is_relative_to(base):
        return {"uri": quote(whole.relative_to(base).as_posix()), "uriBaseId": _BASE}
    return {"uri": whole.as_uri()}
