"""Knowledge that changes while robots work: proposed with its effects, put in force between actions, rolled back."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import ClassVar, Protocol, TypeAlias

from executive import events
from executive.request import TaskRequest
from executive.revising import TaskEffect, Unfinished, effects_on, new_knowledge
from executive.shell import Shell
from executive.trace import KnowledgeRefused
from kb.difference import Difference
from kb.errors import ConcertmasterError, Fault, KnowledgeError
from kb.revisions import CarryOver, Revision
from kb.store import KnowledgeBase, Proposal, Snapshot
from kb.watching import FolderWatch


class KnowledgeInUse(ConcertmasterError):
    """A revision cannot come into force: a task uses what it does not know."""

    fault: ClassVar[Fault] = "knowledge"


class World(Protocol):
    """What knowledge is about: robots and services as they really are."""

    def check(self, snapshot: Snapshot) -> None:
        """Whether the world has what knowledge says.

        Raises:
            ConcertmasterError: It has not: a robot, a service, a field of one.
        """

    def open_files(self, snapshot: Snapshot) -> None:
        """What is known is planned with, and may never come into force: services may read its files."""

    def adapt(self, snapshot: Snapshot) -> None:
        """What is known is in force from now on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class KnowledgeProposal:
    """A revision that may come into force.

    Attributes:
        proposal: The same for the knowledge base.
        effects: What it changes for each task that has not ended, in order of arrival.
    """

    proposal: Proposal
    effects: tuple[TaskEffect, ...]

    @property
    def revision(self) -> int:
        """Its number."""
        return self.proposal.revision.number

    @property
    def difference(self) -> Difference:
        """Between its files and those of the revision in force."""
        return self.proposal.difference

    @property
    def carry(self) -> CarryOver:
        """What becomes of the facts that were told."""
        return self.proposal.carry

    @property
    def text(self) -> str:
        """For people, a line each: what is different, what becomes of facts, what it changes for tasks."""
        return "\n".join((self.proposal.text, *(effect.text for effect in self.effects)))


