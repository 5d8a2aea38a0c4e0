"""The reasoner's own process: `python -m kb.reasoning_worker HERMIT_JAR JVM MEMORY_MB`.

Java runs inside it, with HermiT and the OWL API from HermiT's jar, and stays warm between requests. A
request is one line of JSON on standard input, an answer one line on standard output, in turn; the process
ends with its standard input. kb/reasoner.py starts and asks it; nothing else imports this module.

A request is `{"documents": [{"name": ..., "text": N-Triples without imports}], "only": [iri]}`. Each document
becomes an ontology of its own, so that of every axiom it is known in which documents it stands; the reasoner is
given all of them together.

A class expression `p value a` makes HermiT take all individuals into account whenever it compares two classes,
which takes minutes with 10,000. So documents say `p some A` with a class A of its own, `urn:only:` before the IRI of
a, and "only" lists these individuals. The axioms A = {a} are added where it matters whether there is one such thing or
more: for consistency, and for reasons. For classification A is given what is stated of a. An answer is a dictionary:

    violations     what is not OWL 2 DL: [{"kind", "text", "axiom"}]
    inconsistent   axioms that contradict each other, a smallest set: [axiom]; where the rest is missing
    unsatisfiable  classes that nothing can belong to, each with a smallest set of axioms why, or with such a class
                   that it is said to be below: {iri: {"axioms": [axiom], "below": iri or None}}
    superclasses   direct superclasses of each class, and equivalent ones: {iri: [iri]}
    types          direct types of each individual: {iri: [iri]}
    error          what went wrong; nothing else is there then

and an axiom is `{"text": in Manchester syntax, "subject": iri or None, "names": [iri], "documents": [name]}`.
"""

from __future__ import annotations

import json
import os
import re
import sys
import threading
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TextIO

import jpype

from kb.justification import smallest

_IRI = re.compile(r"<([^<>\s]+)>")
ONLY = "urn:only:"
"""Before the IRI of an individual: the class that has it and nothing else; kb/reasoner.py says the same."""
_ABOUT_MANY = {"DisjointClasses", "DifferentIndividuals", "DisjointObjectProperties", "DisjointDataProperties"}


def main() -> None:
    """Answer requests until there are no more."""
    jar, jvm, memory_mb = sys.argv[1:4]
    # Whatever Java prints must not get between the answers.
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    requests = _requests(sys.stdin)
    jpype.startJVM(
        jvm,
        # Short runs: compile little, collect serially.
        "-XX:TieredStopAtLevel=1",
        "-XX:+UseSerialGC",
        "-XX:-UsePerfData",
        f"-Xmx{memory_mb}M",
        "-Xss16M",
        "--enable-native-access=ALL-UNNAMED",
        classpath=[jar],
        convertStrings=False,
    )
    reasoner = _Reasoner()
    while True:
        request = requests()
        try:
            answer = reasoner.answer(request)
        except jpype.JException as error:
            answer = {"error": _told(error)}
        json.dump(answer, answers)
        answers.write("\n")
        answers.flush()


def _requests(stream: TextIO) -> Callable[[], Any]:
    """A function that waits for the next request; the process ends when there can be none, whatever it is doing."""
    lines: list[str] = []
    arrived = threading.Semaphore(0)

    def read() -> None:
        for line in stream:
            lines.append(line)
            arrived.release()
        os._exit(0)

    threading.Thread(target=read, daemon=True).start()

    def next_request() -> Any:
        arrived.acquire()
        return json.loads(lines.pop(0))

    return next_request


def _told(error: Any) -> str:
    name = str(error.getClass().getSimpleName())
    if name == "OutOfMemoryError":
        return "it ran out of memory"
    return f"{name}: {str(error.getMessage())[:500]}"


