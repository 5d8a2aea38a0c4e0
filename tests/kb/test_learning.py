"""What is learned from tries and trips."""

from __future__ import annotations

from dataclasses import replace
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


def tried(
    ms: int,
    count: int = 1,
    *,
    process: str = "Kinect",
    robot: str = "amigo_1",
    place: str = "",
    succeeded: bool = True,
) -> Tries:
    """Tries that took so long."""
    return Tries(process=process, robot=robot, place=place, took_ms=ms, succeeded=succeeded, count=count)


def trip(way_ms: int, took_ms: int, robot: str = "amigo_1", place: str = "at_bar") -> Trip:
    """A trip of a robot."""
    return Trip(process="Navigate", robot=robot, place=place, way_ms=way_ms, took_ms=took_ms)


def learned(lessons: list[Lesson], prop: Property, subject: str, robot: str = "", place: str = "") -> Lesson:
    """The one lesson about a property of a process or robot, or of a process by a robot, or there."""
    about = (prop, subject, robot, place)
    [found] = [one for one in lessons if (one.prop, one.subject, one.robot, one.place) == about]
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
    """Nor from tries of what is not known any more, or is no longer one step, and trips of what is no robot."""
    assert learn([tried(160, FEWEST - 1)], [trip(1000, 9000)], stated) == []
    for gone in ("Gone", "FindEachDrink", "kitchen"):
        assert learn([tried(160, 100, process=gone)], [], stated) == []
        assert learn([], [replace(trip(1000, 9000), process=gone)] * 100, stated) == []
    assert learn([], [trip(1000, 9000, robot="kitchen")] * 100, stated) == []


def test_what_is_as_stated_differs_in_nothing(stated: Ontology) -> None:
    """A thousand tries of 0.08 s that succeed."""
    assert [one.differs for one in learn([tried(80, 1000)], [], stated)] == [False, False]


def test_odds_are_the_mean_of_a_beta(stated: Ontology) -> None:
    """90 of 100, with 10 stated successes: 100 of 110."""
    odds = learned(learn([tried(80, 90), tried(80, 10, succeeded=False)], [], stated), Property.SUCCESS_ODDS, "Kinect")
    assert odds.learned == round(100 / 110, 4)
    assert 0.82 < odds.low < odds.learned < odds.high < 0.97


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


def test_robots_are_told_apart_where_it_is_no_chance(stated: Ontology) -> None:
    """One takes 0.16 s and one the stated 0.08; with the others' as its prior, no try counts twice."""
    slow, fast = tried(160, 90), tried(80, 90, robot="pico_1")
    lessons = learn([slow, fast], [], stated)
    both = learned(lessons, Property.DURATION_S, "Kinect")
    amigo, pico = (learned(lessons, Property.DURATION_S, "Kinect", r) for r in ("amigo_1", "pico_1"))
    assert both.learned == round((10 * 0.08 + 90 * 0.16 + 90 * 0.08) / 190, 3)
    others = round((10 * 0.08 + 90 * 0.08) / 100, 3)
    assert amigo.learned == round((10 * others + 90 * 0.16) / 100, 3)
    assert (amigo.stated, pico.stated) == (both.learned, both.learned)
    assert (amigo.differs, pico.differs) == (True, True)
    assert amigo.source.startswith("90 tries; of all robots 0.118")
    rng = np.random.default_rng(3)
    alike = [tried(int(rng.normal(160, 40)), robot=robot) for robot in ("amigo_1", "pico_1") for _ in range(40)]
    lessons = [one for one in learn(alike, [], stated) if one.prop == Property.DURATION_S]
    assert [(one.robot, one.differs) for one in lessons] == [("", True), ("amigo_1", False), ("pico_1", False)]


def test_of_a_single_robot_or_place_nothing_is_told_apart(stated: Ontology) -> None:
    """There is nothing to compare with; nor from few tries, nor of robots and places that are gone."""
    alone = [tried(160, 90, place="at_bar")]
    few = [tried(300, FEWEST - 1, robot="pico_1"), tried(300, 90, robot="gone_1")]
    for tries, robots in ((alone, {""}), (alone + few, {"", "amigo_1"})):
        lessons = learn(tries, [], stated)
        assert {one.robot for one in lessons} == robots
        assert {one.place for one in lessons} == {""}


