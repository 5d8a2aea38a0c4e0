"""Goals: what a person wants to be true, checked against the ontology, and how it is reached."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from kb.errors import ConcertmasterError, Fault
from kb.ontology import fluent_properties
from kb.store import Snapshot
from kb.terms import Struct, Term, Value, Var, struct
from kb.vocabulary import Kind
from planner.classical_operators import KNOWN, Operator, offered
from planner.plan import PlanStatus

_PART = re.compile(
    r"(?P<no>not\s+)?(?P<prop>[\w-]+)\s*\(\s*(?P<subject>[\w.-]+)\s*\)\s*(?:(?P<op>!?=)\s*(?P<value>\S+))?"
)
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?([eE][-+]?\d+)?")


class BadGoal(ConcertmasterError):
    """A goal that makes no sense.

    Attributes:
        part: What of it.
        message: What is wrong, and what would be right.
    """

    fault: ClassVar[Fault] = "request"

    def __init__(self, part: str, message: str) -> None:
        super().__init__(part, message)
        self.part, self.message = part, message

    def __str__(self) -> str:
        return f"goal {self.part!r}: {self.message}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """What shall be true at the end, all of it.

    Attributes:
        text: As people write it.
        conditions: `holds(Property, Subject, Value)` and `not(...)` of it; the value of a property whose values are
            messages is `known`.
    """

    text: str
    conditions: tuple[Struct, ...]

    @property
    def names(self) -> frozenset[str]:
        """The individuals that it names."""
        found = set()
        for condition in self.conditions:
            inner = condition.args[0] if condition.functor == "not" else condition
            assert isinstance(inner, Struct)
            _, subject, value = inner.args
            found |= {str(subject), str(value)}
        return frozenset(found - {KNOWN})


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalStep:
    """A process of a plan; times in milliseconds since the plan is made.

    Attributes:
        name: Its step in the program.
        binding: Individuals by the variables of its operator.
        head: The process with its arguments.
    """

    name: str
    operator: Operator
    binding: Mapping[str, str]
    head: Term
    robots: tuple[str, ...]
    start_ms: int
    end_ms: int


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalPlan:
    """How a goal is reached.

    Attributes:
        makespan_ms: Of `program`; 0 where there is no plan.
        bound_ms: No plan takes less.
        steps: By start, then name.
        program: Sequence, conc and call terms, with `Frame` for the invocation; None: there is no plan.
        engine: What found it.
        reason: Why there is no plan, or why it is as good as it is.
    """

    goal: Goal
    status: PlanStatus
    makespan_ms: int
    bound_ms: int
    steps: tuple[GoalStep, ...]
    program: Term | None
    engine: str
    reason: str


def parse_goal(given: str | Sequence[str] | Mapping[str, object], snapshot: Snapshot) -> Goal:
    """Make a goal of what a person asked for.

    Args:
        given: `locatedAt(amigo_1)=at_bar and not locatedAt(pico_1)=at_bar and hasDetectedPosition(drink_1)`; or its
            parts, one by one; or values by `property(individual)`, None for a message that shall be known.

    Raises:
        BadGoal: It cannot be read; an unknown property or individual; a value that the property cannot have; two
            values for one property.
    """
    parts = list(_parts(given))
    if not parts:
        raise BadGoal("", "is empty; say what shall be true, such as locatedAt(ROBOT)=PLACE")
    checker = _Checker(snapshot)
    conditions = tuple(checker.condition(part) for part in parts)
    wanted: dict[tuple[Term, ...], Struct] = {}
    for part, condition in zip(parts, conditions, strict=True):
        if condition.functor == "holds":
            other = wanted.setdefault(condition.args[:2], condition)
            if other != condition:
                raise BadGoal(
                    part,
                    f"{condition.args[0]}({condition.args[1]}) has one value at a time, not {other.args[2]} as well",
                )
    return Goal(text=" and ".join(parts), conditions=conditions)


def _parts(given: str | Sequence[str] | Mapping[str, object]) -> Iterable[str]:
    match given:
        case str():
            yield from (part.strip() for part in re.split(r"\s+and\s+|,(?![^(]*\))", given) if part.strip())
        case Mapping():
            for subject, value in given.items():
                shown = str(value).lower() if isinstance(value, bool) else value
                yield subject if value is None else f"{subject}={shown}"
        case _:
            for part in given:
                yield from _parts(part)


class _Checker:
    def __init__(self, snapshot: Snapshot) -> None:
        self._ontology = snapshot.ontology
        self._fluents = sorted(fluent_properties(snapshot.ontology))
        self._things = sorted(
            {
                i
                for k in (Kind.ROBOT, Kind.AREA, Kind.LOCATION, Kind.PHYSICAL_OBJECT)
                for i in self._ontology.individuals(k)
            }
        )
        self._values: dict[str, set[Value]] = {}
        self._kinds: dict[str, set[str]] = {}
        for (prop, _), told in snapshot.fluents.items():
            self._values.setdefault(prop, set()).add(told)
        for operator in offered(snapshot).operators:
            for effect in operator.effects:
                match effect.value:
                    case Var(name):
                        self._kinds.setdefault(effect.prop, set()).add(operator.kinds[name])
                    case str() | int() | float() as value:
                        self._values.setdefault(effect.prop, set()).add(value)
                    case other:
                        raise AssertionError(f"no value of an effect: {other!r}")

    def condition(self, part: str) -> Struct:
        read = _PART.fullmatch(part)
        if read is None:
            raise BadGoal(part, "cannot be read; write property(individual)=value or not property(individual)=value")
        prop, subject, text = read["prop"], read["subject"], read["value"]
        if prop not in self._fluents:
            raise BadGoal(part, f"{prop} is no property that changes; {_near(prop, self._fluents, 'there is')}")
        if subject not in self._things:
            raise BadGoal(part, f"{subject} is not known; {_near(subject, self._things, 'there is')}")
        condition = struct("holds", prop, subject, self._value(part, prop, text))
        return struct("not", condition) if (read["no"] is not None) != (read["op"] == "!=") else condition

    def _value(self, part: str, prop: str, text: str | None) -> str | int | float:
        if self._ontology.datum_property(prop):
            if text is not None:
                raise BadGoal(
                    part, f"the values of {prop} are messages; ask for one to be known: {part.partition('=')[0]}"
                )
            return KNOWN
        values, kinds = self._values.get(prop, set()), sorted(self._kinds.get(prop, set()))
        literal = _literal("true" if text is None else text)
        if isinstance(literal, bool) and any(isinstance(v, bool) for v in values):
            return literal
        if not isinstance(literal, bool | str) and any(isinstance(v, int | float) for v in values):
            return literal
        right = sorted({v for v in values if isinstance(v, str)}.union(*map(self._ontology.individuals, kinds)))
        if text is not None and literal in right:
            assert isinstance(literal, str)
            return literal
        may_be = " or ".join(kinds) or ", ".join(sorted(map(str, values))) or "unknown values"
        if text is None:
            raise BadGoal(part, f"lacks a value; write {part}=..., where {prop} has {may_be}")
        what = f"a {self._ontology.kind_of(text)}" if text in self._ontology.kinds else "not known"
        raise BadGoal(part, f"{text} is {what}; {prop} has {may_be}; {_near(text, right, 'there is')}")


def _literal(text: str) -> str | int | float:
    if text in ("true", "false"):
        return text == "true"
    if _NUMBER.fullmatch(text):
        return int(text) if text.lstrip("+-").isdigit() else float(text)
    return text


def _near(wrong: str, right: Sequence[str], there_is: str) -> str:
    near = difflib.get_close_matches(wrong, right, n=1)
    return f"did you mean {near[0]}?" if near else f"{there_is} {', '.join(right) or 'none'}"
