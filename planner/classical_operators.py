"""What goals are reached with: processes as operators, each with a known duration and known effects.

An operator stands for a whole process: its conditions hold when it begins, its effects when it has
ended, and meanwhile its robots do nothing else. Offered is every process that sets a fluent and that
the planner may take as one step (it has a duration) or that comes to a plain sequence of such steps.
Processes that loop, choose or decide on what only acting finds out are not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import TypeAlias

from kb.compiler import Compiler
from kb.ontology import Ontology
from kb.processes import Process, Role
from kb.store import Snapshot
from kb.terms import Struct, Term, Var, struct
from kb.vocabulary import Property

_MOST_CASES = 200
"""Ways to satisfy a rule that are written out; each is a case of each ground operator."""

KNOWN = "known"
"""The value that a fluent gets whose values are messages: it has one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """A way that an operator's robot travels.

    Attributes:
        origin: None: where the robot is when the operator begins.
        odds: Of success; the expected time is the travel time over the odds, rounded (half to even).
    """

    robot: Term
    origin: Term | None
    goal: Term
    odds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """Afterwards the property of the subject has this value."""

    prop: str
    subject: Term
    value: Term


@dataclass(frozen=True, slots=True, kw_only=True)
class Operator:
    """A process, to be taken as a whole.

    Attributes:
        process: Its name, which is the operator's.
        arguments: Of its head: a Var for an individual, `loc(Frame, Name)` for what it outputs.
        kinds: Classes of the variables, by name: those of the head first, in order.
        robots: All that are busy with it.
        requires: Capabilities, each of one of its robots.
        conditions: Hold when it begins; `same(A, B)` beside the conditions of planner/golog/syntax.pl.
        effects: Hold when it has ended; each property of a subject once.
        fixed_ms: What it takes beside its legs.
        claims: What nobody else uses meanwhile, as far as its capacity goes.
    """

    process: str
    arguments: tuple[Term, ...]
    kinds: Mapping[str, str]
    robots: tuple[Term, ...]
    requires: tuple[tuple[str, Term], ...]
    conditions: tuple[Term, ...]
    effects: tuple[Effect, ...]
    legs: tuple[Leg, ...]
    fixed_ms: int
    claims: tuple[Term, ...]

    @property
    def used(self) -> tuple[str, ...]:
        """The variables that anything depends on, in order; the others may be any individuals."""
        told: list[Term] = [*self.robots, *self.claims, *self.conditions]
        told += [term for effect in self.effects for term in (effect.subject, effect.value)]
        told += [leg.goal for leg in self.legs]
        found = variables(told)
        return tuple(name for name in self.kinds if name in found)


@dataclass(frozen=True, slots=True, kw_only=True)
class Offer:
    """What a knowledge base offers.

    Attributes:
        operators: By name.
        refused: Why the other processes are none, by name.
    """

    operators: tuple[Operator, ...]
    refused: Mapping[str, str]


Row: TypeAlias = tuple[Term, ...]


class Facts:
    """The facts of kb/rules/facts.pl about processes, by process."""

    def __init__(self, snapshot: Snapshot) -> None:
        self.processes = snapshot.processes
        self._rows: dict[tuple[str, str], list[Row]] = {}
        for fact in Compiler(snapshot.ontology, snapshot.processes).facts(snapshot.revision):
            if isinstance(fact, Struct) and fact.functor not in ("fluent", "value", "kind"):
                _, head, *rest = fact.args
                name = head.functor if isinstance(head, Struct) else str(head)
                self._rows.setdefault((fact.functor, name), []).append((head, *rest))

    def of(self, functor: str, name: str, arguments: tuple[Term, ...] = ()) -> list[Row]:
        """What a fact says about a process, after its head, with these arguments for the head's variables."""
        rows = []
        for head, *rest in self._rows.get((functor, name), ()):
            binding = {
                parameter.name: argument
                for parameter, argument in zip(head.args if isinstance(head, Struct) else (), arguments, strict=False)
                if isinstance(parameter, Var)
            }
            rows.append(tuple(bound(term, binding) for term in rest))
        return rows


class _Unfit(Exception):
    """Why a process is no operator."""


class Unwritten(_Unfit):
    """Why a condition of a rule cannot be written out."""


