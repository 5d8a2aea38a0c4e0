"""Fleets as ontologies: what the product loads, classifies, compiles and plans in the benchmark of the planner.

A folder is a copy of the shipped ontologies with a site `fleet` more. The drinks are found by the shipped process
Navigate, which has its travel time and nothing on top here, so that all planners of the benchmark solve the same,
and an action that detects them in 1 s. There are two recipes, with a Kinect, and with a color camera for what can be
told by its color.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias
from xml.sax.saxutils import escape

from kb.files import SHIPPED
from tests.benchmarks.fleets import Instance, drink_name, place_names, robot_name

SITE = "fleet"
FIND_TASK, FETCH_TASK = "FindEmptyDrinks", "FetchEmptyDrinks"
ROOM = "hall"

_NAMESPACE = "http://example.org/concertmaster/"
_XSD = "http://www.w3.org/2001/XMLSchema#"
_FILE = """<?xml version="1.0"?>
<rdf:RDF xml:base="{namespace}{name}.owl"
     xmlns:core="{namespace}core.owl#" xmlns:fetch="{namespace}fetch_drinks.owl#"
     xmlns:patrol="{namespace}patrol.owl#"
     xmlns:owl="http://www.w3.org/2002/07/owl#"
     xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"
     xmlns:rdfs="http://www.w3.org/2000/01/rdf-schema#">
    <owl:Ontology rdf:about="{namespace}{name}.owl">
{imports}
    </owl:Ontology>
{entities}
</rdf:RDF>
"""


@dataclass(frozen=True)
class To:
    """An entity, written `file:name`."""

    name: str

    @property
    def iri(self) -> str:
        file, _, name = self.name.partition(":")
        return f"{_NAMESPACE}{file}.owl#{name}"


Value: TypeAlias = "To | str | bool | int | float"
_DRIVING = {"robot": "core:Robot", "area": "core:Area", "location": "core:Location"}
_KEEPS_ROBOT: tuple[str, Value] = ("core:keepsRobot", True)


@dataclass
class OntologyFile:
    """An ontology file in the making."""

    name: str
    imports: tuple[str, ...]
    entities: list[str] = field(default_factory=list)

    def to(self, name: str) -> To:
        """An entity of this file, or one written `file:name`."""
        return To(name if ":" in name else f"{self.name}:{name}")

    def individual(self, name: str, kinds: str, *values: tuple[str, Value]) -> None:
        """A named individual of classes, with its values."""
        lines = [f'        <rdf:type rdf:resource="{self.to(kind).iri}"/>' for kind in kinds.split()]
        lines += [_written(prop, value) for prop, value in values]
        self._entity("owl:NamedIndividual", name, lines)

    def subclass(self, name: str, above: str, *axioms: str) -> None:
        """A class below another, with what all its members have."""
        lines = [f'        <rdfs:subClassOf rdf:resource="{self.to(above).iri}"/>']
        lines += [f"        <rdfs:subClassOf>{axiom}</rdfs:subClassOf>" for axiom in axioms]
        self._entity("owl:Class", name, lines)

    def capability(self, name: str, prop: str, device: str) -> None:
        """The class of all robots that have a device."""
        both = f'<rdf:Description rdf:about="{To("core:Robot").iri}"/>{self.some(prop, device)}'
        defined = f'<owl:Class><owl:intersectionOf rdf:parseType="Collection">{both}</owl:intersectionOf></owl:Class>'
        self._entity("owl:Class", name, [f"        <owl:equivalentClass>{defined}</owl:equivalentClass>"])

    def some(self, prop: str, kind: str) -> str:
        """The restriction `prop some kind`."""
        return _restriction(prop, f'<owl:someValuesFrom rdf:resource="{self.to(kind).iri}"/>')

    def property(self, name: str, sort: str) -> None:
        """An object or datatype property that has one value."""
        functional = '        <rdf:type rdf:resource="http://www.w3.org/2002/07/owl#FunctionalProperty"/>'
        self._entity(f"owl:{sort}", name, [functional])

    def parameters(self, process: str, kind: str, **types: str) -> list[tuple[str, Value]]:
        """Inputs or locals of a process, numbered as they stand; returns what the process says of them."""
        first = sum(f"#{process}_" in e and "core:parameterName" in e for e in self.entities) + 1
        for number, (name, of) in enumerate(types.items(), start=first):
            is_robot = kind == "Input" and of == "core:Robot"
            self.individual(
                f"{process}_{name}",
                "core:RobotParameter" if is_robot else f"core:{kind}",
                ("core:parameterName", name),
                ("core:parameterNumber", 10 * number),
                ("core:parameterType", self.to(of)),
            )
        return [(f"core:has{kind}", self.to(f"{process}_{name}")) for name in types]

    def action(
        self,
        name: str,
        duration_s: float,
        capability: str,
        *more: tuple[str, Value],
        **types: str,
    ) -> None:
        """An atomic process, done by a robot, whose service may take four times as long."""
        values = self.parameters(name, "Input", **types)
        values += [("core:duration_s", duration_s), ("core:requiresCapability", self.to(capability))]
        self.individual(name, "core:AtomicProcess", *values, *more)
        self.individual(
            f"{name}_service",
            "core:RobotGrounding",
            ("core:grounds", self.to(name)),
            ("core:serviceName", f"/{{robot}}/{name.lower()}"),
            ("core:timeout_s", 4.0 * duration_s),
        )

    def construct(self, name: str, kind: str, *steps: str) -> None:
        """A control construct with its steps, in order."""
        self.individual(name, f"core:{kind}", *(("core:hasStep", self.to(step)) for step in steps))

    def perform(
        self, name: str, process: str, *, number: int | None = None, bindings: Mapping[str, str] | None = None
    ) -> None:
        """A step that performs a process; `bindings` are parameters of the process -> parameters, by entity."""
        values: list[tuple[str, Value]] = [("core:performs", self.to(process))]
        if number is not None:
            values.append(("core:stepNumber", number))
        for position, (to, source) in enumerate((bindings or {}).items()):
            binding = f"{name}_binding_{position}"
            self.individual(
                binding, "core:Binding", ("core:toParameter", self.to(to)), ("core:fromParameter", self.to(source))
            )
            values.append(("core:hasBinding", self.to(binding)))
        self.individual(name, "core:Perform", *values)

    def pick(self, name: str, over: str, body: str, *more: tuple[str, Value]) -> None:
        """A robot is picked for a step."""
        self.individual(
            name, "core:Pick", ("core:overParameter", self.to(over)), ("core:bodyStep", self.to(body)), *more
        )

    def holds(self, name: str, prop: str, subject: str, value: Value) -> None:
        """A condition: a property of a parameter has the value, or that of another parameter."""
        of = "core:objectParameter" if isinstance(value, To) else "core:hasValue"
        self.individual(
            name,
            "core:Holds",
            ("core:ofProperty", self.to(prop)),
            ("core:subjectParameter", self.to(subject)),
            (of, value),
        )

    def write(self, path: Path) -> None:
        """Save the file."""
        imports = "\n".join(f'        <owl:imports rdf:resource="{_NAMESPACE}{i}.owl"/>' for i in self.imports)
        entities = "\n".join(self.entities)
        text = _FILE.format(namespace=_NAMESPACE, name=self.name, imports=imports, entities=entities)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def _entity(self, sort: str, name: str, lines: list[str]) -> None:
        body = "\n".join(lines)
        self.entities.append(f'    <{sort} rdf:about="{self.to(name).iri}">\n{body}\n    </{sort}>')


def task(instance: Instance) -> str:
    """The process to be planned; its input `room` is ROOM."""
    return FETCH_TASK if instance.coupled else FIND_TASK


def write_ontologies(instance: Instance, folder: Path) -> None:
    """Write the ontologies of a fleet into a folder that does not exist yet."""
    shutil.copytree(SHIPPED, folder)
    navigation = folder / "tasks" / "navigation.owl"
    text = navigation.read_text(encoding="utf-8")
    on_top = f'<core:duration_s rdf:datatype="{_XSD}double">1.5</core:duration_s>'
    if text.count(on_top) != 1:
        raise ValueError("navigation.owl has changed: nothing, or more, takes 1.5 s")
    navigation.write_text(text.replace(on_top, on_top.replace("1.5", "0.0")), encoding="utf-8")
    site = folder / "sites" / SITE
    shutil.copytree(folder / "sites" / "tue_lab", site, ignore=shutil.ignore_patterns("*.owl", "catalog*"))
    _robots().write(folder / "robots" / "fleet_robots.owl")
    _finding().write(folder / "tasks" / "find_drinks.owl")
    if instance.coupled:
        _fetching().write(folder / "tasks" / "fetch_drinks.owl")
    _site(instance).write(site / f"{SITE}.owl")


def _robots() -> OntologyFile:
    """Kinds of robots: slow or fast, with a Kinect or not, with an arm or not."""
    file = OntologyFile("fleet_robots", ("core",))
    file.subclass("ColorCamera", "core:Sensor")
    file.subclass("RobotArm", "core:Actuator")
    file.capability("RobotWithColorCamera", "core:hasSensor", "ColorCamera")
    file.capability("RobotWithArm", "core:hasActuator", "RobotArm")
    limits = {"radius_m": 0.3, "maxVelAng_radps": 1.2, "laserX_m": 0.18, "laserY_m": 0.0, "laserYaw_rad": 0.0}
    camera = {"cameraX_m": 0.12, "cameraZ_m": 1.05, "cameraPitch_rad": 0.4}
    file.subclass(
        "FleetRobot",
        "core:Robot",
        file.some("core:hasSensor", "core:LaserScanner"),
        file.some("core:hasSensor", "ColorCamera"),
        file.some("core:hasActuator", "core:OmnidirectionalBase"),
        *(has(f"core:{name}", value) for name, value in (limits | camera).items()),
    )
    file.subclass("SlowRobot", "FleetRobot", has("core:maxVelLin_mps", 1.0))
    file.subclass("FastRobot", "FleetRobot", has("core:maxVelLin_mps", 2.0))
    file.subclass("KinectRobot", "FleetRobot", file.some("core:hasSensor", "core:Kinect"))
    file.subclass("ArmRobot", "FleetRobot", file.some("core:hasActuator", "RobotArm"))
    return file


def _finding() -> OntologyFile:
    """The task FindEmptyDrinks: every empty drink of a room is found by some robot."""
    file = OntologyFile("find_drinks", ("core", "navigation", "objects", "groundings", "fleet_robots"))
    file.property("toldByColor", "DatatypeProperty")
    looking = {"robot": "core:Robot", "drink": "objects:Drink"}
    file.action("DetectByKinect", 1.0, "core:RobotWithKinect", **looking)
    file.action("DetectByColor", 1.0, "fleet_robots:RobotWithColorCamera", **looking)
    file.holds("FindByColor_told", "toldByColor", "FindByColor_drink", True)
    for way, more in (("ByKinect", []), ("ByColor", [("core:hasPrecondition", file.to("FindByColor_told"))])):
        recipe = f"Find{way}"
        inputs = file.parameters(recipe, "Input", **_DRIVING, drink="objects:Drink")
        body = ("core:composedOf", file.to(f"{recipe}_body"))
        file.individual(recipe, "core:CompositeProcess", *inputs, _KEEPS_ROBOT, body, *more)
        file.construct(f"{recipe}_body", "Sequence", f"{recipe}_drive", f"{recipe}_detect")
        file.perform(f"{recipe}_drive", "navigation:Navigate", number=10)
        file.perform(f"{recipe}_detect", f"Detect{way}", number=20)
    inputs = file.parameters("FindDrink", "Input", **_DRIVING, drink="objects:Drink")
    file.individual("FindDrink", "core:CompositeProcess", *inputs, ("core:composedOf", file.to("FindDrink_recipe")))
    file.construct("FindDrink_recipe", "Choice", "FindDrink_by_kinect", "FindDrink_by_color")
    file.perform("FindDrink_by_kinect", "FindByKinect")
    file.perform("FindDrink_by_color", "FindByColor")

    _for_each_drink(file, FIND_TASK, f"{FIND_TASK}_pick", robot="core:Robot")
    file.pick(f"{FIND_TASK}_pick", f"{FIND_TASK}_robot", f"{FIND_TASK}_find")
    file.perform(f"{FIND_TASK}_find", "FindDrink", bindings={"FindDrink_area": f"{FIND_TASK}_room"})
    return file


def _fetching() -> OntologyFile:
    """The task FetchEmptyDrinks: every empty drink is found by some robot, and then fetched by one with an arm."""
    file = OntologyFile("fetch_drinks", ("core", "navigation", "objects", "find_drinks", "fleet_robots"))
    file.subclass("Doorway", "core:PhysicalObject")
    for name in ("hasInside", "hasOutside", "hasTableSide", "hasDoorway"):
        file.property(name, "ObjectProperty")
    arm = "fleet_robots:RobotWithArm"
    file.action("Grasp", 2.0, arm, robot="core:Robot", drink="objects:Drink")
    file.action("PutDown", 2.0, arm, robot="core:Robot", drink="objects:Drink")
    located = ("core:hasEffect", file.to("PassDoor_effect"))
    claims = ("core:claimsParameter", file.to("PassDoor_door"))
    through = {"robot": "core:Robot", "door": "Doorway", "side": "core:Location"}
    file.action("PassDoor", 2.0, "core:RobotWithBase", located, claims, **through)
    file.individual(
        "PassDoor_effect",
        "core:Effect",
        ("core:ofProperty", file.to("core:locatedAt")),
        ("core:subjectParameter", file.to("PassDoor_robot")),
        ("core:objectParameter", file.to("PassDoor_side")),
    )

    places = {"door": "Doorway", "inside": "core:Location", "outside": "core:Location", "table": "core:Location"}
    inputs = file.parameters("FetchDrink", "Input", **_DRIVING, drink="objects:Drink", **places)
    body = ("core:composedOf", file.to("FetchDrink_body"))
    file.individual("FetchDrink", "core:CompositeProcess", *inputs, _KEEPS_ROBOT, body)
    steps: tuple[tuple[str, str, dict[str, str]], ...] = (
        ("to_drink", "navigation:Navigate", {}),
        ("grasp", "Grasp", {}),
        ("to_door", "navigation:Navigate", {"navigation:Navigate_location": "FetchDrink_inside"}),
        ("leave", "PassDoor", {"PassDoor_side": "FetchDrink_outside"}),
        ("to_table", "navigation:Navigate", {"navigation:Navigate_location": "FetchDrink_table"}),
        ("put", "PutDown", {}),
        ("back", "navigation:Navigate", {"navigation:Navigate_location": "FetchDrink_outside"}),
        ("return", "PassDoor", {"PassDoor_side": "FetchDrink_inside"}),
    )
    names = [f"FetchDrink_{10 * number}_{name}" for number, (name, _, _) in enumerate(steps, start=1)]
    file.construct("FetchDrink_body", "Sequence", *names)
    for number, (name, (_, process, bindings)) in enumerate(zip(names, steps, strict=True), start=1):
        file.perform(name, process, number=10 * number, bindings=bindings)

    task = FETCH_TASK
    _for_each_drink(file, task, f"{task}_both", **places, finder="core:Robot", fetcher="core:Robot")
    file.construct(f"{task}_both", "Sequence", f"{task}_find", f"{task}_fetch")
    area = f"{task}_room"
    found = {"find_drinks:FindDrink_robot": f"{task}_finder", "find_drinks:FindDrink_area": area}
    file.pick(f"{task}_find", f"{task}_finder", f"{task}_finds", ("core:stepNumber", 10))
    file.perform(f"{task}_finds", "find_drinks:FindDrink", bindings=found)
    fetched = {"FetchDrink_robot": f"{task}_fetcher", "FetchDrink_area": area}
    file.pick(f"{task}_fetch", f"{task}_fetcher", f"{task}_fetches", ("core:stepNumber", 20))
    file.perform(f"{task}_fetches", "FetchDrink", bindings=fetched)
    return file


def _for_each_drink(file: OntologyFile, task: str, body: str, **more: str) -> None:
    """A task that does a step for every empty drink of a room, side by side; `more` are its further locals."""
    inputs = file.parameters(task, "Input", room="core:Area")
    own = file.parameters(task, "Local", drink="objects:Drink", location="core:SearchLocation", **more)
    each = f"{task}_each"
    file.individual(task, "core:CompositeProcess", *inputs, *own, ("core:composedOf", file.to(each)))
    over = [f"{task}_drink", f"{task}_location"]
    conditions = [f"{task}_is_empty", f"{task}_drink_at", f"{task}_in_room"]
    file.holds(f"{task}_is_empty", "core:isEmpty", f"{task}_drink", True)
    file.holds(f"{task}_drink_at", "core:locatedAt", f"{task}_drink", file.to(f"{task}_location"))
    file.holds(f"{task}_in_room", "core:inArea", f"{task}_location", file.to(f"{task}_room"))
    if "door" in more:
        over += [f"{task}_{name}" for name in ("door", "inside", "outside", "table")]
        conditions += [f"{task}_of_room", f"{task}_has_inside", f"{task}_has_outside", f"{task}_has_table"]
        file.holds(f"{task}_of_room", "hasDoorway", f"{task}_room", file.to(f"{task}_door"))
        file.holds(f"{task}_has_inside", "hasInside", f"{task}_door", file.to(f"{task}_inside"))
        file.holds(f"{task}_has_outside", "hasOutside", f"{task}_door", file.to(f"{task}_outside"))
        file.holds(f"{task}_has_table", "hasTableSide", f"{task}_door", file.to(f"{task}_table"))
    file.individual(f"{task}_condition", "core:AllOf", *(("core:operand", file.to(c)) for c in conditions))
    turned = [("core:overParameter", file.to(parameter)) for parameter in over]
    asked = ("core:hasCondition", file.to(f"{task}_condition"))
    file.individual(each, "core:ForEach", *turned, asked, ("core:bodyStep", file.to(body)))


def _site(instance: Instance) -> OntologyFile:
    """The hall with its robots and drinks."""
    file = OntologyFile(
        SITE, ("core", "objects", "fleet_robots", "find_drinks", *(["fetch_drinks"] * instance.coupled))
    )
    told = f'<owl:Restriction><owl:onProperty rdf:resource="{To("find_drinks:toldByColor").iri}"/>'
    told += f'<owl:hasValue rdf:datatype="{_XSD}boolean">true</owl:hasValue></owl:Restriction>'
    about = f'    <rdf:Description rdf:about="{To("objects:SoftDrink").iri}">'
    file.entities.append(f"{about}<rdfs:subClassOf>{told}</rdfs:subClassOf></rdf:Description>")
    file.individual(SITE, "core:Site")
    doorway = [("fetch:hasDoorway", file.to("hall_door"))] if instance.coupled else []
    file.individual(ROOM, "core:Room", ("core:inArea", file.to(SITE)), *doorway)
    names = place_names(instance)
    for number, name in enumerate(names):
        if number >= instance.inside and not instance.coupled:
            continue
        x_dm, y_dm = instance.xy_dm[number]
        kind = "core:SearchLocation" if instance.robots <= number < instance.inside else "core:Location"
        pose: list[tuple[str, Value]] = [("core:poseX_m", x_dm / 10), ("core:poseY_m", y_dm / 10)]
        pose.append(("core:poseYaw_rad", 0.0))
        file.individual(name, kind, ("core:inArea", file.to(ROOM if number <= instance.inside else SITE)), *pose)
    if instance.coupled:
        sides = zip(("Inside", "Outside", "TableSide"), names[-3:], strict=True)
        file.individual(
            "hall_door", "fetch_drinks:Doorway", *((f"fetch:has{side}", file.to(name)) for side, name in sides)
        )
    for robot in range(instance.robots):
        kinds = ["SlowRobot" if instance.speed_mps[robot] == 1 else "FastRobot"]
        kinds += ["KinectRobot"] * instance.has_kinect[robot] + ["ArmRobot"] * instance.has_arm[robot]
        dock = ("core:locatedAt", file.to(names[robot]))
        file.individual(robot_name(robot), " ".join(f"fleet_robots:{kind}" for kind in kinds), dock)
    for drink in range(instance.drinks):
        kind = "objects:Beer" if instance.needs_kinect[drink] else "objects:SoftDrink"
        spot = ("core:locatedAt", file.to(names[instance.spot(drink)]))
        file.individual(drink_name(drink), kind, spot, ("core:isEmpty", True))
    return file


def has(prop: str, value: float) -> str:
    """The restriction `prop value v`."""
    return _restriction(prop, f'<owl:hasValue rdf:datatype="{_XSD}double">{value}</owl:hasValue>')


def _restriction(prop: str, what: str) -> str:
    on = f'<owl:onProperty rdf:resource="{To(prop).iri}"/>'
    return f"<owl:Restriction>{on}{what}</owl:Restriction>"


def _written(prop: str, value: Value) -> str:
    match value:
        case To():
            return f'        <{prop} rdf:resource="{value.iri}"/>'
        case bool():
            return f'        <{prop} rdf:datatype="{_XSD}boolean">{str(value).lower()}</{prop}>'
        case int():
            return f'        <{prop} rdf:datatype="{_XSD}integer">{value}</{prop}>'
        case float():
            return f'        <{prop} rdf:datatype="{_XSD}double">{value}</{prop}>'
        case str():
            return f"        <{prop}>{escape(value)}</{prop}>"
