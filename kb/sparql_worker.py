"""Answers SPARQL queries over graphs that it is given once; each query in a process that may be ended at any time.

Run by kb/sparql.py, by its path. It names no other module of ours, so that it starts fast. It reads the graphs, then
one query a line, and forks for each: the copy has the graphs at once, limits of its own, and its end ends nothing else.
A copy can open or connect to nothing, so that a query that asks another server (SERVICE) gets nowhere.

Standard input: a line of JSON `{"most_bytes", "prefixes", "graphs": [[IRI, bytes], ...]}`; those graphs in N-Triples;
then queries, `{"query", "time_limit_s", "most_rows"}` on a line each. Standard output, once for the graphs and once for
each query: `{"ended", "bytes"}` on a line, the exit status of the copy (below 0, the signal that ended it) and how much
it wrote; then that: an answer in JSON, or what went wrong.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import sys
from itertools import islice
from typing import Any, NoReturn

import pyoxigraph as ox


def main() -> None:
    """Answer until there are no more queries."""
    source = sys.stdin.buffer
    begin = json.loads(source.readline())
    resource.setrlimit(resource.RLIMIT_AS, (begin["most_bytes"], begin["most_bytes"]))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    store = ox.Store()
    for graph, size in begin["graphs"]:
        where = ox.NamedNode(graph) if graph else ox.DefaultGraph()
        store.bulk_load(input=source.read(size), format=ox.RdfFormat.N_TRIPLES, to_graph=where)
    _tell(0, b"")
    for line in source:
        out, into = os.pipe()
        copy = os.fork()
        if copy == 0:
            _answer_and_end(store, json.loads(line), begin["prefixes"], into)
        os.close(into)
        with os.fdopen(out, "rb") as pipe:
            written = pipe.read()
        ended = os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1])
        _tell(ended, written)


def _tell(ended: int, written: bytes) -> None:
    sys.stdout.buffer.write(json.dumps({"ended": ended, "bytes": len(written)}).encode() + b"\n" + written)
    sys.stdout.buffer.flush()


def _answer_and_end(store: ox.Store, asked: dict[str, Any], prefixes: dict[str, str], into: int) -> NoReturn:
    for stream in (sys.stdout, sys.stderr):
        os.dup2(into, stream.fileno())
    open_files = 3  # standard input, output and error
    os.closerange(open_files, into + 1)
    resource.setrlimit(resource.RLIMIT_NOFILE, (open_files, open_files))
    signal.setitimer(signal.ITIMER_REAL, asked["time_limit_s"])  # ends the process, whatever it is doing
    json.dump(_answer(store, asked, prefixes), sys.stdout)
    sys.stdout.flush()
    os._exit(0)  # without taking down the graphs, which takes a while


def _answer(store: ox.Store, asked: dict[str, Any], prefixes: dict[str, str]) -> dict[str, Any]:
    try:
        found = store.query(asked["query"], prefixes=prefixes)
        if isinstance(found, ox.QueryBoolean):
            return {"variables": [], "rows": [], "holds": bool(found), "complete": True}
        if isinstance(found, ox.QueryTriples):
            variables = ["subject", "predicate", "object"]
            rows = ([_term(t) for t in (f.subject, f.predicate, f.object)] for f in found)
        else:
            variables = [v.value for v in found.variables]
            rows = ([_term(solution[v]) for v in variables] for solution in found)
        taken = list(islice(rows, asked["most_rows"] + 1))
    except SyntaxError as error:
        return {"syntax_error": str(error)}
    except (OSError, RuntimeError, ValueError) as error:
        return {"error": str(error)}
    most = asked["most_rows"]
    return {"variables": variables, "rows": taken[:most], "holds": None, "complete": len(taken) <= most}


def _term(term: Any) -> dict[str, str] | None:
    """As in the SPARQL 1.1 Query Results JSON Format."""
    match term:
        case None:
            return None
        case ox.NamedNode():
            return {"type": "uri", "value": term.value}
        case ox.BlankNode():
            return {"type": "bnode", "value": term.value}
        case ox.Literal():
            told = {"type": "literal", "value": term.value}
            if term.language:
                told["xml:lang"] = term.language
            elif term.datatype.value != "http://www.w3.org/2001/XMLSchema#string":
                told["datatype"] = term.datatype.value
            return told
        case _:
            return {"type": "triple", "value": str(term)}


if __name__ == "__main__":
    main()
