"""SPARQL over what is known: right answers, and nothing that changes, leaves the machine or never ends."""

import gc
import json
import shutil
import signal
import socket
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from rdflib import BNode, Graph

from kb.dataset import dataset
from kb.files import SHIPPED, read_files
from kb.ontology import close
from kb.reasoner import classify
from kb.sparql import BadQuery, Endpoint, results_json, short
from kb.store import KnowledgeBase, Snapshot


@pytest.fixture
def knowledge() -> Iterator[KnowledgeBase]:
    """A knowledge base of the shipped site that a test may tell things."""
    knowledge = KnowledgeBase("tue_lab")
    yield knowledge
    knowledge.close()


@pytest.fixture(scope="module")
def snapshot(shipped: KnowledgeBase) -> Snapshot:
    """What is known at first."""
    return shipped.snapshot()


@pytest.fixture(scope="module")
def endpoint(snapshot: Snapshot) -> Iterator[Endpoint]:
    """Of what is known at first; one for all queries, as users have it."""
    with Endpoint(snapshot.ontology, snapshot.fluents) as endpoint:
        yield endpoint


def rows(endpoint: Endpoint, query: str) -> list[tuple[str, ...]]:
    """What a query finds, with prefixes."""
    return [tuple(short(c, endpoint.prefixes) for c in row) for row in endpoint.ask(query).rows]


def test_what_is_stated_and_what_follows_is_found(endpoint: Endpoint) -> None:
    """Values of individuals, of their classes, transitive ones, inferred classes."""
    assert rows(endpoint, "SELECT ?r ?at { ?r a core:Robot ; core:locatedAt ?at }") == [
        ("tue_lab:amigo_1", "tue_lab:start_west"),
        ("tue_lab:pico_1", "tue_lab:start_east"),
    ]
    assert rows(endpoint, "SELECT ?r { tue_lab:pico_1 core:radius_m ?r }") == [("0.3",)]
    assert rows(endpoint, "SELECT ?a { tue_lab:at_bar core:inArea ?a }") == [("tue_lab:kitchen",), ("tue_lab:tue_lab",)]
    assert ("tue_lab:pico_1",) in rows(endpoint, "SELECT ?r { ?r a core:RobotWithKinect }")


def test_every_stated_value_is_there_once(tmp_path: Path) -> None:
    """Closing adds nothing that a file has stated already, with another datatype or not."""
    folder = Path(shutil.copytree(SHIPPED, tmp_path / "ontologies"))
    task = folder / "tasks" / "find_empty_drink.owl"
    stated = task.read_text(encoding="utf-8")
    assert '#integer">10<' in stated
    task.write_text(stated.replace('#integer">10<', '#nonNegativeInteger">10<'), encoding="utf-8")
    files = read_files(folder / "sites" / "tue_lab" / "tue_lab.owl", folder)
    with Endpoint(close(files, classify(files)), {}) as endpoint:
        assert rows(endpoint, "SELECT ?n { find_empty_drink:SearchDrink_10_Navigate core:stepNumber ?n }") == [("10",)]
        assert rows(endpoint, "SELECT * { ?s ?p ?a, ?b FILTER(isLiteral(?a) && ?a = ?b && !sameTerm(?a, ?b)) }") == []


def test_graphs_tell_where_from(knowledge: KnowledgeBase) -> None:
    """Files by their IRI, what is inferred, and what was told; the default graph has what is so now."""
    knowledge.tell("locatedAt", "pico_1", "at_bar")
    snapshot = knowledge.snapshot()
    with Endpoint(snapshot.ontology, snapshot.fluents) as endpoint:
        assert rows(endpoint, "SELECT ?at { tue_lab:pico_1 core:locatedAt ?at }") == [("tue_lab:at_bar",)]
        assert rows(endpoint, "SELECT ?g ?at { GRAPH ?g { tue_lab:pico_1 core:locatedAt ?at } }") == [
            ("graph:told", "tue_lab:at_bar"),
            ("<http://example.org/concertmaster/tue_lab.owl>", "tue_lab:start_east"),
        ]
        inferred = rows(endpoint, "SELECT ?a { GRAPH graph:inferred { tue_lab:at_bar core:inArea ?a } }")
        assert inferred == [("tue_lab:tue_lab",)]


