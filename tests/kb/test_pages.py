"""The reference: complete, linked, escaped, the same every time."""

import re
import shutil
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path, PurePosixPath

import pytest

from kb.entities import Entities
from kb.files import SHIPPED
from kb.pages.reference import reference
from kb.pages.rendering import Renderer
from kb.pages.site_map import site_map, spots
from kb.store import KnowledgeBase
from tests.kb.conftest import SITE, individual, instead

HOSTILE = "<script>alert(1)</script>"
_VOID = {"meta", "input", "br", "image", "rect", "circle", "line", "polyline", "polygon", "path", "link", "img"}


class Page(HTMLParser):
    """The links, loaded files, scripts and open elements of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.scripts = 0
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        told = dict(attrs)
        if tag == "a" or tag == "form":
            self.links.append(str(told.get("href") or told.get("action")))
        elif told.get("src") or told.get("href"):
            self.loaded.append(str(told.get("src") or told.get("href")))
        self.scripts += tag == "script"
        assert not [name for name in told if name.startswith("on")], "no script in attributes"
        if tag not in _VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in _VOID:
            assert self.open.pop() == tag


@pytest.fixture(scope="module")
def pages(shipped: KnowledgeBase) -> dict[str, str]:
    """Of the shipped site."""
    return reference(shipped.snapshot(), shipped.warnings, SHIPPED)


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """Of a site with a label that is markup, a name that is no file name, and one that differs by case alone."""
    folder = Path(shutil.copytree(SHIPPED, tmp_path_factory.mktemp("hostile") / "ontologies"))
    escaped = HOSTILE.replace("<", "&lt;").replace(">", "&gt;")
    instead(SITE, ">first drink<", f">{escaped}<")(folder)
    individual(SITE, "..%2F..%2Fetc'é", "Room", f"<rdfs:comment>{escaped}</rdfs:comment>")(folder)
    individual(SITE, "Kitchen", "Room")(folder)
    knowledge = KnowledgeBase("tue_lab", folder)
    yield reference(knowledge.snapshot(), knowledge.warnings, folder)
    knowledge.close()


@pytest.mark.parametrize("which", ["pages", "hostile"])
def test_all_links_resolve_and_nothing_is_loaded(which: str, request: pytest.FixtureRequest) -> None:
    """Every link leads to a page that is there; pictures are in the page; elements are closed."""
    found: dict[str, str] = request.getfixturevalue(which)
    for name, text in found.items():
        page = Page(text)
        assert page.open == [], name
        for link in page.links:
            target = (PurePosixPath(name).parent / link).as_posix()
            parts: list[str] = []
            for part in target.split("/"):
                if part == "..":
                    parts.pop()
                else:
                    parts.append(part)
            assert "/".join(parts) in found, (name, link)
        assert all(loaded.startswith("data:image/png;base64,") for loaded in page.loaded), name
        assert page.scripts == (1 if name == "index.html" else 0), name


def test_every_entity_has_a_page_with_its_place(pages: dict[str, str], shipped: KnowledgeBase) -> None:
    """File and line, label, comment; and it can be found from the first page."""
    entities = Entities(shipped.snapshot().ontology)
    render = Renderer("", entities, SHIPPED)
    for name in entities.names:
        entity = entities.entity(name)
        page = pages[render.page(name)]
        assert entity.place.line > 0, name
        assert f"{render.file(entity.place.file)}:{entity.place.line}" in page
        assert f'href="{render.page(name)}"' in pages["index.html"]
    assert "sites/tue_lab/tue_lab.owl:" in pages["entity/drink_1.html"]


def test_pages_tell_what_is_known(pages: dict[str, str]) -> None:
    """Values stated and inferred, users, charts, readiness, services."""
    drink, pico = pages["entity/drink_1.html"], pages["entity/pico_1.html"]
    assert "trash_bin_1" in drink
    assert "inferred" in drink
    assert re.search(r'<th scope="row"><a href="../entity/SearchDrink.html">.*?</th><td><span class="able">', pico)
    assert "Used by" in pages["entity/Navigate.html"]
    assert "SearchDrink_10_Navigate" in pages["entity/Navigate.html"]
    assert '<svg xmlns="http://www.w3.org/2000/svg" class="chart"' in pages["entity/Navigate.html"]
    assert "/compute/path" in pages["groundings.html"]
    assert "RobotWithKinect" in pages["classes.html"]
    assert 'class="map"' in pages["sites.html"]


def test_hostile_labels_and_names_are_text(hostile: dict[str, str]) -> None:
    """No markup of theirs; no file outside of the folder; names that differ by case have files that differ by more."""
    assert not [name for name, text in hostile.items() if HOSTILE in text]
    assert "&lt;script&gt;alert(1)" in hostile["index.html"]
    assert all(re.fullmatch(r"(entity/)?[A-Za-z0-9_-]+\.html", name) for name in hostile)
    assert len({name.lower() for name in hostile}) == len(hostile)


def test_the_same_knowledge_gives_the_same_pages(pages: dict[str, str], shipped: KnowledgeBase) -> None:
    """Byte for byte, and nothing of the machine is in them."""
    assert reference(shipped.snapshot(), shipped.warnings, SHIPPED) == pages
    assert not [name for name, text in pages.items() if str(SHIPPED.parent.parent) in text]


def test_the_map_has_all_locations(shipped: KnowledgeBase) -> None:
    """Each by its number, above one another as their y says, on the picture of the site."""
    snapshot = shipped.snapshot()
    picture = site_map(snapshot)
    found = spots(snapshot)
    assert [s.name for s in found] == snapshot.ontology.individuals("Location")
    centers = [float(y) for y in re.findall(r'<circle [^>]*cy="([\d.]+)"', picture)]
    assert sorted(found, key=lambda s: -s.y_m) == [
        s for _, s in sorted(zip(centers, found, strict=True), key=lambda p: p[0])
    ]
    assert picture.count("<image ") == 1
