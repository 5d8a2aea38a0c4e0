"""`concertmaster kb show`: what a process consists of, as text or as a flow chart."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from executive.exit_codes import OK
from executive.kb_commands.options import add_site
from kb.chart import chart
from kb.names import UnknownName
from kb.outline import outline, outline_text
from kb.store import KnowledgeBase


def add_show(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the command."""
    show = commands.add_parser("show", help="show what a process consists of, or draw it")
    show.add_argument("process", help="a process, such as FindEmptyDrink")
    add_site(show)
    show.add_argument("--expand", action="store_true", help="show what the processes that it does consist of, too")
    show.add_argument("--data", action="store_true", help="show what each step takes and gives")
    show.add_argument("--svg", type=Path, metavar="FILE", help="draw a flow chart into this file instead")
    show.set_defaults(command=_show)


def _show(options: argparse.Namespace) -> int:
    knowledge = KnowledgeBase(options.site, options.knowledge)
    snapshot = knowledge.snapshot()
    knowledge.close()
    if options.process not in snapshot.processes:
        raise UnknownName(options.process, "process", snapshot.processes)
    drawn = outline(snapshot, options.process, expand=options.expand)
    if options.svg is None:
        print(outline_text(drawn, data=options.data))
        return OK
    options.svg.write_text(chart(drawn, data=options.data), encoding="utf-8")
    print(options.svg)
    return OK
