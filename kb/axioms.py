"""What a description-logic reasoner is given: all but the SWRL rules.

Rules ask for what changes while robots work (kb/swrl.py), and HermiT gives up at the first built-in.
"""

from __future__ import annotations

from rdflib import RDF, BNode, Graph, Namespace
from rdflib.term import Node

_SWRL = Namespace("http://www.w3.org/2003/11/swrl#")


def without_rules(graph: Graph) -> Graph:
    """A graph without rules, their atoms and their variables; itself if it has none."""
    dropped: set[Node] = {node for kind in (_SWRL.Imp, _SWRL.Variable) for node in graph.subjects(RDF.type, kind)}
    if not dropped:
        return graph
    todo = list(dropped)
    while todo:
        parts = {o for o in graph.objects(todo.pop()) if isinstance(o, BNode)} - dropped
        dropped |= parts
        todo += parts
    kept = Graph()
    for triple in graph:
        if triple[0] not in dropped and triple[2] != _SWRL.Builtin:
            kept.add(triple)
    return kept
