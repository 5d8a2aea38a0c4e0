from collections.abc import Iterator
from pathlib import Path
from threading import Event, Thread

import pytest

from kb.files import SHIPPED
from kb.history import Source, SourceKind
from kb.problems import OntologyRejected
from kb.revisions import renewed
from kb.store import KnowledgeBase, ProposalOutdated, UnknownRevision
from kb.terms import Var, struct
from tests.kb.conftest import SITE, ask, count, dropped, renamed

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


# Revisions


def facts_of(key: int) -> int:
    """How many facts Prolog holds of a revision."""
    return sum(count(fact, key, arity) for fact, arity in FACTS.items())


@pytest.fixture
def edited(folder: Path) -> Path:
    """A folder whose files say that drink_1 is at the cabinet."""
    renamed(SITE, "drink_1", "#at_coffee_table", "#at_cabinet")(folder)
    return folder


def test_what_is_proposed_changes_nothing_until_it_is_accepted(knowledge: KnowledgeBase, edited: Path) -> None:
    """Then all at once; snapshots of before stay as they are, and facts of before leave Prolog."""
    knowledge.tell("isEmpty", "drink_2", False, t_s=1.0)
    before = knowledge.snapshot()
    proposal = knowledge.propose(knowledge.read(edited))
    assert knowledge.snapshot() == before
    assert proposal.snapshot.value("locatedAt", "drink_1") == "at_cabinet"
    assert "locatedAt(drink_1) is at_cabinet from now on, as the files say" in proposal.text
    knowledge.tell("isEmpty", "drink_1", False, t_s=2.0)  # meanwhile, life goes on
    knowledge.accept(proposal, t_s=3.0)
    after = knowledge.snapshot()
    assert (before.number, after.number) == (1, 2)
    assert before.value("locatedAt", "drink_1") == "at_coffee_table"
    assert after.value("locatedAt", "drink_1") == "at_cabinet"
    for prop, subject, value in (("locatedAt", "drink_1", "at_cabinet"), ("isEmpty", "drink_1", False)):
        assert told(knowledge, prop, subject) == [value]
    assert (after.value("isEmpty", "drink_1"), after.value("isEmpty", "drink_2")) == (False, False)
    assert facts_of(before.revision) == 0
    with pytest.raises(ProposalOutdated):
        knowledge.accept(proposal)


def test_what_is_told_of_something_that_a_proposal_does_not_know(knowledge: KnowledgeBase, folder: Path) -> None:
    """Nothing is known of it then, though something else had been when it was proposed."""
    for file in folder.rglob("*.owl"):
        file.write_text(file.read_text(encoding="utf-8").replace("#at_bar", "#at_counter"), encoding="utf-8")
    dropped(SITE, "drink_1", "locatedAt")(folder)
    knowledge.tell("locatedAt", "drink_1", "at_cabinet")
    proposal = knowledge.propose(knowledge.read(folder))
    knowledge.tell("locatedAt", "drink_1", "at_bar")
    knowledge.tell("isEmpty", "drink_1", False)
    assert knowledge.accept(proposal).dropped == {("locatedAt", "drink_1"): "there is no at_bar any more"}
    assert ("locatedAt", "drink_1") not in knowledge.snapshot().fluents
    assert told(knowledge, "locatedAt", "drink_1") == []
    assert told(knowledge, "isEmpty", "drink_1") == [False]


def test_facts_stay_as_long_as_somebody_uses_them(knowledge: KnowledgeBase, edited: Path) -> None:
    """Until the last one lets go; those of a proposal that is withdrawn go at once."""
    before = knowledge.snapshot()
    with knowledge.in_use(before):
        knowledge.hold(before)
        knowledge.accept(knowledge.propose(knowledge.read(edited)))
        assert facts_of(before.revision) > 0
    assert facts_of(before.revision) > 0
    knowledge.let_go(before)
    assert facts_of(before.revision) == 0
    proposal = knowledge.propose(knowledge.read(SHIPPED))
    assert facts_of(proposal.revision.key) > 0
    knowledge.withdraw(proposal)
    assert facts_of(proposal.revision.key) == 0


def test_wrong_files_leave_everything_as_it_is(knowledge: KnowledgeBase, folder: Path) -> None:
    """No fact, no number, no proposal."""
    before = knowledge.snapshot()
    dropped(SITE, "at_bar", "poseX_m")(folder)
    with pytest.raises(OntologyRejected):
        knowledge.read(folder)
    assert knowledge.snapshot() == before
    assert knowledge.proposal is None
    assert [r.number for r in knowledge.revisions] == [1]


