"""The sites of a folder, and what their robots, things and files must say so that services can be asked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from kb.groundings import Field, Grounding, TravelEstimate
from kb.ontology import Ontology
from kb.problems import Problem
from kb.processes import Process
from kb.vocabulary import Kind, Property

_POSITIVE = (
    Property.RADIUS_M,
    Property.MAX_VEL_LIN_MPS,
    Property.MAX_VEL_ANG_RADPS,
    Property.ENERGY_J,
    Property.POWER_W,
    Property.TRAVEL_FACTOR,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Request:
    """What is asked of a service.

    Attributes:
        name: Of the grounding or travel duration that asks.
        robots: The names of those of its parameters that stand for robots.
        kinds: The classes of its parameters, by name.
    """

    name: str
    fields: tuple[Field, ...]
    robots: frozenset[str]
    kinds: Mapping[str, str]


def sites_of(folder: Path) -> list[str]:
    """The names of the sites in a folder of ontologies."""
    return sorted(p.parent.name for p in folder.glob("sites/*/*.owl") if p.stem == p.parent.name)


def check_site(
    ontology: Ontology,
    processes: Mapping[str, Process],
    groundings: Mapping[str, Grounding],
    estimates: Mapping[str, TravelEstimate],
) -> list[Problem]:
    """All that services would miss.

    Args:
        estimates: How travel is estimated, by the name of the duration model.
    """
    requests = [*_of_groundings(processes, groundings), *_of_estimates(ontology, estimates)]
    problems = [*_one_estimate(ontology, estimates), *_no_room(ontology)]
    for robot in ontology.individuals(Kind.ROBOT):
        problems += [*_not_positive(ontology, robot), *_half_a_battery(ontology, robot)]
        problems += [p for request in requests for p in _unstated(ontology, robot, request)]
    for request in requests:
        problems += _missing_files(ontology, request)
        problems += _missing_entries(ontology, request)
    return problems


def _of_groundings(processes: Mapping[str, Process], groundings: Mapping[str, Grounding]) -> Iterator[_Request]:
    for grounding in groundings.values():
        process = processes[grounding.process]
        yield _Request(
            name=grounding.name,
            fields=grounding.request,
            robots=frozenset(p.name for p in process.robots),
            kinds={p.name: p.kind for p in process.parameters},
        )


def _of_estimates(ontology: Ontology, estimates: Mapping[str, TravelEstimate]) -> Iterator[_Request]:
    for name, estimate in estimates.items():
        parameter = str(ontology.value(Property.TRAVELING_ROBOT, name))
        robot = str(ontology.value(Property.PARAMETER_NAME, parameter))
        yield _Request(name=name, fields=estimate.request, robots=frozenset({robot}), kinds={})


def _one_estimate(ontology: Ontology, estimates: Mapping[str, TravelEstimate]) -> list[Problem]:
    """All travel durations must be estimated in the same way."""
    names = sorted(estimates)
    return [
        ontology.problem(
            "KB162",
            name,
            f"names another service or other fields than {names[0]}; "
            "only one way to estimate travel is supported, so give both the same",
        )
        for name in names
        if estimates[name] != estimates[names[0]]
    ]


def _not_positive(ontology: Ontology, robot: str) -> list[Problem]:
    """What a robot, or its class, says to be zero or less though no robot is like that."""
    return [
        ontology.problem(
            "KB132", robot, f"of the class {ontology.kind_of(robot)} has {prop} {value}; it must be a number above 0"
        )
        for prop in _POSITIVE
        for value in ontology.values(prop, robot)
        if not isinstance(value, int | float) or value <= 0
    ]


def _half_a_battery(ontology: Ontology, robot: str) -> list[Problem]:
    """Energy without power, or power without energy: how long the robot can work is not known."""
    pair = (Property.ENERGY_J, Property.POWER_W)
    lacking = [prop for prop in pair if ontology.value(prop, robot) is None]
    if len(lacking) != 1:
        return []
    [given] = set(pair) - set(lacking)
    told = (
        f"of the class {ontology.kind_of(robot)} has {given}, but no {lacking[0]}; give both, or none: it can work for"
    )
    return [ontology.problem("KB133", robot, f"{told} energy_J / power_W seconds")]


def _no_room(ontology: Ontology) -> list[Problem]:
    """Resources that nothing could ever use."""
    return [
        ontology.problem("KB134", name, f"has the capacity {value}; it must be a whole number above 0")
        for prop, name, value in ontology.all_values()
        if prop == Property.CAPACITY and (not isinstance(value, int) or value < 1)
    ]


def _unstated(ontology: Ontology, robot: str, request: _Request) -> list[Problem]:
    """What a robot does not say of itself, though a service is told it."""
    kind = ontology.kind_of(robot)
    return [
        ontology.problem(
            "KB131",
            robot,
            f"has no {field.of_property}, which {request.name} needs; "
            f"give the class {kind} `SubClassOf: {field.of_property} value ...`",
        )
        for field in request.fields
        if field.of_property and field.parameter in request.robots and ontology.value(field.of_property, robot) is None
    ]


def _missing_files(ontology: Ontology, request: _Request) -> list[Problem]:
    return [
        ontology.problem("KB125", request.name, f"names the file {field.file}, which does not exist")
        for field in request.fields
        if field.file is not None and not field.file.exists()
    ]


def _missing_entries(ontology: Ontology, request: _Request) -> list[Problem]:
    """Things of a class that a service is told the name of, but finds nothing about in its file.

    A YAML file in the same request whose topmost names are classes of such things, at least one of them, is taken
    to describe the things by class.
    """
    problems = []
    for field in request.fields:
        kind = request.kinds.get(field.parameter or "")
        if not field.kind_of or kind is None:
            continue
        for file in (f.file for f in request.fields if f.file is not None):
            described = _topmost(file)
            if not any(kind in ontology.superclasses.get(name, ()) for name in described):
                continue
            for thing in ontology.individuals(kind):
                if (own := ontology.kind_of(thing)) not in described:
                    told = f"is of the class {own}, of which {request.name} finds nothing in {file.name}"
                    problems.append(
                        ontology.problem("KB135", thing, f"{told}; add an entry {own} there, as for the others")
                    )
    return problems


def _topmost(file: Path) -> frozenset[str]:
    """The names at the top of a YAML file; none of one that is no such file, which its service will complain of."""
    try:
        content: Any = yaml.safe_load(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        return frozenset()
    return frozenset(map(str, content)) if isinstance(content, dict) else frozenset()
