"""A recipe kept from a goal as a way to accomplish a task type: which of its inputs is which of the task's."""

from __future__ import annotations

import re
from collections.abc import Mapping

from kb.processes import Process, Role
from kb.store import Snapshot
from kb.vocabulary import Kind
from planner.classical_goal import BadGoal

_ASKED = re.compile(r"\s*(?P<task>\w+)\s*(?:\((?P<pairs>[^()]*)\))?\s*")


def asked_task(realizes: str, snapshot: Snapshot) -> tuple[Process, dict[str, str]]:
    """The task type, and the inputs that are told by name: individual by input.

    Args:
        realizes: `Task` or `Task(input=individual, ...)`.

    Raises:
        BadGoal: It is no task type, has no such input, or promises outputs, which recipes of goals do not make.
    """
    asked = _ASKED.fullmatch(realizes)
    if asked is None:
        raise BadGoal(realizes, "is no task type; write it as SeeDrink, or as SeeDrink(drink=drink_1)")
    name = asked["task"]
    types = snapshot.ontology.individuals(Kind.SIMPLE_PROCESS)
    if name not in types:
        raise BadGoal(name, f"is no task type that recipes may realize; there is {', '.join(types) or 'none'}")
    task = snapshot.processes[name]
    if task.outputs:
        promised = ", ".join(p.name for p in task.outputs)
        raise BadGoal(name, f"promises {promised}, which no recipe that is kept from a goal makes")
    told: dict[str, str] = {}
    for pair in filter(None, map(str.strip, (asked["pairs"] or "").split(","))):
        parameter, equals, individual = (part.strip() for part in pair.partition("="))
        if not equals or parameter not in {p.name for p in task.inputs} or parameter in told:
            names = ", ".join(p.name for p in task.inputs)
            raise BadGoal(pair, f"gives no input of {name} a value; its inputs are {names or 'none'}, each given once")
        told[parameter] = individual
    return task, told


def task_inputs(realizes: str, inputs: Mapping[str, str], snapshot: Snapshot) -> tuple[str, dict[str, str]]:
    """The name of the task type, and which of its inputs each individual of a goal stands for.

    Args:
        realizes: As for `asked_task`.
        inputs: The class that each individual must be of, so that the recipe can be done.

    Raises:
        BadGoal: As for `asked_task`; or there is no input, or no single one, for an individual.
    """
    task, told = asked_task(realizes, snapshot)
    above = snapshot.ontology.superclasses
    names: dict[str, str] = {}
    for parameter, individual in told.items():
        if individual not in inputs:
            there = ", ".join(sorted(inputs)) or "nothing"
            raise BadGoal(realizes, f"{individual} is nothing that the recipe asks for; that is {there}")
        names[individual] = parameter
    for individual, kind in sorted(inputs.items()):
        fit = [
            p.name
            for p in task.inputs
            if p.role is Role.INPUT or kind == Kind.ROBOT
            if kind in above.get(p.kind, {p.kind})
        ]
        if individual in names and names[individual] not in fit:
            raise BadGoal(realizes, f"{names[individual]} of {task.name} need be no {kind}, as {individual} is")
        free = [name for name in fit if name not in names.values()]
        if individual not in names and len(free) != 1:
            choice = f"could be {' or '.join(free)}" if free else "is none of its inputs"
            told_how = f"; tell which, as in {task.name}({free[0]}={individual})" if free else ""
            raise BadGoal(realizes, f"{individual}, a {kind}, {choice}{told_how}")
        names.setdefault(individual, free[0] if free else "")
    return task.name, names
