from collections.abc import Iterator
from pathlib import Path

import pytest

from kb.store import KnowledgeBase
from kb.terms import Var, struct
from tests.kb.conftest import ask, count

FACTS = {
    "kind": 3,
    "value": 4,
    "fluent": 4,
    "definition": 4,
    "duration": 3,
    "requires": 3,
    "agent": 3,
}


@pytest.fixture
def knowledge() -> Iterator[KnowledgeBase]:
    """A knowledge base of the shipped site that a test may tell things."""
    knowledge = KnowledgeBase("tue_lab")
    yield knowledge
    knowledge.close()


def told(knowledge: KnowledgeBase, prop: str, subject: str) -> list[object]:
    """The values of a fluent in Prolog."""
    fluent = struct(":", "kb_facts", struct("fluent", knowledge.snapshot().revision, prop, subject, Var("Value")))
    return list(ask(struct("findall", Var("Value"), fluent, Var("Answer"))))


def test_what_is_told_is_known_from_then_on(knowledge: KnowledgeBase) -> None:
    """A snapshot made before does not change; one made after has the new value, as has Prolog."""
    before = knowledge.snapshot()
    knowledge.tell("locatedAt", "amigo_1", "at_bar")
    after = knowledge.snapshot()
    assert (before.value("locatedAt", "amigo_1"), after.value("locatedAt", "amigo_1")) == ("start_west", "at_bar")
    assert (after.revision, after.state) == (before.revision, before.state + 1)
    assert told(knowledge, "locatedAt", "amigo_1") == ["at_bar"]


def test_telling_again_replaces(knowledge: KnowledgeBase) -> None:
    """A fluent has one value, whatever its type; others stay."""
    for value in (False, True, False):
        knowledge.tell("isEmpty", "drink_1", value)
        assert told(knowledge, "isEmpty", "drink_1") == [value]
        assert knowledge.snapshot().value("isEmpty", "drink_1") is value
    assert told(knowledge, "isEmpty", "drink_2") == [True]


def test_what_was_not_stated_can_be_told(knowledge: KnowledgeBase) -> None:
    """A fluent without a value in the files gets one, with any name."""
    assert knowledge.snapshot().value("hasPoseEstimate", "amigo_1") is None
    knowledge.tell("hasPoseEstimate", "amigo_1", "it's é")
    assert knowledge.snapshot().value("hasPoseEstimate", "amigo_1") == "it's é"
    assert told(knowledge, "hasPoseEstimate", "amigo_1") == ["it's é"]


def test_a_snapshot_can_not_be_changed(knowledge: KnowledgeBase) -> None:
    """The maps of a snapshot are read-only."""
    snapshot = knowledge.snapshot()
    with pytest.raises(TypeError):
        snapshot.fluents["locatedAt", "amigo_1"] = "at_bar"  # type: ignore[index]
    with pytest.raises(TypeError):
        snapshot.processes["Laser"] = snapshot.processes["Base"]  # type: ignore[index]


def test_two_knowledge_bases_do_not_mix(knowledge: KnowledgeBase, shipped: KnowledgeBase) -> None:
    """What one is told, the other does not know; each has all its facts."""
    knowledge.tell("locatedAt", "pico_1", "at_bar")
    assert knowledge.snapshot().revision != shipped.snapshot().revision
    assert shipped.snapshot().value("locatedAt", "pico_1") == "start_east"
    assert (told(knowledge, "locatedAt", "pico_1"), told(shipped, "locatedAt", "pico_1")) == (
        ["at_bar"],
        ["start_east"],
    )
    for fact, arity in FACTS.items():
        assert count(fact, knowledge.snapshot().revision, arity) == count(fact, shipped.snapshot().revision, arity) > 0


def test_closing_forgets_the_facts_of_one(shipped: KnowledgeBase) -> None:
    """No fact of a closed knowledge base is left, and none of another is gone."""
    closed = KnowledgeBase("tue_lab")
    revision = closed.snapshot().revision
    others = [count(fact, shipped.snapshot().revision, arity) for fact, arity in FACTS.items()]
    closed.close()
    assert [count(fact, revision, arity) for fact, arity in FACTS.items()] == [0] * len(FACTS)
    assert [count(fact, shipped.snapshot().revision, arity) for fact, arity in FACTS.items()] == others


def test_python_and_prolog_know_the_same(shipped: KnowledgeBase) -> None:
    """Every fluent of the snapshot is a fact, and the other way round."""
    snapshot = shipped.snapshot()
    assert count("fluent", snapshot.revision, 4) == len(snapshot.fluents) > 0
    for (prop, subject), value in snapshot.fluents.items():
        assert told(shipped, prop, subject) == [value]


def test_a_site_may_stand_anywhere(folder: Path) -> None:
    """A copied folder is loaded as the shipped one is; its files are its own."""
    knowledge = KnowledgeBase("tue_lab", folder)
    files = {f.file for g in knowledge.snapshot().groundings.values() for f in g.request if f.file}
    assert {folder / file.relative_to(folder) for file in files} == files != set()
    knowledge.close()
