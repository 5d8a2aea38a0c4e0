"""What an ontology says that can be done when an action has failed: classes of failure, and what may help."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from kb.ontology import Ontology
from kb.vocabulary import Kind, Property

UNKNOWN_FAILURE = "UnknownFailure"
"""The class of a failure whose code no class claims."""

MOST_ATTEMPTS = 10
"""Of a recovery that has no `maxAttempts`: nothing is tried for ever."""


class RecoveryKind(StrEnum):
    """What is done, beside another choice of the robot: that is always possible."""

    RETRY = Kind.RETRY.value
    """The failed step again, by the same robot."""
    REPLAN = Kind.REPLAN.value
    """A process around the step is begun again, planned from what is known now."""
    PROCESS = Kind.PROCESS_RECOVERY.value
    """The same, after another process."""
    ASK_PERSON = Kind.ASK_PERSON.value
    """The same, when a person has helped."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Recovery:
    """What may help after a failure.

    Attributes:
        name: Its individual in the ontology.
        time_s: How much time it takes, as a rule, until the step can go on.
        odds: The probability that it helps.
        attempts: How often at most it is tried for one step.
        pause_s: How long to wait before; a part of `time_s`.
        process: What is done before; empty where nothing is.
    """

    name: str
    kind: RecoveryKind = RecoveryKind.RETRY
    time_s: float
    odds: float
    attempts: int
    pause_s: float = 0.0
    process: str = ""


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

    def is_of_robot(self, failure: str) -> bool:
        """Whether it makes no difference to a class of failure where the robot is to go, and in which way."""
        above = self._ontology.superclasses.get(failure, frozenset({failure}))
        return any(self._ontology.value(Property.CONCERNS_ROBOT, kind) is True for kind in above)

    def failure_if_late(self, process: str) -> str:
        """The class of failure that it is if a composite process takes too long; empty where the process says none."""
        return str(self._ontology.value(Property.FAILURE_IF_LATE, process) or "")

    def against(self, failure: str) -> tuple[Recovery, ...]:
        """What may help against a class of failure, by name; what helps against the classes above does too.

        Another choice of the robot is not among them (`Reassign`), nor is a process that no file names.
        """
        above = self._ontology.superclasses.get(failure, frozenset({failure}))
        names = {str(r) for kind in above for r in self._ontology.values(Property.RECOVERED_BY, kind)}
        found = (
            self._recovery(name, kind)
            for name in sorted(names)
            for kind in RecoveryKind
            if self._ontology.is_a(name, kind)
        )
        return tuple(recovery for recovery in found if recovery.process or recovery.kind is not RecoveryKind.PROCESS)

    def _recovery(self, name: str, kind: RecoveryKind) -> Recovery:
        numbers: Mapping[Property, float | None] = {prop: self._number(prop, name) for prop in _NUMBERS}
        attempts = numbers[Property.MAX_ATTEMPTS]
        return Recovery(
            name=name,
            kind=kind,
            time_s=numbers[Property.RECOVERY_TIME_S] or 0.0,
            odds=numbers[Property.RECOVERY_ODDS] or 1.0,
            attempts=MOST_ATTEMPTS if attempts is None else int(attempts),
            pause_s=numbers[Property.PAUSE_S] or 0.0,
            process=str(self._ontology.value(Property.USES_PROCESS, name) or ""),
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
