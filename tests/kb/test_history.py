"""What was told when, by whom, and what was known at a time."""

from __future__ import annotations

import pytest

from kb.history import Fact, History, HistoryForgotten, Known, Source, SourceKind, shown

PERSON = Source(kind=SourceKind.PERSON)


def fact(t_s: float, value: Known, before: Known = None, subject: str = "cup") -> Fact:
    """The cup is somewhere else."""
    return Fact(t_s=t_s, prop="locatedAt", subject=subject, value=value, before=before, source=PERSON)


def test_what_was_known_at_a_time() -> None:
    """What was told by then, over what was known before; what is not known is left out."""
    history = History({("locatedAt", "cup"): "shelf", ("isEmpty", "cup"): True})
    for told in (fact(1.0, "table", "shelf"), fact(2.0, "sink", "table"), fact(3.0, None, "sink")):
        history.note(told)
    assert history.known_at(0.5) == {("locatedAt", "cup"): "shelf", ("isEmpty", "cup"): True}
    assert history.known_at(1.0)["locatedAt", "cup"] == "table"
    assert history.known_at(2.5)["locatedAt", "cup"] == "sink"
    assert history.known_at(9.0) == {("isEmpty", "cup"): True}


def test_facts_of_one_property_or_individual() -> None:
    """In the order in which they were told."""
    history = History({})
    one, two, other = fact(1.0, "table"), fact(2.0, "sink"), fact(3.0, "sink", subject="jar")
    for told in (one, two, other):
        history.note(told)
    assert history.of() == (one, two, other)
    assert history.of("locatedAt", "cup") == (one, two)
    assert history.of(subject="jar") == (other,)
    assert history.of("isEmpty") == ()


def test_memory_is_bounded() -> None:
    """The oldest facts are folded into where the history begins; what was before that is said to be forgotten."""
    history = History({("locatedAt", "cup"): "shelf"}, limit=2)
    for n in range(5):
        history.note(fact(float(n), f"place_{n}"))
    assert [f.value for f in history.of()] == ["place_3", "place_4"]
    assert history.known_at(2.0)["locatedAt", "cup"] == "place_2"
    assert history.known_at(3.5)["locatedAt", "cup"] == "place_3"
    with pytest.raises(HistoryForgotten, match="ask for a time from 2 s on"):
        history.known_at(1.5)


def test_facts_are_told_in_a_line() -> None:
    """When, what, from what, by whom."""
    by = Source(kind=SourceKind.ACTION, task="Tidy-1", action="Put(r1,cup)", robot="r1")
    told = Fact(t_s=1.25, prop="locatedAt", subject="cup", value="sink", before=None, source=by)
    assert str(told) == "1.250 s  locatedAt(cup): not known -> sink  (effect of Put(r1,cup) of Tidy-1)"
    assert str(Source(kind=SourceKind.FILES, revision=3)) == "stated in files, revision 3"
    assert [shown(v) for v in (True, 0.5, [1.0, 2.5], "x")] == ["true", "0.5", "[1, 2.5]", "x"]
