"""What stands in the way of a robot or a branch: the fact, a sentence for people, and what would remove it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from kb.ontology import Ontology, Value
from kb.vocabulary import Kind, Property
from planner.hypotheses import Battery, Change, ChangeKind

PLENTY_MS = 10**9
"""More than any request takes: a battery or a deadline that is none."""

_MS_PER_S = 1000
_WORDS = {
    "less": "less than",
    "at_most": "at most",
    "more": "more than",
    "at_least": "at least",
    "equal": "",
    "differs": "other than",
}
_ANOTHER = "another value"
"""Stands for any other individual where a value has to differ."""


class ObstacleKind(StrEnum):
    """What sort of fact is in the way."""

    CAPABILITY = "capability"
    """A robot lacks a sensor, an actuator or software."""
    CONDITION = "condition"
    """A precondition does not hold: a limit is exceeded, a value is another."""
    WAY = "way"
    """A robot cannot get there."""
    BATTERY = "battery"
    """One step alone takes longer than the robot can work."""
    SAME_ROBOT = "same robot"
    """Different robots are needed."""
    NOBODY = "nobody"
    """There is no individual to choose."""
    FAILED = "failed"
    """It has failed there before."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """A fact in the way of a process.

    Attributes:
        robots: Whose process it is; empty if that needs no robot.
        lasting: Nothing that the program does changes the fact.
        change: What would remove it, alone; None if no single fact would.
    """

    kind: ObstacleKind
    process: str
    robots: tuple[str, ...]
    lasting: bool
    text: str
    change: Change | None


def read_obstacles(
    rows: Iterable[tuple[Any, ...]], batteries: Iterable[Battery], ontology: Ontology
) -> tuple[Obstacle, ...]:
    """What planner/golog/hypotheses.pl tells, each fact once (of the outermost process), what lasts first."""
    energies = {b.robot: b for b in batteries}
    found: dict[tuple[Any, ...], Obstacle] = {}
    for kind, process, *facts in rows:
        found.setdefault((kind, *facts), _obstacle(kind, process, facts, energies, ontology))
    return tuple(sorted(found.values(), key=lambda o: not o.lasting))


def energy_change(battery: Battery, needed_ms: int | None = None) -> Change:
    """A robot that can work for so long in all; None: as long as it takes."""
    seconds = (PLENTY_MS if needed_ms is None else needed_ms + 1) / _MS_PER_S  # a millisecond for rounding
    value = math.ceil(battery.power_W * seconds * _MS_PER_S) / _MS_PER_S
    told = "enough" if needed_ms is None else f"at least {value:g}"
    return Change(
        kind=ChangeKind.VALUE,
        subject=battery.robot,
        what=Property.ENERGY_J,
        value=value,
        now=battery.energy_J,
        text=f"{Property.ENERGY_J}({battery.robot}) were {told} (now {battery.energy_J:g})",
    )


def _obstacle(
    kind: str, process: str, facts: list[Any], energies: Mapping[str, Battery], ontology: Ontology
) -> Obstacle:
    def about(
        what: ObstacleKind, robots: tuple[str, ...], why: str, change: Change | None, lasting: bool = True
    ) -> Obstacle:
        who = " and ".join(robots)
        told = f"{who} cannot do {process}: {why}" if robots else f"{process} cannot be done: {why}"
        return Obstacle(kind=what, process=process, robots=robots, lasting=lasting, text=told, change=change)

    match kind, facts:
        case "lacks", [robot, Property.IS_REACHABLE]:
            return about(ObstacleKind.CAPABILITY, (robot,), "it does not answer", None)
        case "lacks", [robot, capability]:
            means = ontology.definition(capability)
            told = f"{capability} ({means})" if means else capability
            wish = f"{robot} were a {capability}"
            change = Change(kind=ChangeKind.CAPABILITY, subject=robot, what=capability, text=wish)
            return about(ObstacleKind.CAPABILITY, (robot,), f"it is no {told}", change)
        case "is_no", [robots, individual, wanted]:
            means = ontology.definition(wanted)
            told = f"{individual} is no {wanted} ({means})" if means else f"{individual} is no {wanted}"
            change = Change(
                kind=ChangeKind.CAPABILITY, subject=individual, what=wanted, text=f"{individual} were a {wanted}"
            )
            return about(ObstacleKind.CONDITION, robots, told, change)
        case "twice", [robot]:
            return about(ObstacleKind.SAME_ROBOT, (robot,), "it takes different robots", None)
        case "nobody", [wanted]:
            return about(ObstacleKind.NOBODY, (), f"there is no {wanted}", None)
        case "failed", [individual, choice]:
            return about(ObstacleKind.FAILED, (individual,), f"it has failed at {choice}", None)
        case "way", [robot, place]:
            change = Change(
                kind=ChangeKind.WAY, subject=robot, what=place, text=f"there were a way to {place} for {robot}"
            )
            return about(ObstacleKind.WAY, (robot,), f"there is no way to {place}", change)
        case "battery", [robot, needed_ms, left_ms]:
            why = f"it takes {needed_ms / _MS_PER_S:g} s of work, and the battery lasts for {left_ms / _MS_PER_S:g} s"
            return about(ObstacleKind.BATTERY, (robot,), why, energy_change(energies[robot]))
        case "broken", [robots, lasting, prop, subject, known, relation, wanted, other]:
            shown = f"{prop}({subject})"
            is_now = "is not known" if known is None else f"is {_shown(known)}"
            why = f"{shown} {is_now} and has to be {_told(relation, wanted, other)}"
            away = prop == Property.LOCATED_AT and ontology.is_a(subject, Kind.ROBOT)  # it stands where it stands
            return about(ObstacleKind.CONDITION, robots, why, None if away else _value(facts), lasting)
        case _:
            raise ValueError(f"no obstacle: {kind} {facts}")


def _value(facts: list[Any]) -> Change | None:
    """The value that makes a condition hold; None where what it is compared with is not known either."""
    _, _, prop, subject, known, relation, wanted, other = facts
    if wanted is None:
        return None
    now = "not known" if known is None else f"now {_shown(known)}"
    told = _told(relation, wanted, other)
    return Change(
        kind=ChangeKind.VALUE,
        subject=subject,
        what=prop,
        value=_satisfying(relation, wanted),
        now=known,
        text=f"{prop}({subject}) were {told} ({now})",
    )


def _satisfying(relation: str, wanted: Value) -> Value:
    """The value nearest to what is wanted that is in the relation to it."""
    match relation, wanted:
        case "differs", bool():
            return not wanted
        case "differs", str():
            return _ANOTHER
        case (("more" | "differs"), int()):
            return wanted + 1
        case "less", int():
            return wanted - 1
        case (("more" | "differs"), float()):
            return math.nextafter(wanted, math.inf)
        case "less", float():
            return math.nextafter(wanted, -math.inf)
        case _:
            return wanted


def _told(relation: str, wanted: Value | None, other: tuple[str, str] | None) -> str:
    if relation == "differs" and isinstance(wanted, bool):
        relation, wanted = "equal", not wanted
    word = _WORDS[relation]
    if other is None:
        told = _shown(wanted)
    elif wanted is None:
        told = f"{other[0]}({other[1]}), which is not known"
    else:
        told = f"{other[0]}({other[1]}), {_shown(wanted)}"
    return f"{word} {told}".strip()


def _shown(value: Value | None) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case float():
            return f"{value:g}"
        case _:
            return str(value)
