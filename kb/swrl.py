"""Rules in SWRL that say when a condition holds, as Protégé writes them.

A rule whose head is `satisfied(C, true)`, C being a RuleCondition, defines C by its body; several rules for one C
are alternatives. kb/conditions.py makes a condition of them. Rules that are switched off
(`swrla:isRuleEnabled false`) count for nothing; rules with any other head are refused: what they conclude would
have to be derived anew after each step of each plan that is thought of.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from typing import TypeAlias
from xml.sax.saxutils import escape

from rdflib import OWL, RDF, RDFS, BNode, Graph, Literal, Namespace, URIRef
from rdflib.term import Node

from kb.files import local_name
from kb.ontology import Ontology
from kb.problems import Problem
from kb.terms import Term, Var
from kb.vocabulary import CORE, Kind, Property

SWRL = Namespace("http://www.w3.org/2003/11/swrl#")
_BUILT_IN = "http://www.w3.org/2003/11/swrlb#"
_ENABLED = URIRef("http://swrl.stanford.edu/ontologies/3.3/swrla.owl#isRuleEnabled")

COMPARISONS = ("equal", "notEqual", "lessThan", "lessThanOrEqual", "greaterThan", "greaterThanOrEqual")
"""Built-ins with two arguments, which are compared."""

ARITHMETIC = ("add", "subtract", "multiply")
"""Built-ins whose first argument is what the others come to."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassAtom:
    """An individual belongs to a class."""

    kind: str
    individual: Term


@dataclass(frozen=True, slots=True, kw_only=True)
class PropertyAtom:
    """A property has a value.

    Attributes:
        of_data: The value is a literal, or a variable for one.
    """

    prop: str
    subject: Term
    value: Term
    of_data: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SameAtom:
    """Two individuals are one, or are not."""

    one: Term
    other: Term
    wanted: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class BuiltInAtom:
    """One of COMPARISONS or ARITHMETIC holds of its arguments."""

    name: str
    arguments: tuple[Term, ...]


Atom: TypeAlias = ClassAtom | PropertyAtom | SameAtom | BuiltInAtom


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """A way in which a condition may hold.

    Attributes:
        name: What the rule is called, for people; may be empty.
        condition: The RuleCondition that it defines.
        body: All have to hold. Variables are `Var` with the name that they have in the rule, whatever it is.
    """

    name: str
    condition: str
    body: tuple[Atom, ...]

    @property
    def called(self) -> str:
        """What messages call it."""
        return f"its rule {self.name!r}" if self.name else "its rule"


@dataclass(frozen=True, slots=True, kw_only=True)
class Rules:
    """All rules of an ontology.

    Attributes:
        of: The rules of each RuleCondition, by its name, in order.
        problems: What is wrong with rules, and RuleConditions without any.
    """

    of: Mapping[str, tuple[Rule, ...]]
    problems: tuple[Problem, ...]


class _Unreadable(Exception):
    """What a condition cannot say, or is not whole; the text continues "the rule ..."."""


def variables(body: tuple[Atom, ...]) -> list[str]:
    """The names of the variables of a rule's body, in order of appearance."""
    found: dict[str, None] = {}
    for atom in body:
        found.update((term.name, None) for term in _terms(atom) if isinstance(term, Var))
    return list(found)


def _terms(atom: Atom) -> tuple[Term, ...]:
    match atom:
        case ClassAtom(individual=individual):
            return (individual,)
        case PropertyAtom(subject=subject, value=value):
            return subject, value
        case SameAtom(one=one, other=other):
            return one, other
        case BuiltInAtom(arguments=arguments):
            return arguments


def read_rules(ontology: Ontology) -> Rules:
    """The rules of an ontology that are switched on."""
    return _Reading(ontology).rules()


