"""A browsable reference of a knowledge base: HTML pages that need no network, and link to one another."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markupsafe import Markup

from kb.chart import chart
from kb.entities import Entities, Place, Role, Sort
from kb.outline import outline
from kb.pages.readiness import matrix_values
from kb.pages.rendering import Renderer
from kb.pages.site_map import site_map, spots
from kb.problems import Problem
from kb.query import Questions
from kb.readiness import matrix, robot_classes
from kb.store import Snapshot
from kb.swrl import read_rules
from kb.vocabulary import Kind, Property
from kb.wording import rule_text, signature

_PROPERTIES = (Sort.OBJECT_PROPERTY, Sort.DATA_PROPERTY, Sort.ANNOTATION_PROPERTY)
MOST_USES = 200
"""So many values of a property, members of a class and users of an entity are listed on its page."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Branch:
    """A class and the classes below it."""

    name: str
    below: tuple[Branch, ...]


def reference(snapshot: Snapshot, warnings: Iterable[Problem], folder: Path) -> dict[str, str]:
    """All pages, by their path below the folder that they go into; `index.html` is the first to read.

    Args:
        warnings: What is probably not meant; has a page of its own.
        folder: The folder of knowledge: files are shown by their paths below it.
    """
    return dict(_Reference(snapshot, list(warnings), folder).pages())


