"""Ontology files: found by their IRI in a folder, read with their imports, never from the network."""

from __future__ import annotations

import difflib
import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from pyoxigraph import Triple
from rdflib import OWL, RDF, Graph, URIRef

from kb.parsing import Header, parse, read_bytes, read_header
from kb.problems import OntologyRejected, Problem, warn
from kb.vocabulary import CORE_IRI

SHIPPED = Path(__file__).resolve().parent / "ontologies"


@dataclass(frozen=True, slots=True, kw_only=True)
class OntologyFile:
    """One parsed file.

    Attributes:
        triples: What it says, as pyoxigraph's terms; its blank nodes are its own.
        graph: The same, as rdflib's terms.
        lines: First line that describes an entity, by its IRI.
    """

    path: Path
    iri: str
    triples: tuple[Triple, ...] = field(repr=False)
    graph: Graph = field(repr=False)
    content: bytes = field(repr=False)
    lines: dict[str, int] = field(repr=False)

    def line_of(self, entity: str) -> int:
        """Line where an entity is described; 0 if it is not in this file."""
        return self.lines.get(entity, 0)

    def line_of_statement(self, subject: str | None, others: frozenset[str]) -> int:
        """The line of a statement about an entity: in its description, the first that names one of the others.

        Args:
            subject: None for a statement about all alike, such as `AllDisjointClasses`.
        """
        texts = self.content.decode("utf-8", errors="replace").splitlines()
        names = [re.compile(rf"{re.escape(local_name(iri))}(?!\w)") for iri in sorted(others)]
        if subject is None:
            for number, text in enumerate(texts, start=1):
                span = "\n".join(texts[number - 1 : number + 2 * len(names) + 3])
                if ("AllDisjoint" in text or "AllDifferent" in text) and all(name.search(span) for name in names):
                    return number
            return 0
        begin = self.line_of(subject)
        end = min((n for n in self.lines.values() if n > begin), default=len(texts) + 1) if begin else 0
        inside = (n for n in range(begin + 1, end) if any(name.search(texts[n - 1]) for name in names))
        return next(inside, begin)


@dataclass(frozen=True, kw_only=True)
class OntologyFiles:
    """A file and everything that it imports, imports first."""

    files: tuple[OntologyFile, ...]

    @cached_property
    def digest(self) -> str:
        """Hash of all contents, in an order that does not depend on where files stand."""
        total = hashlib.sha256()
        for file in sorted(self.files, key=lambda f: f.iri):
            total.update(hashlib.sha256(file.content).digest())
        return total.hexdigest()

    def merged(self) -> Graph:
        """One graph of all files, without the import statements; not to be changed."""
        return self._merged

    @cached_property
    def _merged(self) -> Graph:
        graph = Graph()
        for file in self.files:
            for triple in file.graph:
                if triple[1] != OWL.imports:
                    graph.store.add(triple, graph)
        return graph

    def file_of(self, entity: str) -> OntologyFile:
        """The file that describes an entity: the one that gives its type, else the first that names it."""
        node = URIRef(entity)
        for file in self.files:
            if (node, RDF.type, None) in file.graph:
                return file
        for file in self.files:
            if (node, None, None) in file.graph or (None, None, node) in file.graph:
                return file
        return self.files[-1]

    def problem(self, code: str, entity: str, message: str) -> Problem:
        """A problem at the place where an entity, or the file itself, is described."""
        file = self.file_of(entity)
        name = "" if entity == file.iri else local_name(entity)
        return Problem(code=code, file=file.path, line=file.line_of(entity), entity=name, message=message)


class FilesRejected(OntologyRejected):
    """Not all files of a site can be read.

    Attributes:
        files: Those that can.
    """

    def __init__(self, problems: Sequence[Problem], files: OntologyFiles) -> None:
        super().__init__(problems)
        self.files = files


def local_name(iri: str) -> str:
    """What people read of an IRI: the part behind `#`."""
    return iri.rsplit("#", 1)[-1]