class _Reading:
    def __init__(self, ontology: Ontology) -> None:
        self._ontology = ontology
        self._graph: Graph = ontology.graph
        self._problems: list[Problem] = []

    def rules(self) -> Rules:
        found: dict[str, list[Rule]] = {}
        spoilt: set[str] = set()
        switched_off: set[str] = set()
        for rule in self._graph.subjects(RDF.type, SWRL.Imp):
            conditions = self._conditions(rule)
            enabled = self._graph.value(rule, _ENABLED)
            if isinstance(enabled, Literal) and enabled.value is False:
                switched_off |= conditions
                continue
            if not conditions:
                self._refuse_head(rule)
                continue
            try:
                body = tuple(atom for node in self._listed(rule, SWRL.body) if (atom := self._atom(node)) is not None)
            except _Unreadable as unreadable:
                spoilt |= conditions
                for condition in conditions:
                    called = Rule(name=self._label(rule), condition=condition, body=()).called
                    self._problem("KB203", condition, f"{called} {unreadable}")
                continue
            for condition in conditions:
                name = self._label(rule)
                found.setdefault(condition, []).append(Rule(name=name, condition=condition, body=body))
        for condition in self._ontology.individuals(Kind.RULE_CONDITION):
            if condition not in found and condition not in spoilt:
                why = "its rule is switched off" if condition in switched_off else "no rule says when it is satisfied"
                told = f"{why}; write one with the head satisfied({condition}, true)"
                self._problem("KB206", condition, told)
        ordered = {condition: tuple(sorted(rules, key=repr)) for condition, rules in sorted(found.items())}
        return Rules(of=ordered, problems=tuple(self._problems))

    # The head

    def _conditions(self, rule: Node) -> set[str]:
        """The RuleConditions that a rule defines; none if its head says anything else."""
        try:
            conditions = [self._defined(node) for node in self._listed(rule, SWRL.head)]
        except _Unreadable:
            return set()
        return {c for c in conditions if c is not None} if None not in conditions else set()

    def _defined(self, node: Node) -> str | None:
        condition = self._graph.value(node, SWRL.argument1)
        value = self._graph.value(node, SWRL.argument2)
        if self._graph.value(node, SWRL.propertyPredicate) != URIRef(CORE + Property.SATISFIED):
            return None
        name = local_name(str(condition))
        if not self._ontology.is_a(name, Kind.RULE_CONDITION):
            return None
        return name if isinstance(value, Literal) and value.value is True else None

    def _refuse_head(self, rule: Node) -> None:
        told = (
            "concludes something else than satisfied(C, true), C being a RuleCondition; let its conclusion be that, "
            "write the knowledge as axioms of classes and properties, or switch the rule off (isRuleEnabled false)"
        )
        file = next((f for f in self._ontology.files.files if (rule, RDF.type, SWRL.Imp) in f.graph), None)
        label = self._label(rule)
        if isinstance(rule, URIRef) or file is None:
            self._problems.append(self._ontology.files.problem("KB207", str(rule), f"this rule {told}"))
            return
        lines = file.content.decode("utf-8", errors="replace").splitlines()
        line = next((n for n, text in enumerate(lines, start=1) if label and f">{escape(label)}<" in text), 0)
        self._problems.append(
            Problem(code="KB207", file=file.path, line=line, entity=label, message=f"this rule {told}")
        )

    # The body

    def _listed(self, rule: Node, prop: URIRef) -> list[Node]:
        """The atoms of a rule's head or body, or the arguments of a built-in."""
        items: list[Node] = []
        passed: set[Node] = set()
        part = self._graph.value(rule, prop)
        while part is not None and part != RDF.nil:
            item = self._graph.value(part, RDF.first)
            if part in passed or item is None:
                raise _Unreadable("is not whole: write it again in Protégé")
            passed.add(part)
            items.append(item)
            part = self._graph.value(part, RDF.rest)
        if part is None:
            raise _Unreadable("is not whole: write it again in Protégé")
        return items

    def _atom(self, node: Node) -> Atom | None:
        """An atom; None for one that says nothing."""
        kinds = set(self._graph.objects(node, RDF.type))
        if SWRL.ClassAtom in kinds:
            kind = self._named(node, SWRL.classPredicate, "a class expression; name the class (EquivalentTo)")
            individual = self._argument(node, SWRL.argument1)
            return None if kind == OWL.Thing else ClassAtom(kind=local_name(str(kind)), individual=individual)
        if SWRL.IndividualPropertyAtom in kinds or SWRL.DatavaluedPropertyAtom in kinds:
            prop = self._named(node, SWRL.propertyPredicate, "an inverse property; exchange subject and value")
            if prop == URIRef(CORE + Property.SATISFIED):
                raise _Unreadable("asks for another condition; join conditions with AllOf, AnyOf and Not")
            return PropertyAtom(
                prop=local_name(str(prop)),
                subject=self._argument(node, SWRL.argument1),
                value=self._argument(node, SWRL.argument2),
                of_data=SWRL.DatavaluedPropertyAtom in kinds,
            )
        if SWRL.SameIndividualAtom in kinds or SWRL.DifferentIndividualsAtom in kinds:
            return SameAtom(
                one=self._argument(node, SWRL.argument1),
                other=self._argument(node, SWRL.argument2),
                wanted=SWRL.SameIndividualAtom in kinds,
            )
        if SWRL.BuiltinAtom in kinds:
            return self._built_in(node)
        if SWRL.DataRangeAtom in kinds:
            raise _Unreadable("asks for a data range; compare the value instead")
        raise _Unreadable("has an atom of no kind that we know")

    def _built_in(self, node: Node) -> BuiltInAtom:
        iri = str(self._graph.value(node, SWRL.builtin))
        name = iri.removeprefix(_BUILT_IN)
        if name not in (*COMPARISONS, *ARITHMETIC):
            known = ", ".join((*COMPARISONS, *ARITHMETIC))
            raise _Unreadable(f"uses the built-in {name}; those that work are {known}")
        arguments = tuple(self._term(a) for a in self._listed(node, SWRL.arguments))
        takes = "two" if name in COMPARISONS else "three" if name == "subtract" else "three or more"
        fits = {"two": len(arguments) == 2, "three": len(arguments) == 3, "three or more": len(arguments) > 2}
        if not fits[takes]:
            raise _Unreadable(f"gives {name} {len(arguments)} arguments; it takes {takes}")
        return BuiltInAtom(name=name, arguments=arguments)

    def _named(self, node: Node, prop: URIRef, otherwise: str) -> URIRef:
        value = self._graph.value(node, prop)
        if isinstance(value, URIRef):
            return value
        if isinstance(value, BNode):
            raise _Unreadable(f"asks for {otherwise}")
        raise _Unreadable("is not whole: write it again in Protégé")

    def _argument(self, node: Node, prop: URIRef) -> Term:
        value = self._graph.value(node, prop)
        if value is None:
            raise _Unreadable("is not whole: write it again in Protégé")
        return self._term(value)

    def _term(self, node: Node) -> Term:
        """A variable, an individual or a literal."""
        if isinstance(node, Literal):
            value = node.value
            if isinstance(value, Decimal):
                value = float(value)
            if isinstance(value, float) and not math.isfinite(value):
                raise _Unreadable(f"has the number {node}, which is none")
            return value if isinstance(value, bool | int | float) else str(node)
        if (node, RDF.type, SWRL.Variable) in self._graph:
            return Var(local_name(str(node)).rsplit(":", 1)[-1])
        return local_name(str(node))

    # Messages

    def _label(self, rule: Node) -> str:
        return str(self._graph.value(rule, RDFS.label) or "")

    def _problem(self, code: str, entity: str, message: str) -> None:
        self._problems.append(self._ontology.problem(code, entity, message))
