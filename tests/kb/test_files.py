import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kb.files import SHIPPED, read_files
from kb.problems import OntologyRejected, Problem
from tests.kb.conftest import CORE, IRI, NAVIGATION, OBJECTS, SITE

TURTLE = "@prefix owl: <http://www.w3.org/2002/07/owl#> .\n<http://example.org/x.owl> a owl:Ontology .\n"
EMPTY_RDF = '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"></rdf:RDF>'
SMALL = (SHIPPED / OBJECTS).read_bytes()


def with_entities(declarations: str, use: str) -> str:
    """A whole ontology that declares XML entities and uses one in its label."""
    return (
        f'<?xml version="1.0"?>\n<!DOCTYPE rdf:RDF [{declarations}]>\n'
        '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:owl="http://www.w3.org/2002/07/owl#"'
        ' xmlns:rdfs="http://www.w3.org/2000/01/rdf-schema#">\n'
        f'<owl:Ontology rdf:about="{IRI}objects.owl"><rdfs:label>{use}</rdfs:label></owl:Ontology>\n</rdf:RDF>\n'
    )


BILLION_LAUGHS = with_entities(
    '<!ENTITY a0 "ha ha ha ha ha ">' + "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 12)), "&a11;"
)


def problems_of(folder: Path) -> list[Problem]:
    """What is wrong with the files of a folder."""
    with pytest.raises(OntologyRejected) as caught:
        read_files(folder / SITE, folder)
    return caught.value.problems