class _Reasoner:
    """HermiT and the OWL API, as far as they are needed."""

    def __init__(self) -> None:
        api = "org.semanticweb.owlapi"
        self._manager = jpype.JClass(f"{api}.apibinding.OWLManager")
        self._source = jpype.JClass(f"{api}.io.StringDocumentSource")
        self._iri = jpype.JClass(f"{api}.model.IRI")
        self._factory = self._manager.getOWLDataFactory()
        self._string = jpype.JClass("java.lang.String")
        self._hash_set = jpype.JClass("java.util.HashSet")
        self._profile = jpype.JClass(f"{api}.profiles.OWL2DLProfile")
        self._inference = jpype.JClass(f"{api}.reasoner.InferenceType")
        self._hermit = jpype.JClass("org.semanticweb.HermiT.Reasoner")
        self._configuration = jpype.JClass("org.semanticweb.HermiT.Configuration")
        modules = jpype.JPackage("uk").ac.manchester.cs.owlapi.modularity
        self._extractor, self._star = modules.SyntacticLocalityModuleExtractor, modules.ModuleType.STAR

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        """All that is to be found out about some documents."""
        only: list[str] = request["only"]
        manager = self._manager.createOWLOntologyManager()
        ontologies = {d["name"]: self._load(manager, d["text"]) for d in request["documents"]}
        stated = self._together(ontologies.values())
        whole = manager.createOntology(stated)
        describe = _Describer(ontologies)
        violations = [
            {
                "kind": str(v.getClass().getSimpleName()),
                "text": str(v.toString()),
                "axiom": describe(v.getAxiom()) if v.getAxiom() is not None else None,
            }
            for v in self._profile().checkOntology(whole).getViolations()
        ]
        if violations:
            return {"violations": violations}  # outside OWL 2 DL, HermiT refuses, or may be wrong
        exact = self._exactly(only)
        if not self._reasoner(self._ontology([*exact, stated])).isConsistent():
            return {"violations": [], "inconsistent": [describe(a) for a in self._contradiction(whole, exact)]}
        hermit = self._reasoner(self._ontology([*self._at_least(whole, only), stated]))
        hermit.precomputeInferences(self._inference.CLASS_HIERARCHY, self._inference.CLASS_ASSERTIONS)
        empty = {str(c.getIRI()): c for c in hermit.getUnsatisfiableClasses().getEntitiesMinusBottom()}
        return {
            "violations": [],
            "unsatisfiable": {
                iri: self._why(whole, exact, empty, iri, describe) for iri in sorted(empty) if not iri.startswith(ONLY)
            },
            "superclasses": self._superclasses(whole, hermit),
            "types": self._types(hermit),
        }

    def _load(self, manager: Any, text: str) -> Any:
        return manager.loadOntologyFromOntologyDocument(self._source(self._string(text)))

    def _together(self, ontologies: Iterable[Any]) -> Any:
        axioms = self._hash_set()
        for ontology in ontologies:
            axioms.addAll(ontology.getAxioms())
        return axioms

    def _reasoner(self, ontology: Any) -> Any:
        configuration = self._configuration()
        configuration.throwInconsistentOntologyException = False
        return self._hermit(configuration, ontology)

    # What stands for `value`

    def _exactly(self, only: Iterable[str]) -> list[Any]:
        """The class of each such individual has it, and nothing else."""
        axioms = []
        for name in sorted(only):
            kind, individual = self._kind(name), self._individual(name)
            axioms.append(self._factory.getOWLClassAssertionAxiom(kind, individual))
            axioms.append(self._factory.getOWLSubClassOfAxiom(kind, self._factory.getOWLObjectOneOf(individual)))
        return axioms

    def _kind(self, name: str) -> Any:
        return self._factory.getOWLClass(self._iri.create(ONLY + name))

    def _individual(self, name: str) -> Any:
        return self._factory.getOWLNamedIndividual(self._iri.create(name))

    def _at_least(self, whole: Any, only: Iterable[str]) -> list[Any]:
        """It has it, and is what that is stated to be, as far as one gets from there by stated values."""
        make = self._factory
        axioms: list[Any] = []
        done, todo = set[str](), sorted(only)
        while todo:
            name = todo.pop()
            if name in done:
                continue
            done.add(name)
            kind, individual = self._kind(name), self._individual(name)
            axioms.append(make.getOWLClassAssertionAxiom(kind, individual))
            for stated in whole.getClassAssertionAxioms(individual):
                axioms.append(make.getOWLSubClassOfAxiom(kind, stated.getClassExpression()))
            for stated in whole.getObjectPropertyAssertionAxioms(individual):
                value = str(stated.getObject()).strip("<>")
                some = make.getOWLObjectSomeValuesFrom(stated.getProperty(), self._kind(value))
                axioms.append(make.getOWLSubClassOfAxiom(kind, some))
                todo.append(value)
        return axioms

    # Classification

    def _superclasses(self, whole: Any, hermit: Any) -> dict[str, list[str]]:
        found = {}
        for kind in whole.getClassesInSignature():
            iri = str(kind.getIRI())
            if not iri.startswith(ONLY):
                above = self._above(hermit, kind)
                found[iri] = sorted({*above, *_iris(hermit.getEquivalentClasses(kind).getEntities())} - {iri})
        return found

    def _types(self, hermit: Any) -> dict[str, list[str]]:
        found: dict[str, set[str]] = {}
        for kind in [*hermit.getRootOntology().getClassesInSignature(), self._factory.getOWLThing()]:
            iri = str(kind.getIRI())
            kinds = self._above(hermit, kind) if iri.startswith(ONLY) else {iri}
            if hermit.isSatisfiable(kind):
                for individual in _iris(hermit.getInstances(kind, True).getFlattened()):
                    found.setdefault(individual, set()).update(kinds)
        return {individual: sorted(kinds) for individual, kinds in found.items()}

    def _above(self, hermit: Any, kind: Any) -> set[str]:
        """The direct superclasses of a class; of those that stand for an individual, what is above them."""
        found, todo = set[str](), [kind]
        while todo:
            for iri in _iris(hermit.getSuperClasses(todo.pop(), True).getFlattened()):
                if iri.startswith(ONLY):
                    todo.append(self._factory.getOWLClass(self._iri.create(iri)))
                else:
                    found.add(iri)
        return found

    # Justifications

    def _contradiction(self, whole: Any, exact: Sequence[Any]) -> list[Any]:
        """A smallest set of axioms that is inconsistent."""
        terms: list[Any] = []
        facts: list[Any] = []
        for axiom in whole.getLogicalAxioms():
            of_individuals = axiom.getIndividualsInSignature().size() or axiom.getAnonymousIndividuals().size()
            (facts if of_individuals else terms).append(axiom)

        def clash(axioms: Sequence[Any]) -> bool:
            return not self._reasoner(self._ontology([*exact, *axioms])).isConsistent()

        # What is said of individuals first: there are many, and few of them matter.
        clashing = smallest(sorted(facts, key=str), clash, terms)
        return clashing + smallest(sorted(terms, key=str), clash, clashing)

    def _why(
        self, whole: Any, exact: Sequence[Any], empty: dict[str, Any], iri: str, describe: _Describer
    ) -> dict[str, Any]:
        above = self._said_above(whole, empty, iri)
        roots = sorted(other for other in above if iri not in self._said_above(whole, empty, other))
        if roots:
            return {"axioms": [], "below": roots[0]}
        return {"axioms": [describe(a) for a in self._why_empty(whole, exact, empty[iri])], "below": None}

    def _said_above(self, whole: Any, empty: dict[str, Any], iri: str) -> set[str]:
        """The empty classes that a class is said to be below, through empty classes."""
        reached, todo = set[str](), [iri]
        while todo:
            for axiom in whole.getSubClassAxiomsForSubClass(empty[todo.pop()]):
                for above in {str(axiom.getSuperClass()).strip("<>")} & set(empty) - reached:
                    reached.add(above)
                    todo.append(above)
        return reached

    def _why_empty(self, whole: Any, exact: Sequence[Any], kind: Any) -> list[Any]:
        """A smallest set of axioms for which nothing can belong to a class: looked for in what bears on the class."""
        module = self._extractor(whole.getOWLOntologyManager(), whole, self._star)
        signature = self._hash_set()
        signature.add(kind)
        axioms = [a for a in module.extract(signature) if a.isLogicalAxiom()]

        def empty(some: Sequence[Any]) -> bool:
            reasoner = self._reasoner(self._ontology([*exact, *some]))
            return not reasoner.isConsistent() or not reasoner.isSatisfiable(kind)

        if not empty(axioms):  # it follows from what is stated of an individual that the class names
            axioms = list(whole.getLogicalAxioms())
        return smallest(sorted(axioms, key=str), empty, [])

    def _ontology(self, axioms: Sequence[Any]) -> Any:
        """Of axioms, and sets of them."""
        chosen = self._hash_set()
        for axiom in axioms:
            if isinstance(axiom, self._hash_set):
                chosen.addAll(axiom)
            else:
                chosen.add(axiom)
        return self._manager.createOWLOntologyManager().createOntology(chosen)


