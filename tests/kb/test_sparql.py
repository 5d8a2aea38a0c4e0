"""SPARQL over what is known: right answers, and nothing that changes, leaves the machine or never ends."""

import json
import socket
from collections.abc import Iterator

import pytest
from rdflib import BNode, Graph

from kb.dataset import dataset
from kb.sparql import BadQuery, ask, prefixes, results_json, short
from kb.sparql import _run as run_worker
from kb.store import KnowledgeBase, Snapshot


@pytest.fixture
def knowledge() -> Iterator[KnowledgeBase]:
    """A knowledge base of the shipped site that a test may tell things."""
    knowledge = KnowledgeBase("tue_lab")
    yield knowledge
    knowledge.close()


@pytest.fixture
def snapshot(shipped: KnowledgeBase) -> Snapshot:
    """What is known at first."""
    return shipped.snapshot()


def rows(snapshot: Snapshot, query: str) -> list[tuple[str, ...]]:
    """What a query finds, with prefixes."""
    known = prefixes(snapshot)
    return [tuple(short(c, known) for c in row) for row in ask(snapshot, query).rows]


def test_what_is_stated_and_what_follows_is_found(snapshot: Snapshot) -> None:
    """Values of individuals, of their classes, transitive ones, inferred classes."""
    assert rows(snapshot, "SELECT ?r ?at { ?r a core:Robot ; core:locatedAt ?at }") == [
        ("tue_lab:amigo_1", "tue_lab:start_west"),
        ("tue_lab:pico_1", "tue_lab:start_east"),
    ]
    assert rows(snapshot, "SELECT ?r { tue_lab:pico_1 core:radius_m ?r }") == [("0.3",)]
    assert rows(snapshot, "SELECT ?a { tue_lab:at_bar core:inArea ?a }") == [("tue_lab:kitchen",), ("tue_lab:tue_lab",)]
    assert ("tue_lab:pico_1",) in rows(snapshot, "SELECT ?r { ?r a core:RobotWithKinect }")


def test_every_stated_value_is_there_once(snapshot: Snapshot) -> None:
    """Closing adds nothing that a file has stated already, with another datatype or not."""
    twice = "SELECT ?s ?p { ?s ?p ?a, ?b FILTER(isLiteral(?a) && isLiteral(?b) && str(?a) < str(?b) && ?a = ?b) }"
    assert rows(snapshot, twice) == []


def test_graphs_tell_where_from(knowledge: KnowledgeBase) -> None:
    """Files by their IRI, what is inferred, and what was told; the default graph has what is so now."""
    knowledge.tell("locatedAt", "pico_1", "at_bar")
    snapshot = knowledge.snapshot()
    assert rows(snapshot, "SELECT ?at { tue_lab:pico_1 core:locatedAt ?at }") == [("tue_lab:at_bar",)]
    assert rows(snapshot, "SELECT ?g ?at { GRAPH ?g { tue_lab:pico_1 core:locatedAt ?at } }") == [
        ("graph:told", "tue_lab:at_bar"),
        ("<http://example.org/concertmaster/tue_lab.owl>", "tue_lab:start_east"),
    ]
    inferred = rows(snapshot, "SELECT ?a { GRAPH graph:inferred { tue_lab:at_bar core:inArea ?a } }")
    assert inferred == [("tue_lab:tue_lab",)]


def test_ask_construct_and_describe_are_answered(snapshot: Snapshot) -> None:
    """Yes or no; triples."""
    assert ask(snapshot, "ASK { tue_lab:drink_1 core:isEmpty true }").holds is True
    assert ask(snapshot, "ASK { tue_lab:drink_1 core:isEmpty false }").holds is False
    found = ask(snapshot, "CONSTRUCT { ?r a core:Thing } WHERE { ?r a core:Robot }")
    assert found.variables == ("subject", "predicate", "object")
    assert len(found.rows) == 2
    assert ask(snapshot, "DESCRIBE tue_lab:drink_1").rows


def test_rows_are_in_order(snapshot: Snapshot) -> None:
    """In the one that was asked for, else sorted."""
    robots = "SELECT ?r { ?r a core:Robot }"
    assert rows(snapshot, f"{robots} ORDER BY DESC(?r)") == list(reversed(rows(snapshot, robots)))


def test_numbers_and_languages_keep_their_type(snapshot: Snapshot) -> None:
    """In the results format of the W3C."""
    query = "SELECT ?r ?l ?n { tue_lab:pico_1 core:radius_m ?r ; rdfs:label ?l OPTIONAL { tue_lab:pico_1 core:x ?n } }"
    [binding] = json.loads(json.dumps(results_json(ask(snapshot, query))))["results"]["bindings"]
    assert binding["r"]["datatype"] == "http://www.w3.org/2001/XMLSchema#double"
    assert binding["l"] == {"type": "literal", "value": "Pico 1", "xml:lang": "en"}
    assert "n" not in binding


