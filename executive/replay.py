"""Does what a trace tells once more, and compares: same inputs, same decisions, or the first difference."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path

from executive.errors import BadTrace
from executive.events import TaskStatus
from executive.fleet import Fleet, TaskHandle
from executive.live import KnowledgeInUse, KnowledgeProposal
from executive.recorder import KNOWLEDGE
from executive.trace import (
    FactsTold,
    FleetOpened,
    KnowledgeAccepted,
    KnowledgeProposed,
    KnowledgeRefused,
    KnowledgeRolledBack,
    PersonAsked,
    PersonHasAnswered,
    TaskAccepted,
    TaskStatusChanged,
    TraceEvent,
    to_json,
)
from kb.history import SourceKind


def scenario_of(named: str) -> str | Path:
    """A scenario as a person names it: a TOML file, or a shipped one."""
    return Path(named) if named.endswith(".toml") else named


def kept_knowledge(beside: Path | None, digest: str) -> Path | None:
    """Where files of this hash are kept beside a trace, if they are."""
    folder = beside / KNOWLEDGE / digest if beside else None
    return folder if folder and folder.is_dir() else None


def first_difference(events: Sequence[TraceEvent], knowledge: Path, beside: Path | None = None) -> str:
    """Open the same fleet, do what people did at the same times (file, cancel, tell), and compare event by event.

    Args:
        events: A trace; if it ends before its tasks did, so does the comparison.
        knowledge: Folder of the ontologies that it was recorded with.
        beside: Folder of the trace, if it has one: revisions that were kept there are read in place of the folders
            where they were then, which may be others now.

    Returns:
        Number of the first event that differs and both sides; empty if none does.

    Raises:
        BadTrace: It does not begin with a fleet being opened.
    """
    opened = events[0] if events else None
    if not isinstance(opened, FleetOpened):
        raise BadTrace("trace", 1, "does not begin with fleet_opened, so it is not known what to do again")
    if opened.connect:
        raise BadTrace("trace", 1, f"is of robots at {opened.connect}; what they did cannot be done again, only read")
    with Fleet.open(
        opened.site,
        scenario=scenario_of(opened.scenario),
        knowledge=knowledge,
        seed=opened.seed,
        compute=Path(opened.compute) if opened.compute else None,
        faults=Path(opened.faults) if opened.faults else None,
    ) as fleet:
        tasks: dict[str, TaskHandle] = {}
        proposed: KnowledgeProposal | None = None
        if any(isinstance(event, PersonAsked) for event in events):
            fleet.listen(lambda _: None)
        for event in filter(_is_of_a_person, events):
            fleet.parts.clock.call_at(max(event.t_s, 0.0), _look_up)
        for number, event in enumerate(events):
            by_person = _is_of_a_person(event)
            if by_person:
                _go_on(fleet, number, event.t_s)
            match event:
                case TaskAccepted():
                    if "robots" in event.arguments:
                        raise BadTrace("trace", 0, f"{event.task} has an argument 'robots', which no task has")
                    tasks[event.task] = (
                        fleet.request_goal(event.goal)
                        if event.goal
                        else fleet.request(event.process, robots=event.robots, **event.arguments)
                    )
                case TaskStatusChanged() if event.status == TaskStatus.CANCELED:
                    if event.task not in tasks:
                        raise BadTrace("trace", 0, f"tells of the end of {event.task}, but not that it was accepted")
                    tasks[event.task].cancel()
                case FactsTold(prop=prop, subject=subject, value=str() | float() | bool() as value) if by_person:
                    fleet.tell(prop, subject, value)
                case PersonHasAnswered() if by_person:
                    fleet.answer(event.number, helped=event.helped, reason=event.reason)
                case KnowledgeProposed() | KnowledgeAccepted() | KnowledgeRolledBack() | KnowledgeRefused():
                    proposed = _change_knowledge(fleet, event, number, proposed, beside)
                case _:
                    pass
        for task in tasks.values():
            task.wait()
        again = list(fleet.trace)[: len(events)]
    for number, (one, other) in enumerate(zip_longest(events, again), start=1):
        was = to_json(_anywhere(one)) if one else "nothing"
        now = to_json(_anywhere(other)) if other else "nothing"
        if was != now:
            return f"event {number} differs\n- {was}\n+ {now}"
    return ""


def _anywhere(event: TraceEvent) -> TraceEvent:
    """An event without the folder that files were read from."""
    return replace(event, folder="") if isinstance(event, KnowledgeProposed | KnowledgeRefused) else event


def _change_knowledge(
    fleet: Fleet,
    event: KnowledgeProposed | KnowledgeAccepted | KnowledgeRolledBack | KnowledgeRefused,
    number: int,
    proposed: KnowledgeProposal | None,
    beside: Path | None,
) -> KnowledgeProposal | None:
    """Propose, accept or refuse knowledge as a person did, or who watched a folder; what is proposed then."""
    live, known = fleet.parts.live, fleet.parts.knowledge
    match event:
        case KnowledgeProposed() if event.revision in {r.number for r in known.revisions}:
            return live.propose_earlier(event.revision)
        case KnowledgeProposed():
            folder = kept_knowledge(beside, event.knowledge) or Path(event.folder)
            found = known.read(folder).digest
            if found != event.knowledge:
                told = f"revision {event.revision} was read from {event.folder}, whose files are others now"
                raise BadTrace(
                    "trace", number + 1, f"cannot be repeated: {told} (hash {found}, then {event.knowledge})"
                )
            return live.propose(folder)
        case KnowledgeRefused(revision=0):
            live.reject(event.folder, event.reason)  # what was wrong is not in the folder any more
        case _:
            if proposed is None:
                raise BadTrace("trace", number + 1, f"tells of revision {event.revision}, but not that it was proposed")
            with suppress(KnowledgeInUse):  # refused then, and again
                live.accept(proposed)
    return proposed


def _is_of_a_person(event: TraceEvent) -> bool:
    """Whether a person stepped in there."""
    match event:
        case TaskAccepted():
            return True
        case TaskStatusChanged():
            return event.status == TaskStatus.CANCELED
        case FactsTold():
            return not event.task and event.source in ("", SourceKind.PERSON)  # of old traces, the source is not known
        case KnowledgeProposed() | KnowledgeAccepted() | KnowledgeRolledBack() | KnowledgeRefused():
            return True
        case PersonHasAnswered():
            return event.in_time
        case _:
            return False


def _look_up() -> None:
    """What is asked for first at an instant happens first: the clock stops there before anything else happens."""


def _go_on(fleet: Fleet, events: int, t_s: float) -> None:
    """Up to where a person stepped in: after so many events, as several may share an instant, and not before a time."""
    fleet.parts.clock.run_until(lambda: len(fleet.trace) >= events and fleet.now_s >= t_s)
