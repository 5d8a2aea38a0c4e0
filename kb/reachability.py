"""What compiles and can never be done, or is never used: warnings, for the files can be loaded all the same.

Like kb/soundness.py it reads what the compiler made, and warns only of what is certain: a step after something that
never ends, a branch whose condition cannot hold, a process that nothing leads to or that no robot can do, a
parameter that nothing mentions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from rdflib import OWL, RDF

from kb.contradictions import atoms, contradiction, place_of
from kb.files import local_name
from kb.ontology import Ontology, fluent_properties
from kb.problems import Problem, warn
from kb.processes import Process, Role
from kb.recursion import called
from kb.terms import Struct, Term, Var, struct
from kb.vocabulary import CORE, Kind, Property


def unreachable(ontology: Ontology, processes: Mapping[str, Process], facts: list[Term]) -> list[Problem]:
    """All warnings about processes.

    Args:
        facts: Those of kb/rules/facts.pl that processes were compiled to.
    """
    bodies: dict[str, Term] = {}
    said: dict[str, list[Term]] = {}
    requires: dict[str, list[str]] = {}
    for fact in facts:
        match fact:
            case Struct("definition", (_, Struct(name) | str(name), _, body)):
                bodies[name] = body
            case Struct("precondition" | "effect" | "claims" | "duration", (_, Struct(name) | str(name), *terms)):
                said.setdefault(name, []).extend(terms)
            case Struct("requires", (_, str(name), str(capability))):
                requires.setdefault(name, []).append(capability)
            case _:
                pass
    found = [
        *_Steps(ontology, bodies).warnings(),
        *_idle(processes, bodies),
        *_unused(ontology, processes, bodies, said),
        *_beyond_robots(ontology, requires, bodies),
    ]
    return [warn(ontology.problem(code, entity, told)) for code, entity, told in found]


_Found = Iterator[tuple[str, str, str]]
"""Code, entity and message of each."""

_Never = Callable[[Term, str], None]
"""Tells that a program is never come to, and why."""


class _Steps:
    """Steps that are never come to (KB216)."""

    def __init__(self, ontology: Ontology, bodies: Mapping[str, Term]) -> None:
        self._bodies = bodies
        self._fluents = fluent_properties(ontology)
        self._functional = {local_name(str(p)) for p in ontology.graph.subjects(RDF.type, OWL.FunctionalProperty)}
        self._found: dict[str, str] = {}
        self._endless: dict[str, bool] = {}

    def warnings(self) -> _Found:
        for name in sorted(self._bodies):
            self._ends(name)
        for step, told in sorted(self._found.items()):
            yield "KB216", step, told

    def _ends(self, process: str) -> bool:
        """Whether a process may end; where it performs itself, it is taken for granted that it does."""
        if process not in self._endless:
            self._endless[process] = False
            body = self._bodies.get(process)
            self._endless[process] = body is not None and not self._walk(process, body, [])
        return not self._endless[process]

    def _walk(self, process: str, program: Term, holding: list[Term]) -> bool:
        """Go through a program before which conditions hold; whether it may end."""

        def excluded(condition: Term) -> str:
            return contradiction([*holding, condition], self._functional)

        def never(part: Term, reason: str) -> None:
            step = _first_step(part)
            if step is not None:
                self._found.setdefault(
                    step, f"is never done in {process}: {reason}; correct the condition or the order"
                )

        def branch(part: Term, condition: Term) -> bool:
            if excluding := excluded(condition):
                never(part, f"{excluding} exclude each other")
                return False
            return self._walk(process, part, [*holding, condition])

        match program:
            case list():
                return self._sequence(process, program, holding, never)
            case Struct("conc" | "pconc", (list(parts),)) | Struct("any_order", (_, _, list(parts))):
                lasting = self._lasting(holding)
                ends = [self._walk(process, part, lasting) for part in parts]
                return all(ends)
            case Struct("choice", (_, _, list(branches))):
                ends = [self._walk(process, part, holding) for part in branches]
                return any(ends)
            case Struct("if", (condition, then, otherwise)):
                return any([branch(then, condition), branch(otherwise, struct("not", condition))])
            case Struct("while", (condition, body)):
                holding = self._lasting(holding)
                branch(body, condition)
                return not excluded(struct("not", condition))
            case Struct("until", (body, condition)):
                holding = self._lasting(holding)
                return self._walk(process, body, holding) and not excluded(condition)
            case Struct("foreach", (_, _, _, condition, _, body)) | Struct("interrupt", (_, _, _, condition, body)):
                holding = self._lasting(holding)
                branch(body, condition)
                return True
            case Struct("star", (*_, body)):
                self._walk(process, body, self._lasting(holding))
                return True
            case Struct("pick" | "search" | "deadline", (*_, body)):
                return self._walk(process, body, holding)
            case Struct("test", (condition,)):
                holding = self._lasting(holding)  # it may wait
                return not excluded(condition)
            case Struct("call", (_, _, Struct(callee) | str(callee))):
                return self._ends(callee)
            case _:
                return True

    def _sequence(self, process: str, parts: list[Term], holding: list[Term], never: _Never) -> bool:
        for number, part in enumerate(parts, start=1):
            if not self._walk(process, part, holding):
                never(parts[number:], f"{_first_step(part) or 'what stands'} before it never comes to an end")
                return False
            holding = self._lasting(holding) + ([part.args[0]] if isinstance(part, Struct) and _is_test(part) else [])
        return True

    def _lasting(self, conditions: list[Term]) -> list[Term]:
        """What still holds after a step: of conditions, the parts that speak of nothing that changes."""
        return [atom for condition in conditions for atom in atoms(condition) if not self._may_change(atom)]

    def _may_change(self, condition: Term) -> bool:
        match condition:
            case Struct("holds" | "value", (str(prop), *_)):
                return prop in self._fluents
            case Struct("is_true"):
                return True
            case Struct(_, arguments):
                return any(self._may_change(a) for a in arguments)
            case list():
                return any(self._may_change(a) for a in condition)
            case _:
                return False


def _is_test(part: Struct) -> bool:
    return part.functor == "test"


def _first_step(program: Term) -> str | None:
    """The step, by name, that stands first in a program."""
    match program:
        case Struct("call", (_, str(step), _)):
            return step
        case Struct(_, arguments):
            return next((step for step in map(_first_step, arguments) if step), None)
        case list():
            return next((step for step in map(_first_step, program) if step), None)
        case _:
            return None


def _idle(processes: Mapping[str, Process], bodies: Mapping[str, Term]) -> _Found:
    """Processes that nobody can ask for, as they are given messages, and that nothing performs (KB217)."""
    todo = [name for name, process in processes.items() if not any(p.is_datum for p in process.inputs)]
    reached = set(todo)
    for name in todo:
        new = set(called(bodies.get(name, []))) - reached
        todo += sorted(new)
        reached |= new
    for name in sorted(set(processes) - reached):
        data = " and ".join(repr(p.name) for p in processes[name].inputs if p.is_datum)
        told = f"is never done: it needs {data}, which only another step can make, and nothing that can be asked for"
        yield "KB217", name, f"{told} performs it; perform it in a process, or remove it"


def _unused(
    ontology: Ontology, processes: Mapping[str, Process], bodies: Mapping[str, Term], said: Mapping[str, list[Term]]
) -> _Found:
    """Parameters that nothing mentions (KB218); outputs have a check of their own, robots are who does it."""
    mapped = {str(ontology.value(Property.MAPS_PARAMETER, f)) for f in ontology.individuals(Kind.FIELD)}
    for name, process in sorted(processes.items()):
        used = set(_names([bodies.get(name, []), *said.get(name, ())]))
        for parameter in process.parameters:
            if parameter.role in (Role.ROBOT, Role.OUTPUT) or parameter.name in used or parameter.entity in mapped:
                continue
            # Of a primitive action, the individuals are what it is about, even where its service is not told them.
            if parameter.is_datum or not process.is_atomic:
                told = f"is a parameter of {name} that nothing uses; bind or ask for it, or remove it"
                yield "KB218", parameter.entity, told


def _names(term: Term) -> Iterator[str]:
    """The names of all parameters in a term."""
    match term:
        case Var() | Struct("loc"):
            yield place_of(term)
        case Struct(_, arguments):
            for argument in arguments:
                yield from _names(argument)
        case list():
            for part in term:
                yield from _names(part)
        case _:
            pass


def _beyond_robots(ontology: Ontology, requires: Mapping[str, list[str]], bodies: Mapping[str, Term]) -> _Found:
    """Processes that no robot of the site and no class of robots can do, though one can do what it performs (KB219)."""
    robots = {robot: ontology.kinds[robot] for robot in ontology.individuals(Kind.ROBOT)}
    capabilities = {c for asked in requires.values() for c in asked}
    # A class that is a capability is what is asked for, not what could be bought.
    own_terms = {local_name(str(c)) for c in ontology.graph.subjects(RDF.type, OWL.Class) if str(c).startswith(CORE)}
    models = {
        kind: above
        for kind, above in ontology.superclasses.items()
        if Kind.ROBOT in above and kind != Kind.ROBOT and kind not in capabilities and kind not in own_terms
    }
    beyond = {
        name for name, asked in requires.items() if not any(o.issuperset(asked) for o in (robots | models).values())
    }
    for name in sorted(beyond):
        if beyond.intersection(set(called(bodies.get(name, []))) - {name}):
            continue
        asked = requires[name]
        lacking = "; ".join(
            f"{who} is no {' and no '.join(_shown(ontology, c) for c in asked if c not in own)}"
            for who, own in sorted((robots or models).items())
        )
        told = f"can be done by no robot: {lacking or 'there is none'}"
        yield "KB219", name, f"{told}; equip one, or correct requiresCapability"


def _shown(ontology: Ontology, capability: str) -> str:
    definition = ontology.definition(capability)
    return f"{capability} ({definition})" if definition else capability
