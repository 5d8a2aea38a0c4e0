"""OWL-S style control constructs -> Golog terms.

The constructs map one to one (the Golog side is documented in planner/golog/syntax.pl); C are conditions
(kb/conditions.py):

    Sequence [P, ...]   SplitJoin conc([P, ...])   Prioritized pconc([P, ...])
    AnyOrder any_order(Frame, Step, [P, ...])   Choice choice(Frame, Step, [P, ...])
    IfThenElse if(C, P, Q)   RepeatWhile while(C, P)   RepeatUntil until(P, C)   Iterate star(Frame, Step, P)
    ForEach foreach(Frame, Step, [Var-Class, ...], C, Inner, P)   Pick pick(Frame, Step, Var, Class, P)
    Interrupt interrupt(Frame, Step, [Var-Class, ...], C, P)   Await test(C)
    Lookahead search(P)   Deadline deadline(Milliseconds, P)   Perform call(Frame, Step, Head)

Split alone has no term: what follows it in its sequence is a part beside its own,
[A, Split([P, ...]), B] is [A, conc([P, ..., [B]])]. A SimpleProcess, a task type, is a choice between the
processes that realize it: choice(Frame, recipe, [call(Frame, Recipe, Head), ...]).

Frame stands for the invocation. Parameters that are individuals become logical variables; locals that are
data become places `loc(Frame, Name)`, written by the step that outputs them and read by later ones.
"""

from __future__ import annotations

from collections.abc import Mapping

from kb.conditions import Conditions
from kb.ontology import Ontology
from kb.processes import Parameter, Process, Role, realizing
from kb.scope import FRAME, Reader, Scope, variable
from kb.terms import Struct, Term, render, struct
from kb.vocabulary import Kind, Property

MS_PER_S = 1000