def test_ask_construct_and_describe_are_answered(endpoint: Endpoint) -> None:
    """Yes or no; triples."""
    assert endpoint.ask("ASK { tue_lab:drink_1 core:isEmpty true }").holds is True
    assert endpoint.ask("ASK { tue_lab:drink_1 core:isEmpty false }").holds is False
    found = endpoint.ask("CONSTRUCT { ?r a core:Thing } WHERE { ?r a core:Robot }")
    assert found.variables == ("subject", "predicate", "object")
    assert len(found.rows) == 2
    assert endpoint.ask("DESCRIBE tue_lab:drink_1").rows


def test_rows_are_in_order(endpoint: Endpoint) -> None:
    """In the one that was asked for, else sorted."""
    robots = "SELECT ?r { ?r a core:Robot }"
    assert rows(endpoint, f"{robots} ORDER BY DESC(?r)") == list(reversed(rows(endpoint, robots)))


def test_columns_are_in_the_order_of_the_query(endpoint: Endpoint) -> None:
    """Named, or as they come up."""
    assert endpoint.ask("SELECT ?b ?a { ?a core:locatedAt ?b }").variables == ("b", "a")
    for star in ("SELECT *", "select distinct *", "# SELECT ?z\nSELECT REDUCED*"):
        answer = endpoint.ask(f"{star} {{ ?thing core:locatedAt ?place . ?place core:inArea ?area }}")
        assert answer.variables == ("thing", "place", "area")
        assert {short(row[1], endpoint.prefixes) for row in answer.rows} >= {"tue_lab:start_west"}


def test_misspelt_names_are_doubted(endpoint: Endpoint) -> None:
    """Each once, with the nearest; not those of others, and not those that a query makes up."""
    answer = endpoint.ask("ASK { ?r a core:Robott ; core:locatdAt ?p . ?q core:locatdAt tue_lab:at_bar }")
    assert answer.doubts == (
        "no file names core:Robott; did you mean core:Robot?",
        "no file names core:locatdAt; did you mean core:locatedAt?",
    )
    for fine in (
        "ASK { ?r a core:Robot ; rdfs:lable ?l ; <http://a#b> 'core:Robott' } # core:Robott",
        "PREFIX core: <http://example.org/other#> ASK { ?r a core:Robott }",
        "CONSTRUCT { ?r a core:Robott } WHERE { ?r a core:Robot }",
        "SELECT ?core { ?core a core:Robot }",
        "SELECT ?r { ?r a core:Robot. ?r a core:Robot.}",
    ):
        assert endpoint.ask(fine).doubts == ()


def test_numbers_and_languages_keep_their_type(endpoint: Endpoint) -> None:
    """In the results format of the W3C."""
    query = "SELECT ?r ?l ?n { tue_lab:pico_1 core:radius_m ?r ; rdfs:label ?l OPTIONAL { tue_lab:pico_1 core:x ?n } }"
    [binding] = json.loads(json.dumps(results_json(endpoint.ask(query))))["results"]["bindings"]
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
def test_what_is_not_answered_says_where_and_why(endpoint: Endpoint, query: str, told: str) -> None:
    """Syntax errors, unknown prefixes, updates, other servers."""
    with pytest.raises(BadQuery) as refused:
        endpoint.ask(query)
    assert told in str(refused.value)
    assert refused.value.fault == "request"


@pytest.mark.parametrize(
    "harmless",
    ['"SERVICE <http://a>"', "'''INSERT'''", "<http://service#INSERT>", "?service", "core:SERVICE", "1 # SERVICE\n"],
)
def test_words_in_texts_and_names_are_no_commands(endpoint: Endpoint, harmless: str) -> None:
    """A query may speak of services."""
    assert endpoint.ask(f"SELECT * {{ ?service ?p {harmless} }}").complete


def test_a_query_cannot_reach_a_server(endpoint: Endpoint, monkeypatch: pytest.MonkeyPatch) -> None:
    """Even one that comes to the process unseen opens no connection."""
    monkeypatch.setattr("kb.sparql.refuse", lambda query: None)
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        server.setblocking(False)
        with pytest.raises(BadQuery, match="cannot be answered"):
            endpoint.ask(f"SELECT * {{ SERVICE <http://127.0.0.1:{server.getsockname()[1]}/> {{ ?s ?p ?o }} }}")
        with pytest.raises(BlockingIOError):
            server.accept()


def test_a_query_that_takes_too_long_is_given_up(endpoint: Endpoint) -> None:
    """All combinations of five triples; the next query is answered again."""
    product = " . ".join(f"?a{n} ?b{n} ?c{n}" for n in range(5))
    with pytest.raises(BadQuery, match=r"no answer within 0\.5 s"):
        endpoint.ask(f"SELECT (COUNT(*) AS ?n) {{ {product} }}", time_limit_s=0.5)
    assert endpoint.ask("ASK { tue_lab:drink_1 core:isEmpty true }").holds is True


