"""A fleet on patrol as an ontology: what the benchmark of the fleet loads, plans and executes.

Every robot of the site drives leg after leg, by a service of its own, until it says that its patrol is over: one task,
`PatrolAll`, in which all robots work side by side. The hall is empty; its map is coarse, for travel times only.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from kb.files import SHIPPED
from tests.benchmarks.fleet_ontology import OntologyFile, has

SITE, TASK, DRIVE = "hall", "PatrolAll", "DriveLeg"
LEG_M, LONGEST_LEG_S = 5.0, 15.0
PATROL_S = 600.0
_CELLS, _CELL_M = 20, 5.0


def robot_name(number: int) -> str:
    """The robot of this number."""
    return f"patrol_{number}"


def service_of(robot: str) -> str:
    """The service by which a robot drives a leg; it takes nothing, and tells whether the patrol is `over`."""
    return f"/{robot}/{DRIVE.lower()}"


def write_ontologies(robots: int, folder: Path) -> None:
    """Write the ontologies of such a fleet into a folder that does not exist yet."""
    shutil.copytree(SHIPPED, folder)
    site = folder / "sites" / SITE
    site.mkdir()
    cells = "\n".join(" ".join(["254"] * _CELLS) for _ in range(_CELLS))
    (site / "hall.pgm").write_text(f"P2\n{_CELLS} {_CELLS}\n255\n{cells}\n", encoding="ascii")
    thresholds = "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    (site / "hall.yaml").write_text(f"image: hall.pgm\nresolution: {_CELL_M}\norigin: [0, 0, 0]\n{thresholds}")
    _patrol().write(folder / "tasks" / "patrol.owl")
    _hall(robots).write(site / f"{SITE}.owl")


def _patrol() -> OntologyFile:
    file = OntologyFile("patrol", ("core",))
    file.capability("RobotOnWheels", "core:hasActuator", "core:OmnidirectionalBase")
    limits = (has("core:maxVelLin_mps", 1.0), has("core:radius_m", 0.3))
    file.subclass("PatrolRobot", "core:Robot", file.some("core:hasActuator", "core:OmnidirectionalBase"), *limits)
    file.property("startsAt", "ObjectProperty")

    over = ("core:hasOutput", file.to(f"{DRIVE}_over"))
    file.action(DRIVE, LONGEST_LEG_S, "RobotOnWheels", over, robot="core:Robot")
    file.parameters(DRIVE, "Output", over="core:TruthValue")
    file.individual(
        f"{DRIVE}_service_over",
        "core:Field",
        ("core:fieldName", "over"),
        ("core:messageType", "bool"),
        ("core:mapsParameter", file.to(f"{DRIVE}_over")),
    )
    file.individual(f"{DRIVE}_service", "core:RobotGrounding", ("core:hasReplyField", file.to(f"{DRIVE}_service_over")))

    inputs = file.parameters("Patrol", "Input", robot="core:Robot", start="core:Location")
    own = file.parameters("Patrol", "Local", over="core:TruthValue")
    file.individual(
        "Patrol",
        "core:CompositeProcess",
        *inputs,
        *own,
        ("core:keepsRobot", True),
        ("core:composedOf", file.to("Patrol_legs")),
        ("core:hasDurationModel", file.to("Patrol_duration")),
        ("core:duration_s", PATROL_S),
    )
    file.individual(
        "Patrol_duration_map_file",
        "core:Field",
        ("core:fieldName", "map_file"),
        ("core:messageType", "string"),
        ("core:fileName", "hall.yaml"),
    )
    for name, prop in (("radius_m", "radius_m"), ("max_vel_lin_mps", "maxVelLin_mps")):
        file.individual(
            f"Patrol_duration_{name}",
            "core:Field",
            ("core:fieldName", name),
            ("core:messageType", "float64"),
            ("core:mapsParameter", file.to("Patrol_robot")),
            ("core:ofProperty", file.to(f"core:{prop}")),
        )
    file.individual(
        "Patrol_duration",
        "core:TravelDuration",
        ("core:serviceName", "/compute/travel"),
        ("core:travelGoal", file.to("Patrol_start")),
        ("core:travelingRobot", file.to("Patrol_robot")),
        *(
            ("core:hasRequestField", file.to(f"Patrol_duration_{name}"))
            for name in ("map_file", "radius_m", "max_vel_lin_mps")
        ),
    )
    until = ("core:hasCondition", file.to("Patrol_is_over"))
    file.individual("Patrol_legs", "core:RepeatUntil", ("core:bodyStep", file.to("Patrol_leg")), until)
    file.individual("Patrol_is_over", "core:IsTrue", ("core:ofTruthValue", file.to("Patrol_over")))
    file.perform("Patrol_leg", DRIVE)

    own = file.parameters(TASK, "Local", robot="core:Robot", start="core:Location")
    file.individual(TASK, "core:CompositeProcess", *own, ("core:composedOf", file.to(f"{TASK}_each")))
    file.holds(f"{TASK}_starts", "startsAt", f"{TASK}_robot", file.to(f"{TASK}_start"))
    file.individual(
        f"{TASK}_each",
        "core:ForEach",
        ("core:overParameter", file.to(f"{TASK}_robot")),
        ("core:overParameter", file.to(f"{TASK}_start")),
        ("core:hasCondition", file.to(f"{TASK}_starts")),
        ("core:bodyStep", file.to(f"{TASK}_patrol")),
    )
    file.perform(f"{TASK}_patrol", "Patrol")
    return file


def _hall(robots: int) -> OntologyFile:
    file = OntologyFile(SITE, ("core", "patrol"))
    file.individual(SITE, "core:Site")
    middle = _CELLS * _CELL_M / 2
    pose = ("core:poseX_m", middle), ("core:poseY_m", middle), ("core:poseYaw_rad", 0.0)
    file.individual("dock", "core:Location", ("core:inArea", file.to(SITE)), *pose)
    stands = ("core:locatedAt", file.to("dock")), ("patrol:startsAt", file.to("dock"))
    for number in range(robots):
        file.individual(robot_name(number), "patrol:PatrolRobot", *stands)
    return file
