"""Which processes may perform themselves, and what follows for those that do."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from kb.recursion import endless, least, recursive, stepless
from kb.terms import Term, Var, struct

_F = Var("F")


def call(name: str) -> Term:
    """A call without arguments, of a step or process."""
    return struct("call", _F, f"do_{name}", name)


def either(*branches: Term) -> Term:
    """One of these."""
    return struct("choice", _F, "either", list(branches))


_SOME = struct("holds", "isOpen", "door", True)
_STEP, _AGAIN = call("Step"), call("Again")


@pytest.mark.parametrize(
    "body",
    [
        either([], [_STEP, _AGAIN]),
        struct("if", _SOME, [_STEP, _AGAIN], []),
        struct("while", _SOME, [_STEP, _AGAIN]),
        [_STEP, struct("star", _F, "s", [_STEP, _AGAIN])],
        [_STEP, struct("conc", [_STEP, either([], _AGAIN)])],
        either(_STEP, struct("pick", _F, "p", Var("X"), "Door", [struct("deadline", 9, _STEP), _AGAIN])),
        either([], [struct("until", _STEP, _SOME), struct("any_order", _F, "o", [_STEP, _AGAIN])]),
    ],
)
def test_what_can_end_and_does_a_step_first_may_come_back_to_itself(body: Term) -> None:
    """By a choice, a condition, or a loop that need not turn."""
    assert recursive({"Again": body}) == {"Again": ["Again", "Again"]}
    assert endless({"Again": body}) == {}


@pytest.mark.parametrize(
    "body",
    [
        [_STEP, _AGAIN],
        either([_STEP, _AGAIN], [_STEP, _STEP, _AGAIN]),
        struct("conc", [_STEP, _AGAIN]),
        struct("if", _SOME, [_STEP, _AGAIN], [_STEP, _AGAIN]),
        struct("until", [_STEP, _AGAIN], _SOME),
        [either([], _STEP), struct("pick", _F, "p", Var("X"), "Door", [_STEP, _AGAIN])],
    ],
)
def test_what_cannot_end_is_refused(body: Term) -> None:
    """Recursion without a choice."""
    assert endless({"Again": body})["Again"].startswith("performs itself without end: Again -> Again; let a Choice")


@pytest.mark.parametrize(
    "body",
    [
        either([], _AGAIN),
        either(_STEP, _AGAIN),
        either([], [_AGAIN, _STEP]),
        either([], struct("conc", [_STEP, _AGAIN])),
        either([], struct("any_order", _F, "o", [_STEP, _AGAIN])),
        either([], [either([], _STEP), _AGAIN]),
        either([], [struct("test", _SOME), struct("while", _SOME, _STEP), _AGAIN]),
        struct("if", _SOME, [struct("foreach", _F, "e", [], _SOME, Var("I"), _STEP), _AGAIN], []),
        either([], [call("Maybe"), _AGAIN]),
    ],
)
def test_what_may_come_back_without_a_step_is_refused(body: Term) -> None:
    """No time would pass."""
    bodies = {"Again": body, "Maybe": either([], _STEP)}
    assert endless(bodies) == {
        "Again": "may come back to itself without having done a step: Again -> Again; put a step before that in a "
        "Sequence, or use RepeatUntil or RepeatWhile"
    }


def test_a_ring_is_told_once_with_its_way() -> None:
    """Of processes that perform each other, the first by name; others beside it are told too."""
    bodies = {
        "C": [_STEP, call("A")],
        "B": either(call("C"), _STEP),
        "A": [_STEP, call("B")],
        "Main": [call("A"), call("Y")],
        "Y": [_STEP, call("Z")],
        "Z": call("Y"),
    }
    assert recursive(bodies) == {
        "A": ["A", "B", "C", "A"],
        "B": ["B", "C", "A", "B"],
        "C": ["C", "A", "B", "C"],
        "Y": ["Y", "Z", "Y"],
        "Z": ["Z", "Y", "Z"],
    }
    assert list(endless(bodies)) == ["Y"]
    assert "Y -> Z -> Y" in endless(bodies)["Y"]


def test_a_way_round_a_ring_needs_a_step_somewhere() -> None:
    """In one of its processes is enough."""
    round_trip = {"A": either([], call("B")), "B": [_STEP, call("A")]}
    assert endless(round_trip) == {}
    assert "A -> B -> A" in endless({**round_trip, "B": [either([], _STEP), call("A")]})["A"]


def test_what_may_do_nothing_follows_through_calls() -> None:
    """Also where they come back."""
    bodies = {
        "A": either(call("B"), [_STEP, call("A")]),
        "B": [call("C"), call("C")],
        "C": either(_STEP, []),
        "D": _STEP,
    }
    assert stepless(bodies) == {"A": True, "B": True, "C": True, "D": False}


def test_the_least_solution_goes_round_rings() -> None:
    """What one needs all need that lead to it, and no more."""
    leads = {"A": "B", "B": "C", "C": "A", "D": "A", "E": ""}
    own = {"A": {"a"}, "C": {"c"}, "D": {"d"}, "E": {"e"}}

    def follows(name: str, known: Mapping[str, frozenset[str]]) -> frozenset[str]:
        return frozenset(own.get(name, set())) | known.get(leads[name], frozenset())

    found = least(leads, frozenset[str](), follows)
    assert {n: "".join(sorted(f)) for n, f in found.items()} == {"A": "ac", "B": "ac", "C": "ac", "D": "acd", "E": "e"}
