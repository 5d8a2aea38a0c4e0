"""What the files say of failures, checked: codes that services tell them by, recoveries, what processes expect.

They are annotations, so that a reasoner sees nothing of them; what a recovery itself must state is in shapes.ttl.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from rdflib import RDF, RDFS, Graph, URIRef
from rdflib.term import Node

from kb.files import OntologyFiles, local_name
from kb.problems import Problem
from kb.vocabulary import CORE, Kind, Property

_CODE = re.compile(
    r"(?:concertmaster|(?P<type>[a-z]\w*(?:/(?:msg|srv|action))?/\w+)(?: (?P<number>-?\d+))?) (?P<name>\w+)"
)


def check_failures(files: OntologyFiles, graph: Graph) -> Iterator[Problem]:
    """Failure codes that are none, or that two classes claim; what is named as failure or recovery but is none."""
    yield from _codes(files, graph)
    failures: set[Node] = set(_below(graph, Kind.FAILURE))
    for prop in (Property.EXPECTED_FAILURE, Property.FAILURE_IF_LATE):
        yield from _misnamed(files, graph, prop, failures, "a class below Failure")
    recoveries = {r for kind in _below(graph, Kind.RECOVERY) for r in graph.subjects(RDF.type, kind)}
    yield from _misnamed(files, graph, Property.RECOVERED_BY, recoveries, "an individual that is a Recovery")


def _codes(files: OntologyFiles, graph: Graph) -> Iterator[Problem]:
    claimed: dict[tuple[str, str], Node] = {}
    for failure, told in sorted(graph.subject_objects(_term(Property.FAILURE_CODE)), key=str):
        code = _CODE.fullmatch(str(told))
        if code is None:
            right = "a ROS type, its number if it has one, its name: nav2_msgs/action/FollowPath 104 PATIENCE_EXCEEDED"
            yield files.problem("KB146", str(failure), f"has the failure code {str(told)!r}; a code is {right}")
            continue
        source = code["type"] or "concertmaster"
        for part in filter(None, (code["number"], code["name"])):
            other = claimed.setdefault((source, part), failure)
            if other != failure:
                wrong = f"has the failure code {source} {part}, as {local_name(str(other))} has"
                yield files.problem("KB146", str(failure), f"{wrong}; a code stands for one class of failure")


def _misnamed(files: OntologyFiles, graph: Graph, prop: Property, right: set[Node], wanted: str) -> Iterator[Problem]:
    for subject, value in graph.subject_objects(_term(prop)):
        if value not in right:
            told = f"{prop} names {local_name(str(value))}, which is not {wanted}; name one"
            yield files.problem("KB148", str(subject), told)


def _below(graph: Graph, kind: Kind) -> Iterator[Node]:
    """All classes below a class, itself included."""
    return (node for node in graph.transitive_subjects(RDFS.subClassOf, _term(kind)) if node is not None)


def _term(name: Kind | Property) -> URIRef:
    return URIRef(CORE + name)
