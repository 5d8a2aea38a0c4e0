"""What a person asks for on the command line, and the fleet that is to do it."""

from __future__ import annotations

import argparse
from pathlib import Path

from executive.errors import BadRequest
from executive.fleet import Fleet
from executive.replay import scenario_of
from kb.files import SHIPPED
from planner.classical_goal import GoalPlan


def open_fleet(
    options: argparse.Namespace,
    trace: Path | None = None,
    *,
    compute: Path | None = None,
    faults: Path | None = None,
    connect: str | None = None,
) -> Fleet:
    """Open the fleet that the options say, with the files that only some commands have options for."""
    return Fleet.open(
        options.site,
        scenario=scenario_of(options.scenario) if options.scenario else None,
        knowledge=options.knowledge,
        seed=options.seed,
        trace=trace,
        compute=compute,
        faults=faults,
        connect=connect,
    )


def arguments_of(options: argparse.Namespace) -> dict[str, str]:
    """The arguments of the task, by name.

    Raises:
        BadRequest: One is none, or is given twice.
    """
    arguments: dict[str, str] = {}
    for given in options.arguments:
        name, equals, value = given.partition("=")
        if not equals:
            raise BadRequest(given, f"{given!r} is no argument; write name=value, such as room=tue_lab")
        if name == "robots":
            raise BadRequest(name, f"{given!r} is no argument of the task; write --robots {value}")
        if name in arguments:
            raise BadRequest(name, f"{name} is given twice, as {arguments[name]!r} and as {value!r}")
        arguments[name] = value
    return arguments


def check_goal_options(options: argparse.Namespace) -> None:
    """Refuse options that go with a goal, or without one, where they make no sense."""
    if options.goal is not None and options.robots is not None:
        raise BadRequest("robots", "all robots may take part in reaching a goal; leave --robots out")
    if options.store and options.goal is None:
        raise BadRequest("store", "--store keeps what leads to a goal; give --goal as well")
    if options.realizes and not options.store:
        raise BadRequest("realizes", "--realizes tells what the recipe of --store is for; give --store NAME as well")
    if options.folder and not options.store:
        raise BadRequest("folder", "--folder tells where --store keeps the recipe; give --store NAME as well")


def _recipes(options: argparse.Namespace) -> Path:
    folder: Path = options.folder or options.knowledge or SHIPPED
    return folder


def check_store(options: argparse.Namespace, fleet: Fleet) -> None:
    """Before anything moves: whether a recipe can be kept as `--store` says."""
    if options.store:
        fleet.check_recipe(options.store, _recipes(options), realizes=options.realizes)


def store(options: argparse.Namespace, fleet: Fleet, plan: GoalPlan) -> None:
    """Keep what leads to the goal as a recipe."""
    file = fleet.store_recipe(plan, options.store, _recipes(options), realizes=options.realizes)
    print(f"recipe:   {file}")
