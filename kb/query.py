"""Questions about what is known, in Python: what there is, where it is, who can do what, and from where that is known.

with a snapshot of a `KnowledgeBase`:
Questions(snapshot).robots_able("SearchDrink")     -> ["amigo_1", "pico_1"]
Questions(snapshot).facts("drink_1")               -> every value, with its origin and place
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

from kb.entities import Entities, Place, Role
from kb.names import UnknownName
from kb.ontology import Value
from kb.processes import Process, realizing
from kb.readiness import Verdict, matrix, roles
from kb.sparql import TIME_LIMIT_S, Answer, Endpoint
from kb.store import Snapshot
from kb.vocabulary import Kind, Property


class Origin(StrEnum):
    """How something is known."""

    STATED = "stated"
    """A file says so of the individual itself."""
    INFERRED = "inferred"
    """It follows from what files say: from the individual's class, a sub-property, a transitive property."""
    TOLD = "told"
    """It was told since the files were read."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fact:
    """A value of a property of an individual.

    Attributes:
        place: Where it is stated; None unless it is.
    """

    prop: str
    subject: str
    value: Value
    origin: Origin
    place: Place | None


class Questions:
    """Answers from one snapshot; every method raises UnknownName for names that are not known."""

    def __init__(self, snapshot: Snapshot) -> None:
        self._snapshot = snapshot
        self._ontology = snapshot.ontology
        self._entities = Entities(snapshot.ontology)
        self._known: dict[str, set[str]] = {}
        """Properties that have a value, by individual."""
        pairs = [(prop, subject) for prop, subject, _ in snapshot.ontology.all_values()]
        for prop, subject in (*pairs, *snapshot.fluents):
            self._known.setdefault(subject, set()).add(prop)
        self._in_area: dict[str, set[str]] = {}
        self._located: dict[str, set[str]] = {}
        for prop, subject, value in snapshot.ontology.all_values():
            if prop == Property.IN_AREA:
                self._in_area.setdefault(str(value), set()).add(subject)
        for (prop, subject), value in snapshot.fluents.items():
            if prop == Property.LOCATED_AT:
                self._located.setdefault(str(value), set()).add(subject)

    # What there is

    def individuals(self, kind: str, *, stated: bool = False) -> list[str]:
        """The individuals of a class, by name.

        Args:
            stated: Only those of which a file says so itself; else those too for which it follows.
        """
        self._require_role(kind, Role.CLASS)
        found = self._ontology.individuals(kind)
        return [i for i in found if self._entities.stated_kind(kind, i) is not None] if stated else found

    def kinds(self, individual: str, *, stated: bool = False) -> list[str]:
        """The classes of an individual, by name."""
        self._require_individual(individual)
        found = sorted(k for k in self._ontology.kinds[individual] if self._entities.key(k, Role.CLASS) is not None)
        return [k for k in found if self._entities.stated_kind(k, individual) is not None] if stated else found

    def value(self, prop: str, subject: str) -> Value | None:
        """The present value of a property that has one; None where nothing is known."""
        values = self.values(prop, subject)
        return values[0] if values else None

    def values(self, prop: str, subject: str, *, stated: bool = False) -> tuple[Value, ...]:
        """The present values of a property.

        Args:
            stated: Only those that a file states of the individual itself, and what has been told.
        """
        self._require_role(prop, Role.PROPERTY)
        self._require_individual(subject)
        told = self._snapshot.fluents.get((prop, subject))
        values = self._ontology.values(prop, subject) if told is None else (told,)
        if not stated:
            return values
        return tuple(v for v in values if self._fact(prop, subject, v).origin is not Origin.INFERRED)

    def facts(self, subject: str) -> tuple[Fact, ...]:
        """All that is known of an individual now, by property and value."""
        self._require_individual(subject)
        props = sorted(self._known.get(subject, ()))
        return tuple(self._fact(p, subject, value) for p in props for value in self.values(p, subject))

    # Where things are

    def where(self, thing: str) -> str | None:
        """The location where a robot or a thing is, as far as known."""
        value = self.value(Property.LOCATED_AT, thing)
        return None if value is None else str(value)

    def at(self, place: str) -> list[str]:
        """What is at a location, or at a location of an area, or is itself part of that area; by name."""
        self._require_individual(place)
        inside = self._in_area.get(place, set())
        return sorted(inside.union(*(self._located.get(p, set()) for p in (place, *inside))))

    # Who can do what

    def tasks(self) -> list[str]:
        """What may be asked for: the processes all of whose inputs are individuals; by name."""
        return sorted(n for n, p in self._snapshot.processes.items() if not any(i.is_datum for i in p.inputs))

    def recipes(self, task: str) -> list[str]:
        """The processes that accomplish a task: those that realize a task type and are not retired, else itself."""
        process = self._process(task)
        if not self._ontology.is_a(process.name, Kind.SIMPLE_PROCESS):
            return [task]
        return realizing(self._ontology, task)

    def robots_able(self, task: str, *, now: bool = False) -> list[str]:
        """The robots that can take part in a task; all robots where it needs none.

        Args:
            now: As things stand; else as far as capabilities go.
        """
        self._process(task)
        robots = self._ontology.individuals(Kind.ROBOT)
        if not roles(self._snapshot, task):
            return robots
        right = (Verdict.ABLE,) if now else (Verdict.ABLE, Verdict.NOT_NOW)
        return [found.who for found in matrix(self._snapshot, robots, [task]) if found.verdict in right]

    def tasks_of(self, robot: str) -> list[str]:
        """The tasks that a robot can take part in, as far as capabilities go."""
        self._require(robot, "robot", self._ontology.individuals(Kind.ROBOT))
        return [t for t in self.tasks() if roles(self._snapshot, t) and robot in self.robots_able(t)]

    # Anything else

    def sparql(self, query: str, *, time_limit_s: float = TIME_LIMIT_S) -> Answer:
        """Answer a SPARQL query: see kb/sparql.py.

        Raises:
            kb.sparql.BadQuery: It is wrong, would change something, or takes too much.
        """
        return self._endpoint.ask(query, time_limit_s=time_limit_s)

    @cached_property
    def _endpoint(self) -> Endpoint:
        return Endpoint(self._ontology, self._snapshot.fluents)

    def _fact(self, prop: str, subject: str, value: Value) -> Fact:
        place = self._entities.stated(prop, subject, value)
        told = self._snapshot.fluents.get((prop, subject))
        if place is not None:
            origin = Origin.STATED
        else:
            is_told = told is not None and told not in self._ontology.values(prop, subject)
            origin = Origin.TOLD if is_told else Origin.INFERRED
        return Fact(prop=prop, subject=subject, value=value, origin=origin, place=place)

    def _process(self, name: str) -> Process:
        self._require(name, "process", self._snapshot.processes)
        return self._snapshot.processes[name]

    def _require_role(self, name: str, role: Role) -> None:
        if self._entities.key(name, role) is None:
            known = [n for n in self._entities.local_names if self._entities.key(n, role) is not None]
            raise UnknownName(name, role, known)

    def _require_individual(self, name: str) -> None:
        self._require(name, "individual", self._ontology.kinds)

    def _require(self, name: str, what: str, known: Iterable[str]) -> None:
        if name not in known:
            raise UnknownName(name, what, known)
