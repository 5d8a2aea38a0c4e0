"""The shipped ontologies open in the tools that people have, without a network, and say what they should."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import owlready2
import pyoxigraph
import pytest
from rdflib import OWL, RDF, RDFS, SKOS, Graph, Literal, URIRef
from rdflib.compare import isomorphic
from rdflib.term import Node

from kb.files import SHIPPED, local_name, read_files
from kb.problems import OntologyRejected
from kb.reasoner import classify
from kb.store import KnowledgeBase
from kb.validation import check
from kb.vocabulary import CORE
from tests.kb.conftest import OBJECTS, SITE, added

FILES = sorted(file.relative_to(SHIPPED) for file in SHIPPED.rglob("*.owl"))
FOLDERS = sorted({file.parent for file in FILES})
TESTS = Path(__file__).parents[1] / "data" / "owl"
OURS = "http://example.org/concertmaster/"
CATALOG = "{urn:oasis:names:tc:entity:xmlns:xml:catalog}uri"
SORTS = (OWL.Class, OWL.ObjectProperty, OWL.DatatypeProperty, OWL.AnnotationProperty, OWL.NamedIndividual)
MATCHES = (SKOS.exactMatch, SKOS.closeMatch, SKOS.broadMatch, SKOS.narrowMatch, SKOS.relatedMatch)
OWL_S = "http://www.daml.org/services/owl-s/1.2/"
VOCABULARIES = (
    OWL_S,
    "http://purl.org/ieee1872-owl/",
    "http://www.ease-crc.org/ont/SOMA.owl#",
    "http://www.ontologydesignpatterns.org/ont/dul/DUL.owl#",
    "http://www.w3.org/ns/sosa/",
    "https://w3id.org/bot#",
)
# `source [number] name`, as core.owl says of failureCode.
FAILURE_CODE = re.compile(r"(?:(concertmaster)|([a-z0-9_]+(?:/action)?/\w+) (-?\d+)) (\w+)")

GRAPHS = {file: Graph().parse(SHIPPED / file, format="xml") for file in FILES}


def iri_of(file: Path) -> str:
    """The IRI of the ontology in a file."""
    graph = GRAPHS.get(file.relative_to(SHIPPED)) or Graph().parse(file, format="xml")
    (iri,) = graph.subjects(RDF.type, OWL.Ontology)
    return str(iri)


def merged() -> Graph:
    """All shipped files in one graph."""
    graph = Graph()
    for each in GRAPHS.values():
        graph += each
    return graph


ALL = merged()


def term(name: str) -> URIRef:
    """A term of core.owl."""
    return URIRef(CORE + name)


def individuals(kind: str) -> list[URIRef]:
    """The individuals that are said to be of a class, by IRI."""
    return sorted(s for s in ALL.subjects(RDF.type, term(kind)) if isinstance(s, URIRef))


def declared(graph: Graph) -> dict[URIRef, set[Node]]:
    """What a file declares: the sorts of each entity that has one."""
    entities: dict[URIRef, set[Node]] = {}
    for sort in SORTS:
        for entity in graph.subjects(RDF.type, sort):
            if isinstance(entity, URIRef):
                entities.setdefault(entity, set()).add(sort)
    return entities


def failures() -> list[URIRef]:
    """The classes of failure."""
    below = ALL.transitive_subjects(RDFS.subClassOf, term("Failure"))
    return sorted(s for s in below if isinstance(s, URIRef) and s != term("Failure"))


# --------------------------------------------------------------------------------------------- files


def test_there_are_ontologies() -> None:
    """All kinds of knowledge are there."""
    assert {file.parts[0] for file in FILES} == {"core", "failures", "robots", "sites", "tasks"}


@pytest.mark.parametrize("file", FILES, ids=str)
def test_three_libraries_read_the_same(file: Path) -> None:
    """Owlready2, rdflib and pyoxigraph count the same triples, and the last two read the same ones.

    Of anonymous restrictions that are the same, Owlready2 keeps one; the shipped files have none that it merges.
    """
    graph = GRAPHS[file]
    world = owlready2.World()
    for imported in graph.objects(None, OWL.imports):
        world.get_ontology(str(imported)).loaded = True  # or Owlready2 would fetch it
    with (SHIPPED / file).open("rb") as stream:
        ontology = world.get_ontology(iri_of(SHIPPED / file)).load(fileobj=stream, reload=True)
    content = (SHIPPED / file).read_bytes()
    quads = list(pyoxigraph.parse(content, format=pyoxigraph.RdfFormat.RDF_XML, base_iri=iri_of(SHIPPED / file)))
    assert len(ontology.graph) == len(graph) == len(quads) > 0
    world.close()
    other = Graph().parse(data="".join(f"{quad.triple} .\n" for quad in quads), format="nt")
    assert isomorphic(graph, other)


@pytest.mark.parametrize("file", FILES, ids=str)
def test_protege_finds_every_import_in_the_folder(file: Path) -> None:
    """Each import, and their imports, are in the catalog beside the file, at the file of that IRI."""
    catalog = _catalog(file.parent)
    todo = {str(o) for o in GRAPHS[file].objects(None, OWL.imports)}
    done: set[str] = set()
    while todo - done:
        imported = min(todo - done)
        done.add(imported)
        target = (SHIPPED / file.parent / catalog[imported]).resolve()
        todo |= {str(o) for o in GRAPHS[target.relative_to(SHIPPED)].objects(None, OWL.imports)}


@pytest.mark.parametrize("folder", FOLDERS, ids=str)
def test_every_catalog_lists_every_file(folder: Path) -> None:
    """By its IRI, at a path relative to the catalog, and nothing that is not there."""
    catalog = _catalog(folder)
    for uri in catalog.values():
        assert re.match(r"(?!/)[^:]+$", uri), f"{uri} is not relative"
    places = {iri: (SHIPPED / folder / uri).resolve() for iri, uri in catalog.items()}
    assert places == {iri_of(SHIPPED / file): SHIPPED / file for file in FILES}


def _catalog(folder: Path) -> dict[str, str]:
    root = ET.parse(SHIPPED / folder / "catalog-v001.xml").getroot()
    return {str(e.get("name")): str(e.get("uri")) for e in root.iter(CATALOG)}


@pytest.mark.parametrize("file", FILES, ids=str)
def test_the_ontology_header_tells_what_it_is(file: Path) -> None:
    """Label, comment and version are what Protégé shows first."""
    header = URIRef(iri_of(SHIPPED / file))
    for prop in (RDFS.label, RDFS.comment, OWL.versionInfo):
        assert GRAPHS[file].value(header, prop), prop


# ------------------------------------------------------------------------------------------- entities


@pytest.mark.parametrize("file", FILES, ids=str)
def test_everything_is_labelled_and_explained(file: Path) -> None:
    """Each class, property and individual has one English label and one English comment, a sentence."""
    for entity in declared(GRAPHS[file]):
        for prop in (RDFS.label, RDFS.comment):
            texts = [o for o in ALL.objects(entity, prop) if isinstance(o, Literal) and o.language == "en"]
            assert len(texts) == 1, f"{local_name(entity)} in {file} has {len(texts)} English {local_name(str(prop))}s"
        assert str(ALL.value(entity, RDFS.comment)).endswith("."), f"{local_name(entity)}: its comment is no sentence"


def test_nothing_of_ours_is_undeclared() -> None:
    """What the files name in our namespaces is declared in one of them, as one sort."""
    sorts = declared(ALL)
    used = {n for triple in ALL for n in triple if isinstance(n, URIRef) and n.startswith(OURS) and "#" in n}
    assert used
    assert used <= set(sorts)
    assert {entity for entity in sorts if len(sorts[entity]) > 1} == set()


def test_every_individual_has_a_class_of_its_own() -> None:
    """A person who opens an individual sees what it is."""
    for individual in ALL.subjects(RDF.type, OWL.NamedIndividual):
        assert set(ALL.objects(individual, RDF.type)) - {OWL.NamedIndividual}, individual


def test_the_top_kinds_exclude_each_other() -> None:
    """Every class of core.owl that has none above it stands in one AllDisjointClasses."""
    core = GRAPHS[Path("core/core.owl")]
    classes = {c for c in core.subjects(RDF.type, OWL.Class) if isinstance(c, URIRef)}
    tops = {c for c in classes if not any(isinstance(o, URIRef) for o in core.objects(c, RDFS.subClassOf))}
    groups = [
        set(core.items(members))
        for each in core.subjects(RDF.type, OWL.AllDisjointClasses)
        for members in core.objects(each, OWL.members)
    ]
    assert len(tops) >= 15
    assert any(tops <= group for group in groups), f"not disjoint: {tops - max(groups, key=len)}"


def test_every_control_construct_is_used_somewhere() -> None:
    """By a shipped process or one of the tests' own."""
    graph = merged()
    for file in sorted(TESTS.glob("*.owl")):
        graph.parse(file, format="xml")
    constructs = set(graph.subjects(RDFS.subClassOf, term("ControlConstruct")))
    assert len(constructs) >= 17
    assert {c for c in constructs if (None, RDF.type, c) not in graph} == set()


