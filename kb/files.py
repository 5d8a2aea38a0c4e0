"""Ontology files: found by their IRI in a folder, parsed with their imports, never from the network."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat
from xml.sax import SAXException

from rdflib import OWL, RDF, Graph, URIRef
from rdflib.exceptions import ParserError

from kb.problems import OntologyRejected, Problem
from kb.vocabulary import CORE_IRI

SHIPPED = Path(__file__).resolve().parent / "ontologies"

_HEADER = re.compile(rb"<owl:Ontology\s[^>]*rdf:about\s*=\s*[\"']([^\"']+)[\"']")
_LONGEST_ENTITY = 300
_ABOUT = re.compile(r"rdf:(?:about|ID)\s*=\s*[\"']([^\"']+)[\"']")


@dataclass(frozen=True, slots=True, kw_only=True)
class OntologyFile:
    """One parsed file.

    Attributes:
        lines: First line that describes an entity, by its IRI.
    """

    path: Path
    iri: str
    graph: Graph
    content: bytes
    lines: dict[str, int] = field(repr=False)

    def line_of(self, entity: str) -> int:
        """Line where an entity is described; 0 if it is not in this file."""
        return self.lines.get(entity, 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class OntologyFiles:
    """A file and everything that it imports, imports first."""

    files: tuple[OntologyFile, ...]

    @property
    def digest(self) -> str:
        """Hash of all contents, in an order that does not depend on where files stand."""
        total = hashlib.sha256()
        for file in sorted(self.files, key=lambda f: f.iri):
            total.update(hashlib.sha256(file.content).digest())
        return total.hexdigest()

    def merged(self) -> Graph:
        """One graph of all files, without the import statements."""
        graph = Graph()
        for file in self.files:
            for triple in file.graph:
                if triple[1] != OWL.imports:
                    graph.add(triple)
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
        """A problem at the place where an entity is described."""
        file = self.file_of(entity)
        return Problem(code=code, file=file.path, line=file.line_of(entity), entity=local_name(entity), message=message)


def local_name(iri: str) -> str:
    """What people read of an IRI: the part behind `#`."""
    return iri.rsplit("#", 1)[-1]


def read_files(path: Path, folder: Path) -> OntologyFiles:
    """Read an ontology file and all that it imports from `folder` (and the shipped core).

    Raises:
        OntologyRejected: A file does not parse, or an import has no file or two.
    """
    index = _index(folder, path)
    parsed: dict[str, OntologyFile] = {}
    problems: list[Problem] = []
    in_order: list[OntologyFile] = []

    def visit(current: Path) -> None:
        try:
            file = _parse(current)
        except OntologyRejected as rejected:
            problems.extend(rejected.problems)
            return
        parsed[file.iri] = file
        for imported in sorted(str(o) for o in file.graph.objects(URIRef(file.iri), OWL.imports)):
            if imported in parsed:
                continue
            paths = index.get(imported, [])
            if len(paths) == 1:
                visit(paths[0])
            else:
                problems.append(_import_problem(file, imported, paths, folder))
        in_order.append(file)

    visit(path)
    if problems:
        raise OntologyRejected(problems)
    return OntologyFiles(files=tuple(in_order))


def _import_problem(file: OntologyFile, imported: str, paths: list[Path], folder: Path) -> Problem:
    if paths:
        code, message = "KB003", f"imports {imported}, which two files claim to be: {paths[0]} and {paths[1]}"
    else:
        code, message = "KB002", f"imports {imported}, but no file in {folder} has this ontology IRI"
    return Problem(code=code, file=file.path, line=file.line_of(file.iri), entity="", message=message)


def _index(folder: Path, main: Path) -> dict[str, list[Path]]:
    """Paths by ontology IRI, read from the files' headers; the shipped core where the folder has none."""
    index: dict[str, list[Path]] = {}
    for path in sorted({*folder.rglob("*.owl"), main}):
        with path.open("rb") as stream:
            found = _HEADER.search(stream.read(65536))
        if found:
            index.setdefault(found.group(1).decode(errors="replace"), []).append(path)
    index.setdefault(CORE_IRI, [SHIPPED / "core" / "core.owl"])
    return index


def _parse(path: Path) -> OntologyFile:
    content = path.read_bytes()

    def rejected(line: int, message: str) -> OntologyRejected:
        return OntologyRejected([Problem(code="KB001", file=path, line=line, entity="", message=message)])

    if not content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        raise rejected(1, "is not RDF/XML; in Protégé choose File > Save as > RDF/XML Syntax")
    xml = expat.ParserCreate(namespace_separator=" ")
    xml.EntityDeclHandler = _refuse_bomb
    graph = Graph()
    try:
        xml.Parse(content, True)
        graph.parse(data=content, format="xml", publicID=path.resolve().as_uri())
    except (expat.ExpatError, SAXException, ParserError, ValueError) as error:
        raise rejected(xml.CurrentLineNumber, f"does not parse as RDF/XML: {error}") from error
    iris = sorted(str(s) for s in graph.subjects(RDF.type, OWL.Ontology) if isinstance(s, URIRef))
    if len(iris) != 1:
        raise rejected(1, f"has {len(iris)} ontology IRIs; one <owl:Ontology rdf:about=...> is needed")
    return OntologyFile(path=path, iri=iris[0], graph=graph, content=content, lines=_lines(content, iris[0]))


def _refuse_bomb(
    name: str,
    is_parameter: bool,
    value: str | None,
    base: str | None,
    system: str | None,
    public: str | None,
    note: str | None,
) -> None:
    """Entities abbreviate IRIs; one that holds others, or stands elsewhere, may grow without end or spy."""
    if is_parameter or value is None or "&" in value or len(value) > _LONGEST_ENTITY:
        raise ValueError(f"the entity {name} is not a plain IRI; write it out where it is used")


def _lines(content: bytes, base: str) -> dict[str, int]:
    lines: dict[str, int] = {}
    for number, text in enumerate(content.decode("utf-8", errors="replace").splitlines(), start=1):
        for about in _about(text):
            lines.setdefault(about if ":" in about else f"{base}#{about.lstrip('#')}", number)
    return lines


def _about(line: str) -> Iterable[str]:
    return _ABOUT.findall(line)
