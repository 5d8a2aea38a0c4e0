"""The shipped site, larger sites made from it, and travel times as given."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import pytest

from kb.store import KnowledgeBase, Snapshot
from planner.network import NO_WAY, Travel
from planner.planner import TravelTimes
from tests.planner import labs

Times = Mapping[tuple[str, str, str], float]


@pytest.fixture(scope="session")
def tue_lab() -> Iterator[Snapshot]:
    """The shipped site: amigo_1, pico_1, two drinks."""
    knowledge = KnowledgeBase("tue_lab")
    yield knowledge.snapshot()
    knowledge.close()


@pytest.fixture(scope="session")
def larger_lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[int, int], Snapshot]]:
    """A function of (robots, drinks): the shipped site with that many."""
    made: dict[tuple[int, int], KnowledgeBase] = {}

    def lab(robots: int, drinks: int) -> Snapshot:
        if (robots, drinks) not in made:
            made[robots, drinks] = labs.larger_lab(tmp_path_factory.mktemp("lab") / "ontologies", robots, drinks)
        return made[robots, drinks].snapshot()

    yield lab
    for knowledge in made.values():
        knowledge.close()


def travel_of(times: Times) -> TravelTimes:
    """Travel times for a session, as given in seconds; every robot has a table of its own."""

    def travel_times(robots: Sequence[str], places: Sequence[str]) -> Travel:
        def row(robot: str, origin: str) -> list[int]:
            seconds = (times.get((robot, origin, goal)) for goal in places)
            return [NO_WAY if s is None else round(1000 * s) for s in seconds]

        return Travel(
            places=tuple(places),
            profile={robot: number for number, robot in enumerate(robots)},
            between=tuple(
                np.array([row(r, p) for p in places], dtype=np.int64).reshape(len(places), len(places)) for r in robots
            ),
            here={r: np.array(row(r, "here"), dtype=np.int64) for r in robots},
        )

    return travel_times


def random_times(rng: np.random.Generator, robots: Sequence[str], places: Sequence[str], reached: float) -> Times:
    """Random seconds for the share `reached` of the ways; nothing for the others."""
    return {
        (robot, origin, goal): round(float(rng.uniform(1.0, 20.0)), 3)
        for robot in robots
        for origin in ("here", *places)
        for goal in places
        if rng.random() < reached
    }
