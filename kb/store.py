"""The knowledge base: loaded whole or not at all, asked, told.

Files are read, checked, reasoned over and compiled before anything is replaced. What changes while
robots work (fluents) is told to the store; it reaches the planner as single facts and never the
reasoner.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from kb import validation
from kb.compiler import Compiler, Program
from kb.errors import KnowledgeError
from kb.files import SHIPPED, read_files
from kb.groundings import Field, Grounding, TravelEstimate, read_groundings, read_travel_estimates
from kb.ontology import Ontology, Value, close, fluent_properties
from kb.problems import OntologyRejected, Problem
from kb.processes import Process, read_processes
from kb.prolog import Entry
from kb.reasoner import classify
from kb.terms import struct
from kb.vocabulary import Kind, Property

_load_facts = Entry(search_path="kb_rules", file="facts", name="load_facts")
_drop_facts = Entry(search_path="kb_rules", file="facts", name="drop_facts")
_tell = Entry(search_path="kb_rules", file="facts", name="tell")
_revisions = itertools.count(1)
_POSITIVE = (
    Property.RADIUS_M,
    Property.MAX_VEL_LIN_MPS,
    Property.MAX_VEL_ANG_RADPS,
    Property.ENERGY_J,
    Property.POWER_W,
)


class UnknownSite(KnowledgeError, LookupError):
    """There is no site of this name.

    Attributes:
        site: What was asked for.
        known: The sites there are.
    """

    def __init__(self, site: str, known: list[str], folder: Path) -> None:
        self.site, self.known = site, known
        super().__init__(f"no site {site!r} in {folder / 'sites'}; there is {', '.join(known) or 'none'}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """What was known at one moment; it does not change.

    Attributes:
        revision: Number of the loaded files.
        state: How many facts had been told since.
        fluents: Values of what changes, by (property, subject).
    """

    revision: int
    state: int
    site: str
    ontology: Ontology
    processes: Mapping[str, Process]
    groundings: Mapping[str, Grounding]
    travel_estimates: tuple[TravelEstimate, ...]
    fluents: Mapping[tuple[str, str], Value]
    compiler: Compiler

    def value(self, prop: str, subject: str) -> Value | None:
        """The value of a property, told last or stated in files."""
        told = self.fluents.get((prop, subject))
        return told if told is not None else self.ontology.value(prop, subject)

    def program(self, process: str) -> Program:
        """The Golog program of a task type."""
        return self.compiler.program(process)


class KnowledgeBase:
    """The knowledge of one fleet; the only writer of facts."""

    def __init__(self, site: str, folder: Path = SHIPPED) -> None:
        """Load a site and all that it imports from a folder of ontologies.

        Raises:
            UnknownSite: The folder has no such site.
            OntologyRejected: The files are wrong; nothing was loaded.
        """
        known = sorted(p.parent.name for p in folder.glob("sites/*/*.owl") if p.stem == p.parent.name)
        if site not in known:
            raise UnknownSite(site, known, folder)
        path = folder / "sites" / site / f"{site}.owl"
        self._site = site
        self._ontology = load(path, folder)
        self._processes = read_processes(self._ontology)
        self._groundings = read_groundings(self._ontology, self._processes, path.parent)
        estimates = read_travel_estimates(self._ontology, path.parent)
        _require_one_estimate(self._ontology, estimates)
        self._travel_estimates = tuple(sorted(set(estimates.values()), key=str))
        requests = {g.name: g.request for g in self._groundings.values()} | {n: e.request for n, e in estimates.items()}
        robots = {g.name: {p.name for p in self._processes[g.process].robots} for g in self._groundings.values()}
        robots |= {n: {self._traveling_robot(n)} for n in estimates}
        _require_values(self._ontology, requests, robots)
        self._compiler = Compiler(self._ontology, self._processes)
        self._revision = next(_revisions)
        _load_facts(list(self._compiler.facts(self._revision)))
        names = fluent_properties(self._ontology)
        self._fluents = {(p, s): v for p, s, v in self._ontology.all_values() if p in names}
        self._state = 0

    def _traveling_robot(self, duration: str) -> str:
        """The name of the parameter that a travel duration is about."""
        parameter = self._ontology.value(Property.TRAVELING_ROBOT, duration)
        return str(self._ontology.value(Property.PARAMETER_NAME, str(parameter)))

    def snapshot(self) -> Snapshot:
        """What is known now."""
        return Snapshot(
            revision=self._revision,
            state=self._state,
            site=self._site,
            ontology=self._ontology,
            processes=MappingProxyType(self._processes),
            groundings=MappingProxyType(self._groundings),
            travel_estimates=self._travel_estimates,
            fluents=MappingProxyType(dict(self._fluents)),
            compiler=self._compiler,
        )

    def tell(self, prop: str, subject: str, value: Value) -> None:
        """From now on, a property of an individual has this value."""
        self._fluents[prop, subject] = value
        self._state += 1
        _tell(struct("fluent", self._revision, prop, subject, value))

    def close(self) -> None:
        """Forget the facts."""
        _drop_facts(self._revision)


def load(path: Path, folder: Path) -> Ontology:
    """Read, check and classify an ontology file and its imports.

    Raises:
        OntologyRejected: With everything that is wrong.
    """
    files = read_files(path, folder)
    problems = validation.check(files)
    if problems:
        raise OntologyRejected(problems)
    return close(files, classify(files))


def _require_one_estimate(ontology: Ontology, estimates: Mapping[str, TravelEstimate]) -> None:
    """All travel durations must be estimated in the same way; estimates by the name of the duration model."""
    names = sorted(estimates)
    problems = [
        ontology.problem(
            "KB162",
            name,
            f"names another service or other fields than {names[0]}; "
            "only one way to estimate travel is supported, so give both the same",
        )
        for name in names
        if estimates[name] != estimates[names[0]]
    ]
    if problems:
        raise OntologyRejected(problems)


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


def _require_values(
    ontology: Ontology, requests: Mapping[str, tuple[Field, ...]], robots: Mapping[str, set[str]]
) -> None:
    """Robots must state what requests say of them, and what can be; files must be there.

    Args:
        requests: By who makes them.
        robots: The names of those of their parameters that stand for robots.
    """
    problems: list[Problem] = []
    for name, request in requests.items():
        for field in request:
            if field.file is not None and not field.file.exists():
                problems.append(ontology.problem("KB125", name, f"names the file {field.file}, which does not exist"))
    if problems:
        raise OntologyRejected(problems)
    problems = _no_room(ontology)
    for robot in ontology.individuals(Kind.ROBOT):
        problems += [*_not_positive(ontology, robot), *_half_a_battery(ontology, robot)]
        for name, request in requests.items():
            for field in request:
                lacks = (
                    field.of_property
                    and field.parameter in robots[name]
                    and ontology.value(field.of_property, robot) is None
                )
                if lacks:
                    kind = ontology.kind_of(robot)
                    problems.append(
                        ontology.problem(
                            "KB131",
                            robot,
                            f"has no {field.of_property}, which {name} needs; "
                            f"give the class {kind} `SubClassOf: {field.of_property} value ...`",
                        )
                    )
    if problems:
        raise OntologyRejected(set(problems))