# ----------------------------------------------------------------------------------------- alignments


def _alignments() -> Iterator[tuple[Node, Node, Node]]:
    for prop in MATCHES:
        yield from ALL.triples((None, prop, None))


def test_terms_are_aligned_by_annotation() -> None:
    """With all the vocabularies that we name, of terms of core.owl alone, which stay without other people's axioms."""
    found = list(_alignments())
    for subject, prop, value in found:
        assert str(subject).startswith(CORE), (subject, prop)
        assert (prop, RDF.type, OWL.AnnotationProperty) in ALL
        assert str(value).startswith(VOCABULARIES), value
    for vocabulary in VOCABULARIES:
        assert [value for *_, value in found if str(value).startswith(vocabulary)], vocabulary


def test_no_two_terms_mean_exactly_the_same() -> None:
    """An exact match is one to one."""
    exact = list(ALL.subject_objects(SKOS.exactMatch))
    assert len({s for s, _ in exact}) == len({o for _, o in exact}) == len(exact) > 10


@pytest.mark.shared
def test_terms_of_owl_s_exist(shared: Path) -> None:
    """Each term of OWL-S 1.2 that ours are aligned to is in its files, as the same sort."""
    theirs = Graph()
    for name in ("Process.owl", "Grounding.owl", "generic/Expression.owl"):
        theirs.parse(shared / "ontologies" / "owl-s-1.2-unibas" / name, format="xml", publicID=OWL_S + name)
    aligned = [(s, p, o) for s, p, o in _alignments() if str(o).startswith(OWL_S)]
    assert len(aligned) > 40
    for subject, prop, value in aligned:
        sorts = set(theirs.objects(value, RDF.type))
        assert sorts, f"OWL-S has no {value}"
        if prop == SKOS.exactMatch:
            ours = OWL.Class if (subject, RDF.type, OWL.Class) in ALL else OWL.ObjectProperty
            assert ours in sorts, (subject, value)


