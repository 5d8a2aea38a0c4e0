"""Questions in Python."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from kb.names import UnknownName
from kb.query import Origin, Questions
from kb.store import KnowledgeBase


@pytest.fixture
def knowledge() -> Iterator[KnowledgeBase]:
    """A knowledge base of the shipped site that a test may tell things."""
    knowledge = KnowledgeBase("tue_lab")
    yield knowledge
    knowledge.close()


@pytest.fixture
def questions(shipped: KnowledgeBase) -> Questions:
    """About the shipped site."""
    return Questions(shipped.snapshot())


def test_individuals_of_a_class_stated_or_not(questions: Questions) -> None:
    """A robot's model is stated, that it is a robot follows."""
    assert questions.individuals("Robot") == ["amigo_1", "pico_1"]
    assert questions.individuals("Robot", stated=True) == []
    assert questions.individuals("Amigo", stated=True) == ["amigo_1"]
    assert questions.kinds("amigo_1", stated=True) == ["Amigo"]
    assert "RobotWithKinect" in questions.kinds("amigo_1")


def test_facts_have_origin_and_place(knowledge: KnowledgeBase) -> None:
    """Stated in a file, inferred from a class, told since."""
    knowledge.tell("locatedAt", "drink_1", "at_bar")
    facts = {(f.prop, f.value): f for f in Questions(knowledge.snapshot()).facts("drink_1")}
    told, stated = facts["locatedAt", "at_bar"], facts["isEmpty", True]
    inferred = facts["hasDisposeLocation", "trash_bin_1"]
    assert (told.origin, told.place) == (Origin.TOLD, None)
    assert (inferred.origin, inferred.place) == (Origin.INFERRED, None)
    assert stated.origin is Origin.STATED
    assert stated.place is not None
    line = stated.place.file.read_text(encoding="utf-8").splitlines()[stated.place.line - 1]
    assert "#drink_1" in line


def test_values_and_where_things_are(knowledge: KnowledgeBase) -> None:
    """As they are now."""
    knowledge.tell("locatedAt", "drink_1", "at_bar")
    questions = Questions(knowledge.snapshot())
    assert questions.where("drink_1") == "at_bar"
    assert questions.at("at_bar") == ["drink_1"]
    assert {"drink_1", "at_bar", "bar_1"} <= set(questions.at("kitchen"))
    assert questions.values("inArea", "at_bar") == ("kitchen", "tue_lab")
    assert questions.values("inArea", "at_bar", stated=True) == ("kitchen",)
    assert questions.value("hasOdometry", "amigo_1") is None


def test_tasks_recipes_and_robots(questions: Questions) -> None:
    """What takes individuals can be asked for."""
    assert {"FindEmptyDrink", "SearchDrink", "Navigate"} <= set(questions.tasks())
    assert not {"Detection", "Base"} & set(questions.tasks())
    assert questions.recipes("SearchDrink") == ["SearchDrink"]
    assert questions.robots_able("SearchDrink") == questions.robots_able("SearchDrink", now=True)
    assert questions.robots_able("FindEmptyDrink") == ["amigo_1", "pico_1"]
    assert "SearchDrink" in questions.tasks_of("pico_1")


def _text(value: object) -> str:
    """A value as SPARQL gives it, in small letters."""
    return f"{value:g}" if isinstance(value, float) else str(value).lower()


def test_answers_agree_with_sparql(questions: Questions) -> None:
    """Every value that Python gives is in the graph, and no other value of that property."""
    for name in ("drink_1", "pico_1", "at_bar"):
        for prop in {f.prop for f in questions.facts(name)}:
            found = questions.sparql(f"SELECT ?v {{ tue_lab:{name} core:{prop} ?v }}")
            values = sorted(_text(v) for v in questions.values(prop, name))
            cells = [row[0] for row in found.rows]
            assert sorted(c.value.rsplit("#", 1)[-1].lower() for c in cells if c) == values, prop


@pytest.mark.parametrize(
    ("question", "told"),
    [
        (lambda q: q.individuals("Robott"), "no class 'Robott'; did you mean Robot?"),
        (lambda q: q.value("locatedAt", "amigo"), "no individual 'amigo'; did you mean amigo_1?"),
        (lambda q: q.value("locatdAt", "amigo_1"), "no property 'locatdAt'; did you mean locatedAt?"),
        (lambda q: q.robots_able("Navigatee"), "no process 'Navigatee'; did you mean Navigate?"),
        (lambda q: q.tasks_of("drink_1"), "no robot 'drink_1'; there is amigo_1, pico_1"),
        (lambda q: q.recipes(""), "no process ''; there is"),
    ],
)
def test_what_is_not_known_is_named(questions: Questions, question: Callable[[Questions], Any], told: str) -> None:
    """With the nearest name, or what there is."""
    with pytest.raises(UnknownName) as unknown:
        question(questions)
    assert told in str(unknown.value)
