"""SRDL robot descriptions -> a robot class of ours (Kunze, Roehm, Beetz, "Towards semantic robot description
languages", ICRA 2011).

Components become what the class has; links and joints are kept for reference. Poses, and what belongs to one
robot and not to its class, are left out.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

from rdflib import OWL, RDF, RDFS, URIRef
from rdflib.term import Node

from kb.imports.draft import Draft
from kb.imports.knowrob import CAPABILITY, COMPONENT, KNOWROB, axioms, canonical, is_individual, is_vocabulary
from kb.imports.names import local
from kb.imports.report import Fate, Imported, NotImportable, in_order
from kb.imports.robots import Device, Joint, Model, write_model
from kb.imports.source import Source
from kb.vocabulary import CORE_IRI

_KNOWN = {
    "LaserScanner": Device(kind="LaserScanner", sort="Sensor"),
    "TiltingLaserScanner": Device(kind="LaserScanner", sort="Sensor"),
    "TwoDimensionalLaserScanner": Device(kind="LaserScanner", sort="Sensor"),
    "HokuyoURG04LX": Device(kind="LaserScanner", sort="Sensor"),
    "HokuyoUTM-30LX": Device(kind="LaserScanner", sort="Sensor"),
    "Kinect": Device(kind="Kinect", sort="Sensor"),
    "KinectCamera": Device(kind="Kinect", sort="Sensor"),
    "HolonomicBase": Device(kind="OmnidirectionalBase", sort="Actuator"),
    "KukaOmnidirPlatform": Device(kind="OmnidirectionalBase", sort="Actuator"),
    "Pr2Base": Device(kind="OmnidirectionalBase", sort="Actuator"),
    "MobileBase": Device(kind="Base", sort="Actuator"),
    "WheeledBase": Device(kind="Base", sort="Actuator"),
    "Base": Device(kind="Base", sort="Actuator"),
}
_BY_NAME = (
    (re.compile(r"Sensor|Camera|Scanner|Accelerometer|IMU|Microphone"), "Sensor"),
    (re.compile(r"Controller|Component$|Executive|Software|Recognition(Model|Component)"), "Software"),
    (re.compile(r"Arm|Gripper|Hand|Base|Manipulation|Actuator|Motor|Torso|KukaLWR"), "Actuator"),
)
_PARTS_OF_BODY = re.compile(r"(Left|Right)?(Arm|Hand|Leg)$|Head-Vertebrate|ComponentComposition|Map$")
_HARDWARE = re.compile(r"(Arm|Gripper|Hand)Component$")


def import_srdl(path: Path, iri: str) -> Imported:
    """Read a robot description.

    Args:
        path: The file.
        iri: Of the ontology to make.

    Raises:
        NotImportable: The file does not parse, or describes no robot.
    """
    source = Source(path, is_vocabulary=is_vocabulary, canonical=canonical)
    draft = Draft(iri)
    robot = _Robot(source)
    write_model(draft, robot.model())
    source.tell_unread("there is no place for it in our robot classes")
    return Imported(
        iri=iri,
        entities=tuple(draft.entities.values()),
        imports=(CORE_IRI,),
        comments=(f"Imported from the SRDL file {path.name}, ontology <{source.iri}>; to be reviewed.",),
        label=local(source.iri).removesuffix(".owl"),
        notes=in_order(source.notes),
    )


class _Robot:
    def __init__(self, source: Source) -> None:
        self._source = source
        self._kind = self._robot_class()

    def model(self) -> Model:
        """The whole."""
        capabilities = self._capabilities()
        links, joints = self._links(), self._joints()
        masses = {link: self._mass_kg(link) for link in links}
        lacking = "maxVelLin_mps, maxVelAng_radps and radius_m, which SRDL does not say"
        self._source.note(self._kind, Fate.LEFT_OUT, f"{lacking}: add them to the class before robots of it drive")
        said = [f"In SRDL it is said to have the capabilities {', '.join(capabilities)}."] if capabilities else []
        return Model(
            name=local(str(self._kind)),
            devices=tuple(self._devices()),
            figures=(("mass_kg", round(sum(known), 6)),) if (known := [m for m in masses.values() if m]) else (),
            links=tuple((name, masses[link]) for link, name in links.items()),
            joints=tuple(joints),
            comments=tuple(said),
        )

    def _robot_class(self) -> URIRef:
        source = self._source
        known = [c for c in source.of_type(OWL.Class) if isinstance(c, URIRef)]
        robots = [c for c in known if KNOWROB.Robot in source.values(c, RDFS.subClassOf)]
        able = [c for c in known if any(r.prop == "hasCapability" for r in axioms(source, c)[1])]
        found = robots or able
        if not found:
            told = "describes no robot: no class is below knowrob:Robot or has a restriction of hasCapability"
            raise NotImportable(source.path, 0, told)
        for other in found[1:]:
            source.note(other, Fate.LEFT_OUT, f"is another robot class; one is imported, {local(str(found[0]))}")
        return found[0]

    def _capabilities(self) -> list[str]:
        found = [r for r in axioms(self._source, self._kind)[1] if r.prop == "hasCapability"]
        for r in found:
            told = f"hasCapability {local(str(r.filler))}: our capabilities follow from what a robot has"
            self._source.note(self._kind, Fate.CHANGED, f"{told}; it is told in the comment of the class")
            self._source.types(CAPABILITY[local(str(r.filler))])
        return sorted(local(str(r.filler)) for r in found)

    def _devices(self) -> list[Device]:
        source, found = self._source, []
        for kind in sorted(set(source.graph.objects(None, RDF.type)), key=str):
            name = local(str(kind))
            own = str(kind).startswith((str(COMPONENT), str(KNOWROB), source.iri))
            if not own or name.endswith(("UrdfLink", "UrdfJoint")):
                continue
            members = [m for m in source.graph.subjects(RDF.type, kind) if is_individual(source, m)]
            device = self._device(kind) if members else None
            if device is not None:
                found.append(device)
                for member in members:
                    source.types(member)
        return found

    def _device(self, kind: Node) -> Device | None:
        """What a component of a class is to us; None for what is no component."""
        name = local(str(kind))
        above = [local(str(c)) for c in self._source.values(kind, RDFS.subClassOf)]
        for own in (name, *above):
            if own in _KNOWN:
                return _KNOWN[own]
        if _PARTS_OF_BODY.fullmatch(name):
            return None
        for own in (name, *above):
            sort = "Actuator" if _HARDWARE.search(own) else next((s for p, s in _BY_NAME if p.search(own)), "")
            if sort:
                told = f"{name} was taken for a kind of {sort.lower()}, by its name"
                self._source.note(self._kind, Fate.GUESSED, told)
                return Device(kind=name.replace("-", "_"), sort=sort)
        return None

    # Links and joints

    def _links(self) -> dict[Node, str]:
        links = {link: self._called(link) for link in self._source.of_type(COMPONENT.UrdfLink)}
        return dict(sorted(links.items(), key=lambda item: item[1]))

    def _mass_kg(self, link: Node) -> float | None:
        value = self._source.value(link, COMPONENT.mass_value)
        if value is None:
            return None
        try:
            mass = float(str(value))
        except ValueError:
            mass = math.nan
        if not 0 <= mass < math.inf:
            self._source.note(link, Fate.LEFT_OUT, f"its mass {value} is no number of kg from 0")
            return None
        return mass

    def _called(self, node: Node) -> str:
        return str(self._source.value(node, COMPONENT.urdfName) or local(str(node)))

    def _joints(self) -> list[Joint]:
        source, joints = self._source, []
        above = {joint: link for link in self._links() for joint in source.values(link, COMPONENT.succeedingJoint)}
        for prefix in ("Revolute", "Continuous", "Prismatic", "Fixed", "Floating", "Planar"):
            for joint in source.of_type(COMPONENT[f"{prefix}UrdfJoint"]):
                child = source.value(joint, COMPONENT.succeedingLink)
                parent = above.get(joint) or source.value(joint, COMPONENT.precedingLink)
                if child is None or parent is None:
                    source.note(joint, Fate.LEFT_OUT, "a joint that does not connect two links")
                    continue
                ends = (self._called(parent), self._called(child))
                joints.append(Joint(name=self._called(joint), kind=prefix.lower(), parent=ends[0], child=ends[1]))
        return sorted(joints, key=lambda j: j.name)
