"""Rules become conditions: parameters by their names, all other variables existential, nothing raw in Prolog."""

from __future__ import annotations

from pathlib import Path

import pytest

from kb.compiler import Compiler
from kb.ontology import Ontology
from kb.problems import OntologyRejected, Problem, Severity
from kb.processes import read_processes
from kb.store import KnowledgeBase
from kb.terms import Struct, Term, Var, render, struct
from tests.kb.conftest import OBJECTS, TASK, Edit, ask, given, individual, link, renamed
from tests.kb.rules import (
    Argument,
    built_in,
    closed,
    core,
    different,
    has,
    has_data,
    is_a,
    named,
    rule,
    same,
    satisfied,
)

READY = named(TASK, "Ready")
ON_MAP = struct("holds", "inArea", Var("Location"), Var("_1_somewhere"))
SHIPPED_PRECONDITIONS: list[Term] = [
    struct("holds", "locatedAt", Var("Drink"), Var("Location")),
    struct("some", [struct("-", Var("_1_somewhere"), "Area")], ON_MAP),
]
AT_ROBOT = has(core("locatedAt"), "?robot", "?place")
AT_DRINK = has(core("locatedAt"), "?drink", "?place")
ENERGY = has_data(core("energy_J"), "?robot", "?e")


def asking(*bodies: tuple[str, ...]) -> list[Edit]:
    """Edits after which SearchDrink (robot, area, drink, location) asks for the condition Ready."""
    return [
        individual(TASK, "Ready", "RuleCondition"),
        given(TASK, "SearchDrink", link("hasPrecondition", TASK, "Ready")),
        *(rule(TASK, satisfied(READY), *body, label=f"rule {n}") for n, body in enumerate(bodies, start=1)),
    ]


def compiled(ontology: Ontology) -> tuple[Term, list[Problem]]:
    """The condition that SearchDrink asks for by its rules, and warnings."""
    compiler = Compiler(ontology, read_processes(ontology))
    facts = compiler.facts(1)
    found = [
        fact.args[2]
        for fact in facts
        if isinstance(fact, Struct) and fact.functor == "precondition" and "'SearchDrink'(" in render(fact)
    ]
    [condition] = [c for c in found if c not in SHIPPED_PRECONDITIONS]
    return condition, compiler.warnings


def condition_of(folder: Path, *bodies: tuple[str, ...]) -> str:
    """The condition that rules with these bodies are, as text."""
    for edit in asking(*bodies):
        edit(folder)
    condition, warnings = compiled(closed(folder))
    assert not warnings
    return render(condition)


def problems_with(folder: Path, *bodies: tuple[str, ...]) -> list[Problem]:
    """Why rules with these bodies are no condition."""
    for edit in asking(*bodies):
        edit(folder)
    ontology = closed(folder)
    with pytest.raises(OntologyRejected) as caught:
        Compiler(ontology, read_processes(ontology)).facts(1)
    return caught.value.problems


@pytest.mark.parametrize(
    ("body", "condition"),
    [
        ((is_a(core("Robot"), "?robot"),), "is_a(Robot,'Robot')"),
        (
            (AT_ROBOT, AT_DRINK),
            "some(['-'(_1_place,'Location')],all([holds(locatedAt,Robot,_1_place),holds(locatedAt,Drink,_1_place)]))",
        ),
        (
            (is_a(core("Location"), "?place"), AT_ROBOT, is_a(core("Area"), "?place"), is_a(core("Area"), "?area")),
            "some(['-'(_1_place,'Location')],all([holds(locatedAt,Robot,_1_place),is_a(_1_place,'Area'),"
            "is_a(Area,'Area')]))",
        ),
        ((ENERGY, built_in("lessThan", 5, "?e")), "compare(less,5,value(energy_J,Robot))"),
        (
            (ENERGY, built_in("greaterThan", "?e", 5), built_in("notEqual", "?e", 7)),
            "some([_1_e],all([holds(energy_J,Robot,_1_e),compare(more,_1_e,5),not(compare(equal,_1_e,7))]))",
        ),
        (
            (ENERGY, built_in("lessThan", 5, "?e"), built_in("lessThan", "?e", 9)),
            "all([compare(less,5,value(energy_J,Robot)),compare(less,value(energy_J,Robot),9)])",
        ),
        ((ENERGY,), "some([_1_e],holds(energy_J,Robot,_1_e))"),
        ((has_data(core("energy_J"), "?robot", 5),), "compare(equal,value(energy_J,Robot),5)"),
        ((has_data(core("isEmpty"), "?drink", True),), "holds(isEmpty,Drink,true)"),
        (
            (different("?other", "?robot"), has_data(core("energy_J"), "?other", 5)),
            "some(['-'(_1_other,'Robot'),_2_],all([not(same(_1_other,Robot)),holds(energy_J,_1_other,_2_),compare(equal,_2_,5)]))",
        ),
        (
            (
                ENERGY,
                built_in("subtract", "?rest", "?twice", 1.5),
                built_in("multiply", "?twice", 2, "?e"),
                built_in("greaterThanOrEqual", "?rest", 0),
            ),
            "some([_1_e],all([holds(energy_J,Robot,_1_e),compare(at_least,minus(times(2,_1_e),1.5),0)]))",
        ),
        (
            (ENERGY, built_in("add", "?e", 1, 2, 3)),
            "some([_1_e],all([holds(energy_J,Robot,_1_e),compare(equal,_1_e,plus(plus(1,2),3))]))",
        ),
        ((same("?drink", "?robot"), different("?area", "?robot")), "all([same(Drink,Robot),not(same(Area,Robot))])"),
        (
            (has_data(core("energy_J"), "?robot", "?e"), built_in("equal", "?e", '"full"')),
            "some([_1_e],all([holds(energy_J,Robot,_1_e),same(_1_e,full)]))",
        ),
        (
            (
                has_data(core("energy_J"), "?robot", "?e"),
                has_data(core("power_W"), "?robot", "?p"),
                built_in("equal", "?e", "?p"),
            ),
            "some([_1_e,_2_p],all([holds(energy_J,Robot,_1_e),holds(power_W,Robot,_2_p),"
            "any([same(_1_e,_2_p),compare(equal,_1_e,_2_p)])]))",
        ),
    ],
)
def test_what_a_body_becomes(folder: Path, body: tuple[str, ...], condition: str) -> None:
    """Each kind of atom, in the order of the rule."""
    assert condition_of(folder, body) == condition


