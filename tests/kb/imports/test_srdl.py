"""SRDL robot descriptions become robot classes."""

from __future__ import annotations

from pathlib import Path

import pytest

from kb.imports.report import Fate, NotImportable
from kb.imports.srdl import import_srdl
from kb.writing import Entity, Sort
from tests.kb.imports.worlds import BASE, IRI, loaded, told

KB = "http://knowrob.org/kb"
ROBOT = f"""<?xml version="1.0"?>
<!DOCTYPE rdf:RDF [<!ENTITY comp "{KB}/srdl2-comp.owl#"> <!ENTITY knowrob "{KB}/knowrob.owl#">]>
<rdf:RDF xml:base="http://example.net/tug.owl" xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"
  xmlns:rdfs="http://www.w3.org/2000/01/rdf-schema#" xmlns:owl="http://www.w3.org/2002/07/owl#"
  xmlns:c="{KB}/srdl2-comp.owl#">
<owl:Ontology rdf:about="http://example.net/tug.owl"/>
<owl:Class rdf:ID="Tug"><rdfs:subClassOf rdf:resource="&knowrob;Robot"/>
  <rdfs:subClassOf><owl:Restriction><owl:onProperty rdf:resource="{KB}/srdl2-cap.owl#hasCapability"/>
    <owl:someValuesFrom rdf:resource="{KB}/srdl2-cap.owl#move_base"/></owl:Restriction></rdfs:subClassOf></owl:Class>
<owl:NamedIndividual rdf:ID="tug_1"><rdf:type rdf:resource="#Tug"/></owl:NamedIndividual>
<owl:NamedIndividual rdf:ID="laser"><rdf:type rdf:resource="&comp;HokuyoUTM-30LX"/></owl:NamedIndividual>
<owl:NamedIndividual rdf:ID="base"><rdf:type rdf:resource="&comp;HolonomicBase"/></owl:NamedIndividual>
<owl:NamedIndividual rdf:ID="hook"><rdf:type rdf:resource="&comp;TowingGripper"/></owl:NamedIndividual>
<owl:NamedIndividual rdf:ID="l1"><rdf:type rdf:resource="&comp;UrdfLink"/><c:urdfName>base_link</c:urdfName>
  <c:mass_value>40.5</c:mass_value><c:succeedingJoint rdf:resource="#j1"/></owl:NamedIndividual>
<owl:NamedIndividual rdf:ID="l2"><rdf:type rdf:resource="&comp;UrdfLink"/><c:urdfName>hook_link</c:urdfName>
</owl:NamedIndividual>
<owl:NamedIndividual rdf:ID="j1"><rdf:type rdf:resource="&comp;PrismaticUrdfJoint"/><c:urdfName>lift</c:urdfName>
  <c:succeedingLink rdf:resource="#l2"/><c:kp>7</c:kp></owl:NamedIndividual>
</rdf:RDF>
"""


def test_a_robot_class(tmp_path: Path) -> None:
    """Components become what the class has, links and joints its parts; guesses and losses are told of."""
    file = tmp_path / "tug.owl"
    file.write_text(ROBOT, encoding="utf-8")
    imported = import_srdl(file, IRI)
    tug = Entity(iri=f"{BASE}/trial.owl#our_tug", sort=Sort.INDIVIDUAL, types=(f"{IRI}#Tug",))
    with loaded(imported, tmp_path / "kb", (tug,)) as snapshot:
        ontology = snapshot.ontology
        assert {"RobotWithLaser", "RobotWithBase"} <= ontology.kinds["our_tug"]
        assert ontology.value("mass_kg", "our_tug") == 40.5
        assert ontology.value("childLink", "Tug_lift") == "Tug_hook_link"
        assert ontology.value("parentLink", "Tug_lift") == "Tug_base_link"
        assert ontology.value("jointType", "Tug_lift") == "prismatic"
        assert "Tug_TowingGripper" in ontology.superclasses
    assert "TowingGripper was taken for a kind of actuator, by its name" in told(imported, Fate.GUESSED)
    left_out = told(imported, Fate.LEFT_OUT)
    assert "tug_1, of the class Tug" in left_out
    assert "kp (j1)" in left_out
    assert "hasCapability move_base" in told(imported, Fate.CHANGED)


@pytest.mark.parametrize("mass", ["heavy", "nan", "1e999", "-3"])
def test_a_mass_that_is_none_is_left_out(mass: str, tmp_path: Path) -> None:
    """The report says so; the rest is there."""
    file = tmp_path / "tug.owl"
    file.write_text(ROBOT.replace("40.5", mass), encoding="utf-8")
    imported = import_srdl(file, IRI)
    assert f"its mass {mass} is no number of kg from 0" in told(imported, Fate.LEFT_OUT)
    assert "mass_kg" not in imported.text


def test_no_robot(tmp_path: Path) -> None:
    """A file without a robot class is refused."""
    file = tmp_path / "tug.owl"
    file.write_text(
        ROBOT.replace('rdf:resource="&knowrob;Robot"', 'rdf:resource="&knowrob;Tool"').replace("hasCapab", "x")
    )
    with pytest.raises(NotImportable, match="describes no robot"):
        import_srdl(file, IRI)


@pytest.mark.shared
@pytest.mark.parametrize(
    ("path", "kind", "able"),
    [
        ("knowrob-indigo/PR2.owl", "PR2", {"RobotWithBase"}),
        ("knowrob-indigo/amigo.owl", "Amigo", {"RobotWithBase", "RobotWithLaser"}),
        ("knowrob-indigo/pioneer.owl", "Ari", {"RobotWithBase"}),
        ("roboearth/amigo.owl", "Amigo", {"RobotWithBase", "RobotWithLaser"}),
    ],
)
def test_published_robots(path: str, kind: str, able: set[str], shared: Path, tmp_path: Path) -> None:
    """The robots of KnowRob and RoboEarth become classes that are capable of what their components allow."""
    imported = import_srdl(shared / "ontologies" / path, IRI)
    robot = Entity(iri=f"{BASE}/trial.owl#one", sort=Sort.INDIVIDUAL, types=(f"{IRI}#{kind}",))
    with loaded(imported, tmp_path / "kb", (robot,)) as snapshot:
        assert able <= snapshot.ontology.kinds["one"]
    assert len(imported.notes) < 120


@pytest.mark.shared
def test_a_published_robot_with_a_fault(shared: Path, tmp_path: Path) -> None:
    """TUMRosie uses an entity that it does not declare; line and remedy are told, and the remedy helps."""
    file = shared / "ontologies" / "knowrob-indigo" / "TUMRosie.owl"
    with pytest.raises(
        NotImportable, match=r"TUMRosie\.owl:78 does not parse as XML: undefined entity &pr2; declare it"
    ):
        import_srdl(file, IRI)
    mended = tmp_path / "TUMRosie.owl"
    entities = ("pr2", "PR2"), ("robot", "TUMRosie"), ("qudt-unit", "unit")
    declared = "<!DOCTYPE rdf:RDF [" + "".join(f'<!ENTITY {n} "http://knowrob.org/kb/{f}.owl#">' for n, f in entities)
    mended.write_text(file.read_text(encoding="utf-8").replace("<!DOCTYPE rdf:RDF [", declared), encoding="utf-8")
    imported = import_srdl(mended, IRI)
    rosie = Entity(iri=f"{BASE}/trial.owl#one", sort=Sort.INDIVIDUAL, types=(f"{IRI}#TUMRosie",))
    with loaded(imported, tmp_path / "kb", (rosie,)) as snapshot:
        assert {"RobotWithBase", "RobotWithLaser"} <= snapshot.ontology.kinds["one"]
