"""Processes that perform themselves, directly or through others.

"Tidy one thing and then the rest, or be done" is a process that performs itself. It can be planned if it is able to
end, by a choice, a condition or a loop that leaves out the call, and if a step is done before it comes back to
itself: else it would turn without time passing, for ever. What else is asked here is a least solution too: what holds
of a process because it holds of those that it performs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TypeVar

from kb.terms import Struct, Term

Solution = TypeVar("Solution")


def least(
    names: Iterable[str], none: Solution, follows: Callable[[str, Mapping[str, Solution]], Solution]
) -> dict[str, Solution]:
    """The least solution of equations in which processes depend on one another.

    Args:
        none: What is so of each at least: false, the empty set.
        follows: What is so of a process where that is so of the others; more of them never makes it less.
    """
    known = dict.fromkeys(names, none)
    while True:
        found = {name: follows(name, known) for name in known}
        if found == known:
            return known
        known = found


def called(program: Term) -> Iterator[str]:
    """The processes that a program performs itself."""
    match program:
        case Struct("call", (_, _, Struct(callee) | str(callee))):
            yield callee
        case Struct(_, parts) | list(parts):
            for part in parts:
                yield from called(part)
        case _:
            pass


def recursive(bodies: Mapping[str, Term]) -> dict[str, list[str]]:
    """The processes that perform themselves, each with the shortest way back to itself.

    Args:
        bodies: The program of each process that has one, by name.
    """
    return _cycles({name: dict.fromkeys(called(body)) for name, body in bodies.items()})


def stepless(bodies: Mapping[str, Term]) -> dict[str, bool]:
    """Whether each process may end without having done a step; those that have no program are steps."""
    return least(bodies, False, lambda name, known: may_be_stepless(bodies[name], known))


def may_be_stepless(program: Term, known: Mapping[str, bool]) -> bool:
    """Whether a program may end without a step, as planner/golog/syntax.pl says; of calls, too.

    Args:
        known: Whether processes may; those that are not in it are steps.
    """
    match program:
        case list(parts) | Struct("conc" | "pconc", (list(parts),)) | Struct("any_order", (_, _, list(parts))):
            return all(may_be_stepless(part, known) for part in parts)
        case Struct("choice", (_, _, list(branches))):
            return any(may_be_stepless(branch, known) for branch in branches)
        case Struct("pick" | "search" | "deadline", (*_, body)) | Struct("until", (body, _)):
            return may_be_stepless(body, known)
        case Struct("if", (_, then, otherwise)):
            return may_be_stepless(then, known) or may_be_stepless(otherwise, known)
        case Struct("call", (_, _, Struct(callee) | str(callee))):
            return known.get(callee, False)
        case _:
            return True  # a for-each, a while, an iteration or an interrupt may have no turn; a test takes no time


def endless(bodies: Mapping[str, Term]) -> dict[str, str]:
    """What is wrong with the processes that perform themselves, a sentence each, by name."""
    ends = least(bodies, False, lambda name, known: _may_end(bodies[name], known))
    may_be_empty = stepless(bodies)
    at_once = _cycles({name: dict.fromkeys(_first(body, may_be_empty)) for name, body in bodies.items()})
    found: dict[str, str] = {}
    told: set[str] = set()
    for name, cycle in recursive(bodies).items():
        if told.intersection(cycle):
            continue
        told.update(cycle if not ends[name] else at_once.get(name, ()))
        if not ends[name]:
            found[name] = (
                f"performs itself without end: {' -> '.join(cycle)}; let a Choice or IfThenElse in it leave out the "
                "call, or use RepeatUntil or RepeatWhile"
            )
        elif name in at_once:
            found[name] = (
                f"may come back to itself without having done a step: {' -> '.join(at_once[name])}; put a step before "
                "that in a Sequence, or use RepeatUntil or RepeatWhile"
            )
    return found


def _cycles(calls: Mapping[str, Iterable[str]]) -> dict[str, list[str]]:
    """The names from which calls lead back to themselves, each with a shortest way."""
    found: dict[str, list[str]] = {}
    for name in sorted(calls):
        trails = [[name]]
        passed: set[str] = set()
        for trail in trails:
            for callee in calls.get(trail[-1], ()):
                if callee == name:
                    found.setdefault(name, [*trail, name])
                elif callee not in passed:
                    passed.add(callee)
                    trails.append([*trail, callee])
    return found


def _may_end(program: Term, known: Mapping[str, bool]) -> bool:
    """Whether some execution of a program ends, its conditions apart.

    Args:
        known: Of which processes that is so; those that are not in it are steps, which end.
    """
    match program:
        case Struct("call", (_, _, Struct(callee) | str(callee))):
            return known.get(callee, True)
        case Struct("choice", (_, _, list(branches))):
            return any(_may_end(branch, known) for branch in branches)
        case Struct("if", (_, then, otherwise)):
            return _may_end(then, known) or _may_end(otherwise, known)
        case Struct("while" | "star" | "interrupt" | "foreach"):
            return True  # without a turn
        case Struct(_, parts) | list(parts):
            return all(_may_end(part, known) for part in parts)
        case _:
            return True


def _first(program: Term, may_be_empty: Mapping[str, bool]) -> Iterator[str]:
    """The processes that a program may perform before a step has ended."""
    match program:
        case list(parts):
            for part in parts:
                yield from _first(part, may_be_empty)
                if not may_be_stepless(part, may_be_empty):
                    return
        case Struct("call", (_, _, Struct(callee) | str(callee))):
            yield callee
        case (
            Struct("conc" | "pconc", (list(parts),))
            | Struct("any_order" | "choice", (_, _, list(parts)))
            | Struct(_, parts)
        ):
            for part in parts:
                yield from _first(part, may_be_empty)
        case _:
            pass