def test_several_rules_are_alternatives(folder: Path) -> None:
    """One of the bodies is enough."""
    bodies = ((has_data(core("isEmpty"), "?drink", True),), (is_a(core("Robot"), "?robot"),))
    assert condition_of(folder, *bodies) == "any([holds(isEmpty,Drink,true),is_a(Robot,'Robot')])"


def test_a_rule_may_be_an_operand(folder: Path) -> None:
    """Not, AllOf and AnyOf take a RuleCondition like any other condition."""
    for edit in asking((AT_ROBOT, AT_DRINK)):
        edit(folder)
    renamed(TASK, "SearchDrink", "#Ready", "#Unready")(folder)
    individual(TASK, "Unready", "Not", link("operand", TASK, "Ready"))(folder)
    condition, _ = compiled(closed(folder))
    assert render(condition).startswith("not(some(['-'(_1_place,'Location')],all([")


@pytest.mark.parametrize(
    ("body", "names", "words"),
    [
        ((AT_ROBOT, same("?who", "?robot")), ["who"], "no atom gives a value|class atom such as Location(?who)"),
        ((ENERGY, built_in("lessThan", "?e", "?most")), ["most"], "?most"),
        ((ENERGY, built_in("add", "?x", "?y", 1), built_in("add", "?y", "?x", 1)), ["x", "y"], "no atom gives a value"),
        ((is_a(core("Robot"), "?robot"), same("?drinks", "?robot")), ["drinks"], "did you mean ?drink?"),
    ],
)
def test_a_variable_that_nothing_gives_a_value(
    folder: Path, body: tuple[str, ...], names: list[str], words: str
) -> None:
    """KB204 at the condition, for each such variable, with a name that is near or what to add."""
    found = [p for p in problems_with(folder, body) if p.code == "KB204"]
    assert {(p.entity, p.file) for p in found} == {("Ready", folder / TASK)}
    assert len(found) == len(names)
    assert all(any(f"?{name}" in p.message for p in found) for name in names)
    assert all(word in found[0].message for word in ("its rule 'rule 1'", *words.split("|")))


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (
            (has(core("locatedAt"), "?robt", "?place"), AT_DRINK),
            "?robt|no parameter of SearchDrink|did you mean ?robot?",
        ),
        ((is_a(core("Robot"), "?who"),), "no variable named like a parameter of SearchDrink|?robot, ?area, ?drink"),
        ((has_data(core("isEmpty"), named(OBJECTS, "Drink"), True),), "asks the same whatever that is given"),
    ],
)
def test_a_variable_that_is_meant_to_be_a_parameter(folder: Path, body: tuple[str, ...], words: str) -> None:
    """KB205 warns of a name that is nearly a parameter's, and of a rule without any."""
    for edit in asking(body):
        edit(folder)
    _, warnings = compiled(closed(folder))
    assert [(p.code, p.entity, p.severity) for p in warnings] == [("KB205", "Ready", Severity.WARNING)]
    assert all(word in warnings[0].message for word in words.split("|"))