def written_out(condition: Term, ontology: Ontology) -> Term:
    """A condition without variables of its own: of `some`, one of all cases that there are.

    Raises:
        Unwritten: A variable stands for a number, or for something of no known class; or there are too many cases.
    """
    match condition:
        case Struct("some", (list(over), part)):
            names, individuals = [], []
            for typed in over:
                match typed:
                    case Struct("-", (Var(name), str(kind))):
                        names.append(name)
                        individuals.append(ontology.individuals(kind))
                    case _:
                        raise Unwritten("a rule of it asks for a number, or for something of no class that we know")
            if prod(map(len, individuals)) > _MOST_CASES:
                raise Unwritten(f"a rule of it may be satisfied in more than {_MOST_CASES} ways")
            body = written_out(part, ontology)
            return struct("any", [bound(body, dict(zip(names, each, strict=True))) for each in product(*individuals)])
        case Struct("all" | "any" | "not" as word, parts):
            return Struct(word, tuple(written_out(part, ontology) for part in parts))
        case list():
            return [written_out(part, ontology) for part in condition]
        case _:
            return condition


def offered(snapshot: Snapshot, *, parts: bool = False) -> Offer:
    """The operators that a knowledge base offers.

    Args:
        parts: Also processes that are of use only as parts of others: those without effects, or that need messages.
    """
    facts = Facts(snapshot)
    operators: dict[str, Operator] = {}
    refused: dict[str, str] = {}
    for name, process in sorted(snapshot.processes.items()):
        if snapshot.ontology.value(Property.RETIRED, name) is True:
            refused[name] = "it is retired"
            continue
        try:
            operators[name] = _Reading(facts, snapshot).operator(process, part=parts)
        except _Unfit as unfit:
            refused[name] = str(unfit)
    changed = {effect.prop for operator in operators.values() for effect in operator.effects}
    for name, operator in list(operators.items()):
        for prop in sorted(_compared(list(operator.conditions)) & changed):
            del operators[name]
            refused[name] = f"it compares {prop}, which other processes change"
            break
    return Offer(operators=tuple(operators.values()), refused=refused)


def variables(term: Term) -> set[str]:
    """The names of the variables in a term."""
    match term:
        case Var(name):
            return {name}
        case Struct(_, parts):
            return variables(list(parts))
        case list():
            return set[str]().union(*map(variables, term))
        case _:
            return set()


def bound(term: Term, binding: Mapping[str, Term]) -> Term:
    """The term with values for its variables."""
    match term:
        case Var(name):
            return binding.get(name, term)
        case Struct(functor, parts):
            return Struct(functor, tuple(bound(part, binding) for part in parts))
        case list():
            return [bound(part, binding) for part in term]
        case _:
            return term


def expected_ms(milliseconds: int, odds: float) -> int:
    """The expected duration of what is done again until it succeeds."""
    return round(milliseconds / odds)