@pytest.mark.parametrize(
    ("query", "told"),
    [
        ("SELECT ?x {\n  ?x a core:Robot", "line 2, column 18"),
        (
            "SELECT ?x { ?x a cor:Robot }",
            "column 18 of the query:\n  SELECT ?x { ?x a cor:Robot }\n  " + " " * 17 + "^",
        ),
        ("SELECT ?x { ?x a cor:Robot }", "the prefix cor: is not known; did you mean core:?"),
        ("", "line 1, column 1"),
        ("INSERT DATA { core:a core:b core:c }", "line 1, column 1: INSERT would change what is known"),
        ("PREFIX x: <http://x#>\n# SELECT\nDELETE WHERE { ?s ?p ?o }", "line 3, column 1: DELETE would change"),
        ("LOAD <file:///etc/passwd>", "LOAD would change"),
        ("SELECT * { SERVICE <http://127.0.0.1/> { ?s ?p ?o } }", "column 12: SERVICE asks another server"),
        ("SELECT * { service silent ?x { ?s ?p ?o } }", "SERVICE asks another server"),
    ],
)
def test_what_is_not_answered_says_where_and_why(snapshot: Snapshot, query: str, told: str) -> None:
    """Syntax errors, unknown prefixes, updates, other servers."""
    with pytest.raises(BadQuery) as refused:
        ask(snapshot, query)
    assert told in str(refused.value)
    assert refused.value.fault == "request"


@pytest.mark.parametrize(
    "harmless",
    ['"SERVICE <http://a>"', "'''INSERT'''", "<http://service#INSERT>", "?service", "core:SERVICE", "1 # SERVICE\n"],
)
def test_words_in_texts_and_names_are_no_commands(snapshot: Snapshot, harmless: str) -> None:
    """A query may speak of services."""
    assert ask(snapshot, f"SELECT * {{ ?service ?p {harmless} }}").complete


def test_the_worker_cannot_reach_a_server(snapshot: Snapshot) -> None:
    """Even a query that comes to it unseen opens no connection."""
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        server.setblocking(False)
        query = f"SELECT * {{ SERVICE <http://127.0.0.1:{server.getsockname()[1]}/> {{ ?s ?p ?o }} }}"
        asked = {"query": query, "prefixes": {}, "graphs": {}, "most_rows": 1, "most_bytes": 2**32}
        told = run_worker(asked, 10.0)
        assert "error" in told
        with pytest.raises(BlockingIOError):
            server.accept()


def test_a_query_that_takes_too_long_is_given_up(snapshot: Snapshot) -> None:
    """All combinations of five triples."""
    product = " . ".join(f"?a{n} ?b{n} ?c{n}" for n in range(5))
    with pytest.raises(BadQuery, match=r"no answer within 0\.5 s"):
        ask(snapshot, f"SELECT (COUNT(*) AS ?n) {{ {product} }}", time_limit_s=0.5)


def test_a_query_that_needs_too_much_memory_is_given_up(snapshot: Snapshot) -> None:
    """It ends the worker, not us."""
    asked = {"query": "SELECT * { ?s ?p ?o }", "prefixes": {}, "graphs": dataset(snapshot), "most_rows": 10**9}
    with pytest.raises(BadQuery, match="memory"):
        run_worker({**asked, "most_bytes": 2**20}, 10.0)


def test_limits_that_are_none_are_refused(snapshot: Snapshot) -> None:
    """No time, less than no rows, and what is no number."""
    for time_limit_s in (0.0, -1.0, float("nan")):
        with pytest.raises(BadQuery):
            ask(snapshot, "ASK { ?s ?p ?o }", time_limit_s=time_limit_s)
    with pytest.raises(BadQuery):
        ask(snapshot, "ASK { ?s ?p ?o }", most_rows=-1)


def test_too_many_rows_are_cut_and_said(snapshot: Snapshot) -> None:
    """So many as were asked for, and that there are more."""
    answer = ask(snapshot, "SELECT * { ?s ?p ?o }", most_rows=10)
    assert (len(answer.rows), answer.complete) == (10, False)


def test_the_graphs_read_back_as_what_was_loaded(snapshot: Snapshot) -> None:
    """Each file's graph holds its triples, whatever its texts hold; rdflib reads them."""
    for file in snapshot.ontology.files.files:
        read = Graph().parse(data=dataset(snapshot)[file.iri], format="nt")
        assert len(read) == len(file.graph)
        assert {t for t in read if not any(isinstance(n, BNode) for n in t)} == {
            t for t in file.graph if not any(isinstance(n, BNode) for n in t)
        }


def test_every_file_has_a_prefix(snapshot: Snapshot) -> None:
    """By its name, and the core's is `core`."""
    known = prefixes(snapshot)
    assert known["core"] == "http://example.org/concertmaster/core.owl#"
    assert {f.iri + "#" for f in snapshot.ontology.files.files} <= set(known.values())
