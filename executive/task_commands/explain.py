"""`concertmaster explain`: why a task is planned so, or what would make it possible."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator

from executive.errors import BadRequest
from executive.exit_codes import OK
from executive.task_commands.asked import arguments_of, open_fleet
from planner.answers import Answer, as_data
from planner.explain import Explainer
from planner.plan import Plan


def explain(options: argparse.Namespace) -> int:
    """Answer; the exit status."""
    arguments = arguments_of(options)
    with (
        open_fleet(options) as fleet,
        fleet.explaining(options.task, robots=options.robots, **arguments) as (plan, explainer),
    ):
        answers = list(_answers(options, plan, explainer))
    if options.json:
        print(json.dumps([as_data(a) for a in answers], indent=2, ensure_ascii=False))
    else:
        for answer in answers:
            print(answer.text)
    return OK


def _answers(options: argparse.Namespace, plan: Plan, explainer: Explainer) -> Iterator[Answer]:
    if not plan.solved:
        yield explainer.what_would_help()
        return
    if options.why_not is not None:
        yield explainer.why_not(plan, *_pair("--not", options.why_not))
    if options.first is not None:
        yield explainer.why_not_first(plan, *_pair("--first", options.first))
    if options.why_not is None and options.first is None:
        yield explainer.why(plan)


def _pair(option: str, given: str) -> tuple[str, str]:
    one, equals, other = given.rpartition("=")
    if not equals:
        raise BadRequest(option, f"{option} {given} names one thing; name two, such as {option} drink_1=pico_1")
    return one, other