class Constructs(Reader):
    """Makes the terms of the processes of one ontology, and gathers what is wrong with them.

    Attributes:
        calls: The processes that each process performs, in the order in which it names them.
    """

    def __init__(self, ontology: Ontology, processes: Mapping[str, Process]) -> None:
        super().__init__(ontology)
        self.calls: dict[str, list[str]] = {}
        self._processes = processes
        self._conditions = Conditions(self, ontology)
        self._repeating: dict[tuple[str, str], str] = {}

    def body(self, process: Process) -> Term:
        """What a composite process does, or the choice that a task type is."""
        if self._ontology.is_a(process.name, Kind.SIMPLE_PROCESS):
            return self._choice_of_recipes(process)
        return self._construct(self.scope(process), self.part(process.name, Property.COMPOSED_OF))

    def scope(self, process: Process) -> Scope:
        """The parameters of a process as terms, outside of all its constructs."""
        return Scope(self, process, frame=FRAME, frames={}, bound=frozenset())

    def condition(self, scope: Scope, entity: str) -> Term:
        """A condition of a process."""
        return self._conditions.term(scope, entity)

    def asked_of(self, individual: str) -> bool:
        """Whether a rule may ask something of an individual; after all conditions have been made."""
        return self._conditions.asked_of(individual)

    def repeating(self, process: str, term: Term) -> str:
        """The construct, by name, that a loop or interrupt was made of."""
        return self._repeating[process, render(term)]

    # Control constructs

    def _construct(self, scope: Scope, entity: str) -> Term:
        def steps() -> list[Term]:
            return [self._construct(scope, step) for step in self.parts(entity, Property.HAS_STEP)]

        def body(within: Scope = scope, prop: Property = Property.BODY_STEP) -> Term:
            return self._construct(within, self.part(entity, prop))

        def asked(within: Scope = scope) -> Term:
            return self.condition(within, self.part(entity, Property.HAS_CONDITION))

        def variables() -> list[Term]:
            return [struct("-", variable(p), p.kind) for p in scope.over(entity)]

        match self.construct_kind(entity):
            case Kind.SEQUENCE:
                return self._sequence(scope, self.in_order(entity))
            case Kind.SPLIT | Kind.SPLIT_JOIN:
                return struct("conc", steps())
            case Kind.PRIORITIZED:
                return struct("pconc", [self._construct(scope, step) for step in self.in_order(entity)])
            case Kind.ANY_ORDER:
                return struct("any_order", scope.frame, entity, steps())
            case Kind.CHOICE:
                return struct("choice", scope.frame, entity, steps())
            case Kind.IF_THEN_ELSE:
                has_else = self._ontology.value(Property.ELSE_STEP, entity) is not None
                return struct(
                    "if", asked(), body(prop=Property.THEN_STEP), body(prop=Property.ELSE_STEP) if has_else else []
                )
            case Kind.REPEAT_WHILE:
                return self._repeated(scope, entity, struct("while", asked(), body()))
            case Kind.REPEAT_UNTIL:
                return self._repeated(scope, entity, struct("until", body(), asked()))
            case Kind.ITERATE:
                return self._repeated(scope, entity, struct("star", scope.frame, entity, body()))
            case Kind.INTERRUPT:
                within = scope.binding(entity)
                term = struct("interrupt", scope.frame, entity, variables(), asked(within), body(within))
                return self._repeated(scope, entity, term)
            case Kind.FOR_EACH:
                within = scope.binding(entity)
                inner = within.inner(self._written(scope.process, self.part(entity, Property.BODY_STEP)))
                return struct("foreach", scope.frame, entity, variables(), asked(within), inner.frame, body(inner))
            case Kind.PICK:
                if not (over := scope.over(entity)):
                    return []  # reported already
                [picked] = over
                return struct("pick", scope.frame, entity, variable(picked), picked.kind, body(scope.binding(entity)))
            case Kind.AWAIT:
                return struct("test", asked())
            case Kind.LOOKAHEAD:
                return struct("search", body())
            case Kind.DEADLINE:
                seconds = float(self.part(entity, Property.DEADLINE_S))
                return struct("deadline", round(seconds * MS_PER_S), body())
            case Kind.PERFORM:
                return self._perform(scope, entity)
            case _:
                self.problem("KB107", entity, "is not a control construct that we know")
                return []

    def construct_kind(self, entity: str) -> Kind | None:
        """Which control construct it is."""
        kinds = self._ontology.kinds.get(entity, frozenset())
        return next((k for k in _CONSTRUCTS if k in kinds), None)

    def _sequence(self, scope: Scope, steps: list[str]) -> list[Term]:
        terms: list[Term] = []
        for number, step in enumerate(steps, start=1):
            if self._ontology.is_a(step, Kind.SPLIT):
                begun = [self._construct(scope, s) for s in self.parts(step, Property.HAS_STEP)]
                rest = self._sequence(scope, steps[number:])
                return [*terms, struct("conc", [*begun, rest] if rest else begun)]
            terms.append(self._construct(scope, step))
        return terms

    def _repeated(self, scope: Scope, entity: str, term: Term) -> Term:
        self._repeating[scope.process.name, render(term)] = entity
        return term

    def in_order(self, entity: str) -> list[str]:
        """The steps of a construct by their numbers."""

        def number(step: str) -> tuple[float, str]:
            value = self._ontology.value(Property.STEP_NUMBER, step)
            return value if isinstance(value, int | float) else 0, step

        return sorted(self.parts(entity, Property.HAS_STEP), key=number)

    def _written(self, process: Process, construct: str) -> frozenset[str]:
        """The parameters of a process, by entity, that some step within a construct outputs."""
        written: set[str] = set()
        todo = [construct]
        for entity in todo:
            todo += [s for s in self.parts(entity, Property.HAS_STEP) if s not in todo]
            callee = self._processes.get(self.part(entity, Property.PERFORMS))
            if callee is None:
                continue
            bound = {
                self.part(b, Property.TO_PARAMETER): self.part(b, Property.FROM_PARAMETER)
                for b in self.parts(entity, Property.HAS_BINDING)
            }
            for output in callee.outputs:
                same_name = process.parameter(output.name)
                written.add(bound.get(output.entity, same_name.entity if same_name else ""))
        return frozenset(written)

    # Performing processes

    def _perform(self, scope: Scope, entity: str) -> Term:
        performed = self.part(entity, Property.PERFORMS)
        callee = self._processes.get(performed)
        if callee is None:
            told = f"performs {performed}, which is no AtomicProcess, CompositeProcess or SimpleProcess"
            self.problem("KB106", entity, told)
            return []
        self.calls.setdefault(scope.process.name, []).append(callee.name)
        bindings = {self.part(b, Property.TO_PARAMETER): b for b in self.parts(entity, Property.HAS_BINDING)}
        arguments = []
        for parameter in callee.arguments:
            binding = bindings.pop(parameter.entity, None)
            arguments.append(self._argument(scope, entity, callee, parameter, binding))
        for stray in bindings:
            self.problem("KB117", entity, f"binds {stray}, which is no parameter of {callee.name}")
        return struct("call", scope.frame, entity, _bound(callee, arguments))

    def _argument(self, scope: Scope, entity: str, callee: Process, parameter: Parameter, binding: str | None) -> Term:
        if binding is not None:
            constant = self._constant(entity, parameter, binding)
            if constant is not None:
                return constant
            source = scope.parameter(self.part(binding, Property.FROM_PARAMETER))
            of_property = self._ontology.value(Property.OF_PROPERTY, binding)
            if of_property is not None and source is not None:
                return struct("fluent", str(of_property), scope.term(source.entity, entity))
        else:
            source = scope.process.parameter(parameter.name)
        if source is None:
            if parameter.role is Role.OUTPUT:
                return struct("loc", scope.frame, f"{entity}_{parameter.name}")
            self.problem(
                "KB110",
                entity,
                f"the input {parameter.name} of {callee.name} is not bound; give {scope.process.name} "
                f"a parameter named {parameter.name!r}, or this step a Binding to {parameter.entity}",
            )
            return []
        if not (self._is_below(source.kind, parameter.kind) or self._is_below(parameter.kind, source.kind)):
            self.problem(
                "KB112",
                entity,
                f"{parameter.name} of {callee.name} is a {parameter.kind}, but {source.name} of "
                f"{scope.process.name} is a {source.kind}",
            )
        return scope.term(source.entity, entity)

    def _constant(self, entity: str, parameter: Parameter, binding: str) -> Term | None:
        """What a binding gives whatever the enclosing process is given: an individual, or a value of data."""
        value = self._ontology.value(Property.HAS_VALUE, binding)
        individual = self._ontology.value(Property.FROM_INDIVIDUAL, binding)
        wrong = ""
        if individual is not None and not self._ontology.is_a(str(individual), parameter.kind):
            wrong = f"is a {parameter.kind}, and {individual} is none"
        elif value is not None and not parameter.is_datum:
            wrong = f"is a {parameter.kind}, which has no literal values; name one by fromIndividual"
        elif parameter.role is Role.OUTPUT and (value is not None or individual is not None):
            wrong = "is an output, which needs a parameter to go to; bind it by fromParameter"
        if wrong:
            self.problem("KB112", entity, f"{parameter.name} of the process that it performs {wrong}")
        return value if individual is None else individual

    def _is_below(self, kind: str, other: str) -> bool:
        return other in self._ontology.superclasses.get(kind, {kind})

    def _choice_of_recipes(self, task: Process) -> Term:
        recipes = [self._processes[name] for name in realizing(self._ontology, task.name)]
        if not recipes:
            told = "is a task type that no process realizes (retired ones do not count)"
            told += "; let a CompositeProcess or AtomicProcess 'realizes' it"
            self.problem("KB130", task.name, told)
        calls: list[Term] = []
        for recipe in recipes:
            self._refuse_unfit(task, recipe)
            self.calls.setdefault(task.name, []).append(recipe.name)
            given: list[Term] = [
                variable(parameter)
                if task.parameter(parameter.name)
                else struct("loc", FRAME, f"{recipe.name}_{parameter.name}")
                for parameter in recipe.arguments
            ]
            calls.append(struct("call", FRAME, recipe.name, _bound(recipe, given)))
        return struct("choice", FRAME, "recipe", calls)

    def _refuse_unfit(self, task: Process, recipe: Process) -> None:
        """What a task type is given, each recipe must be able to take; what it promises, to make."""
        told: list[str] = []
        given = {p.name: p for p in task.inputs}
        for parameter in recipe.inputs:
            source = given.get(parameter.name)
            if source is None:
                told.append(f"needs the input {parameter.name!r}, which {task.name} does not have")
            elif parameter.role is Role.ROBOT and source.role is not Role.ROBOT:
                told.append(f"{parameter.name!r} is an input of {task.name} and no RobotParameter")
            elif parameter.role is not Role.ROBOT and not self._is_below(source.kind, parameter.kind):
                # A robot of a narrower class is a matter of capability: kb/compiler.py.
                told.append(
                    f"takes a {parameter.kind} for {parameter.name!r}, but {task.name} may be given any {source.kind}"
                )
        made = {p.name: p for p in recipe.outputs}
        for output in task.outputs:
            if output.name not in made:
                told.append(f"lacks the output {output.name!r}, which {task.name} promises")
            elif not self._is_below(made[output.name].kind, output.kind):
                told.append(
                    f"makes a {made[output.name].kind} for {output.name!r}; {task.name} promises a {output.kind}"
                )
        for each in told:
            self.problem("KB129", recipe.name, f"realizes {task.name}, but {each}")


_CONSTRUCTS = (
    Kind.SEQUENCE,
    Kind.SPLIT,
    Kind.SPLIT_JOIN,
    Kind.PRIORITIZED,
    Kind.ANY_ORDER,
    Kind.CHOICE,
    Kind.IF_THEN_ELSE,
    Kind.REPEAT_WHILE,
    Kind.REPEAT_UNTIL,
    Kind.ITERATE,
    Kind.INTERRUPT,
    Kind.FOR_EACH,
    Kind.PICK,
    Kind.AWAIT,
    Kind.LOOKAHEAD,
    Kind.DEADLINE,
    Kind.PERFORM,
)


def head(process: Process) -> Term:
    """A process with its parameters as variables."""
    return _bound(process, [variable(p) for p in process.arguments])


def _bound(process: Process, arguments: list[Term]) -> Term:
    return Struct(process.name, tuple(arguments)) if arguments else process.name
