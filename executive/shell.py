"""The shell around the loop: carries out its commands and feeds back what comes of them.

Here are the clock, the transport, the knowledge base, the planner's sessions, the messages that steps
hand on, and the recorder. Events are taken one at a time, in order.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from typing import Any, assert_never

from executive import events, loop, trace
from executive.goal_calls import GoalCalls
from executive.goals import solve_goal
from executive.metrics import Metrics
from executive.pace import Pace
from executive.persons import Persons
from executive.presence import Presence
from executive.recorder import Recorder
from executive.recovering import choose
from executive.request import TaskRequest
from executive.results import TaskResult, outputs_of
from executive.revising import Unfinished
from executive.shown import lacking, shown, shown_output
from executive.state import State
from executive.topic_readings import TopicReadings
from executive.travel import travel_times
from grounding.actions import Carrier
from grounding.errors import GroundingError
from grounding.ground import ground
from grounding.messages import PoseStamped
from grounding.outcome import Outcome, OutcomeStatus, interpret, refused, timed_out
from grounding.runner import Here, Runner
from grounding.transport import ServiceReply
from kb.clock import Clock
from kb.difference import concerned
from kb.history import Source, SourceKind
from kb.recoveries import Recoveries
from kb.revisions import CarryOver, Revision
from kb.store import KnowledgeBase, Snapshot
from kb.terms import Action, Data, Fluent
from kb.vocabulary import Property
from planner.classical_goal import GoalPlan
from planner.classical_process import GoalProcess
from planner.explain import Explainer
from planner.network import Travel
from planner.plan import EFFORT, Plan
from planner.planner import Session, TravelTimes
from planner.remedy import remedy

FORECAST_EFFORT = 1.0
"""Budget for planning a task to see what another revision changes for it, in deterministic seconds."""


class Shell:
    """One executive: one fleet, one queue of events."""

    def __init__(
        self, knowledge: KnowledgeBase, transport: Carrier, clock: Clock, recorder: Recorder, pace: Pace
    ) -> None:
        self.clock = clock
        self._pace = pace
        self.recorder = recorder
        self.metrics = Metrics()
        self.compute: Runner = Here()
        self.results: dict[str, TaskResult] = {}
        self._knowledge = knowledge
        self._transport = transport
        self._goal_calls = GoalCalls(transport, clock, self.post)
        self._readings = TopicReadings(transport, clock)
        self._last_change: tuple[Revision, Revision, CarryOver] | None = None
        self._keys: dict[str, str] = {}
        self._held: dict[str, Snapshot] = {}
        self._state = State()
        self._queue: deque[events.Event] = deque()
        self._taking_events = False
        self._snapshots: dict[str, Snapshot] = {}
        self._requests: dict[str, TaskRequest] = {}
        self._goals: dict[str, GoalPlan] = {}
        self._goal_processes: dict[str, GoalProcess] = {}
        self._sessions: dict[str, Session] = {}
        self._plans: dict[str, Plan] = {}
        self._messages: dict[str, object] = {}
        self._presence = Presence(transport, clock, self.post)
        self.persons = Persons(clock, self.post)

    def post(self, event: events.Event) -> None:
        """Take an event in, and carry out all that it leads to now."""
        self._queue.append(event)
        if self._taking_events:
            return
        self._taking_events = True
        try:
            while self._queue:
                self._state, commands = loop.step(self._state, self._queue.popleft(), self.clock.now_s)
                for command in commands:
                    self._carry_out(command)
        finally:
            self._taking_events = False

    def status(self, task: str) -> events.TaskStatus | None:
        """Where a task is in its life; None if there is no such task."""
        if task in self.results:
            return self.results[task].status
        found = self._state.tasks.get(task)
        return found.status if found else None

    @property
    def unfinished(self) -> tuple[str, ...]:
        """The tasks that have not ended, in order of arrival."""
        return tuple(self._state.tasks)

    @property
    def unfinished_tasks(self) -> list[Unfinished]:
        """The same with what is left of each."""
        return [
            Unfinished(
                name=name,
                status=task.status,
                request=task.request,
                snapshot=self._snapshots.get(name),
                session=self._sessions.get(name),
            )
            for name, task in self._state.tasks.items()
        ]

    def forecast(self, session: Session, snapshot: Snapshot) -> tuple[Plan, tuple[str, ...]]:
        """Plan what a session has left under a snapshot, roughly; with the capabilities that robots lack for it."""
        return self._made_plan(session, snapshot, FORECAST_EFFORT)

    def plan(
        self,
        request: TaskRequest,
        *,
        effort: float = EFFORT,
        stop: Callable[[], bool] = lambda: False,
        on_plan: Callable[[Plan], None] = lambda plan: None,
    ) -> tuple[Plan, tuple[str, ...]]:
        """Plan a request without doing it; with the capabilities that robots lack, if there is no plan.

        Args:
            effort: Budget, in deterministic seconds.
            stop: Asked often; true: take the best plan so far.
            on_plan: Told each better plan, and each better bound.
        """
        snapshot = self._knowledge.snapshot()
        key = f"plan@{snapshot.revision}"  # no two fleets share a revision
        session = Session(
            key, snapshot, request.process, request.arguments, robots=request.robots, now_s=self.clock.now_s
        )
        with self._knowledge.in_use(snapshot), closing(session):
            return self._made_plan(session, snapshot, effort, stop, on_plan)

    def plan_goal(self, request: TaskRequest) -> tuple[GoalPlan, Plan | None]:
        """Plan what leads to a goal without doing it; without a plan, if there is nothing to do or none."""
        snapshot = self._knowledge.snapshot()
        found = self._solved(request, snapshot)
        if not found.steps:
            return found, None
        with closing(GoalProcess(found, snapshot)) as process:
            own, key = process.snapshot, f"plan@{process.snapshot.revision}"
            now_s = self.clock.now_s
            with closing(Session(key, own, request.process, {}, robots=request.robots, now_s=now_s)) as session:
                return found, self._made_plan(session, own)[0]

    @contextmanager
    def explaining(self, request: TaskRequest) -> Iterator[tuple[Plan, Explainer]]:
        """The plan of a request, without doing it, and who answers questions about it."""
        snapshot = self._knowledge.snapshot()
        key, now_s = f"explain@{snapshot.revision}", self.clock.now_s  # no two fleets share a revision
        session = Session(key, snapshot, request.process, request.arguments, robots=request.robots, now_s=now_s)
        with self._knowledge.in_use(snapshot), closing(session):
            explainer = Explainer(session, self._travel_times(snapshot), now_s=now_s + self._pace.planning_s)
            yield self._made_plan(session, snapshot)[0], explainer

    def _solved(self, request: TaskRequest, snapshot: Snapshot) -> GoalPlan:
        goal, t_s = request.goal, self.clock.now_s
        assert goal is not None
        return solve_goal(goal, snapshot, self._messages, self._pose_estimate, self.compute, t_s=t_s)

    def remember(self, fluent: Fluent, message: object) -> None:
        """Keep a message as the value of a fluent, as told before anything has moved."""
        self._messages[fluent.place] = message

    def _post_after(self, seconds: float, event: events.Event) -> None:
        self.clock.call_at(self.clock.now_s + seconds, lambda: self.post(event))

    def _carry_out(self, command: events.Command) -> None:
        match command:
            case events.Record(event=event):
                self.recorder.record(event)
            case events.ReadKnowledge(task=task, request=request):
                snapshot = self._knowledge.snapshot()
                self._hold(task, snapshot)
                self._requests[task] = request
                read = events.KnowledgeWasRead(task=task, facts_told=snapshot.state, revision=snapshot.number)
                self.post(read)
            case events.SolveGoal(task=task):
                self._solve(task)
            case events.CompileProgram(task=task):
                self._compile(task)
            case events.MakePlan(task=task):
                self._plan(task)
            case events.AskActions(task=task):
                progress = self._sessions[task].next_actions(now_s=self.clock.now_s)
                self.post(events.ActionsAreReady(task=task, progress=progress))
            case events.StartAction(number=number, task=task, action=action, pause_s=pause_s):
                if pause_s:
                    self.clock.call_at(self.clock.now_s + pause_s, lambda: self._start(number, task, action))
                else:
                    self._start(number, task, action)
            case events.CancelAction(number=number):
                self._goal_calls.cancel(number)
            case events.ChooseRecovery():
                self._choose_recovery(command)
            case events.RedoProcess():
                self._redo(command)
            case events.AskPerson():
                self.persons.ask(command)
            case events.ReportOutcome(task=task, action=action, outcome=outcome, out=out):
                self.report_outcome(task, action, outcome, out)
            case events.ReportChange(task=task, change=change):
                self._report_change(task, change)
            case events.Tell():
                self._tell(command)
            case events.AdoptKnowledge(revision=revision):
                self._adopt(revision)
            case events.RebaseTask(task=task):
                self._rebase(task)
            case events.FinishTask():
                self._finish(command)
            case _:
                assert_never(command)

    def _solve(self, task: str) -> None:
        found = self._solved(self._requests[task], self._snapshots[task])
        self._goals[task] = found
        if found.steps:
            process = GoalProcess(found, self._snapshots[task])
            self._goal_processes[task], self._snapshots[task] = process, process.snapshot
        self._post_after(self._pace.planning_s, events.GoalWasSolved(task=task, plan=found))

    def _compile(self, task: str) -> None:
        snapshot, request = self._snapshots[task], self._requests[task]
        program = snapshot.program(request.process)
        key = self._keys[task] = f"{task}@{snapshot.revision}"  # no two fleets share a revision
        self._sessions[task] = Session(
            key, snapshot, request.process, request.arguments, robots=request.robots, now_s=self.clock.now_s
        )
        self.post(events.ProgramWasCompiled(task=task, program=program.text))

    def _hold(self, task: str, snapshot: Snapshot) -> None:
        """From now on, a task is done under a snapshot."""
        self._knowledge.hold(snapshot)
        if task in self._held:
            self._knowledge.let_go(self._held[task])
        self._snapshots[task] = self._held[task] = snapshot

    def _adopt(self, revision: int) -> None:
        proposal = self._knowledge.proposal
        assert proposal is not None, f"revision {revision} was not proposed"
        t_s = self.clock.now_s
        carry = self._knowledge.accept(proposal, t_s=t_s)
        self._last_change = (proposal.base, proposal.revision, carry)
        for (prop, subject), value in carry.changed.items():
            self.recorder.record(
                trace.FactsTold(t_s=t_s, task="", prop=prop, subject=subject, value=value, source=SourceKind.FILES)
            )

    def _rebase(self, task: str) -> None:
        """The rest of a task under the revision that has just come into force."""
        assert self._last_change is not None, "no revision has come into force"
        old, new, carry = self._last_change
        self._hold(task, snapshot := self._knowledge.snapshot())
        why = concerned(self._requests[task].process, old, new, carry.changed)
        progress = self._sessions[task].rebased(
            snapshot, forgotten=carry.dropped, anew=bool(why), now_s=self._decided_s
        )
        what = f"revision {new.number} of the knowledge: {why or 'other individuals fit'}"
        self._post_after(self._pace.deciding_s, events.ActionsAreReady(task=task, progress=progress, change=what))

    def _plan(self, task: str) -> None:
        own, now = self._snapshots[task], self._knowledge.snapshot()
        current = now if own.number == now.number else own  # what travels under an old revision stays there
        plan, without = self._made_plan(self._sessions[task], current)
        self._plans[task] = plan
        made = events.PlanWasMade(task=task, plan=plan, lacking=without, limits_s=self._limits_s(task, plan))
        self._post_after(self._pace.planning_s, made)

    def _limits_s(self, task: str, plan: Plan) -> dict[str, float]:
        """How long the plan's composite steps may take: as planned, and the grace time that the ontology grants."""
        ontology, limits_s = self._snapshots[task].ontology, {}
        for step in plan.steps:
            grace_s = ontology.value(Property.GRACE_TIME_S, step.action.process)
            if isinstance(grace_s, int | float):
                limits_s[step.action.id] = step.end_s - step.start_s + grace_s
        return limits_s

    def _made_plan(
        self,
        session: Session,
        snapshot: Snapshot,
        effort: float = EFFORT,
        stop: Callable[[], bool] = lambda: False,
        on_plan: Callable[[Plan], None] = lambda plan: None,
    ) -> tuple[Plan, tuple[str, ...]]:
        now_s = self.clock.now_s
        plans = []
        for plan in session.plans(
            self._travel_times(snapshot), now_s=now_s + self._pace.planning_s, effort=effort, stop=stop
        ):
            on_plan(plan)
            plans = [plan]
        [plan] = plans
        if plan.solved:
            return plan, ()
        return plan, lacking(session.exclusions(), snapshot)

    def _travel_times(self, snapshot: Snapshot) -> TravelTimes:
        now_s = self.clock.now_s

        def times(robots: Sequence[str], places: Sequence[str]) -> Travel:
            return travel_times(robots, places, snapshot, self._pose_estimate, self.compute, t_s=now_s)

        return times

    def _pose_estimate(self, robot: str) -> PoseStamped:
        pose = self._messages[Fluent(Property.HAS_POSE_ESTIMATE, robot).place]
        assert isinstance(pose, PoseStamped)
        return pose

    def _start(self, number: int, task: str, action: Action) -> None:
        if number not in self._state.running:
            return  # it is no longer wanted
        snapshot, called_s = self._snapshots[task], self.clock.now_s
        grounding = snapshot.groundings[action.process]

        def ended(outcome: Outcome) -> None:
            if number not in self._state.running:
                return  # a late reply
            self._keep(action, outcome)
            seen = {name: value for name, o in outcome.outputs.items() if (value := shown(o)) is not None}
            self.post(events.OutcomeArrived(number=number, outcome=outcome, planned_s=grounding.duration_s, shown=seen))

        try:
            call = ground(action, snapshot, self._messages, call_id=number, t_s=called_s)
        except GroundingError as error:
            outcome = refused(error)
            self.clock.call_at(called_s, lambda: ended(outcome))
            return

        def came(outcome: Outcome, reply: Mapping[str, object]) -> None:
            if number in self._state.running:  # else it is late
                self.metrics.note(call, action.robot or "", outcome, reply)
            if outcome.status is OutcomeStatus.LOST and action.robot:
                self._presence.lose(action.robot, call)
            ended(outcome)

        def deliver(reply: ServiceReply) -> None:
            forget_timeout()
            elapsed_s = round(self.clock.now_s - called_s, 9)
            came(interpret(reply, grounding, service=call.service, elapsed_s=elapsed_s), reply.fields)

        self.recorder.record(
            trace.ActionStarted(
                t_s=called_s,
                task=task,
                action=str(action),
                robot=action.robot or "",
                number=number,
                service=call.service,
            )
        )
        if grounding.action_type:
            self._goal_calls.send(call, grounding, Recoveries(snapshot.ontology), came)
        elif grounding.is_topic:
            self._readings.read(call, grounding, came)
        else:
            self._transport.call(call, deliver)
            forget_timeout = self.clock.call_at(called_s + call.timeout_s, lambda: came(timed_out(call), {}))

    def _keep(self, action: Action, outcome: Outcome) -> None:
        for name, value in outcome.outputs.items():
            place = action.argument(name)
            if isinstance(place, Data):
                self._messages[place.place] = value

    def _choose_recovery(self, asked: events.ChooseRecovery) -> None:
        task, now_s = asked.task, self.clock.now_s
        plan, snapshot, session = self._plans[task], self._snapshots[task], self._sessions[task]
        chosen, foreseen = choose(
            asked,
            session,
            plan,
            snapshot,
            lambda s: self.forecast(s, snapshot)[0],
            can_ask=bool(self.persons.listeners),
            now_s=now_s,
        )
        self._post_after(self._pace.planning_s if foreseen else 0.0, chosen)

    def _redo(self, redo: events.RedoProcess) -> None:
        session, snapshot, then_s = self._sessions[redo.task], self._snapshots[redo.task], self._decided_s
        before = None
        if redo.process:
            around = session.surroundings(redo.action).processes
            before = remedy(redo.process, redo.whole.id, [redo.action, *reversed(around)], snapshot)
        abandoned = tuple(a.id for a in session.redo(redo.action, redo.whole.id, before, now_s=then_s))
        redone = events.ProcessWasRedone(task=redo.task, whole=redo.whole, process=redo.process, abandoned=abandoned)
        self._post_after(self._pace.deciding_s, redone)

    @property
    def _decided_s(self) -> float:
        return self.clock.now_s + self._pace.deciding_s

    def report_outcome(self, task: str, action: Action, outcome: Outcome, out: int = 0) -> None:
        """Tell the planner how an action ended; what it decides comes as an event."""
        session, then_s = self._sessions[task], self._decided_s
        if outcome.succeeded:
            truths = {name: value for name, value in outcome.outputs.items() if isinstance(value, bool)}
            progress = session.succeeded(action, truths, now_s=then_s)
            self._post_after(self._pace.deciding_s, events.ActionsAreReady(task=task, progress=progress, cause=action))
        else:
            retry = session.failed(action, out=out, now_s=then_s)
            abandoned = tuple(a.id for a in retry.abandoned)
            reported = events.FailureWasReported(task=task, excluded=retry.excluded, abandoned=abandoned)
            self._post_after(self._pace.deciding_s, reported)

    def _report_change(self, task: str, change: events.FactWasTold) -> None:
        if task not in self._sessions:
            return  # its program will begin with what is so by then
        session, then_s = self._sessions[task], self._decided_s
        progress = session.observed(change.prop, change.subject, change.value, now_s=then_s)
        what = f"{change.prop}({change.subject}) is {change.value} now"
        self._post_after(self._pace.deciding_s, events.ActionsAreReady(task=task, progress=progress, change=what))

    def _tell(self, fact: events.Tell) -> None:
        t_s, by = self.clock.now_s, fact.source
        if isinstance(by, SourceKind):
            source = Source(kind=by)
        else:
            source = Source(kind=SourceKind.ACTION, task=fact.task, action=str(by), robot=by.robot or "")
        if isinstance(fact.value, Data | Fluent):
            message = self._messages.get(fact.value.place)
            self._messages[Fluent(fact.prop, fact.subject).place] = message
            value: Any = shown(message)
            if isinstance(message, bool):  # a truth value, unlike other messages, is something to plan with
                self._knowledge.tell(fact.prop, fact.subject, message, t_s=t_s, source=source)
        else:
            self._knowledge.tell(fact.prop, fact.subject, fact.value, t_s=t_s, source=source)
            value = fact.value
        self.recorder.record(
            trace.FactsTold(
                t_s=t_s,
                task=fact.task,
                prop=fact.prop,
                subject=fact.subject,
                value=value,
                source=source.action or source.kind,
                robot=source.robot,
            )
        )

    def _finish(self, finish: events.FinishTask) -> None:
        task = finish.task
        self.persons.withdraw(task)
        outputs = dict[str, Any]()
        if task in self._sessions:
            outputs = outputs_of(self._requests[task].process, self._keys[task], self._snapshots[task], self._messages)
        self.results[task] = TaskResult(
            status=finish.status,
            reason=finish.reason,
            plan=self._plans.get(task),
            outputs=outputs,
            took_s=finish.took_s,
            goal=self._goals.get(task),
        )
        self.recorder.record(
            trace.TaskFinished(
                t_s=self.clock.now_s,
                task=task,
                status=finish.status,
                reason=finish.reason,
                took_s=finish.took_s,
                outputs={name: shown_output(value) for name, value in outputs.items()},
            )
        )
        if task in self._sessions:
            self._sessions.pop(task).close()
            key = self._keys.pop(task)
            self._messages = {p: m for p, m in self._messages.items() if not p.startswith(f"{key}/")}
        if task in self._goal_processes:
            self._goal_processes.pop(task).close()
        for kept in (self._snapshots, self._requests, self._plans, self._goals):
            kept.pop(task, None)
        if task in self._held:
            self._knowledge.let_go(self._held.pop(task))
