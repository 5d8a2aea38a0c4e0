"""SPARQL 1.1 queries over what is known: read only, with limits.

The default graph is all that is known now: what files state, what follows from it, and the present value of what
changes. Named graphs tell where from: one for each file, by its ontology IRI, with what it states;
`graph:inferred`; `graph:told`, what has been told since the files were read. A query runs in a process of its own
(kb/sparql_worker.py), which is ended when it takes too long, and which cannot reach the network.
"""

from __future__ import annotations

import difflib
import json
import re
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rdflib import RDF, RDFS

from kb.dataset import GRAPHS, dataset
from kb.errors import ConcertmasterError, InternalError
from kb.store import Snapshot

TIME_LIMIT_S = 10.0
MOST_ROWS = 100_000

_MOST_BYTES = 4 * 2**30
_WORKER = Path(__file__).with_name("sparql_worker.py")
_TOKEN = re.compile(
    r"'''.*?'''|\"\"\".*?\"\"\"|'(?:[^'\\\n]|\\.)*'|\"(?:[^\"\\\n]|\\.)*\"|<[^<>\"{}|^`\\\s]*>|#[^\n]*"
    r"|[?$]\w+|[\w-]*:[\w.%-]*|(?P<word>\w+)|.",
    re.DOTALL,
)
_UPDATES = frozenset({"INSERT", "DELETE", "LOAD", "CLEAR", "CREATE", "DROP", "COPY", "MOVE", "ADD", "WITH"})
_PREFIX_WORDS = frozenset({"PREFIX", "BASE"})
_POSITION = re.compile(r"error at (\d+):(\d+): (.*)", re.DOTALL)
_OFFERED = re.compile(r"\"(?:\\.|[^\"\\])*\"|'(?:\\.|[^'\\])*'|[A-Za-z]+")
_STANDARD = {
    "owl": "http://www.w3.org/2002/07/owl#",
    "rdf": str(RDF),
    "rdfs": str(RDFS),
    "skos": "http://www.w3.org/2004/02/skos/core#",
    "xsd": "http://www.w3.org/2001/XMLSchema#",
    "graph": GRAPHS,
}


