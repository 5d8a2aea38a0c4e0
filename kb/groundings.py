"""How atomic processes are executed, as the ontology declares it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from kb.ontology import Ontology, Value
from kb.processes import Process
from kb.vocabulary import Kind, Property


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """One field of a request or reply.

    The value is a file of the site (`file`), or that of a parameter: the message or individual itself,
    a property of the individual (`of_property`), or the name of its most specific class (`kind_of`); or it is
    always the same (`constant`).
    """

    name: str
    message_type: str
    parameter: str | None
    of_property: str | None
    kind_of: bool
    file: Path | None
    optional: bool
    constant: Value | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Grounding:
    """The service, action or topic that executes an atomic process.

    Attributes:
        service: Name of the service, the action or the topic; `{robot}` stands for the robot's name.
        on_robot: Whether the robot offers it; else it is a compute service.
        duration_s: How long it is expected to take.
        deterministic: Whether equal requests have equal replies, but for stamps.
        cacheable: Whether an earlier reply to an equal request may stand in for a call.
        action_type: Such as `nav2_msgs/NavigateToPose`; empty for a service or a topic.
        max_age_s: How old the newest message of a topic may be; None for a service or an action. The one reply field
            is the message.
    """

    name: str
    process: str
    service: str
    on_robot: bool
    timeout_s: float
    duration_s: float
    request: tuple[Field, ...]
    reply: tuple[Field, ...]
    deterministic: bool = False
    cacheable: bool = False
    action_type: str = ""
    max_age_s: float | None = None

    @property
    def is_topic(self) -> bool:
        """Whether the newest message of a topic is taken, rather than something called."""
        return self.max_age_s is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class TravelEstimate:
    """The compute service that tells how long a robot travels.

    Attributes:
        request: Its fields, but for the places.
    """

    service: str
    request: tuple[Field, ...]


def read_travel_estimates(ontology: Ontology, site_folder: Path) -> dict[str, TravelEstimate]:
    """How travel durations are estimated, by the name of the duration model."""
    return {
        name: TravelEstimate(
            service=str(ontology.value(Property.SERVICE_NAME, name)),
            request=_fields(ontology, Property.HAS_REQUEST_FIELD, name, site_folder),
        )
        for name in ontology.individuals(Kind.TRAVEL_DURATION)
    }


_NAMED_BY = {
    Kind.ROBOT_GROUNDING: Property.SERVICE_NAME,
    Kind.COMPUTE_GROUNDING: Property.SERVICE_NAME,
    Kind.ACTION_GROUNDING: Property.ACTION_NAME,
    Kind.TOPIC_GROUNDING: Property.TOPIC_NAME,
}


def read_groundings(ontology: Ontology, processes: dict[str, Process], site_folder: Path) -> dict[str, Grounding]:
    """All groundings by the name of their process; shapes have checked that each is whole."""
    groundings = {}
    for kind, named in _NAMED_BY.items():
        for name in ontology.individuals(kind):
            process = str(ontology.value(Property.GROUNDS, name))
            groundings[process] = Grounding(
                name=name,
                process=process,
                service=str(ontology.value(named, name)),
                on_robot=kind is not Kind.COMPUTE_GROUNDING,
                timeout_s=_number(ontology, Property.TIMEOUT_S, name),
                duration_s=_number(ontology, Property.DURATION_S, process),
                request=_fields(ontology, Property.HAS_REQUEST_FIELD, name, site_folder),
                reply=_fields(ontology, Property.HAS_REPLY_FIELD, name, site_folder),
                deterministic=ontology.value(Property.IS_DETERMINISTIC, process) is True,
                cacheable=ontology.value(Property.IS_CACHEABLE, name) is True,
                action_type=str(ontology.value(Property.ACTION_TYPE, name) or ""),
                max_age_s=_number(ontology, Property.MAX_AGE_S, name) if kind is Kind.TOPIC_GROUNDING else None,
            )
    return groundings


def must_offer(ontology: Ontology, robot: str, grounding: Grounding) -> bool:
    """Whether a robot must offer what a grounding names: an action or a topic only if it is capable of the process."""
    needed = ontology.values(Property.REQUIRES_CAPABILITY, grounding.process)
    able = all(ontology.is_a(robot, str(capability)) for capability in needed)
    return grounding.on_robot and (able or not (grounding.action_type or grounding.is_topic))


def _fields(ontology: Ontology, prop: Property, grounding: str, site_folder: Path) -> tuple[Field, ...]:
    fields = []
    for entity in map(str, ontology.values(prop, grounding)):
        parameter = ontology.value(Property.MAPS_PARAMETER, entity)
        of_property = ontology.value(Property.OF_PROPERTY, entity)
        file_name = ontology.value(Property.FILE_NAME, entity)
        fields.append(
            Field(
                name=str(ontology.value(Property.FIELD_NAME, entity)),
                message_type=str(ontology.value(Property.MESSAGE_TYPE, entity)),
                parameter=None if parameter is None else str(ontology.value(Property.PARAMETER_NAME, str(parameter))),
                of_property=None if of_property is None else str(of_property),
                kind_of=ontology.value(Property.KIND_OF, entity) is True,
                file=None if file_name is None else site_folder / str(file_name),
                optional=ontology.value(Property.IS_OPTIONAL, entity) is True,
                constant=ontology.value(Property.HAS_VALUE, entity),
            )
        )
    return tuple(sorted(fields, key=lambda f: f.name))


def _number(ontology: Ontology, prop: Property, subject: str) -> float:
    value = ontology.value(prop, subject)
    return float(value) if isinstance(value, int | float) else 0.0
