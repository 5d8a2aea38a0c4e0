"""What entities are, and whether they are used as that: what a reasoner, which assumes nothing, would infer in silence.

A class is asserted, here: stated of an individual, or above one that is stated.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

from rdflib import OWL, RDF, RDFS, XSD, BNode, Graph, Literal, URIRef
from rdflib.collection import Collection
from rdflib.term import Node

from kb.closure import PROPERTY_SORTS
from kb.files import OntologyFiles, local_name
from kb.problems import Problem, warn
from kb.vocabulary import CORE, Property

_FILLERS = (OWL.someValuesFrom, OWL.allValuesFrom, OWL.onClass)


def check_kinds(files: OntologyFiles, graph: Graph) -> list[Problem]:
    """Entities that are not what they are used as; classless ones; labels; deprecated terms."""
    individuals = _individuals(graph)
    return [
        *check_stated(files, graph),
        *_values(files, graph, individuals),
        *_classless(files, graph, individuals),
        *_deprecated(files, graph),
    ]


def check_stated(files: OntologyFiles, graph: Graph) -> list[Problem]:
    """What is wrong by itself, whatever else may be stated."""
    return [
        *_misnamed(files, graph),
        *_literal_classes(files, graph),
        *_fillers(files, graph, _individuals(graph)),
        *_labels(files, graph),
    ]


def _individuals(graph: Graph) -> set[URIRef]:
    return {s for s in graph.subjects(RDF.type, OWL.NamedIndividual) if isinstance(s, URIRef)}


def _misnamed(files: OntologyFiles, graph: Graph) -> Iterator[Problem]:
    """Entities whose names the planner cannot tell from values: those of JSON, no place, and where a robot is now."""
    sorts = (OWL.NamedIndividual, OWL.Class, *PROPERTY_SORTS)
    for entity in sorted({e for sort in sorts for e in graph.subjects(RDF.type, sort) if isinstance(e, URIRef)}):
        name = local_name(str(entity))
        if name in ("true", "false", "null", "none", "here"):
            told = f"is called {name}, which is something else in programs and plans; rename it"
            yield files.problem("KB009", str(entity), told)


def _literal_classes(files: OntologyFiles, graph: Graph) -> Iterator[Problem]:
    """Texts where a class or property is to be named: `<rdf:type>Beer</rdf:type>`."""
    for predicate in (RDF.type, RDFS.subClassOf, RDFS.subPropertyOf, RDFS.domain, RDFS.range):
        for subject, value in graph.subject_objects(predicate):
            if isinstance(value, Literal):
                told = f"{local_name(predicate)} has the literal {str(value)!r} for a value; name it with rdf:resource"
                yield files.problem("KB015", _owner(files, graph, subject), told)


def _fillers(files: OntologyFiles, graph: Graph, individuals: set[URIRef]) -> Iterator[Problem]:
    for filler in _FILLERS:
        for restriction, value in graph.subject_objects(filler):
            if value in individuals:
                name, prop = local_name(str(value)), local_name(str(graph.value(restriction, OWL.onProperty)))
                told = f"restricts {prop} to the class {name}, which is an individual; say `{prop} value {name}`"
                yield files.problem("KB014", _owner(files, graph, restriction), f"{told}, or name its class")


def _values(files: OntologyFiles, graph: Graph, individuals: set[URIRef]) -> Iterator[Problem]:
    """Values of the wrong sort (KB015); individuals and literals that are not of the domain or range (KB016)."""
    asserted = _Asserted(graph)
    classes = set(graph.subjects(RDF.type, OWL.Class)) - individuals
    for sort, check in ((OWL.ObjectProperty, _thing), (OWL.DatatypeProperty, _literal)):
        for prop in sorted(graph.subjects(RDF.type, sort), key=str):
            if str(prop).startswith("http://www.w3.org/"):
                continue  # what files repeat of SWRL, which has anonymous atoms
            above = set(graph.transitive_objects(prop, RDFS.subPropertyOf))
            domains = [d for p in above for d in graph.objects(p, RDFS.domain)]
            ranges = [r for p in above for r in graph.objects(p, RDFS.range)]
            for subject, value in graph.subject_objects(prop):
                if subject in individuals:
                    for domain in domains:
                        if not asserted.belongs(subject, domain):
                            yield _misused(files, subject, prop, asserted.name(domain))
                for code, entity, told in check(asserted, classes, prop, value, ranges):
                    yield files.problem(code, str(entity or _owner(files, graph, subject)), told)
            for restriction, value in _restricted(graph, prop):
                for code, entity, told in check(asserted, classes, prop, value, ranges):
                    yield files.problem(code, str(entity or _owner(files, graph, restriction)), told)


def _restricted(graph: Graph, prop: Node) -> Iterator[tuple[Node, Node]]:
    """The values that classes give to their members for a property."""
    for restriction in graph.subjects(OWL.onProperty, prop):
        for value in graph.objects(restriction, OWL.hasValue):
            yield restriction, value


_Found: TypeAlias = Iterator[tuple[str, Node | None, str]]
"""Code, entity (None: whoever has the value) and message of each."""


def _thing(asserted: _Asserted, classes: set[Node], prop: Node, value: Node, ranges: list[Node]) -> _Found:
    """What is wrong with the value of a property of individuals."""
    name = local_name(str(prop))
    if isinstance(value, Literal):
        yield "KB015", None, f"{name} has the literal {str(value)!r} for a value; name an individual"
    elif value in classes:
        told = f"{name} has the class {local_name(str(value))} for a value; name an individual, one of that class"
        yield "KB015", None, told
    elif isinstance(value, BNode):
        yield "KB015", None, f"{name} has an individual without a name for a value; give it one (rdf:about)"
    else:
        for kind in ranges:
            if not asserted.belongs(value, kind):
                wanted = asserted.name(kind)
                told = f"is a value of {name}, which must be {wanted}, but has no class below {wanted}"
                yield "KB016", value, f"{told}; add one, or use another property than {name}"


def _literal(asserted: _Asserted, classes: set[Node], prop: Node, value: Node, ranges: list[Node]) -> _Found:
    """What is wrong with the value of a property of literals."""
    name = local_name(str(prop))
    if not isinstance(value, Literal):
        told = f"{name} has {local_name(str(value))} for a value; give a literal, such as a number or a text"
        yield "KB015", None, told
        return
    wanted = [r for r in ranges if isinstance(r, URIRef) and r.startswith(str(XSD))]
    if not wanted:
        return
    right = local_name(str(wanted[0]))
    if value.language:
        told = f"is in the language {value.language!r}; remove the language"
    elif (stated := value.datatype or XSD.string) not in wanted:
        told = f"is of xsd:{local_name(str(stated))}; choose xsd:{right} as its datatype"
    else:
        return
    yield "KB016", None, f"{name} is of xsd:{right}, but {str(value)!r} {told}"


def _misused(files: OntologyFiles, subject: Node, prop: Node, kind: str) -> Problem:
    name = local_name(str(prop))
    told = (
        f"has {name}, which is of {kind}, but has no class below {kind}; add one, or use another property than {name}"
    )
    return files.problem("KB016", str(subject), told)


def described(graph: Graph, node: Node) -> str:
    """IRI of a node; of an anonymous one (a restriction, a list), that of the entity it describes; empty if of none."""
    todo, seen = [node], {node}
    for above in todo:
        if not isinstance(above, BNode):
            return str(above)
        users = set(graph.subjects(None, above)) - seen
        seen |= users
        todo += sorted(users, key=lambda user: (isinstance(user, BNode), str(user)))
    return ""


def _owner(files: OntologyFiles, graph: Graph, node: Node) -> str:
    return described(graph, node) or files.files[-1].iri


class _Asserted:
    """The classes that individuals belong to, without inference from what they are used as."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._known: dict[Node, frozenset[Node]] = {}
        self._classes: dict[Node, frozenset[Node]] = {}

    def belongs(self, individual: Node, kind: Node) -> bool:
        """Whether an individual is of a class or union; true where that cannot be told without a reasoner."""
        if kind == OWL.Thing:
            return True
        if isinstance(kind, BNode):
            union = self._graph.value(kind, OWL.unionOf)
            return union is None or any(self.belongs(individual, part) for part in Collection(self._graph, union))
        if individual not in self._classes:
            types = set(self._graph.objects(individual, RDF.type)) - {OWL.NamedIndividual, OWL.Thing}
            self._classes[individual] = frozenset[Node]().union(*map(self._above, types))
        # Of what has no class at all, that is said (KB017).
        return not self._classes[individual] or kind in self._classes[individual]

    def name(self, kind: Node) -> str:
        """A class, or the classes of a union, for people."""
        union = self._graph.value(kind, OWL.unionOf)
        if union is None:
            return local_name(str(kind))
        return " or ".join(sorted(self.name(part) for part in Collection(self._graph, union)))

    def _above(self, kind: Node) -> frozenset[Node]:
        """All classes above a class, itself included."""
        if kind not in self._known:
            reached, todo = {kind}, [kind]
            for node in todo:
                parts = self._graph.value(node, OWL.intersectionOf)
                up = [*self._graph.objects(node, RDFS.subClassOf), *self._graph.objects(node, OWL.equivalentClass)]
                up += [*self._graph.subjects(OWL.equivalentClass, node)]
                up += [*Collection(self._graph, parts)] if parts is not None else []
                todo += [n for n in up if n not in reached]
                reached.update(up)
            self._known[kind] = frozenset(reached)
        return self._known[kind]