def test_places_of_a_robot_are_told_apart(stated: Ontology) -> None:
    """One robot fails at the bar, and only there; another one nowhere."""
    tries = [
        tried(80, 10, place="at_bar"),
        tried(80, 30, place="at_bar", succeeded=False),
        tried(80, 40, place="at_cabinet"),
        tried(80, 40, place="at_bar", robot="pico_1"),
        tried(80, 40, place="at_cabinet", robot="pico_1"),
    ]
    lessons = [one for one in learn(tries, [], stated) if one.prop == Property.SUCCESS_ODDS and one.differs]
    assert [(one.robot, one.place) for one in lessons] == [
        ("", ""),
        *(("amigo_1", place) for place in ("", "at_bar", "at_cabinet")),
        ("pico_1", ""),
    ]
    general, bar = lessons[1], lessons[2]
    assert general.learned == round((10 + 50) / (10 + 80), 4)
    assert bar.learned == round((10 + 10) / (10 + 40), 4)
    assert bar.stated == general.learned
    assert bar.source.startswith("40 tries; of amigo_1 0.6667")


def test_what_comes_on_top_of_a_way_is_told_apart_too(stated: Ontology) -> None:
    """Two robots of one pace; at the bar, one needs 6 s more to turn, of which its pace takes a part."""
    rng = np.random.default_rng(5)
    trips = [
        trip(int(way), int(way + 1500 + more + rng.normal(0, 50)), robot, place)
        for robot, place, more in (
            *(("amigo_1", "at_bar", 6000), ("amigo_1", "at_cabinet", 0)),
            *(("pico_1", "at_bar", 0), ("pico_1", "at_cabinet", 0)),
        )
        for way in rng.uniform(1000, 20000, 100)
    ]
    lessons = [one for one in learn([], trips, stated) if one.prop == Property.DURATION_S]
    at_bar, at_cabinet = (
        learned(lessons, Property.DURATION_S, "Navigate", "amigo_1", p) for p in ("at_bar", "at_cabinet")
    )
    assert 4.0 < at_bar.learned - at_cabinet.learned < 6.5
    assert (at_bar.differs, at_cabinet.differs) == (True, True)


def test_what_helps_is_learned_too(stated: Ontology) -> None:
    """A retry is stated to help three times in ten; it did 30 times of 40. Who did it, and where, is all the same."""
    tries = [
        tried(500, 30, process="retry"),
        tried(500, 10, process="retry", succeeded=False),
        tried(500, 10, process="retry", robot="pico_1", place="at_bar"),
    ]
    [lesson] = learn(tries, [], stated)
    assert (lesson.prop, lesson.subject, lesson.stated) == (Property.RECOVERY_ODDS, "retry", 0.3)
    assert lesson.learned == round((3 + 40) / (10 + 50), 4)


def test_robots_that_are_alike_are_not_told_apart(stated: Ontology) -> None:
    """Their trips scatter by more than they take on top of the way; what scatters below nothing counts in full."""
    rng = np.random.default_rng(11)
    trips = [
        trip(int(way), max(0, int(way + rng.normal(0, scatter))), robot, place)
        for robot, scatter in (("amigo_1", 300), ("pico_1", 3000))
        for place in ("at_bar", "at_cabinet")
        for way in rng.uniform(5000, 30000, 100)
    ]
    lessons = [one for one in learn([], trips, stated) if one.prop == Property.DURATION_S]
    assert len(lessons) == 1 + 2 + 4
    assert [one for one in lessons if one.robot and one.differs] == []


@pytest.mark.parametrize("each", [FEWEST, 100])
def test_places_that_are_alike_are_hardly_told_apart(stated: Ontology, each: int) -> None:
    """Durations that scatter unevenly, from few tries too: hardly one in fifty is taken to differ by chance."""
    rng = np.random.default_rng(13)
    told = [
        one.differs
        for _ in range(30)
        for one in learn(
            [
                tried(int(ms), robot=robot, place=place)
                for robot in ("amigo_1", "pico_1")
                for place in ("at_bar", "at_cabinet", "at_coffee_table", "at_dining_table")
                for ms in rng.lognormal(9, 0.8, each)
            ],
            [],
            stated,
        )
        if one.prop == Property.DURATION_S and one.place
    ]
    assert len(told) == 30 * 8
    assert sum(told) < len(told) / 50


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
