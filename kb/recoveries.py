"""What an ontology says that can be done when an action has failed: classes of failure, and what may help."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from kb.ontology import Ontology
from kb.vocabulary import Kind, Property

UNKNOWN_FAILURE = "UnknownFailure"
"""The class of a failure whose code no class claims."""

MOST_ATTEMPTS = 10
"""Of a recovery that has no `maxAttempts`: nothing is tried for ever."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Retry:
    """The same robot does the failed step again.

    Attributes:
        name: Its individual in the ontology.
        time_s: How much time it takes, as a rule, until the step can go on.
        odds: The probability that it helps.
        attempts: How often at most it is tried for one step.
        pause_s: How long to wait before; a part of `time_s`.
    """

    name: str
    time_s: float
    odds: float
    attempts: int
    pause_s: float


class Recoveries:
    """What may help against the failures that services tell of."""

    def __init__(self, ontology: Ontology) -> None:
        """Read the classes of failure, their codes and their recoveries."""
        self._ontology = ontology
        self._classes = {
            code.split()[-1]: failure
            for failure in sorted(ontology.superclasses)
            for code in map(str, ontology.values(Property.FAILURE_CODE, failure))
        }

    def failure_class(self, code: str) -> str:
        """The class of failure that a service means by the name of a code, such as `NoPath`."""
        return self._classes.get(code, UNKNOWN_FAILURE)

    def retries(self, failure: str) -> tuple[Retry, ...]:
        """The ways to try again that may help against a class of failure, by name; those of the classes above too."""
        above = self._ontology.superclasses.get(failure, frozenset({failure}))
        names = {str(r) for kind in above for r in self._ontology.values(Property.RECOVERED_BY, kind)}
        return tuple(self._retry(name) for name in sorted(names) if self._ontology.is_a(name, Kind.RETRY))

    def _retry(self, name: str) -> Retry:
        numbers: Mapping[Property, float | None] = {prop: self._number(prop, name) for prop in _NUMBERS}
        attempts = numbers[Property.MAX_ATTEMPTS]
        return Retry(
            name=name,
            time_s=numbers[Property.RECOVERY_TIME_S] or 0.0,
            odds=numbers[Property.RECOVERY_ODDS] or 1.0,
            attempts=MOST_ATTEMPTS if attempts is None else int(attempts),
            pause_s=numbers[Property.PAUSE_S] or 0.0,
        )

    def _number(self, prop: Property, name: str) -> float | None:
        value = self._ontology.value(prop, name)
        return float(value) if isinstance(value, int | float) else None


_NUMBERS = (Property.RECOVERY_TIME_S, Property.RECOVERY_ODDS, Property.MAX_ATTEMPTS, Property.PAUSE_S)
