"""A plan's steps, ended and started in order of time, against what remains of the program."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice, permutations

from kb.terms import Action, Data, Fluent, Term, Value
from planner.checking.constructs import Constructs
from planner.checking.demands import Demands
from planner.checking.ending import Ending
from planner.checking.knowledge import Knowledge
from planner.checking.moment import Moment
from planner.checking.outstanding import Outstanding
from planner.checking.remainder import Node, frames_of
from planner.checking.start import Start, first_moment, goes_on, ms
from planner.checking.starting import Stage, seconds
from planner.checking.walk import Walk, Wanted
from planner.plan import Plan, PlannedStep

_ORDERS = 24
"""So many orders of effects that contradict one another at one instant are tried."""


@dataclass(frozen=True, slots=True)
class _State:
    """A state of the replay.

    Attributes:
        waiting: Steps that are to start at this instant.
        later: How many steps start at this instant or before.
    """

    node: Node
    moment: Moment
    waiting: tuple[Wanted, ...]
    later: int


class Replay:
    """Goes through a plan in order of time; where several orders may do, through each until one does."""

    def __init__(
        self,
        plan: Plan,
        start: Start,
        constructs: Constructs,
        demands: Demands,
        knowledge: Knowledge,
        stage: Stage,
    ) -> None:
        self._plan = plan
        self._stage = stage
        self._ending = Ending(constructs, knowledge, stage)
        self._walk = Walk(constructs, demands, knowledge, stage, self._ending)
        self._outstanding = Outstanding(constructs, self._ending)
        new = [step for step in plan.steps if not any(goes_on(step, run, plan) for run in start.running)]
        self._steps = sorted(map(_wanted, new), key=lambda wanted: wanted.start_ms)
        program = constructs.node(start.remaining, {})
        self._first = _State(program, first_moment(start, ms(plan.made_at_s)), (), 0)
        self._furthest: tuple[int, int] = (-1, -1)
        self._faults: list[str] = []

    def faults(self) -> list[str]:
        """What keeps the plan from being an execution, where it gets furthest; nothing if it is one."""
        node, moment = self._ending.settle(self._first.node, self._first.moment, None)
        states = [replace(self._first, node=node, moment=moment)]
        # Orders multiply where nothing depends on them; a plan that needs more tries is refused.
        for _ in range(10 * (2 * len(self._steps) + 100)):
            if not states:
                break
            state = states.pop()
            if state.waiting:
                states += reversed(self._started(state))
            elif state.moment.running or state.later < len(self._steps):
                states += reversed(self._passed(state))
            else:
                missing = self._missing(state)
                if not missing:
                    return []
                self._note(state, missing)
        return self._faults

    def _note(self, state: _State, faults: list[str]) -> None:
        reached = (state.moment.now_ms, state.later - len(state.waiting))
        if reached > self._furthest:
            self._furthest, self._faults = reached, list(dict.fromkeys(faults))

    def _started(self, state: _State) -> list[_State]:
        """One of the steps that are to start now has started: all ways to do so that may make a difference."""
        now_ms, faults = state.moment.now_ms, []
        states: list[_State] = []
        in_no_time = any(wanted.end_ms == now_ms for wanted in state.waiting)
        for wanted in state.waiting:
            others = tuple([w for w in state.waiting if w is not wanted])
            for begun in self._walk.begin(state.node, state.moment, wanted):
                ended = (wanted.action.id,) if wanted.end_ms == now_ms else ()
                states.append(_State(*self._settled(*begun, ended), others, state.later))
            if states and not in_no_time:
                return states  # what starts now makes nothing impossible that may start now too
            faults += [f"{wanted.action}: {reason}" for reason in self._walk.reasons] or [self._unasked(state, wanted)]
        if not states:
            self._note(state, faults)
        return states

    def _passed(self, state: _State) -> list[_State]:
        """Time has passed to when something ends or starts."""
        ends = [run.end_ms for run in state.moment.running.values()]
        starts = [wanted.start_ms for wanted in self._steps[state.later : state.later + 1]]
        moment, later = replace(state.moment, now_ms=min([*ends, *starts])), state.later
        while later < len(self._steps) and self._steps[later].start_ms <= moment.now_ms:
            later += 1
        starting = tuple(self._steps[state.later : later])
        return [_State(*self._settled(state.node, moment, ended), starting, later) for ended in self._orders(moment)]

    def _orders(self, moment: Moment) -> Iterator[tuple[str, ...]]:
        """What ends now; in several orders if that makes a difference to what holds afterwards."""
        ended = tuple([step_id for step_id, run in moment.running.items() if run.end_ms <= moment.now_ms])
        set_to: dict[tuple[str, str], Term] = {}
        contradicted = False
        for step_id in ended:
            for fluent, value in self._stage.changes(step_id, moment).items():
                contradicted |= set_to.setdefault(fluent, value) != value
        yield from islice(permutations(ended), _ORDERS) if contradicted else (ended,)

    def _settled(self, node: Node, moment: Moment, ended: tuple[str, ...]) -> tuple[Node, Moment]:
        """What remains when steps have ended and what can end by itself has."""
        frames: set[str] = set()
        for step_id in ended:
            moment = self._stage.end_step(step_id, moment)
            frames.update(frames_of(step_id))
        return self._ending.settle(node, moment, frozenset(frames))

    def _missing(self, state: _State) -> list[str]:
        """What keeps the program from being over where the plan is."""
        node, moment, waits_for = state.node, state.moment, frozenset(self._plan.waits_for)
        self._walk.reasons.clear()
        places = self._ending.halted(node, moment)
        if places is None:
            reasons = list(self._walk.reasons)
            return reasons or [f"the plan lacks {' and '.join(islice(self._outstanding.of(node, moment, None), 3))}"]
        if places != waits_for:
            told, asked = (", ".join(sorted(names)) or "nothing" for names in (waits_for, places))
            return [f"the plan ends to wait for {told}; the program waits for {asked}"]
        over = self._ending.ended(node, moment)
        return (
            []
            if over is None
            else [
                f"the program does not ask for what the plan chooses at {choice_id}"
                for choice_id, answers in self._plan.choices.items()
                if len(answers) > over.taken.get(choice_id, 0)
            ]
        )

    def _unasked(self, state: _State, wanted: Wanted) -> str:
        told = f"the program does not ask for {wanted.action} ({wanted.action.id}) at {seconds(wanted.start_ms)}"
        first = " and ".join(islice(self._outstanding.of(state.node, state.moment, wanted.frames), 3))
        return f"{told}; before, it wants {first}" if first else told


def _wanted(step: PlannedStep) -> Wanted:
    return Wanted(
        action=step.action,
        arguments=_arguments(step.action),
        frames=frames_of(step.action.id),
        start_ms=ms(step.start_s),
        end_ms=ms(step.end_s),
    )


def _arguments(action: Action) -> tuple[str, ...]:
    return tuple([_place(argument.value) for argument in action.arguments])


def _place(value: Value) -> str:
    return value.place if isinstance(value, Data | Fluent) else str(value)
