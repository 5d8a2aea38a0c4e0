"""Checks a plan by its own reading of the program; shares no code with what makes plans.

The plan is replayed: its steps end and start in order of time, and each start has to be one that what
remains of the program allows then (planner/checking/walk.py), by robots that may do it (starting.py), in
the time that the ontology gives it (demands.py), where conditions are as effects have left them
(knowledge.py). In the end, nothing may remain.

What happens at one instant happens in some order: what ends, before what starts; else any order will do.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite

from kb.compiler import Program
from kb.store import Snapshot
from kb.terms import Struct, Term
from planner.checking.constructs import Constructs
from planner.checking.demands import Definitions, Demands
from planner.checking.knowledge import Knowledge
from planner.checking.moment import CannotCheck
from planner.checking.replay import Replay
from planner.checking.start import Start, beginning, ms, not_going_on
from planner.checking.starting import MS_PER_S, Stage, seconds
from planner.plan import Plan, PlanStatus

__all__ = ["CannotCheck", "Start", "beginning", "violations"]

_WHOLE = 1e-3
"""Plans are in whole milliseconds, but for what floating point leaves of them."""


def violations(
    plan: Plan,
    snapshot: Snapshot,
    program: Program,
    start: Start,
    *,
    robots: int,
    travel_times: Mapping[tuple[str, str, str], float],
) -> list[str]:
    """What is wrong with a plan, one sentence each; empty if it is sound.

    Of what is wrong in the course of it, only the first is told: what comes later follows from it.

    Raises:
        CannotCheck: The program has a term that is none of planner/golog/syntax.pl. No compiled program has.

    Args:
        program: What `start.remaining` calls.
        start: What is left to be done, and how things stand, when the plan is made.
        robots: At most so many may take part.
        travel_times: Seconds by (robot, from, to); from "here" and from each location.
    """
    if odd := list(_not_in_milliseconds(plan)):
        return odd
    found = [*_figures(plan), *not_going_on(plan, start)]
    definitions = _definitions(program)
    knowledge, demands = Knowledge(snapshot, start.truths, start.places), Demands(snapshot, definitions)
    constructs = Constructs(
        definitions=definitions,
        demands=demands,
        knowledge=knowledge,
        choices=plan.choices,
        excluded=start.excluded,
        began_ms=ms(start.began_s),
    )
    stage = Stage(knowledge, demands, travel_times, robots)
    return [*found, *Replay(plan, start, constructs, demands, knowledge, stage).faults()]


def _definitions(program: Program) -> Definitions:
    found: dict[str, tuple[tuple[Term, ...], Term]] = {}
    for definition in program.definitions:
        match definition:
            case Struct("proc", (Struct(name, parameters), body)):
                found[name] = (parameters, body)
            case Struct("proc", (str(name), body)):
                found[name] = ((), body)
            case _:
                raise CannotCheck(f"no procedure: {definition}")
    return found


# ------------------------------------------------------------------------------------ the plan's figures


def _not_in_milliseconds(plan: Plan) -> Iterator[str]:
    for told, time_s in (("made_at_s", plan.made_at_s), ("makespan", plan.makespan_s), ("bound", plan.lower_bound_s)):
        if not isfinite(time_s):
            yield f"the {told} {time_s} is no time"
    for step in plan.steps:
        for time_s in (step.start_s, step.end_s):
            if not isfinite(time_s) or abs(time_s * MS_PER_S - round(time_s * MS_PER_S)) > _WHOLE:
                yield f"{step.action} starts or ends at {time_s} s, which is no whole number of milliseconds"


def _figures(plan: Plan) -> Iterator[str]:
    made_ms, makespan_ms, bound_ms = ms(plan.made_at_s), ms(plan.makespan_s), ms(plan.lower_bound_s)
    for step in plan.steps:
        if ms(step.start_s) < made_ms:
            yield f"{step.action} starts at {step.start_s:.3f} s, before the plan is made"
        if step.end_s < step.start_s:
            yield f"{step.action} ends at {step.end_s:.3f} s, before it starts"
    took_ms = max((ms(step.end_s) for step in plan.steps), default=made_ms) - made_ms
    if took_ms != makespan_ms:
        yield f"the makespan is {seconds(took_ms)}, not {seconds(makespan_ms)}"
    if bound_ms > makespan_ms:
        yield f"the lower bound {seconds(bound_ms)} is above the makespan"
    if plan.status is PlanStatus.SOLVED_OPTIMALLY and bound_ms < makespan_ms:
        yield f"the lower bound {seconds(bound_ms)} does not prove {seconds(makespan_ms)} the least"
