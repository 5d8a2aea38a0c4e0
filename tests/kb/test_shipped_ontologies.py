"""The shipped ontologies open in the tools that people have, without a network, and say what they should."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import owlready2
import pytest
from rdflib import OWL, RDF, Graph, URIRef

from kb.files import SHIPPED, read_files
from kb.store import KnowledgeBase
from kb.validation import check
from tests.kb.conftest import SITE

FILES = sorted(file.relative_to(SHIPPED) for file in SHIPPED.rglob("*.owl"))
CATALOG = "{urn:oasis:names:tc:entity:xmlns:xml:catalog}uri"


def iri_of(file: Path) -> str:
    """The IRI of the ontology in a file."""
    (iri,) = Graph().parse(file, format="xml").subjects(RDF.type, OWL.Ontology)
    return str(iri)


def test_there_are_ontologies() -> None:
    """All kinds of knowledge are there."""
    assert {file.parts[0] for file in FILES} == {"core", "robots", "sites", "tasks"}


@pytest.mark.parametrize("file", FILES, ids=str)
def test_two_libraries_read_the_same(file: Path) -> None:
    """Owlready2 and rdflib count the same triples."""
    graph = Graph().parse(SHIPPED / file, format="xml")
    world = owlready2.World()
    for imported in graph.objects(None, OWL.imports):
        world.get_ontology(str(imported)).loaded = True  # or Owlready2 would fetch it
    with (SHIPPED / file).open("rb") as stream:
        ontology = world.get_ontology(iri_of(SHIPPED / file)).load(fileobj=stream, reload=True)
    assert len(ontology.graph) == len(graph) > 0
    world.close()


@pytest.mark.parametrize("file", FILES, ids=str)
def test_protege_finds_every_import_in_the_folder(file: Path) -> None:
    """Each import, and their imports, are in the catalog beside the file, at the file of that IRI."""
    folder = (SHIPPED / file).parent
    catalog = {e.get("name"): e.get("uri") for e in ET.parse(folder / "catalog-v001.xml").getroot().iter(CATALOG)}
    todo = {str(o) for o in Graph().parse(SHIPPED / file, format="xml").objects(None, OWL.imports)}
    done: set[str] = set()
    while todo - done:
        imported = min(todo - done)
        done.add(imported)
        uri = catalog[imported]
        assert re.match(r"(?!/)[^:]+$", uri or ""), f"{imported} -> {uri} is not relative"
        target = (folder / str(uri)).resolve()
        assert iri_of(target) == imported
        todo |= {str(o) for o in Graph().parse(target, format="xml").objects(None, OWL.imports)}


@pytest.mark.parametrize("file", FILES, ids=str)
def test_the_ontology_header_tells_what_it_is(file: Path) -> None:
    """Label, comment and version are what Protégé shows first."""
    graph = Graph().parse(SHIPPED / file, format="xml")
    header = URIRef(iri_of(SHIPPED / file))
    for prop in ("label", "comment"):
        assert graph.value(header, URIRef(f"http://www.w3.org/2000/01/rdf-schema#{prop}")), prop
    assert graph.value(header, OWL.versionInfo)


def test_no_false_alarm() -> None:
    """The shipped site has no problem."""
    assert check(read_files(SHIPPED / SITE, SHIPPED)) == []


def test_the_shipped_site_is_classified(shipped: KnowledgeBase) -> None:
    """What a robot can do follows from what its class has."""
    ontology = shipped.snapshot().ontology
    assert ontology.individuals("Robot") == ["amigo_1", "pico_1"]
    for robot, kind in (("amigo_1", "Amigo"), ("pico_1", "Pico")):
        assert ontology.kinds[robot] >= {kind, "Robot", "RobotWithKinect", "RobotWithLaser", "RobotWithBase"}
        assert ontology.kind_of(robot) == kind
    assert ontology.kinds["drink_1"] >= {"Beer", "Drink", "PhysicalObject"}
    assert "RobotWithKinect" not in ontology.kinds["drink_1"]
