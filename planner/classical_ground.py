"""The states that operators lead through: facts, ground operators, and what can be said without search.

A state gives each (property, subject) its values. Where a robot travels from is one more property, since
it starts where it is, which need not be a place with a name.

`earliest` is the bound h^1 of Haslum and Geffner, "Heuristic planning with time and resources" (2001):
when each fact can hold at the earliest if nothing is ever undone and nobody waits for anybody. A goal
that is not reached even so is out of reach; a plan that takes no longer than its latest part is optimal.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import TypeAlias

from kb.store import Snapshot
from kb.terms import Struct, Term, Value, Var
from kb.vocabulary import Kind, Property
from planner.classical_operators import KNOWN, Offer, Operator, bound, expected_ms
from planner.network import NO_WAY, Travel

POSITION = "position"
"""The property of robots that travel starts from: a place of the travel table, or `here(Robot)`."""

Subject: TypeAlias = tuple[str, str]
"""(property, individual)."""

Fact: TypeAlias = tuple[str, str, Value]
"""(property, individual, value)."""

Literal: TypeAlias = tuple[Fact, bool]
"""A fact that has to hold, or has not to."""


def here(robot: str) -> str:
    """The place where a robot is at first."""
    return f"here_{robot}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ground:
    """An operator with individuals for its variables; its first leg begins anywhere.

    Attributes:
        conditions: All have to hold when it begins.
        effects: What the subjects' values are afterwards.
        travels: The robot whose position its duration depends on, and that of the first leg's goal; None: neither.
        rest_ms: What it takes beside that first leg.
    """

    operator: Operator
    binding: Mapping[str, str]
    conditions: frozenset[Literal]
    effects: Mapping[Subject, Value]
    travels: tuple[tuple[str, str, float], ...]
    rest_ms: int


class World:
    """What is true at first, and what operators can make of it."""

    def __init__(self, snapshot: Snapshot, offer: Offer, travel: Travel) -> None:
        self.snapshot, self.offer, self.travel = snapshot, offer, travel
        self._place = {place: number for number, place in enumerate(travel.places)}
        self.changed: frozenset[Subject] = frozenset(
            (effect.prop, subject)
            for operator in offer.operators
            for effect in operator.effects
            for subject in self._range(effect.subject, operator)
        )
        self.ground = tuple(ground for operator in offer.operators for ground in self._ground(operator))

    def values(self, prop: str, subject: str) -> tuple[Value, ...]:
        """The values that a property has at first."""
        if prop == POSITION:
            return (here(subject),)
        told = self.snapshot.fluents.get((prop, subject))
        if self.snapshot.ontology.datum_property(prop):
            return () if told is None else (KNOWN,)
        return self.snapshot.ontology.values(prop, subject) if told is None else (told,)

    def holds(self, fact: Fact) -> bool:
        """Whether a fact holds at first."""
        prop, subject, value = fact
        return any(type(v) is type(value) and v == value for v in self.values(prop, subject))

    def travel_ms(self, robot: str, origin: str, goal: str) -> int:
        """How long a robot travels; NO_WAY if it cannot."""
        column = self._place.get(goal)
        if column is None or robot not in self.travel.profile:
            return NO_WAY
        if origin == here(robot):
            return int(self.travel.here[robot][column])
        row = self._place.get(origin)
        return NO_WAY if row is None else int(self.travel.between[self.travel.profile[robot]][row, column])

    def cases(self, condition: Term, binding: Mapping[str, Term]) -> Iterator[frozenset[Literal]]:
        """The ways in which a condition can hold: what has to hold of what changes."""
        yield from self._cases(bound(condition, binding), wanted=True)

    def origins(self, ground: Ground) -> Iterator[tuple[tuple[str, ...], int]]:
        """From where a ground operator may begin: a position for each traveling robot, and its duration."""
        ways = []
        for robot, goal, odds in ground.travels:
            starts = (here(robot), *self.travel.places)
            times = ((start, self.travel_ms(robot, start, goal)) for start in starts)
            ways.append([(start, expected_ms(ms, odds)) for start, ms in times if ms != NO_WAY])
        for choice in product(*ways):
            yield tuple(start for start, _ in choice), ground.rest_ms + sum(ms for _, ms in choice)

    def earliest(self) -> dict[Fact, int]:
        """When each fact can hold at the earliest, in milliseconds; those that never can are left out."""
        times: dict[Fact, int] = {
            (prop, subject, value): 0 for prop, subject in self.subjects() for value in self.values(prop, subject)
        }
        pending = True
        while pending:
            pending = False
            for ground in self.ground:
                end_ms = self._earliest_end(ground, times)
                if end_ms is None:
                    continue
                for (prop, subject), value in ground.effects.items():
                    if end_ms < times.get((prop, subject, value), end_ms + 1):
                        times[prop, subject, value] = end_ms
                        pending = True
        return times

    def earliest_of(self, literals: frozenset[Literal], times: Mapping[Fact, int]) -> int | None:
        """When all literals can hold at the earliest; None: never."""
        latest = 0
        for fact, wanted in literals:
            if wanted:
                at = times.get(fact)
            elif not self.holds(fact):
                at = 0
            else:
                others = [ms for other, ms in times.items() if other[:2] == fact[:2] and other[2] != fact[2]]
                at = min(others, default=None)
            if at is None:
                return None
            latest = max(latest, at)
        return latest

    def subjects(self) -> Iterator[Subject]:
        """All that changes, sorted."""
        yield from sorted({*self.changed, *((POSITION, robot) for robot in self.travel.profile)})

    def _earliest_end(self, ground: Ground, times: Mapping[Fact, int]) -> int | None:
        begin_ms = self.earliest_of(ground.conditions, times)
        if begin_ms is None:
            return None
        ends = []
        for starts, duration_ms in self.origins(ground):
            arrivals = [times.get((POSITION, leg[0], at)) for leg, at in zip(ground.travels, starts, strict=True)]
            known = [ms for ms in arrivals if ms is not None]
            if len(known) == len(arrivals):
                ends.append(max([begin_ms, *known]) + duration_ms)
        return min(ends, default=None)

    def _range(self, term: Term, operator: Operator) -> list[str]:
        match term:
            case Var(name):
                return self.snapshot.ontology.individuals(operator.kinds[name])
            case _:
                return [str(term)]

    def _ground(self, operator: Operator) -> Iterator[Ground]:
        names = operator.used
        for individuals in product(*(self.snapshot.ontology.individuals(operator.kinds[name]) for name in names)):
            binding: dict[str, str] = dict(zip(names, individuals, strict=True))
            robots = [str(bound(robot, binding)) for robot in operator.robots]
            able = all(self.snapshot.ontology.is_a(str(bound(r, binding)), c) for c, r in operator.requires)
            if len(set(robots)) < len(robots) or not able:
                continue
            travels, rest_ms = self._legs(operator, binding)
            if rest_ms == NO_WAY:
                continue
            effects: dict[Subject, Value] = {}
            for effect in operator.effects:
                subject, value = str(bound(effect.subject, binding)), bound(effect.value, binding)
                assert isinstance(value, str | int | float)
                effects[effect.prop, subject] = value
                if effect.prop == Property.LOCATED_AT and self.snapshot.ontology.is_a(subject, Kind.ROBOT):
                    effects[POSITION, subject] = value
            cases = self._cases(bound(list(operator.conditions), binding), wanted=True)
            for conditions in dict.fromkeys(cases):  # of a rule, many are alike
                yield Ground(
                    operator=operator,
                    binding=binding,
                    conditions=conditions,
                    effects=effects,
                    travels=travels,
                    rest_ms=rest_ms,
                )

    def _legs(self, operator: Operator, binding: Mapping[str, Term]) -> tuple[tuple[tuple[str, str, float], ...], int]:
        travels, rest_ms = [], operator.fixed_ms
        for leg in operator.legs:
            robot, goal = str(bound(leg.robot, binding)), str(bound(leg.goal, binding))
            if leg.origin is None:
                travels.append((robot, goal, leg.odds))
                continue
            way_ms = self.travel_ms(robot, str(bound(leg.origin, binding)), goal)
            if way_ms == NO_WAY:
                return (), NO_WAY
            rest_ms += expected_ms(way_ms, leg.odds)
        return tuple(travels), rest_ms

    def _cases(self, condition: Term, *, wanted: bool) -> Iterator[frozenset[Literal]]:
        match condition:
            case list() if wanted:
                yield from self._all(condition, wanted=wanted)
            case Struct("all", (list(parts),)):
                yield from self._all(parts, wanted=True) if wanted else self._any(parts, wanted=False)
            case Struct("any", (list(parts),)):
                yield from self._any(parts, wanted=True) if wanted else self._all(parts, wanted=False)
            case Struct("not", (part,)):
                yield from self._cases(part, wanted=not wanted)
            case Struct("same", (one, other)):
                if (one == other) is wanted:
                    yield frozenset()
            case Struct("compare", (str(op), one, other)):
                if self.compares(op, one, other) is wanted:
                    yield frozenset()
            case Struct("is_a", (individual, str(kind))):
                if self.snapshot.ontology.is_a(str(individual), kind) is wanted:
                    yield frozenset()
            case Struct("holds", (str(prop), str(subject), str() | int() | float() as value)):
                fact: Fact = (prop, subject, value)
                if (prop, subject) in self.changed:
                    yield frozenset([(fact, wanted)])
                elif self.holds(fact) is wanted:
                    yield frozenset()
            case _:
                raise AssertionError(f"no condition of an operator: {condition!r}")

    def _all(self, parts: list[Term], *, wanted: bool) -> Iterator[frozenset[Literal]]:
        for choice in product(*(list(self._cases(part, wanted=wanted)) for part in parts)):
            union = frozenset[Literal]().union(*choice)
            if not any((fact, not positive) in union for fact, positive in union):
                yield union

    def _any(self, parts: list[Term], *, wanted: bool) -> Iterator[frozenset[Literal]]:
        for part in parts:
            yield from self._cases(part, wanted=wanted)

    def compares(self, op: str, one: Term, other: Term) -> bool:
        """Whether two numbers compare so; what is not known does not."""
        a, b = self._number(one), self._number(other)
        if a is None or b is None:
            return False
        return {"less": a < b, "at_most": a <= b, "more": a > b, "at_least": a >= b, "equal": a == b}[op]

    def _number(self, term: Term) -> float | None:
        match term:
            case Struct("value", (str(prop), str(subject))):
                numbers = [v for v in self.values(prop, subject) if isinstance(v, int | float)]
                return numbers[0] if numbers else None
            case Struct("plus" | "minus" | "times" as word, (one, other)):
                a, b = self._number(one), self._number(other)
                return None if a is None or b is None else {"plus": a + b, "minus": a - b, "times": a * b}[word]
            case int() | float():
                return term
            case _:
                return None
