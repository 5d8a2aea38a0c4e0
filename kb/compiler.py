"""OWL-S style processes -> Golog: facts and procedures as terms for the planner.

A composite process becomes one `definition(Revision, Head, Frame, Body)`. Frame stands for the
invocation. Parameters that are individuals become logical variables; locals that are data become
places `loc(Frame, Name)`, written by the step that outputs them and read by later ones. The constructs
map one to one (the Golog side is documented in planner/golog/syntax.pl):

    Sequence [P, ...]   SplitJoin conc([P, ...])   Choice choice(Frame, Step, [P, ...])
    IfThenElse if(C, P, Q)   RepeatWhile while(C, P)   RepeatUntil until(P, C)
    ForEach foreach(Frame, Step, [Var-Class, ...], C, Inner, P)   Pick pick(Frame, Step, Var, Class, P)
    Perform call(Frame, Step, Head)
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from kb.ontology import Ontology, fluent_properties
from kb.problems import OntologyRejected, Problem
from kb.processes import Parameter, Process, Role
from kb.terms import Struct, Term, Var, render, struct
from kb.vocabulary import Kind, Property

MS_PER_S = 1000


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
        self._problems: list[Problem] = []
        self._bodies: dict[str, Term] = {}
        self._calls: dict[str, list[str]] = {}

    def facts(self, revision: int) -> list[Term]:
        """Everything that the planner needs, as facts of kb/rules/facts.pl, sorted.

        Raises:
            OntologyRejected: A process cannot be compiled.
        """
        facts = [*self._individuals(revision), *self._compiled(revision)]
        self._refuse_recursion()
        if self._problems:
            raise OntologyRejected(self._problems)
        return sorted([*facts, *self._requirements(revision)], key=render)

    def program(self, name: str) -> Program:
        """The program of a task type; after `facts`."""
        order = [name]
        for caller in order:
            order.extend(c for c in self._calls.get(caller, ()) if c not in order)
        definitions: list[Term] = [
            struct("proc", self._head(self._processes[n]), self._bodies[n]) for n in order if n in self._bodies
        ]
        return Program(name=name, definitions=tuple(definitions))

    # Individuals and their values

    def _individuals(self, revision: int) -> Iterator[Term]:
        fluents = fluent_properties(self._ontology)
        things = {
            name
            for name, kinds in self._ontology.kinds.items()
            if kinds & {Kind.ROBOT, Kind.AREA, Kind.LOCATION, Kind.PHYSICAL_OBJECT}
        }
        for name in things:
            for kind in self._ontology.kinds[name]:
                yield struct("kind", revision, name, kind)
        for prop, subject, value in self._ontology.all_values():
            if subject in things:
                yield struct("fluent" if prop in fluents else "value", revision, prop, subject, value)

    # Processes

    def _compiled(self, revision: int) -> Iterator[Term]:
        for name, process in sorted(self._processes.items()):
            head = self._head(process)
            if process.robot:
                yield struct("agent", revision, head, _variable(process.robot))
            if not process.is_atomic:
                body = self._construct(_Scope(self, process, Var("Frame")), self._part(name, Property.COMPOSED_OF))
                self._bodies[name] = body
                yield struct("definition", revision, head, Var("Frame"), body)
            if self._ontology.value(Property.KEEPS_ROBOT, name) is True:
                yield struct("keeps_robot", revision, name)
            yield from self._conditions(revision, process, head)
            yield from self._duration(revision, process, head)

    def _requirements(self, revision: int) -> Iterator[Term]:
        for name in sorted(self._processes):
            for capability in sorted(self._required(name)):
                yield struct("requires", revision, name, capability)

    def _head(self, process: Process) -> Term:
        arguments = tuple(_variable(p) for p in process.arguments)
        return Struct(process.name, arguments) if arguments else process.name

    def _conditions(self, revision: int, process: Process, head: Term) -> Iterator[Term]:
        scope = _Scope(self, process, Var("Frame"))
        for entity in self._parts(process.name, Property.HAS_PRECONDITION):
            yield struct("precondition", revision, head, self._condition(scope, entity))
        for entity in self._parts(process.name, Property.HAS_EFFECT):
            fluent = struct("fluent", self._part(entity, Property.OF_PROPERTY), scope.subject(entity))
            yield struct("effect", revision, head, fluent, scope.object(entity))

    def _duration(self, revision: int, process: Process, head: Term) -> Iterator[Term]:
        seconds = self._ontology.value(Property.DURATION_S, process.name)
        milliseconds = round(float(seconds) * MS_PER_S) if isinstance(seconds, int | float) else 0
        model = self._ontology.value(Property.HAS_DURATION_MODEL, process.name)
        if process.is_atomic:
            yield struct("duration", revision, head, struct("fixed", milliseconds))
        elif model is not None:
            scope = _Scope(self, process, Var("Frame"))
            robot = scope.term(self._part(str(model), Property.TRAVELING_ROBOT), str(model))
            goal = scope.term(self._part(str(model), Property.TRAVEL_GOAL), str(model))
            yield struct("duration", revision, head, struct("travel", robot, goal, milliseconds))

    def _construct(self, scope: _Scope, entity: str) -> Term:
        def part(prop: Property) -> Term:
            return self._construct(scope, self._part(entity, prop))

        def condition() -> Term:
            return self._condition(scope, self._part(entity, Property.HAS_CONDITION))

        match self._construct_kind(entity):
            case Kind.SEQUENCE:
                return [self._construct(scope, step) for step in self._in_order(entity)]
            case Kind.SPLIT_JOIN:
                return struct("conc", [self._construct(scope, step) for step in self._parts(entity, Property.HAS_STEP)])
            case Kind.CHOICE:
                steps: list[Term] = [self._construct(scope, s) for s in self._parts(entity, Property.HAS_STEP)]
                return struct("choice", scope.frame, entity, steps)
            case Kind.IF_THEN_ELSE:
                has_else = self._ontology.value(Property.ELSE_STEP, entity) is not None
                return struct("if", condition(), part(Property.THEN_STEP), part(Property.ELSE_STEP) if has_else else [])
            case Kind.REPEAT_WHILE:
                return struct("while", condition(), part(Property.BODY_STEP))
            case Kind.REPEAT_UNTIL:
                return struct("until", part(Property.BODY_STEP), condition())
            case Kind.FOR_EACH:
                bound = scope.binding(entity)
                asked = self._condition(bound, self._part(entity, Property.HAS_CONDITION))
                inner = bound.inner(self._written(scope.process, self._part(entity, Property.BODY_STEP)))
                variables: list[Term] = [struct("-", _variable(p), p.kind) for p in scope.over(entity)]
                body = self._construct(inner, self._part(entity, Property.BODY_STEP))
                return struct("foreach", scope.frame, entity, variables, asked, inner.frame, body)
            case Kind.PICK:
                if not (over := scope.over(entity)):
                    return []  # reported already
                [picked] = over
                body = self._construct(scope.binding(entity), self._part(entity, Property.BODY_STEP))
                return struct("pick", scope.frame, entity, _variable(picked), picked.kind, body)
            case Kind.PERFORM:
                return self._perform(scope, entity)
            case _:
                self._problem("KB107", entity, "is not a control construct that we know")
                return []

    def _construct_kind(self, entity: str) -> Kind | None:
        kinds = self._ontology.kinds.get(entity, frozenset())
        return next((k for k in _CONSTRUCTS if k in kinds), None)

    def _perform(self, scope: _Scope, entity: str) -> Term:
        performed = self._part(entity, Property.PERFORMS)
        callee = self._processes.get(performed)
        if callee is None:
            self._problem("KB106", entity, f"performs {performed}, which is no AtomicProcess or CompositeProcess")
            return []
        self._calls.setdefault(scope.process.name, []).append(callee.name)
        bindings = {self._part(b, Property.TO_PARAMETER): b for b in self._parts(entity, Property.HAS_BINDING)}
        arguments = []
        for parameter in callee.arguments:
            binding = bindings.pop(parameter.entity, None)
            arguments.append(self._argument(scope, entity, callee, parameter, binding))
        for stray in bindings:
            self._problem("KB117", entity, f"binds {stray}, which is no parameter of {callee.name}")
        return struct("call", scope.frame, entity, Struct(callee.name, tuple(arguments)) if arguments else callee.name)

    def _argument(self, scope: _Scope, entity: str, callee: Process, parameter: Parameter, binding: str | None) -> Term:
        if binding is not None:
            source = scope.parameter(self._part(binding, Property.FROM_PARAMETER))
            of_property = self._ontology.value(Property.OF_PROPERTY, binding)
            if of_property is not None and source is not None:
                return struct("fluent", str(of_property), scope.term(source.entity, entity))
        else:
            source = scope.process.parameter(parameter.name)
        if source is None:
            if parameter.role is Role.OUTPUT:
                return struct("loc", scope.frame, f"{entity}_{parameter.name}")
            self._problem(
                "KB110",
                entity,
                f"the input {parameter.name} of {callee.name} is not bound; give {scope.process.name} "
                f"a parameter named {parameter.name!r}, or this step a Binding to {parameter.entity}",
            )
            return []
        if not self._compatible(source.kind, parameter.kind):
            self._problem(
                "KB112",
                entity,
                f"{parameter.name} of {callee.name} is a {parameter.kind}, but {source.name} of "
                f"{scope.process.name} is a {source.kind}",
            )
        return scope.term(source.entity, entity)

    def _written(self, process: Process, construct: str) -> frozenset[str]:
        """The parameters of a process, by entity, that some step within a construct outputs."""
        written: set[str] = set()
        todo = [construct]
        for entity in todo:
            todo += [s for s in self._parts(entity, Property.HAS_STEP) if s not in todo]
            callee = self._processes.get(self._part(entity, Property.PERFORMS))
            if callee is None:
                continue
            bound = {
                self._part(b, Property.TO_PARAMETER): self._part(b, Property.FROM_PARAMETER)
                for b in self._parts(entity, Property.HAS_BINDING)
            }
            for output in callee.outputs:
                same_name = process.parameter(output.name)
                written.add(bound.get(output.entity, same_name.entity if same_name else ""))
        return frozenset(written)

    def _compatible(self, one: str, other: str) -> bool:
        above = self._ontology.superclasses
        return other in above.get(one, {one}) or one in above.get(other, {other})

    def _condition(self, scope: _Scope, entity: str) -> Term:
        def operands() -> list[Term]:
            return [self._condition(scope, o) for o in self._parts(entity, Property.OPERAND)]

        if self._ontology.is_a(entity, Kind.ALL_OF):
            return struct("all", operands())
        if self._ontology.is_a(entity, Kind.ANY_OF):
            return struct("any", operands())
        if self._ontology.is_a(entity, Kind.NOT):
            return struct("not", operands()[0])
        if self._ontology.is_a(entity, Kind.HOLDS):
            return struct(
                "holds", self._part(entity, Property.OF_PROPERTY), scope.subject(entity), scope.object(entity)
            )
        return struct("is_true", scope.term(self._part(entity, Property.OF_TRUTH_VALUE), entity))

    # What a process requires of its robot

    def _required(self, name: str) -> set[str]:
        own = {str(c) for c in self._ontology.values(Property.REQUIRES_CAPABILITY, name)}
        robot = self._processes[name].robot
        if name in self._bodies and robot:
            own |= self._required_by(self._bodies[name], _variable(robot))
        return own

    def _required_by(self, body: Term, robot: Term) -> set[str]:
        """What a program asks of a robot: all that it may come to, but of a choice what all branches ask."""
        match body:
            case Struct("call", (_, _, Struct(callee, arguments))):
                at = self._processes[callee].robot
                position = self._processes[callee].arguments.index(at) if at else None
                return self._required(callee) if position is not None and arguments[position] == robot else set()
            case Struct("choice", (_, _, list(branches))):
                return set.intersection(*(self._required_by(b, robot) for b in branches)) if branches else set()
            case Struct(_, arguments):
                return set().union(*(self._required_by(a, robot) for a in arguments))
            case list():
                return set().union(*(self._required_by(a, robot) for a in body))
            case _:
                return set()

    def _refuse_recursion(self) -> None:
        def visit(name: str, trail: list[str]) -> None:
            if name in trail:
                cycle = " -> ".join([*trail[trail.index(name) :], name])
                self._problem("KB210", name, f"performs itself without end: {cycle}; use RepeatUntil or RepeatWhile")
                return
            for callee in self._calls.get(name, ()):
                visit(callee, [*trail, name])

        for name in sorted(self._calls):
            if not self._problems:
                visit(name, [])

    # Reading the ontology

    def _parts(self, entity: str, prop: Property) -> list[str]:
        return [str(v) for v in self._ontology.values(prop, entity)]

    def _part(self, entity: str, prop: Property) -> str:
        return str(self._ontology.value(prop, entity))

    def _in_order(self, entity: str) -> list[str]:
        def number(step: str) -> tuple[float, str]:
            value = self._ontology.value(Property.STEP_NUMBER, step)
            return (float(value) if isinstance(value, int | float) else 0.0, step)

        return sorted(self._parts(entity, Property.HAS_STEP), key=number)

    def _problem(self, code: str, entity: str, message: str) -> None:
        self._problems.append(self._ontology.problem(code, entity, message))


_CONSTRUCTS = (
    Kind.SEQUENCE,
    Kind.SPLIT_JOIN,
    Kind.CHOICE,
    Kind.IF_THEN_ELSE,
    Kind.REPEAT_WHILE,
    Kind.REPEAT_UNTIL,
    Kind.FOR_EACH,
    Kind.PICK,
    Kind.PERFORM,
)


class _Scope:
    """The parameters of a process as terms, within one frame."""

    def __init__(
        self,
        compiler: Compiler,
        process: Process,
        frame: Var,
        frames: Mapping[str, Var] | None = None,
        bound: frozenset[str] = frozenset(),
    ) -> None:
        self._compiler = compiler
        self.process = process
        self.frame = frame
        self._frames = frames or {}
        """Parameters, by entity, that belong to the turn of a for-each."""
        self._bound = bound
        """Parameters, by entity, that a for-each or pick around goes over."""

    def binding(self, construct: str) -> _Scope:
        """The scope within a for-each or pick: what it goes over has a value there."""
        bound = self._bound | {p.entity for p in self.over(construct)}
        return _Scope(self._compiler, self.process, self.frame, self._frames, bound)

    def inner(self, written: frozenset[str]) -> _Scope:
        """The scope of one turn of a for-each: the data written in it belong to that turn."""
        frame = Var("Inner" + self.frame.name)
        frames = {**self._frames, **dict.fromkeys(written, frame)}
        return _Scope(self._compiler, self.process, frame, frames, self._bound)

    def parameter(self, entity: str) -> Parameter | None:
        return next((p for p in self.process.parameters if p.entity == entity), None)

    def term(self, entity: str, user: str) -> Term:
        """A parameter, by entity, as the step or condition `user` reads or writes it."""
        parameter = self.parameter(entity)
        if parameter is None:
            self._compiler._problem("KB124", entity, f"is used in {self.process.name}, but is no parameter of it")
            return []
        if parameter.is_datum and (parameter.role is Role.LOCAL or entity in self._frames):
            return struct("loc", self._frames.get(entity, Var("Frame")), parameter.name)
        if parameter.role is Role.LOCAL and entity not in self._bound:
            told = f"is used by {user}, but no ForEach or Pick around it goes over it"
            self._compiler._problem("KB126", entity, told)
        return _variable(parameter)

    def over(self, construct: str) -> list[Parameter]:
        entities = self._compiler._parts(construct, Property.OVER_PARAMETER)
        for entity in entities:
            if self.parameter(entity) is None:
                told = f"goes over {entity}, which is no parameter of {self.process.name}"
                self._compiler._problem("KB124", construct, told)
        return [p for p in self.process.parameters if p.entity in entities]

    def subject(self, entity: str) -> Term:
        return self.term(self._compiler._part(entity, Property.SUBJECT_PARAMETER), entity)

    def object(self, entity: str) -> Term:
        value = self._compiler._ontology.value(Property.HAS_VALUE, entity)
        if value is not None:
            return value
        return self.term(self._compiler._part(entity, Property.OBJECT_PARAMETER), entity)


def _variable(parameter: Parameter) -> Var:
    return Var(parameter.name[0].upper() + parameter.name[1:])
