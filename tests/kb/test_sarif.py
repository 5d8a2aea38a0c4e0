import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from kb.problems import Problem, warn
from kb.sarif import sarif

TEXT: dict[str, Any] = {
    "type": "object",
    "required": ["text"],
    "properties": {"text": {"type": "string", "minLength": 1}},
}
LEVEL = {"enum": ["none", "note", "warning", "error"]}
PLACE = {
    "type": "object",
    "required": ["artifactLocation", "region"],
    "properties": {
        "artifactLocation": {
            "type": "object",
            "properties": {
                "uri": {"type": "string", "format": "uri-reference", "pattern": r"^[\x21-\x7e]+$"},
                "uriBaseId": {"type": "string"},
            },
            "additionalProperties": False,
        },
        "region": {
            "type": "object",
            "required": ["startLine"],
            "properties": {"startLine": {"type": "integer", "minimum": 1}},
            "additionalProperties": False,
        },
    },
    "additionalProperties": False,
}
RULE = {
    "type": "object",
    "required": ["id", "shortDescription", "fullDescription", "help"],
    "properties": {
        "id": {"type": "string"},
        "shortDescription": TEXT,
        "fullDescription": TEXT,
        "help": {"type": "object", "required": ["text"], "properties": {"text": TEXT["properties"]["text"]}},
        "defaultConfiguration": {"type": "object", "properties": {"level": LEVEL}, "additionalProperties": False},
    },
    "additionalProperties": False,
}
RESULT = {
    "type": "object",
    "required": ["ruleId", "message", "locations"],
    "properties": {
        "ruleId": {"type": "string"},
        "ruleIndex": {"type": "integer", "minimum": -1},
        "level": LEVEL,
        "message": TEXT,
        "locations": {
            "type": "array",
            "minItems": 1,
            "items": {
                "type": "object",
                "properties": {
                    "physicalLocation": PLACE,
                    "logicalLocations": {
                        "type": "array",
                        "items": {"type": "object", "properties": {"name": {"type": "string"}}},
                    },
                },
                "additionalProperties": False,
            },
        },
    },
    "additionalProperties": False,
}
DRIVER = {
    "type": "object",
    "required": ["name"],
    "properties": {"name": {"type": "string"}, "rules": {"type": "array", "uniqueItems": True, "items": RULE}},
    "additionalProperties": False,
}
RUN = {
    "type": "object",
    "required": ["tool"],
    "properties": {
        "tool": {"type": "object", "required": ["driver"], "properties": {"driver": DRIVER}},
        "originalUriBaseIds": {
            "type": "object",
            "additionalProperties": {
                "type": "object",
                "properties": {"uri": {"type": "string", "format": "uri", "pattern": "/$"}, "description": TEXT},
                "additionalProperties": False,
            },
        },
        "columnKind": {"enum": ["utf16CodeUnits", "unicodeCodePoints"]},
        "results": {"type": "array", "items": RESULT},
    },
    "additionalProperties": False,
}
SCHEMA: dict[str, Any] = {
    "type": "object",
    "required": ["$schema", "version", "runs"],
    "properties": {
        "$schema": {"type": "string"},
        "version": {"const": "2.1.0"},
        "runs": {"type": "array", "items": RUN},
    },
    "additionalProperties": False,
}
"""The parts of SARIF 2.1.0 that are used here, and what the standard and GitHub's code scanning require of them."""

WRONG = Problem(code="KB011", file=Path("my sites/a.owl"), line=7, entity="drink_1", message="uses Beeer")
DOUBTFUL = warn(Problem(code="KB018", file=Path("/elsewhere/b.owl"), line=0, entity="", message="has two"))


def test_a_log_is_what_the_standard_asks_for(tmp_path: Path) -> None:
    """Every required part is there, no part has another name, and it is JSON."""
    for problems in ([], [WRONG], [WRONG, DOUBTFUL]):
        log = sarif(problems, tmp_path)
        jsonschema.validate(json.loads(json.dumps(log)), SCHEMA)


def test_the_schema_notices_what_is_wrong(tmp_path: Path) -> None:
    """The check of the test above can fail."""
    spoilt: list[dict[str, Any]] = [{"message": {}}, {"level": "fatal"}, {"line": 3}, {"ruleIndex": -2}]
    for wrong in spoilt:
        log = sarif([WRONG], tmp_path)
        log["runs"][0]["results"][0].update(wrong)
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(log, SCHEMA)


def test_a_result_points_at_its_rule_and_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files below the base are named from there, others by their whole path; the first line where none is known."""
    monkeypatch.chdir(tmp_path)
    [run] = sarif([DOUBTFUL, WRONG, WRONG], tmp_path)["runs"]
    doubtful, wrong = run["results"]
    rules = run["tool"]["driver"]["rules"]
    assert [rules[r["ruleIndex"]]["id"] for r in run["results"]] == ["KB018", "KB011"]
    assert [r["level"] for r in run["results"]] == ["warning", "error"]
    assert wrong["message"]["text"] == "drink_1: uses Beeer"
    [place] = wrong["locations"]
    assert place["physicalLocation"] == {
        "artifactLocation": {"uri": "my%20sites/a.owl", "uriBaseId": "%SRCROOT%"},
        "region": {"startLine": 7},
    }
    assert place["logicalLocations"] == [{"name": "drink_1"}]
    [place] = doubtful["locations"]
    assert place == {
        "physicalLocation": {"artifactLocation": {"uri": "file:///elsewhere/b.owl"}, "region": {"startLine": 1}}
    }


def test_braces_are_no_placeholders(tmp_path: Path) -> None:
    """They are doubled in messages (3.11.5)."""
    wrong = Problem(code="KB120", file=Path("a.owl"), line=1, entity="", message="such as /{robot}/laser")
    [result] = sarif([wrong], tmp_path)["runs"][0]["results"]
    assert result["message"]["text"] == "such as /{{robot}}/laser"


def test_every_base_is_declared_and_every_rule_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A relative place names a base of the run, a whole one none (3.4.4); no rule is listed that no result has."""
    monkeypatch.chdir(tmp_path)
    [run] = sarif([DOUBTFUL, WRONG], tmp_path)["runs"]
    places = [r["locations"][0]["physicalLocation"]["artifactLocation"] for r in run["results"]]
    assert {p["uri"].startswith("file:"): p.get("uriBaseId") for p in places} == {True: None, False: "%SRCROOT%"}
    assert set(run["originalUriBaseIds"]) == {"%SRCROOT%"}
    assert {rule["id"] for rule in run["tool"]["driver"]["rules"]} == {r["ruleId"] for r in run["results"]}
    assert str(tmp_path) not in json.dumps(run)
