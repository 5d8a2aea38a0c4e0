"""Small edits of people's ontology files: a statement more or less, all other bytes as they were.

Files are people's own: comments, order and layout stay. Only their elements' places are looked up, by expat.
"""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urljoin
from xml.parsers import expat

from kb.errors import KnowledgeError

_RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns# "
_BASE = "http://www.w3.org/XML/1998/namespace base"


class NotDescribed(KnowledgeError):
    """A file has no element that describes an entity.

    Attributes:
        iri: Of the entity.
    """

    def __init__(self, iri: str) -> None:
        self.iri = iri
        super().__init__(f"no element of the file describes {iri}")


@dataclass(slots=True, kw_only=True)
class _Place:
    """Where an entity is described, in bytes.

    Attributes:
        opened: Where its start tag begins.
        closed: Where its end tag begins; None where there is none, as in `<a/>`.
        children: Of its direct parts: name as namespace and local name, first byte, byte behind the last.
    """

    opened: int
    closed: int | None = None
    children: list[tuple[str, int, int]] = field(default_factory=list)


def with_statement(content: bytes, iri: str, statement: str) -> bytes:
    """Add a statement to the first element that describes an entity.

    Args:
        content: Of an RDF/XML file.
        statement: An element in ASCII, which declares the prefixes that it uses.

    Raises:
        NotDescribed: There is no such element.
    """
    place = _find(content, iri)
    added = statement.encode("ascii")
    if place.closed is None:
        end = _tag_end(content, place.opened)
        name = re.match(rb"<([^\s/>]+)", content[place.opened :])
        assert name is not None, "expat has found a tag here"
        whole = content[place.opened : end - 2].rstrip() + b">\n        " + added + b"\n    </" + name.group(1) + b">"
        return content[: place.opened] + whole + content[end:]
    return content[: place.closed] + b"    " + added + b"\n    " + content[place.closed :]


def without_statements(content: bytes, iri: str, properties: Collection[str]) -> bytes:
    """Take all statements with these properties away from the element that describes an entity.

    Args:
        properties: By IRI.

    Raises:
        NotDescribed: There is no such element.
    """
    for name, begin, end in reversed(_find(content, iri).children):
        if name.replace(" ", "") in properties:
            before = content[:begin].rstrip(b" \t")
            content = before.removesuffix(b"\n").removesuffix(b"\r") + content[end:]
    return content


def write_over(file: Path, content: bytes) -> None:
    """Put new content in the place of a file's; a reader sees the old one or the new one, whole."""
    handle, name = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name}.")
    with os.fdopen(handle, "wb") as stream:
        stream.write(content)
    if file.exists():
        shutil.copymode(file, name)
    Path(name).replace(file)


def _find(content: bytes, iri: str) -> _Place:
    parser = expat.ParserCreate(namespace_separator=" ")
    found: list[_Place] = []
    path: list[tuple[str, int]] = []
    base = [""]

    def start(name: str, attributes: dict[str, str]) -> None:
        if not path:
            base[0] = attributes.get(_BASE, "")
        about = attributes.get(_RDF + "about")
        if about is None and _RDF + "ID" in attributes:
            about = "#" + attributes[_RDF + "ID"]
        if len(path) == 1 and not found and about is not None and urljoin(base[0], about) == iri:
            found.append(_Place(opened=parser.CurrentByteIndex))
        path.append((name, parser.CurrentByteIndex))

    def end(name: str) -> None:
        _, begin = path.pop()
        opened_till = _tag_end(content, begin)
        is_closed = content[opened_till - 2 : opened_till] == b"/>"  # expat's end of such a tag is behind it
        if len(path) == 1 and found and found[0].opened == begin and not is_closed:
            found[0].closed = parser.CurrentByteIndex
        if len(path) == 2 and found and found[0].opened == path[1][1]:
            till = opened_till if is_closed else _tag_end(content, parser.CurrentByteIndex)
            found[0].children.append((name, begin, till))

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.Parse(content, True)
    if not found:
        raise NotDescribed(iri)
    return found[0]


def _tag_end(content: bytes, begin: int) -> int:
    """Behind the tag that begins here; `>` may stand in the value of an attribute."""
    match = re.compile(rb"<(?:[^\"'>]|\"[^\"]*\"|'[^']*')*>").match(content, begin)
    assert match is not None, "expat has found a tag here"
    return match.end()
