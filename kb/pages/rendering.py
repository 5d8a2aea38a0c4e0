"""Turns templates and what is known into pages; everything is escaped unless it is markup of ours."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from pathlib import Path

import jinja2
from markupsafe import Markup

from kb.chart import STYLE
from kb.entities import Entities, Place, Role
from kb.ontology import Value

_FOLDER = Path(__file__).with_name("templates")
_PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,80}\Z")
_SHORT_HASH = 10


class Renderer:
    """Renders the pages of one reference."""

    def __init__(self, title: str, entities: Entities | None, folder: Path | None) -> None:
        """Prepare for pages that link to one another.

        Args:
            entities: What has a page.
            folder: Files are shown by their path below it; nothing of the path above is told.
        """
        self._folder = folder
        self._shown_files: dict[Path, str] = {}
        self._entities = entities
        self._files = _file_names(entities.names if entities is not None else ())
        self._templates = jinja2.Environment(
            loader=jinja2.FileSystemLoader(_FOLDER),
            autoescape=True,
            undefined=jinja2.StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        self._templates.globals.update(title=title, chart_style=Markup(STYLE), find=self.find, page=self.page)
        self._templates.filters.update(place=self.place, file=self.file, shown=shown)

    def render(self, template: str, root: str, **values: object) -> str:
        """A page.

        Args:
            root: What leads from the page to the folder of all: empty, or `../`.
        """
        here = template.removesuffix(".html")
        return self._templates.get_template(template).render(root=root, here=here, **values) + "\n"

    def find(self, name: str, roles: str = "") -> str | None:
        """The entity that is meant by a name: one of these roles, in their order; None if none has a page.

        Args:
            roles: Words; none for any role.
        """
        return None if self._entities is None else self._entities.key(name, *map(Role, roles.split()))

    def page(self, name: str) -> str:
        """The page of an entity, from the folder of all."""
        return f"entity/{self._files[name]}"

    def place(self, place: Place) -> str:
        """A file and a line."""
        return f"{self.file(place.file)}:{place.line}" if place.line else self.file(place.file)

    def file(self, path: Path) -> str:
        """A file by its path below the folder of knowledge, or by its name."""
        if path not in self._shown_files:
            folder, whole = self._folder and self._folder.resolve(), path.resolve()
            below = folder is not None and folder in whole.parents
            self._shown_files[path] = whole.relative_to(folder).as_posix() if folder and below else path.name
        return self._shown_files[path]


def shown(value: Value) -> str:
    """A value of a property."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def _file_names(names: Iterable[str]) -> dict[str, str]:
    """A file name for each entity: its own name where that is safe and unlike all others in any case."""
    known = sorted(names)
    alike: dict[str, int] = {}
    for name in known:
        alike[name.lower()] = alike.get(name.lower(), 0) + 1
    found = {}
    for name in known:
        if _PLAIN.match(name) and alike[name.lower()] == 1:
            found[name] = f"{name}.html"
        else:
            digest = hashlib.sha256(name.encode("utf-8", errors="surrogatepass")).hexdigest()[:_SHORT_HASH]
            found[name] = f"{re.sub('[^A-Za-z0-9]+', '-', name)[:40].strip('-')}-{digest}.html".lstrip("-")
    return found
