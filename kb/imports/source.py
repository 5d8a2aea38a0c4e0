"""RDF/XML files of others: read with what they import from beside them, and with what was made use of.

More is let pass than in our own files (any encoding, relative ontology IRIs, undeclared terms), as these
are to be read, not kept. What an importer never asked for is told in the end: nothing is lost silently.
"""

from __future__ import annotations

import logging
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from urllib.parse import urldefrag, urljoin
from xml.parsers import expat
from xml.sax import SAXException

from rdflib import OWL, RDF, RDFS, BNode, Graph, Literal, URIRef
from rdflib.exceptions import ParserError
from rdflib.term import Node

from kb.imports.names import local
from kb.imports.report import Fate, Note, NotImportable

_RDF_NS = str(RDF)
_LARGEST_BYTES = 20_000_000
_LONGEST_ENTITY = 300
_ENTITY = re.compile(rb"&([A-Za-z_][\w.-]*);")
_DEEP = 12
_MANY = 3
_SILENT = {OWL.imports, OWL.versionInfo, RDFS.isDefinedBy, RDFS.seeAlso}
"""Of no consequence to what is made of a file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _File:
    path: Path
    iri: str
    graph: Graph
    lines: dict[str, int] = field(repr=False)


class Source:
    """A file of others and what it imports, as one graph."""

    def __init__(
        self,
        path: Path,
        *,
        is_vocabulary: Callable[[str], bool] = lambda iri: False,
        canonical: Callable[[str], str] = str,
    ) -> None:
        """Read a file and, of what it imports, what is in the same folder or below.

        Args:
            is_vocabulary: Tells of the IRI of an ontology that it is not to be read: the importer knows it.
            canonical: What to read for an IRI: vocabularies are found under many addresses.

        Raises:
            NotImportable: The file, or one that it imports, does not parse.
        """
        self.notes: list[Note] = []
        self._files = [_read(path)]
        self._read: set[tuple[Node, Node, Node]] = set()
        self._signatures: dict[Node, str] = {}
        self._gather(path, is_vocabulary)
        self.graph = Graph()
        for triple in (t for file in self._files for t in file.graph):
            subject, prop, value = (URIRef(canonical(str(n))) if isinstance(n, URIRef) else n for n in triple)
            self.graph.add((subject, prop, value))

    @property
    def path(self) -> Path:
        """The file that was asked for."""
        return self._files[0].path

    @property
    def iri(self) -> str:
        """Of the ontology in it."""
        return self._files[0].iri

    def _gather(self, path: Path, is_vocabulary: Callable[[str], bool]) -> None:
        beside: dict[str, Path] | None = None
        known = {self.iri}
        for file in self._files:
            for imported in sorted(map(str, file.graph.objects(None, OWL.imports))):
                if imported in known or is_vocabulary(imported):
                    continue
                known.add(imported)
                beside = _beside(path) if beside is None else beside
                if imported in beside:
                    self._files.append(_read(beside[imported]))
                else:
                    told = f"no file beside {path.name} has the ontology {imported}; what it says is not known"
                    self.notes.append(_note(file, "imports", Fate.LEFT_OUT, told))

    # Asking

    def value(self, subject: Node, *properties: URIRef) -> Node | None:
        """The value of the first property that has one; the first in order where there are several."""
        for prop in properties:
            if values := self.values(subject, prop):
                return values[0]
        return None

    def values(self, subject: Node, *properties: URIRef) -> list[Node]:
        """All values of properties, in an order that is the same in each run."""
        found = [(p, o) for p in properties for o in self.graph.objects(subject, p)]
        self._read.update((subject, p, o) for p, o in found)
        return sorted({o for _, o in found}, key=self._signature)

    def subjects(self, prop: URIRef, value: Node) -> list[Node]:
        """All that has this value, in order."""
        found = set(self.graph.subjects(prop, value))
        self._read.update((s, prop, value) for s in found)
        return sorted(found, key=self._signature)

    def of_type(self, kind: URIRef) -> list[Node]:
        """All individuals that are said to be of a class, in order."""
        return self.subjects(RDF.type, kind)

    def is_a(self, node: Node, kind: URIRef) -> bool:
        """Whether a node is said to be of a class."""
        self._read.add((node, RDF.type, kind))
        return (node, RDF.type, kind) in self.graph

    def items(self, node: Node, first: Iterable[URIRef], rest: Iterable[URIRef]) -> list[Node]:
        """The items of a list; `first` and `rest` are the properties that may make it."""
        items: list[Node] = []
        seen: set[Node] = set()
        firsts, rests = tuple(first), tuple(rest)
        current: Node | None = node
        while current is not None and current not in seen:
            seen.add(current)
            items += self.values(current, *firsts)[:1]
            self.types(current)
            current = self.value(current, *rests)
        return items

    # Telling

    def note(self, node: Node | str, fate: Fate, message: str) -> None:
        """Remember what happened to a node, at the entity that it is part of."""
        named = self.named(node) if isinstance(node, Node) else node
        file = next((f for f in self._files if named in f.lines), self._files[0])
        self.notes.append(_note(file, named, fate, message))

    def named(self, node: Node) -> str:
        """IRI of a node; of an anonymous one that of the entity that it is part of."""
        current, seen = node, {node}
        while isinstance(current, BNode):
            above = sorted((s for s in self.graph.subjects(None, current) if s not in seen), key=self._signature)
            if not above:
                return self.iri
            current = above[0]
            seen.add(current)
        return str(current)

    def types(self, node: Node) -> list[Node]:
        """All classes that a node is said to be of."""
        return self.values(node, RDF.type)

    def tell_unread(self, because: str) -> None:
        """Note all that nothing has asked for: whole entities by their class, else statements by their property."""
        unread: dict[str, list[tuple[Node, Node, Node]]] = {}
        read: set[str] = set()
        for triple in self.graph:
            subject, prop, value = triple
            if triple in self._read:
                read.add(self.named(subject))
            elif prop not in _SILENT and value not in (OWL.Ontology, OWL.NamedIndividual, RDF.List):
                unread.setdefault(self.named(subject), []).append(triple)
        wholes: dict[str, Counter[str]] = {}
        parts: dict[str, Counter[str]] = {}
        for entity, triples in unread.items():
            if entity in read or entity == self.iri:
                for _, prop, value in triples:
                    about = local(str(value)) if prop == RDF.type else local(str(prop))
                    parts.setdefault(about, Counter())[entity] += 1
            else:
                kinds = sorted(local(str(o)) for s, p, o in triples if p == RDF.type and str(s) == entity)
                wholes.setdefault(" and ".join(kinds), Counter())[entity] += len(triples)
        for kind, found in wholes.items():
            of = f", of the class {kind}" if kind else ""
            self._tell(found, "{entities}" + f"{of} ({found.total()} statements): {because}")
        for about, found in parts.items():
            times = f"{found.total()} times: " if found.total() > 1 else ""
            self._tell(found, f"{about} ({times}" + "{entities}): " + because)

    def _tell(self, found: Counter[str], message: str) -> None:
        names = sorted(found, key=lambda e: (self._line(e), e))
        shown = ", ".join(map(local, names[:_MANY])) + (f" and {len(names) - _MANY} more" if len(names) > _MANY else "")
        self.note(names[0], Fate.LEFT_OUT, message.replace("{entities}", shown))

    def _line(self, named: str) -> int:
        return next((f.lines[named] for f in self._files if named in f.lines), 0)

    def _signature(self, node: Node) -> str:
        """What a node says, without the names of anonymous nodes, which differ from run to run."""
        if not isinstance(node, BNode):
            return repr((str(node), str(getattr(node, "datatype", "")), str(getattr(node, "language", ""))))
        if node not in self._signatures:
            self._signatures[node] = self._described(node, 0)
        return self._signatures[node]

    def _described(self, node: Node, depth: int) -> str:
        if not isinstance(node, BNode) or depth > _DEEP:
            return "" if isinstance(node, BNode) else str(node)
        return (
            "["
            + ";".join(sorted(f"{p} {self._described(o, depth + 1)}" for p, o in self.graph.predicate_objects(node)))
            + "]"
        )


def texts(nodes: Iterable[Node]) -> Iterator[str]:
    """The texts among nodes, without the space around."""
    for node in nodes:
        if isinstance(node, Literal):
            yield " ".join(str(node).split())


def _note(file: _File, named: str, fate: Fate, message: str) -> Note:
    return Note(file=file.path.name, line=file.lines.get(named, 0), entity=local(named), fate=fate, message=message)


def _read(path: Path) -> _File:
    if not path.is_file():
        raise NotImportable(path, 0, "is no file")
    if path.stat().st_size > _LARGEST_BYTES:
        raise NotImportable(path, 0, f"is larger than {_LARGEST_BYTES // 1_000_000} MB; take it apart")
    content = path.read_bytes()
    scan = _Scan(path)
    scan.run(content)
    graph = Graph()
    try:
        _quiet(lambda: graph.parse(BytesIO(content), format="xml", publicID=scan.default_base))
    except TypeError as error:  # what rdflib says of XML without namespaces
        raise NotImportable(path, 1, "does not parse as RDF/XML: its elements have no namespace") from error
    except (SAXException, ParserError, ValueError) as error:
        raise NotImportable(path, 0, f"does not parse as RDF/XML: {error}") from error
    return _File(path=path, iri=scan.iri or scan.default_base, graph=graph, lines=scan.lines)


def _quiet(parse: Callable[[], object]) -> None:
    """Parse without rdflib's remarks on literals and IRIs: what matters of those, the importer tells."""
    logger = logging.getLogger("rdflib.term")
    was = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        parse()
    finally:
        logger.setLevel(was)


