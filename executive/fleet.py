"""The Python API: open a fleet, file a task, wait for its result.

from executive import Fleet

with Fleet.open("tue_lab") as fleet:
    task = fleet.request("FindEmptyDrink", room="tue_lab", robots=2)
    result = task.wait()            # result.status, result.reason, result.plan, result.outputs
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

from executive import events
from executive.connecting import open_connected
from executive.errors import BadRequest
from executive.goals import check_goal, recipe_file, store_recipe
from executive.live import KnowledgeProposal
from executive.metrics import Metrics
from executive.opening import Given
from executive.persons import Question
from executive.request import TaskRequest, check_fact, check_request
from executive.results import TaskResult
from executive.trace import TraceEvent
from executive.wiring import Parts, open_simulated
from grounding.inprocess import Handler
from kb.errors import ConcertmasterError, InternalError
from kb.history import Fact, Known
from planner.classical_goal import GoalPlan
from planner.explain import Explainer
from planner.plan import EFFORT, Plan


def _run_until(parts: Parts, done: Callable[[], bool]) -> bool:
    """Let everything happen until `done()`; what watched folders bring comes in between two events.

    Returns:
        False if nothing is left that could make it so.
    """

    def is_done() -> bool:
        parts.live.take_found()
        return done()

    return parts.clock.run_until(is_done)


def _let_time_pass(parts: Parts, until_s: float, done: Callable[[], bool]) -> None:
    """Let everything happen that happens up to a time, or until `done()`; a time that is past is now."""
    reached, clock = False, parts.clock

    def reach() -> None:
        nonlocal reached
        reached = True

    clock.call_at(max(until_s, clock.now_s), reach)
    _run_until(parts, lambda: reached or done())


class TaskHandle:
    """A task that was accepted."""

    def __init__(self, name: str, parts: Parts) -> None:
        self.name = name
        self._parts = parts

    @property
    def status(self) -> events.TaskStatus:
        """Where the task is in its life."""
        status = self._parts.shell.status(self.name)
        if status is None:
            raise InternalError(f"{self.name} is neither underway nor ended")
        return status

    def wait(self) -> TaskResult:
        """Let time pass until the task has ended.

        Returns:
            How it ended: completed, failed, refused (no robot is capable) or canceled, with the reason.
        """
        results = self._parts.shell.results
        if not _run_until(self._parts, lambda: self.name in results):
            raise InternalError(f"{self.name} has not ended, but nothing is left to happen")
        return results[self.name]

    def wait_until(self, t_s: float) -> TaskResult | None:
        """Let time pass until the task has ended or the clock shows `t_s`; the result if it has ended."""
        results = self._parts.shell.results
        _let_time_pass(self._parts, t_s, lambda: self.name in results)
        return results.get(self.name)

    def cancel(self) -> None:
        """End the task now; robots get no further command from it. Nothing happens if it has ended."""
        self._parts.shell.post(events.CancelRequested(task=self.name))


class Fleet:
    """The robots of a site, ready to work. Make one with `Fleet.open`, close it when done."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._counts: dict[str, int] = {}
        self._is_open = True

    @classmethod
    def open(
        cls,
        site: str,
        *,
        scenario: str | Path | None = None,
        knowledge: str | Path | None = None,
        seed: int | None = None,
        trace: Path | None = None,
        services: Mapping[str, Handler] | None = None,
        compute: Path | None = None,
        faults: Path | None = None,
        connect: str | Path | None = None,
    ) -> Self:
        """Load the knowledge of a site and start its simulated robots, or connect to robots elsewhere.

        Args:
            site: Name of the site: `sites/<site>/<site>.owl` in the knowledge folder.
            scenario: What the simulated world is like: name of a shipped scenario, or a TOML file. The first
                shipped one for the site if left out.
            knowledge: Folder of ontologies; the shipped ones if left out.
            seed: Of all chance in the simulator; the scenario's if left out.
            trace: Where to write the trace (JSON Lines), and beside it the knowledge that comes into force. Without,
                all events stay in memory: give one to a fleet that works for long.
            services: Compute services that the ontology grounds processes in, beside those of our own, by name: each
                takes the fields of a request and gives those of the reply, or raises ServiceFailed.
            compute: Settings (TOML) that say which compute services run in worker processes; none if left out.
            faults: What goes wrong with calls (TOML); nothing if left out.
            connect: Where the robots are, in real time: the address of a rosbridge server that has them all, that of
                the master of ROS 1, `ros2:` for ROS 2, or a file (TOML) that names a server for each. They are
                simulated if left out.

        Raises:
            ConcertmasterError: Something given is not usable, or a robot cannot be reached; nothing was started.
        """
        given = Given(
            site=site,
            knowledge=knowledge,
            seed=seed,
            trace=trace,
            services=services or {},
            compute=compute,
            faults=faults,
        )
        if connect is None:
            return cls(open_simulated(given, scenario))
        if scenario is not None:
            raise BadRequest("scenario", "robots that are connected are where they are; leave the scenario out")
        return cls(open_connected(given, connect))

    def request(self, process: str, /, *, robots: int | None = None, **arguments: str) -> TaskHandle:
        """File a task.

        Args:
            process: Task type: a process of the knowledge base.
            robots: At most so many robots take part; all if left out.
            **arguments: Individuals for the inputs of the process, by name.

        Raises:
            BadRequest: Something about the request is wrong, or the fleet is closed; nothing was done.
        """
        return self._file(process, self._checked(process, arguments, robots))

    def tell(self, prop: str, subject: str, value: str | float | bool) -> None:
        """Tell of a change in the world that no robot has made: a drink stands somewhere else, a door is shut.

        What is under way is planned anew if the plan was made for something else.

        Args:
            prop: A property that changes, such as `locatedAt`.
            subject: The individual whose property it is.
            value: What it is now: an individual, a number, or a truth value.

        Raises:
            BadRequest: Something about it is not known, or the fleet is closed; nothing was done.
        """
        if not self._is_open:
            raise BadRequest(prop, f"{prop} cannot be told: this fleet is closed; open another")
        check_fact(prop, subject, value, self._parts.knowledge.snapshot())
        self._parts.shell.post(events.FactWasTold(prop=prop, subject=subject, value=value))

    def listen(self, listener: Callable[[Question], None]) -> None:
        """Take questions: what has failed, and a person may be able to help with.

        Without anybody who listens, recoveries by a person are not available.

        Args:
            listener: Told each question when it comes up; it is answered by `answer`, at once or later.

        Raises:
            BadRequest: The fleet is closed.
        """
        self._require_open("listen", "nothing will be asked")
        self._parts.shell.persons.listeners.append(listener)

    def answer(self, number: int, *, helped: bool, reason: str = "") -> None:
        """Answer a question: whether somebody has helped, so that what has failed can be begun again.

        Args:
            number: That of the question.
            reason: What was done, or why nothing was, in a sentence.

        Raises:
            BadRequest: The question is not open: it was answered, or its time is over; or the fleet is closed.
        """
        self._require_open("answer", f"question {number} cannot be answered")
        told = reason or ("somebody has helped" if helped else "nobody can help")
        if not self._parts.shell.persons.answer(number, helped=helped, reason=told):
            raise BadRequest("answer", f"question {number} is not open: it was answered, or its time is over")

    def propose_knowledge(self, folder: str | Path | None = None) -> KnowledgeProposal:
        """Read a folder of ontologies beside the one in force and tell what would change; nothing does.

        Args:
            folder: The folder in force, with what has been saved there since, if left out.

        Returns:
            The difference, what becomes of told facts, and what it changes for each task that has not ended.

        Raises:
            BadRequest: The fleet is closed.
            OntologyRejected: The files are wrong; file, line, entity and code of each fault.
            ConcertmasterError: The files say what the world has not: a robot, a service, a field of one.
        """
        self._require_open("knowledge", "no knowledge can be proposed")
        return self._parts.live.propose(None if folder is None else Path(folder))

    def accept_knowledge(self, proposal: KnowledgeProposal) -> None:
        """Put proposed knowledge in force, between two actions.

        Queued tasks will use it. Tasks underway go over to it if their programs are the same, and finish under the
        revision they began with otherwise; the trace tells which. Actions that are running end as they began.

        Raises:
            BadRequest: The fleet is closed.
            ProposalOutdated: Something else has been proposed since, or has come into force.
            KnowledgeInUse: A task underway uses a robot, or anything else, that it does not know.
        """
        self._require_open("knowledge", "no knowledge can be accepted")
        self._parts.live.accept(proposal)

    def roll_back_knowledge(self, revision: int) -> KnowledgeProposal:
        """Put an earlier revision in force again, by its number; errors as for `accept_knowledge`.

        Raises:
            UnknownRevision: It never was in force, was too long ago, or is now.
        """
        self._require_open("knowledge", "no knowledge can be rolled back")
        return self._parts.live.roll_back(revision)

    def watch_knowledge(
        self,
        folder: str | Path | None = None,
        *,
        on_change: Callable[[KnowledgeProposal | ConcertmasterError], None] = lambda found: None,
    ) -> None:
        """Put in force whatever is saved in a folder, as long as the fleet is open and time passes.

        Args:
            folder: The folder in force if left out.
            on_change: Told what came into force, or why something did not.

        Raises:
            BadRequest: The fleet is closed.
            FileNotFoundError: There is no such folder.
        """
        self._require_open("knowledge", "no folder can be watched")
        self._parts.live.watch(None if folder is None else Path(folder), on_change)

    def history(self, prop: str | None = None, subject: str | None = None) -> tuple[Fact, ...]:
        """What was told of a property, of an individual, or at all, in order: when, by whom, what was so before."""
        return self._parts.knowledge.history(prop, subject)

    def known_at(self, t_s: float) -> Mapping[tuple[str, str], Known]:
        """What was known at a time, by (property, individual).

        Raises:
            HistoryForgotten: More facts than are kept have been told since.
        """
        return self._parts.knowledge.known_at(t_s)

    def _require_open(self, what: str, told: str) -> None:
        if not self._is_open:
            raise BadRequest(what, f"{told}: this fleet is closed; open another")

    def _file(self, kind: str, request: TaskRequest) -> TaskHandle:
        count = self._counts.get(kind, 0) + 1
        self._counts[kind] = count
        name = f"{kind}-{count}"
        self._parts.shell.post(events.Requested(task=name, request=request))
        return TaskHandle(name, self._parts)

    def request_goal(self, goal: str | Sequence[str] | Mapping[str, object], /) -> TaskHandle:
        """Ask for something to be true; what leads there is found out. All robots may take part.

        Args:
            goal: Such as `locatedAt(amigo_1)=at_bar and hasDetectedPosition(drink_1)`; or its parts, one by one; or
                values by `property(individual)`, None for a message that shall be known.

        Raises:
            BadRequest: The fleet is closed.
            BadGoal: The goal makes no sense; nothing was done.
            DependencyMissing: The extra `goals` is not installed.
        """
        return self._file("Goal", self._checked_goal(goal))

    def plan_goal(self, goal: str | Sequence[str] | Mapping[str, object], /) -> tuple[GoalPlan, Plan | None]:
        """Plan what leads to a goal without doing it; errors as for `request_goal`.

        Returns:
            How the goal is reached, or why it is not; and the robots' plan for that, None if there is nothing to do.
        """
        return self._parts.shell.plan_goal(self._checked_goal(goal))

    def check_recipe(self, name: str, folder: Path, *, realizes: str = "") -> None:
        """Check that a recipe can be kept under a name; errors as for `store_recipe`."""
        recipe_file(name, folder, self._parts.knowledge.snapshot(), realizes=realizes)

    def store_recipe(self, plan: GoalPlan, name: str, folder: Path, *, realizes: str = "") -> Path:
        """Keep what leads to a goal as a recipe; what the goal names is asked for, the rest is chosen each time.

        Args:
            name: Of the process that it becomes, such as `FindBoth`.
            folder: Of ontologies; not the shipped one.
            realizes: The task type that it is a way to accomplish, such as `SeeDrink`, or `SeeDrink(drink=drink_1)`
                where it is not plain which individual stands for which input.

        Returns:
            The file. A site has to import it so that the recipe is known there.

        Raises:
            BadGoal: The plan has no steps, the name is no new name of a process, or the recipe is no way to accomplish
                the task type.
            BadRequest: The folder is none of ontologies, or the one that is shipped, or has such a file.
        """
        snapshot = self._parts.knowledge.snapshot()
        return store_recipe(plan, name, folder, snapshot, t_s=self.now_s, realizes=realizes)

    def plan(
        self,
        process: str,
        /,
        *,
        robots: int | None = None,
        effort: float = EFFORT,
        stop: Callable[[], bool] = lambda: False,
        on_plan: Callable[[Plan], None] = lambda plan: None,
        **arguments: str,
    ) -> tuple[Plan, tuple[str, ...]]:
        """Plan a task without doing it; arguments as for `request`.

        Args:
            effort: Budget, in deterministic seconds: about what one core takes in seconds.
            stop: Asked often; true: take the best plan so far.
            on_plan: Told each better plan, and each better bound.

        Returns:
            The plan, and, if there is none, which robots lack which capability, a sentence each.
        """
        request = self._checked(process, arguments, robots)
        return self._parts.shell.plan(request, effort=effort, stop=stop, on_plan=on_plan)

    def explaining(
        self, process: str, /, *, robots: int | None = None, **arguments: str
    ) -> AbstractContextManager[tuple[Plan, Explainer]]:
        """The plan of a task, without doing it, and who answers questions about it; arguments as for `request`."""
        return self._parts.shell.explaining(self._checked(process, arguments, robots))

    def _checked(self, process: str, arguments: Mapping[str, str], robots: int | None) -> TaskRequest:
        if not self._is_open:
            raise BadRequest(process, f"{process} cannot be asked for: this fleet is closed; open another")
        return check_request(process, arguments, robots, self._parts.knowledge.snapshot())

    def _checked_goal(self, goal: str | Sequence[str] | Mapping[str, object]) -> TaskRequest:
        if not self._is_open:
            raise BadRequest("goal", "no goal can be asked for: this fleet is closed; open another")
        return check_goal(goal, self._parts.knowledge.snapshot())

    @property
    def trace(self) -> Sequence[TraceEvent]:
        """Every event so far."""
        return self._parts.shell.recorder.events

    @property
    def metrics(self) -> Metrics:
        """What the work has cost so far: calls, bytes and time by service and robot, hits of caches, processor time."""
        return self._parts.shell.metrics

    @property
    def now_s(self) -> float:
        """Seconds since the fleet was opened."""
        return self._parts.clock.now_s

    def let_time_pass(self, until_s: float) -> None:
        """Let everything happen that happens up to a time."""
        _let_time_pass(self._parts, until_s, lambda: False)

    @property
    def parts(self) -> Parts:
        """What the fleet consists of, for tests and scoring."""
        return self._parts

    def close(self) -> None:
        """Cancel the tasks that have not ended, stop everything and write the trace out."""
        if not self._is_open:
            return
        self._is_open = False
        with ExitStack() as closing:
            closing.callback(self._parts.knowledge.close)
            closing.callback(self._parts.compute.close)
            closing.callback(self._parts.robots.close)
            closing.callback(self._parts.shell.recorder.close)
            closing.callback(self._parts.live.close)
            for task in reversed(self._parts.shell.unfinished):  # the last first, or the next would begin
                self._parts.shell.post(events.CancelRequested(task=task))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()
