"""Recipes of a site, to review: which there are, where they come from, which are retired, which wait to be imported.

Retiring, restoring and importing change one statement of a person's file, on request. The knowledge base is
read again as it would be then; where that is refused, the file is as it was.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from kb.checking import read_site
from kb.editing import NotDescribed, with_statement, without_statements, write_over
from kb.errors import ConcertmasterError
from kb.files import SHIPPED, OntologyFile, read_files
from kb.learned import main_file, site_file
from kb.ontology import Ontology
from kb.vocabulary import CORE, Kind, Property

_OWL = "http://www.w3.org/2002/07/owl#"
_XSD = "http://www.w3.org/2001/XMLSchema#"
_KEPT = re.compile(rf"[:<]{Property.FOUND_FOR_GOAL}\b".encode())
_ANY_REVISION = 0


class NoSuchRecipe(ConcertmasterError):
    """A recipe cannot be changed as asked; no file was.

    Attributes:
        name: What was asked for.
    """

    fault = "request"

    def __init__(self, name: str, message: str) -> None:
        self.name = name
        super().__init__(f"recipe {name!r}: {message}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """A process that accomplishes a task type, or was kept from a plan for a goal.

    Attributes:
        realizes: Task types that it is a way to accomplish; none: it is asked for by its own name.
        goal: What it was found for; empty if a person wrote it.
        kept_at_s: When it was kept, in seconds since the fleet was opened that found it.
        makespan_s: Expected of the plan that it was kept from.
        knowledge: Hash of the knowledge in which it was found.
        retired: Whether it is not chosen any more.
        because: Why it is retired.
        superseded_by: What is done instead.
    """

    name: str
    file: Path
    line: int
    realizes: tuple[str, ...]
    goal: str = ""
    kept_at_s: float | None = None
    makespan_s: float | None = None
    knowledge: str = ""
    retired: bool = False
    because: str = ""
    superseded_by: str = ""


def recipes(ontology: Ontology) -> list[Recipe]:
    """The recipes of a site, by name."""
    names = {*ontology.individuals(Kind.COMPOSITE_PROCESS), *ontology.individuals(Kind.ATOMIC_PROCESS)}
    told = (Property.REALIZES, Property.FOUND_FOR_GOAL, Property.RETIRED)
    return [_recipe(ontology, n) for n in sorted(names) if any(ontology.values(p, n) for p in told)]


def not_imported(ontology: Ontology, folder: Path) -> list[Path]:
    """Files of recipes that were kept from plans, which the site does not import; sorted."""
    imported = {file.path.resolve() for file in ontology.files.files}
    found = sorted(path for path in folder.glob("tasks/*.owl") if path.resolve() not in imported)
    return [path for path in found if _KEPT.search(path.read_bytes())]


def retire(folder: Path, site: str, name: str, *, because: str = "", superseded_by: str = "") -> Recipe:
    """Have a recipe not chosen any more; it can still be read, and asked for by its name.

    Raises:
        NoSuchRecipe: There is none, it is retired already, why is no line of text, or what shall supersede it is no
            process.
        OntologyRejected: A task type would be left without a recipe, or the files were wrong before.
    """
    ontology = read_site(main_file(folder, site), folder, _ANY_REVISION).ontology
    recipe = _known(ontology, name)
    if recipe.retired:
        raise NoSuchRecipe(name, f"is retired already{': ' + recipe.because if recipe.because else ''}")
    processes = {n for k in (Kind.COMPOSITE_PROCESS, Kind.ATOMIC_PROCESS) for n in ontology.individuals(k)}
    if not because.isprintable():
        raise NoSuchRecipe(name, f"cannot be retired because {because!r}: give one line that can be printed")
    if superseded_by and (superseded_by == name or superseded_by not in processes):
        raise NoSuchRecipe(name, f"cannot be superseded by {superseded_by}, which is no other process")
    statements = [_statement(Property.RETIRED, "true", sort="boolean")]
    if because:
        statements.append(_statement(Property.RETIRED_BECAUSE, because))
    if superseded_by:
        iri = ontology.iri(superseded_by)
        statements.append(f'<core:{Property.SUPERSEDED_BY} xmlns:core="{CORE}" rdf:resource="{_ascii(iri)}"/>')

    def edit(content: bytes) -> bytes:
        for statement in statements:
            content = with_statement(content, ontology.iri(name), statement)
        return content

    return _known(_changed(folder, site, recipe.file, edit), name)


def restore(folder: Path, site: str, name: str) -> Recipe:
    """Have a retired recipe chosen again.

    Raises:
        NoSuchRecipe: There is none, or it is not retired.
        OntologyRejected: The files are wrong.
    """
    ontology = read_site(main_file(folder, site), folder, _ANY_REVISION).ontology
    recipe = _known(ontology, name)
    if not recipe.retired:
        raise NoSuchRecipe(name, "is not retired")
    gone = {CORE + p for p in (Property.RETIRED, Property.RETIRED_BECAUSE, Property.SUPERSEDED_BY)}
    iri = ontology.iri(name)
    return _known(_changed(folder, site, recipe.file, lambda content: without_statements(content, iri, gone)), name)


def import_recipe(folder: Path, site: str, file: Path) -> list[Recipe]:
    """Have a site import an ontology file, so that what it describes is known there.

    Returns:
        The recipes that the site did not have before.

    Raises:
        NoSuchRecipe: The file is not in the folder, or is imported already.
        OntologyRejected: With the file, something would be wrong; the site is as it was.
    """
    if not file.resolve().is_relative_to(folder.resolve()) or not file.is_file():
        raise NoSuchRecipe(str(file), f"is no file in {folder}; imports are looked for there")
    before = read_site(main_file(folder, site), folder, _ANY_REVISION).ontology
    imported = _parsed(file, folder).iri
    if imported in {known.iri for known in before.files.files}:
        raise NoSuchRecipe(str(file), f"is imported by {site} already")
    path = site_file(folder, site)
    statement = f'<owl:imports xmlns:owl="{_OWL}" rdf:resource="{_ascii(imported)}"/>'
    iri = _parsed(path, folder).iri
    after = _changed(folder, site, path, lambda content: with_statement(content, iri, _brief(statement, content)))
    known = {recipe.name for recipe in recipes(before)}
    return [recipe for recipe in recipes(after) if recipe.name not in known]


def _recipe(ontology: Ontology, name: str) -> Recipe:
    place = ontology.problem("", name, "")
    kept_at, makespan = (ontology.value(p, name) for p in (Property.KEPT_AT_S, Property.FOUND_MAKESPAN_S))
    return Recipe(
        name=name,
        file=place.file,
        line=place.line,
        realizes=tuple(map(str, ontology.values(Property.REALIZES, name))),
        goal=str(ontology.value(Property.FOUND_FOR_GOAL, name) or ""),
        kept_at_s=float(kept_at) if isinstance(kept_at, int | float) else None,
        makespan_s=float(makespan) if isinstance(makespan, int | float) else None,
        knowledge=str(ontology.value(Property.FOUND_IN_KNOWLEDGE, name) or ""),
        retired=ontology.value(Property.RETIRED, name) is True,
        because=str(ontology.value(Property.RETIRED_BECAUSE, name) or ""),
        superseded_by=str(ontology.value(Property.SUPERSEDED_BY, name) or ""),
    )


def _known(ontology: Ontology, name: str) -> Recipe:
    found = {recipe.name: recipe for recipe in recipes(ontology)}
    if name not in found:
        raise NoSuchRecipe(name, f"is not known; there is {', '.join(found) or 'none'}")
    return found[name]


def _changed(folder: Path, site: str, file: Path, edit: Callable[[bytes], bytes]) -> Ontology:
    """The knowledge after an edit of one file; where it is wrong, the file is as it was."""
    if file.resolve().is_relative_to(SHIPPED):
        told = "the shipped ontologies are not changed; copy them, and give the folder of the copy"
        raise NoSuchRecipe(file.stem, f"is described in {file}: {told}")
    before = file.read_bytes()
    try:
        after = edit(before)
    except NotDescribed as error:
        raise NoSuchRecipe(file.stem, f"{file}: {error}; describe it there, as Protégé does") from error
    write_over(file, after)
    try:
        return read_site(main_file(folder, site), folder, _ANY_REVISION).ontology
    except ConcertmasterError:
        write_over(file, before)
        raise


def _parsed(file: Path, folder: Path) -> OntologyFile:
    return read_files(file, folder).files[-1]


def _statement(prop: Property, text: str, *, sort: str = "") -> str:
    typed = f' xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" rdf:datatype="{_XSD}{sort}"' if sort else ""
    return f'<core:{prop} xmlns:core="{CORE}"{typed}>{_ascii(text)}</core:{prop}>'


def _brief(statement: str, content: bytes) -> str:
    """Without the declaration of a prefix that the file has at its top, as Protégé writes it."""
    return statement.replace(f' xmlns:owl="{_OWL}"', "") if f'xmlns:owl="{_OWL}"'.encode() in content else statement


def _ascii(text: str) -> str:
    """Text for XML, in attributes too."""
    return "".join(c if (c.isalnum() and c.isascii()) or c in " .,:;/#_-+()=" else f"&#{ord(c)};" for c in text)
