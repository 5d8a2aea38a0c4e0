"""`concertmaster kb services`: what a robot must offer: ROS service definitions, and names of actions and topics."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from typing import Any

from executive.errors import BadRequest
from executive.exit_codes import OK
from executive.kb_commands.options import add_site
from kb.checking import read_site
from kb.groundings import Field, must_offer
from kb.learned import main_file
from kb.vocabulary import Kind

_ANY_REVISION = 0


def add_services(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the command."""
    services = commands.add_parser("services", help="tell which services a robot must offer, with their types")
    services.add_argument("robot", nargs="?", help="robot (default: any, as {robot})")
    add_site(services)
    services.set_defaults(command=_services)


def _services(options: argparse.Namespace) -> int:
    snapshot = read_site(main_file(options.knowledge, options.site), options.knowledge, _ANY_REVISION)
    if options.robot is not None and not snapshot.ontology.is_a(options.robot, Kind.ROBOT):
        known = ", ".join(snapshot.ontology.individuals(Kind.ROBOT))
        raise BadRequest("robot", f"{options.robot} is no robot of {options.site}; its robots are {known}")
    robots = [options.robot] if options.robot else snapshot.ontology.individuals(Kind.ROBOT)
    groundings = [
        g for g in snapshot.groundings.values() if any(must_offer(snapshot.ontology, robot, g) for robot in robots)
    ]
    for number, grounding in enumerate(sorted(groundings, key=lambda g: g.service)):
        if number:
            print()
        name = grounding.service.replace("{robot}", options.robot or "{robot}")
        if grounding.action_type:
            print(f"# {name}: {grounding.process}, an action of type {grounding.action_type}")
            continue
        if grounding.is_topic:
            (message,) = grounding.reply
            print(f"# {name}: {grounding.process}, a topic of type {message.message_type}")
            continue
        print(f"# {name}: {grounding.process}")
        print("\n".join([*_lines(grounding.request), "---", *_lines(grounding.reply)]))
    return OK


def _lines(fields: Iterable[Field]) -> list[str]:
    """Fields in the format of `.srv` files."""
    return [f"{field.message_type} {field.name}" for field in fields]