class _Reference:
    def __init__(self, snapshot: Snapshot, warnings: list[Problem], folder: Path) -> None:
        self._snapshot, self._warnings = snapshot, warnings
        self._ontology = snapshot.ontology
        self._entities = Entities(snapshot.ontology)
        self._questions = Questions(snapshot)
        self._used_by = self._entities.used_by()
        self._tasks = [t for t in self._questions.tasks() if not snapshot.processes[t].is_atomic]
        self._fleet = self._ontology.individuals(Kind.ROBOT)
        self._ready = matrix(snapshot, [*self._fleet, *robot_classes(snapshot)], self._tasks)
        self._uses: dict[str, list[tuple[str, object]]] = {}
        for prop, subject, value in snapshot.ontology.all_values():
            self._uses.setdefault(prop, []).append((subject, value))
        # Of annotations, values are classes and properties; of all else, individuals.
        annotations = {self._entities.entity(n).name for n in self._entities.of_sort(Sort.ANNOTATION_PROPERTY)}
        names = self._entities.local_names
        self._roles = {n: "class property individual" if n in annotations else "individual" for n in names}
        self._below: dict[str, set[str]] = {}
        for name, above in snapshot.ontology.superclasses.items():
            for kind in above - {name}:
                self._below.setdefault(kind, set()).add(name)
        self._render = Renderer(snapshot.site, self._entities, folder)

    def pages(self) -> Iterator[tuple[str, str]]:
        """Path and content of each."""
        for name, values in (
            ("index", self._index()),
            ("classes", {"trees": self._trees()}),
            ("properties", {"properties": [self._entities.entity(n) for n in self._entities.of_sort(*_PROPERTIES)]}),
            ("individuals", {"groups": self._groups()}),
            ("robots", self._robots()),
            (
                "sites",
                {"map": Markup(site_map(self._snapshot)), "spots": spots(self._snapshot), "areas": self._areas()},
            ),
            ("processes", {"groups": self._processes()}),
            ("groundings", {"groundings": [g for _, g in sorted(self._snapshot.groundings.items())]}),
            ("rules", {"rules": self._rules()}),
            ("problems", {"problems": self._warnings}),
        ):
            yield f"{name}.html", self._render.render(f"{name}.html", "", **values)
        for name in self._entities.names:
            yield self._render.page(name), self._entity(name)

    # Overviews

    def _index(self) -> dict[str, Any]:
        files = [(f, len(f.graph)) for f in sorted(self._ontology.files.files, key=lambda f: f.iri)]
        entities = [(n, self._entities.entity(n)) for n in self._entities.names]
        return {"files": files, "entities": entities, "warnings": len(self._warnings), "tasks": self._tasks}

    def _trees(self) -> tuple[Branch, ...]:
        """The classes by the classes right above them; one below several stands below each."""
        own = {self._entities.entity(n).name for n in self._entities.of_sort(Sort.CLASS)}
        above = {n: (self._ontology.superclasses.get(n, frozenset()) - {n}) & own for n in own}
        direct: dict[str, list[str]] = {}
        tops = []
        for name in sorted(own):
            # Equivalent classes are above each other: neither hides the other.
            strict = {a for a in above[name] if name not in above.get(a, ())}
            nearest = {a for a in strict if not any(a in above[b] and b not in above[a] for b in strict)}
            for parent in nearest:
                direct.setdefault(parent, []).append(name)
            if not nearest:
                tops.append(name)

        def branch(name: str) -> Branch:
            return Branch(name=name, below=tuple(branch(n) for n in direct.get(name, ())))

        return tuple(map(branch, tops))

    def _groups(self) -> list[tuple[str, list[str]]]:
        groups: dict[str, list[str]] = {}
        for name in self._entities.of_sort(Sort.INDIVIDUAL):
            kind = self._ontology.kind_of(name) if name in self._ontology.kinds else ""
            groups.setdefault(kind, []).append(name)
        return sorted(groups.items())

    def _robots(self) -> dict[str, Any]:
        robots = [(r, self._ontology.kind_of(r), self._questions.where(r)) for r in self._fleet]
        return {"fleet": robots, **matrix_values(self._ready)}

    def _areas(self) -> list[tuple[str, str, list[str]]]:
        return [
            (area, self._ontology.kind_of(area), self._questions.at(area))
            for area in self._ontology.individuals(Kind.AREA)
        ]

    def _processes(self) -> list[tuple[str, list[tuple[str, str, str]]]]:
        groups = (
            ("Task types", Kind.SIMPLE_PROCESS),
            ("Composite processes", Kind.COMPOSITE_PROCESS),
            ("Primitive actions", Kind.ATOMIC_PROCESS),
        )
        return [
            (
                title,
                [
                    (name, signature(process), self._entities.comment(name))
                    for name, process in sorted(self._snapshot.processes.items())
                    if self._ontology.is_a(name, kind)
                ],
            )
            for title, kind in groups
        ]

    def _rules(self) -> list[tuple[str, str, str]]:
        found = read_rules(self._ontology).of
        return [(condition, rule.name, rule_text(rule)) for condition in sorted(found) for rule in found[condition]]

    # One entity

    def _entity(self, key: str) -> str:
        entity = self._entities.entity(key)
        name = entity.name
        users = [u for u in self._used_by.get(key, []) if u != key]
        values: dict[str, Any] = {
            "entity": entity,
            "used_by": users[:MOST_USES],
            "used_more": max(0, len(users) - MOST_USES),
            "axioms": self._entities.axioms(key),
            "roles": self._roles,
            "above": [],
            "below": [],
            "members": [],
            "uses": [],
            "more": 0,
            "kinds": [],
            "facts": (),
            "process": None,
            "ready": [],
        }
        if entity.sort is Sort.CLASS:
            values |= self._class(name)
        elif entity.sort is Sort.INDIVIDUAL:
            values |= self._individual(name)
        else:
            uses = self._uses.get(name, [])
            values |= {"uses": uses[:MOST_USES], "more": max(0, len(uses) - MOST_USES)}
        return self._render.render("entity.html", "../", **values)

    def _class(self, name: str) -> Mapping[str, Any]:
        above = sorted(self._ontology.superclasses.get(name, frozenset()) - {name})
        members = self._ontology.individuals(name)
        return {
            "above": [(k, self._entities.stated_kind(k, name, Role.CLASS)) for k in above if self._is_class(k)],
            "below": sorted(n for n in self._below.get(name, ()) if self._is_class(n)),
            "members": members[:MOST_USES],
            "more": max(0, len(members) - MOST_USES),
        }

    def _is_class(self, name: str) -> bool:
        return self._entities.key(name, Role.CLASS) is not None

    def _individual(self, name: str) -> Mapping[str, Any]:
        if name not in self._ontology.kinds:
            return {}
        kinds: list[tuple[str, Place | None]] = [
            (k, self._entities.stated_kind(k, name)) for k in self._questions.kinds(name)
        ]
        values: dict[str, Any] = {"kinds": kinds, "facts": self._questions.facts(name)}
        if name in self._snapshot.processes:
            values["process"] = self._process(name)
        if self._ontology.is_a(name, Kind.ROBOT):
            values["ready"] = [r for r in self._ready if r.who == name]
        return values

    def _process(self, name: str) -> dict[str, Any]:
        process = self._snapshot.processes[name]
        grounding = self._snapshot.groundings.get(name)
        return {
            "signature": signature(process),
            "chart": Markup(chart(outline(self._snapshot, name))),
            "expanded": None
            if process.is_atomic
            else Markup(chart(outline(self._snapshot, name, expand=True), data=True)),
            "recipes": [r for r in self._questions.recipes(name) if r != name],
            "realizes": [str(v) for v in self._ontology.values(Property.REALIZES, name)],
            "grounding": grounding,
        }
