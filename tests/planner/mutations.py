"""Ways to break a plan, each of which leaves none whatever the plan was.

A mutant has the makespan and bound that go with its steps, so that these do not give it away. What is
merely another plan (equal things exchanged, a step put off) is no mutant. The plan must be sound and of
a program that ends when the plan does (`waits_for` is empty).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from kb.terms import Argument
from planner.plan import Plan, PlannedStep, PlanStatus

Mutation = Callable[[Plan, np.random.Generator], Plan | None]
"""Returns None for a plan that it does not apply to."""

_MS = 0.001


def mutations(
    plan: Plan, rng: np.random.Generator, *, lasting: Callable[[PlannedStep], bool], earliest: bool = False
) -> Iterator[tuple[str, Plan]]:
    """A mutant of each kind that applies, with the name of the kind.

    Args:
        lasting: Whether the program asks for a step whatever the others do. What depends on a condition may not be
            wanted any more if it is left out.
        earliest: No step could begin earlier if the others begin when they do.
    """
    for mutation in (*MUTATIONS, *((begun_earlier,) if earliest else ())):
        mutant = mutation(plan, rng)
        if mutant is not None:
            yield mutation.__name__, mutant
    missing = _of([step for step in plan.steps if lasting(step)], rng)
    if missing is not None:
        yield "step_missing", _with(plan, [step for step in plan.steps if step is not missing])


def _of(options: Sequence[PlannedStep], rng: np.random.Generator) -> PlannedStep | None:
    return options[int(rng.integers(len(options)))] if options else None


def _with(plan: Plan, steps: Sequence[PlannedStep]) -> Plan:
    ordered = sorted(steps, key=lambda s: (s.start_s, s.action.robot or "", s.end_s))
    took_s = max((s.end_s for s in steps), default=plan.made_at_s) - plan.made_at_s
    return replace(plan, steps=tuple(ordered), makespan_s=took_s, lower_bound_s=took_s)


def _changed(plan: Plan, old: PlannedStep, new: PlannedStep) -> Plan:
    return _with(plan, [new if step is old else step for step in plan.steps])


def _choosing(plan: Plan, choices: Mapping[str, tuple[str | int, ...]]) -> Plan:
    return replace(plan, choices=choices)


def _robots(step: PlannedStep) -> list[str]:
    return [str(a.value) for a in step.action.arguments if a.role == "robot"]


# --------------------------------------------------------------------------------------------- steps


def step_foreign(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Something is done once more under an id that the program has not, when all is over."""
    step = _of(plan.steps, rng)
    if step is None:
        return None
    end_s = max(s.end_s for s in plan.steps)
    again = replace(
        step,
        action=replace(step.action, id=f"{step.action.id}_again"),
        start_s=end_s,
        end_s=end_s + step.end_s - step.start_s,
    )
    return _with(plan, [*plan.steps, again])


