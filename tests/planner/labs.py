"""The shipped site with more robots and drinks."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from kb.files import SHIPPED
from kb.store import KnowledgeBase

_PLACES = ("at_bar", "at_cabinet", "at_side_table")


def larger_lab(folder: Path, robots: int, drinks: int) -> KnowledgeBase:
    """A copy of the shipped site in a new folder, with copies of its first robot and its first drink."""
    shutil.copytree(SHIPPED, folder)
    file = folder / "sites" / "tue_lab" / "tue_lab.owl"
    file.write_text(_with_more(file.read_text(encoding="utf-8"), robots, drinks), encoding="utf-8")
    return KnowledgeBase("tue_lab", folder)


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
