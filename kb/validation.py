"""Closed-world checks: what a reasoner, which assumes nothing, lets pass.

Misspelt terms, missing parts (SHACL shapes in shapes.ttl), two values of a property that has one.
"""

from __future__ import annotations

import difflib
import re
from pathlib import Path

from rdflib import OWL, RDF, SH, XSD, Graph, Literal, URIRef
from rdflib.term import Node

from kb.files import OntologyFiles, local_name
from kb.problems import Problem
from kb.vocabulary import CORE

_SHAPES = Path(__file__).resolve().parent / "shapes.ttl"
_IRI = re.compile(r"http://\S+#(\S+)")
_KNOWN_DATATYPES = {XSD.string, XSD.boolean, XSD.integer, XSD.double, XSD.anyURI}


def check(files: OntologyFiles) -> list[Problem]:
    """All problems of files that parse, without the reasoner."""
    graph = files.merged()
    misspelt = _unknown_terms(files, graph)
    # A misspelt term makes shapes complain about what is only its consequence.
    return misspelt or [*_datatypes(files), *_two_values(files, graph), *_shapes(files, graph)]


def _unknown_terms(files: OntologyFiles, graph: Graph) -> list[Problem]:
    own = {file.iri + "#" for file in files.files}
    declared = {str(s) for s in graph.subjects(RDF.type) if isinstance(s, URIRef)}
    problems = []
    for file in files.files:
        unknown: dict[str, str] = {}
        for subject, predicate, value in file.graph:
            for node in (predicate, value):
                iri = str(node)
                if isinstance(node, URIRef) and iri not in declared and any(iri.startswith(ns) for ns in own):
                    unknown[iri] = str(subject) if isinstance(subject, URIRef) else file.iri
        for iri, subject in sorted(unknown.items()):
            near = difflib.get_close_matches(local_name(iri), sorted(map(local_name, declared)), n=1)
            hint = f"; did you mean {near[0]}?" if near else "; declare it, or use a term that is"
            problems.append(
                Problem(
                    code="KB011",
                    file=file.path,
                    line=file.line_of(subject),
                    entity=local_name(subject),
                    message=f"uses {local_name(iri)}, which is declared nowhere{hint}",
                )
            )
    return problems


def _datatypes(files: OntologyFiles) -> list[Problem]:
    problems = []
    for file in files.files:
        for subject, predicate, value in file.graph:
            if isinstance(value, Literal) and (value.ill_typed or value.datatype not in {None, *_KNOWN_DATATYPES}):
                entity = str(subject) if isinstance(subject, URIRef) else file.iri
                kind = local_name(str(value.datatype))
                problems.append(
                    files.problem("KB012", entity, f"{local_name(str(predicate))} {str(value)!r} is no {kind} we know")
                )
    return problems


def _two_values(files: OntologyFiles, graph: Graph) -> list[Problem]:
    """Two values of a functional property: a reasoner takes them for one individual (no unique names)."""
    problems = []
    for prop in graph.subjects(RDF.type, OWL.FunctionalProperty):
        for subject in sorted(set(graph.subjects(prop)), key=str):
            values = sorted({local_name(str(o)) for o in graph.objects(subject, prop)})
            if len(values) > 1 and isinstance(subject, URIRef):
                told = f"{local_name(str(prop))} has {len(values)} values, {' and '.join(values)}; it can have one"
                problems.append(files.problem("KB143", str(subject), told))
    return problems


def _shapes(files: OntologyFiles, graph: Graph) -> list[Problem]:
    import pyshacl  # noqa: PLC0415  half a second, needed only when files have changed

    _, report, _ = pyshacl.validate(graph, shacl_graph=str(_SHAPES), advanced=True, inference="none")
    problems = []
    for result in report.subjects(RDF.type, SH.ValidationResult):
        focus = report.value(result, SH.focusNode)
        told = _message(report, result)
        code, _, message = told.partition(" ")
        entity = str(focus) if isinstance(focus, URIRef) else files.files[-1].iri
        if not entity.startswith(CORE):
            problems.append(files.problem(code, entity, _IRI.sub(r"\1", message)))
    return sorted(set(problems), key=str)


def _message(report: Graph, result: Node) -> str:
    return str(report.value(result, SH.resultMessage))
