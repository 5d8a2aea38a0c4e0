"""`concertmaster kb ask`: a SPARQL query over what is known."""

from __future__ import annotations

import argparse
import csv
import gc
import io
import json
import sys
from pathlib import Path
from typing import Any

from executive.exit_codes import OK, complain
from executive.kb_commands.options import add_site
from executive.kb_commands.tables import table
from kb.files import read_files
from kb.ontology import close
from kb.reasoner import classify
from kb.revisions import first_file
from kb.sparql import MOST_ROWS, TIME_LIMIT_S, Answer, BadQuery, Endpoint, results_json, short


def add_ask(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the command."""
    asking = commands.add_parser("ask", help="answer a SPARQL query over what is known")
    asking.add_argument("query", help="SELECT, ASK, CONSTRUCT or DESCRIBE; @FILE reads it from a file, - from input")
    add_site(asking)
    asking.add_argument("--format", choices=("table", "json", "csv"), default="table", help="default: %(default)s")
    asking.add_argument(
        "--time-limit",
        type=float,
        default=TIME_LIMIT_S,
        metavar="S",
        help="give up after so long (default: %(default)s)",
    )
    asking.add_argument(
        "--rows", type=int, default=MOST_ROWS, metavar="N", help="print so many rows at most (default: %(default)s)"
    )
    asking.set_defaults(command=_ask)


def _ask(options: argparse.Namespace) -> int:
    query = _query(options.query)
    gc.disable()  # nothing becomes garbage here, and looking for it in a large site takes a fifth of the time
    try:
        # Whatever is no contradiction can be asked about; what else is wrong, `kb check` tells.
        files = read_files(first_file(options.site, options.knowledge), options.knowledge)
        with Endpoint(close(files, classify(files)), {}) as endpoint:
            answer = endpoint.ask(query, time_limit_s=options.time_limit, most_rows=options.rows)
    finally:
        gc.enable()
    for doubt in answer.doubts:
        complain(f"concertmaster: {doubt}")
    match options.format:
        case "json":
            print(json.dumps(results_json(answer), indent=2, ensure_ascii=False))
        case "csv":
            print(_csv(answer), end="")
        case _:
            print(_table(answer, endpoint.prefixes))
    if not answer.complete:
        complain(f"concertmaster: there are more than {options.rows} rows; --rows gives more")
    return OK


def _query(given: str) -> str:
    if given == "-":
        return sys.stdin.read()
    if not given.startswith("@"):
        return given
    try:
        return Path(given[1:]).read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise BadQuery(f"{given[1:]} is not UTF-8 text: {error}") from error


def _table(answer: Answer, known: dict[str, str]) -> str:
    if answer.holds is not None:
        return "yes" if answer.holds else "no"
    rows = [[short(c, known) for c in row] for row in answer.rows]
    number = f"{len(rows)} row{'' if len(rows) == 1 else 's'}"
    return f"{table(answer.variables, rows)}\n{number}" if rows else "nothing"


def _csv(answer: Answer) -> str:
    """In the SPARQL 1.1 Query Results CSV Format."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    if answer.holds is not None:
        writer.writerow(["true" if answer.holds else "false"])
        return out.getvalue()
    writer.writerow(answer.variables)
    writer.writerows([["" if c is None else c.value for c in row] for row in answer.rows])
    return out.getvalue()
