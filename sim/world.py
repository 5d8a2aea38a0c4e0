"""The rooms: a world file becomes boxes that stand still, and object models.

Frame `map`: origin at the lower left inner corner of the lab, x right, y up, z = 0 on the floor; meters.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from kb.section import Section, read_file
from sim.errors import BadScenario

Point3 = tuple[float, float, float]
Color = tuple[float, float, float]  # red, green, blue, each 0 to 1

_DOOR_COLOR: Color = (0.55, 0.35, 0.20)
_STANDS_WITHIN_M = 0.005  # an object stands on a surface if its bottom is this close to it


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """A solid box with sides along the axes of the map: from corner `low` to corner `high`."""

    low: Point3
    high: Point3
    color: Color

    def covers(self, x_m: float, y_m: float) -> bool:
        """Whether the box is above, at or below this point of the floor."""
        return self.low[0] <= x_m <= self.high[0] and self.low[1] <= y_m <= self.high[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class DoorSetup:
    """A sliding door.

    Attributes:
        leaf: Where the leaf is when the door is closed.
        slides_m: How far the leaf goes to open, x and y (map).
        travel_s: How long that takes.
        is_open: Whether it is open at the start.
    """

    name: str
    leaf: Box
    slides_m: tuple[float, float]
    travel_s: float
    is_open: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """A lab of `size_m` (x, y) inside its outer walls, all of it as boxes but for the doors."""

    name: str
    size_m: tuple[float, float]
    floor_color: Color
    boxes: tuple[Box, ...]
    doors: tuple[DoorSetup, ...] = ()

    def top_m(self, x_m: float, y_m: float) -> float:
        """Height of the furniture at a point of the floor; 0 where there is none."""
        return max((box.high[2] for box in self.boxes if box.covers(x_m, y_m)), default=0.0)

    def bears(self, position: Point3) -> bool:
        """Whether an object can stand at `position` (its bottom center): on the floor or on top of a box."""
        x, y, z = position
        tops = [0.0] + [box.high[2] for box in self.boxes if box.covers(x, y)]
        buried = any(box.covers(x, y) and box.low[2] < z + _STANDS_WITHIN_M < box.high[2] for box in self.boxes)
        inside = 0.0 <= x <= self.size_m[0] and 0.0 <= y <= self.size_m[1]
        return inside and not buried and any(abs(z - top) <= _STANDS_WITHIN_M for top in tops)


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectModel:
    """A kind of object: an upright cylinder of one color."""

    name: str
    radius_m: float
    height_m: float
    color: Color


def load_world(source: str | Path) -> World:
    """Read a world.

    Args:
        source: The name of a world that comes with the simulator, or the path of a file.

    Raises:
        BadScenario: the file is missing or wrong.
    """
    file = source if isinstance(source, Path) else files("sim") / "worlds" / f"{source}.toml"
    top = read_file(file, BadScenario)
    lab = top.section("world")
    name = lab.name("name")
    width, depth = lab.numbers("size_m", 2, low=1.0, high=100.0)
    thick = lab.number("wall_thickness_m", low=0.01, high=1.0)
    high = lab.number("wall_height_m", low=0.1, high=10.0)
    wall_color = _color(lab, "wall_color")
    floor_color = _color(lab, "floor_color")
    lab.end()

    # The outer walls stand outside of the rectangle; the two along x also fill the corners.
    spans = [
        ((-thick, width + thick), (-thick, 0.0)),
        ((-thick, width + thick), (depth, depth + thick)),
        ((-thick, 0.0), (0.0, depth)),
        ((width, width + thick), (0.0, depth)),
    ]
    for _, wall in top.sections("inner_walls"):
        spans.append((_span(wall, "x_m"), _span(wall, "y_m")))
        wall.end()
    boxes = [Box(low=(x[0], y[0], 0.0), high=(x[1], y[1], high), color=wall_color) for x, y in spans]
    for _, piece in top.sections("furniture"):
        boxes.extend(_furniture(piece))
    doors = tuple(_door(door_name, section, high) for door_name, section in top.sections_if_given("doors"))
    top.end()
    return World(name=name, size_m=(width, depth), floor_color=floor_color, boxes=tuple(boxes), doors=doors)


@functools.cache
def object_models() -> dict[str, ObjectModel]:
    """The kinds of objects that come with the simulator, by name."""
    models = {}
    for name, section in read_file(files("sim") / "models" / "objects.toml", BadScenario).named():
        models[name] = ObjectModel(
            name=name,
            radius_m=section.number("radius_m", low=0.005, high=1.0),
            height_m=section.number("height_m", low=0.005, high=2.0),
            color=_color(section, "color"),
        )
        section.end()
    return models


def _furniture(piece: Section) -> list[Box]:
    """Boxes of a piece of furniture: one if `solid`; a top on four legs in its corners if `table`."""
    shape = piece.text("shape", choices=("solid", "table"))
    x, y = piece.numbers("center_m", 2)
    width, depth = piece.numbers("size_m", 2, low=0.05, high=20.0)
    height = piece.number("height_m", low=0.05, high=3.0)
    color = _color(piece, "color")
    left, right, front, back = x - width / 2, x + width / 2, y - depth / 2, y + depth / 2
    if shape == "solid":
        piece.end()
        return [Box(low=(left, front, 0.0), high=(right, back, height), color=color)]
    top = piece.number("top_thickness_m", low=0.01, high=height)
    leg = piece.number("leg_m", low=0.01, high=min(width, depth) / 2)
    piece.end()
    under = height - top
    legs = [
        Box(low=(leg_x, leg_y, 0.0), high=(leg_x + leg, leg_y + leg, under), color=color)
        for leg_x in (left, right - leg)
        for leg_y in (front, back - leg)
    ]
    return [Box(low=(left, front, under), high=(right, back, height), color=color), *legs]


def _door(name: str, section: Section, height_m: float) -> DoorSetup:
    """A door: `x_m` and `y_m` of the closed leaf, which way it opens, how fast, and whether it is open."""
    x, y = _span(section, "x_m"), _span(section, "y_m")
    slide_x, slide_y = section.numbers("slides_m", 2, low=-20.0, high=20.0)
    if slide_x == slide_y == 0.0:
        raise section.fault("slides_m", "is [0, 0]; a leaf has to move aside to open")
    door = DoorSetup(
        name=name,
        leaf=Box(low=(x[0], y[0], 0.0), high=(x[1], y[1], height_m), color=_DOOR_COLOR),
        slides_m=(slide_x, slide_y),
        travel_s=section.number("travel_s", low=0.1, high=60.0),
        is_open=section.truth("open"),
    )
    section.end()
    return door


def _span(section: Section, key: str) -> tuple[float, float]:
    low, high = section.numbers(key, 2)
    if low >= high:
        raise section.fault(key, f"[{low:g}, {high:g}] is empty; the first has to be the lesser")
    return low, high


def _color(section: Section, key: str) -> Color:
    red, green, blue = section.numbers(key, 3, low=0.0, high=1.0)
    return red, green, blue
