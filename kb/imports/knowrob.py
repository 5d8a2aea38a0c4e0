"""The vocabulary of KnowRob and SRDL, wherever a file says that it lives, and how their class axioms are read."""

from __future__ import annotations

import re
from dataclasses import dataclass

from rdflib import OWL, RDF, RDFS, BNode, Namespace, URIRef
from rdflib.term import Node

from kb.imports.names import local
from kb.imports.owls_terms import FIRST, REST
from kb.imports.report import Fate
from kb.imports.source import Source

KNOWROB = Namespace("http://knowrob.org/kb/knowrob.owl#")
COMPONENT = Namespace("http://knowrob.org/kb/srdl2-comp.owl#")
CAPABILITY = Namespace("http://knowrob.org/kb/srdl2-cap.owl#")

_HOME = re.compile(
    r"http://(?:ias\.cs\.tum\.edu|(?:www\.)?knowrob\.org)/kb/((?:knowrob|srdl2|srdl2-comp|srdl2-cap)\.owl#.*)\Z"
)
_VOCABULARY = re.compile(r"(?:^|.*/)(?:knowrob|srdl2|srdl2-comp|srdl2-cap|srdl2-action|knowrob_common)\.owl\Z")
_MISSPELT = URIRef(str(OWL) + "subClassOf")


def canonical(iri: str) -> str:
    """The IRI of a term as this module writes it; any other as it is."""
    found = _HOME.match(iri)
    return f"http://knowrob.org/kb/{found.group(1)}" if found else iri


def is_vocabulary(iri: str) -> bool:
    """Whether an ontology is part of KnowRob or SRDL itself."""
    return _VOCABULARY.match(iri) is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class Restriction:
    """What a class says of its members: a property, and a class or an individual.

    Attributes:
        filler: A class, or an individual.
        is_value: The filler is one individual, not a class.
    """

    prop: str
    filler: Node
    is_value: bool


def axioms(source: Source, kind: Node) -> tuple[list[Node], list[Restriction]]:
    """Named superclasses of a class and its restrictions, out of all that it is below or equal to.

    Two habits of recipes are read as they are meant, and told of: owl:subClassOf, and a restriction to *some* of
    a filler that is an individual.
    """
    above: list[Node] = []
    restrictions: list[Restriction] = []
    if source.values(kind, _MISSPELT):
        source.note(kind, Fate.CHANGED, "owl:subClassOf is no term of OWL; it was read as rdfs:subClassOf")
    anonymous = isinstance(kind, BNode)
    todo = [kind] if anonymous else source.values(kind, RDFS.subClassOf, OWL.equivalentClass, _MISSPELT)
    for node in todo:
        source.types(node)
        parts = source.value(node, OWL.intersectionOf)
        prop = source.value(node, OWL.onProperty)
        if parts is not None:
            items = source.items(parts, FIRST, REST)
            todo += [item for item in items if item not in todo]
            if len(items) == 1:
                source.note(kind, Fate.CHANGED, "an intersection of one class was read as that class")
        elif prop is None:
            above.append(node)
        else:
            restrictions += _restrictions(source, kind, node, local(str(prop)))
    return above, restrictions


def _restrictions(source: Source, kind: Node, node: Node, prop: str) -> list[Restriction]:
    found = [Restriction(prop=prop, filler=v, is_value=True) for v in source.values(node, OWL.hasValue)]
    for filler in source.values(node, OWL.someValuesFrom, OWL.allValuesFrom):
        is_value = is_individual(source, filler)
        if is_value:
            told = f"{prop} some {local(str(filler))}, which is an individual, was read as {prop} value that"
            source.note(kind, Fate.CHANGED, told)
        found.append(Restriction(prop=prop, filler=filler, is_value=is_value))
    if not found:
        source.note(kind, Fate.LEFT_OUT, f"a restriction of {prop} that is neither some, all nor value")
    return found


def is_individual(source: Source, node: Node) -> bool:
    """Whether a node is said to be of a class that is no class of classes."""
    kinds = {k for k in source.graph.objects(node, RDF.type) if k != OWL.NamedIndividual}
    return bool(kinds) and not any(str(k).startswith(str(OWL)) for k in kinds)
