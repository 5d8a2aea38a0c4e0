"""What the reasoner found wrong, in words, with the file and line of every axiom: KB301, KB302, KB303.

An axiom comes as kb/reasoning_worker.py describes it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rdflib import OWL, RDF, URIRef

from kb.files import OntologyFile, OntologyFiles, local_name
from kb.problems import Problem

Axiom = Mapping[str, Any]

# By the beginning of the name that the OWL API gives a violation: what is wrong, and what would be right.
_ADVICE = (
    ("UseOfUndeclared", "uses a term that is declared nowhere; declare it, or correct the spelling"),
    ("UseOfUnknownDatatype", "uses a datatype that OWL has not; use one of XML Schema"),
    ("IllegalPunning", "is used as two sorts of property, or as class and datatype; rename one"),
    ("DatatypeIRIAlsoUsedAsClassIRI", "is a datatype and a class; rename one"),
    ("UseOfReservedVocabulary", "uses a term reserved for OWL itself as if it were one's own; take another name"),
    (
        "UseOfNonSimpleProperty",
        "counts or restricts a property that is transitive or a chain, or has such a one below it; "
        "remove the number (some instead of min, max or exactly), or what makes it functional or transitive",
    ),
    ("UseOfPropertyInChain", "has property chains in a circle; break it"),
    ("UseOfTopDataProperty", "uses topDataProperty where it must not be; name a property"),
    ("UseOfNonAbsoluteIRI", "uses a relative IRI; write it in full"),
    ("OntologyIRINotAbsolute", "has a relative ontology IRI; write it in full"),
    ("LexicalNotInLexicalSpace", "has a value that is none of its datatype; correct it"),
    ("Insufficient", "has too few operands; name two or more"),
    ("EmptyOneOf", "enumerates nothing; name an individual"),
    ("CycleInDatatypeDefinition", "has datatypes defined by each other; break the circle"),
    ("UseOfIllegalFacetRestriction", "restricts a datatype by a facet that it has not; remove it"),
)


def contradiction(files: OntologyFiles, axioms: Sequence[Axiom]) -> Problem:
    """The ontology is inconsistent: a smallest set of axioms that clash (KB301)."""
    named = sorted({iri for axiom in axioms for iri in axiom["names"] if not iri.startswith(str(OWL))})
    graph = files.merged()
    individuals = [iri for iri in named if (URIRef(iri), RDF.type, OWL.NamedIndividual) in graph]
    entity = (individuals or named or [files.files[-1].iri])[0]
    return files.problem(
        "KB301", entity, f"the ontology contradicts itself: {_told(files, axioms)}; change one of these"
    )


def empty_class(files: OntologyFiles, iri: str, why: Mapping[str, Any]) -> Problem:
    """Nothing can belong to a class (KB302)."""
    if why["below"] is not None:
        reason = f"it is below {local_name(why['below'])}, to which nothing can belong; mend that"
    else:
        reason = f"its axioms contradict each other: {_told(files, why['axioms'])}; change one of these"
    return files.problem("KB302", iri, f"nothing can ever belong to this class: {reason}")


def outside_profile(files: OntologyFiles, violation: Mapping[str, Any]) -> Problem:
    """Something is not OWL 2 DL, so that reasoners and Protégé may refuse it or differ (KB303)."""
    advice = next((told for kind, told in _ADVICE if violation["kind"].startswith(kind)), None)
    axiom = violation["axiom"]
    entity = _entity(axiom) if axiom is not None else files.files[-1].iri
    told = f"{advice} (in OWL 2 DL, which reasoners need)" if advice else f"is not OWL 2 DL: {violation['text']}"
    if axiom is None:
        return files.problem("KB303", entity, told)
    file, _ = _place(files, axiom)
    line = file.line_of(entity) or file.line_of(file.iri)
    return Problem(
        code="KB303", file=file.path, line=line, entity=local_name(entity), message=f"{told}: {axiom['text']}"
    )


def _told(files: OntologyFiles, axioms: Sequence[Axiom]) -> str:
    places = ((axiom["text"], _place(files, axiom)) for axiom in axioms)
    return "; ".join(f"{text} ({file.path.name}:{line})" for text, (file, line) in places)


def _place(files: OntologyFiles, axiom: Axiom) -> tuple[OntologyFile, int]:
    """Where an axiom stands: the first file that has it, and the line."""
    file = next((f for f in files.files if f.iri in axiom["documents"]), files.file_of(_entity(axiom)))
    subject = axiom["subject"]
    line = file.line_of_statement(subject, frozenset(axiom["names"]) - {subject})
    return file, line or file.line_of(_entity(axiom)) or file.line_of(file.iri)


def _entity(axiom: Axiom) -> str:
    return str(axiom["subject"] or axiom["names"][0])
