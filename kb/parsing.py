"""One ontology file: from bytes to triples and line numbers, or to what is wrong with it and where.

Files are RDF/XML. Expat reads a file first: it knows every encoding, gives line and column of a syntax
error, the lines of entities, and sees declarations of XML entities before they can do harm. Then
pyoxigraph makes the triples, 20 times as fast as rdflib; for it, other encodings become UTF-8.
"""

from __future__ import annotations

import contextlib
import logging
import re
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urljoin
from xml.parsers import expat

import pyoxigraph
from pyoxigraph import RdfFormat, Triple
from rdflib import OWL, RDF, XSD, BNode, Graph, Literal, URIRef

from kb.problems import OntologyRejected, Problem

MAX_BYTES = 50_000_000
"""A file of 10,000 individuals has 5 MB; a hundred times that is a mistake, and would take all memory."""

_LONGEST_ENTITY = 300
_HEAD_BYTES = 65_536
_XSD_STRING = "http://www.w3.org/2001/XMLSchema#string"
_ADVICE = "in Protégé choose File > Save as > RDF/XML Syntax"
_BASE = "http://www.w3.org/XML/1998/namespacebase"  # as expat joins the two
_ABOUT, _ID, _RESOURCE = f"{RDF}about", f"{RDF}ID", f"{RDF}resource"
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_SINGLE_QUOTED = re.compile(rb"(<!ENTITY\s+[^\s>]+\s+)'([^'\"<>]*)'")
_OTHER_SYNTAXES = (
    (r"(?i)\s*(?:#.*\n\s*)*(?:@?prefix\s+\w*:\s*<|@?base\s*<|<\w+:[^<>\s]*>\s)", "Turtle"),
    (r"\s*(?:Prefix|Ontology)\s*\(", "OWL functional syntax"),
    (r"\s*(?:Prefix|Ontology):", "OWL Manchester syntax"),
    (r"\s*[{\[]", "JSON"),
    (r"\s*format-version:", "OBO"),
    (r"(?i)\s*<(?:!doctype\s+)?html", "a web page"),
)
_OTHER_HEADERS = re.compile(
    r"<([^<>\s]+)>\s+(?:a|rdf:type)\s+owl:Ontology|\bOntology\s*\(\s*<([^<>\s]+)>|\bOntology:\s*<([^<>\s]+)>"
    r"|\bontologyIRI\s*=\s*[\"']([^\"']+)|<owl:Ontology\s[^>]*rdf:about\s*=\s*[\"']([^\"']+)"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ParsedFile:
    """What one file says.

    Attributes:
        iri: Of the ontology.
        triples: All of them, as pyoxigraph's terms.
        graph: The same, as rdflib's terms.
        lines: First line that describes an entity, by its IRI.
    """

    iri: str
    triples: tuple[Triple, ...] = field(repr=False)
    graph: Graph = field(repr=False)
    lines: dict[str, int] = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Header:
    """What a file claims to be.

    Attributes:
        iri: Of the ontology.
        imports: IRIs, in the order of the file; None where they cannot be told, as it does not parse so far.
    """

    iri: str
    imports: tuple[str, ...] | None


def read_bytes(path: Path) -> bytes:
    """The content of a file of sensible size.

    Raises:
        OntologyRejected: It cannot be read (KB001), or is too large (KB005).
    """
    try:
        size = path.stat().st_size
        if size <= MAX_BYTES:
            return path.read_bytes()
    except OSError as error:
        raise OntologyRejected([_problem("KB001", path, 0, f"cannot be read: {error.strerror}")]) from error
    told = f"has {size / 1e6:.0f} MB, and at most {MAX_BYTES / 1e6:.0f} are read; put data into files of their own"
    raise OntologyRejected([_problem("KB005", path, 0, told)])


def parse(path: Path, content: bytes) -> ParsedFile:
    """Read the content of a file.

    Raises:
        OntologyRejected: It does not parse or has not one ontology IRI (KB001), is no RDF/XML (KB007), or has an
            XML entity that is more than an abbreviation (KB008).
    """
    other = _other_syntax(content)
    if other:
        raise OntologyRejected([_problem("KB007", path, 1, f"is {other}, not RDF/XML; {_ADVICE}")])
    scan = _Scan(path.resolve().as_uri())
    try:
        scan.run(content)
    except _Foreign as foreign:
        raise OntologyRejected([_problem("KB007", path, scan.line, f"{foreign}; {_ADVICE}")]) from foreign
    except _NotPlain as hostile:
        raise OntologyRejected([_problem("KB008", path, scan.line, str(hostile))]) from hostile
    except (expat.ExpatError, ValueError, LookupError) as error:
        told = f"does not parse as RDF/XML: {error}"
        raise OntologyRejected([_problem("KB001", path, scan.line, told)]) from error
    try:
        triples = tuple(_triples(content, scan))
    except (SyntaxError, ValueError) as error:
        told = f"does not parse as RDF/XML: {error}"
        raise OntologyRejected([_problem("KB001", path, _line_of_error(str(error), content), told)]) from error
    graph = as_graph(triples)
    iris = sorted(str(s) for s in graph.subjects(RDF.type, OWL.Ontology) if isinstance(s, URIRef))
    if len(iris) != 1:
        told = f"has {len(iris)} ontology IRIs; one <owl:Ontology rdf:about=...> is needed"
        raise OntologyRejected([_problem("KB001", path, 1, told)])
    return ParsedFile(iri=iris[0], triples=triples, graph=graph, lines=scan.lines)


def read_header(path: Path) -> Header | None:
    """What a file claims in its first 64 KB; in other syntaxes too, so that it is refused later; None if nothing."""
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
    except OSError:
        return None
    scan = _Scan(path.resolve().as_uri(), only_header=True)
    with contextlib.suppress(_Foreign, _NotPlain, expat.ExpatError, ValueError, LookupError):
        try:
            scan.run(head, whole=False)
        except _HeaderRead:
            return Header(iri=scan.ontology, imports=tuple(scan.imports)) if scan.ontology else None
    found = None if scan.ontology else _OTHER_HEADERS.search(head.decode("utf-8", errors="replace"))
    iri = next(filter(None, found.groups())) if found else scan.ontology
    return Header(iri=iri, imports=None) if iri else None


def header_iri(path: Path) -> str | None:
    """The ontology IRI that a file claims."""
    header = read_header(path)
    return None if header is None else header.iri


def as_graph(triples: Iterable[Triple]) -> Graph:
    """The same triples in rdflib, each term made once."""
    logging.getLogger("rdflib.term").addFilter(_is_news)
    known: dict[object, URIRef | BNode | Literal] = {}
    graph = Graph("SimpleMemory")  # without contexts it takes half the time
    add = graph.store.add

    def term(node: object) -> URIRef | BNode | Literal:
        made = known.get(node)
        if made is None:
            made = known[node] = _in_rdflib(node)
        return made

    for triple in triples:
        add((term(triple.subject), term(triple.predicate), term(triple.object)), graph)
    return graph


def _in_rdflib(node: object) -> URIRef | BNode | Literal:
    match node:
        case pyoxigraph.NamedNode():
            return URIRef(node.value)
        case pyoxigraph.BlankNode():
            return BNode(node.value)
        case pyoxigraph.Literal():
            if node.language:
                return Literal(node.value, lang=node.language)
            # A plain literal is an xsd:string (RDF 1.1); rdflib would take the two for different values.
            return _typed(node.value, None if node.datatype.value == _XSD_STRING else URIRef(node.datatype.value))
        case _:
            raise ValueError(f"is RDF-star, which OWL has not: {node}")


def _typed(text: str, datatype: URIRef | None) -> Literal:
    """A literal; where it is no value of its datatype, as it was written."""
    if datatype == XSD.boolean and text not in ("true", "false", "1", "0"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # rdflib's, which it gives before it takes `yes` for `false`
            return Literal(text, datatype=datatype, normalize=False)
    return Literal(text, datatype=datatype)


def _is_news(record: logging.LogRecord) -> bool:
    """Not what rdflib logs, with a traceback, of a value that is none of its datatype: of that, KB012 tells."""
    return not str(record.msg).startswith("Failed to convert Literal lexical form")


class _Foreign(Exception):
    """XML, but no RDF."""


class _NotPlain(Exception):
    """An XML entity that is more than an abbreviation of an IRI."""


class _HeaderRead(Exception):
    """The element that names the ontology, and what that imports, has been read."""


class _Scan:
    """One pass of expat: is it well-formed, is it RDF, at what lines are entities described?"""

    def __init__(self, base: str, *, only_header: bool = False) -> None:
        self.ontology: str | None = None
        self.imports: list[str] = []
        self.lines: dict[str, int] = {}
        self.encoding: str | None = None
        """Where it is not UTF-8."""
        self.base = self._base = base
        self._root_seen = False
        self._xml = expat.ParserCreate(namespace_separator="")
        self._xml.buffer_text = True
        self._xml.XmlDeclHandler = self._declaration
        self._xml.EntityDeclHandler = self._entity
        self._xml.StartElementHandler = self._start
        if only_header:
            self._xml.EndElementHandler = self._end

    @property
    def line(self) -> int:
        """Where it stands, or stopped."""
        return max(1, self._xml.ErrorLineNumber if self._xml.ErrorCode else self._xml.CurrentLineNumber)

    def run(self, content: bytes, *, whole: bool = True) -> None:
        if content.startswith(_UTF_16):
            self.encoding = "utf-16"
        self._xml.Parse(content, whole)

    def _declaration(self, version: str, encoding: str | None, standalone: int) -> None:
        if encoding is not None and encoding.lower() not in {"utf-8", "utf8", "us-ascii"}:
            self.encoding = encoding

    def _entity(
        self,
        name: str,
        is_parameter: bool,
        value: str | None,
        base: str | None,
        system: str | None,
        public: str | None,
        note: str | None,
    ) -> None:
        """Entities abbreviate IRIs; one that holds others, or stands elsewhere, may grow without end or spy."""
        if is_parameter or value is None or set('&<"') & set(value) or len(value) > _LONGEST_ENTITY:
            raise _NotPlain(f"the entity {name} is not a plain IRI; write it out where it is used")

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        if not self._root_seen:
            self._root_seen = True
            if name != f"{RDF}RDF":
                raise _Foreign(_foreign_root(name))
        self._base = attributes.get(_BASE, self._base)
        if name == f"{OWL}imports":
            self.imports.append(attributes.get(_RESOURCE, ""))
        about = attributes.get(_ABOUT)
        if about is None:
            identifier = attributes.get(_ID)
            if identifier is None:
                return
            about = f"#{identifier}"
        iri = about if ":" in about else urljoin(self._base, about) if about else self._base.partition("#")[0]
        self.lines.setdefault(iri, self._xml.CurrentLineNumber)
        if self.ontology is None and name == f"{OWL}Ontology":
            self.ontology = iri

    def _end(self, name: str) -> None:
        if name == f"{OWL}Ontology":
            raise _HeaderRead


def _foreign_root(name: str) -> str:
    if name.startswith(str(OWL)):
        return "is OWL/XML, not RDF/XML"
    return f"is XML, but not RDF/XML: its outermost element is {name}, not rdf:RDF"


def _other_syntax(content: bytes) -> str | None:
    """The name of the syntax where it is not XML."""
    if not content.strip():
        return "empty"
    head = content[:_HEAD_BYTES].decode("utf-16" if content.startswith(_UTF_16) else "utf-8-sig", errors="replace")
    for pattern, name in _OTHER_SYNTAXES:
        if re.match(pattern, head):
            return name
    return None if head.lstrip().startswith("<") else "something else"


def _triples(content: bytes, scan: _Scan) -> Iterator[Triple]:
    for quad in pyoxigraph.parse(_plain(content, scan), RdfFormat.RDF_XML, base_iri=scan.base, rename_blank_nodes=True):
        yield quad.triple


def _plain(content: bytes, scan: _Scan) -> bytes:
    """The same in UTF-8, with entities in double quotes, as pyoxigraph wants them."""
    if scan.encoding is not None:
        text = content.decode(scan.encoding)
        content = re.sub(r"(<\?xml[^>]*?)\sencoding\s*=\s*[\"'][^\"']*[\"']", r"\1", text, count=1).encode()
    return _SINGLE_QUOTED.sub(rb'\1"\2"', content)


def _line_of_error(message: str, content: bytes) -> int:
    """The parser tells only what is wrong, which can be looked for."""
    for culprit in re.findall(r"'(.+?)'|<(.+?)>|^(.+?) is not a valid", message):
        text = "".join(culprit)
        for form in (text, text.rsplit("#", 1)[-1], text.rsplit("/", 1)[-1]):
            at = content.rfind(form.encode())
            if form and at >= 0:
                return content.count(b"\n", 0, at) + 1
    return 1


def _problem(code: str, path: Path, line: int, message: str) -> Problem:
    return Problem(code=code, file=path, line=line, entity="", message=message)
