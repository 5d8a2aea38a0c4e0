"""What if: a request as it would be if a fact were another or a choice were taken otherwise.

A supposed session is planned like any other (the same solvers, the same independent checker) and guides
nothing. Prolog makes it (planner/golog/hypotheses.pl); what changes in the ontology, the program and the
travel times is changed here in the same way, for the checker.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from types import TracebackType
from typing import Any, Self

import numpy as np

from kb.compiler import Program
from kb.prolog import Entry
from kb.store import Snapshot
from kb.terms import Struct, Term, struct
from planner.making import MS_PER_S, travel_tables
from planner.network import NO_WAY, Label, Milliseconds, Travel
from planner.planner import Session, TravelTimes

_suppose = Entry(search_path="planner_golog", file="hypotheses", name="suppose")
_prospects = Entry(search_path="planner_golog", file="hypotheses", name="prospects")
_needed_travels = Entry(search_path="planner_golog", file="planning", name="needed_travels")
_look_ahead = Entry(search_path="planner_golog", file="planning", name="look_ahead")
_propose = Entry(search_path="planner_golog", file="planning", name="propose")
_drop_facts = Entry(search_path="kb_rules", file="facts", name="drop_facts")


class ChangeKind(StrEnum):
    """What sort of fact a change is about."""

    CAPABILITY = "capability"
    """A robot has a capability: `subject` belongs to the class `what`."""
    VALUE = "value"
    """The property `what` of `subject` has the value `value`."""
    WAY = "way"
    """The robot `subject` can get to the place `what`, as fast as another robot can, or else in no time."""
    TEAM = "team"
    """`value` robots may take part."""
    DEADLINE = "deadline"
    """The deadline in the process `subject` is `value` milliseconds after the request."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """One fact that would be otherwise.

    Attributes:
        subject: Whom or what it is about; empty for the team.
        what: The capability, property or place; empty for team and deadline.
        value: What it would be.
        now: What it is; None if that is not known or not a value.
        text: The same for people, as a clause in the past tense: "pico_1 were a RobotWithKinect".
    """

    kind: ChangeKind
    subject: str = ""
    what: str = ""
    value: str | int | float | bool = True
    now: str | int | float | bool | None = None
    text: str

    @property
    def term(self) -> Term | None:
        """As planner/golog/hypotheses.pl takes it; None for what only the travel times tell."""
        match self.kind:
            case ChangeKind.CAPABILITY:
                return struct("kind", self.subject, self.what)
            case ChangeKind.VALUE:
                return struct("value", self.what, self.subject, self.value)
            case ChangeKind.TEAM:
                return struct("team", self.value)
            case ChangeKind.DEADLINE:
                assert self.now is not None
                return struct("deadline", self.subject, self.now, self.value)
            case ChangeKind.WAY:
                return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """A choice that a program may come to.

    Attributes:
        kind: `individual` (a pick), `branch` (a choice of processes) or `part` (the next part of an any-order).
        labels: All that could be chosen, whether it leads anywhere or not.
        names: What each label is called, in the same order.
    """

    id: str
    kind: str
    labels: tuple[Label, ...]
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Battery:
    """A robot that can work for `energy_J` / `power_W` seconds in all, of which it has worked `worked_ms`."""

    robot: str
    energy_J: float  # noqa: N815  the unit
    power_W: float  # noqa: N815  the unit
    worked_ms: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Prospects:
    """What a program may come to.

    Attributes:
        options: By id of the choice.
        claims: The resources of each step and composite process, by id.
        deadlines: (process, milliseconds after the request), as written in the program.
        obstacles: Facts in the way, as rows of planner/golog/hypotheses.pl (planner/obstacles.py reads them).
    """

    options: Mapping[str, Option]
    claims: Mapping[str, tuple[str, ...]]
    deadlines: tuple[tuple[str, int], ...]
    batteries: tuple[Battery, ...]
    obstacles: tuple[tuple[Any, ...], ...]


class Supposed(Session):
    """A session of another that has changes; leaving it as a context forgets it."""

    def __init__(
        self, session: Session, key: str, *, changes: Sequence[Change] = (), only: Mapping[str, Label] | None = None
    ) -> None:
        """Take what `session` has come to.

        Args:
            key: No other session has it.
            only: Labels by the id of the choice: nothing else is chosen there.
        """
        self.__dict__.update(session.__dict__)  # Session.__init__ would begin the request anew
        self._key = key
        self._snapshot = _with_kinds(session._snapshot, changes)
        self._programs = [_with_deadlines(program, changes) for program in session._programs]
        self._robots = next((int(c.value) for c in changes if c.kind is ChangeKind.TEAM), session._robots)
        self._from_start = False  # what it begins with is no bare request
        terms = [c.term for c in changes if c.term is not None]
        terms += [struct("only", choice, label) for choice, label in sorted((only or {}).items())]
        _suppose(struct("supposition", session._key, key, terms))

    def look(self, travel_times: TravelTimes, now_s: float, below: str = "all") -> Prospects:
        """What the program may come to; obstacles only of what is below a choice, if one is given."""
        needed = _needed_travels(self._key)
        travel = travel_times(needed["robots"], needed["places"])
        _look_ahead(struct("ahead", self._key, round(now_s * MS_PER_S), travel_tables(travel)))
        answer = _prospects(struct("prospects", self._key, below))
        claims: dict[str, tuple[str, ...]] = {}
        for id_, resource in answer["claims"]:
            claims[id_] = (*claims.get(id_, ()), resource)
        return Prospects(
            options={
                id_: Option(id=id_, kind=kind, labels=tuple(labels), names=tuple(names))
                for id_, kind, labels, names in answer["choices"]
            },
            claims=claims,
            deadlines=tuple((process, ms) for process, ms in answer["deadlines"]),
            batteries=tuple(
                Battery(robot=r, energy_J=energy, power_W=power, worked_ms=worked)
                for r, energy, power, worked in answer["energies"]
            ),
            obstacles=tuple(tuple(map(_frozen, row)) for row in answer["obstacles"]),
        )

    def makespan_in_order(
        self, choices: Mapping[str, Sequence[Label]], order: Sequence[tuple[str, Sequence[str], Sequence[str]]]
    ) -> float | None:
        """Seconds that it takes along choices, everyone doing their steps in this order; None if it comes to no end.

        `look` comes before.

        Args:
            order: Of all steps: id, robots, resources.
        """
        taken: list[Term] = [struct("-", choice, label) for choice, labels in choices.items() for label in labels]
        steps: list[Term] = [
            struct("-", id_, [*robots, *(struct("resource", r) for r in resources)]) for id_, robots, resources in order
        ]
        answer = _propose(struct("proposal", self._key, taken, steps, -1))
        return None if answer["status"] == "stuck" else answer["makespan"] / MS_PER_S

    def close(self) -> None:
        """Forget the session and the facts of its own."""
        super().close()
        _drop_facts(self._key)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()


def with_ways(travel: Travel, changes: Sequence[Change]) -> Travel:
    """Travel times if robots could get to the places that changes of the kind `WAY` name, and on from there."""
    for change in changes:
        if change.kind is ChangeKind.WAY and change.subject in travel.profile and change.what in travel.places:
            travel = _opened(travel, change.subject, travel.places.index(change.what))
    return travel


def _opened(travel: Travel, robot: str, place: int) -> Travel:
    table = travel.between[travel.profile[robot]].copy()
    here = travel.here[robot].copy()
    fastest = _fastest(np.stack(travel.between))
    table[:, place] = np.where(table[:, place] == NO_WAY, fastest[:, place], table[:, place])
    table[place] = np.where(table[place] == NO_WAY, fastest[place], table[place])
    if here[place] == NO_WAY:
        here[place] = _fastest(np.stack(list(travel.here.values())))[place]
    return replace(
        travel,
        profile={**travel.profile, robot: len(travel.between)},
        between=(*travel.between, table),
        here={**travel.here, robot: here},
    )


def _fastest(times: Milliseconds) -> Milliseconds:
    """The least over the first axis; 0 where there is no way at all."""
    far = np.iinfo(np.int64).max
    least = np.where(times == NO_WAY, far, times).min(axis=0)
    return np.where(least == far, 0, least)


def _with_kinds(snapshot: Snapshot, changes: Sequence[Change]) -> Snapshot:
    kinds = dict(snapshot.ontology.kinds)
    for change in changes:
        if change.kind is ChangeKind.CAPABILITY:
            kinds[change.subject] = kinds[change.subject] | {change.what}
    return replace(snapshot, ontology=replace(snapshot.ontology, kinds=kinds))


def _with_deadlines(program: Program, changes: Sequence[Change]) -> Program:
    definitions = program.definitions
    for change in changes:
        if change.kind is ChangeKind.DEADLINE:
            definitions = tuple(_extended_in(change, d) for d in definitions)
    return replace(program, definitions=definitions)


def _extended_in(change: Change, definition: Term) -> Term:
    match definition:
        case Struct("proc", ((Struct(name) | str(name)) as head, body)) if name == change.subject:
            return struct("proc", head, _extended(body, change))
        case _:
            return definition


def _extended(term: Term, change: Change) -> Term:
    match term:
        case Struct("deadline", (ms, body)) if ms == change.now:
            return struct("deadline", change.value, _extended(body, change))
        case Struct(functor, arguments):
            return Struct(functor, tuple(_extended(a, change) for a in arguments))
        case list():
            return [_extended(t, change) for t in term]
        case _:
            return term


def _frozen(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
