"""Answers one SPARQL query in a process of its own, which may be ended at any time.

Run by kb/sparql.py, by its path: reads one JSON object from standard input, writes one to standard output. It names
no other module of ours, so that it starts fast. Nothing can be opened or connected to once the data are read: a
query that asks another server (SERVICE) gets nowhere.
"""

from __future__ import annotations

import json
import resource
import signal
import sys
from itertools import islice
from typing import Any

import pyoxigraph as ox


def main() -> None:
    """Answer."""
    asked = json.load(sys.stdin)
    resource.setrlimit(resource.RLIMIT_AS, (asked["most_bytes"], asked["most_bytes"]))
    store = ox.Store()
    for graph, triples in asked["graphs"].items():
        where = ox.NamedNode(graph) if graph else ox.DefaultGraph()
        store.bulk_load(input=triples.encode(), format=ox.RdfFormat.N_TRIPLES, to_graph=where)
    open_files = 3  # standard input, output and error
    resource.setrlimit(resource.RLIMIT_NOFILE, (open_files, open_files))
    # The alarm ends the process, whatever it is doing; its time does not count the reading of data.
    signal.setitimer(signal.ITIMER_REAL, asked["time_limit_s"])
    json.dump(_answer(store, asked), sys.stdout)


def _answer(store: ox.Store, asked: dict[str, Any]) -> dict[str, Any]:
    try:
        found = store.query(asked["query"], prefixes=asked["prefixes"])
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
