"""SWRL rules as Protégé saves them, to be added to ontology files."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

from rdflib import RDF, RDFS, URIRef

from kb.files import SHIPPED, OntologyFiles, read_files
from kb.ontology import Ontology, close
from kb.reasoner import Classification, classify
from kb.vocabulary import CORE
from tests.kb.conftest import IRI, SITE, Edit, added

_SWRL = "http://www.w3.org/2003/11/swrl#"
_BUILT_IN = "http://www.w3.org/2003/11/swrlb#"
_XSD = "http://www.w3.org/2001/XMLSchema#"
_RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"

Argument = str | int | float | bool
"""`?name` is a variable, `"text"` (with the quotes) a string, another str the IRI of an individual."""


def core(name: str) -> str:
    """The IRI of a term of core.owl."""
    return CORE + name


def named(file: str, name: str) -> str:
    """The IRI of something that a file describes."""
    return f"{IRI}{Path(file).name}#{name}"


def is_a(kind: str, individual: str) -> str:
    """An atom: an individual belongs to a class, by its IRI."""
    return _atom("ClassAtom", _resource("classPredicate", kind), _argument("argument1", individual))


def has(prop: str, subject: str, value: str) -> str:
    """An atom: a property, by its IRI, of individuals."""
    ends = _argument("argument1", subject), _argument("argument2", value)
    return _atom("IndividualPropertyAtom", _resource("propertyPredicate", prop), *ends)


def has_data(prop: str, subject: str, value: Argument) -> str:
    """An atom: a property, by its IRI, of literals."""
    ends = _argument("argument1", subject), _argument("argument2", value)
    return _atom("DatavaluedPropertyAtom", _resource("propertyPredicate", prop), *ends)


def same(one: str, other: str) -> str:
    """An atom: sameAs."""
    return _atom("SameIndividualAtom", _argument("argument1", one), _argument("argument2", other))


def different(one: str, other: str) -> str:
    """An atom: differentFrom."""
    return _atom("DifferentIndividualsAtom", _argument("argument1", one), _argument("argument2", other))


def built_in(name: str, *arguments: Argument) -> str:
    """An atom: a built-in of swrlb."""
    listed = _list([_argument(f"{{{_RDF}}}first", a) for a in arguments], _RDF + "List")
    return _atom("BuiltinAtom", f"<swrl:builtin {_rdf('resource', _BUILT_IN + name)}/>", _whole("arguments", listed))


def satisfied(condition: str, value: Argument = True) -> str:
    """The atom of a head."""
    return has_data(core("satisfied"), condition, value)


def rule(file: str, head: str, *body: str, label: str = "", enabled: bool | None = True) -> Edit:
    """Add a rule to a file; enabled=None says nothing of that."""
    return added(file, _rule(head, body, label, enabled=enabled))


def _rule(head: str, body: tuple[str, ...], label: str, *, enabled: bool | None) -> str:
    used = sorted({name for atom in (head, *body) for name in _variables_in(atom)})
    declared = "".join(
        f"<rdf:Description {_rdf('about', iri)}><rdf:type {_rdf('resource', _SWRL + 'Variable')}/></rdf:Description>\n"
        for iri in used
    )
    switch = "http://swrl.stanford.edu/ontologies/3.3/swrla.owl#isRuleEnabled"
    lines = [f"<rdfs:label>{escape(label)}</rdfs:label>"] if label else []
    if enabled is not None:
        declared += f"<owl:AnnotationProperty {_rdf('about', switch)}/>\n"
        value = _literal(enabled)
        lines.append(
            f'<swrla:isRuleEnabled xmlns:swrla="{switch.partition("isRule")[0]}" {value}</swrla:isRuleEnabled>'
        )
    lines.append(f"<rdf:type {_rdf('resource', _SWRL + 'Imp')}/>")
    lines.append(_whole("body", _list([_item(atom) for atom in body], _SWRL + "AtomList")))
    lines.append(_whole("head", _list([_item(head)], _SWRL + "AtomList")))
    xml = "\n".join(lines)
    return f'{declared}<rdf:Description xmlns:swrl="{_SWRL}">\n{xml}\n</rdf:Description>'


def _atom(kind: str, *lines: str) -> str:
    content = "".join(lines)
    return f"<rdf:Description><rdf:type {_rdf('resource', _SWRL + kind)}/>{content}</rdf:Description>"


def _resource(prop: str, iri: str) -> str:
    return f"<swrl:{prop} {_rdf('resource', iri)}/>"


def _whole(prop: str, content: str) -> str:
    return f"<swrl:{prop}>{content}</swrl:{prop}>" if content else f"<swrl:{prop} {_rdf('resource', _RDF + 'nil')}/>"


def _item(atom: str) -> str:
    return f"<rdf:first>{atom}</rdf:first>"


def _list(items: list[str], kind: str) -> str:
    """A list in the long form, each cell typed, as the OWL API writes it; empty for an empty one."""
    if not items:
        return ""
    rest = _list(items[1:], kind)
    tail = f"<rdf:rest>{rest}</rdf:rest>" if rest else f"<rdf:rest {_rdf('resource', _RDF + 'nil')}/>"
    return f"<rdf:Description><rdf:type {_rdf('resource', kind)}/>{items[0]}{tail}</rdf:Description>"


def _argument(prop: str, value: Argument) -> str:
    tag = "rdf:first" if prop.startswith("{") else f"swrl:{prop}"
    if isinstance(value, str) and not value.startswith('"'):
        iri = f"urn:swrl:var#{value[1:]}" if value.startswith("?") else value
        return f"<{tag} {_rdf('resource', iri)}/>"
    return f"<{tag} {_literal(value)}</{tag}>"


def _literal(value: Argument) -> str:
    if isinstance(value, str):
        kind, text = "string", value[1:-1]
    elif isinstance(value, bool):
        kind, text = "boolean", str(value).lower()
    else:
        kind, text = ("integer", str(value)) if isinstance(value, int) else ("double", repr(value))
    return f'rdf:datatype="{_XSD}{kind}">{escape(text)}'


def _rdf(attribute: str, iri: str) -> str:
    return f"rdf:{attribute}={quoteattr(iri)}"


def _variables_in(xml: str) -> set[str]:
    marked = xml.split('rdf:resource="urn:swrl:var#')[1:]
    return {"urn:swrl:var#" + part.partition('"')[0] for part in marked}


def closed(folder: Path) -> Ontology:
    """The ontology of a folder, new individuals in their stated classes: rules and conditions change no others."""
    files = read_files(folder / SITE, folder)
    return close(files, _with_stated(files, _shipped()))


@cache
def _shipped() -> Classification:
    return classify(read_files(SHIPPED / SITE, SHIPPED))


def _with_stated(files: OntologyFiles, known: Classification) -> Classification:
    types = dict(known.types)
    for individual, kind in files.merged().subject_objects(RDF.type):
        if isinstance(individual, URIRef) and str(individual) not in known.types and str(kind) in known.superclasses:
            types[str(individual)] = types.get(str(individual), frozenset()) | known.superclasses[str(kind)]
    return replace(known, types=types)


def document(base: str, condition: str, bodies: list[list[str]], functional: list[str]) -> str:
    """A file of nothing but the rules of one condition."""
    properties = "".join(
        f"<rdf:Description {_rdf('about', base + name)}>"
        f"<rdf:type {_rdf('resource', 'http://www.w3.org/2002/07/owl#FunctionalProperty')}/></rdf:Description>"
        for name in functional
    )
    written = "".join(_rule(satisfied(base + condition), tuple(body), "", enabled=None) for body in bodies)
    return f'<rdf:RDF xmlns:rdf="{_RDF}" xmlns:rdfs="{RDFS}">{properties}{written}</rdf:RDF>'
