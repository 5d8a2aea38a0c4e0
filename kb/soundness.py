"""What compiles and yet cannot be right: loops without end, contradictions, data that nothing has made.

Only what is certain is refused: a loop whose test nothing can change, or whose turn may take no time; a
process whose preconditions exclude each other; a step that reads a datum which no step can have written
before. The checks read the terms of kb/constructs.py, and name the construct, step or process they came from.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rdflib import OWL, RDF

from kb.constructs import Constructs
from kb.contradictions import contradiction, place_of
from kb.files import local_name
from kb.ontology import Ontology, fluent_properties
from kb.processes import Parameter, Process, Role
from kb.recursion import least, may_be_stepless, stepless
from kb.terms import Struct, Term, Var
from kb.vocabulary import Kind, Property


def refuse_unsound(
    ontology: Ontology,
    processes: Mapping[str, Process],
    bodies: Mapping[str, Term],
    preconditions: Mapping[str, list[Term]],
    constructs: Constructs,
) -> None:
    """Add what is wrong to the problems of `constructs`.

    Args:
        bodies: The program of each process that has one, by name.
        preconditions: All that must hold so that a process can start, by its name.
    """
    loops = _Loops(ontology, processes, bodies, constructs)
    data = _Data(ontology, processes, bodies, constructs)
    for name, body in sorted(bodies.items()):
        loops.check(name, body)
        data.check(name, body)
    functional = {local_name(str(p)) for p in ontology.graph.subjects(RDF.type, OWL.FunctionalProperty)}
    for name, conditions in sorted(preconditions.items()):
        excluding = contradiction(conditions, functional)
        if excluding:
            told = f"can never start: its preconditions {excluding} exclude each other; correct one"
            constructs.problem("KB214", name, told)


class _Loops:
    """Loops and interrupts: can their test change, and does every turn take a step?"""

    def __init__(
        self,
        ontology: Ontology,
        processes: Mapping[str, Process],
        bodies: Mapping[str, Term],
        constructs: Constructs,
    ) -> None:
        self._processes = processes
        self._constructs = constructs
        several = {n: b for n, b in bodies.items() if ontology.value(Property.HAS_DURATION_MODEL, n) is None}
        self._stepless = stepless(several)
        effects = (e for name in processes for e in constructs.parts(name, Property.HAS_EFFECT))
        self._changing = fluent_properties(ontology) | {constructs.part(e, Property.OF_PROPERTY) for e in effects}

    def check(self, name: str, body: Term) -> None:
        """All loops of a process."""
        for loop, beside in _loops(body, frozenset(), self._processes):
            match loop:
                case Struct("while", (condition, turn)) | Struct("until", (turn, condition)):
                    test: Term | None = condition
                case Struct("interrupt", (_, _, _, condition, turn)):
                    test = condition
                case Struct("star", (_, _, turn)):
                    test = None
                case _:
                    raise AssertionError(loop)
            entity = self._constructs.repeating(name, loop)
            if may_be_stepless(turn, self._stepless):
                told = f"may turn without doing anything, for ever, in {name}; let its body do a step every time"
                self._constructs.problem("KB213", entity, told)
            elif test is not None and not self._changes(test, name, beside | _written(turn, self._processes)):
                asked = " and ".join(sorted(set(_asked(test))))
                told = (
                    f"asks for {asked}, which no step of its body, none beside it and no effect changes: it never ends "
                    f"or never turns in {name}; ask for what a step finds out, or for a fluent"
                )
                self._constructs.problem("KB212", entity, told)

    def _changes(self, condition: Term, process: str, written: frozenset[str]) -> bool:
        match condition:
            case Struct("all" | "any", (list(parts),)):
                return any(self._changes(part, process, written) for part in parts)
            case Struct("not", (part,)):
                return self._changes(part, process, written)
            case Struct("holds" | "value", (str(prop), *_)):
                return prop in self._changing
            case Struct("compare", (_, left, right)):
                return self._changes(left, process, written) or self._changes(right, process, written)
            case Struct("is_true", (place,)):
                parameter = self._processes[process].parameter(place_of(place))
                # Whoever gave an input may write it meanwhile.
                return place_of(place) in written or (parameter is not None and parameter.role is Role.INPUT)
            case Struct("some", (_, part)):
                return self._changes(part, process, written)
            case Struct("plus" | "minus" | "times", (left, right)):
                return self._changes(left, process, written) or self._changes(right, process, written)
            case _:
                return False


def _loops(
    program: Term, beside: frozenset[str], processes: Mapping[str, Process]
) -> Iterator[tuple[Struct, frozenset[str]]]:
    """All loops and interrupts of a program, with the data that what runs beside them writes."""
    match program:
        case Struct("conc" | "pconc", (list(parts),)):
            written = [_written(part, processes) for part in parts]
            for number, part in enumerate(parts):
                others = frozenset().union(*written[:number], *written[number + 1 :])
                yield from _loops(part, beside | others, processes)
            return
        case Struct("while" | "until" | "star" | "interrupt"):
            yield program, beside
        case _:
            pass
    for part in _inner(program):
        yield from _loops(part, beside, processes)


def _inner(program: Term) -> list[Term]:
    match program:
        case list():
            return program
        case Struct("call"):
            return []
        case Struct(_, arguments):
            return list(arguments)
        case _:
            return []


def _asked(condition: Term) -> Iterator[str]:
    """What a condition asks for, for people."""
    match condition:
        case Struct("holds" | "value", (str(prop), *_)):
            yield prop
        case Struct("is_true", (place,)):
            yield place_of(place)
        case _:
            for part in _inner(condition):
                yield from _asked(part)


_Names = Mapping[str, frozenset[str]]
"""Of each process, the names of some of its parameters."""


class _Data:
    """What steps read: has any step written it before? By the names of parameters."""

    def __init__(
        self,
        ontology: Ontology,
        processes: Mapping[str, Process],
        bodies: Mapping[str, Term],
        constructs: Constructs,
    ) -> None:
        self._processes = processes
        self._bodies = bodies
        self._constructs = constructs
        fields = [(f, ontology.value(Property.IS_OPTIONAL, f) is True) for f in ontology.individuals(Kind.FIELD)]
        mapped = [(str(ontology.value(Property.MAPS_PARAMETER, f)), optional) for f, optional in fields]
        self._dispensable = {p for p, optional in mapped if optional} - {p for p, optional in mapped if not optional}
        self._needed = least(processes, frozenset[str](), self._needs)

    def check(self, name: str, body: Term) -> None:
        """All steps and conditions of a process, and its outputs."""
        process = self._processes[name]
        given = frozenset(p.name for p in process.inputs)
        written = self._flow(process, body, given, frozenset())
        for output in process.outputs:
            if output.is_datum and output.name not in written:
                told = f"promises the output {output.name!r}, but no step of it makes that; bind a step's output to it"
                self._constructs.problem("KB215", name, told)

    def _flow(self, process: Process, program: Term, before: frozenset[str], later: frozenset[str]) -> frozenset[str]:
        """What may have been written after a program.

        Args:
            before: What may have been written before it.
            later: What a later part of the same turn of a loop writes: what is not done every time may come after it.
        """

        def read(condition: Term) -> None:
            for name in sorted(set(_truths(condition)) - before):
                parameter = process.parameter(name)
                assert parameter is not None, name
                told = (
                    f"is asked for by a condition of {process.name}, but no step of it can have made that before; "
                    "correct the stepNumbers, or let an earlier step output it"
                )
                self._constructs.problem("KB215", parameter.entity, told)

        match program:
            case list():
                for part in program:
                    before = self._flow(process, part, before, later)
                return before
            case Struct("conc" | "pconc", (list(parts),)) | Struct("any_order", (_, _, list(parts))):
                written = [_written(part, self._processes) for part in parts]
                for number, part in enumerate(parts):
                    others = before.union(*written[:number], *written[number + 1 :])
                    self._flow(process, part, others, later)
                return before.union(*written)
            case Struct("choice", (_, _, list(branches))):
                return before.union(*(self._flow(process, b, before | later, later) for b in branches))
            case Struct("if", (condition, then, otherwise)):
                read(condition)
                after = [self._flow(process, p, before | later, later) for p in (then, otherwise)]
                return before.union(*after)
            case Struct("while", (condition, body)) | Struct("interrupt", (_, _, _, condition, body)):
                read(condition)
                return self._flow(process, body, before | later, later | _written(body, self._processes))
            case Struct("foreach", (_, _, _, condition, _, body)):
                read(condition)
                return self._flow(process, body, before | later, later)
            case Struct("star", (*_, body)):
                return self._flow(process, body, before | later, later | _written(body, self._processes))
            case Struct("until", (body, condition)):
                before = self._flow(process, body, before, later | _written(body, self._processes))
                read(condition)
                return before
            case Struct("pick" | "search" | "deadline", (*_, body)):
                return self._flow(process, body, before, later)
            case Struct("test", (condition,)):
                read(condition)
                return before
            case Struct("call", (_, str(step), called)):
                for name in sorted(self._read(called, self._needed) - before):
                    told = (
                        f"reads {name!r}, which no step of {process.name} can have made before; "
                        "correct the stepNumbers, or let an earlier step output it"
                    )
                    self._constructs.problem("KB215", step, told)
                return before | _written(program, self._processes)
            case _:
                return before

    def _read(self, called: Term, needed: _Names) -> set[str]:
        """The data that a call reads, `needed` being what each process cannot do without."""
        callee, arguments = _call(called, self._processes)
        return {place_of(a) for p, a in arguments if p.name in needed[callee.name] and _is_place(a)}

    def _needs(self, name: str, known: _Names) -> frozenset[str]:
        """The inputs that are data and without which a process cannot do; `known` of those that it performs."""
        data = [p for p in self._processes[name].inputs if p.is_datum]
        if name not in self._bodies:
            return frozenset(p.name for p in data if p.entity not in self._dispensable)
        read = self._read_within(self._bodies[name], known)
        return frozenset(p.name for p in data if p.name in read)

    def _read_within(self, program: Term, needed: _Names) -> set[str]:
        match program:
            case Struct("call", (_, _, called)):
                return self._read(called, needed)
            case Struct("is_true", (place,)):
                return {place_of(place)}
            case _:
                return set[str]().union(*(self._read_within(part, needed) for part in _inner(program)))


def _written(program: Term, processes: Mapping[str, Process]) -> frozenset[str]:
    """The data, by the names of parameters, that some step of a program outputs."""
    match program:
        case Struct("call", (_, _, called)):
            _, arguments = _call(called, processes)
            return frozenset(place_of(a) for p, a in arguments if p.role is Role.OUTPUT and p.is_datum)
        case _:
            return frozenset[str]().union(*(_written(part, processes) for part in _inner(program)))


def _call(called: Term, processes: Mapping[str, Process]) -> tuple[Process, list[tuple[Parameter, Term]]]:
    name, given = (called.functor, called.args) if isinstance(called, Struct) else (str(called), ())
    callee = processes[name]
    return callee, list(zip(callee.arguments, given, strict=True))


def _truths(condition: Term) -> Iterator[str]:
    """The truth values that a condition asks for, by the names of parameters."""
    match condition:
        case Struct("is_true", (place,)):
            yield place_of(place)
        case _:
            for part in _inner(condition):
                yield from _truths(part)


def _is_place(term: Term) -> bool:
    """Whether a step writes it: neither the value of a fluent nor a constant."""
    return isinstance(term, Var) or (isinstance(term, Struct) and term.functor == "loc")
