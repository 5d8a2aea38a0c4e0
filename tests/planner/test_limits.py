"""Programs that leave far too much open are refused with the reason, and nothing else suffers."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from kb.prolog import Entry, PrologError
from kb.store import Snapshot
from kb.terms import Term, Var, struct
from planner import planner
from planner.plan import PlanStatus
from planner.planner import Session
from tests.planner.conftest import travel_of
from tests.planner.test_planner import TIMES

_REVISION = -7
_THINGS = 100

_load_facts = Entry(search_path="kb_rules", file="facts", name="load_facts")
_drop_facts = Entry(search_path="kb_rules", file="facts", name="drop_facts")


def _entry(file: str, name: str) -> Entry:
    return Entry(search_path="planner_golog", file=file, name=name)


@pytest.fixture
def million() -> Iterator[str]:
    """A session of a program with a million ways: three picks of a hundred things, one within the other."""
    frame, a, b, c = Var("F"), Var("A"), Var("B"), Var("C")
    body: Term = struct("call", frame, "do", struct("Do", a, b, c))
    for step, variable in (("c", c), ("b", b), ("a", a)):
        body = struct("pick", frame, step, variable, "Thing", body)
    facts: list[Term] = [struct("kind", _REVISION, f"thing_{n}", "Thing") for n in range(_THINGS)]
    facts.append(struct("duration", _REVISION, struct("Do", a, b, c), struct("fixed", 5)))
    facts.append(struct("definition", _REVISION, "Main", frame, body))
    _load_facts(facts)
    _entry("steps", "open_session")(struct("request", "million", _REVISION, "Main", 2, 0))
    yield "million"
    _entry("steps", "close_session")("million")
    _drop_facts(_REVISION)


def test_a_million_alternatives_are_not_gone_through(million: str) -> None:
    """It is an error that says so, after a bounded effort."""
    with pytest.raises(PrologError) as refused:
        _entry("planning", "needed_travels")(million)
    assert refused.value.formal == ("resource_error", "alternatives")


def test_such_a_plan_is_unsupported_with_advice_and_the_next_one_is_made(
    tue_lab: Snapshot, million: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The session whose program is too large says what would help; others go on."""
    session = Session("usual", tue_lab, "FindEmptyDrink", {"room": "tue_lab"}, robots=2)
    with monkeypatch.context() as patched:
        needed = planner._needed_travels
        patched.setattr(planner, "_needed_travels", lambda key: needed(million))
        plan = session.plan(travel_of(TIMES), now_s=0.0)
    assert plan.status is PlanStatus.UNSUPPORTED
    assert "leaves too much open" in plan.reason
    assert "hasDurationModel" in plan.reason
    assert session.plan(travel_of(TIMES), now_s=0.0).status is PlanStatus.SOLVED_OPTIMALLY
    session.close()
