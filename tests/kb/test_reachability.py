import pytest

from kb.reachability import unreachable
from kb.store import KnowledgeBase
from kb.terms import Struct, Term, Var, struct

F, X, ROOM = Var("Frame"), Var("X"), Var("Room")
EMPTY = struct("holds", "isEmpty", X, "true")
FULL = struct("not", EMPTY)
HERE = struct("holds", "inArea", X, ROOM)
AWAY = struct("not", HERE)
NEVER = struct("all", [EMPTY, FULL])
ALWAYS = struct("any", [EMPTY, FULL])
WIDE = struct("compare", "more", struct("value", "radius_m", X), 0.5)
SLIM = struct("compare", "less", struct("value", "radius_m", X), 0.4)


def do(step: str) -> Struct:
    """A step."""
    return struct("call", F, step, "Laser")


def never_done(shipped: KnowledgeBase, *bodies: Term) -> list[str]:
    """The steps of processes P0, P1, ... that are never come to; isEmpty may change, inArea does not."""
    facts: list[Term] = [struct("definition", 1, f"P{n}", F, body) for n, body in enumerate(bodies)]
    return [p.entity for p in unreachable(shipped.snapshot().ontology, {}, facts) if p.code == "KB216"]


@pytest.mark.parametrize(
    ("body", "steps"),
    [
        ([struct("test", NEVER), do("a"), do("b")], ["a"]),
        ([struct("while", ALWAYS, do("a")), do("b")], ["b"]),
        ([struct("until", do("a"), NEVER), do("b")], ["b"]),
        (struct("while", NEVER, do("a")), ["a"]),
        (struct("if", NEVER, do("a"), do("b")), ["a"]),
        (struct("if", ALWAYS, do("a"), do("b")), ["b"]),
        (struct("if", EMPTY, struct("if", EMPTY, do("a"), do("b")), []), ["b"]),
        (struct("if", HERE, [do("a"), struct("if", AWAY, do("b"), do("c"))], []), ["b"]),
        ([struct("test", HERE), do("a"), struct("if", AWAY, do("b"), [])], ["b"]),
        (struct("if", WIDE, struct("while", SLIM, do("a")), []), ["a"]),
        (struct("interrupt", F, "i", [struct("-", X, "Drink")], NEVER, do("a")), ["a"]),
        (struct("foreach", F, "e", [struct("-", X, "Drink")], NEVER, Var("Inner"), do("a")), ["a"]),
        ([struct("conc", [struct("test", NEVER), do("a")]), do("b")], ["b"]),
        ([struct("choice", F, "c", [struct("test", NEVER), struct("test", NEVER)]), do("b")], ["b"]),
    ],
)
def test_what_is_never_come_to_is_told(shipped: KnowledgeBase, body: Term, steps: list[str]) -> None:
    """After what never ends, and where conditions exclude each other."""
    assert never_done(shipped, body) == steps


@pytest.mark.parametrize(
    "body",
    [
        [struct("test", EMPTY), do("a")],
        struct("if", EMPTY, [do("a"), struct("if", FULL, do("b"), do("c"))], []),
        [struct("test", EMPTY), do("a"), struct("if", FULL, do("b"), [])],
        struct("while", EMPTY, [do("a"), struct("if", FULL, do("b"), [])]),
        struct("if", EMPTY, struct("conc", [do("a"), struct("if", FULL, do("b"), [])]), []),
        [struct("choice", F, "c", [struct("test", NEVER), do("a")]), do("b")],
        [struct("star", F, "s", do("a")), do("b")],
        [struct("interrupt", F, "i", [struct("-", X, "Drink")], ALWAYS, do("a")), do("b")],
        struct("if", HERE, do("a"), struct("if", AWAY, do("b"), [])),
    ],
)
def test_what_may_come_is_not_blamed(shipped: KnowledgeBase, body: Term) -> None:
    """A fluent may have changed meanwhile; one branch of a choice is enough."""
    assert never_done(shipped, body) == []


def test_a_process_that_never_ends_ends_its_callers(shipped: KnowledgeBase) -> None:
    """What follows its call is never come to; a call of one that ends is no such thing."""
    called: Term = [struct("call", F, "call", "P1"), do("after")]
    assert never_done(shipped, called, struct("test", NEVER)) == ["after"]
    assert never_done(shipped, called, struct("test", EMPTY)) == []
