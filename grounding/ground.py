"""A primitive action -> a service call, as the knowledge base grounds it."""

from __future__ import annotations

from collections.abc import Mapping

from grounding.errors import GroundingError
from grounding.messages import PoseStamped, pose_stamped, problem_with, type_name
from grounding.transport import ServiceCall
from kb.groundings import Field, Grounding
from kb.store import Snapshot
from kb.terms import Action, Data, Fluent, Value
from kb.vocabulary import Kind, Property

_POSE = "geometry_msgs/PoseStamped"


def ground(action: Action, snapshot: Snapshot, data: Mapping[str, object], *, call_id: int, t_s: float) -> ServiceCall:
    """Turn an action into a call: every field of the request filled in and checked.

    Args:
        data: The messages that earlier actions made, by place.
        call_id: Number of the call, never used before.
        t_s: Time now, for stamps.

    Raises:
        GroundingError: A field has no value, or one of the wrong type.
    """
    grounding = snapshot.groundings[action.process]
    fields: dict[str, object] = {}
    for field in grounding.request:
        value = _value(action, field, grounding, snapshot, data, t_s)
        if value is None:
            if not field.optional:
                raise GroundingError(action.process, field.name, f"{field.parameter} of {action} has no value yet")
        else:
            # Messages were checked field by field when they arrived (grounding/outcome.py).
            problem = "" if type_name(value) == field.message_type else problem_with(field.message_type, value)
            if problem:
                raise GroundingError(action.process, field.name, f"the value {problem}")
        fields[field.name] = value
    service = grounding.service.replace("{robot}", action.robot or "")
    return ServiceCall(id=call_id, service=service, fields=fields, timeout_s=grounding.timeout_s)


def _value(
    action: Action, field: Field, grounding: Grounding, snapshot: Snapshot, data: Mapping[str, object], t_s: float
) -> object:
    if field.file is not None:
        return str(field.file)
    if field.constant is not None:
        return field.constant
    argument = action.argument(field.parameter or "")
    match argument:
        case Data(place):
            return data.get(place)
        case Fluent():
            return data.get(argument.place)
        case None:
            raise GroundingError(grounding.process, field.name, f"{action} has no parameter {field.parameter!r}")
        case _ if _is_datum(action, field, snapshot):
            return argument
        case _:
            return field_of_individual(str(argument), field, snapshot, process=action.process, t_s=t_s)


def _is_datum(action: Action, field: Field, snapshot: Snapshot) -> bool:
    """Whether what stands in the place of a message is its value itself: a text or number that was asked with."""
    parameter = snapshot.processes[action.process].parameter(field.parameter or "")
    return parameter is not None and parameter.is_datum


def field_of_individual(individual: str, field: Field, snapshot: Snapshot, *, process: str, t_s: float) -> object:
    """The value of a field that speaks of an individual: its pose, a property, its class, or its name."""
    if field.of_property is not None:
        value: Value | None = snapshot.value(field.of_property, individual)
        return float(value) if field.message_type == "float64" and isinstance(value, int) else value
    if field.kind_of:
        return snapshot.ontology.kind_of(individual)
    if field.message_type == _POSE:
        if not snapshot.ontology.is_a(individual, Kind.LOCATION):
            raise GroundingError(process, field.name, f"{individual} is no Location, so it has no pose")
        return pose_of(individual, snapshot, t_s=t_s)
    return individual


def pose_of(location: str, snapshot: Snapshot, *, t_s: float) -> PoseStamped:
    """Where a robot stands at a location, in the map."""
    x_m, y_m, yaw_rad = (
        float(str(snapshot.ontology.value(prop, location)))
        for prop in (Property.POSE_X_M, Property.POSE_Y_M, Property.POSE_YAW_RAD)
    )
    return pose_stamped(x_m, y_m, yaw_rad, t_s=t_s)
