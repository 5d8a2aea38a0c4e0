"""Problems and plans in the languages of other planners, and a second opinion on our plans.

    goal       PDDL 2.1 (.pddl, durative actions), ANML (.anml)
    task       HDDL (.hddl, without time: the language has none)

PDDL and HDDL have a file for the domain and one for the problem: `find.pddl` goes with `find_domain.pddl`.
Names are written in small letters there; what is renamed is found again when a plan is read.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path

from unified_planning.engines import ValidationResultStatus
from unified_planning.engines.plan_validator import TimeTriggeredPlanValidator
from unified_planning.io import ANMLWriter, PDDLWriter
from unified_planning.model import Problem
from unified_planning.plans import ActionInstance, TimeTriggeredPlan

from kb.errors import ConcertmasterError
from kb.store import Snapshot
from kb.vocabulary import Property
from planner.classical import GoalPlan, adopt
from planner.classical_goal import Goal
from planner.classical_ground import World, here
from planner.classical_model import Model
from planner.classical_operators import bound, offered
from planner.classical_tasks import CannotExport, task_problem
from planner.network import Travel

_STEP = re.compile(r"(?:(?P<start>[\d.]+)\s*:\s*)?\(\s*(?P<words>[^()]+?)\s*\)\s*(?:\[\s*[\d.]+\s*\])?")


class BadPlanText(ConcertmasterError):
    """A plan that somebody gave us cannot be read."""

    fault = "request"


def export_goal(goal: Goal, snapshot: Snapshot, travel: Travel, path: Path) -> list[Path]:
    """Write a goal, and all that can be done about it, as a problem for other planners.

    Args:
        path: Ends in `.pddl` or `.anml`.

    Returns:
        The files written.

    Raises:
        CannotExport: The suffix is another.
    """
    match path.suffix:
        case ".pddl":
            return _write_pddl(goal_problem(goal, snapshot, travel, relational=True), path)
        case ".anml":
            path.write_text(ANMLWriter(goal_problem(goal, snapshot, travel)).get_problem(), encoding="utf-8")
            return [path]
        case suffix:
            raise CannotExport(f"a goal can be written as .pddl or .anml, not as {suffix or 'a file without suffix'}")


def export_task(
    process: str, arguments: Mapping[str, str], snapshot: Snapshot, travel: Travel, path: Path
) -> list[Path]:
    """Write a task, with all recipes that it may come to, as a problem for hierarchical planners.

    Args:
        path: Ends in `.hddl`.

    Returns:
        The files written.

    Raises:
        CannotExport: The suffix is another, or the task has constructs that the language has not.
    """
    if path.suffix != ".hddl":
        raise CannotExport(f"a task can be written as .hddl, not as {path.suffix or 'a file without suffix'}")
    return _write_pddl(task_problem(process, arguments, snapshot, travel, timed=False, relational=True), path)


def goal_problem(goal: Goal, snapshot: Snapshot, travel: Travel, *, relational: bool = False) -> Problem:
    """A goal as a temporal problem of unified-planning, durations in milliseconds.

    Args:
        relational: With truth values alone for what changes, as PDDL has it.
    """
    return Model(World(snapshot, offered(snapshot), travel), goal, timed=True, relational=relational).problem


def import_plan(text: str, goal: Goal, snapshot: Snapshot, travel: Travel) -> GoalPlan:
    """Take over a plan that another planner made for an exported goal.

    Args:
        text: Lines such as `0.0: (navigate amigo_1 at_bar ...) [11600]` or `(navigate amigo_1 at_bar ...)`; `;` begins
            a comment.

    Raises:
        BadPlanText: A line cannot be read, or names what is not in the problem.
        InvalidPlan: It does not lead to the goal.
    """
    problem = goal_problem(goal, snapshot, travel, relational=True)
    writer = PDDLWriter(problem)
    writer.get_domain()
    writer.get_problem()
    names = {writer.get_pddl_name(item): item.name for item in (*problem.actions, *problem.all_objects)}
    steps: list[tuple[Fraction, tuple[str, ...]]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        line = line.partition(";")[0].strip().lower()
        if not line:
            continue
        read = _STEP.fullmatch(line)
        if read is None:
            raise BadPlanText(f"line {number} of the plan is no step: {line!r}; write `0.0: (action object ...) [1.0]`")
        words = read["words"].split()
        unknown = [word for word in words if word not in names]
        if unknown:
            raise BadPlanText(f"line {number} of the plan names {unknown[0]}, which is not in the problem")
        steps.append((Fraction(read["start"] or len(steps)), tuple(names[word] for word in words)))
    return adopt([step for _, step in sorted(steps, key=lambda s: s[0])], goal, snapshot, travel, "imported")


def agrees(plan: GoalPlan, snapshot: Snapshot, travel: Travel) -> str:
    """Ask unified-planning's own validator for time-triggered plans.

    Returns:
        Nothing if it accepts the plan, else why not.
    """
    problem = goal_problem(plan.goal, snapshot, travel)
    em = problem.environment.expression_manager
    position: dict[str, str] = {}
    timed = []
    for number, step in enumerate(plan.steps):
        action = problem.action(step.operator.process)
        values = dict(step.binding)
        for leg in step.operator.legs:
            robot = str(bound(leg.robot, step.binding))
            said = getattr(leg.robot, "name", robot)
            values[f"Profile_{said}"] = f"profile_{travel.profile[robot]}"
            if leg.origin is None:
                values[f"Origin_{said}"] = position.get(robot, here(robot))
        for place, claim in enumerate(step.operator.claims):
            values[f"Slot_{place}"] = f"slot_1_of_{bound(claim, step.binding)}"
        for effect in step.operator.effects:
            if effect.prop == Property.LOCATED_AT:
                position[str(bound(effect.subject, step.binding))] = str(bound(effect.value, step.binding))
        objects = tuple(em.ObjectExp(problem.object(values[p.name])) for p in action.parameters)
        # What follows something begins a little later: nothing may begin just when its condition comes true.
        start = Fraction(step.start_ms) + Fraction(number, 1000)
        timed.append((start, ActionInstance(action, objects), Fraction(step.end_ms - step.start_ms)))
    validator = TimeTriggeredPlanValidator(environment=problem.environment)
    result = validator.validate(problem, TimeTriggeredPlan(timed, problem.environment))
    if result.status is ValidationResultStatus.VALID:
        return ""
    return "; ".join([str(result.reason), *(m.message for m in result.log_messages or ())])


def _write_pddl(problem: Problem, path: Path) -> list[Path]:
    writer = PDDLWriter(problem)
    writer.get_domain()  # this gathers the constants, as sets: the same file is to come out each time
    writer.domain_objects = {
        kind: sorted(constants, key=lambda c: str(c.name))
        for kind, constants in sorted(writer.domain_objects.items(), key=lambda item: str(item[0].name))
    }
    domain = path.with_name(f"{path.stem}_domain{path.suffix}")
    domain.write_text(writer.get_domain(), encoding="utf-8")
    path.write_text(writer.get_problem(), encoding="utf-8")
    return [domain, path]
