"""What a plan begins with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from kb.terms import Data, Fluent, Struct, Term, Value
from planner.checking.moment import Moment, Run
from planner.checking.starting import MS_PER_S
from planner.plan import Plan, PlannedStep


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """What a plan begins with: at first the request, later what is left of it.

    Attributes:
        remaining: The program, with running(Id), scope(Id, Head, P), picked(Id-X, Pick, P), star(F, S, P, N) and
            any_order(F, S, [N-P, ...], K) for what has begun; composite processes with a duration model that have
            begun are running(Id).
        began_s: When the request began; deadlines count from then.
        fluents: Values that effects have set, by (property, subject). Where robots are is left out: they are "here".
        truths: What actions have found out, by place (`Frame/Name`).
        running: Steps under way, with the ends that are expected.
        held: The process that keeps a robot, by robot.
        claimed: Ids of the steps and processes that use a resource, by resource.
        team: Robots that have taken part.
        worked_ms: How long robots have been busy with steps, those under way taken whole.
        excluded: Choices, by id, and individuals, or numbers of branches, that may not be chosen there any more.
        places: Where robots are known to be.
    """

    remaining: Term
    began_s: float
    fluents: Mapping[tuple[str, str], Term] = field(default_factory=dict)
    truths: Mapping[str, bool] = field(default_factory=dict)
    running: tuple[PlannedStep, ...] = ()
    held: Mapping[str, str] = field(default_factory=dict)
    claimed: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    team: frozenset[str] = frozenset()
    worked_ms: Mapping[str, int] = field(default_factory=dict)
    excluded: frozenset[tuple[str, str | int]] = frozenset()
    places: Mapping[str, str] = field(default_factory=dict)


def beginning(key: str, request: Term, began_s: float) -> Start:
    """The start of a request of which nothing is done.

    Args:
        key: Name of the task: the frame of the request.
        request: The process with its arguments, as it was asked for.
    """
    return Start(remaining=Struct("call", (key, "task", request)), began_s=began_s)


def ms(time_s: float) -> int:
    """A time in milliseconds."""
    return round(time_s * MS_PER_S)


def not_going_on(plan: Plan, start: Start) -> Iterator[str]:
    """The steps under way that a plan does not go on with, one sentence each."""
    for run in start.running:
        if not any(goes_on(step, run, plan) for step in plan.steps):
            yield f"{run.action} is under way until {run.end_s:.3f} s; the plan does not say so"


def goes_on(step: PlannedStep, run: PlannedStep, plan: Plan) -> bool:
    """Whether a step of a plan is one that is under way."""
    begun = ms(step.start_s) <= ms(plan.made_at_s)
    return begun and step.action == run.action and ms(step.end_s) == ms(run.end_s)


def first_moment(start: Start, now_ms: int) -> Moment:
    """How things stand when a plan is made."""
    running, busy = {}, {}
    for step in start.running:
        values: list[Term] = [_term(argument.value) for argument in step.action.arguments]
        robots = tuple(str(a.value) for a in step.action.arguments if a.role == "robot")
        name, step_id = step.action.process, step.action.id
        running[step_id] = Run(name=name, arguments=tuple(values), robots=robots, end_ms=ms(step.end_s))
        busy.update(dict.fromkeys(robots, step_id))
    return Moment(
        now_ms=now_ms,
        fluents=start.fluents,
        running=running,
        busy=busy,
        held=start.held,
        claimed=start.claimed,
        team=start.team,
        worked_ms=start.worked_ms,
        taken={},
    )


def _term(value: Value) -> Term:
    match value:
        case Data(place):
            frame, _, name = place.rpartition("/")
            return Struct("loc", (frame, name))
        case Fluent(prop, subject):
            return Struct("fluent", (prop, subject))
        case _:
            return value
