"""Writes the pages of the reference that say what is said elsewhere: the trace, the vocabulary, the failures."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Iterable
from pathlib import Path

from rdflib import OWL, RDF, RDFS, SKOS, BNode, Graph, URIRef
from rdflib.collection import Collection
from rdflib.term import Node

from executive import trace
from kb.vocabulary import CORE, CORE_IRI

MARK = "<!-- Written by `pytest tests/docs --update-golden`; do not edit by hand. -->\n"

FIELDS = {
    "again": "the process that is begun again; empty for the action alone, and where the rest is planned without it",
    "action": 'the action, `Process(robot,"argument",...)`; data are left out',
    "arguments": "individuals by the names of the inputs",
    "changes": "what would be different: entities, programs, facts, plans of tasks; a sentence each",
    "compute": "file of settings that says where compute services run; empty if all do here",
    "elapsed_s": "from the call to the reply",
    "engine": "the planner of unified-planning that found it",
    "facts_told": "how many facts had been told to the knowledge base since it was loaded",
    "failure": "code of the failure, such as `NoPath`; empty if it succeeded. In `recovery_chosen`, its class",
    "connect": "where the robots are, if they are not simulated here: an address, or a file",
    "faults": "file of faults that were injected; empty if none were",
    "folder": "where the files are; empty where an earlier revision is meant",
    "goal": "what shall be true, where no task type was asked for",
    "helped": "whether somebody has done something about it",
    "in_time": "false where nobody has answered before the time was over",
    "knowledge": "hash of the contents of all ontology files",
    "lower_bound_s": "no execution takes less",
    "makespan_s": "from the making of the plan to the end of its last step",
    "number": "of the action in this trace; never used twice. A question has that of the next try",
    "outcome": "`SUCCEEDED`, `EXECUTION_FAILED`, `POSTCONDITION_FAILED`, `REFUSED`, `TIMED_OUT` or `LOST`",
    "outputs": "values by output parameter",
    "planned_s": "how long the knowledge base says that it takes",
    "process": "the process, with its arguments once it has begun",
    "program": "Prolog text, one procedure a line (see [golog.md](golog.md))",
    "prop": "the property",
    "question": "what has failed, and why, in a sentence",
    "reason": "why, in a sentence",
    "recovery": "what is tried, such as `retry` or `open_door`; empty if the rest is planned without what has failed",
    "revision": "number of a revision of the knowledge, from 1; of a task the one that it goes on under",
    "robot": "who does it; empty if no robot does. In `plan_made`, inside `steps`",
    "robots": "the names of the robots (`fleet_opened`), or how many may take part at most (`task_accepted`)",
    "search": "`[phase, effort, nodes, pruned, makespan, lower bound]` each; effort in seconds of computing",
    "scenario": "name of a shipped scenario, or the file as it was given",
    "seed": "of all chance in the simulator",
    "service": "full name of the service that was called, of the action, or of the topic that was read",
    "site": "name of the site",
    "source": "whose effect a fact is: an action or process; else `person` or `files`; empty in old traces",
    "status": "of a plan a [PlanStatus](python-api.md#planstatus), of a task a [TaskStatus](python-api.md#taskstatus)",
    "steps": "`[action, robot, start, end]` each, in seconds, ordered by start",
    "subject": "the individual whose property it is",
    "t_s": "when; seconds since the fleet was opened",
    "task": "name of the task, such as `FindEmptyDrink-1`",
    "took_s": "from acceptance to the end",
    "until_s": "when nobody waits for an answer any more",
    "value": "its value from now on; null for messages that the trace does not show",
}
"""What each field means; the same name means the same in every event."""


def trace_page() -> str:
    """docs/reference/trace.md."""
    lines = [
        "# The trace",
        "",
        MARK,
        "`concertmaster run` writes a trace: a file of [JSON Lines](https://jsonlines.org), one event a line, each",
        "with its `kind`. The events are declared in [executive/trace.py](../../executive/trace.py). Fields may be",
        "added; their meaning does not change. The same knowledge, scenario and seed give the same file, byte for",
        "byte. How to read one is told in [Read a trace](../how-to/read-a-trace.md).",
        "",
        "## Kinds of events",
        "",
    ]
    used: set[str] = set()
    for kind, event in trace.BY_KIND.items():
        lines += [f"### {kind}", "", inspect.cleandoc(event.__doc__ or ""), "", "| field | type |", "|---|---|"]
        for field in dataclasses.fields(event):
            used.add(field.name)
            lines.append(f"| `{field.name}` | `{_escaped(str(field.type))}` |")
        lines.append("")
    if used != set(FIELDS):
        raise AssertionError(f"tests/docs/generated.py: say what these fields mean: {sorted(used ^ set(FIELDS))}")
    lines += ["## Fields", "", "| field | meaning |", "|---|---|"]
    lines += [f"| `{name}` | {_escaped(FIELDS[name])} |" for name in sorted(used)]
    return "\n".join(lines) + "\n"


def vocabulary_page(core: Path) -> str:
    """docs/reference/vocabulary.md."""
    graph = Graph()
    graph.parse(core, format="xml")
    lines = [
        "# The vocabulary",
        "",
        MARK,
        f"The terms of [core.owl](../../kb/ontologies/core/core.owl), `{CORE_IRI}`. All other",
        "ontology files import it. Names end with the unit of their values: `_s`, `_m`, `_rad`, `_mps` (m/s), `_radps`",
        "(rad/s), `_J`, `_W`.",
        "",
        "## Classes",
        "",
        "| class | below | defined as | meaning |",
        "|---|---|---|---|",
    ]
    for node in _named(graph, OWL.Class):
        above = _names(o for o in graph.objects(node, RDFS.subClassOf) if isinstance(o, URIRef))
        defined = " and ".join(_manchester(graph, o) for o in graph.objects(node, OWL.equivalentClass))
        lines.append(f"| `{_name(node)}` | {above} | {f'`{defined}`' if defined else ''} | {_comment(graph, node)} |")
    for title, sort in (
        ("Object properties", OWL.ObjectProperty),
        ("Data properties", OWL.DatatypeProperty),
        ("Annotation properties", OWL.AnnotationProperty),
    ):
        lines += ["", f"## {title}", "", "| property | of | value | sort | meaning |", "|---|---|---|---|---|"]
        for node in _named(graph, sort):
            domain, value = (_names(_parts(graph, node, p)) for p in (RDFS.domain, RDFS.range))
            lines.append(f"| `{_name(node)}` | {domain} | {value} | {_sort(graph, node)} | {_comment(graph, node)} |")
    return "\n".join([*lines, *_alignments(graph)]) + "\n"


_VOCABULARIES = {
    "owls": ("http://www.daml.org/services/owl-s/1.2/Process.owl#", "OWL-S 1.2, processes"),
    "owlsg": ("http://www.daml.org/services/owl-s/1.2/Grounding.owl#", "OWL-S 1.2, groundings"),
    "owlsx": ("http://www.daml.org/services/owl-s/1.2/generic/Expression.owl#", "OWL-S 1.2, expressions"),
    "cora": ("http://purl.org/ieee1872-owl/cora-bare#", "IEEE 1872-2015, core ontology for robotics"),
    "corax": ("http://purl.org/ieee1872-owl/corax#", "IEEE 1872-2015, what is above CORA"),
    "rparts": ("http://purl.org/ieee1872-owl/rparts#", "IEEE 1872-2015, parts of robots"),
    "pos": ("http://purl.org/ieee1872-owl/pos#", "IEEE 1872-2015, positions"),
    "sumo": ("http://purl.org/ieee1872-owl/sumo-cora#", "what IEEE 1872-2015 takes from SUMO"),
    "soma": ("http://www.ease-crc.org/ont/SOMA.owl#", "SOMA, the socio-physical model of activities"),
    "dul": ("http://www.ontologydesignpatterns.org/ont/dul/DUL.owl#", "DOLCE+DnS Ultralite"),
    "sosa": ("http://www.w3.org/ns/sosa/", "SOSA, sensors and observations"),
    "bot": ("https://w3id.org/bot#", "BOT, topology of buildings"),
}


def _alignments(graph: Graph) -> list[str]:
    """Which terms of other vocabularies ours match, and how."""
    lines = ["", "## Terms of other vocabularies", ""]
    lines += ["Said by annotations (SKOS), which no reasoner heeds: nothing of others is imported.", ""]
    lines += ["| prefix | namespace | what |", "|---|---|---|"]
    lines += [f"| `{prefix}` | `{iri}` | {what} |" for prefix, (iri, what) in sorted(_VOCABULARIES.items())]
    lines += ["", "| term | same | nearly | broader | narrower | related |", "|---|---|---|---|---|---|"]
    matches = (SKOS.exactMatch, SKOS.closeMatch, SKOS.broadMatch, SKOS.narrowMatch, SKOS.relatedMatch)
    for node in sorted({subject for match in matches for subject in graph.subjects(match)}, key=str):
        cells = [", ".join(sorted(f"`{_short(o)}`" for o in graph.objects(node, match))) for match in matches]
        lines.append(f"| `{_name(node)}` | {' | '.join(cells)} |")
    return lines


def _short(node: Node) -> str:
    """An IRI by its prefix."""
    for prefix, (iri, _) in _VOCABULARIES.items():
        if str(node).startswith(iri):
            return f"{prefix}:{str(node).removeprefix(iri)}"
    raise AssertionError(f"tests/docs/generated.py: say what vocabulary {node} is of")


def failures_page(failures: Path) -> str:
    """docs/reference/failures.md."""
    graph = Graph()
    graph.parse(failures, format="xml")
    lines = [
        "# Failures",
        "",
        MARK,
        "The classes of failure of [failures.owl](../../kb/ontologies/failures/failures.owl), how services tell them,",
        "and what may help. A recovery that helps against a class helps against all classes below it. Processes name",
        "the failures that they are to be reckoned with by `expectedFailure`. Times and odds are estimates to begin",
        "with; the odds are learned (`concertmaster kb learn`). The executive tries an action again in one of the ways",
        "of the sort `Retry`, or plans again without what has failed, whichever is expected to be done sooner. It does",
        "not ask people, perform other processes, or look for other paths by itself yet.",
        "",
        "## Classes of failure",
        "",
        "| class | below | recovered by | meaning |",
        "|---|---|---|---|",
    ]
    recovered, told = URIRef(CORE + "recoveredBy"), URIRef(CORE + "failureCode")
    for node in _named(graph, OWL.Class):
        above, recoveries = (_names(graph.objects(node, p)) for p in (RDFS.subClassOf, recovered))
        lines.append(f"| `{_name(node)}` | {above} | {recoveries} | {_comment(graph, node)} |")
    lines += [
        "",
        "## Recoveries",
        "",
        "| recovery | sort | time (s) | odds | attempts | meaning |",
        "|---|---|---|---|---|---|",
    ]
    for node in _named(graph, OWL.NamedIndividual):
        sort = _names(o for o in graph.objects(node, RDF.type) if o != OWL.NamedIndividual)
        figures = [graph.value(node, URIRef(CORE + p)) for p in ("recoveryTime_s", "recoveryOdds", "maxAttempts")]
        cells = " | ".join("" if figure is None else str(figure) for figure in figures)
        lines.append(f"| `{_name(node)}` | {sort} | {cells} | {_comment(graph, node)} |")
    lines += ["", "## Codes", "", "| source | code | name | class |", "|---|---|---|---|"]
    codes = []
    for failure, code in graph.subject_objects(told):
        source, *number, name = str(code).split()
        codes.append((source, int(number[0]) if number else 0, name, _name(failure), bool(number)))
    lines += [
        f"| `{s}` | {n if numbered else ''} | `{name}` | `{kind}` |" for s, n, name, kind, numbered in sorted(codes)
    ]
    return "\n".join(lines) + "\n"


def _named(graph: Graph, sort: Node) -> list[URIRef]:
    return sorted(s for s in graph.subjects(RDF.type, sort) if isinstance(s, URIRef))


def _name(node: Node) -> str:
    return str(node).rpartition("#")[2]


def _names(nodes: Iterable[Node]) -> str:
    return ", ".join(sorted(f"`{_name(node)}`" for node in nodes))


def _comment(graph: Graph, node: Node) -> str:
    return _escaped(str(graph.value(node, RDFS.comment) or ""))


def _sort(graph: Graph, prop: Node) -> str:
    sorts = []
    if (prop, RDF.type, OWL.FunctionalProperty) in graph:
        sorts.append("one value")
    if (prop, RDF.type, OWL.TransitiveProperty) in graph:
        sorts.append("transitive")
    if any(str(value) == "true" for value in graph.objects(prop, URIRef(CORE + "fluent"))):
        sorts.append("fluent")
    above = _names(graph.objects(prop, RDFS.subPropertyOf))
    return ", ".join([*sorts, *([f"below {above}"] if above else [])])


def _manchester(graph: Graph, node: Node) -> str:
    """A class expression of named classes, `and` and `some`; what core.owl has."""
    if not isinstance(node, BNode):
        return _name(node)
    members = graph.value(node, OWL.intersectionOf)
    if members is not None:
        return " and ".join(_manchester(graph, member) for member in Collection(graph, members))
    prop, filler = graph.value(node, OWL.onProperty), graph.value(node, OWL.someValuesFrom)
    assert prop is not None, "a class expression that this page cannot show"
    assert filler is not None, "a class expression that this page cannot show"
    return f"({_name(prop)} some {_manchester(graph, filler)})"


def _parts(graph: Graph, prop: Node, end: URIRef) -> list[Node]:
    """The classes of the subjects or values of a property; of a union, each."""
    found: list[Node] = []
    for kind in graph.objects(prop, end):
        union = graph.value(kind, OWL.unionOf)
        found += [kind] if union is None else Collection(graph, union)
    return found


def _escaped(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