def test_rolling_back(knowledge: KnowledgeBase, edited: Path) -> None:
    """The earlier revision as it was, with what has been told since; forward again as well."""
    knowledge.accept(knowledge.propose(knowledge.read(edited)), t_s=1.0)
    knowledge.tell("isEmpty", "drink_1", False, t_s=2.0)
    for number, place in ((1, "at_coffee_table"), (2, "at_cabinet"), (1, "at_coffee_table")):
        proposal = knowledge.propose_earlier(number)
        assert proposal.earlier
        knowledge.accept(proposal, t_s=3.0)
        assert knowledge.snapshot().number == number
        assert told(knowledge, "locatedAt", "drink_1") == [place]
        assert told(knowledge, "isEmpty", "drink_1") == [False]
    assert facts_of(knowledge.snapshot().revision) > 0
    with pytest.raises(UnknownRevision, match="no revision 1 to go back to; there is 2"):
        knowledge.propose_earlier(1)


def test_only_the_last_revisions_are_kept(knowledge: KnowledgeBase, monkeypatch: pytest.MonkeyPatch) -> None:
    """Which was in force longest ago is forgotten first; its number is not given again."""
    monkeypatch.setattr("kb.store.KEPT_REVISIONS", 3)
    same = knowledge.read()
    for _ in range(2):
        knowledge.accept(knowledge.propose(renewed(same)))
    knowledge.accept(knowledge.propose_earlier(1))
    assert [r.number for r in knowledge.revisions] == [1, 2, 3]
    knowledge.accept(knowledge.propose(renewed(same)))
    knowledge.accept(knowledge.propose(renewed(same)))
    assert [r.number for r in knowledge.revisions] == [1, 4, 5]
    with pytest.raises(UnknownRevision, match="no revision 3 to go back to; there is 1, 4"):
        knowledge.propose_earlier(3)


def test_where_facts_come_from(knowledge: KnowledgeBase, edited: Path) -> None:
    """Each with its time, source, and what was so before; and what was known at a time."""
    by = Source(kind=SourceKind.ACTION, task="Tidy-1", action="Put(amigo_1)", robot="amigo_1")
    knowledge.tell("isEmpty", "drink_2", False, t_s=1.0, source=by)
    knowledge.accept(knowledge.propose(knowledge.read(edited)), t_s=2.0)
    action, files = knowledge.history()
    assert (action.t_s, action.value, action.before, action.source) == (1.0, False, True, by)
    assert (files.prop, files.value, files.before) == ("locatedAt", "at_cabinet", "at_coffee_table")
    assert (files.source.kind, files.source.revision) == (SourceKind.FILES, 2)
    assert knowledge.history("isEmpty", "drink_2") == (action,)
    assert knowledge.known_at(0.0)["isEmpty", "drink_2"] is True
    assert knowledge.known_at(1.5)["isEmpty", "drink_2"] is False
    assert knowledge.known_at(1.5)["locatedAt", "drink_1"] == "at_coffee_table"
    assert knowledge.known_at(2.0)["locatedAt", "drink_1"] == "at_cabinet"


def test_readers_see_whole_states(knowledge: KnowledgeBase, edited: Path) -> None:
    """One thread goes back and forth between revisions and tells; others never see a mixture."""
    knowledge.accept(knowledge.propose(knowledge.read(edited)))
    places = {1: "at_coffee_table", 2: "at_cabinet"}
    wrong: list[tuple[int, object]] = []
    ended = Event()

    def look() -> None:
        while not ended.is_set():
            seen = knowledge.snapshot()
            found = [seen.fluents["locatedAt", "drink_1"] for _ in range(2)]
            if found != [places[seen.number]] * 2:
                wrong.append((seen.number, found))

    readers = [Thread(target=look) for _ in range(2)]
    for reader in readers:
        reader.start()
    for number in (1, 2) * 5:
        knowledge.accept(knowledge.propose_earlier(number))
        for value in (True, False) * 5:
            knowledge.tell("isEmpty", "drink_2", value)
    ended.set()
    for reader in readers:
        reader.join()
    assert wrong == []


def test_snapshots_share_what_has_not_changed(knowledge: KnowledgeBase) -> None:
    """Two snapshots with nothing told in between hold the same facts, not copies; later ones have their own."""
    one, two = knowledge.snapshot(), knowledge.snapshot()
    knowledge.tell("isEmpty", "drink_1", False)
    three = knowledge.snapshot()
    assert one.fluents == two.fluents != three.fluents
    assert one.processes is two.processes is three.processes