def test_a_query_that_needs_too_much_memory_is_given_up(snapshot: Snapshot) -> None:
    """It ends its own process; the next query is answered again."""
    product = " . ".join(f"?a{n} ?b{n} ?c{n}" for n in range(3))
    with Endpoint(snapshot.ontology, snapshot.fluents, most_bytes=2**28) as endpoint:
        with pytest.raises(BadQuery, match="more memory than it may have"):
            endpoint.ask(f"SELECT * {{ {product} }} ORDER BY ?a0 ?a1 ?a2", time_limit_s=60.0)
        assert endpoint.ask("ASK { tue_lab:drink_1 core:isEmpty true }").holds is True


def test_knowledge_that_needs_too_much_memory_is_refused(snapshot: Snapshot) -> None:
    """Before any query."""
    with pytest.raises(BadQuery, match="memory"):
        Endpoint(snapshot.ontology, snapshot.fluents, most_bytes=2**20)


def test_a_query_that_is_nested_too_deeply_is_given_up(endpoint: Endpoint) -> None:
    """It ends its own process; the next query is answered again."""
    with pytest.raises(BadQuery, match="nested too deeply"):
        endpoint.ask("ASK " + "{" * 100_000 + "}" * 100_000)
    assert endpoint.ask("ASK { tue_lab:drink_1 core:isEmpty true }").holds is True


def test_threads_share_an_endpoint(endpoint: Endpoint) -> None:
    """Each gets the answer to its own query."""

    def number(n: int) -> str:
        [[found]] = rows(endpoint, f"SELECT ({n} AS ?n) {{}}")
        return found

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(number, range(40))) == [str(n) for n in range(40)]


def test_an_answer_that_nobody_waits_for_is_not_that_of_the_next_query(
    snapshot: Snapshot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C while it is waited for ends the process."""
    with Endpoint(snapshot.ontology, snapshot.fluents) as endpoint:

        def interrupted(_: bytes) -> None:
            raise KeyboardInterrupt

        monkeypatch.setattr("kb.sparql.json.loads", interrupted)
        with pytest.raises(KeyboardInterrupt):
            endpoint.ask("ASK {}")
        assert endpoint._process.returncode == -signal.SIGKILL


def test_nothing_is_left_running(snapshot: Snapshot) -> None:
    """The process ends with the endpoint, closed or forgotten, even while it answers."""
    closed = Endpoint(snapshot.ontology, snapshot.fluents)
    closed.close()
    forgotten = Endpoint(snapshot.ontology, snapshot.fluents)
    processes = [closed._process, forgotten._process]
    del forgotten
    gc.collect()
    assert [p.returncode for p in processes] == [-signal.SIGKILL, -signal.SIGKILL]


def test_limits_that_are_none_are_refused(endpoint: Endpoint) -> None:
    """No time, less than no rows, and what is no number."""
    for time_limit_s in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(BadQuery):
            endpoint.ask("ASK { ?s ?p ?o }", time_limit_s=time_limit_s)
    with pytest.raises(BadQuery):
        endpoint.ask("ASK { ?s ?p ?o }", most_rows=-1)


def test_too_many_rows_are_cut_and_said(endpoint: Endpoint) -> None:
    """So many as were asked for, and that there are more."""
    answer = endpoint.ask("SELECT * { ?s ?p ?o }", most_rows=10)
    assert (len(answer.rows), answer.complete) == (10, False)


def test_the_graphs_read_back_as_what_was_loaded(snapshot: Snapshot) -> None:
    """Each file's graph holds its triples, whatever its texts hold; rdflib reads them."""
    graphs = dataset(snapshot.ontology, snapshot.fluents)
    for file in snapshot.ontology.files.files:
        read = Graph().parse(data=graphs[file.iri], format="nt")
        assert len(read) == len(file.graph)
        assert {t for t in read if not any(isinstance(n, BNode) for n in t)} == {
            t for t in file.graph if not any(isinstance(n, BNode) for n in t)
        }


def test_every_file_has_a_prefix(snapshot: Snapshot, endpoint: Endpoint) -> None:
    """By its name, and the core's is `core`."""
    known = endpoint.prefixes
    assert known["core"] == "http://example.org/concertmaster/core.owl#"
    assert {f.iri + "#" for f in snapshot.ontology.files.files} <= set(known.values())