class _Reading:
    """A process read from its first step to its last."""

    def __init__(self, facts: Facts, snapshot: Snapshot) -> None:
        self._facts = facts
        self._ontology = snapshot.ontology
        self._kinds: dict[str, str] = {}
        self._robots: list[Term] = []
        self._requires: list[tuple[str, Term]] = []
        self._conditions: list[Term] = []
        self._effects: dict[tuple[str, Term], Term] = {}
        self._legs: list[Leg] = []
        self._fixed_ms = 0
        self._claims: list[Term] = []
        self._steps = 0

    def operator(self, process: Process, *, part: bool) -> Operator:
        arguments: list[Term] = []
        for parameter in process.arguments:
            if parameter.is_datum and parameter.role is not Role.OUTPUT and not part:
                raise _Unfit(f"it needs {parameter.name!r}, which only another step can make")
            if parameter.is_datum or parameter.role is Role.OUTPUT:
                arguments.append(struct("loc", Var("Frame"), parameter.name))
            else:
                variable = parameter.name[0].upper() + parameter.name[1:]
                self._kinds[variable] = parameter.kind
                arguments.append(Var(variable))
        self._call(process.name, tuple(arguments))
        if not self._effects and not part:
            raise _Unfit("it has no effect")
        if not self._steps:
            raise _Unfit("it has no step with a duration")
        if len({*map(repr, self._robots)}) < len(self._robots):
            raise _Unfit("one robot would do a step with itself")
        return Operator(
            process=process.name,
            arguments=tuple(arguments),
            kinds=dict(self._kinds),
            robots=tuple(self._robots),
            requires=tuple(self._requires),
            conditions=tuple(self._conditions),
            effects=tuple(Effect(prop=p, subject=s, value=v) for (p, s), v in self._effects.items()),
            legs=tuple(self._legs),
            fixed_ms=self._fixed_ms,
            claims=tuple(self._claims),
        )

    def _call(self, name: str, arguments: tuple[Term, ...]) -> None:
        robots = [robot for (robot,) in self._facts.of("agent", name, arguments)]
        self._robots += [robot for robot in robots if robot not in self._robots]
        for (capability,) in self._facts.of("requires", name):
            self._requires += [(str(capability), r) for r in robots if (str(capability), r) not in self._requires]
        for (condition,) in self._facts.of("precondition", name, arguments):
            self._conditions.append(self._at_start(condition))
        for (resource,) in self._facts.of("claims", name, arguments):
            if resource not in self._claims:
                self._claims.append(resource)
        durations = self._facts.of("duration", name, arguments)
        definitions = self._facts.of("definition", name, arguments)
        if durations:
            self._step(name, durations[0][0])
        elif definitions:
            self._body(name, definitions[0][1])
        else:
            raise _Unfit(f"{name} has neither a duration nor a body")
        for fluent, value in self._facts.of("effect", name, arguments):
            assert isinstance(fluent, Struct)
            self._effect(str(fluent.args[0]), fluent.args[1], value)

    def _step(self, name: str, duration: Term) -> None:
        self._steps += 1
        [(odds,)] = self._facts.of("odds", name) or [(1.0,)]
        assert isinstance(odds, int | float)
        match duration:
            case Struct("travel", (robot, goal, int(more))):
                origin = self._effects.get((Property.LOCATED_AT, robot))
                place = self._individual(goal, "Location")
                self._legs.append(Leg(robot=robot, origin=origin, goal=place, odds=odds))
                self._fixed_ms += expected_ms(more, odds)
            case Struct("fixed", (int(milliseconds),)):
                self._fixed_ms += expected_ms(milliseconds, odds)
            case _:
                raise _Unfit(f"the duration of {name} is of no kind that we know")

    def _body(self, name: str, body: Term) -> None:
        match body:
            case list():
                for part in body:
                    self._body(name, part)
            case Struct("call", (_, _, str(callee))):
                self._call(callee, ())
            case Struct("call", (_, _, Struct(callee, arguments))):
                parameters = self._facts.processes[callee].arguments
                self._call(
                    callee,
                    tuple(
                        argument if p.is_datum else self._individual(argument, p.kind)
                        for p, argument in zip(parameters, arguments, strict=True)
                    ),
                )
            case Struct("search", (part,)):
                self._body(name, part)
            case Struct(construct, _):
                raise _Unfit(f"{name} is no plain sequence of steps: it has {construct}(...)")
            case _:
                raise _Unfit(f"{name} has no body that we know")

    def _individual(self, term: Term, kind: str) -> Term:
        """An argument; what it reads from a property becomes a variable of its own, and a condition."""
        match term:
            case Struct("fluent", (str(prop), subject)):
                variable = f"{prop[0].upper()}{prop[1:]}_{subject.name if isinstance(subject, Var) else subject}"
                self._kinds.setdefault(variable, kind)
                self._conditions.append(self._at_start(struct("holds", prop, subject, Var(variable))))
                return Var(variable)
            case Struct():
                raise _Unfit("a step is about an individual that another step finds out")
            case _:
                return term

    def _effect(self, prop: str, subject: Term, value: Term) -> None:
        if isinstance(subject, Struct):
            raise _Unfit(f"it sets {prop} of what only acting finds out")
        if self._ontology.datum_property(prop):
            value = KNOWN
        elif isinstance(value, Struct):
            raise _Unfit(f"it sets {prop} to what only acting finds out")
        self._effects[prop, subject] = value

    def _at_start(self, condition: Term) -> Term:
        """The condition of a later step, as it has to hold when the whole begins."""
        match condition:
            case Struct("holds", (str(prop), subject, value)):
                if isinstance(subject, Struct) or isinstance(value, Struct):
                    raise _Unfit("it asks for what only acting finds out")
                done = self._effects.get((prop, subject))
                if done is None:
                    return condition
                return struct("all", []) if done in (value, KNOWN) else struct("same", done, value)
            case Struct("compare", (op, *sides)):
                for side in sides:
                    match side:
                        case Struct("value", (str(changed), subject)) if (changed, subject) in self._effects:
                            raise _Unfit(f"it compares {changed}, which its own steps change")
                return struct("compare", op, *sides)
            case Struct("is_true", _):
                raise _Unfit("it decides on what only acting finds out")
            case Struct("is_a" | "same", parts):
                if any(isinstance(part, Struct) for part in parts):
                    raise _Unfit("it asks for what only acting finds out")
                return condition
            case Struct("some"):
                return self._at_start(written_out(condition, self._ontology))
            case Struct(functor, parts):
                return Struct(functor, tuple(self._at_start(part) for part in parts))
            case list():
                return [self._at_start(part) for part in condition]
            case _:
                raise _Unfit("it has a condition of no kind that we know")


def _compared(condition: Term) -> set[str]:
    """The properties whose numbers a condition compares."""
    match condition:
        case Struct("value", (str(prop), _)):
            return {prop}
        case Struct(_, parts):
            return _compared(list(parts))
        case list():
            return set[str]().union(*map(_compared, condition))
        case _:
            return set()
