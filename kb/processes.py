"""What can be done: the signatures of processes, as the ontology declares them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from kb.ontology import Ontology
from kb.problems import OntologyRejected, Problem
from kb.vocabulary import Kind, Property


class Role(StrEnum):
    """What a parameter is to its process."""

    ROBOT = "robot"
    INPUT = "input"
    OUTPUT = "output"
    LOCAL = "local"


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A parameter of one process.

    Attributes:
        entity: Its individual in the ontology.
        kind: The class of its values.
        is_datum: Values are messages, not individuals.
        is_place: Values are locations.
    """

    entity: str
    name: str
    role: Role
    kind: str
    is_datum: bool
    is_place: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Process:
    """A process and its parameters, in the order of their numbers.

    Attributes:
        is_atomic: One primitive action; else a composite process, or a task type that others realize.
    """

    name: str
    is_atomic: bool
    parameters: tuple[Parameter, ...]

    @property
    def arguments(self) -> tuple[Parameter, ...]:
        """All parameters but locals: what a call passes."""
        return tuple(p for p in self.parameters if p.role is not Role.LOCAL)

    @property
    def inputs(self) -> tuple[Parameter, ...]:
        """What a caller must give."""
        return tuple(p for p in self.parameters if p.role in (Role.ROBOT, Role.INPUT))

    @property
    def outputs(self) -> tuple[Parameter, ...]:
        """What a caller gets."""
        return tuple(p for p in self.parameters if p.role is Role.OUTPUT)

    @property
    def robots(self) -> tuple[Parameter, ...]:
        """The parameters that name the robots which do the process together; the first is the one that travels."""
        return tuple(p for p in self.parameters if p.role is Role.ROBOT)

    @property
    def robot(self) -> Parameter | None:
        """The parameter that names the robot which does the process, or the first of several."""
        return next(iter(self.robots), None)

    @property
    def place(self) -> Parameter | None:
        """The parameter that names where the process leads to or takes place: the last location that it is given."""
        return next((p for p in reversed(self.inputs) if p.is_place), None)

    def parameter(self, name: str) -> Parameter | None:
        """The parameter of this name."""
        return next((p for p in self.parameters if p.name == name), None)


def read_processes(ontology: Ontology) -> dict[str, Process]:
    """All processes by name.

    Raises:
        OntologyRejected: A process has two parameters of one name.
    """
    problems: list[Problem] = []
    processes = {}
    for kind in (Kind.ATOMIC_PROCESS, Kind.COMPOSITE_PROCESS, Kind.SIMPLE_PROCESS):
        for name in ontology.individuals(kind):
            process = Process(
                name=name,
                is_atomic=kind is Kind.ATOMIC_PROCESS,
                parameters=_parameters(ontology, name),
            )
            processes[name] = process
            names = [p.name for p in process.parameters]
            for twice in sorted({n for n in names if names.count(n) > 1}):
                problems.append(ontology.problem("KB111", name, f"has two parameters named {twice!r}; rename one"))
    if problems:
        raise OntologyRejected(problems)
    return processes


def realizing(ontology: Ontology, task: str) -> list[str]:
    """The processes that accomplish a task type, by name; not those that are retired."""
    kinds = (Kind.ATOMIC_PROCESS, Kind.COMPOSITE_PROCESS, Kind.SIMPLE_PROCESS)
    return [
        name
        for name in sorted({name for kind in kinds for name in ontology.individuals(kind)})
        if task in ontology.values(Property.REALIZES, name) and ontology.value(Property.RETIRED, name) is not True
    ]


def _parameters(ontology: Ontology, process: str) -> tuple[Parameter, ...]:
    found: list[tuple[int, Parameter]] = []
    for prop, role in (
        (Property.HAS_INPUT, Role.INPUT),
        (Property.HAS_OUTPUT, Role.OUTPUT),
        (Property.HAS_LOCAL, Role.LOCAL),
    ):
        for entity in map(str, ontology.values(prop, process)):
            kind = str(ontology.value(Property.PARAMETER_TYPE, entity))
            number = ontology.value(Property.PARAMETER_NUMBER, entity)
            parameter = Parameter(
                entity=entity,
                name=str(ontology.value(Property.PARAMETER_NAME, entity)),
                role=Role.ROBOT if ontology.is_a(entity, Kind.ROBOT_PARAMETER) else role,
                kind=kind,
                is_datum=ontology.is_datum(kind),
                is_place=Kind.LOCATION in ontology.superclasses.get(kind, frozenset({kind})),
            )
            found.append((number if isinstance(number, int) else 0, parameter))
    return tuple(p for _, p in sorted(found, key=lambda pair: (pair[0], pair[1].name)))
