"""The corpus of wrong edits, continued: files that are no ontologies, and names and texts that try to reach Prolog."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from executive.cli import main
from kb.checking import check_folder
from kb.files import SHIPPED
from kb.learned import write_learned
from kb.revisions import read_revision
from kb.store import KnowledgeBase
from kb.terms import Var, struct
from tests.kb.conftest import AMIGO, IRI, OBJECTS, SITE, Edit, added, ask, instead
from tests.kb.faults import Fault, fault, found, make, refused, told_before_reasoning, written

GOOD = (SHIPPED / OBJECTS).read_bytes()
RDF = '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:owl="http://www.w3.org/2002/07/owl#">'
HEADER = f'<owl:Ontology rdf:about="{IRI}objects.owl">'


def spoiled(old: bytes, new: bytes) -> Edit:
    """Replace all of a text in objects.owl."""
    return written(OBJECTS, GOOD.replace(old, new))


def with_entities(declarations: str) -> Edit:
    """An objects.owl that declares XML entities."""
    text = f'<?xml version="1.0"?>\n<!DOCTYPE rdf:RDF [{declarations}]>\n{RDF}\n{HEADER}&e;</owl:Ontology></rdf:RDF>'
    return written(OBJECTS, text.encode())


def importing(iri: str) -> Edit:
    """Let the site import something in the place of amigo.owl."""
    return instead(SITE, f'imports rdf:resource="{IRI}amigo.owl"', f'imports rdf:resource="{iri}"')


def grown(file: str, size: int) -> Edit:
    """Make a file longer; on most disks, it takes no room."""
    return lambda folder: os.truncate(folder / file, size)


LAUGHS = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 10}">' for n in range(1, 12))

FILES = [
    fault("KB001", OBJECTS, "", spoiled(b"</owl:Class>", b"</owl:Klass>"), words="mismatched tag", at="</owl:Klass>"),
    fault("KB001", OBJECTS, "", spoiled(b"beer", b"\xff\xfe"), words="not well-formed", at="A bottle of"),
    fault("KB001", OBJECTS, "", spoiled(b"beer", b"be\x00er"), words="not well-formed", at="A bottle of"),
    fault("KB001", OBJECTS, "", spoiled(b"beer", b"be&er;"), words="undefined entity", at="be&er;"),
    fault(
        "KB001",
        SITE,
        "",
        instead(SITE, f'<owl:Ontology rdf:about="{IRI}tue_lab.owl">', "<owl:Ontology>"),
        words="0 ontology IRIs",
        at="<?xml",
    ),
    fault(
        "KB001",
        OBJECTS,
        "",
        spoiled(b"</rdf:RDF>", b'<owl:Ontology rdf:about="http://example.org/other.owl"/></rdf:RDF>'),
        words="2 ontology IRIs",
        at="<?xml",
    ),
    *(
        fault("KB001", SITE, "", instead(SITE, 'owl#drink_1">', f'owl#{name}">'), words="IRI", at=name)
        for name in ("drink 1", "a{b}", "back\\slash", "pipe|", "hat^")
    ),
    fault(
        "KB002",
        SITE,
        "",
        importing(f"{IRI}amico.owl"),
        words=f"imports {IRI}amico.owl|did you mean {IRI}amigo.owl?",
    ),
    fault("KB005", OBJECTS, "", grown(OBJECTS, 200_000_000), words="200 MB|at most 50"),
    *(
        fault(
            "KB006",
            SITE,
            "",
            importing(place),
            words=f"imports {place}|a place and not the IRI",
        )
        for place in ("package://robots/amigo.owl", "file:///tmp/amigo.owl")
    ),
    *(
        fault(
            "KB007", OBJECTS, "", written(OBJECTS, content.encode()), words=f"{name}|Save as > RDF/XML", at=content[:9]
        )
        for name, content in (
            ("Turtle", f"@prefix owl: <http://www.w3.org/2002/07/owl#> .\n<{IRI}objects.owl> a owl:Ontology .\n"),
            ("OWL functional syntax", f"Prefix(owl:=<http://www.w3.org/2002/07/owl#>)\nOntology(<{IRI}objects.owl>\n)"),
            ("OWL Manchester syntax", f"Prefix: owl: <http://www.w3.org/2002/07/owl#>\nOntology: <{IRI}objects.owl>\n"),
            ("OWL/XML", f'<Ontology xmlns="http://www.w3.org/2002/07/owl#" ontologyIRI="{IRI}objects.owl"/>'),
        )
    ),
    *(
        fault(
            "KB008", OBJECTS, "", with_entities(declarations), words=f"entity {name} is not a plain IRI", at="<!DOCTYPE"
        )
        for name, declarations in (
            ("e1", f'<!ENTITY e0 "ha">{LAUGHS}<!ENTITY e "&e11;">'),
            ("e", '<!ENTITY e SYSTEM "file:///etc/passwd">'),
            ("e", '<!ENTITY e SYSTEM "http://localhost/e">'),
            ("e", f'<!ENTITY e "{"x" * 1_000}">'),
            ("p", '<!ENTITY % p SYSTEM "file:///etc/passwd"> %p;'),
        )
    ),
]
"""What is no ontology file, or one that would do harm."""


UNUSED = [
    fault(
        "KB010",
        "robots/turtlebot.owl",
        "",
        written("robots/turtlebot.owl", f"{RDF}{HEADER}</owl:Ontology></rdf:RDF>".replace("objects", "tb").encode()),
        words=f"imported by no site|import {IRI}tb.owl where it is needed",
    ),
    fault("KB010", "draft.owl", "", written("draft.owl", b"not yet"), words="imported by no site|no ontology IRI"),
]
"""What is in the folder, but of no use."""


@pytest.mark.parametrize("case", UNUSED, ids=str)
def test_a_file_that_no_site_reads_is_told(case: Fault, folder: Path) -> None:
    """A warning, and the site can be used."""
    refused([case], folder)
    assert read_revision("tue_lab", folder).warnings == ()


def test_other_files_and_other_sites_are_no_strays(folder: Path) -> None:
    """Neither maps, nor what a second site or what was learned imports, nor a folder that is called like a file."""
    (folder / "notes.txt").write_text("not yet", encoding="utf-8")
    (folder / "old.owl").mkdir()
    (folder / "sites" / "annex").mkdir()
    annex = (folder / SITE).read_text(encoding="utf-8").replace("tue_lab.owl", "annex.owl")
    (folder / "sites" / "annex" / "annex.owl").write_text(annex.replace("amigo.owl", "third.owl"), encoding="utf-8")
    third = (folder / AMIGO).read_text(encoding="utf-8").replace("amigo.owl", "third.owl")
    (folder / "robots" / "third.owl").write_text(third, encoding="utf-8")
    assert check_folder(folder) == []
    write_learned(folder, "tue_lab", [])
    assert check_folder(folder) == []


def test_nothing_is_fetched_from_the_network(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not an import, not an entity, not a schema: no socket is ever opened."""

    def opened(*_: object) -> None:
        raise AssertionError("a socket was opened")

    monkeypatch.setattr(socket, "socket", opened)
    assert told_before_reasoning(folder) == []
    importing("http://www.w3.org/2004/02/skos/core")(folder)
    spoiled(b"<owl:Ontology", b'<owl:Ontology xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"')(folder)
    [problem] = told_before_reasoning(folder)
    assert problem.code == "KB002"


