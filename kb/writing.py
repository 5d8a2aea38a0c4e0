"""Ontology files as Protégé saves them: RDF/XML, a section for each sort of entity, entities in order of IRI.

The one writer of all that we make: recipes kept from plans, files imported from others. The same entities,
given in whatever order, make the same text.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from xml.sax.saxutils import escape, quoteattr

from kb.vocabulary import CORE

Literal = str | int | float | bool

_OWL = "http://www.w3.org/2002/07/owl#"
_RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
_RDFS = "http://www.w3.org/2000/01/rdf-schema#"
_XSD = "http://www.w3.org/2001/XMLSchema#"
_STANDARD = {"owl": _OWL, "rdf": _RDF, "xsd": _XSD, "rdfs": _RDFS}
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*\Z")
_NO_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


class Sort(StrEnum):
    """Sorts of entities, by the element that declares them; in the order of their sections."""

    ANNOTATION_PROPERTY = "AnnotationProperty"
    OBJECT_PROPERTY = "ObjectProperty"
    DATATYPE_PROPERTY = "DatatypeProperty"
    CLASS = "Class"
    INDIVIDUAL = "NamedIndividual"


_TITLES = {
    Sort.ANNOTATION_PROPERTY: "Annotation properties",
    Sort.OBJECT_PROPERTY: "Object Properties",
    Sort.DATATYPE_PROPERTY: "Data properties",
    Sort.CLASS: "Classes",
    Sort.INDIVIDUAL: "Individuals",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Some:
    """The restriction `prop some kind`, both by IRI."""

    prop: str
    kind: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Has:
    """The restriction `prop value v`, of a data property by IRI."""

    prop: str
    value: Literal


@dataclass(frozen=True, slots=True, kw_only=True)
class Entity:
    """A declared entity and what is said of it. Everything is named by IRI.

    Attributes:
        types: Classes of an individual; of a property, what it is beside (FunctionalProperty).
        above: Superclasses of a class: IRIs and restrictions.
        domain: Of a property; empty if it has none.
        range_: Of a property: a class or datatype; empty if it has none.
        links: Property and the entity that it leads to, in the order in which they are written.
        values: Property and literal.
        comments: Each an rdfs:comment, in English.
        label: For people, in English; none if empty.
    """

    iri: str
    sort: Sort
    types: tuple[str, ...] = ()
    above: tuple[str | Some | Has, ...] = ()
    domain: str = ""
    range_: str = ""
    links: tuple[tuple[str, str], ...] = ()
    values: tuple[tuple[str, Literal], ...] = ()
    comments: tuple[str, ...] = ()
    label: str = ""


def ontology_text(
    iri: str, entities: Iterable[Entity], *, imports: Iterable[str] = (), comments: Iterable[str] = (), label: str = ""
) -> str:
    """An ontology file.

    Args:
        iri: Of the ontology; that of its own namespace is the same with `#`.
        entities: In any order; no two with one IRI and sort.
        imports: IRIs of ontologies.
        comments: What to say of the ontology, in English.

    Returns:
        The text, to be saved in UTF-8.

    Raises:
        ValueError: A property's IRI has no local name that XML could write; a number is not finite; a text has
            characters that XML cannot hold.
    """
    ordered = sorted(entities, key=lambda e: (list(Sort).index(e.sort), e.iri))
    prefixes = _prefixes(iri, ordered)
    lines = ['<?xml version="1.0"?>', f"<rdf:RDF xmlns={quoteattr(iri + '#')}", f"     xml:base={quoteattr(iri)}"]
    declared = {p: n for n, p in prefixes.items() if p}
    lines += [f"     xmlns:{p}={quoteattr(n)}" for p, n in sorted(declared.items())]
    lines += [f"     xmlns:{p}={quoteattr(n)}" for p, n in _STANDARD.items()]
    lines[-1] += ">"
    lines.append(f"    <owl:Ontology rdf:about={quoteattr(iri)}>")
    lines += [f"        <owl:imports rdf:resource={quoteattr(i)}/>" for i in sorted(set(imports))]
    lines += [*_remarks(tuple(comments), label), "    </owl:Ontology>"]
    lines += ["    ", ""]
    for section in Sort:
        members = [entity for entity in ordered if entity.sort is section]
        if members:
            lines += [*([""] if section is ordered[0].sort else []), *_title(_TITLES[section]), "    ", ""]
        for entity in members:
            lines += ["", f"    <!-- {entity.iri.replace('--', '- -')} -->", ""]
            lines += [*_element(entity, prefixes), "    ", ""]
    return "\n".join([*lines, "</rdf:RDF>", ""])


def _prefixes(iri: str, entities: Iterable[Entity]) -> dict[str, str]:
    """Prefix of each namespace of a property; empty for the file's own."""
    namespaces = {_split(p)[0] for e in entities for p, _ in (*e.links, *e.values)}
    prefixes = {iri + "#": "", CORE: "core"}
    for namespace in sorted(namespaces - set(prefixes)):
        stem = re.sub(r"[^a-z0-9]+", "_", namespace.rstrip("#/").rpartition("/")[2].partition(".")[0].lower()).strip(
            "_"
        )
        name = stem if stem and stem[0].isalpha() and not stem.startswith("xml") else f"ns_{stem}".rstrip("_")
        taken = {*prefixes.values(), *_STANDARD}
        prefixes[namespace] = next(n for n in (name, *(f"{name}_{i}" for i in range(2, 10_000))) if n not in taken)
    return prefixes


