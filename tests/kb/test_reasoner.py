import subprocess
from pathlib import Path

import pytest

from kb import reasoner
from kb.files import SHIPPED, OntologyFiles, read_files
from kb.problems import OntologyRejected
from kb.reasoner import ReasonerFailed, classify
from tests.kb.conftest import CORE, IRI


@pytest.fixture
def files() -> OntologyFiles:
    """The core alone: quick to classify."""
    return read_files(SHIPPED / CORE, SHIPPED)


def test_an_answer_is_kept_for_the_same_files(
    files: OntologyFiles, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first time asks the reasoner and writes one whole file; the second time starts no process."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    first = classify(files)
    (kept,) = (tmp_path / "concertmaster").iterdir()
    assert files.digest in kept.name
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("a process was started"))
    assert classify(files) == first
    assert list((tmp_path / "concertmaster").iterdir()) == [kept]


def test_a_cache_that_can_not_be_written_is_no_loss(
    files: OntologyFiles, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the folder cannot be made, the answer is the same."""
    (tmp_path / "file").write_text("no folder", encoding="utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert classify(files).superclasses[f"{IRI}core.owl#Kinect"] >= {f"{IRI}core.owl#Sensor"}


def test_a_reasoner_without_an_answer_is_an_error(
    files: OntologyFiles, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Past the time limit it is stopped, and the limit is told; nothing is kept."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(reasoner, "TIME_LIMIT_S", 0.01)
    with pytest.raises(ReasonerFailed, match="no answer within"):
        classify(files)
    assert not list(tmp_path.rglob("*.json"))


def test_classes_are_closed_upward(files: OntologyFiles) -> None:
    """A class has all classes above it and itself."""
    above = classify(files).superclasses[f"{IRI}core.owl#OmnidirectionalBase"]
    assert {iri.split("#")[1] for iri in above} >= {"OmnidirectionalBase", "Base", "Actuator", "Device"}


def test_every_explained_axiom_has_a_place(folder: Path) -> None:
    """Of a contradiction across files, each file is named, and no other."""
    text = (folder / "sites/objects.owl").read_text(encoding="utf-8")
    sofa = '<rdfs:subClassOf rdf:resource="http://example.org/concertmaster/core.owl#Sofa"/>'
    soft = 'objects.owl#SoftDrink">\n'
    assert text.count(f'<owl:Class rdf:about="{IRI}{soft}') == 1
    (folder / "sites/objects.owl").write_text(text.replace(soft, soft + sofa, 1), encoding="utf-8")
    with pytest.raises(OntologyRejected) as caught:
        classify(read_files(folder / "sites/tue_lab/tue_lab.owl", folder))
    (problem,) = caught.value.problems
    assert (problem.code, problem.entity, problem.file.name) == ("KB301", "drink_2", "tue_lab.owl")
    for axiom in ("drink_2 type SoftDrink", "SoftDrink subClassOf Sofa", "Sofa subClassOf Furniture", "disjointWith"):
        assert axiom in problem.message
    for file in ("tue_lab.owl:", "objects.owl:", "core.owl:"):
        assert file in problem.message
    assert "navigation.owl" not in problem.message
