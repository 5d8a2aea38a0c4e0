"""Stage 1: a request, checked against the ontology before anything else happens."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass

from executive.errors import BadRequest
from kb.ontology import fluent_properties
from kb.processes import Parameter, Process
from kb.revisions import wrong_kinds
from kb.store import Snapshot
from kb.vocabulary import Kind
from planner.classical_goal import Goal


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskRequest:
    """A well-formed request.

    Attributes:
        process: The process that accomplishes the task; for a goal, the one that its plan becomes.
        arguments: Individuals by the names of its inputs.
        robots: At most so many robots take part.
        goal: What shall be true, where that is what was asked for.
    """

    process: str
    arguments: Mapping[str, str]
    robots: int
    goal: Goal | None = None


def check_request(process: str, arguments: Mapping[str, object], robots: object, snapshot: Snapshot) -> TaskRequest:
    """Make a request of what a person asked for.

    Raises:
        BadRequest: Unknown task type, unknown or missing argument, an argument of the wrong type, no robots.
    """
    found = snapshot.processes.get(process)
    if found is None:
        known = sorted(snapshot.processes)
        raise BadRequest(process, f"there is no task type {process!r}; {_near(process, known, 'there is')}")
    wanted = {p.name: p for p in found.inputs}
    for name in arguments:
        if name not in wanted:
            raise BadRequest(name, f"{process} has no argument {name!r}; it takes {_signature(found)}")
    checked: dict[str, str] = {}
    for name, parameter in wanted.items():
        if name not in arguments:
            raise BadRequest(
                name, f"{process} needs the argument {name!r}, {_a(parameter.kind)}; it takes {_signature(found)}"
            )
        if parameter.is_datum:
            checked[name] = _text(arguments[name], name, parameter, process, snapshot)
            continue
        checked[name] = _individual(arguments[name], name, parameter.kind, process, snapshot)
    fleet = snapshot.ontology.individuals(Kind.ROBOT)
    limit = max(1, len(fleet)) if robots is None else robots  # without robots, there may be services to ask
    if isinstance(limit, bool) or not isinstance(limit, int) or limit < 1:
        raise BadRequest(
            "robots", f"robots={limit!r} is no upper limit of robots; give a number from 1 to {len(fleet)}"
        )
    return TaskRequest(process=process, arguments=checked, robots=limit)


def check_fact(prop: str, subject: str, value: object, snapshot: Snapshot) -> None:
    """Check that a property of an individual may have this value.

    Raises:
        BadRequest: No property that changes, an unknown individual, or a value of the wrong kind.
    """
    ontology = snapshot.ontology
    changing = sorted(p for p in fluent_properties(ontology) if not ontology.datum_property(p))
    if prop not in changing:
        raise BadRequest(
            prop, f"there is no property {prop!r} that a person can tell of; {_near(prop, changing, 'there is')}"
        )
    told = f"{prop}({subject})"
    kinds = (Kind.ROBOT, Kind.AREA, Kind.LOCATION, Kind.PHYSICAL_OBJECT)
    things = sorted({thing for kind in kinds for thing in ontology.individuals(kind)})
    if subject not in things:
        raise BadRequest(told, f"{subject} is not known; {_near(subject, things, 'there is')}")
    if not isinstance(value, str | int | float) or (isinstance(value, float) and not math.isfinite(value)):
        raise BadRequest(told, f"{told} cannot be {value!r}; give an individual, a number or a truth value")
    known = sorted({_sort(v) for (p, _), v in snapshot.fluents.items() if p == prop})
    if known and _sort(value) not in known:
        raise BadRequest(told, f"{told} cannot be {value!r}; its values are {' or '.join(known)}")
    if isinstance(value, str) and value not in things:
        raise BadRequest(told, f"{told} cannot be {value!r}, which is not known; {_near(value, things, 'there is')}")
    for thing, wanted in wrong_kinds(ontology, prop, subject, value):
        wrong = f"{thing} is {_a(ontology.kind_of(thing))}, not {_a(wanted)}"
        near = _near(thing, ontology.individuals(wanted), f"{_a(wanted)} is")
        raise BadRequest(told, f"{told} cannot be {value!r}: {wrong}; {near}")


def _sort(value: object) -> str:
    match value:
        case bool():
            return "true or false"
        case int() | float():
            return "numbers"
        case str():
            return "individuals"
        case _:
            return type(value).__name__


def _text(value: object, name: str, parameter: Parameter, process: str, snapshot: Snapshot) -> str:
    """A datum that a person can give: a text, as it is."""
    if Kind.TEXT not in snapshot.ontology.superclasses.get(parameter.kind, ()):
        raise BadRequest(name, f"{process} needs {name!r}, which only another step can make; ask for a task instead")
    if not isinstance(value, str):
        raise BadRequest(name, f"{name}={value!r} of {process} is a {type(value).__name__}; give a text")
    return value


def _individual(value: object, name: str, kind: str, process: str, snapshot: Snapshot) -> str:
    right = snapshot.ontology.individuals(kind)
    if not isinstance(value, str):
        raise BadRequest(
            name, f"{name}={value!r} of {process} is a {type(value).__name__}; give the name of {_a(kind)}"
        )
    if value not in snapshot.ontology.kinds:
        raise BadRequest(name, f"{name}={value!r} of {process} is not known; {_near(value, right, f'{_a(kind)} is')}")
    if value not in right:
        own = snapshot.ontology.kind_of(value)
        raise BadRequest(
            name, f"{name}={value!r} of {process} is {_a(own)}, not {_a(kind)}; {_near(value, right, f'{_a(kind)} is')}"
        )
    return value


def _near(wrong: str, right: list[str], there_is: str) -> str:
    near = difflib.get_close_matches(wrong, right, n=1)
    return f"did you mean {near[0]}?" if near else f"{there_is} {', '.join(right) or 'none'}"


def _signature(process: Process) -> str:
    return ", ".join(f"{p.name} ({_a(p.kind)})" for p in process.inputs) or "no arguments"


def _a(kind: str) -> str:
    return f"an {kind}" if kind[0] in "AEIOU" else f"a {kind}"
