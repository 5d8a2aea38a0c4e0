"""What was learned of single robots, everywhere or at a place, as an ontology has it: class LearnedValue."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from kb.ontology import Ontology
from kb.vocabulary import Kind, Property


@dataclass(frozen=True, slots=True, kw_only=True)
class LearnedValue:
    """How a process goes where one robot does it.

    Attributes:
        entity: Its individual in the ontology.
        place: Empty if it holds everywhere.
        duration_s: None if only the odds were learned.
        odds: None if only the duration was learned.
    """

    entity: str
    process: str
    robot: str
    place: str
    duration_s: float | None
    odds: float | None


def learned_values(ontology: Ontology) -> dict[tuple[str, str], list[LearnedValue]]:
    """All of them, by process and robot; what holds everywhere first."""
    found: dict[tuple[str, str], list[LearnedValue]] = {}
    for entity in ontology.individuals(Kind.LEARNED_VALUE):
        process, robot, place = (
            str(ontology.value(prop, entity) or "")
            for prop in (Property.OF_PROCESS, Property.OF_ROBOT, Property.AT_PLACE)
        )
        duration_s, odds = (
            _number(ontology, prop, entity) for prop in (Property.LEARNED_DURATION_S, Property.LEARNED_ODDS)
        )
        value = LearnedValue(entity=entity, process=process, robot=robot, place=place, duration_s=duration_s, odds=odds)
        found.setdefault((process, robot), []).append(value)
    return {key: sorted(values, key=lambda v: (v.place, v.entity)) for key, values in sorted(found.items())}


def one_try(ontology: Ontology, process: str, learned: Iterable[LearnedValue], place: str) -> tuple[float, float]:
    """How long a try takes besides the travel (s), and its odds: of the robot there, else of the robot, else of all.

    Args:
        learned: Of the process and the robot, as `learned_values` has them.
    """
    duration_s = _number(ontology, Property.DURATION_S, process) or 0.0
    odds = _number(ontology, Property.SUCCESS_ODDS, process)
    odds = 1.0 if odds is None else odds
    for value in learned:
        if value.place in ("", place):
            duration_s = duration_s if value.duration_s is None else value.duration_s
            odds = odds if value.odds is None else value.odds
    return duration_s, odds


def _number(ontology: Ontology, prop: Property, entity: str) -> float | None:
    value = ontology.value(prop, entity)
    return float(value) if isinstance(value, int | float) else None
