"""Edits of people's files: one statement changes, every other byte stays."""

from __future__ import annotations

from pathlib import Path

import pytest

from kb.editing import NotDescribed, with_statement, without_statements, write_over
from kb.files import SHIPPED

SITE = SHIPPED / "sites" / "tue_lab" / "tue_lab.owl"
IRI = "http://example.org/concertmaster/tue_lab.owl"
NOTE = '<n:note xmlns:n="http://n#">x &#60; y</n:note>'
RDF = 'xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"'


@pytest.mark.parametrize("iri", [IRI, f"{IRI}#amigo_1", f"{IRI}#at_bar"])
def test_a_statement_comes_and_goes(iri: str) -> None:
    """One line more, then the file as it was."""
    before = SITE.read_bytes()
    after = with_statement(before, iri, NOTE)
    added = [line for line in after.split(b"\n") if line not in before.split(b"\n")]
    assert added == [b"        " + NOTE.encode()]
    assert without_statements(after, iri, {"http://n#note"}) == before


@pytest.mark.parametrize(
    ("about", "base"),
    [
        ('rdf:about="#it"', 'xml:base="http://a/b.owl"'),
        ('rdf:ID="it"', 'xml:base="http://a/b.owl"'),
        ("rdf:about='http://a/b.owl#it'", ""),
        ('rdf:about="&b;it"', ""),
    ],
)
@pytest.mark.parametrize("end", [' note="a > b"/>', "></x>", "><y rdf:about='http://a/b.owl#it'/></x>"])
def test_an_entity_is_found_however_it_is_written(about: str, base: str, end: str) -> None:
    """Relative to the base, by entity, with a tag that ends in itself or not, and not within another."""
    doctype = '<!DOCTYPE r [<!ENTITY b "http://a/b.owl#">]>'
    content = f"{doctype}<r {RDF} {base}><!-- <x {about}/> --><x {about}{end}<z/></r>".encode()
    after = with_statement(content, "http://a/b.owl#it", NOTE)
    assert after.count(NOTE.encode()) == 1
    assert NOTE.encode() + b"\n    </x><z/></r>" in after
    assert NOTE.encode() not in without_statements(after, "http://a/b.owl#it", {"http://n#note"})


def test_what_is_not_described_is_not_changed() -> None:
    """The error names it."""
    with pytest.raises(NotDescribed, match="describes http://a/b#nothing"):
        with_statement(SITE.read_bytes(), "http://a/b#nothing", NOTE)


def test_a_file_is_written_over_whole(tmp_path: Path) -> None:
    """With its permissions, and nothing beside it."""
    file = tmp_path / "a.owl"
    file.write_bytes(b"old")
    file.chmod(0o640)
    write_over(file, b"new")
    assert (file.read_bytes(), file.stat().st_mode & 0o777) == (b"new", 0o640)
    assert list(tmp_path.iterdir()) == [file]
