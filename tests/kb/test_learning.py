"""What is learned from tries and trips."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kb.experience import Experience, Tries, Trip
from kb.learning import FEWEST, Lesson, learn, winsorized
from kb.ontology import Ontology
from kb.store import KnowledgeBase
from kb.vocabulary import Property


@pytest.fixture(scope="session")
def stated(shipped: KnowledgeBase) -> Ontology:
    """What is stated of the shipped site."""
    return shipped.snapshot().ontology


def tried(ms: int, count: int = 1, *, process: str = "Kinect", succeeded: bool = True) -> Tries:
    """Tries that took so long."""
    return Tries(process=process, robot="amigo_1", place="", took_ms=ms, succeeded=succeeded, count=count)


def trip(way_ms: int, took_ms: int, robot: str = "amigo_1") -> Trip:
    """A trip of a robot."""
    return Trip(process="Navigate", robot=robot, place="at_bar", way_ms=way_ms, took_ms=took_ms)


def learned(lessons: list[Lesson], prop: Property, subject: str) -> Lesson:
    """The one lesson about a property of a process or robot."""
    [found] = [one for one in lessons if (one.prop, one.subject) == (prop, subject)]
    return found


def test_few_tries_change_little_and_many_decide(stated: Ontology) -> None:
    """From 0.08 s as stated to 0.16 s as measured: a third of the way with 5 tries, all of it with 1000."""
    few, many = (learned(learn([tried(160, n)], [], stated), Property.DURATION_S, "Kinect") for n in (5, 1000))
    assert few.learned == round((10 * 0.08 + 5 * 0.16) / 15, 3)
    assert (many.learned, many.tries, many.stated) == (0.159, 1000, 0.08)
    assert few.low < few.learned < few.high < 0.16
    assert 0.15 < many.low < many.learned < many.high
    assert many.high - many.low < few.high - few.low


def test_from_too_few_tries_nothing_is_learned(stated: Ontology) -> None:
    """Nor from tries of what is not known any more."""
    assert learn([tried(160, FEWEST - 1)], [trip(1000, 9000)], stated) == []
    assert learn([tried(160, 100, process="Gone")], [], stated) == []


def test_what_is_as_stated_differs_in_nothing(stated: Ontology) -> None:
    """A thousand tries of 0.08 s that succeed."""
    assert [one.differs for one in learn([tried(80, 1000)], [], stated)] == [False, False]


def test_odds_are_the_mean_of_a_beta(stated: Ontology) -> None:
    """90 of 100, with 10 stated successes: 100 of 110."""
    odds = learned(learn([tried(80, 90), tried(80, 10, succeeded=False)], [], stated), Property.SUCCESS_ODDS, "Kinect")
    assert odds.learned == round(100 / 110, 4)
    assert 0.84 < odds.low < odds.learned < odds.high < 0.96


def test_a_single_outlier_hardly_counts(stated: Ontology) -> None:
    """One try of an hour among 40 of 0.08 s; but what is slow one time in three does count."""
    once = learned(learn([tried(80, 40), tried(3_600_000)], [], stated), Property.DURATION_S, "Kinect")
    assert once.learned == 0.08
    often = learned(learn([tried(80, 400), tried(1080, 200)], [], stated), Property.DURATION_S, "Kinect")
    assert often.learned == pytest.approx(0.08 + 1 / 3, abs=0.01)


def test_winsorizing_moves_the_extremes() -> None:
    """One of ten at each end; of two, none."""
    assert winsorized(np.array([9.0, 1, 2, 3, 4, 5, 6, 7, 8, 100])).tolist() == [9, 2, 2, 3, 4, 5, 6, 7, 8, 9]
    assert winsorized(np.array([1.0, 100])).tolist() == [1, 100]


def test_travel_factors_are_told_apart_from_what_comes_on_top(stated: Ontology) -> None:
    """Robots that take 1.4 and 0.9 times as long as estimated, and 2.5 s to start and to turn, from noisy trips."""
    rng = np.random.default_rng(7)
    trips = [
        trip(int(way), int(factor * way + 2500 + rng.normal(0, 100)), robot)
        for robot, factor in (("amigo_1", 1.4), ("pico_1", 0.9))
        for way in rng.uniform(1000, 20000, 200)
    ]
    lessons = learn([], trips, stated)
    amigo, pico = (learned(lessons, Property.TRAVEL_FACTOR, r) for r in ("amigo_1", "pico_1"))
    assert amigo.learned == pytest.approx(1.4, abs=0.05)
    assert pico.learned == pytest.approx(0.9, abs=0.05)
    assert learned(lessons, Property.DURATION_S, "Navigate").learned == pytest.approx(2.5, abs=0.4)
    assert amigo.low < amigo.learned < amigo.high
    assert amigo.tries == 200
    few = learn([], trips[:3] + trips[200:203], stated)
    assert 1.0 < learned(few, Property.TRAVEL_FACTOR, "amigo_1").learned < 1.4


def test_experience_is_kept_by_site_and_a_trace_counts_once(tmp_path: Path) -> None:
    """Also where several add to the same file."""
    experience = Experience(tmp_path / "new" / "experience.sqlite")
    assert experience.add("a", "lab", [tried(80, 2), tried(90)], [trip(1000, 1500)])
    assert not experience.add("a", "lab", [tried(80, 2)], [])
    assert Experience(tmp_path / "new" / "experience.sqlite").add("b", "lab", [tried(80, 3)], [])
    assert experience.add("c", "elsewhere", [tried(80, 100)], [])
    assert experience.traces("lab") == 2
    assert experience.tries("lab") == [tried(80, 5), tried(90)]
    assert experience.trips("lab") == [trip(1000, 1500)]
