"""A robot model as a class of ours: what it has, how large it is, and its links and joints for reference."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from kb.imports.draft import Draft
from kb.imports.names import safe
from kb.vocabulary import CORE, Kind, Property
from kb.writing import Has, Literal, Some

_OURS = {
    "LaserScanner": "LaserScanner",
    "DepthCamera": "DepthCamera",
    "Kinect": "Kinect",
    "Base": "Base",
    "OmnidirectionalBase": "OmnidirectionalBase",
}
_HAS = {"Sensor": "hasSensor", "Actuator": "hasActuator", "Software": "hasSoftware"}
_HINTS = (
    (re.compile(r"kinect"), "Kinect", "Sensor"),
    (re.compile(r"xtion|realsense|rgbd|depth|asus|orbbec"), "DepthCamera", "Sensor"),
    (re.compile(r"laser|lidar|hokuyo|sick|velodyne|scanner"), "LaserScanner", "Sensor"),
    (re.compile(r"cam(?:era)?(?:_|$|\d)"), "Camera", "Sensor"),
    (re.compile(r"imu(?:_|$)"), "InertialSensor", "Sensor"),
    (re.compile(r"sonar|ultrasound"), "Sonar", "Sensor"),
    (re.compile(r"mecanum|omni"), "OmnidirectionalBase", "Actuator"),
    (re.compile(r"wheel|caster"), "Base", "Actuator"),
    (re.compile(r"gripper|finger"), "Gripper", "Actuator"),
    (re.compile(r"arm(?:_|$|\d)|elbow|shoulder"), "Arm", "Actuator"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Device:
    """Something that a robot has.

    Attributes:
        kind: Name of its class: one of the core where that has it.
        sort: Sensor, Actuator or Software.
    """

    kind: str
    sort: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """A joint of a robot model, with what is known of it by property of ours."""

    name: str
    kind: str
    parent: str
    child: str
    limits: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """A robot model.

    Attributes:
        figures: Numbers of the whole by property of ours.
        links: Mass by name, where it is known.
    """

    name: str
    devices: tuple[Device, ...]
    figures: tuple[tuple[str, float], ...]
    links: tuple[tuple[str, float | None], ...]
    joints: tuple[Joint, ...]
    comments: tuple[str, ...] = ()


def hinted(name: str) -> Device | None:
    """What the name of a link suggests that a robot has; a guess."""
    for pattern, kind, sort in _HINTS:
        if pattern.search(name.lower()):
            return Device(kind=kind, sort=sort)
    return None


def write_model(draft: Draft, model: Model) -> None:
    """Add a robot model to a draft."""
    name = draft.names.of(model.name, _capital(safe(model.name)))
    above: list[str | Some | Has] = [CORE + Kind.ROBOT]
    for device in sorted(set(model.devices), key=lambda d: (list(_HAS).index(d.sort), d.kind)):
        above.append(Some(prop=CORE + _HAS[device.sort], kind=_class_of(draft, name, device)))
    above += [Has(prop=CORE + prop, value=value) for prop, value in model.figures]
    kind = draft.kind(name, above, comments=model.comments, label=model.name)
    for link, mass_kg in model.links:
        values: list[tuple[str, Literal]] = [] if mass_kg is None else [("mass_kg", mass_kg)]
        _part(draft, name, kind, link, "Link", [], values)
    for joint in model.joints:
        ends = [("parentLink", joint.parent), ("childLink", joint.child)]
        links = [(prop, draft.names.of(f"{name} Link {to}", f"{name}_{to}")) for prop, to in ends if to]
        _part(draft, name, kind, joint.name, "Joint", links, [("jointType", joint.kind), *joint.limits])


def _part(
    draft: Draft,
    robot: str,
    kind: str,
    name: str,
    sort: str,
    links: Iterable[tuple[Property | str, str]],
    values: Iterable[tuple[Property | str, Literal]],
) -> None:
    entity = draft.names.of(f"{robot} {sort} {name}", f"{robot}_{name}")
    draft.individual(entity, sort, [*links, ("partOfModel", kind)], values, label=name)


def _class_of(draft: Draft, robot: str, device: Device) -> str:
    """The class of a device: that of the core, or a new one of this robot."""
    if device.kind in _OURS:
        return CORE + _OURS[device.kind]
    name = draft.names.of(f"device {device.kind}", f"{robot}_{device.kind}")
    return draft.kind(name, [CORE + device.sort], label=device.kind)


def _capital(name: str) -> str:
    return name[:1].upper() + name[1:]
