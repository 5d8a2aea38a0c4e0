"""URDF -> a robot class of ours, to be reviewed: footprint, height, mass, what it has, links and joints with limits.

URDF (wiki.ros.org/urdf/XML) says how a robot is built, not what its parts are for: sensors follow from the
simulator's tags where there are any, else they are guessed from names, and the report says so.
"""

from __future__ import annotations

import contextlib
import io
import math
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from urdf_parser_py import urdf

from kb.imports.draft import Draft
from kb.imports.names import local
from kb.imports.report import Fate, Imported, Note, NotImportable, in_order
from kb.imports.robots import Device, Joint, Model, hinted, write_model
from kb.imports.urdf_shape import Shape, extent
from kb.imports.urdf_text import Text
from kb.vocabulary import CORE_IRI

_SENSORS = {
    "ray": "LaserScanner",
    "gpu_ray": "LaserScanner",
    "lidar": "LaserScanner",
    "gpu_lidar": "LaserScanner",
    "depth": "DepthCamera",
    "depth_camera": "DepthCamera",
    "rgbd_camera": "DepthCamera",
    "camera": "Camera",
    "multicamera": "Camera",
    "imu": "InertialSensor",
    "contact": "ContactSensor",
    "force_torque": "ForceTorqueSensor",
    "gps": "SatelliteReceiver",
    "sonar": "Sonar",
}
_PARTLY_READ = {
    "gazebo": "which sensors are in them became what the class has; there is no place for the rest in our model",
    "origin": "they count for footprint and height; there is no place for where links and joints sit in our model",
    "inertial": "masses are kept; there is no place for the rest in our model",
}
"""What the report says of elements of which something is carried over."""
_TURNS = {"revolute", "continuous"}
_SLIDES = {"prismatic"}
_NEEDS_LIMIT = {"revolute", "prismatic"}
_LARGEST_RAD = 100.0 * math.pi
_LARGEST_M = 1000.0
"""Limits beyond are no limits of a joint, but mistakes of unit or exponent."""


def import_urdf(path: Path, iri: str) -> Imported:
    """Read a robot model.

    Args:
        path: The file, with xacro already expanded.
        iri: Of the ontology to make.

    Raises:
        NotImportable: No URDF; or links and joints are no tree, or limits, masses or sizes are impossible.
    """
    text = Text(path)
    robot = _parsed(path, text)
    reader = _Reader(path, text, robot)
    draft = Draft(iri)
    write_model(draft, reader.model())
    return Imported(
        iri=iri,
        entities=tuple(draft.entities.values()),
        imports=(CORE_IRI,),
        comments=(f"Imported from the URDF file {path.name}; to be reviewed.",),
        label=local(iri).removesuffix(".owl"),
        notes=in_order(reader.notes),
    )


def _parsed(path: Path, text: Text) -> urdf.URDF:
    """Links and joints, by the parser of ROS; it is given nothing else, as it fails at what it does not know."""
    whole = Element("robot", name=text.root.get("name", path.stem))
    whole.extend(e for e in text.root if e.tag in ("link", "joint"))
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            return urdf.URDF.from_xml_string(ElementTree.tostring(whole))
    except Exception as error:
        culprit = next((n for k in ("joint", "link") for n in text.names(k) if f"'{n}'" in str(error)), "")
        line = text.line("joint", culprit) or text.line("link", culprit)
        raise NotImportable(path, line, f"is no URDF: {' '.join(str(error).split())}") from error