def read_files(path: Path, folder: Path) -> OntologyFiles:
    """Read an ontology file and all that it imports from `folder` (and the shipped core).

    Files may import each other.

    Raises:
        FilesRejected: A file does not parse, or an import has no file or two.
    """
    headers = _headers(folder, path)
    index = _by_iri(headers)
    nameless = [p for p in _owl_files(folder) if p not in headers]
    parsed: dict[str, OntologyFile] = {}
    problems: list[Problem] = []
    in_order: list[OntologyFile] = []
    refused: set[Path] = set()

    def visit(current: Path) -> None:
        try:
            file = _read(current)
        except OntologyRejected as rejected:
            problems.extend(rejected.problems)
            refused.add(current)
            # What else does not parse is told at once; what this one lacks, when it can be read.
            for imported in _imports(headers, current) or ():
                for other in index.get(imported, ()):
                    if imported not in parsed and other not in refused:
                        visit(other)
            return
        parsed[file.iri] = file
        for imported in sorted(str(o) for o in file.graph.objects(URIRef(file.iri), OWL.imports)):
            if imported in parsed:
                continue
            # What is called so, but has no IRI, was cut off perhaps: that it does not parse is what helps.
            paths = index.get(imported) or [p for p in nameless if p.name == imported.rpartition("/")[2]]
            if len(paths) != 1:
                problems.append(_import_problem(file, imported, index, folder))
            elif paths[0] not in refused:
                visit(paths[0])
        in_order.append(file)

    visit(path)
    files = OntologyFiles(files=tuple(in_order))
    if problems:
        raise FilesRejected(problems, files)
    return files


def _read(path: Path) -> OntologyFile:
    content = read_bytes(path)
    parsed = parse(path, content)
    return OntologyFile(
        path=path, iri=parsed.iri, triples=parsed.triples, graph=parsed.graph, content=content, lines=parsed.lines
    )


def _import_problem(file: OntologyFile, imported: str, index: dict[str, list[Path]], folder: Path) -> Problem:
    paths = index.get(imported)
    code = "KB002"
    if paths:
        code = "KB003"
        told = f"imports {imported}, which two files claim to be: {paths[0]} and {paths[1]}; give one another IRI"
    elif not imported.startswith(("http:", "https:", "urn:")):
        code = "KB006"
        told = f"imports {imported}, a place and not the IRI of an ontology; import the IRI that the file itself states"
    else:
        told = f"imports {imported}, but no file in {folder} has this ontology IRI; {_nearest(imported, index)}"
    return Problem(code=code, file=file.path, line=file.line_of(file.iri), entity="", message=told)


def _nearest(imported: str, index: dict[str, list[Path]]) -> str:
    near = difflib.get_close_matches(imported, sorted(index), n=1, cutoff=0.8)
    return f"did you mean {near[0]}?" if near else "put it there"


def unused_files(folder: Path, mains: Sequence[Path]) -> list[Problem]:
    """Ontology files of a folder that no site reads: a warning each (KB010); none while an import is not found.

    Args:
        mains: Where each site of the folder begins to be read.
    """
    headers = _headers(folder, *mains)
    index = _by_iri(headers)
    used, todo = set(mains), list(mains)
    while todo:
        imports = _imports(headers, todo.pop())
        if imports is None or not set(imports) <= index.keys():
            return []  # it would blame a file for an import that is misspelt, or cannot be read
        found = {path for imported in imports for path in index[imported]} - used
        used |= found
        todo += found
    told = "is imported by no site of the folder: nothing that it says holds; "
    return [
        warn(Problem(code="KB010", file=path, line=0, entity="", message=told + _remedy(headers.get(path))))
        for path in _owl_files(folder)
        if path not in used
    ]


def _remedy(header: Header | None) -> str:
    if header is None:
        return "it has no ontology IRI by which it could be: give it one, or move it away"
    return f"import {header.iri} where it is needed, or move it away"


def _imports(headers: Mapping[Path, Header], path: Path) -> tuple[str, ...] | None:
    header = headers.get(path)
    return None if header is None else header.imports


def _owl_files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*.owl") if path.is_file())


def _headers(folder: Path, *mains: Path) -> dict[Path, Header]:
    """What files claim to be, as far as they claim anything; with the shipped core where the folder has none."""
    core = SHIPPED / "core" / "core.owl"
    found = {path: header for path in sorted({*_owl_files(folder), *mains}) if (header := read_header(path))}
    if all(header.iri != CORE_IRI for header in found.values()):
        found[core] = Header(iri=CORE_IRI, imports=())
    return found


def _by_iri(headers: Mapping[Path, Header]) -> dict[str, list[Path]]:
    index: dict[str, list[Path]] = {}
    for path, header in headers.items():
        index.setdefault(header.iri, []).append(path)
    return index
