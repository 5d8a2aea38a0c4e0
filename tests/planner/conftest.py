"""The shipped site, larger sites made from it, and travel times as given."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import pytest

from kb.files import SHIPPED
from kb.store import KnowledgeBase, Snapshot

Times = Mapping[tuple[str, str, str], float]
_PLACES = ("at_bar", "at_cabinet", "at_side_table")


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
            folder = tmp_path_factory.mktemp("lab") / "ontologies"
            shutil.copytree(SHIPPED, folder)
            file = folder / "sites" / "tue_lab" / "tue_lab.owl"
            file.write_text(_with_more(file.read_text(encoding="utf-8"), robots, drinks), encoding="utf-8")
            made[robots, drinks] = KnowledgeBase("tue_lab", folder)
        return made[robots, drinks].snapshot()

    yield lab
    for knowledge in made.values():
        knowledge.close()


def _with_more(owl: str, robots: int, drinks: int) -> str:
    copies = [_copy(owl, "amigo_1", f"amigo_{n}") for n in range(3, robots + 1)]
    for n in range(3, drinks + 1):
        copies.append(_copy(owl, "drink_1", f"drink_{n}").replace("at_coffee_table", _PLACES[n % len(_PLACES)]))
    found = re.search(r" *<owl:NamedIndividual", owl)
    assert found
    return owl[: found.start()] + "".join(copies) + owl[found.start() :]


def _copy(owl: str, name: str, new_name: str) -> str:
    found = re.search(rf' *<owl:NamedIndividual rdf:about="[^"]*#{name}">.*?</owl:NamedIndividual>\n', owl, re.DOTALL)
    assert found
    return found.group().replace(name, new_name)


def travel_of(times: Times) -> Callable[[Mapping[str, Sequence[str]]], Times]:
    """Travel times for a session, as given."""

    def travel_times(goals: Mapping[str, Sequence[str]]) -> Times:
        return {key: s for key, s in times.items() if key[2] in goals.get(key[0], ())}

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
