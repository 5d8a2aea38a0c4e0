"""Knowledge bases for imported files, made of one file and a site that imports it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from kb.imports.report import Fate, Imported
from kb.store import KnowledgeBase, Snapshot
from kb.writing import Entity, ontology_text

BASE = "http://example.org/concertmaster"
IRI = f"{BASE}/imported.owl"
DATA = Path(__file__).parents[2] / "data"


@contextmanager
def loaded(imported: Imported, folder: Path, individuals: tuple[Entity, ...] = ()) -> Iterator[Snapshot]:
    """What is known at a site that knows only what was imported (and individuals): checked, reasoned over, compiled."""
    (folder / "tasks").mkdir(parents=True)
    (folder / "tasks" / "imported.owl").write_text(imported.text, encoding="utf-8")
    (folder / "sites" / "trial").mkdir(parents=True)
    site = ontology_text(f"{BASE}/trial.owl", individuals, imports=[imported.iri, f"{BASE}/core.owl"])
    (folder / "sites" / "trial" / "trial.owl").write_text(site, encoding="utf-8")
    knowledge = KnowledgeBase("trial", folder)
    try:
        yield knowledge.snapshot()
    finally:
        knowledge.close()


def told(imported: Imported, fate: Fate) -> str:
    """The notes of one fate, a line each."""
    return "\n".join(str(n) for n in imported.notes if n.fate is fate)


def definitions(snapshot: Snapshot, name: str) -> str:
    """The program of a process as Prolog text."""
    return snapshot.program(name).text
