"""Which robot can take part in which task; if not, exactly what is missing.

A robot takes part in a task in a *role*: as one of its robot parameters, or, where it has none, as what a pick
within it may choose. What a role asks of the robot follows from all that it comes to: of a choice, one branch will
do; what is done any number of times may be done no time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

from kb.constructs import Constructs
from kb.derivation import Derivation
from kb.holding import held
from kb.names import UnknownName
from kb.ontology import Ontology
from kb.processes import Parameter, Process, Role
from kb.recursion import called
from kb.scope import variable
from kb.store import Snapshot
from kb.terms import Struct, Term, Var
from kb.vocabulary import Kind, Property
from kb.wording import condition_text, variable_names


class Verdict(StrEnum):
    """Whether a robot can take part."""

    ABLE = "able"
    NOT_NOW = "not now"
    """It has what it takes, but something does not hold at present."""
    UNABLE = "unable"
    """It lacks a capability, or more energy than it can have."""


class LackKind(StrEnum):
    """What sort of thing is missing."""

    CAPABILITY = "capability"
    BATTERY = "battery"
    PLACE = "place"
    """It is not known where the robot is."""
    CONDITION = "condition"
    INDIVIDUAL = "individual"
    """There is nothing that an input could be."""


_LASTING = (LackKind.CAPABILITY, LackKind.BATTERY)


@dataclass(frozen=True, slots=True, kw_only=True)
class Lack:
    """One thing that is missing.

    Attributes:
        what: The capability, the condition, the class.
        processes: Who asks for it, outermost first.
        text: A sentence.
    """

    kind: LackKind
    what: str
    processes: tuple[str, ...]
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Readiness:
    """Whether one robot, or the robots of one class, can take part in one task.

    Attributes:
        who: A robot, or a class of robots.
        is_class: Which of the two; of a class nothing is said that depends on where a robot is or what holds.
        role: The parameter for which it would stand; empty if the task needs no robot.
        requires: The capabilities that are asked for, each with the processes that ask.
        lacks: What is missing; none if it is able.
        through: The recipes or branches by which it is able, where there is a choice between processes.
    """

    who: str
    is_class: bool
    task: str
    role: str
    verdict: Verdict
    requires: Mapping[str, tuple[str, ...]]
    lacks: tuple[Lack, ...]
    through: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskRole:
    """What a robot may be to a task.

    Attributes:
        parameter: Of `process`, which is the task, or has the pick.
        program: What is done with the robot; None for all that the process is.
    """

    process: str
    parameter: Parameter
    program: Term | None


def readiness(snapshot: Snapshot, who: str, task: str) -> Readiness:
    """Whether a robot, or a class of robots, can take part in a task; in the role that it lacks least for.

    Raises:
        UnknownName: There is no such robot and no such class of robots, or no such process.
    """
    [found] = matrix(snapshot, [who], [task])
    return found


def matrix(snapshot: Snapshot, who: Iterable[str], tasks: Iterable[str]) -> tuple[Readiness, ...]:
    """Of all of these for all of these tasks, by robot, then task."""
    names, derivation = list(tasks), Derivation(snapshot.ontology)
    constructs = Constructs(snapshot.ontology, snapshot.processes)
    return tuple(_readiness(snapshot, derivation, constructs, robot, task) for robot in who for task in names)


def _readiness(snapshot: Snapshot, derivation: Derivation, constructs: Constructs, who: str, task: str) -> Readiness:
    if task not in snapshot.processes:
        raise UnknownName(task, "process", snapshot.processes)
    is_class = not snapshot.ontology.is_a(who, Kind.ROBOT)
    if is_class and who not in derivation.models():
        raise UnknownName(who, "robot", [*snapshot.ontology.individuals(Kind.ROBOT), *derivation.models()])
    asking = _Asking(snapshot, derivation, constructs, who, is_class=is_class, task=task)
    found = [asking.in_role(role) for role in roles(snapshot, task)] or [asking.in_no_role()]
    return min(found, key=lambda r: (list(Verdict).index(r.verdict), len(r.lacks)))


def robot_classes(snapshot: Snapshot) -> list[str]:
    """The classes of robots that are models, such as Pico, not capabilities; by name."""
    return Derivation(snapshot.ontology).models()


def roles(snapshot: Snapshot, task: str) -> tuple[TaskRole, ...]:
    """What robots may be to a task; nothing if it needs none."""
    process = snapshot.processes[task]
    if process.robots:
        return tuple(TaskRole(process=task, parameter=p, program=None) for p in process.robots)
    return tuple(role for name, body in bodies(snapshot, task) for role in _picked(snapshot, name, body))


def bodies(snapshot: Snapshot, task: str) -> Iterator[tuple[str, Term]]:
    """The programs of a task and of all that it calls, by name; callers first."""
    for definition in snapshot.program(task).definitions:
        match definition:
            case Struct("proc", (Struct(name) | str(name), body)):
                yield name, body
            case _:
                raise AssertionError(definition)


def _picked(snapshot: Snapshot, name: str, program: Term) -> Iterator[TaskRole]:
    """The variables over robots that a program chooses itself."""
    own = {variable(p): p for p in snapshot.processes[name].parameters}
    superclasses = snapshot.ontology.superclasses
    for variables, body in _bindings(program):
        for bound in variables:
            parameter = own.get(bound)
            if parameter is not None and Kind.ROBOT in superclasses.get(parameter.kind, {parameter.kind}):
                yield TaskRole(process=name, parameter=parameter, program=body)


def _bindings(program: Term) -> Iterator[tuple[list[Var], Term]]:
    match program:
        case Struct("pick", (_, _, Var() as bound, _, body)):
            yield [bound], body
        case Struct("foreach" | "interrupt", (_, _, list(typed), _, *_, body)):
            yield [v for t in typed if isinstance(t, Struct) for v in t.args if isinstance(v, Var)], body
        case _:
            pass
    match program:
        case Struct(_, parts) | list(parts):
            for part in parts:
                yield from _bindings(part)
        case _:
            pass


@dataclass(frozen=True, slots=True, kw_only=True)
class _Needs:
    """What a part of a task asks of a robot."""

    requires: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    lacks: tuple[Lack, ...] = ()
    through: tuple[str, ...] = ()

    def __or__(self, other: _Needs) -> _Needs:
        requires = dict(self.requires)
        for capability, processes in other.requires.items():
            requires[capability] = tuple(dict.fromkeys((*requires.get(capability, ()), *processes)))
        lacks = {(lack.kind, lack.what): lack for lack in self.lacks}
        for lack in other.lacks:
            known = lacks.get((lack.kind, lack.what), lack)
            processes = tuple(dict.fromkeys((*known.processes, *lack.processes)))
            lacks[lack.kind, lack.what] = replace(known, processes=processes)
        through = tuple(dict.fromkeys((*self.through, *other.through)))
        return _Needs(requires=requires, lacks=tuple(lacks.values()), through=through)


class _Asking:
    """One robot, or class of robots, and one task."""

    def __init__(
        self,
        snapshot: Snapshot,
        derivation: Derivation,
        constructs: Constructs,
        who: str,
        *,
        is_class: bool,
        task: str,
    ) -> None:
        self._snapshot = snapshot
        self._ontology: Ontology = snapshot.ontology
        self._who, self._is_class, self._task = who, is_class, task
        self._derivation, self._constructs = derivation, constructs
        self._kinds = self._derivation.kinds(who)
        self._bodies = dict(bodies(snapshot, task))
        self._changed = {
            str(self._ontology.value(Property.OF_PROPERTY, str(effect)))
            for name in self._called()
            for effect in self._ontology.values(Property.HAS_EFFECT, name)
        }

    def in_role(self, role: TaskRole) -> Readiness:
        """As one of its robots."""
        process = self._snapshot.processes[role.process]
        if role.program is None:
            needs, program = self._process(process, role.parameter, ()), self._bodies.get(process.name)
        else:
            needs, program = self._of_kind(process, role.parameter.kind), role.program
            needs |= self._program(role.program, variable(role.parameter), ())
        needs |= _Needs(lacks=(*self._individuals(), *self._battery(process, role.parameter, program)))
        return self._readiness(role.parameter.name, needs)

    def in_no_role(self) -> Readiness:
        """Of a task that needs no robot."""
        return self._readiness("", _Needs(lacks=tuple(self._individuals())))

    def _readiness(self, role: str, needs: _Needs) -> Readiness:
        verdict = Verdict.NOT_NOW if needs.lacks else Verdict.ABLE
        if any(lack.kind in _LASTING for lack in needs.lacks):
            verdict = Verdict.UNABLE
        return Readiness(
            who=self._who,
            is_class=self._is_class,
            task=self._task,
            role=role,
            verdict=verdict,
            requires=needs.requires,
            lacks=needs.lacks,
            through=needs.through,
        )

    # What is asked

    def _process(self, process: Process, parameter: Parameter, around: tuple[Parameter, ...]) -> _Needs:
        """By a process of the robot that stands for one of its parameters.

        Args:
            around: What the robot stands for already where this is performed: a process that performs itself asks no
                more the second time.
        """
        if parameter in around:
            return _Needs()
        needs = self._of_kind(process, parameter.kind)
        for capability in self._ontology.values(Property.REQUIRES_CAPABILITY, process.name):
            needs |= self._of_kind(process, str(capability))
        needs |= _Needs(lacks=(*self._conditions(process, parameter), *self._place(process, parameter)))
        body = self._bodies.get(process.name)
        return needs if body is None else needs | self._program(body, variable(parameter), (*around, parameter))

    def _program(self, program: Term, robot: Var, around: tuple[Parameter, ...]) -> _Needs:
        match program:
            case Struct("call", (_, _, Struct(callee, arguments))):
                process, needs = self._snapshot.processes[callee], _Needs()
                for parameter, argument in zip(process.arguments, arguments, strict=True):
                    if parameter.role is Role.ROBOT and argument == robot:
                        needs |= self._process(process, parameter, around)
                return needs
            case Struct("choice", (_, _, list(branches))):
                found = [(self._program(b, robot, around), b) for b in branches]
                least = min(len(needs.lacks) for needs, _ in found)
                best = [(needs, b) for needs, b in found if len(needs.lacks) == least]
                names = tuple(name for _, b in best if (name := _called_by(b)))
                return replace(best[0][0], through=(*names, *best[0][0].through))
            case Struct("star"):
                return _Needs()  # it may be done no time
            case Struct(_, parts) | list(parts):
                needs = _Needs()
                for part in parts:
                    needs |= self._program(part, robot, around)
                return needs
            case _:
                return _Needs()

    def _of_kind(self, process: Process, kind: str) -> _Needs:
        if kind == Kind.ROBOT:
            return _Needs()
        requires = {kind: (process.name,)}
        if kind in self._kinds:
            return _Needs(requires=requires)
        means = self._ontology.definition(kind)
        told = f"it is no {kind}" + (f" ({means})" if means else "")
        lack = Lack(kind=LackKind.CAPABILITY, what=kind, processes=(process.name,), text=told)
        return _Needs(requires=requires, lacks=(lack,))

    def _conditions(self, process: Process, parameter: Parameter) -> Iterator[Lack]:
        """Preconditions that no individuals satisfy now, unless a step of the task may change that before."""
        if self._is_class:
            return
        for entity in map(str, self._ontology.values(Property.HAS_PRECONDITION, process.name)):
            condition = self._constructs.condition(self._constructs.scope(process), entity)
            if process.name != self._task and self._changed & set(_properties(condition)):
                continue
            found = held(self._snapshot, process, condition, {parameter.name: self._who})
            if found.holds is False:
                text = condition_text(condition, variable_names(process))
                told = f"nothing fits {text} now"
                if found.values:
                    told = f"{'; '.join(found.values)}, but {text} has to hold"
                yield Lack(kind=LackKind.CONDITION, what=text, processes=(process.name,), text=told)

    def _place(self, process: Process, parameter: Parameter) -> Iterator[Lack]:
        model = self._ontology.value(Property.HAS_DURATION_MODEL, process.name)
        travels = model is not None and self._ontology.value(Property.TRAVELING_ROBOT, str(model)) == parameter.entity
        if travels and not self._is_class and self._snapshot.value(Property.LOCATED_AT, self._who) is None:
            told = "it is not known where it is: give it a locatedAt"
            yield Lack(kind=LackKind.PLACE, what=Property.LOCATED_AT, processes=(process.name,), text=told)

    def _individuals(self) -> Iterator[Lack]:
        """What an input of the task could be does not exist."""
        for parameter in self._snapshot.processes[self._task].inputs:
            is_wanted = parameter.role is Role.INPUT and not parameter.is_datum
            if is_wanted and not self._ontology.individuals(parameter.kind):
                told = f"there is no {parameter.kind} for {parameter.name}"
                yield Lack(kind=LackKind.INDIVIDUAL, what=parameter.kind, processes=(self._task,), text=told)

    def _battery(self, process: Process, parameter: Parameter, program: Term | None) -> Iterator[Lack]:
        energy_j = self._derivation.number(Property.ENERGY_J, self._who)
        power_w = self._derivation.number(Property.POWER_W, self._who)
        if energy_j is None or power_w is None:
            return
        least_s = self._least_s(program, variable(parameter), ()) if program is not None else self._duration_s(process)
        if least_s > energy_j / power_w:
            told = f"it takes {least_s:g} s of work at least, and the battery lasts for {energy_j / power_w:g} s"
            yield Lack(kind=LackKind.BATTERY, what=Property.ENERGY_J, processes=(process.name,), text=told)

    def _least_s(self, program: Term, robot: Var, around: tuple[Parameter, ...]) -> float:
        """How long a robot works at least, travel apart; what performs itself once more, not at all."""
        match program:
            case Struct("call", (_, _, Struct(callee, arguments))):
                process = self._snapshot.processes[callee]
                for parameter, argument in zip(process.arguments, arguments, strict=True):
                    if parameter.role is Role.ROBOT and argument == robot:
                        one_step = self._ontology.value(Property.HAS_DURATION_MODEL, callee) is not None
                        body = None if one_step else self._bodies.get(callee)
                        if body is None:
                            return self._duration_s(process)
                        within = (*around, parameter)
                        return 0.0 if parameter in around else self._least_s(body, variable(parameter), within)
                return 0.0
            case Struct("choice", (_, _, list(branches))):
                return min((self._least_s(b, robot, around) for b in branches), default=0.0)
            case Struct("if", (_, then, otherwise)):
                return min(self._least_s(then, robot, around), self._least_s(otherwise, robot, around))
            case Struct("star" | "while" | "foreach" | "interrupt"):
                return 0.0  # it may be done no time
            case Struct(_, parts) | list(parts):
                return sum(self._least_s(part, robot, around) for part in parts)
            case _:
                return 0.0

    def _duration_s(self, process: Process) -> float:
        value = self._ontology.value(Property.DURATION_S, process.name)
        return float(value) if isinstance(value, int | float) else 0.0

    def _called(self) -> set[str]:
        """The task and all that it may come to."""
        found = {self._task}
        for body in self._bodies.values():
            found.update(called(body))
        return found


def _called_by(program: Term) -> str:
    match program:
        case Struct("call", (_, _, Struct(name) | str(name))):
            return name
        case _:
            return ""


def _properties(condition: Term) -> Iterator[str]:
    """The properties that a condition asks for."""
    match condition:
        case Struct("holds" | "value", (str(prop), *_)):
            yield prop
        case Struct(_, parts) | list(parts):
            for part in parts:
                yield from _properties(part)
        case _:
            pass