def test_a_second_variable_like_a_parameter_that_is_used_is_no_mistake(folder: Path) -> None:
    """?robot2 beside ?robot is another robot."""
    body = (has(core("locatedAt"), "?robot2", "?place"), AT_ROBOT, different("?robot", "?robot2"))
    assert condition_of(folder, body).startswith("some([_1_robot2,'-'(_2_place,'Location')],")


def test_a_message_is_no_subject_of_a_rule(folder: Path) -> None:
    """A parameter that is a message only the executive holds: KB203."""
    found = problems_with(folder, (is_a(core("Datum"), "?scan"), is_a(core("Robot"), "?robot")))
    assert ("KB203", "Ready") in {(p.code, p.entity) for p in found}
    assert any("IsTrue" in p.message for p in found)


HOSTILE = [
    "x'), halt, foo('",
    "_",
    "Robot",
    "robot\n:- halt.",
    "\u202erobot",
    "1",
    "frame",
    "'",
    "a b",
    "\\",
    "😀",
    "Frame",
]


@pytest.mark.parametrize("name", HOSTILE)
def test_names_of_variables_do_not_reach_prolog(folder: Path, name: str) -> None:
    """Whatever a variable is called, it is one variable of its own, and no text of it is read as Prolog."""
    variable = "?" + name.replace("\n", "%0A").replace(" ", "%20").replace("\\", "%5C")
    body = (has(core("locatedAt"), "?robot", variable), has(core("locatedAt"), "?drink", variable))
    for edit in asking(body):
        edit(folder)
    condition, _ = compiled(closed(folder))
    text = render(condition)
    [typed] = condition.args[0] if isinstance(condition, Struct) and isinstance(condition.args[0], list) else []
    own = typed.args[0] if isinstance(typed, Struct) else typed
    assert isinstance(own, Var)
    assert own.name.startswith("_1_")
    drawn = f"holds(locatedAt,Robot,{own.name}),holds(locatedAt,Drink,{own.name})"
    assert text == f"some(['-'({own.name},'Location')],all([{drawn}]))"


@pytest.mark.parametrize("text", ["'), halt, foo('", "x\ny", "", "it's", "\\", "日本", "[]", "X", "a.b"])
def test_literals_come_over_as_they_are(folder: Path, text: str) -> None:
    """A string of a rule is an atom of the same characters in Prolog."""
    value: Argument = f'"{text}"'
    for edit in asking((has_data(core("isEmpty"), "?drink", value),)):
        edit(folder)
    condition, _ = compiled(closed(folder))
    assert condition == struct("holds", "isEmpty", Var("Drink"), text)
    assert isinstance(condition, Struct)
    assert ask(struct("=", Var("Answer"), condition.args[2])) == text


def test_effects_change_what_a_rule_asks_for(folder: Path) -> None:
    """A loaded rule is asked of the present, and its individuals are known to Prolog, whatever they are."""
    for edit in asking((AT_ROBOT, AT_DRINK, is_a(core("Location"), "?place"), is_a(core("Sensor"), "?sensor"))):
        edit(folder)
    individual(TASK, "lone_sensor", "Sensor")(folder)
    knowledge = KnowledgeBase("tue_lab", folder)
    try:
        revision = knowledge.snapshot().revision
        drink = next(iter(knowledge.snapshot().ontology.individuals("Drink")))
        robot = next(iter(knowledge.snapshot().ontology.individuals("Robot")))
        place = str(knowledge.snapshot().value("locatedAt", drink))
        assert answer(revision, robot, drink) == "no"
        knowledge.tell("locatedAt", robot, place)
        assert answer(revision, robot, drink) == "yes"
        knowledge.tell("locatedAt", drink, "elsewhere")
        assert answer(revision, robot, drink) == "no"
    finally:
        knowledge.close()


def answer(revision: int, robot: str, drink: str) -> object:
    """Whether the rule that has two variables holds now."""
    head = Struct("SearchDrink", (robot, Var("Area"), drink, Var("Location"), Var("Position")))
    asked = struct(
        ",",
        struct(":", "kb_facts", struct("precondition", revision, head, Var("C"))),
        struct("=", Var("C"), struct("some", [Var("V1"), Var("V2")], Var("Body"))),
    )
    situation = struct("situation", revision, struct("plan", "t"), 1, 0, Var("S"))
    goals = [
        struct("load_files", struct("planner_golog", "conditions"), [struct("if", "not_loaded")]),
        struct(":", "planner_projection", situation),
        asked,
        struct(":", "planner_conditions", struct("asked", Var("C"), Var("S"), Var("Answer"))),
    ]
    goal = goals.pop()
    while goals:
        goal = struct(",", goals.pop(), goal)
    return ask(goal)
