import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rdflib.compare import isomorphic

from kb.files import SHIPPED, read_files
from kb.problems import OntologyRejected, Problem
from tests.kb.conftest import CORE, IRI, NAVIGATION, OBJECTS, SITE

TURTLE = "@prefix owl: <http://www.w3.org/2002/07/owl#> .\n<http://example.org/x.owl> a owl:Ontology .\n"
EMPTY_RDF = '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"></rdf:RDF>'
FILES = 9  # the site and all that it imports
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


def refused(path: Path, content: bytes) -> Problem:
    """The one problem of a file with this content."""
    path.write_bytes(content)
    with pytest.raises(OntologyRejected) as caught:
        read_files(path, path.parent)
    (problem,) = caught.value.problems
    assert (problem.file, problem.entity) == (path, "")
    return problem


@pytest.mark.parametrize(
    ("spoiled", "words", "line"),
    [
        (cut(SMALL), "does not parse as RDF/XML", b"\n"),
        (SMALL.replace(b"</owl:Class>", b"</owl:Klass>", 1), "mismatched tag", b"</owl:Klass>"),
        (SMALL.replace(b"beer", b"\xff\xfe"), "not well-formed", b"\xff\xfe"),
        (SMALL.replace(b"beer", b"b\x00er"), "not well-formed", b"b\x00er"),
        (b"<\x00\x01\x02", "does not parse", b"<"),
        (EMPTY_RDF.encode(), "0 ontology IRIs", b"<rdf:RDF"),
        (
            SMALL.replace(b"</rdf:RDF>", b'<owl:Ontology rdf:about="http://example.org/x.owl"/></rdf:RDF>'),
            "2 ontology IRIs",
            b"<?xml",
        ),
        (with_entities("", "&undefined;").encode(), "undefined entity", b"&undefined;"),
        (with_entities("", "x").replace(f"{IRI}obj", "http://a b/").encode(), "Invalid IRI", b"http://a b/"),
        (with_entities("<!ENTITY q 'u'>", "&q;").replace(f"{IRI}obj", "http://a b/").encode(), "IRI", b"http://a b/"),
        (with_entities("", "é").replace("?>", ' encoding="no-such"?>').encode(), "unknown encoding", b"<?xml"),
        (SMALL.replace(b'xml:lang="en"', b'xml:lang="e n"'), "language tag", b"e n"),
    ],
    ids=["cut", "tag", "bytes", "nul", "junk", "none", "two", "undefined", "iri", "quoted", "encoding", "language"],
)
def test_a_file_that_does_not_parse_is_refused(spoiled: bytes, words: str, line: bytes, tmp_path: Path) -> None:
    """KB001, the line where the parser stopped, and why."""
    problem = refused(tmp_path / "spoiled.owl", spoiled)
    assert problem.code == "KB001"
    assert words in problem.message
    if line != b"\n":
        assert line in spoiled.split(b"\n")[problem.line - 1]
    assert 0 < problem.line <= spoiled.count(b"\n") + 1
    assert str(tmp_path) not in problem.message


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (TURTLE, "Turtle"),
        ("# made by hand\n" + TURTLE, "Turtle"),
        ("<http://example.org/x> <http://example.org/y> <http://example.org/z> .\n", "Turtle"),
        ("Prefix(:=<http://example.org/>)\nOntology(<http://example.org/x.owl>)\n", "OWL functional syntax"),
        ("Prefix: : <http://example.org/>\nOntology: <http://example.org/x.owl>\n", "OWL Manchester syntax"),
        (
            '<?xml version="1.0"?>\n<Ontology xmlns="http://www.w3.org/2002/07/owl#" ontologyIRI="http://x.org/x"/>',
            "OWL/XML",
        ),
        ('{"@id": "http://example.org/x.owl"}', "JSON"),
        ("<!DOCTYPE html>\n<html><body>Sign in</body></html>", "a web page"),
        ("format-version: 1.2\n", "OBO"),
        ('<?xml version="1.0"?><robot name="amigo"/>', "outermost element is robot"),
        ("\x7fELF\x02\x01\x01", "something else"),
        ("", "empty"),
    ],
)
def test_other_syntaxes_are_named(content: str, words: str, tmp_path: Path) -> None:
    """KB007 says what the file is, and how to save it as RDF/XML."""
    problem = refused(tmp_path / "other.owl", content.encode())
    assert (problem.code, 0 < problem.line < 3) == ("KB007", True)
    assert words in problem.message
    assert "in Protégé choose" in problem.message


@pytest.mark.parametrize(
    ("content", "entity"),
    [
        (BILLION_LAUGHS, "a1"),
        (with_entities(f'<!ENTITY a "{"ha" * 1000}">', "&a;" * 1000), "a"),
        (with_entities("<!ENTITY % a '<!ENTITY b \"c\">'> %a;", "&b;"), "a"),
    ],
    ids=["bomb", "long", "parameter"],
)
def test_entities_can_not_grow(content: str, entity: str, tmp_path: Path) -> None:
    """KB008: nothing is expanded that is more than an IRI."""
    problem = refused(tmp_path / "bomb.owl", content.encode())
    assert (problem.code, problem.line) == ("KB008", 2)
    assert f"the entity {entity} is not a plain IRI" in problem.message