class BadQuery(ConcertmasterError):
    """A query cannot be answered: it is wrong, would change something, or takes too much."""

    fault = "request"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """A value in an answer, in the words of the SPARQL 1.1 Query Results JSON Format.

    Attributes:
        type: `uri`, `literal`, `bnode` or `triple`.
        datatype: IRI, of a literal that is no plain text; else empty.
        language: Of a text in a language; else empty.
    """

    type: str
    value: str
    datatype: str = ""
    language: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What a query found.

    Attributes:
        variables: The columns; `subject`, `predicate` and `object` for CONSTRUCT and DESCRIBE.
        rows: A cell for each variable, None where it has no value. In the order of the query, where it asks for one;
            else sorted.
        holds: Of an ASK; else None.
        complete: Whether these are all rows that there are.
    """

    variables: tuple[str, ...]
    rows: tuple[tuple[Cell | None, ...], ...]
    holds: bool | None
    complete: bool


def prefixes(snapshot: Snapshot) -> dict[str, str]:
    """The prefixes that a query need not declare: `core`, one for each file by its name, and the usual ones."""
    found = dict(_STANDARD)
    for file in snapshot.ontology.files.files:
        stem = re.sub(r"\W", "_", file.path.stem, flags=re.ASCII)
        name = stem if stem[:1].isalpha() else f"f_{stem}"
        number = 1
        while name in found:
            number += 1
            name = f"{stem}_{number}"
        found[name] = file.iri + "#"
    return found


def ask(snapshot: Snapshot, query: str, *, time_limit_s: float = TIME_LIMIT_S, most_rows: int = MOST_ROWS) -> Answer:
    """Answer a query: SELECT, ASK, CONSTRUCT or DESCRIBE.

    Args:
        time_limit_s: After so long, it is given up; above 0. The reading of data does not count.
        most_rows: So many rows are given at most.

    Raises:
        BadQuery: A syntax error, with its place; an update; SERVICE; too slow, or it needs too much memory.
    """
    if not time_limit_s > 0:
        raise BadQuery(f"a time limit of {time_limit_s:g} s leaves no time; give more than 0")
    if most_rows < 0:
        raise BadQuery(f"{most_rows} rows cannot be given; ask for 0 or more")
    _refuse(query)
    known = prefixes(snapshot)
    told = _run(
        {
            "query": query,
            "prefixes": known,
            "graphs": dataset(snapshot),
            "most_rows": most_rows,
            "most_bytes": _MOST_BYTES,
        },
        time_limit_s,
    )
    if "syntax_error" in told:
        raise BadQuery(_syntax_error(told["syntax_error"], query, known))
    if "error" in told:
        raise BadQuery(f"the query cannot be answered: {told['error']}")
    rows = [tuple(None if c is None else _cell(c) for c in row) for row in told["rows"]]
    if not any(word.upper() == "ORDER" for word, _ in _words(query)):
        rows.sort(key=lambda row: [("", "") if c is None else (c.value, c.type) for c in row])
    return Answer(variables=tuple(told["variables"]), rows=tuple(rows), holds=told["holds"], complete=told["complete"])


# ------------------------------------------------------------------------------------------ answers


def short(cell: Cell | None, known: Mapping[str, str]) -> str:
    """A value for people: `tue_lab:pico_1`, `0.35`, text; empty where there is none.

    Args:
        known: Namespaces by prefix.
    """
    if cell is None:
        return ""
    if cell.type == "uri":
        for prefix, namespace in known.items():
            if cell.value.startswith(namespace):
                return f"{prefix}:{cell.value.removeprefix(namespace)}"
        return f"<{cell.value}>"
    return f"_:{cell.value}" if cell.type == "bnode" else cell.value


def results_json(answer: Answer) -> dict[str, object]:
    """An answer in the SPARQL 1.1 Query Results JSON Format (W3C, 2013); `complete` is our own."""
    if answer.holds is not None:
        return {"head": {}, "boolean": answer.holds}
    bindings = [
        {v: _standard(c) for v, c in zip(answer.variables, row, strict=True) if c is not None} for row in answer.rows
    ]
    return {"head": {"vars": list(answer.variables)}, "results": {"bindings": bindings}, "complete": answer.complete}


def _standard(cell: Cell) -> dict[str, str]:
    told = {"type": cell.type, "value": cell.value}
    if cell.datatype:
        told["datatype"] = cell.datatype
    if cell.language:
        told["xml:lang"] = cell.language
    return told


def _cell(told: Mapping[str, str]) -> Cell:
    return Cell(
        type=told["type"],
        value=told["value"],
        datatype=told.get("datatype", ""),
        language=told.get("xml:lang", ""),
    )


# -------------------------------------------------------------------------------------------- refusal


def _refuse(query: str) -> None:
    """Tell of what would not be answered anyway, in plain words."""
    begun = True
    for word, offset in _words(query):
        if begun and word.upper() not in _PREFIX_WORDS:
            begun = False
            if word.upper() in _UPDATES:
                raise BadQuery(
                    f"{_position(query, offset)}: {word.upper()} would change what is known; only SELECT, ASK, "
                    "CONSTRUCT and DESCRIBE are answered. Edit the files instead"
                )
        if word.upper() == "SERVICE":
            raise BadQuery(
                f"{_position(query, offset)}: SERVICE asks another server; nothing is fetched from the network"
            )


def _words(query: str) -> Iterator[tuple[str, int]]:
    """The keywords of a query and where they are: no texts, IRIs, comments, variables or names with a prefix."""
    for token in _TOKEN.finditer(query):
        if token["word"]:
            yield token["word"], token.start()


def _position(query: str, offset: int) -> str:
    before = query[:offset]
    return f"line {before.count(chr(10)) + 1}, column {offset - before.rfind(chr(10))}"


def _syntax_error(message: str, query: str, known: Mapping[str, str]) -> str:
    found = _POSITION.match(message)
    if found is None:
        return f"the query is wrong: {message}"
    line, column, expected = int(found[1]), int(found[2]), found[3]
    text = (query.splitlines() or [""])[min(line, len(query.splitlines()) or 1) - 1]
    unknown = _unknown_prefix(text[:column], known) if "Prefix not found" in expected else None
    if unknown is not None:
        column = unknown[1] + 1
    shown = f"line {line}, column {column} of the query:\n  {text}\n  {' ' * (column - 1)}^\n"
    if unknown is not None:
        near = difflib.get_close_matches(unknown[0], known, n=1)
        hint = f"did you mean {near[0]}:?" if near else f"known are {', '.join(f'{k}:' for k in known)}"
        return f"{shown}the prefix {unknown[0]}: is not known; {hint}"
    offered = sorted({o.strip("\"'") or o for o in _OFFERED.findall(re.sub(r"\[[^\]]*\]", "", expected))})
    words = [o for o in offered if o not in ("expected", "one", "of") and "\\" not in o]
    return shown + (f"expected {' or '.join(words)}" if words else "the query ends too early, or goes on too long")


def _unknown_prefix(text: str, known: Mapping[str, str]) -> tuple[str, int] | None:
    """The last prefix of a line that is not known, and where it is."""
    found = [(m[1], m.start()) for m in re.finditer(r"([A-Za-z_][\w-]*):", text) if m[1] not in known]
    return found[-1] if found else None


# ------------------------------------------------------------------------------------------- process


def _run(asked: Mapping[str, object], time_limit_s: float) -> dict[str, Any]:
    done = subprocess.run(
        [sys.executable, "-I", str(_WORKER)],
        input=json.dumps({**asked, "time_limit_s": time_limit_s}),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode == -signal.SIGALRM:
        raise BadQuery(
            f"there was no answer within {time_limit_s:g} s; join the parts of the query by variables, or ask for less"
        )
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
        if done.returncode == -signal.SIGABRT or "memory" in last.lower():  # what Rust and Python do without memory
            raise BadQuery(f"the query was given up: it needs more than {_MOST_BYTES >> 30} GB of memory ({last})")
        raise InternalError(f"kb/sparql_worker.py ended with status {done.returncode}: {last}")
    found: dict[str, Any] = json.loads(done.stdout)
    return found
