"""The knowledge base: revisions of files, one of them in force, and what has been told since.

Files are read, checked, reasoned over and compiled before anything is replaced. What changes while
robots work (fluents) is told to the store; it reaches the planner as single facts and never the
reasoner.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Lock, RLock
from types import MappingProxyType

from kb.checking import check_ontology
from kb.compiler import Compiler, Program
from kb.difference import Difference, difference
from kb.errors import KnowledgeError
from kb.files import SHIPPED
from kb.groundings import Grounding, TravelEstimate
from kb.history import Fact, History, Known, Source, SourceKind
from kb.ontology import Ontology, Value
from kb.problems import Problem, reject_errors
from kb.processes import Process
from kb.prolog import Entry
from kb.revisions import CarryOver, Key, Revision, UnknownSite, carry_over, read_revision, renewed
from kb.terms import Term, struct

__all__ = ["KnowledgeBase", "Proposal", "ProposalOutdated", "Snapshot", "UnknownRevision", "UnknownSite", "load"]

_load_facts = Entry(search_path="kb_rules", file="facts", name="load_facts")
_drop_facts = Entry(search_path="kb_rules", file="facts", name="drop_facts")
_tell = Entry(search_path="kb_rules", file="facts", name="tell")

_AT_ONCE = 2000
"""So many facts go to Prolog in one call."""

KEPT_REVISIONS = 10
"""So many revisions are kept, that in force among them; each takes about 9 MB of memory for the demo."""

_PERSON = Source(kind=SourceKind.PERSON)


class ProposalOutdated(KnowledgeError):
    """A proposal was withdrawn, or what it would replace is not in force any more."""

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(f"revision {number} is not proposed any more: something else came first; propose it anew")


class UnknownRevision(KnowledgeError, LookupError):
    """There is no earlier revision of this number.

    Attributes:
        number: What was asked for.
        known: The numbers there are: the last that were in force.
    """

    def __init__(self, number: int, known: tuple[int, ...]) -> None:
        self.number, self.known = number, known
        super().__init__(f"no revision {number} to go back to; there is {', '.join(map(str, known)) or 'none'}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """What was known at one moment; it does not change.

    Attributes:
        revision: The key of the revision: what its facts are kept under in Prolog, unique in this process.
        number: Of the revision in its knowledge base, from 1.
        state: How many facts had been told since.
        fluents: Values of what changes, by (property, subject).
    """

    revision: int
    number: int = 1
    state: int
    site: str
    ontology: Ontology
    processes: Mapping[str, Process]
    groundings: Mapping[str, Grounding]
    travel_estimates: tuple[TravelEstimate, ...]
    fluents: Mapping[Key, Value]
    compiler: Compiler

    def value(self, prop: str, subject: str) -> Value | None:
        """The value of a property, told last or stated in files."""
        told = self.fluents.get((prop, subject))
        return told if told is not None else self.ontology.value(prop, subject)

    def program(self, process: str) -> Program:
        """The Golog program of a task type."""
        return self.compiler.program(process)


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """A revision that may follow the one in force, whose facts wait beside those.

    Attributes:
        difference: Between the files of both.
        carry: What would hold if it came into force now.
        snapshot: What would be known then.
        earlier: It was in force before.
    """

    revision: Revision
    base: Revision
    earlier: bool
    difference: Difference
    carry: CarryOver
    snapshot: Snapshot

    @property
    def text(self) -> str:
        """What changes, for people."""
        told = "\n".join((*self.difference.lines, *self.carry.sentences))
        return told or f"revision {self.revision.number}: nothing changes"


class KnowledgeBase:
    """The knowledge of one fleet; the only writer of facts.

    One thread tells and replaces at a time; any number take snapshots meanwhile, each of which is whole.
    """

    def __init__(self, site: str, folder: Path = SHIPPED) -> None:
        """Load a site and all that it imports from a folder of ontologies.

        Raises:
            UnknownSite: The folder has no such site.
            OntologyRejected: The files are wrong; nothing was loaded.
        """
        self._site = site
        self._writing = RLock()
        self._reading = Lock()  # held for a moment only: readers never wait for Prolog
        self._revision = read_revision(site, folder)
        self._revisions = {1: self._revision}  # that in force last at the end
        self._newest = 1
        self._proposal: Proposal | None = None
        self._uses: Counter[int] = Counter()
        self._loaded: set[int] = set()
        self._load(self._revision)
        self._fluents = dict(self._revision.initial)
        self._lent = False  # whether a snapshot holds self._fluents, which must then be copied before it is changed
        self._told: set[Key] = set()
        self._state = 0
        self._history = History(self._revision.initial)

    @property
    def revision(self) -> Revision:
        """The revision in force."""
        return self._revision

    @property
    def revisions(self) -> tuple[Revision, ...]:
        """The last `KEPT_REVISIONS` that have been in force, in order of number."""
        return tuple(revision for _, revision in sorted(self._revisions.items()))

    @property
    def warnings(self) -> tuple[Problem, ...]:
        """What is probably not meant in the files of the revision in force."""
        return self._revision.warnings

    def snapshot(self) -> Snapshot:
        """What is known now; it shares its facts with the knowledge base until the next one is told."""
        with self._reading:
            self._lent = True
            return _snapshot(self._revision, self._state, self._fluents)

    @contextmanager
    def in_use(self, snapshot: Snapshot) -> Iterator[None]:
        """Keep the facts of a snapshot's revision in Prolog, whatever comes into force meanwhile."""
        self.hold(snapshot)
        try:
            yield
        finally:
            self.let_go(snapshot)

    def hold(self, snapshot: Snapshot) -> None:
        """The same without an end: `let_go` must follow, once for each."""
        with self._writing:
            self._uses[snapshot.revision] += 1

    def let_go(self, snapshot: Snapshot) -> None:
        """The revision of a snapshot is used no more by who has held it."""
        with self._writing:
            self._uses[snapshot.revision] -= 1
            self._drop_unused()

    def tell(self, prop: str, subject: str, value: Value, *, t_s: float = 0.0, source: Source = _PERSON) -> None:
        """From now on, a property of an individual has this value.

        Args:
            t_s: When; in the order of telling.
            source: Who tells it.
        """
        with self._writing:
            before = self._fluents.get((prop, subject))
            with self._reading:
                self._change()[prop, subject] = value
                self._told.add((prop, subject))
                self._state += 1
                self._history.note(Fact(t_s=t_s, prop=prop, subject=subject, value=value, before=before, source=source))
            _tell(struct("fluent", self._revision.key, prop, subject, value))

    @property
    def proposal(self) -> Proposal | None:
        """The revision that is proposed now, if one is."""
        return self._proposal

    def read(self, folder: Path | None = None) -> Revision:
        """Read files beside the revision in force, which stays as it is; any thread may.

        Args:
            folder: Where the files are; the folder of the revision in force if left out.

        Raises:
            UnknownSite: The folder has not this site.
            OntologyRejected: The files are wrong.
        """
        return read_revision(self._site, folder or self._revision.folder)

    def propose(self, revision: Revision) -> Proposal:
        """Compare a revision that was read with the one in force, and let it wait beside that.

        There is one proposal at a time; the one before, if there is any, is withdrawn.
        """
        with self._writing:
            return self._offer(replace(revision, number=self._newest + 1))

    def propose_earlier(self, number: int) -> Proposal:
        """Propose a revision that was in force before, as it was then.

        Raises:
            UnknownRevision: It never was, was too long ago, or is now.
        """
        earlier = self._revisions.get(number)
        if earlier is None or earlier is self._revision:
            raise UnknownRevision(
                number, tuple(n for n, r in sorted(self._revisions.items()) if r is not self._revision)
            )
        with self._writing:
            return self._offer(renewed(earlier))

    def _offer(self, revision: Revision) -> Proposal:
        self._proposal = None
        self._drop_unused()
        base = self._revision
        carry = carry_over(base, revision, self._fluents, frozenset(self._told))
        self._load(revision)
        self._tell_all(revision, revision.initial, carry.fluents)
        self._proposal = Proposal(
            revision=revision,
            base=base,
            earlier=revision.number in self._revisions,
            difference=difference(base, revision),
            carry=carry,
            snapshot=_snapshot(revision, self._state, dict(carry.fluents)),
        )
        return self._proposal

    def accept(self, proposal: Proposal, *, t_s: float = 0.0) -> CarryOver:
        """Put a proposed revision in force, with all that has been told up to now; at once for all readers.

        Raises:
            ProposalOutdated: It is not the proposal that was made last, or was withdrawn.
        """
        with self._writing:
            self.require_proposed(proposal)
            revision = proposal.revision
            carry = carry_over(self._revision, revision, self._fluents, frozenset(self._told))
            if proposal.carry.fluents.keys() <= carry.fluents.keys():
                self._tell_all(revision, proposal.carry.fluents, carry.fluents)
            else:  # something was told since that the revision does not know: what it knew of it before goes
                _drop_facts(revision.key)
                self._load(revision)
                self._tell_all(revision, revision.initial, carry.fluents)
            source = Source(kind=SourceKind.FILES, revision=revision.number)
            with self._reading:
                before = self._fluents
                self._revision, self._fluents, self._lent = revision, dict(carry.fluents), False
                self._told -= carry.dropped.keys()
                for (prop, subject), value in carry.changed.items():
                    was = before.get((prop, subject))
                    self._history.note(
                        Fact(t_s=t_s, prop=prop, subject=subject, value=value, before=was, source=source)
                    )
                self._state += len(carry.changed)
            self._revisions.pop(revision.number, None)
            self._revisions[revision.number] = revision
            if len(self._revisions) > KEPT_REVISIONS:
                del self._revisions[next(iter(self._revisions))]
            self._newest = max(self._newest, revision.number)
            self._proposal = None
            self._drop_unused()
            return carry

    def require_proposed(self, proposal: Proposal) -> None:
        """Go on if a proposal can be accepted.

        Raises:
            ProposalOutdated: It is not the proposal that was made last, or was withdrawn.
        """
        if proposal is not self._proposal:
            raise ProposalOutdated(proposal.revision.number)

    def withdraw(self, proposal: Proposal) -> None:
        """Forget a proposal; nothing happens if it is not proposed any more."""
        with self._writing:
            if proposal is self._proposal:
                self._proposal = None
                self._drop_unused()

    def history(self, prop: str | None = None, subject: str | None = None) -> tuple[Fact, ...]:
        """What was told of a property, of an individual, or at all, in order; the last 100,000 facts are kept."""
        return self._kept_history().of(prop, subject)

    def known_at(self, t_s: float) -> Mapping[Key, Known]:
        """What was known at a time, by (property, individual).

        Raises:
            HistoryForgotten: More facts than are kept have been told since.
        """
        return self._kept_history().known_at(t_s)

    def close(self) -> None:
        """Forget the facts, of all revisions."""
        with self._writing:
            for key in sorted(self._loaded):
                _drop_facts(key)
            self._loaded.clear()

    def _kept_history(self) -> History:
        with self._reading:  # not while it is searched, which takes longer
            return self._history.copy()

    def _change(self) -> dict[Key, Value]:
        """The facts, which nobody else holds."""
        if self._lent:
            self._fluents, self._lent = dict(self._fluents), False
        return self._fluents

    def _load(self, revision: Revision) -> None:
        self._loaded.add(revision.key)
        for start in range(0, len(revision.facts), _AT_ONCE):  # others take turns in between
            _load_facts(list(revision.facts[start : start + _AT_ONCE]))

    def _tell_all(self, revision: Revision, now: Mapping[Key, Value], then: Mapping[Key, Value]) -> None:
        """Tell Prolog what is otherwise than what has been told it of a revision."""
        for (prop, subject), value in then.items():
            known = now.get((prop, subject))
            if known != value or type(known) is not type(value):
                fact: Term = struct("fluent", revision.key, prop, subject, value)
                _tell(fact)

    def _drop_unused(self) -> None:
        """Facts of revisions that are neither in force nor proposed nor used by a session."""
        needed = {self._revision.key, *(key for key, uses in self._uses.items() if uses > 0)}
        if self._proposal is not None:
            needed.add(self._proposal.revision.key)
        for key in sorted(self._loaded - needed):
            _drop_facts(key)
        self._loaded &= needed
        self._uses = +self._uses


def _snapshot(revision: Revision, state: int, fluents: dict[Key, Value]) -> Snapshot:
    return Snapshot(
        revision=revision.key,
        number=revision.number,
        state=state,
        site=revision.site,
        ontology=revision.ontology,
        processes=revision.processes,
        groundings=revision.groundings,
        travel_estimates=revision.travel_estimates,
        fluents=MappingProxyType(fluents),
        compiler=revision.compiler,
    )


def load(path: Path, folder: Path) -> Ontology:
    """Read, check and classify an ontology file and its imports.

    Raises:
        OntologyRejected: With everything that is wrong.
    """
    ontology, problems = check_ontology(path, folder)
    reject_errors(problems)
    assert ontology is not None, "where there is no ontology, there is an error"
    return ontology
