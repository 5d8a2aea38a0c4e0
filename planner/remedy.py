"""What is done before something that has failed is begun again: a call of a process, with what is known around it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from kb.processes import Parameter, Role
from kb.store import Snapshot
from kb.terms import Action, Data, Fluent, Struct, Term, Value, Var, struct
from kb.vocabulary import Kind


@dataclass(frozen=True, slots=True, kw_only=True)
class Remedy:
    """A program to be done before.

    Attributes:
        process: What it performs.
        program: A Golog program of its own.
        found: The place of the truth value that the process finds out; None if it finds out none.
    """

    process: str
    program: Term
    found: Term | None


def remedy(process: str, whole: str, around: Iterable[Action], snapshot: Snapshot) -> Remedy | None:
    """A call of a process before what has the id `whole` is begun again.

    What the process is given is bound by name: to what the failed action, and the processes that it is part of, have of
    the same name and class; else the planner picks it.

    Args:
        around: The failed action and those processes, the innermost first.

    Returns:
        None if the process needs a message that is not there.
    """
    known: dict[str, Value] = {}
    for part in around:
        for argument in part.arguments:
            known.setdefault(argument.name, argument.value)
    frame = f"{whole}/{process}"
    arguments: list[Term] = []
    picked: list[tuple[Var, Parameter]] = []
    found: Term | None = None
    for parameter in snapshot.processes[process].arguments:
        if parameter.role is Role.OUTPUT:
            place = struct("loc", frame, parameter.name)
            found = place if parameter.kind == Kind.TRUTH_VALUE and found is None else found
            arguments.append(place)
        elif (bound := _bound(parameter, known, snapshot)) is not None:
            arguments.append(bound)
        elif parameter.is_datum:
            return None
        else:
            picked.append((Var(f"V{len(picked)}"), parameter))
            arguments.append(picked[-1][0])
    head: Term = Struct(process, tuple(arguments)) if arguments else process
    program: Term = struct("call", whole, process, head)
    for variable, parameter in reversed(picked):
        program = struct("pick", whole, f"{process}_{parameter.name}", variable, parameter.kind, program)
    return Remedy(process=process, program=program, found=found)


def _bound(parameter: Parameter, known: Mapping[str, Value], snapshot: Snapshot) -> Term | None:
    match known.get(parameter.name):
        case Data(place) if parameter.is_datum:
            frame, _, name = place.rpartition("/")
            return struct("loc", frame, name)
        case Fluent(prop, subject) if parameter.is_datum:
            return struct("fluent", prop, subject)
        case str(value) if parameter.is_datum or snapshot.ontology.is_a(value, parameter.kind):
            return value
        case bool() | int() | float() as value if parameter.is_datum:
            return value
        case _:
            return None
