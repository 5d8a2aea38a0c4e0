"""Operators as a unified-planning problem.

The classes of the ontology become a tree of types below `individual`. A class that has several above it
hangs below the first of them by name; where that leaves an individual out, the class is asked for by a
static fluent `is_CLASS`. What has individuals for values becomes a fluent with objects for values
(`locatedAt(x) = y`), or a relation where nothing changes it; literals and messages become truth values
(`isEmpty_is_true(x)`, `hasDetectedPosition_is_known(x)`). For languages that know only truth values, the
model may be relational: `locatedAt(x, y)`, with a parameter for the value that an action ends. Durations
are in milliseconds. A robot that travels does so from its `position`, by the table of its `profile`: only
a `way` leads somewhere, so that what is missing from the table is no free ride.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from unified_planning.environment import Environment
from unified_planning.model import (
    Action,
    DurativeAction,
    EndTiming,
    Fluent,
    FNode,
    InstantaneousAction,
    Object,
    Parameter,
    Problem,
    StartTiming,
    Type,
)
from unified_planning.model.htn import HierarchicalProblem
from unified_planning.model.metrics import MinimizeMakespan

from kb.terms import Struct, Term, Value, Var
from kb.vocabulary import Kind, Property
from planner.classical_engine import HORIZON_MS
from planner.classical_goal import Goal
from planner.classical_ground import POSITION, World, here
from planner.classical_operators import Operator, bound, expected_ms, variables
from planner.network import NO_WAY


class Model:
    """A unified-planning problem that knows where its parts come from.

    Attributes:
        problem: The problem.
    """

    def __init__(
        self, world: World, goal: Goal | None, *, timed: bool, relational: bool = False, hierarchical: bool = False
    ) -> None:
        """Make a problem of all operators.

        Args:
            goal: None: that of a hierarchical problem is its task network.
            timed: With durations, claims and robots that do one thing at a time; else as classical planning has it.
            relational: With truth values alone for what changes.
        """
        self._world, self._ontology = world, world.snapshot.ontology
        self._timed, self._relational = timed, relational
        self._env = Environment()
        self._env.credits_stream = None
        self.problem: Problem = (HierarchicalProblem if hierarchical else Problem)("goal", self._env)
        self._em = self._env.expression_manager
        self._bool = self._env.type_manager.BoolType()
        self._individual = self._env.type_manager.UserType("individual")
        operators = world.offer.operators
        self._classes = sorted({o.kinds[name] for o in operators for name in o.used} | {Kind.ROBOT})
        self._types: dict[str, Type] = {}
        for kind in self._classes:
            self._type(kind)
        self._changing = {prop for prop, _ in world.changed} | {POSITION}
        self._fluents: dict[str, Fluent] = {}
        self._objects: dict[str, Object] = {}
        for name in sorted({i for kind in self._classes for i in self._ontology.individuals(kind)}):
            self.individual(name)
        for place in world.travel.places:
            self.individual(place)
        for operator in operators:
            self.problem.add_action(self._action(operator))
        if goal is not None:
            for condition in goal.conditions:
                self.problem.add_goal(self.condition(condition, {}))
        if timed:
            self.problem.add_quality_metric(MinimizeMakespan(self._env))
        if not hierarchical:
            self.fill()

    # Types and objects

    def _above(self, kind: str) -> str | None:
        """The class right above another one among those that are used."""
        above = self._ontology.superclasses
        strictly = [c for c in self._classes if c != kind and c in above.get(kind, ()) and kind not in above.get(c, ())]
        nearest = [c for c in strictly if not any(o != c and c in above.get(o, ()) for o in strictly)]
        return min(nearest, default=None)

    def _type(self, kind: str) -> Type:
        if kind not in self._types:
            above = self._above(kind)
            father = self._type(above) if above else self._individual
            self._types[kind] = self._env.type_manager.UserType(kind, father)
        return self._types[kind]

    def _own_class(self, individual: str) -> str | None:
        kinds = [k for k in self._classes if self._ontology.is_a(individual, k)]
        nearest = [k for k in kinds if not any(self._above(o) == k for o in kinds)]
        return min(nearest, default=None)

    def individual(self, name: str) -> FNode:
        """An individual; made when first asked for."""
        if name not in self._objects:
            kind = self._own_class(name)
            self._objects[name] = Object(name, self._types[kind] if kind else self._individual, self._env)
            self.problem.add_object(self._objects[name])
        return self._em.ObjectExp(self._objects[name])

    def parameter_type(self, kind: str) -> tuple[Type, bool]:
        """The type for values of a class, and whether it may have values that are none of the class."""
        for individual in self._ontology.individuals(kind):
            own = self._own_class(individual)
            while own is not None and own != kind:
                own = self._above(own)
            if own is None:
                return self._individual, True
        return self._type(kind), False

    def kind_conditions(self, kinds: dict[str, str], parameters: dict[str, Parameter]) -> Iterator[FNode]:
        """That parameters are of their classes, where their types don't say so."""
        for name, kind in kinds.items():
            if self.parameter_type(kind)[1]:
                yield self._em.FluentExp(self._fluent(f"is_{kind}", x=self._individual), [parameters[name]])

    # Fluents and conditions

    def _fluent(
        self, name: str, value: Type | None = None, *, default: FNode | bool | int = False, **signature: Type
    ) -> Fluent:
        if name not in self._fluents:
            fluent = Fluent(name, value or self._bool, environment=self._env, **signature)
            self._fluents[name] = fluent
            self.problem.add_fluent(fluent, default_initial_value=default)
        return self._fluents[name]

    def _of(self, prop: str, subject: FNode, value: Value) -> tuple[FNode, FNode | bool]:
        """A fluent and the value that it has where the property has this one."""
        if isinstance(value, str) and not self._ontology.datum_property(prop):
            value_exp = self.individual(value)
            return self._valued(prop, subject, value_exp)
        word = str(value).lower().replace(".", "_").replace("-", "minus_")
        return self._em.FluentExp(self._fluent(f"{prop}_is_{word}", x=self._individual), [subject]), True

    def _valued(self, prop: str, subject: FNode, value: FNode) -> tuple[FNode, FNode | bool]:
        if prop in self._changing and not self._relational:
            nothing = self.individual("nothing")
            fluent = self._fluent(prop, self._individual, default=nothing, x=self._individual)
            return self._em.FluentExp(fluent, [subject]), value
        relation = self._fluent(prop, x=self._individual, y=self._individual)
        return self._em.FluentExp(relation, [subject, value]), True

    def _expression(self, term: Term, parameters: dict[str, Parameter]) -> FNode:
        match term:
            case Var(name):
                return self._em.ParameterExp(parameters[name])
            case str():
                return self.individual(term)
            case _:
                raise AssertionError(f"no individual: {term!r}")

    def _is(
        self, prop: str, subject: Term, value: Term, parameters: dict[str, Parameter]
    ) -> tuple[FNode, FNode | bool]:
        subject_exp = self._expression(subject, parameters)
        match value:
            case Var():
                return self._valued(prop, subject_exp, self._expression(value, parameters))
            case str() | int() | float():
                return self._of(prop, subject_exp, value)
            case _:
                raise AssertionError(f"no value: {value!r}")

    def condition(self, condition: Term, parameters: dict[str, Parameter]) -> FNode:
        """A condition of an operator, a method or a goal."""
        match condition:
            case list() | Struct("all", (list(),)):
                parts = condition if isinstance(condition, list) else condition.args[0]
                assert isinstance(parts, list)
                return self._em.And([self.condition(part, parameters) for part in parts])
            case Struct("any", (list(parts),)):
                return self._em.Or([self.condition(part, parameters) for part in parts])
            case Struct("not", (part,)):
                return self._em.Not(self.condition(part, parameters))
            case Struct("holds", (str(prop), subject, value)):
                fluent, wanted = self._is(prop, subject, value, parameters)
                return fluent if wanted is True else self._em.Equals(fluent, wanted)
            case Struct("same", (one, other)):
                return self._em.Equals(self._expression(one, parameters), self._expression(other, parameters))
            case Struct("compare", (str(op), one, other)):
                return self._compared(op, one, other, parameters)
            case Struct("is_a", (individual, str(kind))):
                able = self._fluent(f"is_{kind}", x=self._individual)
                return self._em.FluentExp(able, [self._expression(individual, parameters)])
            case _:
                raise AssertionError(f"no condition: {condition!r}")

    def _compared(self, op: str, one: Term, other: Term, parameters: dict[str, Parameter]) -> FNode:
        """Numbers do not change: which individuals' compare so is known."""
        names = sorted(variables([one, other]))
        fluent = self._fluent(f"{_said(one)}_{op}_{_said(other)}", **{name.lower(): self._individual for name in names})
        for individuals in product(self._world_individuals(), repeat=len(names)):
            binding: dict[str, Term] = dict(zip(names, individuals, strict=True))
            if self._world.compares(op, bound(one, binding), bound(other, binding)):
                self.problem.set_initial_value(
                    self._em.FluentExp(fluent, [self.individual(name) for name in individuals]), True
                )
        return self._em.FluentExp(fluent, [self._em.ParameterExp(parameters[name]) for name in names])

    def _world_individuals(self) -> list[str]:
        return sorted(name for name in self._objects if name in self._ontology.kinds)

    # Actions

    def _action(self, operator: Operator) -> Action:
        kinds = {name: operator.kinds[name] for name in operator.used}
        signature = {name: self.parameter_type(kind)[0] for name, kind in kinds.items()}
        for leg in operator.legs:
            robot = _said(leg.robot)
            signature[f"Profile_{robot}"] = self._env.type_manager.UserType("profile")
            if leg.origin is None:
                signature[f"Origin_{robot}"] = self._individual
        olds = self._olds(operator) if self._relational else {}
        for old in sorted(set(olds.values()) - signature.keys()):
            signature[old] = self._individual
        slots = [f"Slot_{number}" for number, _ in enumerate(operator.claims)] if self._timed else []
        for slot in slots:
            signature[slot] = self._env.type_manager.UserType("slot")
        sort = DurativeAction if self._timed else InstantaneousAction
        action = sort(operator.process, _env=self._env, **signature)
        parameters = {parameter.name: parameter for parameter in action.parameters}
        conditions = [*self.kind_conditions(kinds, parameters)]
        for capability, who in operator.requires:
            able = self._fluent(f"is_{capability}", x=self._individual)
            conditions.append(self._em.FluentExp(able, [self._expression(who, parameters)]))
        conditions += [self.condition(condition, parameters) for condition in operator.conditions]
        conditions += [
            self._em.Not(self._em.Equals(self._expression(a, parameters), self._expression(b, parameters)))
            for number, a in enumerate(operator.robots)
            for b in operator.robots[:number]
        ]
        duration = [self._em.Int(operator.fixed_ms)]
        for leg in operator.legs:
            conditions += self._leg(leg.robot, leg.origin, leg.goal, leg.odds, parameters, duration)
        effects: list[tuple[FNode, FNode | bool]] = []
        for prop, subject, becomes in self._effects(operator):
            if (prop, subject) in olds:
                old, _ = self._is(prop, subject, Var(olds[prop, subject]), parameters)
                conditions += [old] if old not in conditions else []
                effects.append((old, False))
            effects.append(self._is(prop, subject, becomes, parameters))
        if isinstance(action, InstantaneousAction):
            for condition in conditions:
                action.add_precondition(condition)
            for fluent, value in effects:
                action.add_effect(fluent, value)
            return action
        action.set_fixed_duration(self._em.Plus(duration) if len(duration) > 1 else duration[0])
        busy = [
            self._em.FluentExp(
                self._fluent("free", default=True, x=self._individual), [self._expression(r, parameters)]
            )
            for r in operator.robots
        ]
        for slot, resource in zip(slots, operator.claims, strict=True):
            slot_exp = self._em.ParameterExp(parameters[slot])
            slot_type = parameters[slot].type
            part = self._fluent("slot_of", slot=slot_type, x=self._individual)
            conditions.append(self._em.FluentExp(part, [slot_exp, self._expression(resource, parameters)]))
            busy.append(self._em.FluentExp(self._fluent("unused", default=True, slot=slot_type), [slot_exp]))
        for condition in [*conditions, *busy]:
            action.add_condition(StartTiming(), condition)
        for fluent in busy:
            action.add_effect(StartTiming(), fluent, False)
            action.add_effect(EndTiming(), fluent, True)
        for fluent, value in effects:
            action.add_effect(EndTiming(), fluent, value)
        return action

    def _effects(self, operator: Operator) -> Iterator[tuple[str, Term, Term]]:
        for effect in operator.effects:
            yield effect.prop, effect.subject, effect.value
            if effect.prop == Property.LOCATED_AT and self._travels(effect.subject, operator):
                yield POSITION, effect.subject, effect.value

    def _olds(self, operator: Operator) -> dict[tuple[str, Term], str]:
        """The parameters for values that end, by what they are values of."""
        starts = {(POSITION, leg.robot): f"Origin_{_said(leg.robot)}" for leg in operator.legs if leg.origin is None}
        return {
            (prop, subject): starts.get((prop, subject), f"Old_{prop}_{_said(subject)}")
            for prop, subject, value in self._effects(operator)
            if isinstance(value, Var) or (isinstance(value, str) and not self._ontology.datum_property(prop))
        }

    def _travels(self, subject: Term, operator: Operator) -> bool:
        if isinstance(subject, Var):
            kind = operator.kinds[subject.name]
            return kind == Kind.ROBOT or Kind.ROBOT in self._ontology.superclasses.get(kind, ())
        return self._ontology.is_a(str(subject), Kind.ROBOT)

    def _leg(
        self,
        robot: Term,
        origin: Term | None,
        goal: Term,
        odds: float,
        parameters: dict[str, Parameter],
        duration: list[FNode],
    ) -> Iterator[FNode]:
        profile_type = self._env.type_manager.UserType("profile")
        profile = self._em.ParameterExp(parameters[f"Profile_{_said(robot)}"])
        robot_exp = self._expression(robot, parameters)
        uses = self._fluent("profile_of", x=self._individual, profile=profile_type)
        yield self._em.FluentExp(uses, [robot_exp, profile])
        if origin is None:
            start = self._em.ParameterExp(parameters[f"Origin_{_said(robot)}"])
            fluent, wanted = self._valued(POSITION, robot_exp, start)
            yield fluent if wanted is True else self._em.Equals(fluent, wanted)
        else:
            start = self._expression(origin, parameters)
        ends = [profile, start, self._expression(goal, parameters)]
        table = {"profile": profile_type, "origin": self._individual, "goal": self._individual}
        yield self._em.FluentExp(self._fluent("way", **table), ends)
        if self._timed:
            integers = self._env.type_manager.IntType(0, HORIZON_MS)
            duration.append(self._em.FluentExp(self._fluent(_table(odds), integers, default=0, **table), ends))

    # The initial state

    def fill(self) -> None:
        """Give every fluent its initial values; a hierarchical problem, to be completed, is filled when it is."""
        self._fill_travel()
        self._fill_slots()
        for name, fluent in list(self._fluents.items()):
            for individual in self._world_individuals():
                subject = self.individual(individual)
                if name.startswith("is_") and len(fluent.signature) == 1:
                    if self._ontology.is_a(individual, name.removeprefix("is_")):
                        self.problem.set_initial_value(self._em.FluentExp(fluent, [subject]), True)
                    continue
                prop = name.partition("_is_")[0]
                if prop == POSITION and individual not in self._world.travel.profile:
                    continue
                values: list[Value] = [v for v in self._world.values(prop, individual) if self._told(name, prop, v)]
                if not values and name == prop and prop in self._changing and self._relational:
                    values.append("nothing")
                for value in values:
                    self.problem.set_initial_value(*self._of(prop, subject, value))

    def _told(self, fluent: str, prop: str, value: Value) -> bool:
        """Whether a fluent tells of this value of its property."""
        literal = not isinstance(value, str) or self._ontology.datum_property(prop)
        if not literal:
            return fluent == prop
        return fluent == f"{prop}_is_" + str(value).lower().replace(".", "_").replace("-", "minus_")

    def _fill_travel(self) -> None:
        if "way" not in self._fluents:
            return
        travel, way = self._world.travel, self._fluents["way"]
        profile_type = self._env.type_manager.UserType("profile")
        tables = {_table(leg.odds): leg.odds for o in self._world.offer.operators for leg in o.legs}
        for robot, number in sorted(travel.profile.items()):
            name = f"profile_{number}"
            first = name not in self._objects
            if first:
                self._objects[name] = Object(name, profile_type, self._env)
                self.problem.add_object(self._objects[name])
            profile = self._em.ObjectExp(self._objects[name])
            uses = self._em.FluentExp(self._fluents["profile_of"], [self.individual(robot), profile])
            self.problem.set_initial_value(uses, True)
            for origin in (here(robot), *(travel.places if first else ())):
                for goal in travel.places:
                    way_ms = self._world.travel_ms(robot, origin, goal)
                    if way_ms == NO_WAY:
                        continue
                    ends = [profile, self.individual(origin), self.individual(goal)]
                    self.problem.set_initial_value(self._em.FluentExp(way, ends), True)
                    for table, odds in tables.items():
                        if table in self._fluents:
                            entry = self._em.FluentExp(self._fluents[table], ends)
                            self.problem.set_initial_value(entry, expected_ms(way_ms, odds))

    def _fill_slots(self) -> None:
        if "slot_of" not in self._fluents:
            return
        slot_type = self._env.type_manager.UserType("slot")
        for resource in self._world_individuals():
            capacity = self._ontology.value("capacity", resource)
            for number in range(capacity if isinstance(capacity, int) else 1):
                name = f"slot_{number + 1}_of_{resource}"
                self._objects[name] = Object(name, slot_type, self._env)
                self.problem.add_object(self._objects[name])
                part = [self._em.ObjectExp(self._objects[name]), self.individual(resource)]
                self.problem.set_initial_value(self._em.FluentExp(self._fluents["slot_of"], part), True)


def _table(odds: float) -> str:
    return "travel_ms" if odds == 1.0 else f"travel_ms_at_odds_{odds}".replace(".", "_")


def _said(term: Term) -> str:
    match term:
        case Var(name):
            return name
        case Struct("plus" | "minus" | "times" as word, parts):
            return f"{word}_{'_and_'.join(map(_said, parts))}"
        case Struct(_, parts):
            return "_of_".join(map(_said, parts))
        case _:
            return str(term).replace(".", "_").replace("-", "minus_")
