"""The planner and the checker, which share no code, find the same conditions to hold, however these are nested."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace

import pytest
from hypothesis import assume, event, given, settings
from hypothesis import strategies as st
from rdflib import Graph

from kb.conditions import Conditions
from kb.ontology import Value
from kb.processes import Parameter, Process, Role
from kb.prolog import Entry
from kb.scope import FRAME, Reader, Scope
from kb.store import Snapshot
from kb.swrl import read_rules
from kb.terms import Struct, Term, Var, struct
from planner.checking.knowledge import Knowledge
from planner.checking.moment import Moment, bound
from planner.checking.rules import satisfied
from tests.kb import rules
from tests.kb.conftest import ask

_load_facts = Entry(search_path="kb_rules", file="facts", name="load_facts")
_drop_facts = Entry(search_path="kb_rules", file="facts", name="drop_facts")
_revisions = itertools.count(1)
NAMES = ("a", "b", "c")
CLASSES = ("Cup", "Pot")
NUMBERS = (0, 1, 1.0, 2.5, -3)
OWN = "http://example.org/own#"
NAME, CLASS, NUMBER = st.sampled_from(NAMES), st.sampled_from(CLASSES), st.sampled_from(NUMBERS)


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """Who belongs to what, what has which values, and what effects have set since."""

    kinds: dict[str, frozenset[str]]
    values: dict[tuple[str, str], tuple[Value, ...]]
    fluents: dict[tuple[str, str], Value]


VALUE: dict[str, st.SearchStrategy[Value]] = {"near": NAME, "height": NUMBER, "full": st.booleans()}


def pairs(*, many: bool) -> st.SearchStrategy[dict[tuple[str, str], list[Value]]]:
    """Values of properties of individuals."""

    def of(key: tuple[str, str]) -> st.SearchStrategy[list[Value]]:
        return st.lists(VALUE[key[0]], max_size=2 if many else 1, unique_by=lambda v: (type(v), v))

    return st.fixed_dictionaries({(prop, name): of((prop, name)) for prop in VALUE for name in NAMES})


@st.composite
def worlds(draw: st.DrawFn) -> World:
    """A few things with values, some of them changed by effects."""
    kinds = draw(st.fixed_dictionaries({name: st.frozensets(CLASS) for name in NAMES}))
    values = {key: tuple(found) for key, found in draw(pairs(many=True)).items() if found}
    fluents = {key: found[0] for key, found in draw(pairs(many=False)).items() if found}
    return World(kinds=kinds, values=values, fluents=fluents)


def conditions(draw: st.DrawFn, individuals: list[Term], numbers: list[Term], depth: int) -> Term:
    """A condition over what has a value here."""
    one, other = st.sampled_from(individuals), st.sampled_from(individuals)
    word = draw(
        st.sampled_from(["holds", "is_a", "same", "compare"] + ["all", "any", "not", "some", "some"] * (depth > 0))
    )
    match word:
        case "holds":
            prop = draw(st.sampled_from(["near", "height", "full"]))
            value: Term = draw(one) if prop == "near" else draw(VALUE[prop])
            return struct("holds", prop, draw(other), value)
        case "is_a":
            return struct("is_a", draw(one), draw(CLASS))
        case "same":
            return struct("same", draw(one), draw(other))
        case "compare":
            op = draw(st.sampled_from(["less", "at_most", "more", "at_least", "equal"]))
            return struct("compare", op, sums(draw, individuals, numbers), sums(draw, individuals, numbers))
        case "some":
            return existential(draw, individuals, numbers, depth)
        case "not":
            return struct("not", conditions(draw, individuals, numbers, depth - 1))
        case _:
            parts = [conditions(draw, individuals, numbers, depth - 1) for _ in range(draw(st.integers(0, 3)))]
            return struct(word, parts)


def sums(draw: st.DrawFn, individuals: list[Term], numbers: list[Term], depth: int = 2) -> Term:
    """One side of a comparison."""
    if depth and draw(st.booleans()):
        left, right = (sums(draw, individuals, numbers, depth - 1) for _ in range(2))
        return struct(draw(st.sampled_from(["plus", "minus", "times"])), left, right)
    value = struct("value", "height", draw(st.sampled_from(individuals)))
    return draw(st.sampled_from([*numbers, value]) | NUMBER)


def existential(draw: st.DrawFn, individuals: list[Term], numbers: list[Term], depth: int) -> Term:
    """Variables with a class, or drawn by a property; what draws them stands anywhere among the parts."""
    over: list[Term] = []
    drawing: list[Term] = []
    individuals, numbers = list(individuals), list(numbers)
    for _ in range(draw(st.integers(1, 2))):
        variable = Var(f"_{len(individuals)}_{len(numbers)}_x")
        match draw(st.sampled_from(["class", "value", "subject", "number"])):
            case "class":
                over.append(struct("-", variable, draw(CLASS)))
                individuals += [variable] * 4  # more often than what is outside
            case "number":
                over.append(variable)
                drawing.append(struct("holds", "height", draw(st.sampled_from(individuals)), variable))
                numbers += [variable] * 4
            case way:
                over.append(variable)
                ends = [draw(st.sampled_from(individuals)), variable]
                subject, value = ends if way == "value" else reversed(ends)
                drawing.append(struct("holds", "near", subject, value))
                individuals += [variable] * 4
    parts = [*drawing, *(conditions(draw, individuals, numbers, depth - 1) for _ in range(draw(st.integers(0, 2))))]
    return struct("some", over, struct("all", draw(st.permutations(parts))))


def golog(world: World, asked: list[Term]) -> list[bool]:
    """What planner/golog/conditions.pl answers."""
    revision = next(_revisions) + 10**9
    facts: list[Term] = [struct("kind", revision, name, kind) for name, own in world.kinds.items() for kind in own]
    facts += [struct("value", revision, *key, value) for key, found in world.values.items() for value in found]
    _load_facts(facts)
    changes: list[Term] = [
        struct("-", struct("-", prop, subject), value) for (prop, subject), value in world.fluents.items()
    ]
    s0, s, c, a, key, value = map(Var, ("S0", "S", "C", "A", "K", "V"))
    projection, planner = "planner_projection", "planner_conditions"
    step = struct(":", projection, struct("set_data", key, value, Var("Before"), Var("After")))
    setting = struct(">>", [struct("-", key, value), Var("Before"), Var("After")], step)
    goals = [
        struct("load_files", struct("planner_golog", "conditions"), [struct("if", "not_loaded")]),
        struct(":", projection, struct("situation", revision, struct("plan", "t"), 1, 0, s0)),
        struct("foldl", setting, changes, s0, s),
        struct(
            "findall",
            a,
            struct(",", struct("member", c, asked), struct(":", planner, struct("asked", c, s, a))),
            Var("Answer"),
        ),
    ]
    try:
        answers = ask(_all(goals))
    finally:
        _drop_facts(revision)
    assert len(answers) == len(asked)
    assert set(answers) <= {"yes", "no"}
    return [answer == "yes" for answer in answers]


def _all(goals: list[Struct]) -> Struct:
    first, *rest = goals
    return struct(",", first, _all(rest)) if rest else first


def checker(world: World, base: Snapshot) -> Callable[[Term, dict[str, Term]], bool]:
    """What planner/checking/knowledge.py answers."""
    ontology = replace(base.ontology, kinds=world.kinds, _values=world.values)
    knowledge = Knowledge(replace(base, ontology=ontology, fluents={}), {}, {})
    moment = Moment(
        now_ms=0,
        fluents=dict(world.fluents),
        running={},
        busy={},
        held={},
        claimed={},
        team=frozenset(),
        worked_ms={},
        taken={},
    )
    return lambda condition, binding: knowledge.holds(condition, binding, moment)


@settings(max_examples=150, deadline=None)
@given(data=st.data(), world=worlds())
def test_conditions_hold_for_both_or_for_none(tue_lab: Snapshot, data: st.DataObject, world: World) -> None:
    """Existential variables in any order, sums, and not around and within them."""

    @st.composite
    def condition(draw: st.DrawFn) -> Term:
        return conditions(draw, list(NAMES), [], depth=3)

    asked = data.draw(st.lists(condition(), min_size=5, max_size=15))
    holds = checker(world, tue_lab)
    found = [holds(each, {}) for each in asked]
    event(f"{sum(found)} of {len(found)} hold" if len(found) == 5 else "more")
    assert golog(world, asked) == found


# ------------------------------------------------------------------------------------------------ rules


@st.composite
def bodies(draw: st.DrawFn) -> list[str]:
    """The body of a rule about ?x, as RDF/XML; some have a variable that nothing draws."""
    drawing = [
        rules.has(OWN + "near", "?z", "?y"),
        rules.is_a(OWN + "Cup", "?z"),
        rules.has_data(OWN + "height", "?x", "?n"),
        rules.has_data(OWN + "height", "?z", "?m"),
        rules.built_in("add", "?s", "?n", 1),
        rules.built_in("subtract", "?s", "?n", "?m"),
        rules.built_in("multiply", "?s", "?m", "?n"),
    ]
    atoms = [rules.has(OWN + "near", "?x", "?y"), rules.has_data(OWN + "height", "?y", "?n")]
    atoms += draw(st.lists(st.sampled_from(drawing), max_size=3, unique=True))
    who = st.sampled_from(["?x", "?y", "?y", OWN + "a", *(["?z"] if any("#z" in atom for atom in atoms) else [])])
    known = [name for name in ("?m", "?s") if any(f"#{name[1]}" in atom for atom in atoms)]
    amount = st.sampled_from(["?n", "?n", *known]) | NUMBER
    for _ in range(draw(st.integers(1, 3))):
        match draw(st.sampled_from(["class", "near", "number", "full", "same", "order", "order", "equal", "sum"])):
            case "class":
                atoms.append(rules.is_a(OWN + draw(CLASS), draw(who)))
            case "near":
                atoms.append(rules.has(OWN + "near", draw(who), draw(who)))
            case "number":
                atoms.append(rules.has_data(OWN + "height", draw(who), draw(NUMBER)))
            case "full":
                atoms.append(rules.has_data(OWN + "full", draw(who), draw(st.booleans())))
            case "same":
                atoms.append(draw(st.sampled_from([rules.same, rules.different]))(draw(who), draw(who)))
            case "order":
                word = draw(st.sampled_from(["lessThan", "lessThanOrEqual", "greaterThan", "greaterThanOrEqual"]))
                atoms.append(rules.built_in(word, draw(amount), draw(amount)))
            case "equal":
                atoms.append(rules.built_in(draw(st.sampled_from(["equal", "notEqual"])), draw(amount), draw(amount)))
            case _:
                word = draw(st.sampled_from(["add", "subtract", "multiply"]))
                atoms.append(rules.built_in(word, draw(amount), draw(amount), draw(amount)))
    return list(draw(st.permutations(atoms)))


@pytest.fixture(scope="module")
def asking() -> Process:
    """A process that is given ?x."""
    parameter = Parameter(entity="P_x", name="x", role=Role.INPUT, kind="Thing", is_datum=False, is_place=False)
    return Process(name="P", is_atomic=True, parameters=(parameter,))


def both(
    base: Snapshot, asking: Process, world: World, alternatives: list[list[str]], *, functional: bool
) -> tuple[list[bool], list[bool]] | None:
    """Of whom rules for ?x hold, to the planner and to the checker; None if nothing draws one of their variables."""
    graph = Graph()
    text = rules.document(OWN, "Ready", alternatives, functional=["height"] if functional else [])
    graph.parse(data=text, format="xml")
    kinds = {**world.kinds, "Ready": frozenset({"RuleCondition"})}
    ontology = replace(base.ontology, graph=graph, kinds=kinds)
    reader = Reader(ontology)
    scope = Scope(reader, asking, frame=FRAME, frames={}, bound=frozenset())
    condition = Conditions(reader, ontology).term(scope, "Ready")
    if any(p.code == "KB204" for p in reader.problems):
        return None
    read = satisfied(read_rules(ontology).of["Ready"], ["x"])
    holds = checker(world, base)
    planned = golog(world, [bound(condition, {"X": name}) for name in NAMES])
    return planned, [holds(read, {"x": name}) for name in NAMES]


@settings(max_examples=250, deadline=None)
@given(world=worlds(), alternatives=st.lists(bodies(), min_size=1, max_size=2), functional=st.booleans())
def test_rules_hold_for_both_or_for_none(
    tue_lab: Snapshot, asking: Process, world: World, alternatives: list[list[str]], functional: bool
) -> None:
    """A rule read from a file means the same to kb/conditions.py and planner/checking/rules.py."""
    if functional:  # what has one value at most may be compared without a variable
        world = replace(world, values={key: found[:1] for key, found in world.values.items()})
    answers = both(tue_lab, asking, world, alternatives, functional=functional)
    assume(answers is not None)
    assert answers is not None
    event(f"{sum(answers[0])} of {len(NAMES)} hold")
    assert answers[0] == answers[1]


@pytest.mark.parametrize(
    ("atoms", "holding"),
    [
        ([rules.built_in("lessThan", "?n", 1), rules.built_in("greaterThanOrEqual", "?n", 2)], []),
        ([rules.built_in("lessThan", "?n", 1)], ["a", "b"]),
        ([rules.built_in("greaterThanOrEqual", "?n", 2)], ["a", "c"]),
        ([rules.built_in("subtract", "?s", "?n", 1), rules.built_in("lessThan", "?s", 0)], ["a", "b"]),
        ([rules.built_in("subtract", "?s", 9, "?n"), rules.built_in("lessThan", "?s", 6)], ["c"]),
        ([rules.built_in("notEqual", "?n", 0)], ["a", "c"]),
    ],
)
def test_numbers_of_rules(tue_lab: Snapshot, asking: Process, atoms: list[str], holding: list[str]) -> None:
    """Of a the heights are 0 and 2.5, of b 0, of c 4: one value has to do for the whole rule."""
    values: dict[tuple[str, str], tuple[Value, ...]] = {
        ("height", n): v for n, v in zip("abc", ((0, 2.5), (0,), (4,)), strict=True)
    }
    world = World(kinds=dict.fromkeys(NAMES, frozenset()), values=values, fluents={})
    drawn = [rules.has_data(OWN + "height", "?x", "?n"), *atoms]
    wanted = [name in holding for name in NAMES]
    assert both(tue_lab, asking, world, [drawn], functional=False) == (wanted, wanted)
