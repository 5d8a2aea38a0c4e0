"""SPARQL 1.1 queries over what is known: read only, with limits.

The default graph is all that is known now: what files state, what follows from it, and the present value of what
changes. Named graphs tell where from: one for each file, by its ontology IRI, with what it states;
`graph:inferred`; `graph:told`, what has been told since the files were read. A query runs in a process of its own
(kb/sparql_worker.py), which is ended when it takes too long, and which cannot reach the network.

with Endpoint(ontology, fluents) as endpoint:
    endpoint.ask("SELECT ?robot { ?robot a core:Robot }")
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import weakref
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Self

from rdflib import RDF, RDFS

from kb.dataset import GRAPHS, dataset
from kb.errors import ConcertmasterError, InternalError
from kb.ontology import Ontology, Value
from kb.sparql_text import BadQuery, doubts, in_order, refuse, syntax_error, words

__all__ = ["MOST_BYTES", "MOST_ROWS", "TIME_LIMIT_S", "Answer", "BadQuery", "Cell", "Endpoint", "results_json", "short"]

TIME_LIMIT_S = 10.0
MOST_ROWS = 100_000
MOST_BYTES = 4 * 2**30

_LONGEST_S = 86_400.0
_WORKER = Path(__file__).with_name("sparql_worker.py")
_STANDARD = {
    "owl": "http://www.w3.org/2002/07/owl#",
    "rdf": str(RDF),
    "rdfs": str(RDFS),
    "skos": "http://www.w3.org/2004/02/skos/core#",
    "xsd": "http://www.w3.org/2001/XMLSchema#",
    "graph": GRAPHS,
}


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
        doubts: What is probably misspelt in the query, a sentence each.
    """

    variables: tuple[str, ...]
    rows: tuple[tuple[Cell | None, ...], ...]
    holds: bool | None
    complete: bool
    doubts: tuple[str, ...] = ()


def _prefixes(ontology: Ontology) -> dict[str, str]:
    """The prefixes that a query need not declare: `core`, one for each file by its name, and the usual ones."""
    found = dict(_STANDARD)
    for file in ontology.files.files:
        stem = re.sub(r"\W", "_", file.path.stem, flags=re.ASCII)
        name = first = stem if stem[:1].isalpha() else f"f_{stem}"
        number = 1
        while name in found:
            number += 1
            name = f"{first}_{number}"
        found[name] = file.iri + "#"
    return found


class Endpoint:
    """Answers queries over what was known at one moment; threads may share it.

    Attributes:
        prefixes: The namespaces that a query need not declare, by prefix.
        close: Ends the process that answers; so does the end of the endpoint, or of ours.
    """

    def __init__(
        self, ontology: Ontology, fluents: Mapping[tuple[str, str], Value], *, most_bytes: int = MOST_BYTES
    ) -> None:
        """Give all that is known to the process that will answer.

        Args:
            fluents: The present value of what changes, by (property, individual); of all else, files tell.
            most_bytes: So much memory may a query take, what is known included.

        Raises:
            BadQuery: What is known needs too much memory already.
        """
        self._ontology = ontology
        self.prefixes = _prefixes(ontology)
        self._asking = Lock()
        self._process = subprocess.Popen(
            [sys.executable, "-I", str(_WORKER)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,  # its copies can be ended with it
        )
        self.close = weakref.finalize(self, _end, self._process)
        graphs = dataset(ontology, fluents)
        sizes = [(iri, len(text)) for iri, text in graphs.items()]
        self._answer({"most_bytes": most_bytes, "prefixes": self.prefixes, "graphs": sizes}, *graphs.values())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def ask(self, query: str, *, time_limit_s: float = TIME_LIMIT_S, most_rows: int = MOST_ROWS) -> Answer:
        """Answer a query: SELECT, ASK, CONSTRUCT or DESCRIBE.

        Args:
            time_limit_s: After so long, it is given up; above 0, at most a day.
            most_rows: So many rows are given at most.

        Raises:
            BadQuery: A syntax error, with its place; an update; SERVICE; too slow, or it needs too much memory.
        """
        if not 0 < time_limit_s <= _LONGEST_S:
            raise BadQuery(f"a query cannot have {time_limit_s:g} s; give more than 0, and at most {_LONGEST_S:g}")
        if most_rows < 0:
            raise BadQuery(f"{most_rows} rows cannot be given; ask for 0 or more")
        refuse(query)
        told = json.loads(self._answer({"query": query, "time_limit_s": time_limit_s, "most_rows": most_rows}))
        if "syntax_error" in told:
            raise BadQuery(syntax_error(told["syntax_error"], query, self.prefixes))
        if "error" in told:
            raise BadQuery(f"the query cannot be answered: {told['error']}")
        variables: list[str] = told["variables"]
        columns = in_order(variables, query)
        places = [variables.index(name) for name in columns]
        rows = [tuple(None if (cell := row[n]) is None else _cell(cell) for n in places) for row in told["rows"]]
        if not any(word.upper() == "ORDER" for word, _ in words(query)):
            rows.sort(key=lambda row: [("", "") if c is None else (c.value, c.type) for c in row])
        return Answer(
            variables=tuple(columns),
            rows=tuple(rows),
            holds=told["holds"],
            complete=told["complete"],
            doubts=doubts(query, self.prefixes, self._ontology),
        )

    def _answer(self, asked: Mapping[str, object], *graphs: bytes) -> bytes:
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        with self._asking:
            try:
                with contextlib.suppress(BrokenPipeError):  # it has ended; below is told why
                    process.stdin.writelines([json.dumps(asked).encode(), b"\n", *graphs])
                    process.stdin.flush()
                head = process.stdout.readline()
                if head:
                    told = json.loads(head)
                    ended, written = told["ended"], process.stdout.read(told["bytes"])
                else:
                    ended, written = process.wait(), process.stderr.read()
            except BaseException:
                self.close()  # the rest of an answer that nobody waits for must not become that of the next query
                raise
        if ended != 0:
            raise _given_up(ended, written.decode(errors="replace"), asked)
        return written


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process and its copies."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    with contextlib.suppress(BrokenPipeError), process:  # waits, and closes the pipes
        pass


def _given_up(ended: int, written: str, asked: Mapping[str, object]) -> ConcertmasterError:
    """Why there is no answer.

    Args:
        ended: Exit status of the process that should have given it; below 0, the signal that ended it.
        written: By it, at last.
    """
    if ended == -signal.SIGALRM:
        return BadQuery(
            f"there was no answer within {asked['time_limit_s']:g} s; join the parts of the query by variables, "
            "or ask for less"
        )
    if ended == -signal.SIGSEGV:  # the parser's stack
        return BadQuery("the query was given up: its brackets are nested too deeply")
    last = (written.strip().splitlines() or ["no reason given"])[-1]
    if ended == -signal.SIGABRT or "memory" in last.lower():  # what Rust and Python do without memory
        return BadQuery(f"the query was given up: it needs more memory than it may have ({last})")
    return InternalError(f"kb/sparql_worker.py ended with status {ended}: {last}")


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
