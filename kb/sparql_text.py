"""What a SPARQL query says, as far as it can be told before it is answered: refusals and doubts in plain words."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Mapping, Sequence

from rdflib import URIRef

from kb.errors import ConcertmasterError
from kb.ontology import Ontology

_TOKEN = re.compile(
    r"'''.*?'''|\"\"\".*?\"\"\"|'(?:[^'\\\n]|\\.)*'|\"(?:[^\"\\\n]|\\.)*\"|<[^<>\"{}|^`\\\s]*>|#[^\n]*"
    r"|[?$]\w+|[\w-]*:[\w.%-]*|(?P<word>\w+)|.",
    re.DOTALL,
)
_UPDATES = frozenset({"INSERT", "DELETE", "LOAD", "CLEAR", "CREATE", "DROP", "COPY", "MOVE", "ADD", "WITH"})
_PREFIX_WORDS = frozenset({"PREFIX", "BASE"})
_POSITION = re.compile(r"error at (\d+):(\d+): (.*)", re.DOTALL)
_OFFERED = re.compile(r"\"(?:\\.|[^\"\\])*\"|'(?:\\.|[^'\\])*'|[A-Za-z]+")
_DECLARED = re.compile(r"\bPREFIX\s+([\w-]*):", re.IGNORECASE)
_ALL_VARIABLES = re.compile(r"\s*(?:DISTINCT\s*|REDUCED\s*)?\*", re.IGNORECASE)


class BadQuery(ConcertmasterError):
    """A query cannot be answered: it is wrong, would change something, or takes too much."""

    fault = "request"


def refuse(query: str) -> None:
    """Refuse what would not be answered anyway.

    Raises:
        BadQuery: It would change something, or asks another server.
    """
    begun = True
    for word, offset in words(query):
        if begun and word.upper() not in _PREFIX_WORDS:
            begun = False
            if word.upper() in _UPDATES:
                raise BadQuery(
                    f"{_position(query, offset)}: {word.upper()} would change what is known; only SELECT, ASK, "
                    "CONSTRUCT and DESCRIBE are answered. Edit the files instead"
                )
        if word.upper() == "SERVICE":
            raise BadQuery(
                f"{_position(query, offset)}: SERVICE asks another server; nothing is fetched from the network"
            )


def words(query: str) -> Iterator[tuple[str, int]]:
    """The keywords of a query and where they are: no texts, IRIs, comments, variables or names with a prefix."""
    for token in _TOKEN.finditer(query):
        if token["word"]:
            yield token["word"], token.start()


def _position(query: str, offset: int) -> str:
    before = query[:offset]
    return f"line {before.count(chr(10)) + 1}, column {offset - before.rfind(chr(10))}"


def syntax_error(message: str, query: str, known: Mapping[str, str]) -> str:
    """What is wrong with a query, where, and what would be right.

    Args:
        message: What the parser says.
        known: Namespaces by prefix.
    """
    found = _POSITION.match(message)
    if found is None:
        return f"the query is wrong: {message}"
    line, column, expected = int(found[1]), int(found[2]), found[3]
    text = (query.splitlines() or [""])[min(line, len(query.splitlines()) or 1) - 1]
    unknown = _unknown_prefix(text[:column], known) if "Prefix not found" in expected else None
    if unknown is not None:
        column = unknown[1] + 1
    shown = f"line {line}, column {column} of the query:\n  {text}\n  {' ' * (column - 1)}^\n"
    if unknown is not None:
        near = difflib.get_close_matches(unknown[0], known, n=1)
        hint = f"did you mean {near[0]}:?" if near else f"known are {', '.join(f'{k}:' for k in known)}"
        return f"{shown}the prefix {unknown[0]}: is not known; {hint}"
    offered = sorted({o.strip("\"'") or o for o in _OFFERED.findall(re.sub(r"\[[^\]]*\]", "", expected))})
    right = [o for o in offered if o not in ("expected", "one", "of") and "\\" not in o]
    return shown + (f"expected {' or '.join(right)}" if right else "the query ends too early, or goes on too long")


def _unknown_prefix(text: str, known: Mapping[str, str]) -> tuple[str, int] | None:
    """The last prefix of a line that is not known, and where it is."""
    found = [(m[1], m.start()) for m in re.finditer(r"([A-Za-z_][\w-]*):", text) if m[1] not in known]
    return found[-1] if found else None


def doubts(query: str, known: Mapping[str, str], ontology: Ontology) -> tuple[str, ...]:
    """Names with a prefix that no file has, in order, with the nearest: a query that misspells a name finds nothing.

    Args:
        known: Namespaces by prefix.
    """
    first = next((w.upper() for w, _ in words(query) if w.upper() not in _PREFIX_WORDS), "")
    if first == "CONSTRUCT":
        return ()  # it makes up names
    own = {match[1] for match in _DECLARED.finditer(query)}
    namespaces = {file.iri + "#" for file in ontology.files.files}
    found: dict[str, str] = {}
    for token in _TOKEN.finditer(query):
        name = token[0].rstrip(".")  # a dot at the end is none of a name's
        prefix, _, local = name.partition(":")
        namespace = known.get(prefix, "")
        if not local or prefix in own or namespace not in namespaces:
            continue
        if not _is_named(ontology, URIRef(namespace + local)):
            subjects = {str(node) for node in ontology.graph.subjects()}
            named = sorted(iri.removeprefix(namespace) for iri in subjects if iri.startswith(namespace))
            nearest = difflib.get_close_matches(local, named, n=1)
            hint = f"; did you mean {prefix}:{nearest[0]}?" if nearest else ""
            found[name] = f"no file names {name}{hint}"
    return tuple(found.values())


def _is_named(ontology: Ontology, node: URIRef) -> bool:
    graph = ontology.graph
    return (node, None, None) in graph or (None, node, None) in graph or (None, None, node) in graph


def in_order(variables: Sequence[str], query: str) -> list[str]:
    """The columns of an answer: those of `SELECT *` as they come up in the query, others as it names them."""
    selected = next((offset + len(w) for w, offset in words(query) if w.upper() == "SELECT"), None)
    if selected is None or not _ALL_VARIABLES.match(query, selected):
        return list(variables)
    named = [token[0][1:] for token in _TOKEN.finditer(query) if token[0][0] in "?$"]
    return sorted(variables, key=named.index)
