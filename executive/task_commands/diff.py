"""`concertmaster kb diff`: what is different between two folders of ontologies, and what that changes for tasks."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict

from executive.errors import BadRequest
from executive.exit_codes import OK
from executive.fleet import Fleet
from executive.replay import scenario_of
from executive.request import TaskRequest
from executive.revising import TaskEffect
from kb.store import KnowledgeBase, Proposal
from kb.vocabulary import Kind


def diff(options: argparse.Namespace) -> int:
    """Compare; the exit status."""
    if options.task:
        scenario = scenario_of(options.scenario) if options.scenario else None
        with Fleet.open(options.site, scenario=scenario, knowledge=options.old) as fleet:
            live, knowledge = fleet.parts.live, fleet.parts.knowledge
            proposal = knowledge.propose(knowledge.read(options.new))
            _print(options, proposal, live.foresee(proposal, _requests(options.task, proposal)))
        return OK
    knowledge = KnowledgeBase(options.site, options.old)
    try:
        _print(options, knowledge.propose(knowledge.read(options.new)), ())
    finally:
        knowledge.close()
    return OK


def _requests(tasks: list[str], proposal: Proposal) -> dict[str, TaskRequest]:
    """Requests as they are given; whether they make sense is part of the answer."""
    robots = max(1, len(proposal.base.ontology.individuals(Kind.ROBOT)))
    requests = {}
    for task in tasks:
        process, *given = task.split()
        pairs = [pair.partition("=") for pair in given]
        for name, equals, _ in pairs:
            if not equals:
                raise BadRequest("task", f"--task {task!r}: {name!r} is no argument; write name=value")
        requests[task] = TaskRequest(process=process, arguments={n: v for n, _, v in pairs}, robots=robots)
    return requests


def _print(options: argparse.Namespace, proposal: Proposal, effects: tuple[TaskEffect, ...]) -> None:
    if options.json:
        told = {"difference": proposal.difference.as_data(), "tasks": [asdict(effect) for effect in effects]}
        print(json.dumps(told, indent=2, ensure_ascii=False))
        return
    lines = [*proposal.difference.lines, *proposal.carry.sentences]
    print("\n".join([*(lines or ["nothing is different"]), *(effect.text for effect in effects)]))
