"""An ontology file of ours in the making: entities by name, references by name."""

from __future__ import annotations

from collections.abc import Iterable

from kb.imports.names import Names
from kb.vocabulary import CORE, Kind, Property
from kb.writing import Entity, Has, Literal, Some, Sort


class Draft:
    """What an importer has made so far.

    Attributes:
        iri: Of the ontology; names are minted below it.
        names: Those of the file.
        entities: By sort and name.
    """

    def __init__(self, iri: str) -> None:
        self.iri = iri
        self.names = Names()
        self.entities: dict[tuple[Sort, str], Entity] = {}

    def full(self, name: str) -> str:
        """IRI of a name of this file; a full IRI as it is."""
        return name if ":" in name else f"{self.iri}#{name}"

    def individual(
        self,
        name: str,
        kind: Kind | str,
        links: Iterable[tuple[Property | str, str]] = (),
        values: Iterable[tuple[Property | str, Literal]] = (),
        *,
        comments: Iterable[str] = (),
        label: str = "",
    ) -> str:
        """Add an individual; `kind` is a class of the core or of this file, by IRI. Returns the name."""
        types: tuple[str, ...] = (kind if ":" in kind else CORE + kind,)
        before = self.entities.get((Sort.INDIVIDUAL, name))
        if before is not None:
            types = tuple(dict.fromkeys((*before.types, *types)))
        self.entities[Sort.INDIVIDUAL, name] = Entity(
            iri=self.full(name),
            sort=Sort.INDIVIDUAL,
            types=types,
            links=tuple((_term(p), self.full(to)) for p, to in links),
            values=tuple((_term(p), value) for p, value in values),
            comments=tuple(comments),
            label=label,
        )
        return name

    def kind(
        self, name: str, above: Iterable[str | Some | Has] = (), *, comments: Iterable[str] = (), label: str = ""
    ) -> str:
        """Add a class, below others and restrictions, by IRI. Returns its IRI."""
        self.entities[Sort.CLASS, name] = Entity(
            iri=self.full(name),
            sort=Sort.CLASS,
            above=tuple(above),
            comments=tuple(comments),
            label=label,
        )
        return self.full(name)

    def prop(self, name: str, sort: Sort, *, range_: str = "", fluent: bool = False, label: str = "") -> str:
        """Add a functional property, or let a known one change too. Returns its IRI."""
        before = self.entities.get((sort, name))
        if before is not None:
            fluent = fluent or bool(before.values)
            range_ = range_ or before.range_
        self.entities[sort, name] = Entity(
            iri=self.full(name),
            sort=sort,
            types=("http://www.w3.org/2002/07/owl#FunctionalProperty",),
            range_=range_,
            values=((CORE + Property.FLUENT, True),) if fluent else (),
            label=label,
        )
        return self.full(name)


def _term(prop: Property | str) -> str:
    return prop if ":" in prop else CORE + prop
