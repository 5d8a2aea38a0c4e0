"""Closed-world checks: what a reasoner, which assumes nothing, lets pass.

Misspelt terms, missing parts (SHACL shapes in shapes.ttl), two values of a property that has one, and
what SHACL can say only in SPARQL, which takes longer than all the rest: numbers of steps, fields of groundings.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from rdflib import OWL, RDF, RDFS, SH, XSD, BNode, Graph, Literal, URIRef
from rdflib.term import Node

from kb.failures import check_failures
from kb.files import OntologyFile, OntologyFiles, local_name
from kb.kinds import check_kinds, check_stated, described
from kb.problems import Problem, errors
from kb.vocabulary import CORE, Kind, Property

_SHAPES = Path(__file__).resolve().parent / "shapes.ttl"
_IRI = re.compile(r"http://\S+#(\S+)")
_REMARKS = {
    RDFS.seeAlso,
    RDFS.isDefinedBy,
    OWL.imports,
    OWL.versionIRI,
    OWL.priorVersion,
    OWL.backwardCompatibleWith,
    OWL.incompatibleWith,
}
MISLEADING = frozenset({"KB011", "KB012", "KB014", "KB015", "KB016", "KB017", "KB143", "KB144", "KB303"})
"""After these, a reasoner would complain of what is only their consequence."""
_OF_PLACES = frozenset({"KB140", "KB141"})
_CARDINALITIES = {
    *(OWL.cardinality, OWL.minCardinality, OWL.maxCardinality),
    *(OWL.qualifiedCardinality, OWL.minQualifiedCardinality, OWL.maxQualifiedCardinality),
}
"""Their numbers are nobody's values, and of a datatype of their own."""
_STANDARD = (RDF, RDFS, OWL, XSD)
_KNOWN_DATATYPES = {XSD.string, XSD.boolean, XSD.integer, XSD.double, XSD.decimal, XSD.anyURI}
_DATATYPES_TOLD = "use xsd:string, boolean, integer, double or anyURI"
_LONGEST_VALUE = 60


def check(files: OntologyFiles) -> list[Problem]:
    """All problems of files that parse, without the reasoner."""
    graph = files.merged()
    unreadable = [*_circles(files), *_datatypes(files)]
    if unreadable:  # what follows would go round for ever, and SHACL dies of NaN
        return [*_unknown_terms(files, graph), *unreadable]
    unknown = _unknown_terms(files, graph)
    kinds = _unless_near(graph, unknown, check_kinds(files, graph))
    doubtful = [
        *_cycles(files, graph),
        *_two_values(files, graph),
        *_step_numbers(files, graph),
        *_fields(files, graph),
        *_stated_values(files, graph),
        *_effects(files, graph),
        *check_failures(files, graph),
        *_shapes(files, graph),
    ]
    return [*unknown, *kinds, *_unless_near(graph, [*unknown, *errors(kinds)], doubtful)]


def check_parts(files: OntologyFiles) -> list[Problem]:
    """Problems that no further file could take away: where not all files of a site can be read."""
    graph = files.merged()
    return [*_circles(files), *_datatypes(files)] or [
        *check_stated(files, graph),
        *_cycles(files, graph),
        *_two_values(files, graph),
    ]


def _unless_near(graph: Graph, sure: list[Problem], doubtful: list[Problem]) -> list[Problem]:
    """What is misspelt or of the wrong kind is not blamed for what it lacks, too; nor is what refers to it."""
    near = _neighborhood(graph, {p.entity for p in sure} - {""})
    return [p for p in doubtful if p.entity not in near]


def _neighborhood(graph: Graph, names: set[str]) -> set[str]:
    """Entities, by name, with all that refer to them or that they refer to."""
    if not names:
        return set()
    near = set(names)
    for subject, _, value in graph:
        if isinstance(value, Literal):
            continue
        pair = {local_name(str(subject)), local_name(str(value))}
        if pair & names:
            near |= pair
    return near


def processes_are_whole(problems: list[Problem]) -> bool:
    """Whether processes can be compiled: places may lack something, processes may not."""
    return all(p.code in _OF_PLACES for p in errors(problems))