def test_a_file_too_large_is_not_read(tmp_path: Path) -> None:
    """KB005 states the size and the limit; the file is not loaded into memory."""
    path = tmp_path / "huge.owl"
    with path.open("wb") as stream:
        stream.truncate(200_000_000)
    with pytest.raises(OntologyRejected) as caught:
        read_files(path, tmp_path)
    (problem,) = caught.value.problems
    assert problem.code == "KB005"
    assert "has 200 MB, and at most 50 are read" in problem.message


@pytest.mark.parametrize("encoding", ["iso-8859-1", "utf-16", "utf-8-sig", "cp1252"])
def test_other_encodings_are_read(encoding: str, tmp_path: Path) -> None:
    """A file that declares its encoding and keeps to it is read as it is meant."""
    declared = with_entities("", "Café").replace('"1.0"?>', f'"1.0" encoding="{encoding.removesuffix("-sig")}"?>')
    path = tmp_path / "old.owl"
    path.write_bytes(declared.encode(encoding))
    assert "Café" in map(str, read_files(path, tmp_path).files[-1].graph.objects())


def test_an_encoding_changes_nothing(tmp_path: Path) -> None:
    """A file in another encoding says the same, at the same lines."""
    text = (SHIPPED / CORE).read_text(encoding="utf-8")
    (tmp_path / "core.owl").write_text(text.replace("?>", ' encoding="UTF-16"?>', 1), encoding="utf-16")
    (slow,), (quick,) = (read_files(path, tmp_path).files for path in (tmp_path / "core.owl", SHIPPED / CORE))
    assert slow.graph != quick.graph  # else it would be the same object, and the next line prove nothing
    assert isomorphic(slow.graph, quick.graph)
    assert slow.lines == quick.lines


def importing(iri: str) -> str:
    """An ontology that imports another one."""
    imports = f'<owl:imports rdf:resource="{iri}"/>'
    return with_entities("", "x").replace("<rdfs:label>", f"{imports}<rdfs:label>")


@pytest.mark.parametrize("iri", ["package://knowrob/owl/knowrob.owl", "file:///home/somebody/knowrob.owl"])
def test_imports_of_places_are_refused(iri: str, tmp_path: Path) -> None:
    """KB006: a path, or a ROS package, is nothing that others have."""
    problem = refused(tmp_path / "recipe.owl", importing(iri).encode())
    assert problem.code == "KB006"
    assert f"imports {iri}, a place and not the IRI of an ontology" in problem.message


def test_a_missing_import_has_a_nearest_name(tmp_path: Path) -> None:
    """KB002 offers the ontology of nearly the same IRI."""
    problem = refused(tmp_path / "site.owl", importing(f"{IRI}cor.owl").encode())
    assert problem.code == "KB002"
    assert f"did you mean {IRI}core.owl?" in problem.message


def test_an_import_in_another_syntax_is_named(tmp_path: Path) -> None:
    """Of an import that is Turtle, what is told is that it is Turtle, not that there is none."""
    (tmp_path / "x.owl").write_text(TURTLE, encoding="utf-8")
    (tmp_path / "site.owl").write_text(importing("http://example.org/x.owl"), encoding="utf-8")
    with pytest.raises(OntologyRejected) as caught:
        read_files(tmp_path / "site.owl", tmp_path)
    assert [(p.code, p.file.name) for p in caught.value.problems] == [("KB007", "x.owl")]


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
    assert len(read_files(folder / SITE, folder).files) == FILES


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
    assert len(names) == len(set(names)) == FILES
    assert (names[0], names[-1]) == ("core.owl", "tue_lab.owl")
    assert names.index("objects.owl") < names.index("find_empty_drink.owl") < names.index("groundings.owl")


def test_the_shipped_core_stands_in(folder: Path) -> None:
    """A folder without a core uses the shipped one."""
    (folder / CORE).unlink()
    assert read_files(folder / SITE, folder).files[0].path == SHIPPED / CORE


def test_files_may_import_each_other(tmp_path: Path) -> None:
    """A circle of imports is read once round."""
    for name, other in (("a", "b"), ("b", "a")):
        text = importing(f"{IRI}{other}.owl").replace("objects.owl", f"{name}.owl")
        (tmp_path / f"{name}.owl").write_text(text, encoding="utf-8")
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


def test_a_statement_is_where_the_whole_name_is(tmp_path: Path) -> None:
    """`BeerMug` is not `Beer`; where nothing of it is named, the entity itself is the place."""
    lines = [
        '<owl:Class rdf:about="http://example.org/x#Mug">',
        '<rdfs:subClassOf rdf:resource="http://example.org/x#BeerMug"/>',
        '<rdfs:subClassOf rdf:resource="http://example.org/x#Beer"/>',
        "</owl:Class>",
    ]
    path = tmp_path / "mug.owl"
    path.write_text(with_entities("", "x").replace("</rdf:RDF>", "\n".join([*lines, "</rdf:RDF>"])), encoding="utf-8")
    (file,) = read_files(path, tmp_path).files
    begin = file.line_of("http://example.org/x#Mug")
    for name, line in (("BeerMug", 1), ("Beer", 2), ("Bee", 0)):
        others = frozenset({f"http://example.org/x#{name}"})
        assert file.line_of_statement("http://example.org/x#Mug", others) == begin + line


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
        told = {
            problem.file
            for problem in rejected.problems
            if problem.code in {"KB001", "KB002", "KB006", "KB007", "KB008"}
        }
    assert told == {path}
