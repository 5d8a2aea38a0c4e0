"""A copy of the shipped ontologies to spoil, edits that spoil it, and a way to ask Prolog anything."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from kb.files import SHIPPED
from kb.prolog import Entry
from kb.store import KnowledgeBase
from kb.terms import Struct, Term, Var, struct

SITE = "sites/tue_lab/tue_lab.owl"
OBJECTS = "sites/objects.owl"
CORE = "core/core.owl"
AMIGO = "robots/amigo.owl"
NAVIGATION = "tasks/navigation.owl"
TASK = "tasks/find_empty_drink.owl"
GROUNDINGS = "tasks/groundings.owl"
IRI = "http://example.org/concertmaster/"
DOUBLE = 'rdf:datatype="http://www.w3.org/2001/XMLSchema#double"'

Edit = Callable[[Path], None]


# ------------------------------------------------------------------------------------------- Prolog

_apply = Entry(search_path="kb_rules", file="facts", name="call")


def ask(goal: Term) -> Any:
    """The value of the variable `Answer` of a Prolog goal that holds, as JSON."""
    return _apply(struct(">>", [Var("Answer")], goal))


def probe(goal: Struct) -> Any:
    """The same for a goal of probe.pl."""
    file = str(Path(__file__).with_name("probe.pl"))
    return ask(struct(",", struct("load_files", file, [struct("if", "not_loaded")]), struct(":", "test_probe", goal)))


def count(fact: str, revision: int, arity: int) -> int:
    """How many facts of one kind Prolog knows in a revision."""
    head = struct(fact, revision, *(Var(f"A{n}") for n in range(arity - 1)))
    return int(ask(struct("aggregate_all", "count", struct(":", "kb_facts", head), Var("Answer"))))


# ------------------------------------------------------------------------------------------ fixtures


@pytest.fixture(scope="session")
def shipped() -> Iterator[KnowledgeBase]:
    """The shipped site, loaded once; tests must not tell it anything."""
    knowledge = KnowledgeBase("tue_lab")
    yield knowledge
    knowledge.close()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the shipped ontologies."""
    return Path(shutil.copytree(SHIPPED, tmp_path / "ontologies"))


# --------------------------------------------------------------------------------------------- edits


def instead(file: str, old: str, new: str) -> Edit:
    """Replace a text that occurs once in a file."""

    def edit(folder: Path) -> None:
        text = (folder / file).read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{file} has {old!r} {text.count(old)} times"
        (folder / file).write_text(text.replace(old, new), encoding="utf-8")

    return edit


def added(file: str, xml: str) -> Edit:
    """Add an element at the end of a file."""
    return instead(file, "</rdf:RDF>", f"{xml}\n</rdf:RDF>")


def individual(file: str, name: str, kind: str, *properties: str) -> Edit:
    """Add an individual of a class of core.owl."""
    iri = f"{IRI}{Path(file).name}#{name}"
    lines = [f'<rdf:type rdf:resource="{IRI}core.owl#{kind}"/>', *properties]
    return added(file, "\n".join([f'<owl:NamedIndividual rdf:about="{iri}">', *lines, "</owl:NamedIndividual>"]))


def link(prop: str, file: str, name: str) -> str:
    """The line of an individual that links it to another one."""
    return f'<core:{prop} rdf:resource="{IRI}{Path(file).name}#{name}"/>'


def number(prop: str, value: str, datatype: str = "double") -> str:
    """The line of an individual that gives it a number."""
    return f'<core:{prop} rdf:datatype="http://www.w3.org/2001/XMLSchema#{datatype}">{value}</core:{prop}>'


def within(file: str, name: str, change: Callable[[str], str]) -> Edit:
    """Change the description of one individual."""

    def edit(folder: Path) -> None:
        text = (folder / file).read_text(encoding="utf-8")
        about = re.escape(f"{IRI}{Path(file).name}#{name}")
        block = re.search(rf'<owl:NamedIndividual rdf:about="{about}">.*?</owl:NamedIndividual>', text, re.DOTALL)
        assert block, f"{file} has no individual {name}"
        changed = change(block.group())
        assert changed != block.group(), f"the edit of {name} in {file} changes nothing"
        (folder / file).write_text(text.replace(block.group(), changed), encoding="utf-8")

    return edit


def dropped(file: str, name: str, prop: str) -> Edit:
    """Remove all values of a property of an individual."""
    return within(
        file, name, lambda block: re.sub(rf"\n *<core:{prop} .*", "", re.sub(rf"\n *<core:{prop}>.*", "", block))
    )


def given(file: str, name: str, xml: str) -> Edit:
    """Give an individual one more line."""
    return within(file, name, lambda block: block.replace("</owl:NamedIndividual>", f"{xml}</owl:NamedIndividual>"))


def renamed(file: str, name: str, old: str, new: str) -> Edit:
    """Replace a text within the description of an individual."""
    return within(file, name, lambda block: block.replace(old, new))
