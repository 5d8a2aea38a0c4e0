"""The shipped site with any number of rooms, places and drinks more."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

from kb.files import SHIPPED
from kb.vocabulary import CORE

_PLACES_PER_ROOM, _DRINKS_PER_PLACE = 20, 3


def large_site(folder: Path, individuals: int) -> Path:
    """Copy the shipped ontologies to a new folder, with about so many individuals more, six triples each.

    Returns:
        The file of the site.
    """
    shutil.copytree(SHIPPED, folder)
    file = folder / "sites" / "tue_lab" / "tue_lab.owl"
    owl = file.read_text(encoding="utf-8")
    site = owl.split('xml:base="', 1)[1].split('"', 1)[0]
    more = "".join(_individuals(site, individuals))
    file.write_text(owl.replace("</rdf:RDF>", f"{more}\n</rdf:RDF>"), encoding="utf-8")
    return file


def _individuals(site: str, wanted: int) -> Iterator[str]:
    rooms = round(wanted / (1 + _PLACES_PER_ROOM * (1 + _DRINKS_PER_PLACE)))
    drinks = (kind for _ in range(rooms) for kind in ("Beer", "SoftDrink", "Beer", "SoftDrink", "Beer") * 12)
    for room in range(rooms):
        name = f"room_{room}"
        yield _individual(site, name, f"{CORE}Room", _link(site, "inArea", "tue_lab"))
        for place in range(_PLACES_PER_ROOM):
            x_m, y_m = float(room % 50), float(place) / 2
            at = f"place_{room}_{place}"
            numbers = (_number("poseX_m", x_m), _number("poseY_m", y_m), _number("poseYaw_rad", 0.0))
            yield _individual(site, at, f"{CORE}SearchLocation", _link(site, "inArea", name), *numbers)
            for drink in range(_DRINKS_PER_PLACE):
                empty = f"<core:isEmpty rdf:datatype='{_XSD}boolean'>true</core:isEmpty>"
                kind = site.replace("tue_lab.owl", "objects.owl#") + next(drinks)
                said = (_link(site, "locatedAt", at), empty)
                yield _individual(site, f"more_{room}_{place}_{drink}", kind, *said)


_XSD = "http://www.w3.org/2001/XMLSchema#"


def _individual(site: str, name: str, kind: str, *said: str) -> str:
    label = f"<rdfs:label xml:lang='en'>{name.replace('_', ' ')}</rdfs:label>"
    comment = f"<rdfs:comment xml:lang='en'>One of many: {name}.</rdfs:comment>"
    lines = "\n".join((f"<rdf:type rdf:resource='{kind}'/>", *said, label, comment))
    return f"\n<owl:NamedIndividual rdf:about='{site}#{name}'>\n{lines}\n</owl:NamedIndividual>\n"


def _link(site: str, prop: str, name: str) -> str:
    return f"<core:{prop} rdf:resource='{site}#{name}'/>"


def _number(prop: str, value: float) -> str:
    return f"<core:{prop} rdf:datatype='{_XSD}double'>{value}</core:{prop}>"
