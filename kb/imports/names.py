"""Names for what comes from elsewhere: letters, digits and _, each once, none that the core has."""

from __future__ import annotations

import re
from functools import cache

from kb.files import SHIPPED
from kb.vocabulary import CORE

_ABOUT = re.compile(rf'rdf:about="{re.escape(CORE)}([^"]+)"')
_NOT_SAFE = re.compile(r"[^A-Za-z0-9_]+")


class Names:
    """The local names of one file."""

    def __init__(self) -> None:
        self._taken = set(_names_of_core())
        self._given: dict[str, str] = {}

    def of(self, key: str, wanted: str) -> str:
        """The name of what `key` stands for; the same whenever it is asked for."""
        if key not in self._given:
            self._given[key] = self.fresh(wanted)
        return self._given[key]

    def fresh(self, wanted: str) -> str:
        """A name that nothing has yet, as near as possible to the wanted one."""
        name = safe(wanted)
        number = 1
        while name in self._taken:
            number += 1
            name = f"{safe(wanted)}_{number}"
        self._taken.add(name)
        return name


def safe(text: str) -> str:
    """A text as a name: what is no letter, digit or _ becomes _."""
    name = _NOT_SAFE.sub("_", text).strip("_") or "unnamed"
    return name if name[0].isalpha() else f"n_{name}"


def parameter_name(text: str) -> str:
    """As parameters are named: `bookName` for `BookName`, `isbn` for `ISBN`."""
    name = safe(text)
    capitals = len(name) - len(name.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ"))
    if capitals == len(name) or name[capitals] in "_0123456789":
        return name[:capitals].lower() + name[capitals:]
    first = max(1, capitals - 1)
    return name[:first].lower() + name[first:]


def snake(text: str) -> str:
    """As fields are named: `book_name` for `BookName` and `bookName`."""
    name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", safe(text)).lower()
    return re.sub(r"_+", "_", name)


def local(iri: str) -> str:
    """What people read of an IRI: the part behind the last # or /."""
    return re.split(r"[#/]", iri.rstrip("#/"))[-1]


@cache
def _names_of_core() -> frozenset[str]:
    text = (SHIPPED / "core" / "core.owl").read_text(encoding="utf-8")
    return frozenset(_ABOUT.findall(text))