def _unknown_terms(files: OntologyFiles, graph: Graph) -> list[Problem]:
    declared = {str(s) for s in graph.subjects(RDF.type) if isinstance(s, URIRef)}
    annotations = {p for p in graph.subjects(RDF.type, OWL.AnnotationProperty) if not str(p).startswith(CORE)}
    problems = []
    for file in files.files:
        unknown: dict[str, str] = {}
        for subject, predicate, value in file.graph:
            # What a remark links to may be anywhere.
            for node in (predicate,) if predicate in annotations | _REMARKS else (predicate, value):
                iri = str(node)
                if isinstance(node, URIRef) and iri not in declared and not _is_standard(node):
                    user = _named(file, subject)
                    unknown[iri] = min(user, unknown.get(iri, user))
        for iri, user in sorted(unknown.items()):
            problems.append(
                Problem(
                    code="KB011",
                    file=file.path,
                    line=file.line_of(user),
                    entity="" if user == file.iri else local_name(user),
                    message=_unknown(iri, declared),
                )
            )
    return problems


def _is_standard(node: URIRef) -> bool:
    """Whether RDF or OWL itself defines a term; of other vocabularies of the W3C, all are taken for right."""
    for namespace in _STANDARD:
        if node.startswith(str(namespace)):
            return node in namespace or node.startswith(str(RDF) + "_")
    return node.startswith("http://www.w3.org/")


def _unknown(iri: str, declared: set[str]) -> str:
    """What to say of a term that nothing declares."""
    name = local_name(iri)
    standard = [str(term) for space in _STANDARD for term in dir(space)]
    namesakes = [term for term in standard if local_name(term) == name]
    namesakes += sorted(d for d in declared if local_name(d) == name)
    if namesakes:
        return f"uses <{iri}>, which is declared nowhere; did you mean <{namesakes[0]}>?"
    known = {local_name(d) for d in declared}
    if any(iri.startswith(str(space)) for space in _STANDARD):
        known = set(map(local_name, standard))
    near = difflib.get_close_matches(name, sorted(known), n=1)
    hint = f"did you mean {near[0]}?" if near else "declare it, or use a term that is"
    return f"uses {name}, which is declared nowhere; {hint}"


def _named(file: OntologyFile, node: Node) -> str:
    """IRI of what a node of a file describes; else that of the file."""
    return described(file.graph, node) or file.iri


def _circles(files: OntologyFiles) -> Iterator[Problem]:
    """Lists and class expressions that contain themselves: anonymous, so that Protégé never writes them."""
    for file in files.files:
        parts: dict[Node, list[Node]] = {}
        for subject, _, value in file.graph:
            if isinstance(subject, BNode) and isinstance(value, BNode):
                parts.setdefault(subject, []).append(value)
        try:
            TopologicalSorter(parts).prepare()
        except CycleError as error:
            entity = _named(file, error.args[1][0])
            told = "has a list, class expression or anonymous individual that contains itself; write it anew"
            yield files.problem("KB303", entity, f"{told} (in OWL 2 DL, which reasoners need)")


def _datatypes(files: OntologyFiles) -> list[Problem]:
    problems = []
    for file in files.files:
        for subject, predicate, value in file.graph:
            if not isinstance(value, Literal) or predicate in _CARDINALITIES:
                continue
            if value.datatype not in {None, *_KNOWN_DATATYPES}:
                wrong = f"is of the datatype {local_name(str(value.datatype))}; {_DATATYPES_TOLD}"
            elif value.ill_typed:
                wrong = f"is no xsd:{local_name(str(value.datatype))}; write one, or choose another datatype"
            elif isinstance(value.value, float) and not math.isfinite(value.value):
                wrong = "is no finite number; give one"
            else:
                continue
            prop = file.graph.value(subject, OWL.onProperty) or predicate  # of a restriction, what it restricts
            told = f"{local_name(str(prop))} {_quoted(str(value))} {wrong}"
            problems.append(files.problem("KB012", _named(file, subject), told))
    return problems


def _quoted(text: str) -> str:
    """A text as it was written, or how it begins."""
    return repr(text) if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]!r}..."


def _cycles(files: OntologyFiles, graph: Graph) -> list[Problem]:
    """Constructs and conditions that contain themselves; each cycle once."""
    parts: dict[str, list[str]] = {}
    for above in (Property.HAS_STEP, Property.OPERAND):
        for prop in graph.transitive_subjects(RDFS.subPropertyOf, _term(above)):
            for whole, part in graph.subject_objects(prop):
                parts.setdefault(str(whole), []).append(str(part))
    problems, named = [], set[str]()
    for entity in sorted(parts):
        cycle = [] if entity in named else _way_back(parts, entity)
        if cycle:
            named.update(cycle)
            told = f"contains itself: {' -> '.join(map(local_name, cycle))}; name another step or operand"
            problems.append(files.problem("KB211", entity, told))
    return problems


