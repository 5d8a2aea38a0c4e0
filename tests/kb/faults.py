"""Mistakes that a person may make in ontology files, and what must be said of them."""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from kb.problems import OntologyRejected, Problem
from kb.store import KnowledgeBase
from tests.kb.conftest import IRI, NAVIGATION, Edit, added, individual, link


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """One mistake and the problem that it must be reported as.

    Attributes:
        file: Where the message must point.
        entity: What it must name; empty if it is the file itself.
        words: What the message must say.
        because: Other codes that the same mistake may raise.
    """

    code: str
    file: str
    entity: str
    edits: tuple[Edit, ...]
    words: tuple[str, ...]
    because: frozenset[str] = field(default=frozenset())

    def __str__(self) -> str:
        return f"{self.code}-{self.entity or Path(self.file).name}"


def fault(code: str, file: str, entity: str, *edits: Edit, words: str, because: str = "") -> Fault:
    """A fault, its words separated by `|`."""
    return Fault(
        code=code,
        file=file,
        entity=entity,
        edits=edits,
        words=tuple(words.split("|")),
        because=frozenset(because.split()),
    )


def removed(file: str) -> Edit:
    """Remove a file."""
    return lambda folder: (folder / file).unlink()


def copied(file: str, to: str) -> Edit:
    """Copy a file."""

    def edit(folder: Path) -> None:
        shutil.copy(folder / file, folder / to)

    return edit


def restricted(file: str, prop: str, old: str, new: str) -> Edit:
    """Replace a text within the class restriction on a property."""

    def edit(folder: Path) -> None:
        text = (folder / file).read_text(encoding="utf-8")
        pattern = (
            rf"        <rdfs:subClassOf>\s*<owl:Restriction>\s*<owl:onProperty [^>]*#{prop}\"/>.*?</rdfs:subClassOf>\n"
        )
        (block,) = re.findall(pattern, text, re.DOTALL)
        assert old in block
        (folder / file).write_text(text.replace(block, block.replace(old, new) if new else ""), encoding="utf-8")

    return edit


def a_class(file: str, name: str, *above: str) -> Edit:
    """Add a class."""
    lines = [f'<rdfs:subClassOf rdf:resource="{IRI}{iri}"/>' for iri in above]
    return added(file, f'<owl:Class rdf:about="{IRI}{Path(file).name}#{name}">{"".join(lines)}</owl:Class>')


def travel_duration(name: str, service: str, *fields: str) -> Edit:
    """Add a way to estimate travel, with some of the fields of the shipped one."""
    return individual(
        NAVIGATION,
        name,
        "TravelDuration",
        f"<core:serviceName>{service}</core:serviceName>",
        link("travelGoal", NAVIGATION, "Navigate_location"),
        link("travelingRobot", NAVIGATION, "Navigate_robot"),
        *(link("hasRequestField", NAVIGATION, f"Navigate_duration_{field}") for field in fields),
    )


def problems_of(folder: Path) -> list[Problem]:
    """What is wrong with a folder of ontologies."""
    with pytest.raises(OntologyRejected) as caught:
        KnowledgeBase("tue_lab", folder)
    return caught.value.problems


def refused(cases: Sequence[Fault], folder: Path) -> None:
    """Make mistakes and load: each is a problem with its code, place and words, and nothing else is blamed."""
    for case in cases:
        for edit in case.edits:
            edit(folder)
    problems = problems_of(folder)
    allowed = frozenset[str]().union(*({case.code} | case.because for case in cases))
    assert {p.code for p in problems} <= allowed, problems
    for case in cases:
        found = [p for p in problems if p.code == case.code and p.entity == case.entity]
        assert found, (case, problems)
        assert {p.file for p in found} == {folder / case.file}
        text = (folder / case.file).read_text(encoding="utf-8").splitlines()
        described = f"#{case.entity}" if case.entity else "<owl:Ontology "
        line = text[found[0].line - 1]
        assert described in line
        assert "rdf:about" in line
        for word in case.words:
            assert any(word in p.message for p in found), f"{word!r} is in none of {[p.message for p in found]}"