def cut(content: bytes) -> bytes:
    """The first half of a file, as after a crash while saving."""
    return content[: len(content) // 2]


@pytest.mark.parametrize(
    ("spoiled", "words"),
    [
        (cut(SMALL), "does not parse as RDF/XML"),
        (SMALL.replace(b"</owl:Class>", b"</owl:Klass>", 1), "mismatched tag"),
        (SMALL.replace(b"beer", b"\xff\xfe"), "does not parse as RDF/XML"),
        (TURTLE.encode(), "is not RDF/XML; in Protégé choose"),
        (b"\x7fELF\x02\x01\x01\x00\x00\xde\xad\xbe\xef", "is not RDF/XML"),
        (b"", "is not RDF/XML"),
        (b"<\x00\x01\x02", "does not parse"),
        (EMPTY_RDF.encode(), "0 ontology IRIs"),
        (
            SMALL.replace(b"</rdf:RDF>", b'<owl:Ontology rdf:about="http://example.org/x.owl"/></rdf:RDF>'),
            "2 ontology IRIs",
        ),
        (BILLION_LAUGHS.encode(), "the entity a1 is not a plain IRI"),
        (with_entities(f'<!ENTITY a "{"ha" * 1000}">', "&a;" * 1000).encode(), "the entity a is not a plain IRI"),
        (with_entities("<!ENTITY % a '<!ENTITY b \"c\">'> %a;", "&b;").encode(), "the entity a is not a plain IRI"),
        (with_entities("", "&undefined;").encode(), "undefined entity"),
    ],
    ids=[
        "cut",
        "tag",
        "bytes",
        "turtle",
        "binary",
        "empty",
        "junk",
        "none",
        "two",
        "bomb",
        "long",
        "parameter",
        "undefined",
    ],
)
def test_a_file_that_does_not_parse_is_refused(spoiled: bytes, words: str, tmp_path: Path) -> None:
    """KB001, the file, the line where the parser stopped, and why."""
    path = tmp_path / "spoiled.owl"
    path.write_bytes(spoiled)
    with pytest.raises(OntologyRejected) as caught:
        read_files(path, tmp_path)
    (problem,) = caught.value.problems
    assert (problem.code, problem.file, problem.entity) == ("KB001", path, "")
    assert words in problem.message
    assert problem.line > 0


def test_a_file_of_several_importers_is_blamed_once(folder: Path) -> None:
    """Eight files import the core; one message is enough."""
    (folder / CORE).write_bytes(cut((folder / CORE).read_bytes()))
    assert [(p.code, p.file) for p in problems_of(folder)] == [("KB001", folder / CORE)]


def test_all_broken_files_are_named(folder: Path) -> None:
    """Two files that do not parse are both told."""
    for file in (OBJECTS, NAVIGATION):
        (folder / file).write_bytes(cut((folder / file).read_bytes()))
    assert {p.file for p in problems_of(folder)} == {folder / OBJECTS, folder / NAVIGATION}


def test_files_of_others_do_no_harm(folder: Path) -> None:
    """A file that nothing imports may be broken; it is not read."""
    (folder / "draft.owl").write_text("not yet", encoding="utf-8")
    assert len(read_files(folder / SITE, folder).files) == 8


def test_an_external_entity_is_not_read(tmp_path: Path) -> None:
    """A file cannot pull in what stands elsewhere on the machine."""
    secret = tmp_path / "secret.txt"
    secret.write_text("the secret", encoding="utf-8")
    path = tmp_path / "spy.owl"
    path.write_text(with_entities(f'<!ENTITY spy SYSTEM "{secret.as_uri()}">', "&spy;"), encoding="utf-8")
    with pytest.raises(OntologyRejected, match="the entity spy is not a plain IRI") as caught:
        read_files(path, tmp_path)
    assert "the secret" not in str(caught.value)


def test_entities_that_abbreviate_iris_are_read(tmp_path: Path) -> None:
    """Older editors declare the namespaces as entities."""
    path = tmp_path / "old.owl"
    path.write_text(with_entities('<!ENTITY lab "http://example.org/lab#">', "&lab;table"), encoding="utf-8")
    assert "http://example.org/lab#table" in map(str, read_files(path, tmp_path).files[-1].graph.objects())


def test_imports_come_first_and_once() -> None:
    """Each file is there once, after all that it imports."""
    names = [file.path.name for file in read_files(SHIPPED / SITE, SHIPPED).files]
    assert len(names) == len(set(names)) == 8
    assert (names[0], names[-1]) == ("core.owl", "tue_lab.owl")
    assert names.index("objects.owl") < names.index("find_empty_drink.owl") < names.index("groundings.owl")


def test_the_shipped_core_stands_in(folder: Path) -> None:
    """A folder without a core uses the shipped one."""
    (folder / CORE).unlink()
    assert read_files(folder / SITE, folder).files[0].path == SHIPPED / CORE


def test_files_may_import_each_other(tmp_path: Path) -> None:
    """A circle of imports is read once round."""
    for name, other in (("a", "b"), ("b", "a")):
        text = with_entities("", "x").replace("objects.owl", f"{name}.owl")
        imports = f'<owl:imports xmlns:owl="http://www.w3.org/2002/07/owl#" rdf:resource="{IRI}{other}.owl"/>'
        (tmp_path / f"{name}.owl").write_text(text.replace("<rdfs:label>", f"{imports}<rdfs:label>"), encoding="utf-8")
    assert [f.path.stem for f in read_files(tmp_path / "a.owl", tmp_path).files] == ["b", "a"]


def test_the_digest_is_of_what_files_say(folder: Path) -> None:
    """It does not change with places, and changes with any byte."""
    shipped, copied = read_files(SHIPPED / SITE, SHIPPED), read_files(folder / SITE, folder)
    assert copied.digest == shipped.digest
    (folder / OBJECTS).write_bytes(SMALL + b"\n")
    assert read_files(folder / SITE, folder).digest != shipped.digest


def test_lines_are_where_entities_are_described() -> None:
    """Every named individual of the site is at the line that says so."""
    file = read_files(SHIPPED / SITE, SHIPPED).files[-1]
    lines = file.content.decode().splitlines()
    individuals = [entity for entity in file.lines if re.search(r"tue_lab\.owl#\w+$", entity)]
    assert len(individuals) > 20
    for entity in individuals:
        assert f'<owl:NamedIndividual rdf:about="{entity}"' in lines[file.line_of(entity) - 1]
    assert file.line_of("http://example.org/nothing") == 0


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_no_file_crashes_the_loader(tmp_path: Path, data: st.DataObject) -> None:
    """Whatever bytes a file has lost, gained or swapped: it is read, or refused as an ontology."""
    start = data.draw(st.integers(0, len(SMALL)))
    end = data.draw(st.integers(start, min(len(SMALL), start + 200)))
    junk = data.draw(
        st.binary(max_size=20) | st.sampled_from([b"<", b'"', b"&amp;", b"#", b"rdf:ID='1 2'", b"\xef\xbb\xbf", b"//"])
    )
    path = tmp_path / "fuzzed.owl"
    path.write_bytes(SMALL[:start] + junk + SMALL[end:])
    try:
        told = {file.path for file in read_files(path, tmp_path).files if file.path.parent == tmp_path}
    except OntologyRejected as rejected:
        told = {problem.file for problem in rejected.problems if problem.code in {"KB001", "KB002"}}
    assert told == {path}
