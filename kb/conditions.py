"""Conditions -> Golog terms: condition individuals, and the rules of RuleConditions.

    AllOf all([C, ...])   AnyOf any([C, ...])   Not not(C)   Holds holds(Property, Subject, Value)
    Compare compare(Op, A, B)   IsTrue is_true(loc(Frame, Name))

A rule says what there has to be. Its variables that are named like parameters of the process are those parameters;
for the others there is `some([Variable-Class, ...], C)`:

    C(?x)  is_a(X, C), or the class of a variable of some (else the domain or range of a property that has it)
    p(?x, ?y)  holds(p, X, Y)
    sameAs(?x, ?y)  same(X, Y)     differentFrom(?x, ?y)  not(same(X, Y))
    lessThan(?a, ?b) and so on  compare(less, A, B)     add(?c, ?a, ?b) and so on  plus(A, B) wherever ?c stands

Several rules are alternatives: any([C, ...]). The world is closed, and all is asked of the situation, so that effects
change it.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce

from rdflib import OWL, RDF, RDFS, URIRef

from kb.files import local_name
from kb.ontology import Ontology
from kb.problems import Severity
from kb.scope import Reader, Scope
from kb.swrl import (
    ARITHMETIC,
    Atom,
    BuiltInAtom,
    ClassAtom,
    PropertyAtom,
    Rule,
    SameAtom,
    read_rules,
    variables,
)
from kb.terms import Struct, Term, Var, struct
from kb.vocabulary import Kind, Property

_ORDERINGS = {
    "lessThan": "less",
    "lessThanOrEqual": "at_most",
    "greaterThan": "more",
    "greaterThanOrEqual": "at_least",
}
_SUMS = {"add": "plus", "subtract": "minus", "multiply": "times"}
_NEAR = 0.75
"""How alike two names are that may be meant to be one; 1 is the same."""


class Conditions:
    """Makes the terms of the conditions of one ontology."""

    def __init__(self, reader: Reader, ontology: Ontology) -> None:
        """Read the rules.

        Args:
            reader: Gathers what is wrong.
        """
        self._reader = reader
        self._ontology = ontology
        rules = read_rules(ontology)
        reader.problems += rules.problems
        self._rules = rules.of
        self._functional = {local_name(str(p)) for p in ontology.graph.subjects(RDF.type, OWL.FunctionalProperty)}
        self._ends = _Ends(self._classes(RDFS.domain), self._classes(RDFS.range))
        self._kinds: set[str] = set()
        self._properties: set[str] = set()

    def term(self, scope: Scope, entity: str) -> Term:
        """A condition as the process of `scope` asks for it."""

        def operands() -> list[Term]:
            return [self.term(scope, o) for o in self._reader.parts(entity, Property.OPERAND)]

        if self._ontology.is_a(entity, Kind.ALL_OF):
            return struct("all", operands())
        if self._ontology.is_a(entity, Kind.ANY_OF):
            return struct("any", operands())
        if self._ontology.is_a(entity, Kind.NOT):
            return struct("not", operands()[0])
        if self._ontology.is_a(entity, Kind.HOLDS):
            prop = self._reader.part(entity, Property.OF_PROPERTY)
            return struct("holds", prop, scope.subject(entity), scope.object(entity))
        if self._ontology.is_a(entity, Kind.COMPARE):
            return self._comparison(scope, entity)
        if self._ontology.is_a(entity, Kind.RULE_CONDITION):
            bodies = [self._body(scope, entity, rule) for rule in self._rules.get(entity, ())]
            return bodies[0] if len(bodies) == 1 else struct("any", list(bodies))
        return struct("is_true", scope.term(self._reader.part(entity, Property.OF_TRUTH_VALUE), entity))

    def asked_of(self, individual: str) -> bool:
        """Whether a rule may ask something of an individual; after all terms have been made."""
        if self._ontology.kinds.get(individual, frozenset()) & self._kinds:
            return True
        return any(self._ontology.values(prop, individual) for prop in self._properties)

    def _classes(self, end: URIRef) -> dict[str, str]:
        """The class of the subjects or values of each property that has one, messages left out."""
        graph, found = self._ontology.graph, dict[str, str]()
        for prop in set(graph.subjects(end)):
            kinds = [local_name(str(kind)) for kind in graph.objects(prop, end) if isinstance(kind, URIRef)]
            if len(kinds) == 1 and kinds[0] in self._ontology.superclasses and not self._ontology.is_datum(kinds[0]):
                found[local_name(str(prop))] = kinds[0]
        return found

    def _comparison(self, scope: Scope, entity: str) -> Term:
        comparison = self._reader.part(entity, Property.COMPARISON).replace(" ", "_")
        left = struct("value", self._reader.part(entity, Property.OF_PROPERTY), scope.subject(entity))
        right = scope.object(entity)
        if self._ontology.value(Property.OBJECT_PROPERTY, entity) is not None:
            right = struct("value", self._reader.part(entity, Property.OBJECT_PROPERTY), right)
        return struct("compare", comparison, left, right)

    # Rules

    def _body(self, scope: Scope, entity: str, rule: Rule) -> Term:
        """The body of a rule, its own variables bound by `some`."""
        own = self._own_variables(scope, entity, rule)
        terms = {name: Var(f"_{number}_{_safe(name)}") for number, name in enumerate(own, start=1)}
        given: dict[str, Term] = {}
        for parameter in scope.process.parameters:
            if parameter.name in variables(rule.body):
                given[parameter.name] = scope.term(parameter.entity, entity)
                if parameter.is_datum:
                    told = f"asks for {parameter.name!r}, a message that only acting makes; ask for it by IsTrue"
                    self._reader.problem("KB203", entity, f"{rule.called} {told}")
        reading = _Body(rule, given, dict(terms), self._functional, self._ends)
        lacking = [name for name in own if name not in reading.drawn]
        for name in lacking:
            told = f"{rule.called} has ?{name}, which no atom gives a value: {self._hint(scope, rule, name)}"
            self._reader.problem("KB204", entity, told)
        if lacking:
            return struct("all", [])
        self._kinds |= {a.kind for a in rule.body if isinstance(a, ClassAtom)}
        properties = {a.prop for a in rule.body if isinstance(a, PropertyAtom)}
        self._properties |= properties
        self._kinds |= {ends[p] for ends in (self._ends.domains, self._ends.ranges) for p in properties & ends.keys()}
        return reading.term()

    def _own_variables(self, scope: Scope, entity: str, rule: Rule) -> list[str]:
        """The variables of a rule that are no parameters; warns of those that are meant to be."""
        names = [p.name for p in scope.process.parameters]
        speakable = [p.name for p in scope.process.parameters if not p.is_datum]
        used = variables(rule.body)
        own = [name for name in used if name not in names]
        warned = False
        for name in own:
            near = difflib.get_close_matches(name, [n for n in speakable if n not in used], n=1, cutoff=_NEAR)
            if near:
                warned = True
                told = (
                    f"{rule.called} has ?{name}, which is no parameter of {scope.process.name} and so may be "
                    f"anything; did you mean ?{near[0]}?"
                )
                self._reader.problem("KB205", entity, told, Severity.WARNING)
        if speakable and len(own) == len(used) and not warned:
            told = (
                f"{rule.called} has no variable named like a parameter of {scope.process.name}, and so asks "
                f"the same whatever that is given; its parameters are {', '.join(f'?{n}' for n in speakable)}"
            )
            self._reader.problem("KB205", entity, told, Severity.WARNING)
        return own

    def _hint(self, scope: Scope, rule: Rule, name: str) -> str:
        names = [p.name for p in scope.process.parameters if p.name not in variables(rule.body)]
        near = difflib.get_close_matches(name, names, n=1, cutoff=_NEAR)
        if near:
            return f"did you mean ?{near[0]}?"
        return f"add a class atom such as Location(?{name}), or a property atom that has it"


@dataclass(frozen=True, slots=True)
class _Ends:
    """What the ontology says of the subjects and values of properties: their classes, by name of the property."""

    domains: Mapping[str, str]
    ranges: Mapping[str, str]


class _Body:
    """One body of a rule, with terms for its variables.

    Attributes:
        drawn: The variables that an atom, or a sum of such, gives a value.
    """

    def __init__(
        self, rule: Rule, given: dict[str, Term], own: dict[str, Var], functional: set[str], ends: _Ends
    ) -> None:
        self._own = own
        self._ends = ends
        self._functional = functional
        self._atoms: Sequence[Atom] = rule.body
        self._atoms = [part for atom in rule.body for part in self._numbers_apart(atom)]
        self._terms: dict[str, Term] = {**own, **given}
        self._passed: set[int] = set()
        """Atoms, by number, that are in the terms of variables already."""
        self.drawn = self._drawn_by_atoms()
        self._define_sums()
        self._put_in_values()

    def term(self) -> Term:
        """The condition."""
        stated, kinds = self._kinds()
        parts: list[Term] = []
        for number, atom in enumerate(self._atoms):
            match atom:
                case ClassAtom(kind=kind, individual=Var(name)) if stated.get(name) == kind:
                    continue
                case _ if number not in self._passed:
                    parts += self._condition(atom)
                case _:
                    pass
        left = [name for name, var in self._own.items() if self._terms[name] == var]
        body = parts[0] if len(parts) == 1 else struct("all", parts)
        if not left:
            return body
        over: list[Term] = [
            struct("-", self._own[name], kinds[name]) if name in kinds else self._own[name] for name in left
        ]
        return struct("some", over, body)

    def _kinds(self) -> tuple[dict[str, str], dict[str, str]]:
        """The classes of the rule's own variables: the first that it states; those that its properties tell, too."""
        stated: dict[str, str] = {}
        told: dict[str, str] = {}
        for atom in self._atoms:
            match atom:
                case ClassAtom(kind=kind, individual=Var(name)) if name in self._own:
                    stated.setdefault(name, kind)
                case PropertyAtom(prop=prop, subject=subject, value=value, of_data=of_data):
                    for name in _names(subject) & self._own.keys() if prop in self._ends.domains else ():
                        told.setdefault(name, self._ends.domains[prop])
                    for name in _names(value) & self._own.keys() if prop in self._ends.ranges and not of_data else ():
                        told.setdefault(name, self._ends.ranges[prop])
                case _:
                    pass
        return stated, {**told, **stated}

    def _numbers_apart(self, atom: Atom) -> list[Atom]:
        """A property that has a number, where it also says of whom: the number is compared, 1 being 1.0."""
        match atom:
            case PropertyAtom(subject=subject, value=int() | float() as value) if not isinstance(
                value, bool
            ) and not self._is_known(subject):
                name = f" {len(self._own)}"  # with a blank, which no variable of a rule has
                self._own[name] = Var(f"_{len(self._own) + 1}_")
                return [replace(atom, value=Var(name)), BuiltInAtom(name="equal", arguments=(Var(name), value))]
            case _:
                return [atom]

    def _of(self, term: Term) -> Term:
        return self._terms[term.name] if isinstance(term, Var) else term

    def _drawn_by_atoms(self) -> set[str]:
        found: set[str] = set()
        for atom in self._atoms:
            match atom:
                case ClassAtom(individual=individual):
                    found |= _names(individual)
                case PropertyAtom(subject=subject, value=value):
                    found |= _names(subject) | _names(value)
                case _:
                    pass
        return found

    def _define_sums(self) -> None:
        """A variable that only arithmetic gives a value stands for the sum; what remains is compared."""
        again = True
        while again:
            again = False
            for number, atom in enumerate(self._atoms):
                match atom:
                    case BuiltInAtom(name=word, arguments=(Var(result), *rest)) if (
                        word in ARITHMETIC
                        and result in self._own
                        and result not in self.drawn
                        and all(_names(r) <= self.drawn | (self._terms.keys() - self._own.keys()) for r in rest)
                    ):
                        self._terms[result] = self._sum(word, rest)
                        self.drawn.add(result)
                        self._passed.add(number)
                        again = True
                    case _:
                        pass

    def _sum(self, word: str, terms: list[Term]) -> Term:
        return reduce(lambda one, other: struct(_SUMS[word], one, other), [self._of(term) for term in terms])

    def _put_in_values(self) -> None:
        """A number that is only asked to be more or less than others needs no variable: it is value(P, X)."""
        for name, var in self._own.items():
            sources = [a for a in self._atoms if isinstance(a, PropertyAtom) and a.value == Var(name)]
            asked = [a for a in self._atoms if isinstance(a, BuiltInAtom) and Var(name) in a.arguments]
            if len(sources) != 1 or not asked or any(a.name not in _ORDERINGS for a in asked):
                continue
            [source] = sources
            once = sum(a.arguments.count(Var(name)) for a in asked) == 1 or source.prop in self._functional
            if self._terms[name] == var and once and self._is_known(source.subject):
                self._terms[name] = struct("value", source.prop, self._of(source.subject))
                self._passed.add(self._atoms.index(source))

    def _is_known(self, subject: Term) -> bool:
        """Whether something else than a property of it says who it is."""
        if not isinstance(subject, Var) or subject.name not in self._own:
            return True
        return any(isinstance(a, ClassAtom) and a.individual == subject for a in self._atoms)

    def _condition(self, atom: Atom) -> list[Term]:
        match atom:
            case ClassAtom(kind=kind, individual=individual):
                return [struct("is_a", self._of(individual), kind)]
            case PropertyAtom(prop=prop, subject=subject, value=bool() | str() | Var() as value):
                return [struct("holds", prop, self._of(subject), self._of(value))]
            case PropertyAtom(prop=prop, subject=subject, value=number):
                return [struct("compare", "equal", struct("value", prop, self._of(subject)), number)]
            case SameAtom(one=one, other=other, wanted=wanted):
                same = struct("same", self._of(one), self._of(other))
                return [same if wanted else struct("not", same)]
            case BuiltInAtom(name=word, arguments=arguments) if word in ARITHMETIC:
                return [struct("compare", "equal", self._of(arguments[0]), self._sum(word, list(arguments[1:])))]
            case BuiltInAtom(name=word, arguments=arguments) if word in _ORDERINGS:
                return [struct("compare", _ORDERINGS[word], self._of(arguments[0]), self._of(arguments[1]))]
            case BuiltInAtom(name=word, arguments=arguments):
                equal = _equal(self._of(arguments[0]), self._of(arguments[1]))
                return [equal if word == "equal" else struct("not", equal)]


def _equal(one: Term, other: Term) -> Term:
    """Numbers compare by what they come to, all else by being the same."""
    if any(_is_number(t) for t in (one, other)):
        return struct("compare", "equal", one, other)
    if any(isinstance(t, str | bool) for t in (one, other)):
        return struct("same", one, other)
    return struct("any", [struct("same", one, other), struct("compare", "equal", one, other)])


def _is_number(term: Term) -> bool:
    return isinstance(term, Struct) or (isinstance(term, int | float) and not isinstance(term, bool))


def _names(term: Term) -> set[str]:
    return {term.name} if isinstance(term, Var) else set()


def _safe(name: str) -> str:
    """What of a name may be part of the name of a Prolog variable."""
    return re.sub(r"[^A-Za-z0-9]", "", name)
