"""`concertmaster kb explain`: which robot can do which task, and what is missing."""

from __future__ import annotations

import argparse
import json
import shutil
import textwrap
from collections.abc import Iterator, Sequence
from typing import Any

from executive.exit_codes import OK
from executive.kb_commands.options import add_site
from executive.kb_commands.tables import table
from kb.derivation import Derivation, reason_lines
from kb.names import UnknownName
from kb.pages.readiness import readiness_data, readiness_page
from kb.query import Questions
from kb.readiness import Readiness, Verdict, matrix, robot_classes
from kb.store import KnowledgeBase, Snapshot
from kb.vocabulary import Kind

_WORDS = {Verdict.ABLE: "able", Verdict.NOT_NOW: "not now", Verdict.UNABLE: "unable"}


def add_explain(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the command."""
    explain = commands.add_parser("explain", help="tell which robot can do which task, and what is missing")
    explain.add_argument("robot", nargs="?", help="a robot or a class of robots (default: all)")
    explain.add_argument("task", nargs="?", help="a task (default: all that may be asked for)")
    add_site(explain)
    explain.add_argument("--format", choices=("text", "json", "html"), default="text", help="default: %(default)s")
    explain.set_defaults(command=_explain)


def _explain(options: argparse.Namespace) -> int:
    knowledge = KnowledgeBase(options.site, options.knowledge)
    snapshot = knowledge.snapshot()
    knowledge.close()
    robot, task = _which(snapshot, options.robot, options.task)
    fleet = snapshot.ontology.individuals(Kind.ROBOT)
    who = [robot] if robot else [*fleet, *robot_classes(snapshot)]
    tasks = [task] if task else [t for t in Questions(snapshot).tasks() if not snapshot.processes[t].is_atomic]
    found = matrix(snapshot, who, tasks)
    match options.format:
        case "json":
            print(json.dumps(readiness_data(snapshot, found), indent=2, ensure_ascii=False))
        case "html":
            print(readiness_page(snapshot, found), end="")
        case _ if robot and task:
            print("\n".join(_derivation(snapshot, found[0])))
        case _:
            print("\n".join(_matrix(found, who, tasks)))
    return OK


def _which(snapshot: Snapshot, robot: str | None, task: str | None) -> tuple[str | None, str | None]:
    """A single name may be that of a task."""
    if robot is not None and task is None and robot in snapshot.processes:
        return None, robot
    if robot is not None and robot not in (*snapshot.ontology.individuals(Kind.ROBOT), *robot_classes(snapshot)):
        known = [*snapshot.ontology.individuals(Kind.ROBOT), *robot_classes(snapshot)]
        raise UnknownName(robot, "robot or task" if task is None else "robot", [*known, *snapshot.processes])
    return robot, task


def _matrix(found: Sequence[Readiness], who: Sequence[str], tasks: Sequence[str]) -> Iterator[str]:
    """Robots by tasks, as many tasks beside one another as there is room for; then who lacks what."""
    cell = {(r.who, r.task): _WORDS[r.verdict] for r in found}
    columns = shutil.get_terminal_size().columns
    room = columns - max(map(len, (*who, "robot")))
    shown: list[str] = []
    for task in tasks:
        if shown and sum(max(len(t), 7) + 2 for t in (*shown, task)) > room:
            yield from (table(["robot", *shown], [[w, *(cell[w, t] for t in shown)] for w in who]), "")
            shown = []
        shown.append(task)
    yield table(["robot", *shown], [[w, *(cell[w, t] for t in shown)] for w in who])
    lacking: dict[tuple[str, str], list[str]] = {}
    for readiness in found:
        for lack in readiness.lacks:
            asks = f" (asked for by {', '.join(lack.processes)})"
            lacking.setdefault((lack.text + asks, readiness.who), []).append(readiness.task)
    alike: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for (text, robot), where in lacking.items():
        alike.setdefault((text, tuple(where)), []).append(robot)
    for (text, at), robots in alike.items():
        told = f"{', '.join(robots)} in {', '.join(at)}: {text}"
        yield "\n" + textwrap.fill(told, columns, subsequent_indent="  ", break_on_hyphens=False)


def _derivation(snapshot: Snapshot, found: Readiness) -> Iterator[str]:
    words = {Verdict.ABLE: "can take part in", Verdict.NOT_NOW: "cannot now take part in"}
    role = f" as {found.role}" if found.role else ", which needs no robot"
    yield f"{found.who} {words.get(found.verdict, 'cannot take part in')} {found.task}{role}"
    if found.through:
        yield f"by {' or '.join(found.through)}"
    for lack in found.lacks:
        yield f"- {lack.text} (asked for by {', '.join(lack.processes)})"
    derivation = Derivation(snapshot.ontology)
    for capability, processes in found.requires.items():
        yield f"{capability}, for {', '.join(processes)}:"
        yield from (f"  {line}" for line in reason_lines(derivation.capability(found.who, capability)))
