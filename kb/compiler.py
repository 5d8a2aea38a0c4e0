"""OWL-S style processes -> Golog: facts and procedures as terms for the planner.

A composite process becomes one `definition(Revision, Head, Frame, Body)`; kb/constructs.py makes the body.
Frame stands for the invocation. What else is known of processes and individuals becomes facts of
kb/rules/facts.pl.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from kb.constructs import MS_PER_S, Constructs, head
from kb.learned_values import LearnedValue, learned_values, one_try
from kb.ontology import Ontology, fluent_properties
from kb.problems import Problem, errors, reject_errors
from kb.processes import Process, Role
from kb.recursion import endless, least, recursive
from kb.scope import variable
from kb.soundness import refuse_unsound
from kb.terms import Struct, Term, Var, render, struct
from kb.vocabulary import Kind, Property


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """A task type as a Golog program: its own procedure and all that it calls.

    Attributes:
        name: The process that accomplishes the task.
        definitions: Every procedure as `proc(Head, Body)`, callers first.
    """

    name: str
    definitions: tuple[Term, ...]

    @property
    def text(self) -> str:
        """The program as Prolog text, one procedure a line."""
        return "\n".join(f"{render(d)}." for d in self.definitions)


class Compiler:
    """Compiles the processes of one ontology."""

    def __init__(self, ontology: Ontology, processes: Mapping[str, Process]) -> None:
        self._ontology = ontology
        self._processes = processes
        self._constructs = Constructs(ontology, processes)
        self._bodies: dict[str, Term] = {}

    def facts(self, revision: int) -> list[Term]:
        """Everything that the planner needs, as facts of kb/rules/facts.pl, sorted but for the robots of a process.

        Raises:
            OntologyRejected: A process cannot be compiled, or would not end.
        """
        facts = [*self._compiled(revision)]
        facts += self._individuals(revision)  # of those, too, that the conditions ask for
        facts += self._learned(revision)
        facts += (struct("recursive", revision, name) for name in recursive(self._bodies))
        for name, told in endless(self._bodies).items():
            self._constructs.problem("KB210", name, told)
        if not errors(self._constructs.problems):
            refuse_unsound(self._ontology, self._processes, self._bodies, _preconditions(facts), self._constructs)
        reject_errors(self._constructs.problems)
        return sorted([*facts, *self._requirements(revision)], key=_place_in_order)

    @property
    def warnings(self) -> list[Problem]:
        """What compiles and is probably not meant; after `facts`."""
        return self._constructs.problems

    def program(self, name: str) -> Program:
        """The program of a task type; after `facts`."""
        order = [name]
        for caller in order:
            order.extend(c for c in self._constructs.calls.get(caller, ()) if c not in order)
        definitions: list[Term] = [
            struct("proc", head(self._processes[n]), self._bodies[n]) for n in order if n in self._bodies
        ]
        return Program(name=name, definitions=tuple(definitions))

    # Individuals and their values

    def _individuals(self, revision: int) -> Iterator[Term]:
        fluents = fluent_properties(self._ontology)
        kinds = {Kind.ROBOT, Kind.AREA, Kind.LOCATION, Kind.PHYSICAL_OBJECT}
        named = kinds | {p.kind for process in self._processes.values() for p in process.parameters if not p.is_datum}
        kinds_of = self._ontology.kinds.items()
        things = {name for name, own in kinds_of if own & named or self._constructs.asked_of(name)}
        for name in things:
            for kind in self._ontology.kinds[name]:
                yield struct("kind", revision, name, kind)
        for prop, subject, value in self._ontology.all_values():
            if subject in things:
                yield struct("fluent" if prop in fluents else "value", revision, prop, subject, value)

    # Processes

    def _compiled(self, revision: int) -> Iterator[Term]:
        for name, process in sorted(self._processes.items()):
            for robot in process.robots:
                yield struct("agent", revision, head(process), variable(robot))
            for parameter in process.arguments:
                if not parameter.is_datum:
                    yield struct("parameter", revision, head(process), variable(parameter), parameter.kind)
            if not process.is_atomic:
                self._bodies[name] = self._constructs.body(process)
                yield struct("definition", revision, head(process), Var("Frame"), self._bodies[name])
            if self._ontology.value(Property.KEEPS_ROBOT, name) is True:
                yield struct("keeps_robot", revision, name)
            yield from self._claims(revision, process)
            yield from self._conditions(revision, process)
            yield from self._duration(revision, process)

    def _claims(self, revision: int, process: Process) -> Iterator[Term]:
        inputs = {p.entity: p for p in process.parameters if p.role is Role.INPUT and not p.is_datum}
        for entity in self._constructs.parts(process.name, Property.CLAIMS_PARAMETER):
            if entity in inputs:
                yield struct("claims", revision, head(process), variable(inputs[entity]))
            else:
                told = f"claims {entity}, which is no input of it that names an individual; claim what it is given"
                self._constructs.problem("KB128", process.name, told)

    def _conditions(self, revision: int, process: Process) -> Iterator[Term]:
        scope = self._constructs.scope(process)
        for entity in self._constructs.parts(process.name, Property.HAS_PRECONDITION):
            yield struct("precondition", revision, head(process), self._constructs.condition(scope, entity))
        for entity in self._constructs.parts(process.name, Property.HAS_EFFECT):
            fluent = struct("fluent", self._constructs.part(entity, Property.OF_PROPERTY), scope.subject(entity))
            yield struct("effect", revision, head(process), fluent, scope.object(entity))

    def _duration(self, revision: int, process: Process) -> Iterator[Term]:
        seconds = self._ontology.value(Property.DURATION_S, process.name)
        milliseconds = round(float(seconds) * MS_PER_S) if isinstance(seconds, int | float) else 0
        model = self._ontology.value(Property.HAS_DURATION_MODEL, process.name)
        if process.is_atomic:
            yield struct("duration", revision, head(process), struct("fixed", milliseconds))
        elif model is not None:
            yield self._travel(revision, process, str(model), milliseconds)
        odds = self._ontology.value(Property.SUCCESS_ODDS, process.name)
        if odds is not None and (process.is_atomic or model is not None):
            yield struct("odds", revision, process.name, odds)
        elif odds is not None:
            told = "has successOdds, but is not one step: give them to what it performs, or give it a hasDurationModel"
            self._constructs.problem("KB164", process.name, told)

    def _travel(self, revision: int, process: Process, model: str, milliseconds: int) -> Term:
        scope = self._constructs.scope(process)
        traveling = self._constructs.part(model, Property.TRAVELING_ROBOT)
        if process.robot is not None and traveling in {p.entity for p in process.robots[1:]}:
            told = f"has {traveling} travel, but of the robots of {process.name} the first is {process.robot.entity}"
            self._constructs.problem("KB161", model, f"{told}; exchange their parameterNumbers")
        robot = scope.term(traveling, model)
        goal = scope.term(self._constructs.part(model, Property.TRAVEL_GOAL), model)
        return struct("duration", revision, head(process), struct("travel", robot, goal, milliseconds))

    # What was learned of single robots

    def _learned(self, revision: int) -> Iterator[Term]:
        """Each with both numbers: what was not learned of a robot at a place is the robot's, or the process's."""
        with_places = set()
        for (name, robot), values in learned_values(self._ontology).items():
            self._check_learned(name, values)
            for value in values:
                seconds, odds = one_try(self._ontology, name, values, value.place)
                where = struct("at", value.place) if value.place else "anywhere"
                yield struct("learned", revision, name, robot, where, round(seconds * MS_PER_S), odds)
                with_places |= {name} if value.place else set()
        for name in with_places & self._processes.keys():
            process = self._processes[name]
            if process.place is not None:
                yield struct("takes_place", revision, head(process), variable(process.place))

    def _check_learned(self, name: str, values: Sequence[LearnedValue]) -> None:
        process = self._processes.get(name)
        has_model = self._ontology.value(Property.HAS_DURATION_MODEL, name) is not None
        if process is None or not process.robots or not (process.is_atomic or has_model):
            told = f"is of {name}, which is not one step of a robot; learn of what it performs"
            self._constructs.problem("KB167", values[0].entity, told)
        for first, other in pairwise(values):
            if other.place == first.place:
                told = f"is of the same process, robot and place as {first.entity}; keep one"
                self._constructs.problem("KB167", other.entity, told)

    # What a process requires of its robots

    def _requirements(self, revision: int) -> Iterator[Term]:
        for name, capabilities in least(self._processes, frozenset[str](), self._capabilities).items():
            for capability in capabilities:
                yield struct("requires", revision, name, capability)

    def _capabilities(self, name: str, known: Mapping[str, frozenset[str]]) -> frozenset[str]:
        """What each robot of a process must be: by its own statement, by its parameter's class, by what it performs.

        Where several robots do a process, what follows from parameters and steps is asked of all only as far as it
        is the same for all; the steps ask again.

        Args:
            known: The same of what it performs.
        """
        own = frozenset(self._constructs.parts(name, Property.REQUIRES_CAPABILITY))
        body = self._bodies.get(name, [])
        each = [
            self._asked_of(body, variable(robot), known) | {robot.kind} - {Kind.ROBOT}
            for robot in self._processes[name].robots
        ]
        return own | (frozenset.intersection(*each) if each else frozenset())

    def _asked_of(self, body: Term, robot: Term, known: Mapping[str, frozenset[str]]) -> frozenset[str]:
        """What a program asks of a robot: all that it may come to, but of a choice what all branches ask."""
        match body:
            case Struct("call", (_, _, Struct(callee, arguments))):
                passed = zip(self._processes[callee].arguments, arguments, strict=True)
                does = any(parameter.role is Role.ROBOT and argument == robot for parameter, argument in passed)
                return known[callee] if does else frozenset()
            case Struct("choice", (_, _, list(branches))):
                return frozenset.intersection(*(self._asked_of(b, robot, known) for b in branches))
            case Struct("star"):
                return frozenset()  # it may be done no time
            case Struct(_, arguments):
                return frozenset[str]().union(*(self._asked_of(a, robot, known) for a in arguments))
            case list():
                return frozenset[str]().union(*(self._asked_of(a, robot, known) for a in body))
            case _:
                return frozenset()


def _preconditions(facts: list[Term]) -> dict[str, list[Term]]:
    """What must hold so that a process can start, by its name."""
    found: dict[str, list[Term]] = {}
    for fact in facts:
        match fact:
            case Struct("precondition", (_, Struct(name) | str(name), condition)):
                found.setdefault(name, []).append(condition)
            case _:
                pass
    return found


def _place_in_order(fact: Term) -> str:
    """Robots of one process stay as they are, in the order of their parameters."""
    match fact:
        case Struct("agent", (revision, process, _)):
            return render(struct("agent", revision, process))
        case _:
            return render(fact)
