"""Processes as trees of steps: what is read of files, beyond what charts of shipped processes show (test_chart.py)."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

from kb.files import read_files
from kb.ontology import close
from kb.outline import outline, outline_text
from kb.processes import read_processes
from kb.store import KnowledgeBase, Snapshot
from tests.kb import process_graphs as graphs
from tests.kb.process_graphs import Node, Program

_BEEP, _COUNT = Node("Perform", value="Beep"), Node("Perform", value="Count")
_PROGRAM = Program(
    recipes=(_BEEP, _COUNT), again=(_BEEP, _COUNT), skilled=frozenset(), whole=Node("Perform", value="Part")
)


def made(shipped: KnowledgeBase, *, retired: str = "") -> Snapshot:
    """What is known of the random processes, one of them retired."""
    graph = graphs.graph_of(_PROGRAM)
    if retired:
        graph.rows[retired].append(("core:retired", True))
    with tempfile.TemporaryDirectory() as name:
        files = read_files(graphs.write(graph, Path(name)), Path(name))
        ontology = close(files, graphs.told(files))
    return replace(shipped.snapshot(), ontology=ontology, processes=read_processes(ontology), groundings={})


def test_a_retired_recipe_is_not_shown(shipped: KnowledgeBase) -> None:
    """A task type is the choice that the planner has."""
    assert "Part_a" in outline_text(outline(made(shipped), "Part"))
    text = outline_text(outline(made(shipped, retired="Part_a"), "Part"))
    assert "Part_a" not in text
    assert "Part_b" in text


def test_what_performs_itself_is_expanded_once(shipped: KnowledgeBase) -> None:
    """And a constant is told where it is given: an individual as well as a value."""
    text = outline_text(outline(made(shipped), "Again", expand=True), data=True)
    assert text.count("Again [composite]") == 1
    assert "Check (token ← token_2)" in text
    assert "Spend (robot, token ← local" in text