def _classless(files: OntologyFiles, graph: Graph, individuals: set[URIRef]) -> Iterator[Problem]:
    for individual in sorted(individuals):
        if set(graph.objects(individual, RDF.type)) <= {OWL.NamedIndividual, OWL.Thing}:
            yield files.problem("KB017", str(individual), "has no class; say what it is, in Protégé below Types")


def _labels(files: OntologyFiles, graph: Graph) -> Iterator[Problem]:
    found: dict[tuple[URIRef, str], list[str]] = {}
    for subject, label in graph.subject_objects(RDFS.label):
        if isinstance(subject, URIRef) and isinstance(label, Literal):
            found.setdefault((subject, label.language or ""), []).append(str(label))
    for (subject, language), labels in sorted(found.items()):
        if len(labels) > 1:
            given = " and ".join(map(repr, sorted(labels)))
            told = f"has {len(labels)} labels in {f'the language {language!r}' if language else 'no language'}: {given}"
            yield warn(files.problem("KB018", str(subject), f"{told}; keep one"))


def _deprecated(files: OntologyFiles, graph: Graph) -> Iterator[Problem]:
    told_true = {s for s, v in graph.subject_objects(OWL.deprecated) if isinstance(v, Literal) and v.value is True}
    deprecated = told_true.union(*(graph.subjects(RDF.type, t) for t in (OWL.DeprecatedClass, OWL.DeprecatedProperty)))
    if not deprecated:
        return
    successor = URIRef(CORE + Property.REPLACED_BY)
    used: set[tuple[str, Node]] = set()
    for subject, predicate, value in graph:
        if subject in deprecated or predicate == successor:
            continue
        used |= {(_owner(files, graph, subject), term) for term in (predicate, value) if term in deprecated}
    for user, term in sorted(used):
        better = graph.value(term, successor)
        advice = f"use {local_name(str(better))} instead" if better else "its comment may say what to use instead"
        yield warn(files.problem("KB013", user, f"uses {local_name(str(term))}, which is deprecated; {advice}"))
