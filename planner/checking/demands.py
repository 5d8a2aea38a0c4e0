"""What each process asks for and brings about, read from the ontology for the checker of plans.

This is a reading of its own: it shares no code with kb/compiler.py, which tells the same to the planner.
Parameters are variables by their names in the ontology.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from kb.ontology import Ontology, Value
from kb.processes import Role
from kb.store import Snapshot
from kb.swrl import Rules, read_rules
from kb.terms import Struct, Term, Var
from kb.vocabulary import Kind, Property
from planner.checking.rules import satisfied

Definitions = Mapping[str, tuple[tuple[Term, ...], Term]]
"""Parameters and body of each composite process, by name."""

_MS_PER_S = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Demand:
    """A process as the ontology describes it.

    Attributes:
        parameters: Names, in the order of a call's arguments.
        robots: Numbers of the parameters (from 0) that are robots, the one that travels first.
        capabilities: For each of `robots`, the classes to which it must belong.
        preconditions: Conditions over the parameters.
        effects: (property, subject, value) that hold when it has ended.
        claims: What it uses alone, or as far as its capacity goes.
        keeps_robots: From its first step to its end, its robots do nothing else.
        one_step: It is a single step of a plan; else its body is.
        fixed_ms: How long one try takes, besides the travel.
        travel: The traveling robot and where to.
        odds: Probability that a try succeeds.
        measured: Instead of fixed_ms and odds, of a robot at a place, or everywhere ("").
        place: Number of the parameter that names where it takes place, if one does.
    """

    name: str
    parameters: tuple[str, ...]
    robots: tuple[int, ...]
    capabilities: tuple[frozenset[str], ...]
    preconditions: tuple[Term, ...]
    effects: tuple[tuple[str, Term, Term], ...]
    claims: tuple[Term, ...]
    keeps_robots: bool
    one_step: bool
    fixed_ms: int
    travel: tuple[Term, Term] | None
    odds: float
    measured: Mapping[tuple[str, str], tuple[int, float]]
    place: int | None


class Demands:
    """The demands of all processes of a program, each read when it is first asked for."""

    def __init__(self, snapshot: Snapshot, definitions: Definitions) -> None:
        self._ontology: Ontology = snapshot.ontology
        self._processes = snapshot.processes
        self._definitions = definitions
        self._read: dict[str, Demand] = {}

    @cached_property
    def _rules(self) -> Rules:
        return read_rules(self._ontology)

    def of(self, name: str) -> Demand:
        """The demand of a process.

        Raises:
            KeyError: There is no such process.
        """
        if name not in self._read:
            self._read[name] = self._demand(name)
        return self._read[name]

    def _demand(self, name: str) -> Demand:
        arguments = self._processes[name].arguments
        robots = tuple(n for n, p in enumerate(arguments) if p.role is Role.ROBOT)
        model = self._ontology.value(Property.HAS_DURATION_MODEL, name)
        fixed_ms = self._milliseconds(Property.DURATION_S, name, 0)
        odds = self._number(Property.SUCCESS_ODDS, name, 1.0)
        places = [n for n, p in enumerate(arguments) if p.role is not Role.OUTPUT and self._is_place(p.kind)]
        return Demand(
            name=name,
            parameters=tuple(p.name for p in arguments),
            robots=robots,
            capabilities=tuple(frozenset(self._required(name, n, ())) for n in robots),
            preconditions=tuple(self._condition(e, name) for e in self._names(Property.HAS_PRECONDITION, name)),
            effects=tuple(self._effects(name)),
            claims=tuple(self._parameter(e) for e in self._names(Property.CLAIMS_PARAMETER, name)),
            keeps_robots=self._ontology.value(Property.KEEPS_ROBOT, name) is True,
            one_step=model is not None or name not in self._definitions,
            fixed_ms=fixed_ms,
            travel=None if model is None else self._travel(str(model)),
            odds=odds,
            measured=self._measured(name, fixed_ms, odds),
            place=places[-1] if places else None,
        )

    def _measured(self, name: str, fixed_ms: int, odds: float) -> dict[tuple[str, str], tuple[int, float]]:
        """What was learned of robots, everywhere first: of a robot at a place, the rest is that."""
        by_place: dict[tuple[str, str], str] = {}
        for entity in self._learned.get(name, ()):
            robot, place = (self._ontology.value(p, entity) for p in (Property.OF_ROBOT, Property.AT_PLACE))
            by_place["" if place is None else str(place), str(robot)] = entity
        measured: dict[tuple[str, str], tuple[int, float]] = {}
        for (place, robot), entity in sorted(by_place.items()):
            otherwise = measured.get((robot, ""), (fixed_ms, odds))
            measured[robot, place] = (
                self._milliseconds(Property.LEARNED_DURATION_S, entity, otherwise[0]),
                self._number(Property.LEARNED_ODDS, entity, otherwise[1]),
            )
        return measured

    @cached_property
    def _learned(self) -> dict[str, list[str]]:
        """The learned values of each process."""
        found: dict[str, list[str]] = {}
        for entity in self._ontology.individuals(Kind.LEARNED_VALUE):
            found.setdefault(str(self._ontology.value(Property.OF_PROCESS, entity)), []).append(entity)
        return found

    def _number(self, prop: Property, entity: str, otherwise: float) -> float:
        value = self._ontology.value(prop, entity)
        return float(value) if isinstance(value, int | float) else otherwise

    def _milliseconds(self, prop: Property, entity: str, otherwise: int) -> int:
        return round(self._number(prop, entity, otherwise / _MS_PER_S) * _MS_PER_S)

    def _is_place(self, kind: str) -> bool:
        return Kind.LOCATION in self._ontology.superclasses.get(kind, {kind})

    def _names(self, prop: Property, entity: str) -> list[str]:
        return [str(v) for v in self._ontology.values(prop, entity)]

    def _parameter(self, entity: Value | None) -> Term:
        return Var(str(self._ontology.value(Property.PARAMETER_NAME, str(entity))))

    def _travel(self, model: str) -> tuple[Term, Term]:
        robot = self._ontology.value(Property.TRAVELING_ROBOT, model)
        return self._parameter(robot), self._parameter(self._ontology.value(Property.TRAVEL_GOAL, model))

    def _effects(self, name: str) -> Iterator[tuple[str, Term, Term]]:
        for entity in self._names(Property.HAS_EFFECT, name):
            prop = str(self._ontology.value(Property.OF_PROPERTY, entity))
            yield prop, self._subject(entity), self._object(entity)

    def _subject(self, entity: str) -> Term:
        return self._parameter(self._ontology.value(Property.SUBJECT_PARAMETER, entity))

    def _object(self, entity: str) -> Term:
        value = self._ontology.value(Property.HAS_VALUE, entity)
        return self._parameter(self._ontology.value(Property.OBJECT_PARAMETER, entity)) if value is None else value

    def _condition(self, entity: str, process: str) -> Term:
        """A condition of a process, in the terms of programs."""
        operands: list[Term] = [self._condition(e, process) for e in self._names(Property.OPERAND, entity)]
        prop = self._ontology.value(Property.OF_PROPERTY, entity)
        if self._ontology.is_a(entity, Kind.ALL_OF):
            return Struct("all", (operands,))
        if self._ontology.is_a(entity, Kind.ANY_OF):
            return Struct("any", (operands,))
        if self._ontology.is_a(entity, Kind.NOT):
            return Struct("not", (operands[0],))
        if self._ontology.is_a(entity, Kind.HOLDS):
            return Struct("holds", (str(prop), self._subject(entity), self._object(entity)))
        if self._ontology.is_a(entity, Kind.COMPARE):
            comparison = str(self._ontology.value(Property.COMPARISON, entity)).replace(" ", "_")
            left = Struct("value", (str(prop), self._subject(entity)))
            other = self._ontology.value(Property.OBJECT_PROPERTY, entity)
            right = self._object(entity) if other is None else Struct("value", (str(other), self._object(entity)))
            return Struct("compare", (comparison, left, right))
        if self._ontology.is_a(entity, Kind.RULE_CONDITION):
            names = [p.name for p in self._processes[process].parameters]
            return satisfied(self._rules.of.get(entity, ()), names)
        return Struct("is_true", (self._parameter(self._ontology.value(Property.OF_TRUTH_VALUE, entity)),))

    # What a process requires of a robot

    def _required(self, name: str, position: int, above: tuple[tuple[str, int], ...]) -> set[str]:
        """The classes that a process asks of one of its robots, itself or through what it may come to perform."""
        own = set(self._names(Property.REQUIRES_CAPABILITY, name))
        own |= {self._processes[name].arguments[position].kind} - {Kind.ROBOT}
        if name in self._definitions and (name, position) not in above:
            parameters, body = self._definitions[name]
            own |= self._asked(body, parameters[position], (*above, (name, position)))
        return own

    def _asked(self, program: Term, robot: Term, above: tuple[tuple[str, int], ...]) -> set[str]:
        match program:
            case Struct("call", (_, _, Struct(callee, arguments))):
                takes = self._processes[callee].arguments
                places = [n for n, a in enumerate(arguments) if a == robot and takes[n].role is Role.ROBOT]
                return set().union(*(self._required(callee, n, above) for n in places))
            case Struct("choice", (_, _, list(branches))):
                return set.intersection(*(self._asked(b, robot, above) for b in branches)) if branches else set()
            case Struct("star"):
                return set()  # it may be done no time
            case Struct(_, parts):
                return self._all_asked(parts, robot, above)
            case list(parts):
                return self._all_asked(parts, robot, above)
            case _:
                return set()

    def _all_asked(self, parts: Sequence[Term], robot: Term, above: tuple[tuple[str, int], ...]) -> set[str]:
        return set().union(*(self._asked(p, robot, above) for p in parts))
