"""The corpus of wrong edits: each is refused with its code, at its place, in words that help.

Every case copies the shipped ontologies, makes one mistake that a person may make, and loads them.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from kb.errors import KnowledgeError
from kb.store import KnowledgeBase, UnknownSite
from kb.terms import Var, struct
from tests.kb.conftest import (
    AMIGO,
    GROUNDINGS,
    IRI,
    NAVIGATION,
    OBJECTS,
    SITE,
    TASK,
    added,
    ask,
    dropped,
    given,
    individual,
    link,
    number,
    renamed,
)
from tests.kb.faults import Fault, a_class, copied, fault, problems_of, refused, removed, restricted, travel_duration
from tests.kb.test_program_faults import GROUPS

# What the files themselves, shapes and vocabulary show, before any reasoning.
QUICK = [
    # Imports
    fault("KB002", SITE, "", removed(AMIGO), words="imports|amigo.owl|no file"),
    fault("KB003", SITE, "", copied(AMIGO, "robots/amigo_copy.owl"), words="amigo.owl|amigo_copy.owl|two files"),
    # Terms
    fault(
        "KB011",
        AMIGO,
        "Amigo",
        restricted(AMIGO, "radius_m", "#radius_m", "#radus_m"),
        words="radus_m|did you mean radius_m?",
    ),
    fault(
        "KB011",
        SITE,
        "amigo_1",
        renamed(SITE, "amigo_1", "locatedAt", "locatdAt"),
        words="locatdAt|did you mean locatedAt?",
    ),
    fault("KB011", SITE, "drink_1", renamed(SITE, "drink_1", "#Beer", "#Beeer"), words="Beeer|did you mean Beer?"),
    fault(
        "KB011",
        SITE,
        "drink_1",
        renamed(SITE, "drink_1", "core:isEmpty", "core:zzzzzz"),
        words="zzzzzz|declared nowhere",
    ),
    fault(
        "KB012",
        SITE,
        "at_bar",
        renamed(SITE, "at_bar", ">7.5<", ">7,5<"),
        words="poseX_m|'7,5'|double",
    ),
    fault("KB012", SITE, "at_bar", renamed(SITE, "at_bar", "double", "dubble"), words="poseX_m|dubble"),
    fault("KB012", NAVIGATION, "Laser", renamed(NAVIGATION, "Laser", ">0.008<", ">NaN<"), words="duration_s|finite"),
    fault("KB012", AMIGO, "Amigo", restricted(AMIGO, "radius_m", ">0.35<", ">INF<"), words="radius_m|finite"),
    fault("KB012", SITE, "at_bar", renamed(SITE, "at_bar", ">7.5<", ">-1e999<"), words="poseX_m|finite"),
    fault("KB012", AMIGO, "Amigo", restricted(AMIGO, "radius_m", ">0.35<", ">0,35<"), words="radius_m '0,35'|double"),
    fault(
        "KB011",
        SITE,
        "drink_1",
        renamed(SITE, "drink_1", "objects.owl#Beer", "object.owl#Beer"),
        words="/object.owl#Beer>|did you mean <http://example.org/concertmaster/objects.owl#Beer>?",
    ),
    fault(
        "KB011",
        AMIGO,
        "Amigo",
        restricted(AMIGO, "radius_m", "core.owl#radius_m", "cor.owl#radius_m"),
        words="/cor.owl#radius_m>|core.owl#radius_m>?",
    ),
    fault(
        "KB011", AMIGO, "Amigo", restricted(AMIGO, "radius_m", "owl:hasValue", "owl:hasValu"), words="hasValu|nowhere"
    ),
    # Processes
    fault(
        "KB101",
        NAVIGATION,
        "Beep",
        individual(NAVIGATION, "Beep", "AtomicProcess", number("duration_s", "1.0")),
        words="grounding",
    ),
    fault(
        "KB101",
        NAVIGATION,
        "Laser",
        individual(
            GROUNDINGS,
            "Laser_again",
            "RobotGrounding",
            link("grounds", NAVIGATION, "Laser"),
            "<core:serviceName>/{robot}/laser</core:serviceName>",
            number("timeout_s", "1.0"),
            link("hasReplyField", GROUNDINGS, "Laser_service_scan"),
        ),
        words="more than one",
    ),
    fault("KB103", NAVIGATION, "Localize", dropped(NAVIGATION, "Localize", "composedOf"), words="composedOf"),
    fault(
        "KB104",
        NAVIGATION,
        "Base_velocity",
        dropped(NAVIGATION, "Base_velocity", "parameterType"),
        words="parameterType",
    ),
    fault(
        "KB105",
        NAVIGATION,
        "Base_velocity",
        renamed(NAVIGATION, "Base_velocity", ">velocity<", ">my speed<"),
        words="parameterName",
    ),
    fault(
        "KB105",
        NAVIGATION,
        "Base_velocity",
        renamed(NAVIGATION, "Base_velocity", ">velocity<", ">Velocity<"),
        words="small letter",
    ),
    fault(
        "KB106", NAVIGATION, "Localize_20_Laser", dropped(NAVIGATION, "Localize_20_Laser", "performs"), words="perform"
    ),
    fault("KB107", NAVIGATION, "Localize_body", dropped(NAVIGATION, "Localize_body", "hasStep"), words="no step"),
    fault("KB107", TASK, "FindEmptyDrink_pick", dropped(TASK, "FindEmptyDrink_pick", "bodyStep"), words="bodyStep"),
    fault(
        "KB107",
        NAVIGATION,
        "Navigate_40_40_blocked",
        dropped(NAVIGATION, "Navigate_40_40_blocked", "thenStep"),
        words="thenStep",
    ),
    fault(
        "KB108",
        NAVIGATION,
        "Localize_body",
        renamed(NAVIGATION, "Localize_20_Laser", ">20<", ">10<"),
        words="stepNumber 10|Localize_10_LocMap|Localize_20_Laser",
    ),
    fault(
        "KB109",
        NAVIGATION,
        "Localize_body",
        dropped(NAVIGATION, "Localize_20_Laser", "stepNumber"),
        words="Localize_20_Laser",
    ),
    fault(
        "KB114",
        NAVIGATION,
        "Base_velocity",
        given(NAVIGATION, "Localize", link("hasInput", NAVIGATION, "Base_velocity")),
        words="more than one process",
    ),
    fault(
        "KB115",
        NAVIGATION,
        "Navigate_40_drive",
        dropped(NAVIGATION, "Navigate_40_drive", "hasCondition"),
        words="hasCondition",
    ),
    fault(
        "KB116",
        TASK,
        "FindEmptyDrink_pick",
        dropped(TASK, "FindEmptyDrink_pick", "overParameter"),
        words="overParameter",
    ),
    fault(
        "KB116",
        TASK,
        "FindEmptyDrink_pick",
        given(TASK, "FindEmptyDrink_pick", link("overParameter", TASK, "FindEmptyDrink_drink")),
        words="nest another Pick",
    ),
    fault(
        "KB117",
        NAVIGATION,
        "Localize_30_Pose_odometry",
        dropped(NAVIGATION, "Localize_30_Pose_odometry", "fromParameter"),
        words="fromParameter",
    ),
    fault(
        "KB118",
        TASK,
        "FindEmptyDrink_drink_at",
        dropped(TASK, "FindEmptyDrink_drink_at", "objectParameter"),
        words="objectParameter|hasValue",
    ),
    fault(
        "KB118",
        TASK,
        "FindEmptyDrink_drink_at",
        dropped(TASK, "FindEmptyDrink_drink_at", "ofProperty"),
        words="ofProperty",
    ),
    fault(
        "KB118",
        NAVIGATION,
        "Navigate_arrived_condition",
        dropped(NAVIGATION, "Navigate_arrived_condition", "ofTruthValue"),
        words="ofTruthValue",
    ),
    fault(
        "KB119", TASK, "FindEmptyDrink_condition", dropped(TASK, "FindEmptyDrink_condition", "operand"), words="operand"
    ),
    fault(
        "KB123",
        NAVIGATION,
        "Navigate_effect",
        dropped(NAVIGATION, "Navigate_effect", "subjectParameter"),
        words="subjectParameter",
    ),
    # Groundings
    fault(
        "KB120",
        GROUNDINGS,
        "Base_service",
        renamed(GROUNDINGS, "Base_service", "/{robot}/base", "{robot} base"),
        words="serviceName|/{robot}/laser",
    ),
    fault(
        "KB120",
        GROUNDINGS,
        "Base_service",
        renamed(GROUNDINGS, "Base_service", ">1.0<", ">0.0<"),
        words="timeout_s|more than 0",
    ),
    fault(
        "KB120",
        GROUNDINGS,
        "Base_service",
        dropped(GROUNDINGS, "Base_service", "grounds"),
        words="ground exactly one",
        because="KB101 KB122",
    ),
    fault(
        "KB121",
        GROUNDINGS,
        "Base_service_velocity",
        renamed(GROUNDINGS, "Base_service_velocity", "geometry_msgs/Twist", "Twist!"),
        words="messageType",
    ),
    fault(
        "KB121",
        GROUNDINGS,
        "Base_service_velocity",
        dropped(GROUNDINGS, "Base_service_velocity", "mapsParameter"),
        words="mapsParameter or fileName",
    ),
    fault(
        "KB122",
        GROUNDINGS,
        "Base_service",
        dropped(GROUNDINGS, "Base_service", "hasReplyField"),
        words="output Base_odometry|no reply field",
    ),
    fault(
        "KB122",
        GROUNDINGS,
        "Base_service",
        renamed(GROUNDINGS, "Base_service_velocity", "#Base_velocity", "#Laser_scan"),
        words="Base_service_velocity|Laser_scan|another process",
    ),
    # Places, values, durations
    fault("KB140", SITE, "at_bar", dropped(SITE, "at_bar", "inArea"), words="inArea"),
    fault("KB141", SITE, "at_bar", dropped(SITE, "at_bar", "poseX_m"), words="poseX_m"),
    fault(
        "KB143",
        SITE,
        "amigo_1",
        given(SITE, "amigo_1", link("locatedAt", SITE, "at_bar")),
        words="locatedAt|at_bar and start_west",
    ),
    fault("KB160", NAVIGATION, "Laser", dropped(NAVIGATION, "Laser", "duration_s"), words="duration_s"),
    fault(
        "KB161",
        NAVIGATION,
        "Navigate_duration",
        dropped(NAVIGATION, "Navigate_duration", "travelGoal"),
        words="travelGoal",
    ),
    # Wholes that are parts of themselves
    fault(
        "KB211",
        TASK,
        "FindEmptyDrink_pick",
        renamed(TASK, "FindEmptyDrink_pick", "#FindEmptyDrink_SearchDrink", "#FindEmptyDrink_pick"),
        words="contains itself: FindEmptyDrink_pick -> FindEmptyDrink_pick;",
    ),
    fault(
        "KB211",
        TASK,
        "FindEmptyDrink_body",
        renamed(TASK, "FindEmptyDrink_pick", "#FindEmptyDrink_SearchDrink", "#FindEmptyDrink_body"),
        words="FindEmptyDrink_body -> FindEmptyDrink_pick -> FindEmptyDrink_body;",
    ),
    fault(
        "KB211",
        NAVIGATION,
        "Localize_20_Laser",
        given(NAVIGATION, "Localize_20_Laser", link("hasStep", NAVIGATION, "Localize_body")),
        words="Localize_20_Laser -> Localize_body -> Localize_20_Laser;",
    ),
    fault(
        "KB211",
        NAVIGATION,
        "Navigate_40_40_blocked",
        given(NAVIGATION, "Navigate_40_40_blocked", link("elseStep", NAVIGATION, "Navigate_40_drive")),
        words="Navigate_40_drive -> ",
    ),
    fault(
        "KB211",
        TASK,
        "FindEmptyDrink_any",
        individual(TASK, "FindEmptyDrink_any", "AnyOf", link("operand", TASK, "FindEmptyDrink_condition")),
        given(TASK, "FindEmptyDrink_condition", link("operand", TASK, "FindEmptyDrink_any")),
        words="FindEmptyDrink_any -> FindEmptyDrink_condition -> FindEmptyDrink_any;|operand",
    ),
]

# What shows once the ontology is classified.
REASONED = [
    fault("KB004", SITE, "Laser", individual(SITE, "Laser", "Cabinet"), words="same name|navigation.owl:|rename"),
    fault(
        "KB004",
        SITE,
        "radius_m",
        added(SITE, f'<owl:DatatypeProperty rdf:about="{IRI}tue_lab.owl#radius_m"/>'),
        words="same name|core.owl:|rename",
    ),
    fault(
        "KB110",
        NAVIGATION,
        "Localize_30_Pose",
        renamed(NAVIGATION, "Localize_30_Pose", f"{link('hasBinding', NAVIGATION, 'Localize_30_Pose_odometry')}\n", ""),
        words="input odometry of Pose|not bound|Binding to Pose_odometry",
    ),
    fault(
        "KB111",
        NAVIGATION,
        "Path",
        renamed(NAVIGATION, "Path_scan", ">scan<", ">pose<"),
        words="two parameters named 'pose'",
    ),
    fault(
        "KB112",
        NAVIGATION,
        "Navigate_40_20_VelCmd",
        renamed(NAVIGATION, "VelCmd_scan", "#Scan", "#OdometryReading"),
        words="scan of VelCmd is a OdometryReading|scan of Navigate is a Scan",
    ),
    fault(
        "KB117",
        NAVIGATION,
        "Localize_20_Laser",
        given(NAVIGATION, "Localize_20_Laser", link("hasBinding", NAVIGATION, "Localize_30_Pose_odometry")),
        words="Pose_odometry|no parameter of Laser",
    ),
    fault(
        "KB124",
        NAVIGATION,
        "VelCmd_arrived",
        renamed(NAVIGATION, "Navigate_arrived_condition", '#Navigate_arrived"', '#VelCmd_arrived"'),
        words="used in Navigate|no parameter of it",
    ),
    fault(
        "KB124",
        TASK,
        "FindEmptyDrink_pick",
        renamed(TASK, "FindEmptyDrink_pick", "#FindEmptyDrink_robot", "#SearchDrink_robot"),
        words="goes over SearchDrink_robot|no parameter of FindEmptyDrink",
    ),
    fault("KB125", GROUNDINGS, "Detection_service", removed("sites/tue_lab/HUE.yaml"), words="HUE.yaml|does not exist"),
    fault(
        "KB125",
        NAVIGATION,
        "Navigate_duration",
        renamed(NAVIGATION, "Navigate_duration_map_file", "navMap", "noMap"),
        words="noMap.yaml|does not exist",
    ),
    fault(
        "KB126",
        TASK,
        "FindEmptyDrink_robot",
        renamed(TASK, "FindEmptyDrink_pick", "#FindEmptyDrink_robot", "#FindEmptyDrink_location"),
        words="is used by FindEmptyDrink_SearchDrink|no ForEach or Pick around it goes over it",
    ),
    fault(
        "KB126",
        TASK,
        "FindEmptyDrink_location",
        renamed(TASK, "FindEmptyDrink_body", link("overParameter", TASK, "FindEmptyDrink_location"), ""),
        words="used by FindEmptyDrink_drink_at|used by FindEmptyDrink_in_room|used by FindEmptyDrink_SearchDrink",
    ),
    fault(
        "KB131",
        SITE,
        "amigo_1",
        restricted(AMIGO, "radius_m", "", ""),
        words="no radius_m|class Amigo|SubClassOf: radius_m value",
    ),
    *(
        fault(
            "KB132",
            SITE,
            "amigo_1",
            restricted(AMIGO, prop, f">{right}<", f">{wrong}<"),
            words=f"class Amigo|{prop} {wrong}|above 0",
        )
        for prop, right, wrong in (
            ("radius_m", 0.35, 0.0),
            ("maxVelLin_mps", 0.7, -0.7),
            ("maxVelAng_radps", 1.2, 0.0),
        )
    ),
    fault(
        "KB162",
        NAVIGATION,
        "Other_duration",
        travel_duration("Other_duration", "/compute/other", "map_file", "radius_m", "max_vel_lin_mps"),
        words="another service or other fields than Navigate_duration|only one way",
    ),
    fault(
        "KB162",
        NAVIGATION,
        "Other_duration",
        travel_duration("Other_duration", "/compute/travel", "map_file", "radius_m"),
        words="another service or other fields than Navigate_duration|only one way",
    ),
    fault(
        "KB210",
        NAVIGATION,
        "Localize",
        renamed(NAVIGATION, "Localize_20_Laser", "#Laser", "#Localize"),
        words="without end|Localize -> Localize",
    ),
    fault(
        "KB301",
        SITE,
        "drink_1",
        given(SITE, "drink_1", f'<rdf:type rdf:resource="{IRI}core.owl#Sofa"/>'),
        words="contradicts itself|Sofa|Beer|tue_lab.owl:|objects.owl:",
    ),
    fault(
        "KB302",
        OBJECTS,
        "Mug",
        a_class(OBJECTS, "Mug", "objects.owl#Drink", "core.owl#Furniture"),
        words="nothing can ever belong",
    ),
]


@pytest.mark.parametrize("case", QUICK + REASONED, ids=str)
def test_a_wrong_edit_is_refused(case: Fault, folder: Path) -> None:
    """The problem has its code, points at file, line and entity, and says what helps; nothing else is blamed."""
    refused([case], folder)


def test_every_code_has_a_case() -> None:
    """No check of shapes and code is without a wrong edit that it finds."""
    package = Path(__file__).parents[2] / "kb"
    cases = [*QUICK, *REASONED, *(case for group in GROUPS for case in group)]
    source = "".join(f.read_text(encoding="utf-8") for f in [*package.glob("*.py"), package / "shapes.ttl"])
    assert set(re.findall(r"\bKB\d{3}\b", source)) == {case.code for case in cases} | {"KB001"}


def test_travel_may_be_estimated_twice_in_the_same_way(folder: Path) -> None:
    """Two travel durations that name the same service and fields are one estimate."""
    travel_duration("Other_duration", "/compute/travel", "map_file", "radius_m", "max_vel_lin_mps")(folder)
    knowledge = KnowledgeBase("tue_lab", folder)
    assert len(knowledge.snapshot().travel_estimates) == 1
    knowledge.close()


def test_several_faults_are_told_at_once(folder: Path) -> None:
    """A person gets the whole list, in order of file and line."""
    for case in (dropped(SITE, "at_bar", "inArea"), dropped(NAVIGATION, "Laser", "duration_s")):
        case(folder)
    problems = problems_of(folder)
    assert [p.code for p in problems] == ["KB140", "KB160"]
    assert [p.file.name for p in problems] == ["tue_lab.owl", "navigation.owl"]


def test_a_message_is_one_line_for_a_person(folder: Path) -> None:
    """File, line, code, entity, what is wrong; IRIs are shortened."""
    dropped(NAVIGATION, "Laser", "duration_s")(folder)
    with pytest.raises(KnowledgeError) as caught:
        KnowledgeBase("tue_lab", folder)
    assert re.fullmatch(r".*/tasks/navigation\.owl:\d+ KB160 error Laser: needs one duration_s .*", str(caught.value))
    assert "http://" not in str(caught.value)


def test_an_unknown_site_names_those_there_are(folder: Path) -> None:
    """A misspelt site is answered with the known ones."""
    with pytest.raises(UnknownSite) as caught:
        KnowledgeBase("tue_lob", folder)
    assert (caught.value.site, caught.value.known) == ("tue_lob", ["tue_lab"])
    assert re.search(r"'tue_lob' in .*there is tue_lab", str(caught.value))


def test_a_refused_load_changes_nothing(folder: Path, shipped: KnowledgeBase) -> None:
    """What was open before answers as before, in Python and in Prolog."""
    facts = struct(
        "aggregate_all",
        "count",
        struct(
            ",",
            struct("member", struct("/", Var("N"), Var("A")), [struct("/", "kind", 3), struct("/", "definition", 4)]),
            struct(
                ",", struct("functor", Var("H"), Var("N"), Var("A")), struct("call", struct(":", "kb_facts", Var("H")))
            ),
        ),
        Var("Answer"),
    )
    before, count = shipped.snapshot(), ask(facts)
    renamed(NAVIGATION, "Localize_20_Laser", "#Laser", "#Localize")(folder)
    problems_of(folder)
    after = shipped.snapshot()
    assert (after.revision, after.state, after.fluents) == (before.revision, before.state, before.fluents)
    assert after.program("FindEmptyDrink") == before.program("FindEmptyDrink")
    assert ask(facts) == count > 0