# ------------------------------------------------------------------------------------------- failures


def test_failure_codes_are_told_once_each() -> None:
    """A source and its number, or its name, stand for one class of failure."""
    classes: dict[tuple[str, str], Node] = {}
    for failure, told in ALL.subject_objects(term("failureCode")):
        assert failure in failures(), failure
        match = FAILURE_CODE.fullmatch(str(told))
        assert match, f"{local_name(str(failure))}: {told!r} is no failure code"
        own, source, number, name = match.groups()
        for key in ((own or source, name), (source, number) if source else (own, name)):
            assert classes.setdefault(key, failure) == failure, told
    sources = {source for source, _ in classes}
    assert sources >= {"concertmaster", "moveit_msgs/MoveItErrorCodes", "mbf_msgs/action/MoveBase"}
    assert len([s for s in sources if s.startswith("nav2_msgs/action/")]) >= 13


def test_what_our_services_raise_is_a_failure_code() -> None:
    """Each failure that the sources name is told of some class of failure."""
    root = Path(__file__).parents[2]
    before = r'\w*(?:Failed|Refused)\(\s*|failure=|"failed", |_later\(\w+, \w+, |\b(?:_failure|failed|ended)\([\w.]+, '
    pattern = re.compile(f'(?:{before})"([A-Z]\\w+)"')
    raised = {
        name
        for folder in ("grounding", "sim", "executive")
        for file in sorted((root / folder).rglob("*.py"))
        for name in pattern.findall(file.read_text(encoding="utf-8"))
    }
    assert raised >= {"NoPath", "NotLocalized", "ObjectNotFound", "NoReply", "BadInput", "Busy", "Lost", "OutOfReach"}
    told = {str(o).split()[-1] for o in ALL.objects(None, term("failureCode")) if str(o).startswith("concertmaster ")}
    assert raised <= told


def test_every_failure_but_cancellation_has_a_recovery() -> None:
    """Of its own or of the class above it, and recoveries are individuals."""
    recoveries = {
        r for kind in ("AskPerson", "ProcessRecovery", "Reassign", "Replan", "Retry") for r in individuals(kind)
    }
    for failure in failures():
        above = list(ALL.transitive_objects(failure, RDFS.subClassOf))
        found = {r for each in above for r in ALL.objects(each, term("recoveredBy"))}
        assert found <= recoveries
        assert bool(found) != failure.endswith("#Canceled"), failure
    assert set(ALL.objects(None, term("recoveredBy"))) == recoveries  # none that helps against nothing


