"""The corpus of wrong edits: each is refused with its code, at its place, in words that help.

Every case copies the shipped ontologies, makes one mistake that a person may make, and loads them.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.kb.conftest import (
    AMIGO,
    GROUNDINGS,
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
from tests.kb.faults import (
    Fault,
    a_class,
    a_limit,
    copied,
    fault,
    found,
    make,
    refused,
    removed,
    restricted,
    told_before_reasoning,
    travel_duration,
)

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
        words="poseX_m|'7,5' is no xsd:double",
    ),
    fault(
        "KB012",
        SITE,
        "at_bar",
        renamed(SITE, "at_bar", 'double">7.5', 'float">7.5'),
        words="poseX_m '7.5' is of the datatype float; use xsd:string, boolean, integer, double or anyURI",
    ),
    fault("KB012", SITE, "at_bar", given(SITE, "at_bar", number("capacity", "9" * 5_000, "integer")), words="999'..."),
    fault(
        "KB012",
        SITE,
        "drink_1",
        renamed(SITE, "drink_1", ">true<", ">yes<"),
        words="isEmpty 'yes' is no xsd:boolean",
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
    fault("KB107", TASK, "FindEachDrink_pick", dropped(TASK, "FindEachDrink_pick", "bodyStep"), words="bodyStep"),
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
        "FindEachDrink_pick",
        dropped(TASK, "FindEachDrink_pick", "overParameter"),
        words="overParameter",
    ),
    fault(
        "KB116",
        TASK,
        "FindEachDrink_pick",
        given(TASK, "FindEachDrink_pick", link("overParameter", TASK, "FindEachDrink_drink")),
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
        "FindEachDrink_drink_at",
        dropped(TASK, "FindEachDrink_drink_at", "objectParameter"),
        words="objectParameter|hasValue",
    ),
    fault(
        "KB118",
        TASK,
        "FindEachDrink_drink_at",
        dropped(TASK, "FindEachDrink_drink_at", "ofProperty"),
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
        "KB119", TASK, "FindEachDrink_condition", dropped(TASK, "FindEachDrink_condition", "operand"), words="operand"
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
        "KB136",
        GROUNDINGS,
        "Base_service",
        renamed(GROUNDINGS, "Base_service", "#RobotGrounding", "#ActionGrounding"),
        renamed(
            GROUNDINGS,
            "Base_service",
            "<core:serviceName>/{robot}/base</core:serviceName>",
            "<core:actionName>/{robot}/base</core:actionName>",
        ),
        words="actionType|nav2_msgs/NavigateToPose",
    ),
    fault(
        "KB136",
        GROUNDINGS,
        "Base_service",
        renamed(GROUNDINGS, "Base_service", "#RobotGrounding", "#ActionGrounding"),
        renamed(
            GROUNDINGS,
            "Base_service",
            "<core:serviceName>/{robot}/base</core:serviceName>",
            "<core:actionType>nav2_msgs/NavigateToPose</core:actionType>",
        ),
        words="actionName|/{robot}/navigate_to_pose",
    ),
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
        words="needs either mapsParameter",
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
    fault("KB141", SITE, "at_bar", renamed(SITE, "at_bar", ">1.0<", ">-1.0<"), words="tolerance_m|0 or more"),
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
        "FindEachDrink_pick",
        renamed(TASK, "FindEachDrink_pick", "#FindEachDrink_SearchDrink", "#FindEachDrink_pick"),
        words="contains itself: FindEachDrink_pick -> FindEachDrink_pick;",
    ),
    fault(
        "KB211",
        TASK,
        "FindEachDrink_body",
        renamed(TASK, "FindEachDrink_pick", "#FindEachDrink_SearchDrink", "#FindEachDrink_body"),
        words="FindEachDrink_body -> FindEachDrink_pick -> FindEachDrink_body;",
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
        "FindEachDrink_any",
        individual(TASK, "FindEachDrink_any", "AnyOf", link("operand", TASK, "FindEachDrink_condition")),
        given(TASK, "FindEachDrink_condition", link("operand", TASK, "FindEachDrink_any")),
        words="FindEachDrink_any -> FindEachDrink_condition -> FindEachDrink_any;|operand",
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
        "FindEachDrink_pick",
        renamed(TASK, "FindEachDrink_pick", "#FindEachDrink_robot", "#SearchDrink_robot"),
        words="goes over SearchDrink_robot|no parameter of FindEachDrink",
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
        "FindEachDrink_robot",
        renamed(TASK, "FindEachDrink_pick", "#FindEachDrink_robot", "#FindEachDrink_location"),
        words="is used by FindEachDrink_SearchDrink|no ForEach or Pick around it goes over it",
    ),
    fault(
        "KB126",
        TASK,
        "FindEachDrink_location",
        renamed(TASK, "FindEachDrink_body", link("overParameter", TASK, "FindEachDrink_location"), ""),
        words="used by FindEachDrink_drink_at|used by FindEachDrink_in_room|used by FindEachDrink_SearchDrink",
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
        "KB210",
        NAVIGATION,
        "Localize",
        individual(
            NAVIGATION,
            "Localize_any",
            "Choice",
            link("hasStep", NAVIGATION, "Localize_again"),
            link("hasStep", NAVIGATION, "Localize_body"),
        ),
        individual(NAVIGATION, "Localize_again", "Perform", link("performs", NAVIGATION, "Localize")),
        renamed(NAVIGATION, "Localize", "#Localize_body", "#Localize_any"),
        words="without having done a step: Localize -> Localize; put a step before that",
    ),
    fault(
        "KB301",
        SITE,
        "drink_1",
        given(SITE, "drink_1", f'<rdf:type rdf:resource="{IRI}core.owl#Sofa"/>'),
        words="contradicts itself|Sofa|Beer|tue_lab.owl:|objects.owl:",
    ),
    fault("KB303", OBJECTS, "Wing", a_limit("Wing", "inArea"), words="OWL 2 DL"),
    fault(
        "KB304",
        SITE,
        "cookery",
        individual(SITE, "cookery", "Room", f'<owl:sameAs rdf:resource="{IRI}tue_lab.owl#kitchen"/>'),
        words="the same as kitchen; use one name",
    ),
    fault(
        "KB302",
        OBJECTS,
        "Mug",
        a_class(OBJECTS, "Mug", "objects.owl#Drink", "core.owl#Furniture"),
        words="nothing can ever belong",
    ),
]


def test_of_values_that_are_none_only_we_tell(
    folder: Path, caplog: pytest.LogCaptureFixture, recwarn: pytest.WarningsRecorder
) -> None:
    """What rdflib would log and warn of, with a traceback, reaches nobody."""
    renamed(SITE, "at_bar", ">7.5<", ">7,5<")(folder)
    renamed(SITE, "drink_1", ">true<", ">yes<")(folder)
    assert {p.code for p in told_before_reasoning(folder)} == {"KB012"}
    assert caplog.records == []
    assert list(recwarn) == []


@pytest.mark.parametrize("case", QUICK, ids=str)
def test_a_wrong_edit_is_found_before_reasoning(case: Fault, folder: Path) -> None:
    """The problem has its code, points at file, line and entity, and says what helps; nothing else is blamed."""
    make([case], folder)
    found([case], folder, told_before_reasoning(folder))


@pytest.mark.parametrize("case", REASONED, ids=str)
def test_a_wrong_edit_is_refused(case: Fault, folder: Path) -> None:
    """The same after all stages."""
    refused([case], folder)