def test_a_misspelt_import_is_not_blamed_on_the_file(folder: Path) -> None:
    """Where an import is not found, or a site does not parse, no file is called of no use."""
    importing(f"{IRI}amico.owl")(folder)
    assert check_folder(folder) == []
    (folder / SITE).write_text("<", encoding="utf-8")
    assert check_folder(folder) == []


@pytest.mark.parametrize("case", FILES, ids=str)
def test_a_wrong_file_is_found(case: Fault, folder: Path) -> None:
    """The problem has its code, points at file and line, and says what helps; nothing else is blamed."""
    make([case], folder)
    found([case], folder, told_before_reasoning(folder))


def test_faults_of_several_files_are_told_at_once(folder: Path) -> None:
    """A file that does not parse hides no other one."""
    (folder / OBJECTS).write_bytes(GOOD[:2000])
    instead(AMIGO, "</owl:Class>", "</owl:Klass>")(folder)
    problems = told_before_reasoning(folder)
    assert {(p.code, p.file) for p in problems} == {("KB001", folder / OBJECTS), ("KB001", folder / AMIGO)}


def test_a_file_that_does_not_parse_hides_none_that_it_imports(folder: Path) -> None:
    """What a site imports is read although the site itself is refused: all is told at once, each file once."""
    for file in (SITE, OBJECTS, AMIGO):
        text = (folder / file).read_text(encoding="utf-8")
        (folder / file).write_text(text.replace("</rdf:RDF>", "</rdf:RFD>"), encoding="utf-8")
    problems = told_before_reasoning(folder)
    assert sorted((p.code, p.file) for p in problems) == sorted(("KB001", folder / f) for f in (SITE, OBJECTS, AMIGO))


