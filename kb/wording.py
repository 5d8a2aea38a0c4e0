"""Conditions and signatures of processes as people read them: `isEmpty(drink) and locatedAt(drink) = location`."""

from __future__ import annotations

from collections.abc import Mapping

from kb.processes import Parameter, Process
from kb.swrl import Atom, BuiltInAtom, ClassAtom, PropertyAtom, Rule, SameAtom
from kb.terms import Struct, Term, Var

_COMPARISONS = {"less": "<", "at_most": "≤", "more": ">", "at_least": "≥", "equal": "="}
_SUMS = {"plus": "+", "minus": "-", "times": "*"}


def condition_text(condition: Term, names: Mapping[str, str] | None = None) -> str:
    """A condition (planner/golog/syntax.pl) in one line.

    Args:
        names: What to write for a variable or datum, by its name; the name itself where there is nothing.
    """
    told = names or {}

    def text(part: Term) -> str:
        return condition_text(part, told)

    def joined(parts: list[Term], word: str) -> str:
        return f" {word} ".join(f"({text(p)})" if _is_joined(p) and len(parts) > 1 else text(p) for p in parts)

    match condition:
        case Struct("all", (list(parts),)):
            return joined(parts, "and") or "true"
        case Struct("any", (list(parts),)):
            return joined(parts, "or") or "false"
        case Struct("not", (part,)):
            return f"not ({text(part)})" if _is_joined(part) else f"not {text(part)}"
        case Struct("holds", (str(prop), subject, True)):
            return f"{prop}({text(subject)})"
        case Struct("holds", (str(prop), subject, False)):
            return f"not {prop}({text(subject)})"
        case Struct("holds", (str(prop), subject, value)):
            return f"{prop}({text(subject)}) = {text(value)}"
        case Struct("compare", (str(comparison), left, right)):
            return f"{text(left)} {_COMPARISONS.get(comparison, comparison.replace('_', ' '))} {text(right)}"
        case Struct("value", (str(prop), subject)):
            return f"{prop}({text(subject)})"
        case Struct("is_true", (place,)):
            return text(place)
        case Struct("is_a", (thing, str(kind))):
            return f"{text(thing)} is a {kind}"
        case Struct("same", (left, right)):
            return f"{text(left)} = {text(right)}"
        case Struct("plus" | "minus" | "times" as sum_, (left, right)):
            return f"({text(left)} {_SUMS[sum_]} {text(right)})"
        case Struct("some", (list(variables), part)):
            listed = ", ".join(text(v) for v in variables)
            return f"{text(part)} for some {listed}"
        case Struct("-", (Var(name), str(kind))):
            return f"{told.get(name, name)}: {kind}"
        case Struct("loc", (_, str(name))) | Var(name):
            return told.get(name, name)
        case Struct(functor, arguments):
            return f"{functor}({', '.join(map(text, arguments))})"
        case list():
            return f"[{', '.join(map(text, condition))}]"
        case bool():
            return "true" if condition else "false"
        case float():
            return f"{condition:g}"
        case int():
            return str(condition)
        case str():
            return condition


def variable_names(process: Process) -> dict[str, str]:
    """The names of parameters by the names of their variables, for `condition_text`."""
    return {p.name[0].upper() + p.name[1:]: p.name for p in process.parameters}


def signature(process: Process) -> str:
    """What a process takes and gives: `SearchDrink(robot: Robot, ...) → position: ObjectPosition`."""
    given = f"{process.name}({', '.join(map(typed, process.inputs))})"
    return f"{given} → {', '.join(map(typed, process.outputs))}" if process.outputs else given


def typed(parameter: Parameter) -> str:
    """A parameter with its class: `robot: Robot`."""
    return f"{parameter.name}: {parameter.kind}"


def _is_joined(condition: Term) -> bool:
    match condition:
        case Struct("all" | "any", (list(parts),)):
            return len(parts) > 1
        case Struct("some"):
            return True
        case _:
            return False


def rule_text(rule: Rule) -> str:
    """A rule as Protégé shows it: `Location(?l) ^ inArea(?l, ?a) -> satisfied(C, true)`."""
    return f"{' ^ '.join(map(_atom_text, rule.body))} -> satisfied({rule.condition}, true)"


def _atom_text(atom: Atom) -> str:
    match atom:
        case ClassAtom():
            return f"{atom.kind}({_argument(atom.individual)})"
        case PropertyAtom():
            return f"{atom.prop}({_argument(atom.subject)}, {_argument(atom.value)})"
        case SameAtom():
            return f"{'sameAs' if atom.wanted else 'differentFrom'}({_argument(atom.one)}, {_argument(atom.other)})"
        case BuiltInAtom():
            return f"{atom.name}({', '.join(map(_argument, atom.arguments))})"


def _argument(term: Term) -> str:
    return f"?{term.name}" if isinstance(term, Var) else condition_text(term)