class _Reader:
    def __init__(self, path: Path, text: Text, robot: urdf.URDF) -> None:
        self.notes: list[Note] = []
        self._path, self._text, self._robot = path, text, robot
        self._joints = {j.name: j for j in robot.joints}
        self._root = self._checked_root()

    def model(self) -> Model:
        """The whole."""
        masses = {link.name: self._mass_kg(link) for link in self._robot.links}
        known = [m for m in masses.values() if m]
        figures = [*self._extent(), *((("mass_kg", round(sum(known), 6)),) if known else ())]
        self._tell_rest()
        return Model(
            name=self._robot.name or self._path.stem,
            devices=tuple(self._devices()),
            figures=tuple(figures),
            links=tuple((name, mass) for name, mass in sorted(masses.items())),
            joints=tuple(self._joint(j) for _, j in sorted(self._joints.items())),
        )

    def _note(self, sort: str, name: str, fate: Fate, message: str) -> None:
        line = self._text.line(sort, name)
        self.notes.append(Note(file=self._path.name, line=line, entity=name, fate=fate, message=message))

    def _wrong(self, sort: str, name: str, message: str) -> NotImportable:
        return NotImportable(self._path, self._text.line(sort, name), f"{sort} {name}: {message}")

    # The tree

    def _checked_root(self) -> str:
        """The one link that hangs on no joint."""
        links = {link.name for link in self._robot.links}
        if not links:
            raise NotImportable(self._path, 0, "has no link in it; is it a URDF?")
        above: dict[str, str] = {}
        for joint in self._robot.joints:
            for end, name in (("parent", joint.parent), ("child", joint.child)):
                if name not in links:
                    raise self._wrong("joint", joint.name, f"its {end} {name!r} is no link of this file")
            if joint.child in above:
                told = f"its child {joint.child} hangs on the joint {above[joint.child]} already; a URDF is a tree"
                raise self._wrong("joint", joint.name, told)
            above[joint.child] = joint.name
        roots = sorted(links - set(above))
        self._refuse_cycle(above)
        if len(roots) != 1:
            told = f"has {len(roots)} links that hang on no joint, {', '.join(roots)}; connect all but one by joints"
            raise NotImportable(self._path, self._text.line("link", roots[1]), told)
        return str(roots[0])

    def _refuse_cycle(self, above: dict[str, str]) -> None:
        for start in sorted(above):
            trail = [start]
            while trail[-1] in above:
                parent = self._joints[above[trail[-1]]].parent
                if parent in trail:
                    circle = " -> ".join([*reversed(trail[trail.index(parent) :]), parent])
                    raise self._wrong("joint", above[start], f"links go round in a circle: {circle}")
                trail.append(parent)

    # Figures

    def _mass_kg(self, link: urdf.Link) -> float | None:
        if link.inertial is None:
            return None
        mass = float(link.inertial.mass)
        if not math.isfinite(mass) or mass < 0:
            raise self._wrong("link", link.name, f"has the mass {mass}; it must be a number of kg from 0")
        return mass

    def _extent(self) -> list[tuple[str, float]]:
        """Radius of the footprint and height, as far as the geometry tells."""
        rigid, all_links = self._placed(rigid_only=True), self._placed(rigid_only=False)
        shapes = self._shapes(rigid, "collisions")
        if not shapes:
            shapes = self._shapes(rigid, "visuals")
            if shapes:
                told = "nothing fixed to it has a collision shape; the footprint was taken from what is to be seen"
                self._note("link", self._root, Fate.GUESSED, told)
        around = extent(shapes)
        high = extent([*self._shapes(all_links, "collisions"), *self._shapes(all_links, "visuals", tell=False)])
        figures: list[tuple[str, float]] = []
        if around is None or around.radius_m <= 0:
            told = "no box, cylinder or sphere tells the footprint; add radius_m to the class"
            self._note("link", self._root, Fate.LEFT_OUT, told)
        else:
            figures.append(("radius_m", round(around.radius_m, 4)))
        if high is not None:
            below = min(high.lowest_m, 0.0)
            figures.append(("height_m", round(high.highest_m - below, 4)))
        return figures

    def _placed(self, *, rigid_only: bool) -> dict[str, Shape]:
        """Where links stand in the frame of the root, joints at zero; a shape without size."""
        placed = {self._root: Shape.at_origin()}
        todo = [self._root]
        for link in todo:
            for name, child in self._robot.child_map.get(link, ()):
                joint = self._joints[name]
                if rigid_only and joint.type != "fixed":
                    continue
                placed[child] = placed[link].moved(*self._pose("joint", name, joint.origin))
                todo.append(child)
        return placed

    def _shapes(self, placed: dict[str, Shape], which: str, *, tell: bool = True) -> list[Shape]:
        shapes = []
        for link in self._robot.links:
            for solid in getattr(link, which) if link.name in placed else ():
                geometry = solid.geometry
                own = placed[link.name].moved(*self._pose("link", link.name, solid.origin))
                match geometry:
                    case urdf.Box():
                        shapes.append(own.box(self._sizes(link.name, *geometry.size)))
                    case urdf.Cylinder():
                        radius_m, length_m = self._sizes(link.name, geometry.radius, geometry.length)
                        shapes.append(own.cylinder(radius_m, length_m))
                    case urdf.Sphere():
                        [radius_m] = self._sizes(link.name, geometry.radius)
                        shapes.append(own.sphere(radius_m))
                    case _ if tell:
                        told = f"the mesh {local(str(geometry.filename))} is not read; it counts for no size"
                        self._note("link", link.name, Fate.LEFT_OUT, told)
                    case _:
                        pass
        return shapes

    def _pose(self, sort: str, name: str, origin: urdf.Pose | None) -> tuple[list[float], list[float]]:
        """Position (m) and roll, pitch, yaw (rad)."""
        xyz, rpy = (list((origin and getattr(origin, part)) or [0.0] * 3) for part in ("xyz", "rpy"))
        if not all(map(math.isfinite, (*xyz, *rpy))):
            raise self._wrong(sort, name, f"has an origin of xyz {xyz} and rpy {rpy}; they must be numbers")
        return xyz, rpy

    def _sizes(self, link: str, *sizes: float) -> tuple[float, ...]:
        wrong = next((s for s in sizes if not math.isfinite(float(s)) or float(s) < 0), None)
        if wrong is not None:
            raise self._wrong("link", link, f"has a shape of the size {wrong}; it must be a number of meters from 0")
        return tuple(float(s) for s in sizes)

    # Joints

    def _joint(self, joint: urdf.Joint) -> Joint:
        limits: list[tuple[str, float]] = []
        limit = joint.limit
        if limit is None:
            if joint.type in _NEEDS_LIMIT:
                told = f"a {joint.type} joint without <limit>; how far and fast it may move is not known"
                self._note("joint", joint.name, Fate.LEFT_OUT, told)
        elif joint.type in _TURNS | _SLIDES:
            limits = self._limits(joint, limit)
        if joint.mimic is not None:
            told = f"moves as {joint.mimic.joint} does (mimic): there is no place for it in our model"
            self._note("joint", joint.name, Fate.LEFT_OUT, told)
        return Joint(
            name=joint.name, kind=joint.type, parent=joint.parent, child=joint.child, limits=tuple(sorted(limits))
        )

    def _limits(self, joint: urdf.Joint, limit: urdf.JointLimit) -> list[tuple[str, float]]:
        unit, largest = ("rad", _LARGEST_RAD) if joint.type in _TURNS else ("m", _LARGEST_M)
        numbers = {n: getattr(limit, n) for n in ("lower", "upper", "effort", "velocity")}
        for name, value in numbers.items():
            if value is not None and not math.isfinite(value):
                raise self._wrong("joint", joint.name, f"has the limit {name}={value}; give a number")
        lower, upper = numbers["lower"] or 0.0, numbers["upper"] or 0.0
        found: list[tuple[str, float]] = []
        if joint.type in _NEEDS_LIMIT:
            if lower > upper:
                told = f"its lower limit {lower:g} is above the upper one, {upper:g}; exchange them"
                raise self._wrong("joint", joint.name, told)
            if max(abs(lower), abs(upper)) > largest:
                told = f"has limits {lower:g} and {upper:g} {unit}; beyond {largest:.0f} {unit}, no joint moves"
                raise self._wrong("joint", joint.name, told)
            found += [(f"lowerLimit_{unit}", lower), (f"upperLimit_{unit}", upper)]
        effort = "maxTorque_Nm" if unit == "rad" else "maxForce_N"
        for name, prop in (("effort", effort), ("velocity", f"maxJointVel_{unit}ps")):
            value = numbers[name]
            if value is not None and value < 0:
                raise self._wrong("joint", joint.name, f"has the limit {name}={value:g}; it cannot be below 0")
            if value:
                found.append((prop, float(value)))
            elif value is not None:
                told = f"{name}=0, which most often means that it is not known; it was left out"
                self._note("joint", joint.name, Fate.LEFT_OUT, told)
        return found

    # What it has

    def _devices(self) -> list[Device]:
        found = []
        told_links = set()
        for link, kind in self._text.sensors():
            device = Device(kind=_SENSORS.get(kind, f"Sensor_{kind}"), sort="Sensor")
            found.append(device)
            told_links.add(link)
            if kind not in _SENSORS:
                told = f"has a sensor of the type {kind!r}, which we do not know; it became a class of its own"
                self._note("link", link, Fate.CHANGED, told)
        guesses: dict[Device, list[str]] = {}
        for link in sorted(link.name for link in self._robot.links):
            guess = None if link in told_links or link == self._root else hinted(link)
            if guess is not None and guess not in found:
                guesses.setdefault(guess, []).append(link)
        for device, links in guesses.items():
            told = f"that it has a {device.kind} follows from names alone: {', '.join(links[:4])}"
            self._note("link", links[0], Fate.GUESSED, told)
            found.append(device)
        if not any(d.kind in ("Base", "OmnidirectionalBase") for d in found):
            told = "nothing tells what it drives with; add `hasActuator some Base` to the class if it does"
            self._note("link", self._root, Fate.LEFT_OUT, told)
        return found

    def _tell_rest(self) -> None:
        told = "maxVelLin_mps and maxVelAng_radps, which URDF does not say: add them before robots of it drive"
        self._note("link", self._root, Fate.LEFT_OUT, told)
        for tag, count in self._text.others():
            told = _PARTLY_READ.get(tag, "there is no place for them in our model")
            self._note("robot", tag, Fate.LEFT_OUT, f"{count} elements <{tag}>: {told}")