def test_recoveries_tell_their_cost() -> None:
    """Time of 0 s or more, odds in (0, 1], and how often: at least once; a pause takes part of the time."""
    for recovery in ALL.objects(None, term("recoveredBy")):
        time_s, odds = (float(str(ALL.value(recovery, term(p)))) for p in ("recoveryTime_s", "recoveryOdds"))
        assert time_s >= 0.0
        assert 0.0 < odds <= 1.0
        for attempts in ALL.objects(recovery, term("maxAttempts")):
            assert int(str(attempts)) >= 1
        for pause_s in ALL.objects(recovery, term("pause_s")):
            assert 0.0 < float(str(pause_s)) <= time_s


def test_processes_expect_classes_of_failure() -> None:
    """Each shipped process says at least one."""
    processes = [*individuals("AtomicProcess"), *individuals("CompositeProcess")]
    assert len(processes) >= 13
    for process in processes:
        expected = set(ALL.objects(process, term("expectedFailure")))
        assert expected, process
        assert expected <= set(failures()), process


# ---------------------------------------------------------------------------------------------- flags


def test_flags_are_stated_and_agree() -> None:
    """What may be cached is deterministic, computed off board, and without effects."""
    stated = dict(ALL.subject_objects(term("isDeterministic")))
    assert set(stated) == set(individuals("AtomicProcess"))
    groundings = [*individuals("RobotGrounding"), *individuals("ComputeGrounding")]
    cacheable = {g for g in groundings if ALL.value(g, term("isCacheable")) == Literal(True)}
    assert {g for g in groundings if ALL.value(g, term("isCacheable")) is None} == set()
    assert cacheable
    assert cacheable <= set(individuals("ComputeGrounding"))
    for grounding in cacheable:
        process = ALL.value(grounding, term("grounds"))
        assert process is not None
        assert stated[process] == Literal(True)
        assert ALL.value(process, term("hasEffect")) is None


# ----------------------------------------------------------------------------------------------- load


def test_no_false_alarm(shipped: KnowledgeBase) -> None:
    """The shipped site has no problem, and nothing in it is probably not meant."""
    assert check(read_files(SHIPPED / SITE, SHIPPED)) == []
    assert list(shipped.warnings) == []


@pytest.mark.parametrize("file", FILES, ids=str)
def test_every_file_is_in_owl_2_dl(file: Path) -> None:
    """With what it imports, by the profile check of the OWLAPI; consistent, and no class is empty."""
    assert classify(read_files(SHIPPED / file, SHIPPED)).superclasses


def test_what_is_not_in_owl_2_dl_would_be_found(folder: Path) -> None:
    """A transitive property in a cardinality, for one."""
    restriction = (
        f'<owl:Restriction><owl:onProperty rdf:resource="{CORE}inArea"/>'
        '<owl:maxCardinality rdf:datatype="http://www.w3.org/2001/XMLSchema#nonNegativeInteger">1</owl:maxCardinality>'
        "</owl:Restriction>"
    )
    added(OBJECTS, f'<owl:Class rdf:about="{CORE}Room"><rdfs:subClassOf>{restriction}</rdfs:subClassOf></owl:Class>')(
        folder
    )
    with pytest.raises(OntologyRejected) as caught:
        classify(read_files(folder / OBJECTS, folder))
    assert {p.code for p in caught.value.problems} == {"KB303"}


def test_failures_do_not_reach_plans(shipped: KnowledgeBase) -> None:
    """They load, and can be read by name; no fact of the planner is about them."""
    ontology = shipped.snapshot().ontology
    assert ontology.values("recoveredBy", "NavigationBlocked") == ("another_path", "open_door", "retry_after_pause")
    assert ontology.values("expectedFailure", "Detection") == ("NotDetected",)
    assert ontology.value("usesProcess", "relocalize") == "Relocalize"
    assert ontology.superclasses["DoorClosed"] >= {"NavigationBlocked", "NavigationFailure", "Failure"}
    names = {local_name(str(n)) for n in [*failures(), *ALL.objects(None, term("recoveredBy"))]}
    facts = " ".join(map(str, shipped.snapshot().compiler.facts(1)))
    assert not names & set(re.findall(r"\w+", facts))


def test_the_shipped_site_is_classified(shipped: KnowledgeBase) -> None:
    """What a robot can do follows from what its class has."""
    ontology = shipped.snapshot().ontology
    assert ontology.individuals("Robot") == ["amigo_1", "pico_1"]
    for robot, kind in (("amigo_1", "Amigo"), ("pico_1", "Pico")):
        assert ontology.kinds[robot] >= {kind, "Robot", "RobotWithKinect", "RobotWithLaser", "RobotWithBase"}
        assert ontology.kind_of(robot) == kind
    assert ontology.kinds["drink_1"] >= {"Beer", "Drink", "PhysicalObject"}
    assert "RobotWithKinect" not in ontology.kinds["drink_1"]
