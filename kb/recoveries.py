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
        self._classes: dict[str, str] = {}
        self._numbered: dict[tuple[str, str], tuple[str, str]] = {}
        for failure in sorted(ontology.superclasses):
            for code in map(str, ontology.values(Property.FAILURE_CODE, failure)):
                source, *number, name = code.split()
                self._classes[name] = failure
                for key in (name, *number):
                    self._numbered[_short(source), key] = self._numbered[_package(source), key] = (failure, name)

    def failure_class(self, code: str, action_type: str = "") -> str:
        """The class of failure that a service means by the name of a code, such as `NoPath`.

        Args:
            action_type: Whose code it is, if it is that of an action: names mean different things elsewhere.
        """
        known, _ = self._numbered.get((action_type, code), ("", ""))
        return known or self._classes.get(code, UNKNOWN_FAILURE)

    def code_name(self, action_type: str, number: int) -> str:
        """The name of a result code of an action, such as `nav2_msgs/NavigateToPose`; its number if it has none.

        Nav2's NavigateToPose passes on the codes of the actions that it uses: a number that the action itself has no
        name for is looked up in all of its package.
        """
        for source in (action_type, _package(action_type)):
            if found := self._numbered.get((source, str(number))):
                return found[1]
        return str(number)

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


def _short(source: str) -> str:
    """The name of a type without what family it is of."""
    return source.replace("/action/", "/").replace("/msg/", "/").replace("/srv/", "/")


def _package(source: str) -> str:
    return source.partition("/")[0]