def _beside(path: Path) -> dict[str, Path]:
    """The ontologies in the folder of a file and below, by IRI; the first by path where two have one."""
    found: dict[str, Path] = {}
    for other in sorted(path.parent.rglob("*.owl")):
        scan = _Scan(other)
        try:
            scan.run(other.read_bytes())
        except (NotImportable, OSError):
            continue  # one that is broken is told of where it is imported: it is not there
        if scan.iri:
            found.setdefault(scan.iri, other)
    return found


class _Scan:
    """Ontology IRI and lines of entities, by the XML alone; what is no XML, or spies or grows, is refused."""

    def __init__(self, path: Path) -> None:
        self.lines: dict[str, int] = {}
        self.iri = ""
        self.default_base = f"http://example.org/imported/{path.stem}"
        self._entities = {b"amp", b"lt", b"gt", b"quot", b"apos"}
        self._path = path
        self._bases = [self.default_base]
        self._xml = expat.ParserCreate(namespace_separator=" ")
        self._xml.EntityDeclHandler = self._refuse_bomb
        self._xml.StartElementHandler = self._start
        self._xml.EndElementHandler = self._end

    def run(self, content: bytes) -> None:
        try:
            self._xml.Parse(content, True)
        except expat.ExpatError as error:
            told = expat.ErrorString(error.code) or str(error)
            if error.code == expat.errors.codes[expat.errors.XML_ERROR_UNDEFINED_ENTITY]:
                name = self._undefined(content, error.lineno)
                told = f'{told} &{name}; declare it with <!ENTITY {name} "IRI"> in the DOCTYPE at the top'
            raise NotImportable(self._path, error.lineno, f"does not parse as XML: {told}") from error

    def _undefined(self, content: bytes, line: int) -> str:
        """The first entity from a line on that nothing declares."""
        rest = b"\n".join(content.splitlines()[line - 1 :])
        return next((n.decode() for n in _ENTITY.findall(rest) if n not in self._entities), "?")

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        base = self._bases[-1]
        if given := attributes.get("http://www.w3.org/XML/1998/namespace base"):
            base = urldefrag(urljoin(base, given)).url
        self._bases.append(base)
        about = attributes.get(f"{_RDF_NS} about")
        if about is None and (own := attributes.get(f"{_RDF_NS} ID")) is not None:
            about = f"#{own}"
        if about is None:
            return
        iri = urljoin(base, about) if about else base
        if name == f"{OWL} Ontology":
            self.iri = self.iri or iri
        self.lines.setdefault(iri, self._xml.CurrentLineNumber)

    def _end(self, name: str) -> None:
        self._bases.pop()

    def _refuse_bomb(
        self,
        name: str,
        is_parameter: bool,
        value: str | None,
        base: str | None,
        system: str | None,
        public: str | None,
        note: str | None,
    ) -> None:
        if is_parameter or value is None or "&" in value or len(value) > _LONGEST_ENTITY:
            told = f"the entity {name} is not a plain IRI; write it out where it is used"
            raise NotImportable(self._path, self._xml.CurrentLineNumber, told)
        self._entities.add(name.encode())
