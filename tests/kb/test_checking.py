import re
from pathlib import Path

import pytest

from kb.errors import KnowledgeError
from kb.store import KnowledgeBase, UnknownSite
from kb.terms import Var, struct
from tests.kb.conftest import NAVIGATION, OBJECTS, SITE, ask, dropped, given, link, renamed
from tests.kb.faults import problems_of, travel_duration


def test_travel_may_be_estimated_twice_in_the_same_way(folder: Path) -> None:
    """Two travel durations that name the same service and fields are one estimate."""
    travel_duration("Other_duration", "/compute/travel", "map_file", "radius_m", "max_vel_lin_mps")(folder)
    knowledge = KnowledgeBase("tue_lab", folder)
    assert len(knowledge.snapshot().travel_estimates) == 1
    knowledge.close()


def test_several_faults_are_told_at_once(folder: Path) -> None:
    """A person gets the whole list, in order of file and line."""
    for case in (dropped(SITE, "at_bar", "inArea"), dropped(NAVIGATION, "Laser", "duration_s")):
        case(folder)
    problems = problems_of(folder)
    assert [p.code for p in problems] == ["KB140", "KB160"]
    assert [p.file.name for p in problems] == ["tue_lab.owl", "navigation.owl"]


def test_a_file_that_does_not_parse_hides_no_fault_of_others(folder: Path) -> None:
    """What is wrong whatever that file may say is told beside it; what may only be missing is not."""
    (folder / OBJECTS).write_text("<", encoding="utf-8")
    given(SITE, "amigo_1", '<rdfs:label xml:lang="en">the tall one</rdfs:label>')(folder)
    given(SITE, "amigo_1", link("locatedAt", SITE, "at_bar"))(folder)
    assert {(p.code, p.entity) for p in problems_of(folder)} == {
        ("KB001", ""),
        ("KB018", "amigo_1"),
        ("KB143", "amigo_1"),
    }
    renamed(NAVIGATION, "Laser", ">0.008<", ">0,008<")(folder)
    assert {p.code for p in problems_of(folder)} == {"KB001", "KB012"}


def test_a_message_is_one_line_for_a_person(folder: Path) -> None:
    """File, line, code, entity, what is wrong; IRIs are shortened."""
    dropped(NAVIGATION, "Laser", "duration_s")(folder)
    with pytest.raises(KnowledgeError) as caught:
        KnowledgeBase("tue_lab", folder)
    assert re.fullmatch(r".*/tasks/navigation\.owl:\d+ KB160 error Laser: needs one duration_s .*", str(caught.value))
    assert "http://" not in str(caught.value)


def test_an_unknown_site_names_those_there_are(folder: Path) -> None:
    """A misspelt site is answered with the known ones."""
    with pytest.raises(UnknownSite) as caught:
        KnowledgeBase("tue_lob", folder)
    assert (caught.value.site, caught.value.known) == ("tue_lob", ["tue_lab", "ward"])
    assert re.search(r"'tue_lob' in .*there is tue_lab, ward", str(caught.value))


def test_a_refused_load_changes_nothing(folder: Path, shipped: KnowledgeBase) -> None:
    """What was open before answers as before, in Python and in Prolog."""
    facts = struct(
        "aggregate_all",
        "count",
        struct(
            ",",
            struct("member", struct("/", Var("N"), Var("A")), [struct("/", "kind", 3), struct("/", "definition", 4)]),
            struct(
                ",", struct("functor", Var("H"), Var("N"), Var("A")), struct("call", struct(":", "kb_facts", Var("H")))
            ),
        ),
        Var("Answer"),
    )
    before, count = shipped.snapshot(), ask(facts)
    renamed(NAVIGATION, "Localize_20_Laser", "#Laser", "#Localize")(folder)
    problems_of(folder)
    after = shipped.snapshot()
    assert (after.revision, after.state, after.fluents) == (before.revision, before.state, before.fluents)
    assert after.program("FindEmptyDrink") == before.program("FindEmptyDrink")
    assert ask(facts) == count > 0
