"""The corpus of wrong edits, continued: entities that are used as what they are not, and labels."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.kb.conftest import (
    AMIGO,
    IRI,
    NAVIGATION,
    OBJECTS,
    SITE,
    TASK,
    added,
    dropped,
    given,
    individual,
    link,
    number,
    renamed,
)
from tests.kb.faults import Fault, fault, found, make, restricted, told_before_reasoning


def of_class(name: str, *axioms: str) -> str:
    """A class of objects.owl."""
    return f'<owl:Class rdf:about="{IRI}objects.owl#{name}">{"".join(axioms)}</owl:Class>'


def below(name: str, prop: str = "rdfs:subClassOf") -> str:
    """Says that a class is below one of objects.owl."""
    return f'<{prop} rdf:resource="{IRI}objects.owl#{name}"/>'


def some(filler: str, of: str = "someValuesFrom") -> str:
    """Says that every Amigo has a sensor."""
    restriction = (
        f'<owl:Restriction><owl:onProperty rdf:resource="{IRI}core.owl#hasSensor"/>'
        f'<owl:{of} rdf:resource="{IRI}amigo.owl#{filler}"/></owl:Restriction>'
    )
    about = f'rdf:about="{IRI}amigo.owl#Amigo"'
    return f"<rdf:Description {about}><rdfs:subClassOf>{restriction}</rdfs:subClassOf></rdf:Description>"


def in_circle(prop: str, of: str) -> str:
    """Says that something is below a class whose list of operands does not end."""
    area, robot = (f'<rdf:first rdf:resource="{IRI}core.owl#{name}"/>' for name in ("Area", "Robot"))
    rest = f'<rdf:rest rdf:parseType="Resource">{robot}<rdf:rest rdf:nodeID="l"/></rdf:rest>'
    operands = f'<rdf:Description rdf:nodeID="l">{area}{rest}</rdf:Description>'
    return f"<{prop}><owl:Class><owl:{of}>{operands}</owl:{of}></owl:Class></{prop}>"


DEPRECATED = '<owl:deprecated rdf:datatype="http://www.w3.org/2001/XMLSchema#boolean">true</owl:deprecated>'

KINDS = [
    fault(
        "KB013",
        SITE,
        "drink_1",
        added(OBJECTS, of_class("Ale", below("Drink"), DEPRECATED, below("Beer", "core:replacedBy"))),
        renamed(SITE, "drink_1", "#Beer", "#Ale"),
        words="uses Ale, which is deprecated; use Beer instead",
        because="KB135",  # there is no entry for it in HUE.yaml
    ),
    fault(
        "KB013",
        SITE,
        "drink_2",
        added(OBJECTS, of_class("Pop", below("Drink"), DEPRECATED)),
        renamed(SITE, "drink_2", "#SoftDrink", "#Pop"),
        words="uses Pop, which is deprecated|comment",
        because="KB135",
    ),
    *(
        fault(
            "KB014",
            AMIGO,
            "Amigo",
            individual(AMIGO, "kinect_7", "Kinect"),
            added(AMIGO, some("kinect_7", of)),
            words="restricts hasSensor to the class kinect_7, which is an individual|hasSensor value kinect_7",
        )
        for of in ("someValuesFrom", "allValuesFrom")
    ),
    fault(
        "KB011",
        OBJECTS,
        "Ale",
        added(OBJECTS, of_class("Ale", below("Beer", "owl:subClassOf"))),
        words="owl#subClassOf>|did you mean <http://www.w3.org/2000/01/rdf-schema#subClassOf>?",
    ),
    fault(
        "KB015",
        SITE,
        "amigo_1",
        renamed(SITE, "amigo_1", f'<core:locatedAt rdf:resource="{IRI}tue_lab.owl#start_west"/>', ""),
        given(SITE, "amigo_1", "<core:locatedAt>start_west</core:locatedAt>"),
        words="locatedAt has the literal 'start_west' for a value; name an individual",
    ),
    fault(
        "KB015",
        SITE,
        "drink_1",
        given(SITE, "drink_1", link("hasServeLocation", OBJECTS, "Beer")),
        words="has the class Beer for a value",
    ),
    fault(
        "KB015",
        SITE,
        "at_bar",
        given(SITE, "at_bar", link("capacity", SITE, "kitchen")),
        words="capacity has kitchen for a value; give a literal",
    ),
    fault(
        "KB015",
        SITE,
        "drink_1",
        given(SITE, "drink_1", "<rdf:type>Beer</rdf:type>"),
        words="type has the literal 'Beer' for a value; name it with rdf:resource",
    ),
    fault(
        "KB015",
        NAVIGATION,
        "Localize_body",
        given(
            NAVIGATION,
            "Localize_body",
            f"<core:hasStep><core:Perform>{link('performs', NAVIGATION, 'Laser')}</core:Perform></core:hasStep>",
        ),
        words="hasStep has an individual without a name for a value; give it one",
    ),
    fault(
        "KB016",
        NAVIGATION,
        "Base_velocity",
        renamed(NAVIGATION, "Base_velocity", "<core:parameterName>", '<core:parameterName xml:lang="en">'),
        words="parameterName is of xsd:string, but 'velocity' is in the language 'en'; remove the language",
    ),
    fault(
        "KB016",
        SITE,
        "at_bar",
        renamed(SITE, "at_bar", 'double">7.5', 'decimal">7.5'),
        words="poseX_m is of xsd:double, but '7.5' is of xsd:decimal; choose xsd:double as its datatype",
    ),
    *(
        fault("KB303", OBJECTS, name, added(OBJECTS, xml), words="contains itself; write it anew", because="KB011")
        for name, xml in (
            ("Odd", of_class("Odd", in_circle("rdfs:subClassOf", "intersectionOf"))),
            (
                "odd",
                f'<owl:DatatypeProperty rdf:about="{IRI}objects.owl#odd">{in_circle("rdfs:domain", "unionOf")}'
                "</owl:DatatypeProperty>",
            ),
            ("", '<rdf:Description rdf:nodeID="a"><odd rdf:nodeID="a"/></rdf:Description>'),
        )
    ),
    fault(
        "KB016",
        SITE,
        "kitchen",
        given(SITE, "kitchen", number("poseX_m", "1.0")),
        words="has poseX_m, which is of Location, but has no class below Location",
    ),
    fault(
        "KB016",
        SITE,
        "kitchen",
        renamed(SITE, "amigo_1", "#start_west", "#kitchen"),
        words="is a value of locatedAt, which must be Location",
    ),
    fault(
        "KB016",
        NAVIGATION,
        "Localize_20_Laser",
        renamed(NAVIGATION, "Localize_20_Laser", '#integer">20', '#string">20'),
        words="stepNumber is of xsd:integer, but '20' is of xsd:string",
    ),
    fault(
        "KB016",
        AMIGO,
        "Amigo",
        restricted(AMIGO, "radius_m", "#double", "#integer"),
        restricted(AMIGO, "radius_m", ">0.35<", ">1<"),
        words="radius_m is of xsd:double, but '1' is of xsd:integer",
    ),
    fault(
        "KB016",
        TASK,
        "SearchDrink_drink_there",
        given(NAVIGATION, "Localize_body", link("hasStep", TASK, "SearchDrink_drink_there")),
        words="is a value of hasStep, which must be ControlConstruct",
    ),
    *(
        fault(
            "KB009",
            SITE,
            name,
            individual(SITE, name, "Room"),
            words=f"is called {name}, which is something else",
        )
        for name in ("true", "false", "null", "none", "here")
    ),
    fault(
        "KB017",
        SITE,
        "drink_7",
        added(SITE, f'<owl:NamedIndividual rdf:about="{IRI}tue_lab.owl#drink_7"/>'),
        words="has no class",
    ),
    fault(
        "KB018",
        SITE,
        "amigo_1",
        given(SITE, "amigo_1", '<rdfs:label xml:lang="en">the tall one</rdfs:label>'),
        words="has 2 labels in the language 'en'|'the tall one'|keep one",
    ),
    fault(
        "KB145",
        NAVIGATION,
        "Base_effect",
        renamed(NAVIGATION, "Base_effect", "#hasOdometry", "#hasDispose"),
        added(NAVIGATION, f'<owl:ObjectProperty rdf:about="{IRI}core.owl#hasDispose"/>'),
        words="changes hasDispose, which is no fluent",
    ),
]
"""What a reasoner would infer in silence, and what is only doubtful."""


@pytest.mark.parametrize("case", KINDS, ids=str)
def test_an_entity_is_what_it_is_used_as(case: Fault, folder: Path) -> None:
    """The problem has its code, points at file, line and entity, and says what helps; nothing else is blamed."""
    make([case], folder)
    found([case], folder, told_before_reasoning(folder))


def test_a_text_that_is_called_like_a_faulty_thing_hides_nothing(folder: Path) -> None:
    """A parameter of the name `velocity` has nothing to do with a room that is called so."""
    individual(SITE, "velocity", "Room", number("poseX_m", "1.0"))(folder)
    dropped(NAVIGATION, "Base_velocity", "parameterType")(folder)
    told = {(p.code, p.entity) for p in told_before_reasoning(folder)}
    assert told == {("KB016", "velocity"), ("KB104", "Base_velocity")}


def test_what_a_union_or_a_definition_allows_is_no_fault(folder: Path) -> None:
    """A domain may be a union; an individual may be of a class by the definition of its own."""
    union = (
        '<rdfs:domain><owl:Class><owl:unionOf rdf:parseType="Collection">'
        f'<rdf:Description rdf:about="{IRI}core.owl#Area"/>'
        f'<rdf:Description rdf:about="{IRI}core.owl#Robot"/></owl:unionOf></owl:Class></rdfs:domain>'
    )
    added(SITE, f'<owl:DatatypeProperty rdf:about="{IRI}tue_lab.owl#floor">{union}</owl:DatatypeProperty>')(folder)
    for name in ("kitchen", "amigo_1"):
        given(SITE, name, f'<floor xmlns="{IRI}tue_lab.owl#">first</floor>')(folder)
    both = "".join(f'<rdf:Description rdf:about="{IRI}core.owl#{name}"/>' for name in ("Location", "SearchLocation"))
    defined = f'<owl:Class><owl:intersectionOf rdf:parseType="Collection">{both}</owl:intersectionOf></owl:Class>'
    of = f'rdf:about="{IRI}tue_lab.owl#Spot"'
    added(SITE, f"<owl:Class {of}><owl:equivalentClass>{defined}</owl:equivalentClass></owl:Class>")(folder)
    renamed(SITE, "at_bar", f"{IRI}core.owl#SearchLocation", f"{IRI}tue_lab.owl#Spot")(folder)
    domain = f'<rdfs:domain rdf:resource="{IRI}tue_lab.owl#Zone"/>'
    added(SITE, f'<owl:DatatypeProperty rdf:about="{IRI}tue_lab.owl#wing">{domain}</owl:DatatypeProperty>')(folder)
    same = f'<owl:equivalentClass rdf:resource="{IRI}core.owl#Area"/>'
    added(SITE, f'<owl:Class rdf:about="{IRI}tue_lab.owl#Zone">{same}</owl:Class>')(folder)
    given(SITE, "kitchen", f'<wing xmlns="{IRI}tue_lab.owl#">west</wing>')(folder)
    assert told_before_reasoning(folder) == []