class _Describer:
    """Says what an axiom is and where it stands."""

    def __init__(self, ontologies: dict[str, Any]) -> None:
        self._ontologies = ontologies
        self._about = jpype.JClass("org.semanticweb.owlapi.util.AxiomSubjectProvider")
        self._named = jpype.JClass("org.semanticweb.owlapi.model.OWLNamedObject")
        self._printer = jpype.JPackage(
            "uk"
        ).ac.manchester.cs.owl.owlapi.mansyntaxrenderer.ManchesterOWLSyntaxOWLObjectRendererImpl()

    def __call__(self, axiom: Any) -> dict[str, Any]:
        text = " ".join(str(self._printer.render(axiom)).split())
        for iri in sorted(str(c.getIRI()) for c in axiom.getClassesInSignature()):
            if iri.startswith(ONLY):
                name = iri.rsplit("#", 1)[-1]
                text = text.replace(f"some {name}", f"value {name}")
        return {
            "text": text,
            "subject": self._subject_of(axiom),
            "names": sorted({str(e.getIRI()).removeprefix(ONLY) for e in axiom.getSignature()}),
            "documents": sorted(n for n, o in self._ontologies.items() if o.containsAxiom(axiom)),
        }

    def _subject_of(self, axiom: Any) -> str | None:
        """What an axiom is about; nothing where it is about several alike, or a class expression."""
        if axiom.getAxiomType().getName() in _ABOUT_MANY and axiom.getSignature().size() > 2:
            return None
        subject = self._about().getSubject(axiom)
        return str(subject.getIRI()) if isinstance(subject, self._named) else None


def _iris(entities: Any) -> list[str]:
    """Of a Java set; as one text, as a call for each would take longer than the reasoner."""
    return _IRI.findall(str(entities.toString()))


if __name__ == "__main__":
    main()
