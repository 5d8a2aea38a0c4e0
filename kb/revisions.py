"""Revisions: the files of a site as they were read once, whole, and never changed after.

A new revision is read beside the one in force. What has been told since is carried over from one to the other where
it still makes sense; values in files are only where things begin.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import TypeAlias

from rdflib import OWL, RDFS, URIRef

from kb.checking import Checked, read_site
from kb.compiler import Compiler
from kb.errors import KnowledgeError
from kb.files import local_name
from kb.groundings import Grounding, TravelEstimate
from kb.history import shown
from kb.learned import main_file, site_file
from kb.ontology import Ontology, Value, fluent_properties
from kb.problems import Problem
from kb.processes import Process
from kb.sites import sites_of
from kb.terms import Struct, Term
from kb.vocabulary import Kind

Key: TypeAlias = tuple[str, str]
"""A property and an individual."""

_keys = itertools.count(1)


class UnknownSite(KnowledgeError, LookupError):
    """There is no site of this name.

    Attributes:
        site: What was asked for.
        known: The sites there are.
    """

    def __init__(self, site: str, known: list[str], folder: Path) -> None:
        self.site, self.known = site, known
        super().__init__(f"no site {site!r} in {folder / 'sites'}; there is {', '.join(known) or 'none'}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Revision:
    """What the files of a site said when they were read.

    Attributes:
        number: Counts the revisions of one knowledge base, from 1: for people and traces.
        key: What its facts are kept under in Prolog; no two revisions of this process share one.
        folder: Where the files were.
        initial: What changes while robots work, as the files state it, by (property, individual).
        data: Hash of each file that services read, such as maps, by its path within the folder of ontologies.
        facts: What the planner is given.
        warnings: What is probably not meant.
    """

    number: int = 1
    key: int
    site: str
    folder: Path
    ontology: Ontology = field(repr=False)
    processes: Mapping[str, Process] = field(repr=False)
    groundings: Mapping[str, Grounding] = field(repr=False)
    travel_estimates: tuple[TravelEstimate, ...] = field(repr=False)
    compiler: Compiler = field(repr=False)
    initial: Mapping[Key, Value] = field(repr=False)
    data: Mapping[str, str] = field(repr=False)
    facts: tuple[Term, ...] = field(repr=False)
    warnings: tuple[Problem, ...] = field(repr=False)

    @property
    def digest(self) -> str:
        """Hash of the contents of all its files."""
        return self.ontology.files.digest

    def says_the_same(self, other: Revision) -> bool:
        """Whether all files are the same."""
        return self.digest == other.digest and self.data == other.data

    def is_as_read(self) -> bool:
        """Whether its ontologies still are where they were, with the same contents."""
        try:
            return all(file.path.read_bytes() == file.content for file in self.ontology.files.files)
        except OSError:
            return False

    def executed(self, process: str) -> tuple[Grounding | None, tuple[str, ...]]:
        """How a process is executed, wherever the folder is: its grounding, and the hashes of the files in it."""
        grounding = self.groundings.get(process)
        if grounding is None:
            return None, ()
        request = tuple(replace(f, file=f.file and Path(within(f.file, self.folder))) for f in grounding.request)
        hashes = tuple(self.data[str(f.file)] for f in request if f.file is not None)
        return replace(grounding, request=request), hashes

    @property
    def things(self) -> frozenset[str]:
        """The individuals that tasks and facts may name."""
        kinds = (Kind.ROBOT, Kind.AREA, Kind.LOCATION, Kind.PHYSICAL_OBJECT)
        return frozenset(name for kind in kinds for name in self.ontology.individuals(kind))


def first_file(site: str, folder: Path) -> Path:
    """The file that imports all that is known of a site.

    Raises:
        UnknownSite: The folder has no such site.
    """
    known = sites_of(folder)
    if site not in known:
        raise UnknownSite(site, known, folder)
    return main_file(folder, site)


def read_revision(site: str, folder: Path) -> Revision:
    """Read, check, classify and compile the files of a site; nothing else changes.

    Raises:
        UnknownSite: The folder has no such site.
        OntologyRejected: With everything that is wrong.
    """
    key = next(_keys)
    checked: Checked = read_site(first_file(site, folder), folder, key)
    fluents = fluent_properties(checked.ontology)
    requests = [g.request for g in checked.groundings.values()] + [e.request for e in checked.travel_estimates]
    files = sorted({f.file for request in requests for f in request if f.file is not None})
    return Revision(
        key=key,
        site=site,
        folder=folder,
        ontology=checked.ontology,
        processes=MappingProxyType(dict(checked.processes)),
        groundings=MappingProxyType(dict(checked.groundings)),
        travel_estimates=checked.travel_estimates,
        compiler=checked.compiler,
        initial=MappingProxyType({(p, s): v for p, s, v in checked.ontology.all_values() if p in fluents}),
        data=MappingProxyType({within(f, folder): sha256(f.read_bytes()).hexdigest() for f in files}),
        facts=tuple(checked.facts),
        warnings=checked.warnings,
    )


def within(path: Path, folder: Path) -> str:
    """A path as seen from a folder, with slashes; its name if it is elsewhere."""
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else path.name


def write_copy(revision: Revision, folder: Path) -> None:
    """Write the files that a revision was read from, and what stands beside its site's, where they can be read again.

    Args:
        folder: Made for it; if it is there, nothing is written.
    """
    if folder.exists():
        return
    part = folder.with_name(f"{folder.name}.part")  # where a copy was broken off, the next one goes on
    for path in site_file(revision.folder, revision.site).parent.rglob("*"):
        if path.is_file() and path.suffix != ".owl":
            _write(part / within(path, revision.folder), path.read_bytes())
    for file in revision.ontology.files.files:
        _write(part / within(file.path, revision.folder), file.content)
    part.rename(folder)


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


def renewed(revision: Revision) -> Revision:
    """The same under a new key: sessions may still use the facts under the old one."""
    key = next(_keys)
    facts = tuple(Struct(f.functor, (key, *f.args[1:])) for f in revision.facts if isinstance(f, Struct))
    return replace(revision, key=key, facts=facts)


@dataclass(frozen=True, slots=True, kw_only=True)
class CarryOver:
    """What holds when one revision follows another.

    Attributes:
        fluents: All that changes while robots work, with the values that it has then.
        changed: What has another value than before, or none any more.
        dropped: What had been told and makes no sense any more, with the reason.
        overridden: What the files state anew without effect, as something else has been told; a sentence each.
    """

    fluents: Mapping[Key, Value]
    changed: Mapping[Key, Value | None]
    dropped: Mapping[Key, str]
    overridden: tuple[str, ...]

    @property
    def sentences(self) -> tuple[str, ...]:
        """What becomes of facts, for people: changed by the files, kept against them, dropped."""
        by_files = sorted(key for key in self.changed if key not in self.dropped)
        return (
            *(f"{p}({s}) is {shown(self.changed[p, s])} from now on, as the files say" for p, s in by_files),
            *self.overridden,
            *(f"{p}({s}) is forgotten: {why}" for (p, s), why in sorted(self.dropped.items())),
        )


def carry_over(old: Revision, new: Revision, now: Mapping[Key, Value], told: frozenset[Key]) -> CarryOver:
    """What holds under a new revision.

    What has been told stays as long as property and individual exist and the value fits. Of the rest, the files say
    what holds.

    Args:
        now: What holds under the old revision.
        told: What has been told since the first one.
    """
    fluents, dropped, overridden = dict(new.initial), dict[Key, str](), list[str]()
    properties = fluent_properties(new.ontology)
    for prop, subject in sorted(told & now.keys()):
        key, value = (prop, subject), now[prop, subject]
        why = _misfit(old, new, properties, key, value)
        if why:
            dropped[key] = why
            continue
        stated = new.initial.get(key)
        if stated is not None and stated not in (old.initial.get(key), value):
            overridden.append(
                f"{prop}({subject}) stays {shown(value)}, as told; the files now begin with {shown(stated)}"
            )
        fluents[key] = value
    keys = sorted(now.keys() | fluents.keys())
    changed = {key: fluents.get(key) for key in keys if now.get(key) != fluents.get(key)}
    return CarryOver(
        fluents=MappingProxyType(fluents),
        changed=MappingProxyType(changed),
        dropped=MappingProxyType(dropped),
        overridden=tuple(overridden),
    )


def _misfit(old: Revision, new: Revision, properties: frozenset[str], key: Key, value: Value) -> str:
    """Why a fact that was told makes no sense any more; empty if it does."""
    prop, subject = key
    if prop not in properties:
        return f"there is no property {prop} any more that changes"
    if subject not in new.ontology.kinds:
        return f"there is no {subject} any more"
    if isinstance(value, str) and value in old.ontology.kinds and value not in new.ontology.kinds:
        return f"there is no {value} any more"
    for thing, kind in wrong_kinds(new.ontology, prop, subject, value):
        return f"{thing} is no {kind} any more"
    return ""


def wrong_kinds(ontology: Ontology, prop: str, subject: str, value: Value) -> Iterator[tuple[str, str]]:
    """The individuals of a fact that are not of the class which its property asks for, with that class."""
    for thing, side in ((subject, RDFS.domain), (value, RDFS.range)):
        if isinstance(thing, str) and thing in ontology.kinds:
            for of, kind in sorted(ontology.graph.subject_objects(side)):
                wanted = local_name(str(kind))
                asked = local_name(str(of)) == prop and isinstance(kind, URIRef) and kind != OWL.Thing
                if asked and not ontology.is_a(thing, wanted):
                    yield thing, wanted
