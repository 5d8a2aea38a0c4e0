"""What is in the files of an item: read before they are accepted, and checked like those of a site.

What only a site can complete is left to it: groundings of the processes that a file describes (KB101), recipes of
its task types (KB130), how travel is estimated and what services need to know (checked when a site is loaded).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from rdflib import OWL, RDF, RDFS, BNode, Literal, URIRef

from kb.checking import check_ontology
from kb.compiler import Compiler
from kb.files import SHIPPED, local_name
from kb.ontology import Ontology
from kb.parsing import header_iri, parse, read_bytes
from kb.problems import OntologyRejected, Problem, reject_errors
from kb.processes import read_processes
from kb.repository.items import BadItem, Description, ItemKind
from kb.terms import Struct
from kb.vocabulary import CORE_IRI, Kind

_LEFT_TO_SITES = frozenset({"KB101", "KB130"})
_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_ANY_REVISION = 0
_WANTED = {
    ItemKind.RECIPE: (Kind.COMPOSITE_PROCESS, "a recipe has at least one CompositeProcess"),
    ItemKind.ROBOT: (Kind.ROBOT, "a model of robots has at least one class below Robot"),
    ItemKind.OBJECT: (Kind.PHYSICAL_OBJECT, "a model of objects has at least one class below PhysicalObject"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Contents:
    """What the ontologies of an item say.

    Attributes:
        iris: Of its ontologies, by path.
        imports: Ontologies that it imports and does not have itself; without core.owl, which is everywhere.
        roots: Paths of those that none of the others imports.
        words: Names, labels and comments, to be found by.
    """

    iris: Mapping[str, str]
    imports: frozenset[str]
    roots: tuple[str, ...]
    words: str


def read_contents(about: Description, folder: Path, paths: Iterable[str]) -> Contents:
    """Read the ontologies of an item.

    Args:
        folder: Where its files are.

    Raises:
        OntologyRejected: One does not parse.
        BadItem: There is none, two have one IRI, or one claims to be core.owl.
    """
    iris: dict[str, str] = {}
    imports: dict[str, set[str]] = {}
    words: list[str] = []
    for path in sorted(p for p in paths if p.lower().endswith(".owl")):
        try:
            parsed = parse(folder / path, read_bytes(folder / path))
        except OntologyRejected as rejected:
            raise OntologyRejected(_below(folder, rejected.problems)) from rejected
        if parsed.iri == CORE_IRI:
            raise BadItem(about.name, f"{path} claims to be core.owl, which comes with Concertmaster; leave it out")
        if parsed.iri in iris.values():
            other = next(p for p, iri in iris.items() if iri == parsed.iri)
            raise BadItem(about.name, f"{path} and {other} are both the ontology {parsed.iri}; give one another IRI")
        iris[path] = parsed.iri
        imports[path] = {str(o) for o in parsed.graph.objects(None, OWL.imports)}
        named = {s for s in parsed.graph.subjects(RDF.type) if isinstance(s, URIRef) and not isinstance(s, BNode)}
        words += sorted(local_name(str(s)) for s in named)
        texts = [o for p in (RDFS.label, RDFS.comment) for o in parsed.graph.objects(None, p) if isinstance(o, Literal)]
        words += sorted(map(str, texts))
    if not iris:
        raise BadItem(about.name, "has no ontology; every item needs one (.owl) that says what the other files are")
    inside = set().union(*imports.values())
    roots = tuple(path for path, iri in iris.items() if iri not in inside) or tuple(iris)[:1]
    outside = frozenset(inside - set(iris.values()) - {CORE_IRI})
    return Contents(iris=iris, imports=outside, roots=roots, words=searchable(" ".join(words)))


def check_contents(about: Description, contents: Contents, folder: Path) -> tuple[str, ...]:
    """Check an item, with all that it imports beside it.

    Args:
        folder: With its files, and those of what it imports.

    Returns:
        Classes that its processes require of robots, sorted.

    Raises:
        OntologyRejected: Something in its own files is wrong.
        BadItem: It is not of its kind.
    """
    capabilities: set[str] = set()
    found = False
    for root in contents.roots:
        ontology, problems = check_ontology(folder / root, folder)
        _reject_own(contents, folder, problems)
        if ontology is None:  # what it imports is wrong, which was right when that was taken in
            raise OntologyRejected(_below(folder, problems))
        capabilities |= _compile(contents, folder, ontology)
        found = found or _is_of_kind(about.kind, ontology, set(contents.iris.values()))
    if not found:
        told = _WANTED.get(about.kind, (None, "an environment has at least one Area or Location"))[1]
        raise BadItem(about.name, f"is no {about.kind}: {told}; or upload it as an ontology")
    return tuple(sorted(capabilities))


def shipped_iris() -> frozenset[str]:
    """The ontologies that come with Concertmaster, which every site has."""
    return frozenset(iri for path in SHIPPED.rglob("*.owl") if (iri := header_iri(path)))


def searchable(text: str) -> str:
    """Text with the parts of names beside them, so that FindEmptyDrink is found by drink."""
    parts = {part for word in re.findall(r"\w+", text) for part in _WORDS.findall(word.replace("_", " "))}
    return f"{text} {' '.join(sorted(parts))}"


def _compile(contents: Contents, folder: Path, ontology: Ontology) -> set[str]:
    """What the processes of an item require; of those that a site has to complete, nothing is known yet."""
    own = set(contents.iris.values())
    try:
        facts = Compiler(ontology, read_processes(ontology)).facts(_ANY_REVISION)
    except OntologyRejected as rejected:
        _reject_own(contents, folder, rejected.problems)
        return set()
    required = set()
    for fact in facts:
        match fact:
            case Struct("requires", (_, str(name), str(capability))) if _ontology_of(ontology, name) in own:
                required.add(capability)
            case _:
                pass
    return required


def _is_of_kind(kind: ItemKind, ontology: Ontology, own: set[str]) -> bool:
    if kind is ItemKind.ONTOLOGY:
        return True
    if kind is ItemKind.RECIPE:
        named = ontology.individuals(Kind.COMPOSITE_PROCESS)
    elif kind is ItemKind.ENVIRONMENT:
        named = [*ontology.individuals(Kind.AREA), *ontology.individuals(Kind.LOCATION)]
    else:
        top = _WANTED[kind][0]
        named = [c for c, above in ontology.superclasses.items() if top in above and c != top]
    return any(_ontology_of(ontology, name) in own for name in named)


def _ontology_of(ontology: Ontology, name: str) -> str:
    """The IRI of the file that describes an entity; empty where it is not one of the files, as `Nothing`."""
    try:
        return ontology.files.file_of(ontology.iri(name)).iri
    except KeyError:
        return ""


def _reject_own(contents: Contents, folder: Path, problems: Iterable[Problem]) -> None:
    """What is wrong with what it imports is not the item's fault, and was accepted before."""
    own = {folder / path for path in contents.iris}
    reject_errors(_below(folder, (p for p in problems if p.file in own and p.code not in _LEFT_TO_SITES)))


def _below(folder: Path, problems: Iterable[Problem]) -> list[Problem]:
    """The same problems, with files as the uploader named them."""
    return [
        replace(p, file=p.file.relative_to(folder), message=p.message.replace(f"{folder}/", ""))
        if p.file.is_relative_to(folder)
        else p
        for p in problems
    ]
