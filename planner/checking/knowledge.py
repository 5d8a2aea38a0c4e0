"""What is known in a moment of a plan, and which conditions hold then.

planner/golog/conditions.pl says the same in Prolog and shares no code.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from math import isfinite
from typing import TypeAlias

from kb.store import Snapshot
from kb.terms import Struct, Term, Var
from kb.vocabulary import Property
from planner.checking.moment import Binding, CannotCheck, Moment, OnlyActingTells, bound, same, shown

_Conjunct: TypeAlias = tuple[Term, frozenset[str]]
"""A condition that has to hold, and the variables in it."""

_ARITHMETIC = {"plus": operator.add, "minus": operator.sub, "times": operator.mul}
_COMPARISONS = {
    "less": operator.lt,
    "at_most": operator.le,
    "more": operator.gt,
    "at_least": operator.ge,
    "equal": operator.eq,
}


class Knowledge:
    """What is known of a moment: the ontology, what was told, what effects have set since."""

    def __init__(self, snapshot: Snapshot, truths: Mapping[str, bool], places: Mapping[str, str]) -> None:
        """Take what is known when the plan begins.

        Args:
            truths: What actions have found out, by place.
            places: Where robots are by now.
        """
        self._ontology = snapshot.ontology
        self._told = dict(snapshot.fluents)
        self._told.update({(Property.LOCATED_AT, robot): place for robot, place in places.items()})
        self._truths = truths
        self._members: dict[str, list[str]] = {}
        self._subjects: dict[str, set[str]] = {}

    def is_a(self, individual: str, kind: str) -> bool:
        """Whether an individual belongs to a class."""
        return self._ontology.is_a(individual, kind)

    def members(self, kind: str) -> list[str]:
        """The individuals of a class, by name."""
        if kind not in self._members:
            self._members[kind] = self._ontology.individuals(kind)
        return self._members[kind]

    def values(self, prop: str, subject: str, moment: Moment) -> Sequence[Term]:
        """All values of a property."""
        if (prop, subject) in moment.fluents:
            return (moment.fluents[prop, subject],)
        stated = self._ontology.values(prop, subject)
        told = self._told.get((prop, subject))
        return stated if told is None or told in stated[-1:] else (told,)

    def number(self, prop: str, subject: str, moment: Moment) -> float | None:
        """The value of a property that is a number."""
        for value in self.values(prop, subject, moment):
            if isinstance(value, int | float) and not isinstance(value, bool):
                return value
        return None

    def holds(self, condition: Term, binding: Binding, moment: Moment) -> bool:
        """Whether a condition holds; what is not known to hold does not.

        Raises:
            OnlyActingTells: It depends on that.
        """
        match condition:
            case Struct("all", (list(parts),)):
                return self._decided(parts, binding, moment, by=False)
            case Struct("any", (list(parts),)):
                return self._decided(parts, binding, moment, by=True)
            case Struct("not", (part,)):
                return not self.holds(part, binding, moment)
            case Struct("holds", (str(prop), subject, value)):
                wanted = bound(value, binding)
                known = self.values(prop, _individual(subject, binding), moment)
                return any(same(wanted, v) for v in known)
            case Struct("compare", (str(comparison), left, right)):
                sides = product(self._numbers(left, binding, moment), self._numbers(right, binding, moment))
                return any(_COMPARISONS[comparison](one, other) for one, other in sides)
            case Struct("is_a", (individual, str(kind))):
                return self.is_a(_individual(individual, binding), kind)
            case Struct("same", (one, other)):
                return same(bound(one, binding), bound(other, binding))
            case Struct("some", (list(over), part)):
                kinds = dict(map(_drawn, over))
                outside = {name: value for name, value in binding.items() if name not in kinds}
                return any(True for _ in self._join(kinds, _parts(part, kinds), outside, moment))
            case Struct("is_true", (location,)):
                place = shown(bound(location, binding))
                if place not in self._truths:
                    raise OnlyActingTells(place)
                return self._truths[place]
            case _:
                raise CannotCheck(f"no condition: {condition}")

    def _decided(self, parts: list[Term], binding: Binding, moment: Moment, *, by: bool) -> bool:
        """Whether any part holds (by=True), or all do; one part may decide though others are not known."""
        unknown: OnlyActingTells | None = None
        for part in parts:
            try:
                if self.holds(part, binding, moment) is by:
                    return by
            except OnlyActingTells as tells:
                unknown = tells
        if unknown is not None:
            raise unknown
        return not by

    def _numbers(self, term: Term, binding: Binding, moment: Moment) -> list[int | float]:
        """The numbers that one side of a comparison stands for; none if it stands for none."""
        match term:
            case Struct("value", (str(prop), subject)):
                found = self.values(prop, _individual(subject, binding), moment)
                return [v for v in found if isinstance(v, int | float) and not isinstance(v, bool)]
            case Struct("plus" | "minus" | "times" as word, (left, right)):
                sides = product(self._numbers(left, binding, moment), self._numbers(right, binding, moment))
                return [n for one, other in sides if (n := _calculated(word, one, other)) is not None]
            case _:
                value = bound(term, binding)
                return [value] if isinstance(value, int | float) and not isinstance(value, bool) else []

    def solutions(
        self, over: Sequence[tuple[str, str]], condition: Term, binding: Binding, moment: Moment
    ) -> list[tuple[str, ...]]:
        """The individuals of which a condition holds, in order of name.

        Args:
            over: Variables and their classes.

        Raises:
            OnlyActingTells: For some of them, it depends on that.
        """
        kinds: dict[str, str | None] = dict(over)
        found = self._join(kinds, _parts(condition, kinds), dict(binding), moment)
        return sorted({tuple([str(solution[name]) for name, _ in over]) for solution in found})

    def _join(
        self, kinds: Mapping[str, str | None], conditions: list[_Conjunct], binding: dict[str, Term], moment: Moment
    ) -> Iterator[dict[str, Term]]:
        """Extend a binding to all variables: conditions are asked as soon as they can be."""
        left, unknown = [], None
        for condition, variables in conditions:
            if not variables <= binding.keys():
                left.append((condition, variables))
                continue
            try:
                if not self.holds(condition, binding, moment):
                    return
            except OnlyActingTells as tells:
                left.append((condition, variables))
                unknown = tells
        free = [name for name in kinds if name not in binding]
        if not free and unknown is not None:
            raise unknown
        if not free:
            yield binding
            return
        name, values = self._next(kinds, left, binding, free, moment)
        kind = kinds[name]
        for value in values:
            if kind is None or (isinstance(value, str) and self.is_a(value, kind)):
                yield from self._join(kinds, left, {**binding, name: value}, moment)

    def _next(
        self,
        kinds: Mapping[str, str | None],
        conditions: list[_Conjunct],
        binding: Binding,
        free: list[str],
        moment: Moment,
    ) -> tuple[str, Sequence[Term]]:
        """The variable to bind next, and its candidates: where one is the value of something known, that is all."""
        followed = set()
        for condition, _ in conditions:
            match condition:
                case Struct("holds", (str(prop), subject, Var(name))) if name in free:
                    individual = bound(subject, binding)
                    if isinstance(individual, str):
                        return name, self.values(prop, individual, moment)
                    followed.add(name)
        for name in sorted(free, key=lambda name: name in followed):
            kind = kinds[name]
            if kind is not None:
                return name, self.members(kind)
        for condition, _ in conditions:
            match condition:
                case Struct("holds", (str(prop), Var(name), _)) if name in free:
                    return name, self._having(prop, moment)
                case Struct("is_a", (Var(name), str(kind))) if name in free:
                    return name, self.members(kind)
        raise CannotCheck(f"nothing says what {free[0]} is")

    def _having(self, prop: str, moment: Moment) -> list[str]:
        """Those of whom anything is known to have a property, by name."""
        if not self._subjects:
            for key, subject, _ in self._ontology.all_values():
                self._subjects.setdefault(key, set()).add(subject)
            for key, subject in self._told:
                self._subjects.setdefault(key, set()).add(subject)
        return sorted(self._subjects.get(prop, set()) | {s for key, s in moment.fluents if key == prop})


def _individual(term: Term, binding: Binding) -> str:
    individual = bound(term, binding)
    if isinstance(individual, Var):
        raise CannotCheck(f"nothing says who {individual.name} is")
    return str(individual)


def _calculated(word: str, one: float, other: float) -> float | None:
    """A sum, difference or product; None if it is beyond all numbers."""
    try:
        number: int | float = _ARITHMETIC[word](one, other)
        return None if isinstance(number, float) and not isfinite(number) else number
    except OverflowError:
        return None


def _drawn(variable: Term) -> tuple[str, str | None]:
    """Name and class of a variable of `some`; no class if it stands for what a property has."""
    match variable:
        case Struct("-", (Var(name), str(kind))):
            return name, kind
        case Var(name):
            return name, None
        case _:
            raise CannotCheck(f"no variable: {variable}")


def _parts(condition: Term, kinds: Mapping[str, str | None]) -> list[_Conjunct]:
    return [(part, frozenset(_variables(part, kinds))) for part in _conjuncts(condition)]


def _conjuncts(condition: Term) -> Iterator[Term]:
    match condition:
        case Struct("all", (list(parts),)):
            for part in parts:
                yield from _conjuncts(part)
        case _:
            yield condition


def _variables(term: Term, among: Mapping[str, str | None]) -> set[str]:
    match term:
        case Var(name):
            return {name} & among.keys()
        case Struct(_, parts):
            return set().union(*(_variables(p, among) for p in parts))
        case list():
            return set().union(*(_variables(p, among) for p in term))
        case _:
            return set()
