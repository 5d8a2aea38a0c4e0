"""Links lead somewhere, and every page can be reached."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.docs.pages import PAGES, ROOT, page_id

_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
_FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
_HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)


def links_of(page: Path) -> list[str]:
    """Targets of the links of a page to files of the repository."""
    text = _FENCE.sub("", page.read_text(encoding="utf-8"))
    return [link for link in _LINK.findall(text) if not link.startswith(("http://", "https://"))]


def anchors_of(page: Path) -> set[str]:
    """What links to a part of a page may end with: its headings, as GitHub writes them."""
    headings = _HEADING.findall(_FENCE.sub("", page.read_text(encoding="utf-8")))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=page_id)
def test_links_lead_to_files_and_headings(page: Path) -> None:
    """A link names a file that is in the repository and, behind `#`, a heading of it."""
    for link in links_of(page):
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{page_id(page)} links to {link}"
        assert ROOT in target.parents, f"{page_id(page)} links to {link}, outside the repository"
        if anchor:
            assert anchor in anchors_of(target), f"{page_id(page)} links to {link}; there is no such heading"


def test_every_page_can_be_reached_from_the_readme() -> None:
    """No page is an island."""
    reached, todo = set(), [ROOT / "README.md"]
    while todo:
        page = todo.pop()
        reached.add(page)
        targets = [(page.parent / link.partition("#")[0]).resolve() for link in links_of(page)]
        todo += [t for t in targets if t.suffix == ".md" and t not in reached]
    assert not [page_id(page) for page in PAGES if page not in reached and "changes" not in page.parts]
