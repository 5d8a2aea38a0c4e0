"""OWL-S groundings -> our groundings: the service's name and the names of the fields.

What a WSDL file says is not read: a Concertmaster service of that name has to be offered, by an adapter to the
web service, say. Transformations (XSLT) are left out: the service gets the values themselves.
"""

from __future__ import annotations

from rdflib import RDF
from rdflib.term import Node

from kb.imports.draft import Draft
from kb.imports.names import local, safe, snake
from kb.imports.owls_terms import GROUNDING
from kb.imports.owls_types import Slot
from kb.imports.report import Fate
from kb.imports.source import Source
from kb.vocabulary import Kind, Property
from kb.writing import Literal

DURATION_S = 1.0
"""Assumed of every atomic process: OWL-S does not say how long one takes."""

TIMEOUT_S = 10.0
"""Assumed of every service."""

_MAPS = (GROUNDING.wsdlInput, GROUNDING.wsdlOutput)


def write_grounding(source: Source, draft: Draft, process: Node, name: str, slots: list[Slot]) -> None:
    """Ground an atomic process as the source does; one that it does not ground gets a service named for it."""
    found = source.subjects(GROUNDING.owlsProcess, process)
    if len(found) > 1:
        source.note(
            process, Fate.LEFT_OUT, f"has {len(found)} groundings; only the first, {local(str(found[0]))}, is kept"
        )
    fields: dict[Node, str] = {}
    if found:
        service = _service(source, found[0], name)
        fields = _message_parts(source, found[0])
        source.note(found[0], Fate.CHANGED, f"became the compute service {service}; offer one of this name")
    else:
        service = f"/{safe(local(draft.iri).removesuffix('.owl'))}/{name}"
        source.note(process, Fate.ASSUMED, f"has no grounding; it was given the compute service {service}")
    ground(draft, name, service, slots, fields)


def ground(draft: Draft, process: str, service: str, slots: list[Slot], fields: dict[Node, str] | None = None) -> None:
    """Ground a process of the draft in a compute service whose fields carry its parameters."""
    grounding = draft.names.fresh(f"{process}_Grounding")
    links: list[tuple[Property, str]] = [(Property.GROUNDS, process)]
    taken: dict[Property, set[str]] = {Property.HAS_REQUEST_FIELD: set(), Property.HAS_REPLY_FIELD: set()}
    for slot in slots:
        prop = Property.HAS_REPLY_FIELD if slot.role == "Output" else Property.HAS_REQUEST_FIELD
        wanted = (fields or {}).get(slot.source, snake(slot.parameter))
        field = wanted if wanted not in taken[prop] else snake(slot.parameter)
        taken[prop].add(field)
        entity = draft.names.fresh(f"{grounding}_{field}")
        draft.individual(
            entity,
            Kind.FIELD,
            [(Property.MAPS_PARAMETER, slot.name)],
            [(Property.FIELD_NAME, field), (Property.MESSAGE_TYPE, slot.type.message)],
        )
        links.append((prop, entity))
    values: list[tuple[Property, Literal]] = [(Property.SERVICE_NAME, service), (Property.TIMEOUT_S, TIMEOUT_S)]
    draft.individual(grounding, Kind.COMPUTE_GROUNDING, links, values)


def _service(source: Source, grounding: Node, name: str) -> str:
    document = str(source.value(grounding, GROUNDING.wsdlDocument) or "")
    operation = source.value(grounding, GROUNDING.wsdlOperation)
    called = ""
    if operation is not None:
        called = local(str(source.value(operation, GROUNDING.operation) or ""))
        source.values(operation, GROUNDING.portType, RDF.type)
    for prop in ("wsdlInputMessage", "wsdlOutputMessage", "wsdlVersion", "wsdlReference"):
        source.values(grounding, GROUNDING[prop])
    source.values(grounding, RDF.type)
    stem = local(document.split("?")[0]).partition(".")[0]
    return f"/{safe(stem) if document else 'services'}/{safe(called) if called else name}"


def _message_parts(source: Source, grounding: Node) -> dict[Node, str]:
    """Names of fields, by parameter: those of the message parts, where there is one for the parameter."""
    parts: dict[Node, list[str]] = {}
    for mapped in source.values(grounding, *_MAPS):
        source.values(mapped, RDF.type)
        parameter = source.value(mapped, GROUNDING.owlsParameter)
        part = local(str(source.value(mapped, GROUNDING.wsdlMessagePart) or ""))
        if parameter is None:
            source.note(grounding, Fate.LEFT_OUT, f"the message part {part or '?'} carries no parameter")
            continue
        if source.values(mapped, GROUNDING.xsltTransformationString, GROUNDING.xsltTransformationURI):
            told = f"the transformation (XSLT) of {local(str(parameter))} to or from {part or 'the message'}"
            source.note(grounding, Fate.LEFT_OUT, f"{told}; the service gets, and gives, the value itself")
        if part:
            parts.setdefault(parameter, []).append(part)
    fields = {}
    for parameter, names in parts.items():
        if len(names) == 1:
            fields[parameter] = snake(names[0])
        else:
            told = f"{local(str(parameter))} fills the message parts {', '.join(sorted(names))}; it became one field"
            source.note(grounding, Fate.CHANGED, told)
    return fields
