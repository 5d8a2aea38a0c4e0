"""What a RuleCondition asks for, read from its rules for the checker of plans.

A reading of its own: it shares no code with kb/conditions.py, which tells the same to the planner. Here every
variable of a rule that is no parameter is one of `some`, without a class; Knowledge finds what it may be.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from kb.swrl import ARITHMETIC, Atom, BuiltInAtom, ClassAtom, PropertyAtom, Rule, SameAtom, variables
from kb.terms import Struct, Term, Var

_WORDS = {
    "lessThan": "less",
    "lessThanOrEqual": "at_most",
    "greaterThan": "more",
    "greaterThanOrEqual": "at_least",
    "add": "plus",
    "subtract": "minus",
    "multiply": "times",
}


def satisfied(rules: Collection[Rule], parameters: Collection[str]) -> Term:
    """The condition that rules define, as planner/golog/syntax.pl has it; variables are named as in the rules.

    Args:
        parameters: Names of those of the process that asks.
    """
    return Struct("any", ([_body(rule, parameters) for rule in rules],))


def _body(rule: Rule, parameters: Collection[str]) -> Term:
    own = [name for name in variables(rule.body) if name not in parameters]
    drawn = {t.name for atom in rule.body for t in _who(atom) if isinstance(t, Var)}
    sums: dict[str, Term] = {}
    parts: list[Term] = []
    for atom in _sums_first(rule.body, own, drawn, sums):
        parts += _parts(atom, sums)
    numbers: list[Term] = [
        Var(name) for name in sorted({_number_name(atom) for atom in rule.body if _has_number(atom)})
    ]
    over = [*(Var(name) for name in own if name not in sums), *numbers]
    body = Struct("all", (parts,))
    return Struct("some", (over, body)) if over else body


def _who(atom: Atom) -> tuple[Term, ...]:
    """What a class or property is said of, and its value."""
    match atom:
        case ClassAtom(individual=individual):
            return (individual,)
        case PropertyAtom(subject=subject, value=value):
            return subject, value
        case _:
            return ()


def _sums_first(body: tuple[Atom, ...], own: list[str], drawn: set[str], sums: dict[str, Term]) -> Iterator[Atom]:
    """The atoms that are left when those that only say what a variable comes to are put into `sums`."""
    left = list(body)
    while True:
        unknown = {name for name in own if name not in drawn and name not in sums}
        saying = next((a for a in left if _says(a, unknown)), None)
        if saying is None:
            yield from left
            return
        assert isinstance(saying, BuiltInAtom)
        assert isinstance(saying.arguments[0], Var)
        sums[saying.arguments[0].name] = _sum(saying, sums)
        left.remove(saying)


def _says(atom: Atom, unknown: set[str]) -> bool:
    if not isinstance(atom, BuiltInAtom) or atom.name not in ARITHMETIC:
        return False
    result, *rest = atom.arguments
    known = not any(isinstance(term, Var) and term.name in unknown for term in rest)
    return known and isinstance(result, Var) and result.name in unknown


def _sum(atom: BuiltInAtom, sums: Mapping[str, Term]) -> Term:
    total, *rest = (_put(term, sums) for term in atom.arguments[1:])
    for term in rest:
        total = Struct(_WORDS[atom.name], (total, term))
    return total


def _put(term: Term, sums: Mapping[str, Term]) -> Term:
    return sums.get(term.name, term) if isinstance(term, Var) else term


def _parts(atom: Atom, sums: Mapping[str, Term]) -> list[Term]:
    match atom:
        case ClassAtom(kind=kind, individual=individual):
            return [Struct("is_a", (individual, kind))]
        case PropertyAtom(prop=prop, subject=subject, value=value) if _has_number(atom):
            number = Var(_number_name(atom))
            return [Struct("holds", (prop, subject, number)), Struct("compare", ("equal", number, value))]
        case PropertyAtom(prop=prop, subject=subject, value=value):
            return [Struct("holds", (prop, subject, value))]
        case SameAtom(one=one, other=other, wanted=wanted):
            same = Struct("same", (one, other))
            return [same if wanted else Struct("not", (same,))]
        case BuiltInAtom(name=word) if word in ARITHMETIC:
            return [Struct("compare", ("equal", _put(atom.arguments[0], sums), _sum(atom, sums)))]
        case BuiltInAtom(name=word, arguments=arguments):
            one, other = (_put(term, sums) for term in arguments)
            if word in _WORDS:
                return [Struct("compare", (_WORDS[word], one, other))]
            alike: list[Term] = [Struct("same", (one, other)), Struct("compare", ("equal", one, other))]
            equal = Struct("any", (alike,))
            return [equal if word == "equal" else Struct("not", (equal,))]


def _has_number(atom: Atom) -> bool:
    value = atom.value if isinstance(atom, PropertyAtom) else None
    return isinstance(value, int | float) and not isinstance(value, bool)


def _number_name(atom: Atom) -> str:
    """A variable for the number that a property is said to have; with a blank, which no other variable has."""
    assert isinstance(atom, PropertyAtom)
    return f"{atom.prop} {atom.subject} {atom.value}"
