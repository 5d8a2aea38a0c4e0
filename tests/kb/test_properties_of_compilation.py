"""Random process graphs compile to Golog that is executed as their trees say; names and files do not matter."""

from __future__ import annotations

import itertools
import re
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kb import validation
from kb.compiler import Compiler
from kb.files import read_files
from kb.ontology import Ontology, close
from kb.problems import errors
from kb.processes import read_processes
from kb.prolog import Entry
from kb.terms import Struct, Term, render, struct
from tests.kb import process_graphs as graphs
from tests.kb.expected_executions import TooMany, apart, executions, in_order, misordered, overlapping
from tests.kb.process_graphs import Graph, Program

REVISION = -77
NODES = 300
MOST_REPORTS = 60
ROBOTS = 2

_load_facts = Entry(search_path="kb_rules", file="facts", name="load_facts")
_drop_facts = Entry(search_path="kb_rules", file="facts", name="drop_facts")
_open_session = Entry(search_path="planner_golog", file="steps", name="open_session")
_close_session = Entry(search_path="planner_golog", file="steps", name="close_session")
_next_actions = Entry(search_path="planner_golog", file="steps", name="next_actions")
_report = Entry(search_path="planner_golog", file="steps", name="report")
_look_ahead = Entry(search_path="planner_golog", file="planning", name="look_ahead")
_search_plan = Entry(search_path="planner_golog", file="planning", name="search_plan")


def random_test(examples: int) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """So many random programs, the same ones every time."""
    return settings(
        max_examples=examples,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )


@contextmanager
def written(graph: Graph, **how: Any) -> Iterator[Ontology]:
    """The ontology of a graph, from files that are gone afterwards."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = read_files(graphs.write(graph, folder, **how), folder)
        yield close(files, graphs.told(files))


def compiled(ontology: Ontology) -> tuple[list[Term], Compiler]:
    """The facts of an ontology, and its compiler."""
    compiler = Compiler(ontology, read_processes(ontology))
    return compiler.facts(REVISION), compiler


def texts(graph: Graph, **how: Any) -> str:
    """All that the compiler makes of a graph, as text."""
    with written(graph, **how) as ontology:
        facts, compiler = compiled(ontology)
        return "\n".join([*map(render, facts), compiler.program("Main").text])


# ------------------------------------------------------------------------------------- what is executed


class Walk:
    """Executes Main step by step: each action succeeds at once, each Look sees something.

    Attributes:
        processes: How often each was done.
        starts: When each action has started, by id; of those that are done again, the last time.
        ends: When each has ended.
        done: Nothing remains of the program.
        first: The status of the first plan, when nothing has been chosen yet.
        planned: That of the last one.
    """

    def __init__(self, key: str) -> None:
        self.processes = Counter[str]()
        self.starts: dict[str, int] = {}
        self.ends: dict[str, int] = {}
        self.done = False
        self._key = key
        self._running: list[Sequence[Any]] = []
        self._events = itertools.count()
        self._now = 0
        self.first = self.planned = self._plan()
        self._take(_next_actions(struct("next", key, self._now)))
        while self._running and self.processes.total() < MOST_REPORTS:
            self._finish(self._running.pop(0))

    def _plan(self) -> str:
        _look_ahead(struct("ahead", self._key, self._now, struct("tables", [], [], [])))
        return str(_search_plan(struct("search", self._key, NODES, -1))["status"])

    def _finish(self, row: Sequence[Any]) -> None:
        self._now += 1000
        action_id, _, process, *values = row
        self.ends[action_id] = next(self._events)
        seen: list[Term] = []
        if process == "Look":
            [place] = values[-1]
            frame, _, name = place.rpartition("/")
            seen = [struct("-", struct("loc", frame, name), True)]
        self._take(_report(struct("done", self._key, self._now, action_id, seen)))

    def _take(self, answer: dict[str, Any]) -> None:
        for kind, *row in answer["events"]:
            if kind == "started":
                action_id, robots, process, *_ = row
                busy = {r for _, others, *_ in self._running for r in others}
                assert not busy & set(robots), f"{robots} of {process} are busy"
                self._running.append(row)
                self.processes[process] += 1
                self.starts[action_id] = next(self._events)
        self.done = answer["done"]
        if answer["replan"]:
            self.planned = self._plan()
            self._take(_next_actions(struct("next", self._key, self._now)))


def walked(ontology: Ontology) -> Walk:
    """Compile, and execute Main.

    Raises:
        PrologError: A program is malformed, or its execution went wrong.
    """
    facts, _ = compiled(ontology)
    _load_facts(facts)
    try:
        _open_session(struct("request", "random", REVISION, Struct("Main", graphs.ARGUMENTS), ROBOTS, 0))
        return Walk("random")
    finally:
        _close_session("random")
        _drop_facts(REVISION)


@pytest.mark.parametrize("construct", graphs.PROGRAMS_WITH)
def test_random_processes_are_executed_as_their_trees_say(construct: str) -> None:
    """Well-formed and done as often, and in such order, as the tree allows; not done where it allows nothing."""

    @random_test(8)
    @given(graphs.PROGRAMS_WITH[construct])
    def executed(program: Program) -> None:
        graph = graphs.graph_of(program)
        with written(graph) as ontology:
            walk = walked(ontology)
        try:
            expected = executions(program)
        except TooMany:
            return
        if walk.done:
            assert tuple(sorted(walk.processes.items())) in expected
        assert walk.done or not walk.planned.startswith("solved")
        assert not (expected and walk.first == "unsolvable_proven")
        assert misordered(walk.starts, walk.ends, in_order(graph)) == []
        assert overlapping(walk.starts, walk.ends, apart(graph)) == []

    executed()


@random_test(8)
@given(graphs.programs)
def test_random_processes_pass_the_checks(program: Program) -> None:
    """They are whole, so that no check has anything against them but what lies in their being made up."""
    with written(graphs.graph_of(program)) as ontology:
        found = errors(validation.check(ontology.files))
    assert {p.code for p in found} <= {"KB101"}, found  # nobody executes them: they have no groundings


# ---------------------------------------------------------------------------------- names and places


def tokens(graph: Graph, order: Sequence[int]) -> tuple[dict[str, str], Callable[[str], str]]:
    """New names, in this order instead of that of the old ones, and a function from text with them to the old ones.

    Processes keep what tells them from data: a capital letter or not changes how a name is quoted.
    """
    old = sorted(graph.rows)
    new = {name: f"x{place:04}x" for name, place in zip(old, order, strict=True)}
    back = {token: name for name, token in new.items()}
    return new, lambda text: re.sub(r"x\d{4}x", lambda m: back[m.group()], text)


def mapped(term: Term, names: Callable[[str], str]) -> Term:
    """A term with other names."""
    match term:
        case str():
            return names(term)
        case Struct(functor, arguments):
            return Struct(names(functor), tuple(mapped(a, names) for a in arguments))
        case list():
            return [mapped(part, names) for part in term]
        case _:
            return term


def unordered(term: Term) -> Term:
    """A term with the parts in order of text that stand in no order of their own, but in that of their names."""
    match term:
        case Struct("conc" | "choice" | "any_order" | "all" | "any" as functor, (*rest, list(parts))):
            ordered: list[Term] = sorted(map(unordered, parts), key=render)
            return Struct(functor, (*map(unordered, rest), ordered))
        case Struct("foreach" | "interrupt" as functor, (frame, step, list(variables), *rest)):
            return Struct(functor, (frame, step, sorted(variables, key=render), *map(unordered, rest)))
        case Struct(functor, arguments):
            return Struct(functor, tuple(map(unordered, arguments)))
        case list():
            return [unordered(part) for part in term]
        case _:
            return term


def facts_of(graph: Graph, **how: Any) -> list[Term]:
    """The facts of a graph."""
    with written(graph, **how) as ontology:
        return compiled(ontology)[0]


@random_test(8)
@given(graphs.programs)
def test_names_in_the_same_order_change_nothing_but_names(program: Program) -> None:
    """Also the order of branches, steps and arguments stays; only facts are sorted anew."""
    graph = graphs.graph_of(program)
    new, back = tokens(graph, range(len(graph.rows)))
    renamed = [mapped(fact, back) for fact in facts_of(graph, names=new.__getitem__)]
    assert sorted(map(render, renamed)) == sorted(map(render, facts_of(graph)))


@random_test(8)
@given(graphs.programs, st.randoms(use_true_random=False))
def test_any_other_names_change_nothing_but_names_and_ties(program: Program, random: Any) -> None:
    """What has no order of its own stands in order of names: branches of a choice, and what goes side by side."""
    graph = graphs.graph_of(program)
    order = list(range(len(graph.rows)))
    random.shuffle(order)
    new, back = tokens(graph, order)
    renamed = [unordered(mapped(fact, back)) for fact in facts_of(graph, names=new.__getitem__)]
    assert sorted(map(render, renamed)) == sorted(map(render, map(unordered, facts_of(graph))))


@random_test(8)
@given(graphs.programs, st.randoms(use_true_random=False))
def test_the_order_of_files_and_of_what_is_in_them_does_not_matter(program: Program, random: Any) -> None:
    """One file or three, wherever they stand, whatever comes first in them: the same bytes."""
    graph = graphs.graph_of(program)
    individuals = list(graph.rows)
    random.shuffle(individuals)
    places = ["a/z.owl", "m.owl", "z/a.owl"]
    random.shuffle(places)
    files = [(place, individuals[number::3]) for number, place in enumerate(places)]
    assert texts(graph, files=files, backwards=True) == texts(graph)


def test_every_construct_is_drawn() -> None:
    """The random programs have all control constructs and conditions among them that core.owl has."""
    drawn: set[str] = set()

    @random_test(100)
    @given(graphs.programs)
    def collect(program: Program) -> None:
        todo = list(program.composites.values())
        for node in todo:
            drawn.add(node.kind)
            todo += [*node.parts, *([node.condition] if node.condition else [])]

    collect()
    core = graphs.kinds_below("ControlConstruct") | graphs.kinds_below("Condition")
    assert core - drawn <= {"RuleCondition"}  # rules have tests of their own
