"""The vocabulary of OWL-S, 1.1 and 1.2, wherever a file says that it lives."""

from __future__ import annotations

import re

from rdflib import RDF, Namespace

_HOME = "http://www.daml.org/services/owl-s/1.2"
_MODULE = re.compile(
    r"\w+://[^#]*/owl[-_]s/\d[\d.]*/(?:generic/|extensions/)?"
    r"(ActorDefault|Expression|FLAService|Grounding|MoreGroundings|OWLSExtensions|ObjectList|Process|Profile"
    r"|ProfileAdditionalParameters|Service|ServiceCategory|ServiceParameter)\.owl(?:#(.*))?\Z"
)

PROCESS = Namespace(f"{_HOME}/Process.owl#")
GROUNDING = Namespace(f"{_HOME}/Grounding.owl#")
SERVICE = Namespace(f"{_HOME}/Service.owl#")
EXPRESSION = Namespace(f"{_HOME}/Expression.owl#")
LIST = Namespace(f"{_HOME}/ObjectList.owl#")
SWRL = Namespace("http://www.w3.org/2003/11/swrl#")

FIRST = (RDF.first, LIST.first)
REST = (RDF.rest, LIST.rest)
NO_ITEMS = (RDF.nil, LIST.nil)


def canonical(iri: str) -> str:
    """The IRI of a term of OWL-S as this module writes it; any other as it is."""
    found = _MODULE.match(iri)
    return f"{_HOME}/{found.group(1)}.owl#{found.group(2) or ''}" if found else iri


def is_vocabulary(iri: str) -> bool:
    """Whether an ontology is part of OWL-S itself."""
    return _MODULE.match(iri) is not None
