"""Where facts come from: what was told when, by whom, and what had been so before.

The last `limit` facts are kept one by one; older ones are folded into the state from which they count, so that the
memory of a fleet that works for months is bounded.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

from kb.errors import KnowledgeError

KEPT = 100_000
"""So many facts are kept one by one; about 40 MB if all differ."""

Known: TypeAlias = "str | int | float | bool | list[float] | None"
"""A value as it is told: an individual, a number, a truth value, a pose or point; None: not known."""


class SourceKind(StrEnum):
    """Who tells a fact."""

    ACTION = "action"
    """It is the effect of an action or process that has succeeded."""
    PERSON = "person"
    FILES = "files"
    """Ontology files state it, and a revision of them came into force."""
    SCENARIO = "scenario"
    """It was told before anything moved."""
    CONNECTION = "connection"
    """It shows in how calls to a robot end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """Where a fact comes from.

    Attributes:
        task: Whose action it was; empty where no task told it.
        action: The action or process, with its arguments.
        robot: Who did it; empty if no robot did.
        revision: Number of the revision that was in force from then on, or in which files state it.
    """

    kind: SourceKind
    task: str = ""
    action: str = ""
    robot: str = ""
    revision: int = 0

    def __str__(self) -> str:
        match self.kind:
            case SourceKind.ACTION:
                return f"effect of {self.action} of {self.task}"
            case SourceKind.FILES:
                return f"stated in files, revision {self.revision}"
            case SourceKind.PERSON:
                return "told by a person"
            case SourceKind.SCENARIO:
                return "told at the beginning"
            case SourceKind.CONNECTION:
                return "found out from its connection"


@dataclass(frozen=True, slots=True, kw_only=True)
class Fact:
    """A change of what is known.

    Attributes:
        t_s: When, in seconds on the clock of whoever told it.
        before: What was known until then; None: nothing.
    """

    t_s: float
    prop: str
    subject: str
    value: Known
    before: Known
    source: Source

    def __str__(self) -> str:
        change = f"{shown(self.before)} -> {shown(self.value)}"
        return f"{self.t_s:.3f} s  {self.prop}({self.subject}): {change}  ({self.source})"


class HistoryForgotten(KnowledgeError, LookupError):
    """What was known then is not kept any more.

    Attributes:
        t_s: The time that was asked for.
        since_s: From then on, it is kept.
    """

    def __init__(self, t_s: float, since_s: float) -> None:
        self.t_s, self.since_s = t_s, since_s
        super().__init__(f"what was known at {t_s:g} s is not kept any more; ask for a time from {since_s:g} s on")


class History:
    """What was known when; facts are noted in order of time."""

    def __init__(self, initial: Mapping[tuple[str, str], Known], limit: int = KEPT) -> None:
        """Begin with what is known before anything is told."""
        self._base = dict(initial)
        self._limit = limit
        self._facts: deque[Fact] = deque()
        self._forgotten_s: float | None = None

    def note(self, fact: Fact) -> None:
        """Keep a fact; forget the oldest if there are too many."""
        self._facts.append(fact)
        if len(self._facts) > self._limit:
            oldest = self._facts.popleft()
            self._base[oldest.prop, oldest.subject] = oldest.value
            self._forgotten_s = oldest.t_s

    def copy(self) -> History:
        """The same, which facts noted from now on do not reach."""
        twin = History(self._base, self._limit)
        twin._facts, twin._forgotten_s = self._facts.copy(), self._forgotten_s
        return twin

    def of(self, prop: str | None = None, subject: str | None = None) -> tuple[Fact, ...]:
        """The facts that are kept, in order; of one property, of one individual, or of all."""
        return tuple(f for f in self._facts if prop in (None, f.prop) and subject in (None, f.subject))

    def known_at(self, t_s: float) -> dict[tuple[str, str], Known]:
        """What was known at a time, all that had been told by then included; by (property, individual).

        Raises:
            HistoryForgotten: It was too long ago.
        """
        if self._forgotten_s is not None and t_s < self._forgotten_s:
            raise HistoryForgotten(t_s, self._forgotten_s)
        known = dict(self._base)
        for fact in self._facts:
            if fact.t_s > t_s:
                break
            known[fact.prop, fact.subject] = fact.value
        return {key: value for key, value in known.items() if value is not None}


def shown(value: Known) -> str:
    """A value as people read it."""
    match value:
        case None:
            return "not known"
        case bool():
            return "true" if value else "false"
        case list():
            return f"[{', '.join(f'{v:g}' for v in value)}]"
        case _:
            return str(value)
