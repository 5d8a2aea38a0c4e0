"""SWRL rules are read as Protégé writes them, and refused by name where a condition cannot say them."""

from __future__ import annotations

from pathlib import Path

import pytest
from rdflib import RDF, Literal, Namespace

from kb.axioms import without_rules
from kb.files import read_files
from kb.store import KnowledgeBase
from kb.swrl import BuiltInAtom, ClassAtom, PropertyAtom, SameAtom, read_rules
from kb.terms import Var
from tests.kb.conftest import SITE, TASK, Edit, added, given, individual, link
from tests.kb.faults import problems_of
from tests.kb.rules import (
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

CONDITION = individual(TASK, "Ready", "RuleCondition")
READY = named(TASK, "Ready")


def edited(folder: Path, *edits: Edit) -> Path:
    """A folder after some edits."""
    for edit in edits:
        edit(folder)
    return folder


def test_all_kinds_of_atoms_are_read_in_their_order(folder: Path) -> None:
    """What a body may say, as values."""
    body = (
        is_a(core("Location"), "?place"),
        has(core("locatedAt"), "?robot", "?place"),
        has_data(core("energy_J"), "?robot", "?e"),
        has_data(core("keepsRobot"), named(TASK, "SearchDrink"), True),
        same("?place", named(TASK, "SearchDrink")),
        different("?place", "?robot"),
        built_in("add", "?sum", "?e", 1, 2.5),
        built_in("equal", "?sum", '"a text"'),
    )
    [read] = read_rules(closed(edited(folder, CONDITION, rule(TASK, satisfied(READY), *body, label="there")))).of[
        "Ready"
    ]
    assert (read.name, read.condition) == ("there", "Ready")
    assert read.body == (
        ClassAtom(kind="Location", individual=Var("place")),
        PropertyAtom(prop="locatedAt", subject=Var("robot"), value=Var("place"), of_data=False),
        PropertyAtom(prop="energy_J", subject=Var("robot"), value=Var("e"), of_data=True),
        PropertyAtom(prop="keepsRobot", subject="SearchDrink", value=True, of_data=True),
        SameAtom(one=Var("place"), other="SearchDrink", wanted=True),
        SameAtom(one=Var("place"), other=Var("robot"), wanted=False),
        BuiltInAtom(name="add", arguments=(Var("sum"), Var("e"), 1, 2.5)),
        BuiltInAtom(name="equal", arguments=(Var("sum"), "a text")),
    )


def test_a_class_of_everything_says_nothing(folder: Path) -> None:
    """Protégé needs some atom where there is nothing to ask for."""
    everything = "http://www.w3.org/2002/07/owl#Thing"
    edits = (CONDITION, rule(TASK, satisfied(READY), is_a(everything, "?robot"), enabled=None))
    [read] = read_rules(closed(edited(folder, *edits))).of["Ready"]
    assert read.body == ()


def test_variables_may_be_named_as_in_older_files(folder: Path) -> None:
    """`urn:swrl#x` of OWL API 4, and IRIs of the file itself of Protégé 3, are variables like `urn:swrl:var#x`."""
    edits = [CONDITION, rule(TASK, satisfied(READY), is_a(core("Robot"), "?robot"), is_a(core("Robot"), "?other"))]
    edited(folder, *edits)
    text = (folder / TASK).read_text(encoding="utf-8")
    text = text.replace("urn:swrl:var#robot", "urn:swrl#robot")
    (folder / TASK).write_text(text.replace("urn:swrl:var#other", named(TASK, "other")), encoding="utf-8")
    [read] = read_rules(closed(folder)).of["Ready"]
    assert [a.individual for a in read.body if isinstance(a, ClassAtom)] == [Var("robot"), Var("other")]


def test_several_rules_for_one_condition_are_kept_in_one_order(folder: Path) -> None:
    """Which stands first in the file does not matter."""
    one = rule(TASK, satisfied(READY), is_a(core("Robot"), "?robot"), label="one")
    two = rule(TASK, satisfied(READY), is_a(core("Area"), "?robot"), label="two")
    first = read_rules(closed(edited(folder, CONDITION, one, two))).of["Ready"]
    assert [r.name for r in first] == ["one", "two"]


def test_a_rule_that_is_switched_off_counts_for_nothing(folder: Path) -> None:
    """Not even its faults do; a condition with no other rule is told so."""
    edits = (CONDITION, rule(TASK, satisfied(READY), built_in("pow", "?a", 2, 3), enabled=False))
    rules = read_rules(closed(edited(folder, *edits)))
    assert "Ready" not in rules.of
    [problem] = rules.problems
    assert (problem.code, problem.entity) == ("KB206", "Ready")
    assert "switched off" in problem.message


def test_a_condition_without_a_rule(folder: Path) -> None:
    """Nothing says when it is satisfied: KB206, at the condition."""
    [problem] = read_rules(closed(edited(folder, CONDITION))).problems
    assert (problem.code, problem.entity, problem.file) == ("KB206", "Ready", folder / TASK)
    assert "satisfied(Ready, true)" in problem.message


@pytest.mark.parametrize(
    ("atom", "words"),
    [
        (built_in("pow", "?a", 2, 3), "built-in pow|equal, notEqual, lessThan, lessThanOrEqual, greaterThan|multiply"),
        (built_in("stringConcat", "?a", '"x"', '"y"'), "built-in stringConcat|add, subtract, multiply"),
        (built_in("lessThan", "?a"), "lessThan 1 arguments|takes two"),
        (built_in("subtract", "?a", 1, 2, 3), "subtract 4 arguments|takes three"),
        (built_in("add", "?a", 1), "add 2 arguments|three or more"),
        (satisfied(READY), "another condition|AllOf"),
        (is_a("", "?robot").replace('<swrl:classPredicate rdf:resource=""/>', ""), "not whole"),
        (
            is_a("", "?robot").replace(
                '<swrl:classPredicate rdf:resource=""/>',
                "<swrl:classPredicate><owl:Class><owl:complementOf rdf:resource="
                f'"{core("Robot")}"/></owl:Class></swrl:classPredicate>',
            ),
            "class expression|name the class",
        ),
        (is_a(core("Robot"), "?robot").replace("#ClassAtom", "#DataRangeAtom"), "data range"),
        (is_a(core("Robot"), "?robot").replace("#ClassAtom", "#Imp"), "no kind that we know"),
    ],
)
def test_what_a_condition_cannot_say(folder: Path, atom: str, words: str) -> None:
    """An atom that nothing can be made of is KB203, in words that say which and what there is instead."""
    edits = (CONDITION, rule(TASK, satisfied(READY), is_a(core("Robot"), "?robot"), atom, label="odd"))
    problems = [p for p in read_rules(closed(edited(folder, *edits))).problems if p.code != "KB207"]
    assert [(p.code, p.entity, p.file) for p in problems] == [("KB203", "Ready", folder / TASK)]
    for word in ("its rule 'odd'", *words.split("|")):
        assert word in problems[0].message


@pytest.mark.parametrize(
    "head",
    [
        is_a(core("Robot"), "?robot"),
        satisfied(READY, value=False),
        satisfied("?robot"),
        satisfied(named(TASK, "SearchDrink")),
        has_data(core("energy_J"), READY, 1.0),
    ],
)
def test_a_rule_that_concludes_anything_else(folder: Path, head: str) -> None:
    """General knowledge in a rule is refused, KB207, where the rule stands: it would not be used."""
    good = rule(TASK, satisfied(READY), is_a(core("Robot"), "?robot"), label="good")
    bad = rule(TASK, head, is_a(core("Robot"), "?robot"), label="bad & odd")
    [problem] = read_rules(closed(edited(folder, CONDITION, good, bad))).problems
    assert (problem.code, problem.entity, problem.file) == ("KB207", "bad & odd", folder / TASK)
    assert "satisfied(C, true)" in problem.message
    assert "bad &amp; odd" in (folder / TASK).read_text(encoding="utf-8").splitlines()[problem.line - 1]


def test_a_list_that_ends_in_itself(folder: Path) -> None:
    """A body that an editor has spoilt is refused, and reading it comes to an end."""
    swrl = "http://www.w3.org/2003/11/swrl#"
    loop = (
        f'<rdf:Description xmlns:swrl="{swrl}" rdf:about="urn:x#rule"><rdf:type rdf:resource="{swrl}Imp"/>'
        f'<swrl:body rdf:resource="urn:x#cell"/><swrl:head rdf:resource="urn:x#head"/></rdf:Description>'
        f'<rdf:Description rdf:about="urn:x#cell"><rdf:first>{is_a(core("Robot"), "?robot")}</rdf:first>'
        f'<rdf:rest rdf:resource="urn:x#cell"/></rdf:Description>'
        f'<rdf:Description rdf:about="urn:x#head"><rdf:first>{satisfied(READY)}</rdf:first>'
        '<rdf:rest rdf:resource="http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"/></rdf:Description>'
    ).replace("<rdf:Description><rdf:type", f'<rdf:Description xmlns:swrl="{swrl}"><rdf:type')
    [problem] = read_rules(closed(edited(folder, CONDITION, added(TASK, loop)))).problems
    assert (problem.code, problem.entity) == ("KB203", "Ready")
    assert "not whole" in problem.message


def test_reasoners_do_not_see_rules(folder: Path) -> None:
    """What they are given is the same with a rule as without, but for the condition itself."""
    before = without_rules(read_files(folder / SITE, folder).merged())
    edits = (CONDITION, rule(TASK, satisfied(READY), built_in("lessThan", "?a", 3), is_a(core("Robot"), "?a")))
    graph = without_rules(read_files(edited(folder, *edits) / SITE, folder).merged())
    swrl = Namespace("http://www.w3.org/2003/11/swrl#")
    assert not {t for t in graph if any(str(node).startswith((str(swrl), "urn:swrl")) for node in t)}
    assert not set(graph.subjects(RDF.first, Literal(3)))
    assert len(graph) - len(before) == 2  # Ready is a RuleCondition and an individual


def test_a_site_loads_with_a_rule_of_built_ins_and_without_its_condition_asked(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """HermiT gives up at a built-in and does not get one, nor does what explains a contradiction."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    asked = given(TASK, "SearchDrink", link("hasPrecondition", TASK, "Ready"))
    body = has_data(core("energy_J"), "?robot", "?e"), built_in("greaterThan", "?e", 0.0)
    edited(folder, CONDITION, asked, rule(TASK, satisfied(READY), *body))
    knowledge = KnowledgeBase("tue_lab", folder)
    knowledge.close()
    given(TASK, "Ready", f'<rdf:type rdf:resource="{core("Robot")}"/>')(folder)
    assert {p.code for p in problems_of(folder)} >= {"KB301"}
