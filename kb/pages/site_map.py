"""The places of a site as a picture: where they are, on the map that services use if there is one."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import yaml
from PIL import Image

from kb.groundings import Field
from kb.store import Snapshot
from kb.vocabulary import Kind, Property

_WIDTH = 720.0
_MARGIN_M = 1.0
_RADIUS = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Spot:
    """A location on the map.

    Attributes:
        number: By which the picture names it, from 1.
        there: What is there now.
    """

    number: int
    name: str
    area: tuple[str, ...]
    x_m: float
    y_m: float
    yaw_rad: float
    there: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Picture:
    """A map as a picture.

    Attributes:
        png: Its contents.
        x_m: Where its left edge is; `y_m` its lower edge.
    """

    png: bytes
    x_m: float
    y_m: float
    width_m: float
    height_m: float


def spots(snapshot: Snapshot) -> tuple[Spot, ...]:
    """All locations that have a pose, by name."""
    ontology = snapshot.ontology
    located: dict[str, list[str]] = {}
    for (prop, subject), value in sorted(snapshot.fluents.items(), key=lambda f: f[0]):
        if prop == Property.LOCATED_AT:
            located.setdefault(str(value), []).append(subject)
    found: list[Spot] = []
    for name in ontology.individuals(Kind.LOCATION):
        x_m, y_m = ontology.value(Property.POSE_X_M, name), ontology.value(Property.POSE_Y_M, name)
        yaw_rad = ontology.value(Property.POSE_YAW_RAD, name)
        if isinstance(x_m, int | float) and isinstance(y_m, int | float):
            found.append(
                Spot(
                    number=len(found) + 1,
                    name=name,
                    area=tuple(map(str, ontology.values(Property.IN_AREA, name))),
                    x_m=float(x_m),
                    y_m=float(y_m),
                    yaw_rad=float(yaw_rad) if isinstance(yaw_rad, int | float) else 0.0,
                    there=tuple(located.get(name, ())),
                )
            )
    return tuple(found)


def site_map(snapshot: Snapshot) -> str:
    """An SVG picture of the locations by number, x to the right and y up, as in the map; empty without locations."""
    shown = spots(snapshot)
    if not shown:
        return ""
    picture = _picture(snapshot)
    left, right = min(s.x_m for s in shown) - _MARGIN_M, max(s.x_m for s in shown) + _MARGIN_M
    low, high = min(s.y_m for s in shown) - _MARGIN_M, max(s.y_m for s in shown) + _MARGIN_M
    if picture is not None:
        left, right = min(left, picture.x_m), max(right, picture.x_m + picture.width_m)
        low, high = min(low, picture.y_m), max(high, picture.y_m + picture.height_m)
    scale = _WIDTH / (right - left)
    height = (high - low) * scale
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" class="map" role="img" viewBox="0 0 {_WIDTH:.0f} {height:.1f}" '
        f'aria-label="Map of the locations">',
        "<title>Map of the locations</title>",
        "<desc>Each location has a number, which the table below explains, and a line to where a robot faces.</desc>",
        f'<rect class="floor" x="0" y="0" width="{_WIDTH:.0f}" height="{height:.1f}"/>',
    ]
    if picture is not None:
        data = base64.b64encode(picture.png).decode()
        x, y = (picture.x_m - left) * scale, (high - picture.y_m - picture.height_m) * scale
        size = f'width="{picture.width_m * scale:.1f}" height="{picture.height_m * scale:.1f}"'
        lines.append(f'<image x="{x:.1f}" y="{y:.1f}" {size} href="data:image/png;base64,{data}"/>')
    for spot in shown:
        x, y = (spot.x_m - left) * scale, (high - spot.y_m) * scale
        to_x, to_y = x + 2 * _RADIUS * math.cos(spot.yaw_rad), y - 2 * _RADIUS * math.sin(spot.yaw_rad)
        style = "spot taken" if spot.there else "spot"
        lines += [
            f'<line class="facing" x1="{x:.1f}" y1="{y:.1f}" x2="{to_x:.1f}" y2="{to_y:.1f}"/>',
            f'<circle class="{style}" cx="{x:.1f}" cy="{y:.1f}" r="{_RADIUS:g}"/>',
            f'<text x="{x:.1f}" y="{y + 4:.1f}" font-size="11">{spot.number}</text>',
        ]
    return "\n".join([*lines, "</svg>"])


def _picture(snapshot: Snapshot) -> _Picture | None:
    """The first map, by file name, that a service is given: a map_server YAML file and its image."""
    requests: list[tuple[Field, ...]] = [g.request for g in snapshot.groundings.values()]
    requests += [e.request for e in snapshot.travel_estimates]
    for path in sorted(_yaml_files(requests)):
        told = yaml.safe_load(path.read_text(encoding="utf-8"))
        if isinstance(told, dict) and {"image", "resolution", "origin"} <= set(told):
            with Image.open(path.parent / str(told["image"])) as image:
                gray = image.convert("L")
            out = io.BytesIO()
            gray.save(out, format="PNG", optimize=True)
            resolution_m, (x_m, y_m, *_) = float(told["resolution"]), told["origin"]
            return _Picture(
                png=out.getvalue(),
                x_m=float(x_m),
                y_m=float(y_m),
                width_m=gray.width * resolution_m,
                height_m=gray.height * resolution_m,
            )
    return None


def _yaml_files(requests: Iterable[tuple[Field, ...]]) -> set[Path]:
    files = {f.file for request in requests for f in request if f.file is not None}
    return {f for f in files if f.suffix in (".yaml", ".yml") and f.exists()}
