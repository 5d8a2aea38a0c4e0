"""`concertmaster kb history`: what was told when, by whom, and what was known at a time, from a trace."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from executive.exit_codes import OK
from executive.trace import FactsTold, KnowledgeAccepted, KnowledgeRolledBack, TraceEvent, read_trace
from kb.history import Fact, History, Source, SourceKind, shown


def add_history(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the command."""
    history = commands.add_parser("history", help="tell which facts were told when and by whom, from a trace")
    history.add_argument("trace", type=Path, metavar="TRACE", help="a trace.jsonl that `run` wrote")
    history.add_argument("property", nargs="?", metavar="PROPERTY", help="only facts of this property")
    history.add_argument("subject", nargs="?", metavar="SUBJECT", help="only facts of this individual")
    history.add_argument("--at", type=float, metavar="S", help="instead: what was known at this time, in seconds")
    history.set_defaults(command=_history)


def _history(options: argparse.Namespace) -> int:
    history = history_of(read_trace(options.trace))
    if options.at is None:
        lines = [str(fact) for fact in history.of(options.property, options.subject)]
    else:
        lines = [
            f"{prop}({subject}) = {shown(value)}"
            for (prop, subject), value in sorted(history.known_at(options.at).items())
            if options.property in (None, prop) and options.subject in (None, subject)
        ]
    print("\n".join(lines) or "nothing was told")
    return OK


def history_of(events: Iterable[TraceEvent]) -> History:
    """The facts of a trace; what the files state at the beginning is not in it."""
    kept = [e for e in events if isinstance(e, FactsTold | KnowledgeAccepted | KnowledgeRolledBack)]
    history, now, revision = History({}, limit=len(kept)), dict[tuple[str, str], Any](), 1
    for event in kept:
        if not isinstance(event, FactsTold):
            revision = event.revision
            continue
        key = (event.prop, event.subject)
        source = _source(event, revision)
        history.note(
            Fact(
                t_s=event.t_s,
                prop=event.prop,
                subject=event.subject,
                value=event.value,
                before=now.get(key),
                source=source,
            )
        )
        now[key] = event.value
    return history


def _source(event: FactsTold, revision: int) -> Source:
    if event.task:
        action = event.source or "an action"  # traces of before did not tell which
        return Source(kind=SourceKind.ACTION, task=event.task, action=action, robot=event.robot)
    kind = SourceKind.FILES if event.source == SourceKind.FILES else SourceKind.PERSON
    return Source(kind=kind, revision=revision)
