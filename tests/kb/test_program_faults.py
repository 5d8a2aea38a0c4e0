"""The corpus of wrong edits, continued: what makes a process or a condition wrong.

Reasoning takes seconds, so that mistakes which do not hide each other are made at once.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.kb.conftest import CORE, NAVIGATION, SITE, TASK, Edit, given, individual, link, number, renamed
from tests.kb.faults import Fault, fault, refused


def construct(name: str, kind: str, *properties: str) -> Edit:
    """Add a control construct around the body of FindEachDrink."""
    return individual(TASK, name, kind, link("bodyStep", TASK, "FindEachDrink_body"), *properties)


def body(construct: str) -> Edit:
    """Make FindEachDrink consist of another construct."""
    return renamed(TASK, "FindEachDrink", "#FindEachDrink_body", f"#{construct}")


def comparison(name: str, kind: str, *properties: str) -> Edit:
    """Add a comparison of a property of the robot of FindEachDrink; without a kind, the rest alone."""
    said = (f"<core:comparison>{kind}</core:comparison>",) if kind else ()
    left = (link("ofProperty", CORE, "radius_m"), link("subjectParameter", TASK, "FindEachDrink_robot"))
    return individual(TASK, name, "Compare", *left, *said, *properties)


def parameter(process: str, name: str, kind: str, of: str, place: int) -> Edit:
    """Add a parameter for a process of navigation.owl, or for a new one there."""
    return individual(
        NAVIGATION,
        f"{process}_{name}",
        kind,
        f"<core:parameterName>{name}</core:parameterName>",
        number("parameterNumber", str(place), "integer"),
        link("parameterType", CORE, of),
    )


def task_type(task: str, *parameters: tuple[str, str, str]) -> tuple[Edit, ...]:
    """Add a task type that Navigate realizes, with parameters (name, kind, class)."""
    edits = [parameter(task, name, kind, of, 10) for name, kind, of in parameters]
    lines = [
        link("hasOutput" if kind == "Output" else "hasInput", NAVIGATION, f"{task}_{name}")
        for name, kind, _ in parameters
    ]
    edits.append(individual(NAVIGATION, task, "SimpleProcess", *lines))
    return (*edits, given(NAVIGATION, "Navigate", link("realizes", NAVIGATION, task)))


def precondition(process: str, name: str, kind: str, *properties: str) -> tuple[Edit, ...]:
    """Give a process of navigation.owl one more precondition."""
    return (
        individual(NAVIGATION, name, kind, *properties),
        given(NAVIGATION, process, link("hasPrecondition", NAVIGATION, name)),
    )


def in_area(process: str) -> tuple[str, ...]:
    """The lines of a condition: the location is in the area of a process."""
    return (
        link("ofProperty", CORE, "inArea"),
        link("subjectParameter", NAVIGATION, f"{process}_location"),
        link("objectParameter", NAVIGATION, f"{process}_area"),
    )


ROBOT, AREA = ("robot", "RobotParameter", "Robot"), ("area", "Input", "Area")
LOCATION, THING = ("location", "Input", "Location"), ("location", "Input", "PhysicalObject")
ROBOT_OF_BASE = link("subjectParameter", NAVIGATION, "Base_robot")
HALF = number("hasValue", "0.5")
RIGHT = (link("objectProperty", CORE, "energy_J"), link("objectParameter", TASK, "FindEachDrink_robot"))
WIDE = (link("ofProperty", CORE, "radius_m"), link("subjectParameter", NAVIGATION, "Navigate_robot"))
MORE, AT_MOST = "<core:comparison>more</core:comparison>", "<core:comparison>at most</core:comparison>"
IS_EMPTY = (link("ofProperty", CORE, "isEmpty"), link("subjectParameter", TASK, "SearchDrink_drink"))

SHAPES = [
    *(
        fault("KB127", TASK, f"Half_{n}", comparison(f"Half_{n}", kind, *properties), words=words)
        for n, (kind, properties, words) in enumerate(
            (
                ("beyond", (HALF,), "less, at most, more, at least or equal"),
                ("", (HALF,), "one comparison"),
                ("more", (), "either hasValue (a number) or objectProperty"),
                ("more", ("<core:hasValue>much</core:hasValue>",), "hasValue (a number)"),
                ("more", (HALF, RIGHT[0]), "either hasValue"),
                ("more", (HALF, *RIGHT), "either hasValue"),
                ("more", (RIGHT[0],), "objectProperty and objectParameter"),
                ("more", (RIGHT[1],), "objectProperty and objectParameter"),
            )
        )
    ),
    *(
        fault("KB107", TASK, f"Odd_{kind}", individual(TASK, f"Odd_{kind}", kind), words="no step")
        for kind in ("AnyOrder", "Split", "Prioritized")
    ),
    *(
        fault("KB107", TASK, f"Odd_{kind}", individual(TASK, f"Odd_{kind}", kind), words="bodyStep", because=because)
        for kind, because in (("Iterate", ""), ("Interrupt", "KB115"), ("Lookahead", ""), ("Deadline", "KB165"))
    ),
    fault(
        "KB144",
        TASK,
        "FindEachDrink_is_empty",
        renamed(TASK, "FindEachDrink_is_empty", "#boolean", "#string"),
        words="the value 'true' for isEmpty|datatype boolean",
    ),
    fault(
        "KB144",
        NAVIGATION,
        "Base_there",
        *precondition("Base", "Base_there", "Holds", link("ofProperty", CORE, "locatedAt"), ROBOT_OF_BASE, HALF),
        words="locatedAt|property of individuals: use objectParameter",
    ),
    fault("KB115", TASK, "Odd_Await", individual(TASK, "Odd_Await", "Await"), words="hasCondition"),
    fault(
        "KB109",
        TASK,
        "Guard",
        individual(TASK, "Guard", "Prioritized", link("hasStep", TASK, "FindEachDrink_body")),
        words="FindEachDrink_body",
    ),
    fault(
        "KB163", NAVIGATION, "Laser", renamed(NAVIGATION, "Laser", ">0.008<", ">-1.0<"), words="duration_s|0 or more"
    ),
    fault(
        "KB163",
        NAVIGATION,
        "Navigate",
        renamed(NAVIGATION, "Navigate", ">20.0<", ">-0.5<"),
        words="graceTime_s|0 or more",
    ),
    fault("KB163", NAVIGATION, "NavMap", renamed(NAVIGATION, "NavMap", ">0.02<", ">1e308<"), words="at most 1e8"),
    *(
        fault("KB164", NAVIGATION, name, given(NAVIGATION, name, number("successOdds", odds)), words="above 0")
        for name, odds in (("Path", "0.0"), ("Pose", "-0.5"), ("Base", "1.01"))
    ),
    *(
        fault(
            "KB165",
            TASK,
            f"Soon_{n}",
            construct(f"Soon_{n}", "Deadline", *properties),
            words="deadline_s|0.001 or more",
        )
        for n, properties in enumerate(((), *((number("deadline_s", s),) for s in ("0.0", "-3.0", "1e308"))))
    ),
]
"""What shapes show."""

INDIVIDUALS = [
    fault(
        "KB132",
        SITE,
        "amigo_1",
        given(SITE, "amigo_1", number("energy_J", "-1.0") + number("power_W", "60.0")),
        words="energy_J -1.0|above 0",
    ),
    fault(
        "KB133",
        SITE,
        "pico_1",
        given(SITE, "pico_1", number("energy_J", "3600.0")),
        words="has energy_J, but no power_W|energy_J / power_W seconds",
    ),
    fault(
        "KB134",
        SITE,
        "at_bar",
        given(SITE, "at_bar", number("capacity", "0", "integer")),
        words="capacity 0|above 0",
    ),
]
"""What shows of individuals once the ontology is classified."""

PROCESSES = [
    *(
        fault(
            "KB128",
            NAVIGATION,
            "Navigate",
            given(NAVIGATION, "Navigate", link("claimsParameter", NAVIGATION, claimed)),
            words=f"claims {claimed}, which is no input of it that names an individual",
        )
        for claimed in ("Navigate_scan", "Navigate_robot", "Localize_area")
    ),
    fault(
        "KB129",
        NAVIGATION,
        "Navigate",
        *task_type("Reach", ROBOT, AREA),
        words="realizes Reach|needs the input 'location', which Reach does not have",
    ),
    fault(
        "KB129",
        NAVIGATION,
        "Navigate",
        *task_type("Touch", ROBOT, AREA, THING),
        words="takes a Location for 'location', but Touch may be given any PhysicalObject",
    ),
    fault(
        "KB129",
        NAVIGATION,
        "Navigate",
        *task_type("Follow", ("robot", "Input", "Robot"), AREA, LOCATION),
        words="'robot' is an input of Follow and no RobotParameter",
    ),
    fault(
        "KB129",
        NAVIGATION,
        "Navigate",
        *task_type("Scout", ROBOT, AREA, LOCATION, ("view", "Output", "Scan")),
        words="lacks the output 'view', which Scout promises",
    ),
    fault("KB130", NAVIGATION, "Fly", individual(NAVIGATION, "Fly", "SimpleProcess"), words="no process realizes"),
    fault(
        "KB161",
        NAVIGATION,
        "Navigate_duration",
        parameter("Navigate", "aide", "RobotParameter", "Robot", 5),
        given(NAVIGATION, "Navigate", link("hasInput", NAVIGATION, "Navigate_aide")),
        words="has Navigate_robot travel|first is Navigate_aide|parameterNumbers",
        because="KB110",
    ),
    fault(
        "KB164",
        TASK,
        "SearchDrink",
        given(TASK, "SearchDrink", number("successOdds", "0.5")),
        words="not one step|hasDurationModel",
    ),
]
"""Why processes do not compile."""

UNSOUND = [
    fault(
        "KB212",
        NAVIGATION,
        "Navigate_40_drive",
        individual(NAVIGATION, "There", "Holds", *in_area("Navigate")),
        renamed(NAVIGATION, "Navigate_40_drive", "#Navigate_arrived_condition", "#There"),
        words="asks for inArea|no effect changes|never ends or never turns in Navigate",
    ),
    fault(
        "KB212",
        TASK,
        "Whenever",
        individual(
            TASK,
            "In_itself",
            "Holds",
            link("ofProperty", CORE, "inArea"),
            link("subjectParameter", TASK, "FindEachDrink_room"),
            link("objectParameter", TASK, "FindEachDrink_room"),
        ),
        individual(
            TASK,
            "Whenever",
            "Interrupt",
            link("bodyStep", TASK, "FindEachDrink_SearchDrink"),
            link("hasCondition", TASK, "In_itself"),
            *(link("overParameter", TASK, f"FindEachDrink_{name}") for name in ("robot", "drink", "location")),
        ),
        body("Whenever"),
        words="asks for inArea",
    ),
    fault(
        "KB214",
        NAVIGATION,
        "Navigate",
        *precondition("Navigate", "Here", "Holds", *in_area("Navigate")),
        *precondition("Navigate", "Elsewhere", "Not", link("operand", NAVIGATION, "Here")),
        words="inArea(location, area) and not inArea(location, area)|exclude each other",
    ),
    fault(
        "KB214",
        TASK,
        "SearchDrink",
        *(individual(TASK, f"Is_{v}", "Holds", *IS_EMPTY, number("hasValue", v, "boolean")) for v in ("true", "false")),
        given(TASK, "SearchDrink", "".join(link("hasPrecondition", TASK, f"Is_{v}") for v in ("true", "false"))),
        words="isEmpty(drink, false) and isEmpty(drink, true)",
    ),
    fault(
        "KB215",
        NAVIGATION,
        "Localize_30_Pose",
        renamed(NAVIGATION, "Localize_20_Laser", ">20<", ">40<"),
        words="reads 'scan', which no step of Localize can have made before|stepNumbers",
    ),
]
"""Programs that compile and cannot be right."""

UNSOUND_TOO = [
    fault(
        "KB212",
        NAVIGATION,
        "Navigate_40_drive",
        individual(NAVIGATION, "Big", "Compare", *WIDE, MORE, HALF),
        individual(NAVIGATION, "Small", "Not", link("operand", NAVIGATION, "Big")),
        renamed(NAVIGATION, "Navigate_40_drive", "RepeatUntil", "RepeatWhile"),
        renamed(NAVIGATION, "Navigate_40_drive", "#Navigate_arrived_condition", "#Small"),
        words="asks for radius_m",
    ),
    fault(
        "KB213",
        TASK,
        "Often",
        construct("Often", "Iterate"),
        body("Often"),
        words="may turn without doing anything",
    ),
    fault(
        "KB214",
        NAVIGATION,
        "Navigate",
        individual(NAVIGATION, "Broad", "Compare", *WIDE, MORE, HALF),
        individual(NAVIGATION, "Narrow", "Compare", *WIDE, AT_MOST, HALF),
        *precondition("Navigate", "Both", "AllOf", *(link("operand", NAVIGATION, n) for n in ("Broad", "Narrow"))),
        words="radius_m(robot) more 0.5|radius_m(robot) at most 0.5",
    ),
    fault(
        "KB215",
        NAVIGATION,
        "Navigate_blocked",
        renamed(NAVIGATION, "Navigate_40_40_blocked", ">40<", ">5<"),
        words="asked for by a condition of Navigate",
    ),
]
"""Others, which would hide those."""

ENDLESS = [
    fault(
        "KB213",
        NAVIGATION,
        "Navigate_40_drive",
        individual(NAVIGATION, "Any_number", "Iterate", link("bodyStep", NAVIGATION, "Navigate_40_cycle")),
        renamed(NAVIGATION, "Navigate_40_drive", "#Navigate_40_cycle", "#Any_number"),
        words="without doing anything, for ever, in Navigate",
    ),
    fault(
        "KB215",
        NAVIGATION,
        "Localize",
        renamed(NAVIGATION, "Localize_body", link("hasStep", NAVIGATION, "Localize_30_Pose"), ""),
        words="promises the output 'pose'|no step of it makes",
    ),
]
"""A loop whose body may do nothing, and an output that nothing makes."""

UNMADE = [
    fault(
        "KB212",
        NAVIGATION,
        "Navigate_40_drive",
        renamed(NAVIGATION, "Navigate_40_drive", "#Navigate_40_cycle", "#Navigate_40_10_Localize"),
        words="asks for arrived|no step of its body",
    ),
    fault(
        "KB215",
        NAVIGATION,
        "Navigate_arrived",
        words="asked for by a condition of Navigate, but no step of it can have made that before",
    ),
]
"""A loop that asks for what its body does not find out: two things are wrong with it."""

GROUPS = [SHAPES, INDIVIDUALS, PROCESSES, UNSOUND, UNSOUND_TOO, ENDLESS, UNMADE]


@pytest.mark.parametrize("cases", GROUPS, ids=lambda cases: "-".join(sorted({case.code for case in cases})))
def test_wrong_edits_are_all_refused(cases: list[Fault], folder: Path) -> None:
    """Each problem has its code, points at file, line and entity, and says what helps; nothing else is blamed."""
    refused(cases, folder)