OnChange: TypeAlias = Callable[[KnowledgeProposal | ConcertmasterError], None]
"""Told what came into force, or why something did not."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Found:
    """What a folder held after something was saved in it."""

    folder: Path
    what: Revision | ConcertmasterError
    on_change: OnChange


class LiveKnowledge:
    """The knowledge of an open fleet, and the folders that are watched for changes of it.

    Attributes:
        found: Set as long as a watched folder has brought something that is still to be taken.
    """

    def __init__(self, knowledge: KnowledgeBase, shell: Shell, world: World) -> None:
        self._knowledge = knowledge
        self._shell = shell
        self._world = world
        self._watches: list[FolderWatch[Revision | ConcertmasterError]] = []
        self._found: deque[_Found] = deque()  # by the threads that watch
        self.found = Event()

    def propose(self, folder: Path | None = None) -> KnowledgeProposal:
        """Read a folder, or again the one in force, and tell what would change; nothing does.

        Raises:
            OntologyRejected: The files are wrong.
            ConcertmasterError: The world has not what they say: a robot, a service, a field of one.
        """
        try:
            revision = self._knowledge.read(folder)
        except ConcertmasterError as error:
            self.reject(str(folder or self._knowledge.revision.folder), str(error))
            raise
        return self._told(self._knowledge.propose(revision))

    def foresee(self, proposal: Proposal, requests: Mapping[str, TaskRequest]) -> tuple[TaskEffect, ...]:
        """What a proposal would change for requests, by name, that nobody has made."""
        asked = [
            Unfinished(name=name, status=events.TaskStatus.QUEUED, request=request, snapshot=None, session=None)
            for name, request in requests.items()
        ]
        shell = self._shell
        self._world.open_files(proposal.snapshot)
        return effects_on(asked, self._knowledge.snapshot(), proposal, shell.forecast, now_s=shell.clock.now_s)

    def accept(self, proposed: KnowledgeProposal) -> None:
        """Put it in force.

        Raises:
            ProposalOutdated: Something else has been proposed since, or has come into force.
            KnowledgeInUse: A task that is underway uses what it does not know.
        """
        self._knowledge.require_proposed(proposed.proposal)
        tasks = self._shell.unfinished_tasks
        self._shell.post(events.KnowledgeWasAccepted(knowledge=new_knowledge(proposed.proposal, tasks, ())))
        if self._knowledge.revision is not proposed.proposal.revision:
            refused = next(e for e in reversed(self._shell.recorder.events) if isinstance(e, KnowledgeRefused))
            raise KnowledgeInUse(refused.reason)
        self._world.adapt(self._knowledge.snapshot())

    def roll_back(self, revision: int) -> KnowledgeProposal:
        """Put an earlier revision in force again, as it was read then; errors as for `accept`.

        Raises:
            UnknownRevision: It never was in force, was too long ago, or is now.
        """
        proposed = self.propose_earlier(revision)
        self.accept(proposed)
        return proposed

    def propose_earlier(self, revision: int) -> KnowledgeProposal:
        """Tell what would change if an earlier revision came into force again; errors as for `roll_back`."""
        return self._told(self._knowledge.propose_earlier(revision))

    def watch(self, folder: Path | None, on_change: OnChange) -> None:
        """Read a folder again whenever a file in it is saved, and put what was read in force if that can be.

        Files are read in a thread of their own; `take_found` does the rest.

        Args:
            folder: The folder in force if left out.
            on_change: Told what came into force, or why something did not.
        """
        watched = folder or self._knowledge.revision.folder

        def read() -> Revision | ConcertmasterError:
            if not watched.is_dir():
                return KnowledgeError(f"{watched} is no folder any more; put one there, or watch another")
            try:
                return self._knowledge.read(watched)
            except ConcertmasterError as error:
                return error
            except OSError as error:  # a file that has gone meanwhile, or may not be read
                return KnowledgeError(f"{error.filename}: {error.strerror}")

        def tell(found: Revision | ConcertmasterError) -> None:
            self._found.append(_Found(folder=watched, what=found, on_change=on_change))
            self.found.set()

        missed = folder is None and not self._knowledge.revision.is_as_read()
        self._watches.append(FolderWatch(watched, read, tell, at_once=missed))

    def take_found(self) -> None:
        """Take in what the watched folders have brought since; between two events."""
        self.found.clear()
        while self._found:
            found = self._found.popleft()
            try:
                if isinstance(found.what, ConcertmasterError):
                    self.reject(str(found.folder), str(found.what))
                    found.on_change(found.what)
                elif not found.what.says_the_same(self._knowledge.revision):
                    self.accept(proposed := self._told(self._knowledge.propose(found.what)))
                    found.on_change(proposed)
            except ConcertmasterError as error:
                found.on_change(error)

    def close(self) -> None:
        """Watch no more."""
        while self._watches:
            self._watches.pop().close()

    def _told(self, proposal: Proposal) -> KnowledgeProposal:
        """Tell of a revision that may come into force, if the world has what it says."""
        try:
            self._world.check(proposal.snapshot)
        except ConcertmasterError as error:
            self._knowledge.withdraw(proposal)
            self.reject(str(proposal.revision.folder), str(error))
            raise
        self._world.open_files(proposal.snapshot)
        shell, tasks = self._shell, self._shell.unfinished_tasks
        now = self._knowledge.snapshot()
        for revision in (proposal.base, proposal.revision):
            shell.recorder.keep(revision)
        effects = effects_on(tasks, now, proposal, shell.forecast, now_s=shell.clock.now_s)
        shell.post(events.KnowledgeWasProposed(knowledge=new_knowledge(proposal, tasks, effects)))
        return KnowledgeProposal(proposal=proposal, effects=effects)

    def reject(self, folder: str, reason: str) -> None:
        """Tell of files that cannot be used."""
        self._shell.post(events.KnowledgeWasRejected(folder=folder, reason=reason))