def _split(prop: str) -> tuple[str, str]:
    cut = max(prop.rfind("#"), prop.rfind("/")) + 1
    namespace, name = prop[:cut], prop[cut:]
    if not namespace or not _NAME.match(name):
        raise ValueError(f"{prop} cannot be written as a property: its last part is no XML name")
    return namespace, name


def _title(text: str) -> list[str]:
    bar = f"    {'/' * 87}"
    return ["    <!-- ", bar, "    //", f"    // {text}", "    //", bar, "     -->", ""]


def _element(entity: Entity, prefixes: dict[str, str]) -> Iterator[str]:
    opening = f"    <owl:{entity.sort} rdf:about={quoteattr(_clean(entity.iri))}"
    within = [
        *(_link("rdfs:subClassOf", above) if isinstance(above, str) else _restriction(above) for above in entity.above),
        *(_link("rdf:type", t) for t in entity.types),
        *([_link("rdfs:domain", entity.domain)] if entity.domain else []),
        *([_link("rdfs:range", entity.range_)] if entity.range_ else []),
        *(_link(_qualified(p, prefixes), to) for p, to in entity.links),
        *(_value(_qualified(p, prefixes), value) for p, value in entity.values),
        *_remarks(entity.comments, entity.label),
    ]
    if not within:
        yield f"{opening}/>"
        return
    yield f"{opening}>"
    yield from within
    yield f"    </owl:{entity.sort}>"


def _qualified(prop: str, prefixes: dict[str, str]) -> str:
    namespace, name = _split(prop)
    return f"{prefixes[namespace]}:{name}" if prefixes[namespace] else name


def _link(element: str, to: str) -> str:
    return f"        <{element} rdf:resource={quoteattr(_clean(to))}/>"


def _value(element: str, value: Literal) -> str:
    datatype, text = _literal(value)
    typed = f' rdf:datatype="{_XSD}{datatype}"' if datatype else ""
    return f"        <{element}{typed}>{escape(text)}</{element}>"


def _literal(value: Literal) -> tuple[str, str]:
    match value:
        case bool():
            return "boolean", str(value).lower()
        case int():
            return "integer", str(value)
        case float():
            if not math.isfinite(value):
                raise ValueError(f"{value} is no number that an ontology can hold")
            return "double", repr(value)
        case _:
            return "", _clean(value)


def _restriction(restriction: Some | Has) -> str:
    lines = ["        <rdfs:subClassOf>", "            <owl:Restriction>"]
    lines.append("        " + _link("owl:onProperty", restriction.prop))
    if isinstance(restriction, Some):
        lines.append("        " + _link("owl:someValuesFrom", restriction.kind))
    else:
        lines.append("        " + _value("owl:hasValue", restriction.value))
    return "\n".join([*lines, "            </owl:Restriction>", "        </rdfs:subClassOf>"])


def _remarks(comments: tuple[str, ...], label: str) -> list[str]:
    remarks = [("rdfs:comment", c) for c in comments] + ([("rdfs:label", label)] if label else [])
    return [f'        <{element} xml:lang="en">{escape(_clean(text))}</{element}>' for element, text in remarks]


def _clean(text: str) -> str:
    wrong = _NO_XML.search(text)
    if wrong:
        raise ValueError(f"{text!r} has the character {wrong.group()!r}, which XML cannot hold")
    return text
