"""Goals: a request for what shall be true, solved by the engines of unified-planning, kept as a recipe if asked."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from executive.errors import BadRequest
from executive.request import TaskRequest
from executive.travel import travel_times
from grounding.messages import PoseStamped
from grounding.runner import Runner
from kb.files import SHIPPED
from kb.ontology import fluent_properties
from kb.store import Snapshot
from kb.terms import Fluent
from kb.vocabulary import Kind
from planner.classical_goal import Goal, GoalPlan, parse_goal
from planner.classical_operators import KNOWN
from planner.classical_process import PROCESS
from planner.classical_realizes import asked_task
from planner.classical_recipe import as_owl, check_name, file_name


def check_goal(given: str | Sequence[str] | Mapping[str, object], snapshot: Snapshot) -> TaskRequest:
    """Make a request of what a person wants to be true; all robots may take part.

    Args:
        given: As `planner.classical_goal.parse_goal` takes it.

    Raises:
        BadGoal: It makes no sense.
        DependencyMissing: The extra `goals` is not installed.
    """
    goal = parse_goal(given, snapshot)
    from planner.classical_engine import require_engines  # noqa: PLC0415 - see solve_goal

    require_engines()
    robots = len(snapshot.ontology.individuals(Kind.ROBOT))
    return TaskRequest(process=PROCESS, arguments={}, robots=robots, goal=goal)


def solve_goal(
    goal: Goal,
    snapshot: Snapshot,
    messages: Mapping[str, object],
    pose_of_robot: Callable[[str], PoseStamped],
    runner: Runner,
    *,
    t_s: float,
) -> GoalPlan:
    """Find out what leads to a goal from what is told now.

    Args:
        messages: By place, among them those of fluents whose values are messages.
        pose_of_robot: Where a robot believes it is.
        runner: Of the service that tells travel times.
        t_s: Time now.

    Raises:
        ServiceFailed: Travel times cannot be had.
    """
    from planner.classical import solve  # noqa: PLC0415 - unified_planning takes a second to import

    ontology = snapshot.ontology
    robots, places = ontology.individuals(Kind.ROBOT), ontology.individuals(Kind.LOCATION)
    travel = travel_times(robots, places, snapshot, pose_of_robot, runner, t_s=t_s)
    known = {
        (prop, subject): KNOWN
        for prop in fluent_properties(ontology)
        if ontology.datum_property(prop)
        for subject in ontology.kinds
        if messages.get(Fluent(prop, subject).place) is not None
    }
    return solve(goal, replace(snapshot, fluents={**snapshot.fluents, **known}), travel)


def recipe_file(name: str, folder: Path, snapshot: Snapshot, *, realizes: str = "") -> Path:
    """Where a recipe of this name is to be kept.

    Args:
        folder: Of ontologies: with `tasks` in it.
        realizes: The task type that it is to accomplish, as for `planner.classical_recipe.as_owl`.

    Raises:
        BadGoal: The name is no new name of a process, or what it is to accomplish is no task type for it.
        BadRequest: The folder is none of ontologies, or the one that is shipped, or has such a file.
    """
    check_name(name, snapshot)
    if realizes:
        asked_task(realizes, snapshot)
    if folder.resolve().is_relative_to(SHIPPED):
        told = "the shipped ontologies are not changed; copy them, and give the folder of the copy"
        raise BadRequest("folder", f"{folder} is where the shipped ontologies are: {told}")
    if not (folder / "tasks").is_dir():
        raise BadRequest("folder", f"{folder} is no folder of ontologies: there is no {folder / 'tasks'}")
    file = folder / "tasks" / file_name(name)
    if file.exists():
        raise BadRequest("store", f"{file} is there already; choose another name for the recipe")
    return file


def store_recipe(
    plan: GoalPlan, name: str, folder: Path, snapshot: Snapshot, *, t_s: float, realizes: str = ""
) -> Path:
    """Keep a plan as a recipe; returns the file, which a site has to import so that the recipe is known there.

    Args:
        t_s: Time now.
        realizes: The task type that it is a way to accomplish; none if empty.

    Raises:
        BadGoal: The plan has no steps, or its inputs are not those of the task type; or as for `recipe_file`.
        BadRequest: As for `recipe_file`.
    """
    file = recipe_file(name, folder, snapshot, realizes=realizes)
    text = as_owl(plan, name, snapshot, kept_at_s=t_s, realizes=realizes)
    with file.open("x", encoding="utf-8") as stream:  # x: not over a file that has come meanwhile
        stream.write(text)
    return file