def _way_back(parts: dict[str, list[str]], entity: str) -> list[str]:
    """The shortest way from an entity through its parts to itself, both ends included; empty if there is none."""
    whole_of: dict[str, str] = {}
    todo = [entity]
    for whole in todo:
        for part in sorted(parts.get(whole, ())):
            if part == entity:
                way = [whole]
                while way[-1] != entity:
                    way.append(whole_of[way[-1]])
                return [*reversed(way), entity]
            if part not in whole_of:
                whole_of[part] = whole
                todo.append(part)
    return []


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


def _step_numbers(files: OntologyFiles, graph: Graph) -> list[Problem]:
    """Each step of a sequence, and of what is prioritized, has a number, and no two the same."""
    problems = []
    ordered = [s for kind in (Kind.SEQUENCE, Kind.PRIORITIZED) for s in graph.subjects(RDF.type, _term(kind))]
    for sequence in ordered:
        numbered: dict[Node, str] = {}
        for step in sorted(map(str, graph.objects(sequence, _term(Property.HAS_STEP)))):
            number, name = graph.value(URIRef(step), _term(Property.STEP_NUMBER)), local_name(step)
            if number is None:
                problems.append(files.problem("KB109", str(sequence), f"has a step without stepNumber: {name}"))
            elif numbered.setdefault(number, name) != name:
                told = f"has two steps with stepNumber {number}: {numbered[number]} and {name}"
                problems.append(files.problem("KB108", str(sequence), told))
    return problems


def _fields(files: OntologyFiles, graph: Graph) -> list[Problem]:
    """The fields of a grounding carry parameters of the process that it grounds, all outputs among them."""
    problems = []
    for grounding, process in graph.subject_objects(_term(Property.GROUNDS)):
        outputs = set(graph.objects(process, _term(Property.HAS_OUTPUT)))
        parameters = outputs | set(graph.objects(process, _term(Property.HAS_INPUT)))
        replies = set(graph.objects(grounding, _term(Property.HAS_REPLY_FIELD)))
        requests = set(graph.objects(grounding, _term(Property.HAS_REQUEST_FIELD)))
        mapped = {(f, p) for f in replies | requests for p in graph.objects(f, _term(Property.MAPS_PARAMETER))}
        told = [
            f"the field {local_name(str(f))} maps {local_name(str(p))}, a parameter of another process"
            for f, p in mapped
            if p not in parameters
        ] + [
            f"the output {local_name(str(p))} of the process that it grounds comes from no reply field"
            for p in outputs - {p for f, p in mapped if f in replies}
        ]
        problems += [files.problem("KB122", str(grounding), message) for message in told]
    return problems


def _stated_values(files: OntologyFiles, graph: Graph) -> list[Problem]:
    """What a condition or effect states is of the datatype of its property: 1 is not 1.0 to the planner."""
    problems = []
    for subject, value in graph.subject_objects(_term(Property.HAS_VALUE)):
        prop = graph.value(subject, _term(Property.OF_PROPERTY))
        if prop is None or (subject, RDF.type, _term(Kind.COMPARE)) in graph:
            continue
        stated = value.datatype or XSD.string if isinstance(value, Literal) else None
        wanted = graph.value(prop, RDFS.range)
        if (prop, RDF.type, OWL.ObjectProperty) in graph:
            right = "a property of individuals: use objectParameter"
        elif wanted in _KNOWN_DATATYPES and stated != wanted:
            right = f"a property of datatype {local_name(str(wanted))}: give it such a value"
        else:
            continue
        told = f"states the value {str(value)!r} for {local_name(str(prop))}, {right}"
        problems.append(files.problem("KB144", str(subject), told))
    return problems


def _effects(files: OntologyFiles, graph: Graph) -> list[Problem]:
    """Effects change fluents: of what is no fluent, neither planner nor store expects a change."""
    problems = []
    for effect in {o for o in graph.objects(None, _term(Property.HAS_EFFECT)) if isinstance(o, URIRef)}:
        prop = graph.value(effect, _term(Property.OF_PROPERTY))
        marks = [] if prop is None else [m for m in graph.objects(prop, _term(Property.FLUENT)) if m == Literal(True)]
        if prop is not None and not marks:
            told = f"changes {local_name(str(prop))}, which is no fluent; mark that property `fluent true`"
            problems.append(files.problem("KB145", str(effect), f"{told}, or change another"))
    return problems


def _term(name: Kind | Property) -> URIRef:
    return URIRef(CORE + name)


def _shapes(files: OntologyFiles, graph: Graph) -> list[Problem]:
    import pyshacl  # noqa: PLC0415  half a second, needed only when files have changed

    _, report, _ = pyshacl.validate(graph, shacl_graph=str(_SHAPES), inference="none")
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