def test_a_file_that_cannot_be_opened_is_refused(folder: Path) -> None:
    """In words, and not with an error of Python."""
    (folder / SITE).unlink()
    (folder / SITE).mkdir()
    [problem] = told_before_reasoning(folder)
    assert (problem.code, problem.file) == ("KB001", folder / SITE)
    assert problem.message == "cannot be read: Is a directory"


def test_links_to_nothing_do_no_harm(folder: Path) -> None:
    """As editors leave them for locks."""
    (folder / ".#tue_lab.owl").symlink_to("somebody@somewhere.1234:5678")
    assert told_before_reasoning(folder) == []
    assert check_folder(folder) == []


def test_files_may_import_each_other(folder: Path) -> None:
    """A cycle of imports is legal and blamed by nobody."""
    imports = f'<owl:imports rdf:resource="{IRI}find_empty_drink.owl"/>'
    added(OBJECTS, f'<rdf:Description rdf:about="{IRI}objects.owl">{imports}</rdf:Description>')(folder)
    assert told_before_reasoning(folder) == []


HOSTILE_NAMES = (
    "a'),halt,foo('",
    "x').%20:-%20halt.",
    "'",
    "''",
    "()",
    "X",
    "_",
    "$",
    "!",
    ":-",
    "0",
    "1.5e400",
    "end_of_file",
    "dr\u0456nk_1",  # a Cyrillic i
    "\uff44rink_1",  # a wide d
    "na\u0308ive",
    "\U0001f37a",
    "n" * 10_000,
)
HOSTILE_TEXTS = (
    "a'), halt, foo('",
    'say "no"',
    "back\\slash\\",
    "two\nlines\tand a tab",
    "%s ~w {} $HOME `halt` ${x}",
    "0'a",
    "\u202eevil\u202c",
    "\ufffd\U0001f37a",
    "<script>alert(1)</script> &amp;",
    "t" * 100_000,
)


def test_hostile_names_and_texts_come_back_from_prolog_as_they_were(folder: Path) -> None:
    """What is legal in OWL is an atom in Prolog, whatever its characters; nothing of it is run."""
    added(SITE, f'<owl:DatatypeProperty rdf:about="{IRI}tue_lab.owl#said"/>')(folder)
    for name in HOSTILE_NAMES:
        about = f'rdf:about="{IRI}tue_lab.owl#{name}"'
        beer = f'<rdf:type rdf:resource="{IRI}objects.owl#Beer"/>'
        added(SITE, f"<owl:NamedIndividual {about}>{beer}</owl:NamedIndividual>")(folder)
    for text in HOSTILE_TEXTS:
        escaped = text.replace("&", "&amp;").replace("<", "&lt;")
        of = f'rdf:about="{IRI}tue_lab.owl#drink_1"'
        added(SITE, f'<rdf:Description {of}><said xmlns="{IRI}tue_lab.owl#">{escaped}</said></rdf:Description>')(folder)
    knowledge = KnowledgeBase("tue_lab", folder)
    snapshot = knowledge.snapshot()
    key = snapshot.revision
    of_beer = struct(":", "kb_facts", struct("kind", key, Var("X"), "Beer"))
    beers = ask(struct("findall", Var("X"), of_beer, Var("Answer")))
    assert set(HOSTILE_NAMES) <= set(beers) == set(snapshot.ontology.individuals("Beer"))
    said = struct(":", "kb_facts", struct("value", key, "said", "drink_1", Var("X")))
    texts = ask(struct("findall", Var("X"), said, Var("Answer")))
    assert sorted(texts) == sorted(HOSTILE_TEXTS)
    for beer in HOSTILE_NAMES:
        knowledge.tell("isEmpty", beer, True)
        assert knowledge.snapshot().value("isEmpty", beer) is True
    knowledge.close()


@pytest.mark.parametrize("text", ["a'), halt, foo('", "../../etc/passwd", "", "x\ny", "%s~w", "\u202e", "t" * 5000])
def test_hostile_arguments_are_refused_in_words(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A command that is given what nobody knows ends with status 2 and says so."""
    for arguments in (
        ["plan", "FindEmptyDrink", f"room={text}"],
        ["plan", text or "'", "room=kitchen"],
        ["kb", "check", "--site", text],
    ):
        assert main(arguments) == 2
        assert capsys.readouterr().err.strip()
