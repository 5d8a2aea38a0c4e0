"""Mistakes that a person may make in ontology files, and what must be said of them."""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from kb import validation
from kb.checking import check_folder
from kb.codes import CODES
from kb.files import read_files
from kb.problems import OntologyRejected, Problem
from kb.revisions import read_revision
from kb.store import KnowledgeBase
from tests.kb.conftest import IRI, NAVIGATION, OBJECTS, SITE, Edit, added, individual, link


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """One mistake and the problem that it must be reported as.

    Attributes:
        file: Where the message must point.
        entity: What it must name; empty if it is the file itself.
        words: What the message must say.
        because: Other codes that the same mistake may raise.
        at: What stands in the line that the message must point at; the description of the entity where it is empty.
    """

    code: str
    file: str
    entity: str
    edits: tuple[Edit, ...]
    words: tuple[str, ...]
    because: frozenset[str] = field(default=frozenset())
    at: str = ""

    def __str__(self) -> str:
        return f"{self.code}-{self.entity or Path(self.file).name}"


def fault(code: str, file: str, entity: str, *edits: Edit, words: str, because: str = "", at: str = "") -> Fault:
    """A fault, its words separated by `|`."""
    return Fault(
        code=code,
        file=file,
        entity=entity,
        edits=edits,
        words=tuple(words.split("|")),
        because=frozenset(because.split()),
        at=at,
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


def a_limit(name: str, prop: str) -> Edit:
    """Add a class of areas that have at most one value of a property."""
    restriction = (
        f'<owl:Restriction><owl:onProperty rdf:resource="{IRI}core.owl#{prop}"/>'
        '<owl:maxCardinality rdf:datatype="http://www.w3.org/2001/XMLSchema#nonNegativeInteger">1</owl:maxCardinality>'
        "</owl:Restriction>"
    )
    axioms = f'<rdfs:subClassOf rdf:resource="{IRI}core.owl#Area"/><rdfs:subClassOf>{restriction}</rdfs:subClassOf>'
    return added(OBJECTS, f'<owl:Class rdf:about="{IRI}objects.owl#{name}">{axioms}</owl:Class>')


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


def written(file: str, content: bytes) -> Edit:
    """Write a whole file."""

    def edit(folder: Path) -> None:
        (folder / file).write_bytes(content)

    return edit


def problems_of(folder: Path) -> list[Problem]:
    """What is wrong with a folder of ontologies, so that it is refused."""
    with pytest.raises(OntologyRejected) as caught:
        KnowledgeBase("tue_lab", folder)
    return caught.value.problems


def all_told(folder: Path) -> list[Problem]:
    """All that is said of a folder of ontologies, whether it can be used or not."""
    unused = check_folder(folder)
    try:
        return [*unused, *read_revision("tue_lab", folder).warnings]
    except OntologyRejected as rejected:
        return [*unused, *rejected.problems]


def told_before_reasoning(folder: Path) -> list[Problem]:
    """What is said of the files themselves, their terms and shapes."""
    try:
        return validation.check(read_files(folder / SITE, folder))
    except OntologyRejected as rejected:
        return rejected.problems


def make(cases: Sequence[Fault], folder: Path) -> None:
    """Make mistakes."""
    for case in cases:
        for edit in case.edits:
            edit(folder)


def found(cases: Sequence[Fault], folder: Path, problems: Sequence[Problem]) -> None:
    """Each mistake is a problem with its code, place and words, and nothing else is blamed."""
    allowed = frozenset[str]().union(*({case.code} | case.because for case in cases))
    assert {p.code for p in problems} <= allowed, problems
    for case in cases:
        own = [p for p in problems if p.code == case.code and p.entity == case.entity]
        assert own, (case, problems)
        assert {p.file for p in own} == {folder / case.file}
        assert {p.severity for p in own} == {CODES[case.code].severity}
        if own[0].line:
            text = (folder / case.file).read_text(encoding="utf-8", errors="replace").splitlines()
            line = text[own[0].line - 1]
            assert (case.at or (f"#{case.entity}" if case.entity else "<owl:Ontology ")) in line
            assert case.at or "rdf:about" in line
        else:
            assert not case.entity, f"{case} points at no line"
        for word in case.words:
            assert any(word in p.message for p in own), f"{word!r} is in none of {[p.message for p in own]}"


def refused(cases: Sequence[Fault], folder: Path) -> None:
    """Make mistakes and check: what `found` says, after all stages."""
    make(cases, folder)
    found(cases, folder, all_told(folder))
