"""The corpus of wrong edits, continued: files that are no ontologies, and names and texts that try to reach Prolog."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from executive.cli import main
from kb.files import SHIPPED
from kb.store import KnowledgeBase
from kb.terms import Var, struct
from tests.kb.conftest import AMIGO, IRI, OBJECTS, SITE, Edit, added, ask, instead
from tests.kb.faults import Fault, fault, found, make, told_before_reasoning, written

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
