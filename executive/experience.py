"""From a trace to what can be learned of it: tries of processes, and trips beside what was estimated for them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from executive.trace import (
    ActionFinished,
    FactsTold,
    KnowledgeAccepted,
    KnowledgeRolledBack,
    PlanMade,
    ProcessBegun,
    ProcessEnded,
    RecoveryChosen,
    TaskFinished,
    TraceEvent,
)
from grounding.outcome import OutcomeStatus
from kb.experience import Tries, Trip
from kb.learned_values import learned_values, one_try
from kb.ontology import Ontology
from kb.vocabulary import Kind, Property

_MS_PER_S = 1000
_NAMED = re.compile(r'"([^"]*)"')
_NO_TRY = frozenset({OutcomeStatus.REFUSED})
"""The call was not even made."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Gathered:
    """What a trace tells."""

    tries: tuple[Tries, ...]
    trips: tuple[Trip, ...]


def gather(events: Iterable[TraceEvent], ontology: Ontology, *, same_knowledge: bool) -> Gathered:
    """Read the tries and trips of a trace.

    A composite process is a try if it has a duration model: it succeeded if it ended, and failed when an action of its
    robot had failed meanwhile and was not tried again. A recovery is a try: whether the action was done then.

    Args:
        ontology: Of the site.
        same_knowledge: It is what the run had: only then do plans tell how long ways were estimated to be.
    """
    reading = _Reading(ontology, same_knowledge=same_knowledge)
    for event in events:
        reading.take(event)
    return Gathered(tries=reading.grouped(), trips=tuple(reading.trips))


class _Reading:
    def __init__(self, ontology: Ontology, *, same_knowledge: bool) -> None:
        self.trips: list[Trip] = []
        self._ontology, self._same_knowledge = ontology, same_knowledge
        self._tries: Counter[tuple[str, str, str, int, bool]] = Counter()
        self._planned: dict[str, list[tuple[str, float, float]]] = {}
        self._begun: dict[tuple[str, str], tuple[float, str, int | None]] = {}
        self._at: dict[str, str] = {}
        self._recovering: dict[tuple[str, str], tuple[str, str, float]] = {}
        self._learned = learned_values(ontology)

    def grouped(self) -> tuple[Tries, ...]:
        """All tries, those that went alike together."""
        return tuple(
            Tries(process=process, robot=robot, place=place, took_ms=ms, succeeded=succeeded, count=count)
            for (process, robot, place, ms, succeeded), count in sorted(self._tries.items())
        )

    def take(self, event: TraceEvent) -> None:
        """Take the next event in."""
        match event:
            case KnowledgeAccepted() | KnowledgeRolledBack():
                self._same_knowledge = False  # plans may be made by either for a while
            case PlanMade():
                self._planned[event.task] = [(action, start, end) for action, _, start, end in event.steps]
            case ProcessBegun() if self._ontology.value(Property.HAS_DURATION_MODEL, _name(event.process)) is not None:
                way = self._way_ms(event)
                self._begun[event.task, event.process] = (event.t_s, event.robot, way)
            case ProcessEnded():
                self._end(event)
            case ActionFinished():
                self._finish(event)
            case RecoveryChosen():
                self._recover(event)
            case FactsTold(prop=Property.LOCATED_AT, value=value):
                self._at[event.subject] = "" if value is None else str(value)
            case TaskFinished():
                self._recovering = {key: tried for key, tried in self._recovering.items() if key[0] != event.task}
                self._begun = {key: begun for key, begun in self._begun.items() if key[0] != event.task}
            case _:
                pass

    def _finish(self, event: ActionFinished) -> None:
        succeeded = event.outcome == OutcomeStatus.SUCCEEDED
        recovery, robot, _ = self._recovering.pop((event.task, event.action), ("", "", 0.0))
        if recovery:
            self._count(recovery, robot, event.elapsed_s, succeeded=succeeded)
        given_up = event.outcome == OutcomeStatus.TIMED_OUT and event.elapsed_s == 0  # before it began
        if event.outcome not in _NO_TRY and not given_up:
            self._count(event.action, event.robot, event.elapsed_s, succeeded=succeeded)

    def _recover(self, event: RecoveryChosen) -> None:
        for (task, what), (recovery, robot, chosen_s) in list(self._recovering.items()):
            if (task, robot) == (event.task, event.robot) and (not event.recovery or what == event.again):
                del self._recovering[task, what]  # what was begun again has failed again
                self._count(recovery, robot, event.t_s - chosen_s, succeeded=False)
        if event.recovery:
            self._recovering[event.task, event.again or event.action] = event.recovery, event.robot, event.t_s
        if event.recovery and not event.again:
            return
        for (task, process), (begun_s, robot, _) in list(self._begun.items()):
            if task == event.task and robot == event.robot:
                del self._begun[task, process]
                self._count(process, robot, event.t_s - begun_s, succeeded=False)

    def _end(self, event: ProcessEnded) -> None:
        recovery, robot, chosen_s = self._recovering.pop((event.task, event.process), ("", "", 0.0))
        if recovery:
            self._count(recovery, robot, event.t_s - chosen_s, succeeded=True)
        begun = self._begun.pop((event.task, event.process), None)
        if begun is None:
            return
        begun_s, robot, way_ms = begun
        took_s = event.t_s - begun_s
        self._count(event.process, robot, took_s, succeeded=True)
        if way_ms is not None:
            trip = Trip(
                process=_name(event.process),
                robot=robot,
                place=self._place(event.process, robot),
                way_ms=way_ms,
                took_ms=round(took_s * _MS_PER_S),
            )
            self.trips.append(trip)

    def _way_ms(self, event: ProcessBegun) -> int | None:
        """The estimated way of a process that begins: what its step in the plan takes, less what comes on top.

        A step is planned to take `round(factor * way / odds) + round(duration_s / odds)` (decision 0019).
        """
        steps = [(start, end) for action, start, end in self._planned.get(event.task, ()) if action == event.process]
        if not steps or not self._same_knowledge:
            return None
        start_s, end_s = min(steps, key=lambda step: abs(step[0] - event.t_s))
        place = self._place(event.process, event.robot)
        learned = self._learned.get((_name(event.process), event.robot), [])
        more_s, odds = one_try(self._ontology, _name(event.process), learned, place)
        stated = self._ontology.value(Property.TRAVEL_FACTOR, event.robot)
        factor = float(stated) if isinstance(stated, int | float) else 1.0
        return max(0, round(((end_s - start_s) * odds - more_s) / factor * _MS_PER_S))

    def _count(self, action: str, robot: str, took_s: float, *, succeeded: bool) -> None:
        key = (_name(action), robot, self._place(action, robot), round(took_s * _MS_PER_S), succeeded)
        self._tries[key] += 1

    def _place(self, action: str, robot: str) -> str:
        """The location that an action names last, such as its goal; else where its robot is, unless it travels."""
        named: list[str] = [name for name in _NAMED.findall(action) if self._ontology.is_a(name, Kind.LOCATION)]
        if named:
            return named[-1]
        if any(traveler == robot for _, traveler, _ in self._begun.values()):
            return ""
        stated = self._ontology.value(Property.LOCATED_AT, robot)
        return self._at.get(robot, "" if stated is None else str(stated))


def _name(action: str) -> str:
    return action.partition("(")[0]