def id_altered(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A step has an id that the program has not."""
    step = _of(plan.steps, rng)
    return None if step is None else _changed(plan, step, replace(step, action=replace(step.action, id="task/nowhere")))


def ids_exchanged(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Two steps that are different things have each other's ids."""
    step = _of(plan.steps, rng)
    others = [s for s in plan.steps if step and replace(s.action, id=step.action.id) != step.action]
    other = _of([s for s in others if step and s.action.id != step.action.id], rng)
    if step is None or other is None:
        return None
    one, two = replace(step.action, id=other.action.id), replace(other.action, id=step.action.id)
    exchanged = {id(step): replace(step, action=one), id(other): replace(other, action=two)}
    return _with(plan, [exchanged.get(id(s), s) for s in plan.steps])


def process_altered(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A step is of another process."""
    step = _of(plan.steps, rng)
    other = _of([s for s in plan.steps if step and s.action.process != step.action.process], rng)
    if step is None or other is None:
        return None
    return _changed(plan, step, replace(step, action=replace(step.action, process=other.action.process)))


def robot_exchanged(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Another robot does a step than the program, and what the plan chooses, ask for."""
    step = _of([s for s in plan.steps if s.action.robots], rng)
    team = sorted({robot for s in plan.steps for robot in s.action.robots} | {"nobody"})
    if step is None:
        return None
    robot = str(rng.choice([r for r in team if r != step.action.robots[0]]))
    first = next(a for a in step.action.arguments if a.role == "robot")
    arguments = tuple(replace(a, value=robot) if a is first else a for a in step.action.arguments)
    action = replace(step.action, robots=(robot, *step.action.robots[1:]), arguments=arguments)
    return _changed(plan, step, replace(step, action=action))


def robots_untold(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """The robots of a step are not those that its arguments name."""
    step = _of([s for s in plan.steps if s.action.robots], rng)
    if step is None:
        return None
    return _changed(plan, step, replace(step, action=replace(step.action, robots=step.action.robots[:-1])))


def argument_altered(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A step is done with something else."""
    step = _of([s for s in plan.steps if any(a.role != "robot" for a in s.action.arguments)], rng)
    if step is None:
        return None
    altered: Argument = next(a for a in step.action.arguments if a.role != "robot")
    arguments = tuple(replace(a, value="nothing") if a is altered else a for a in step.action.arguments)
    return _changed(plan, step, replace(step, action=replace(step.action, arguments=arguments)))


def argument_missing(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A step lacks its last argument."""
    step = _of([s for s in plan.steps if s.action.arguments], rng)
    if step is None:
        return None
    action = replace(step.action, arguments=step.action.arguments[:-1])
    return _changed(plan, step, replace(step, action=action))


# --------------------------------------------------------------------------------------------- times


def duration_altered(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A step takes longer, or less long, than it does."""
    step = _of(plan.steps, rng)
    if step is None:
        return None
    by_s = float(rng.choice([-0.5, -_MS, _MS, 2.0]))
    return _changed(plan, step, replace(step, end_s=step.end_s + by_s))


def robot_at_two_things(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A robot begins what it does next a millisecond before it is done with something."""
    pairs = []
    for robot in sorted({robot for step in plan.steps for robot in _robots(step)}):
        own = sorted((s for s in plan.steps if robot in _robots(s)), key=lambda s: (s.start_s, s.end_s))
        pairs += [
            (one, two) for one, two in pairwise(own) if min(one.end_s - one.start_s, two.end_s - two.start_s) > _MS
        ]
    if not pairs:
        return None
    one, two = pairs[int(rng.integers(len(pairs)))]
    start_s = round(one.end_s - _MS, 3)
    return _changed(plan, two, replace(two, start_s=start_s, end_s=round(start_s + two.end_s - two.start_s, 3)))


def begun_before_the_plan(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A step begins before the plan is made."""
    step = _of(plan.steps, rng)
    if step is None:
        return None
    start_s = plan.made_at_s - _MS
    return _changed(plan, step, replace(step, start_s=start_s, end_s=start_s + step.end_s - step.start_s))


def begun_earlier(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A step begins a millisecond before it can."""
    step = _of(plan.steps, rng)
    if step is None:
        return None
    return _changed(plan, step, replace(step, start_s=round(step.start_s - _MS, 3), end_s=round(step.end_s - _MS, 3)))


def ended_before_begun(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A step ends before it begins."""
    step = _of([s for s in plan.steps if s.end_s > s.start_s], rng)
    return None if step is None else _changed(plan, step, replace(step, start_s=step.end_s, end_s=step.start_s))


def between_milliseconds(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A step begins and ends at no whole millisecond."""
    step = _of(plan.steps, rng)
    if step is None:
        return None
    return _changed(plan, step, replace(step, start_s=step.start_s + 0.0004, end_s=step.end_s + 0.0004))


# ------------------------------------------------------------------------------------------- choices


def choice_missing(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """One choice is left open; that a loop has had its turns need not be said."""
    asked = sorted(at for at, answers in plan.choices.items() if "enough" not in answers)
    if not asked:
        return None
    missing = str(rng.choice(asked))
    return _choosing(plan, {at: answers for at, answers in plan.choices.items() if at != missing})


def choice_impossible(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """One choice is of what there is not."""
    if not plan.choices:
        return None
    altered = str(rng.choice(sorted(plan.choices)))
    answers = plan.choices[altered]
    nothing: str | int = "nobody" if isinstance(answers[0], str) else 99
    return _choosing(plan, {**plan.choices, altered: (nothing, *answers[1:])})


def choice_unasked(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """One choice is made once more than the program comes to it."""
    if not plan.choices:
        return None
    altered = str(rng.choice(sorted(plan.choices)))
    answers = plan.choices[altered]
    return _choosing(plan, {**plan.choices, altered: (*answers, answers[-1])})


# ------------------------------------------------------------------------------------------- figures


def makespan_altered(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """The plan claims to be over sooner or later than it is."""
    makespan_s = plan.makespan_s + float(rng.choice([-_MS, _MS, 1.0]))
    return replace(plan, makespan_s=makespan_s, lower_bound_s=makespan_s)


def bound_overstated(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """The bound is above the makespan."""
    return replace(plan, lower_bound_s=plan.makespan_s + _MS)


def called_optimal(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """The bound is below the makespan of what is called optimal."""
    return replace(plan, status=PlanStatus.SOLVED_OPTIMALLY, lower_bound_s=plan.makespan_s - _MS)


def no_figure(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """A figure is no number."""
    return replace(plan, makespan_s=float("nan"))


def waiting_for_nothing(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """The plan ends to wait for what nobody finds out."""
    return replace(plan, waits_for=("task/nowhere",))


MUTATIONS: tuple[Mutation, ...] = (
    step_foreign,
    id_altered,
    ids_exchanged,
    process_altered,
    robot_exchanged,
    robots_untold,
    argument_altered,
    argument_missing,
    duration_altered,
    robot_at_two_things,
    begun_before_the_plan,
    ended_before_begun,
    between_milliseconds,
    choice_missing,
    choice_impossible,
    choice_unasked,
    makespan_altered,
    bound_overstated,
    called_optimal,
    no_figure,
    waiting_for_nothing,
)
