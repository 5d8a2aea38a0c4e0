"""What stands where at the start: a scenario file becomes frozen values.

The names of places (`start`, `believed_at`) belong to the knowledge base; the simulator carries them and does not
resolve them. Where they are left out, the knowledge base itself says where things are. Where an object truly is, is
`position`; the robots have to find that out.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from kb.section import Section, read_file
from sim.errors import BadScenario
from sim.robot import RobotModel, robot_models
from sim.world import ObjectModel, Point3, World, load_world, object_models


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotSetup:
    """A robot, where it is told to stand, if elsewhere than known, and how well it is placed there (1 sigma)."""

    name: str
    model: RobotModel
    start: str | None
    placement_error_m: float
    placement_error_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectSetup:
    """An object, where its bottom center truly is (map, m), and where it is believed to be, if other than known."""

    name: str
    model: ObjectModel
    position: Point3
    believed_at: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class DoorChange:
    """Somebody opens or closes a door at a time of the clock."""

    at_s: float
    door: str
    to_open: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectChange:
    """Somebody puts an object elsewhere at a time of the clock: its bottom center (map, m). Robots are not told."""

    at_s: float
    thing: str
    position: Point3


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """A world, what is in it, what happens to it, and the seed of all chance; each in the order of the file."""

    name: str
    file: str
    site: str
    world: World
    seed: int
    robots: tuple[RobotSetup, ...]
    objects: tuple[ObjectSetup, ...]
    changes: tuple[DoorChange | ObjectChange, ...] = ()


def builtin_scenarios() -> tuple[str, ...]:
    """Names of the scenarios that come with the simulator."""
    names = (file.name for file in (files("sim") / "scenarios").iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml")))


def load_scenario(source: str | Path) -> Scenario:
    """Read a scenario.

    Args:
        source: The name of a scenario that comes with the simulator, or the path of a file. A world named
            `something.toml` in a file is looked for beside that file.

    Raises:
        BadScenario: the file, or the world that it names, is missing or wrong.
    """
    file = source if isinstance(source, Path) else files("sim") / "scenarios" / f"{source}.toml"
    top = read_file(file, BadScenario)
    head = top.section("scenario")
    site = head.name("site")
    world_name = head.text("world")
    if isinstance(source, Path) and world_name.endswith(".toml"):
        world = load_world(source.parent / world_name)
    else:
        world = load_world(world_name)
    seed = head.integer("seed")
    head.end()
    robots = tuple(_robot(name, section) for name, section in top.sections("robots"))
    objects = tuple(_object(name, section, world) for name, section in top.sections("objects"))
    names = [thing.name for thing in objects]
    changes = tuple(_change(section, world, names) for _, section in top.sections_if_given("changes"))
    top.end()
    if not robots:
        raise top.fault("robots", "is empty; a scenario has at least one robot")
    for name in {robot.name for robot in robots} & {thing.name for thing in objects}:
        raise top.fault(f"objects.{name}", "is the name of a robot too; every name is given once")
    return Scenario(
        name=Path(file.name).stem,
        file=str(file),
        site=site,
        world=world,
        seed=seed,
        robots=robots,
        objects=objects,
        changes=changes,
    )


def _robot(name: str, section: Section) -> RobotSetup:
    robot = RobotSetup(
        name=name,
        model=robot_models()[section.text("model", choices=robot_models())],
        start=section.name_if_given("start"),
        placement_error_m=section.number("placement_error_m", low=0.0, high=1.0),
        placement_error_rad=section.number("placement_error_rad", low=0.0, high=1.0),
    )
    section.end()
    return robot


def _change(section: Section, world: World, objects: list[str]) -> DoorChange | ObjectChange:
    at_s = section.number("at_s", low=0.0)
    change: DoorChange | ObjectChange
    if section.has("door"):
        door = section.text("door", choices=[door.name for door in world.doors])
        change = DoorChange(at_s=at_s, door=door, to_open=section.truth("open"))
    else:
        thing = section.text("object", choices=objects)
        change = ObjectChange(at_s=at_s, thing=thing, position=_position(section, world))
    section.end()
    return change


def _position(section: Section, world: World) -> Point3:
    x, y, z = section.numbers("position", 3)
    if not world.bears((x, y, z)):
        raise section.fault(
            "position",
            f"nothing bears an object at ({x:g}, {y:g}, {z:g}) in world {world.name}; "
            f"z has to be the top of the furniture there, or 0 on free floor inside the lab",
        )
    return x, y, z


def _object(name: str, section: Section, world: World) -> ObjectSetup:
    position = _position(section, world)
    thing = ObjectSetup(
        name=name,
        model=object_models()[section.text("model", choices=object_models())],
        position=position,
        believed_at=section.name_if_given("believed_at"),
    )
    section.end()
    return thing
