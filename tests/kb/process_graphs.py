"""Random well-formed processes as ontology files, and what may be done when they are executed.

A process is drawn as a tree of control constructs (`Node`), becomes individuals (`Graph`), and is written as the
RDF/XML that a person would save. What executions are there follows from the tree alone, without the compiler.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import escape

from hypothesis import strategies as st
from rdflib import OWL, RDF, RDFS, XSD, URIRef
from rdflib import Graph as Triples

from kb.files import SHIPPED, OntologyFiles, local_name
from kb.reasoner import Classification
from kb.vocabulary import CORE, CORE_IRI

NAMESPACE = "http://example.org/concertmaster/random.owl#"
DOORS = {"door_1": (True, 0.9, "room_1"), "door_2": (False, 0.8, "room_1"), "door_3": (True, 0.7, "room_2")}
"""Whether it is open, how wide it is (m), and in which room."""
TOKENS = ("token_1", "token_2")
"""What can be spent once."""
ROBOTS = ("ann", "bob")
SKILLED = "bob"
"""The robot with the capability that some processes require."""
ARGUMENTS = ("ann", "door_1", "room_1")
"""Of a request for Main."""


@dataclass(frozen=True, slots=True)
class Node:
    """A control construct, or a condition.

    Attributes:
        value: Of a Perform the process, of a condition what it compares with.
        over: What a Pick goes over: robots, or tokens.
    """

    kind: str
    parts: tuple[Node, ...] = ()
    condition: Node | None = None
    value: str | float | bool = ""
    over: str = "robot"


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """What is drawn: the task type Part, with the recipes Part_a and Part_b or the first alone, Again, and Main.

    Attributes:
        again: What Again does every turn, and at its end: it spends a token and performs itself then, or ends where
            the last token is spent.
        skilled: The composite processes that require the capability that bob alone has.
        whole: Of Main, which may perform Part and begin with Again.
    """

    recipes: tuple[Node, ...]
    again: tuple[Node, Node]
    skilled: frozenset[str]
    whole: Node

    @property
    def composites(self) -> dict[str, Node]:
        """The trees of all composite processes, by name."""
        each, last = self.again
        once_more = _in_turn(Node("Pick", (_SPEND,), over="token"), each, Node("Perform", value="Again"))
        return {**self.of_part, "Again": Node("Choice", (_in_turn(_CHECK, last), once_more)), "Main": self.whole}

    @property
    def of_part(self) -> dict[str, Node]:
        """The recipes of Part, by name."""
        return dict(zip(("Part_a", "Part_b"), self.recipes, strict=False))


# ------------------------------------------------------------------------------------------- strategies

_LOOK = Node("Perform", value="Look")
_BEEP = Node("Perform", value="Beep")
_SPEND = Node("Perform", value="Spend")
_CHECK = Node("Perform", value="Check")
_SEEN = Node("IsTrue")
_NEVER = Node("AllOf", (Node("Holds", value=True), Node("Compare", value=99.0)))


def _in_turn(*parts: Node) -> Node:
    return Node("Sequence", parts)


def _conditions(depth: int) -> st.SearchStrategy[Node]:
    holds = st.booleans().map(lambda is_open: Node("Holds", value=is_open))
    compares = st.sampled_from([0.75, 0.85]).map(lambda width_m: Node("Compare", value=width_m))
    if depth == 0:
        return holds | compares
    inner = _conditions(depth - 1)
    several = st.lists(inner, min_size=2, max_size=2).map(tuple)
    negated = st.builds(Node, st.just("Not"), st.tuples(inner))
    return holds | compares | negated | st.builds(Node, st.sampled_from(["AllOf", "AnyOf"]), several)


def _alternatives(inner: st.SearchStrategy[Node]) -> dict[str, st.SearchStrategy[Node]]:
    """Ways to compose a tree, by what is special about each."""
    one = st.tuples(inner)
    several = st.lists(inner, min_size=1, max_size=3).map(tuple)
    conditions = _conditions(2)

    def asking(kind: str, parts: st.SearchStrategy[tuple[Node, ...]]) -> st.SearchStrategy[Node]:
        return st.builds(Node, st.just(kind), parts, conditions)

    unordered = ("Split", "SplitJoin", "AnyOrder", "Choice")
    return {
        **{kind: st.builds(Node, st.just(kind), several) for kind in ("Sequence", *unordered, "Prioritized")},
        **{kind: st.builds(Node, st.just(kind), one) for kind in ("Lookahead", "Deadline", "Pick")},
        "ForEach": asking("ForEach", one),
        "IfThen": asking("IfThenElse", one),
        "IfThenElse": asking("IfThenElse", st.tuples(inner, inner)),
        "Await": st.builds(_in_turn, asking("Await", st.just(())), inner),
        "what follows a Split": st.builds(
            lambda parts, then, last: _in_turn(Node("Split", parts), then, last), several, inner, inner
        ),
        # What a step has found out; a turn of a loop has a step.
        "IsTrue": st.builds(lambda parts: _in_turn(_LOOK, Node("IfThenElse", parts, _SEEN)), st.tuples(inner, inner)),
        "Iterate": inner.map(lambda body: Node("Iterate", (_in_turn(_BEEP, body),))),
        "RepeatUntil": inner.map(lambda body: Node("RepeatUntil", (_in_turn(_LOOK, body),), _SEEN)),
        "RepeatWhile": inner.map(
            lambda body: _in_turn(_LOOK, Node("RepeatWhile", (_in_turn(_LOOK, body),), Node("Not", (_SEEN,))))
        ),
        # What an interrupt asks for does not hold, or it would go on for ever.
        "Interrupt": st.builds(
            lambda urgent, rest: Node("Prioritized", (Node("Interrupt", (_in_turn(_BEEP, urgent),), _NEVER), rest)),
            inner,
            inner,
        ),
    }


_atomic = st.sampled_from(["Beep", "Count", "Pass"]).map(lambda name: Node("Perform", value=name))
_flat = st.one_of(_atomic, *_alternatives(_atomic).values())
_part = st.just(Node("Perform", value="Part"))
_flat_or_part = st.booleans().flatmap(lambda part: _part if part else _flat)  # as often the one as the other


def _programs(whole: st.SearchStrategy[Node]) -> st.SearchStrategy[Program]:
    recipes = st.lists(_flat, min_size=1, max_size=2).map(tuple)
    skilled = st.frozensets(st.sampled_from(["Part_a", "Part_b", "Again"]), max_size=2)
    return st.builds(Program, recipes=recipes, again=st.tuples(_atomic, _flat), skilled=skilled, whole=whole)


PROGRAMS_WITH = {
    **{name: _programs(whole) for name, whole in _alternatives(_flat_or_part).items()},
    "what performs itself": _programs(_flat_or_part.map(lambda rest: _in_turn(Node("Perform", value="Again"), rest))),
}
"""Programs that begin with each way to compose a tree."""
programs = st.one_of(*PROGRAMS_WITH.values())


# --------------------------------------------------------------------------------------- individuals


@dataclass(slots=True)
class Graph:
    """Individuals: what each has for its properties, in the order in which it was added."""

    rows: dict[str, list[tuple[str, object]]] = field(default_factory=dict)

    def add(self, name: str, kind: str, *rows: tuple[str, object]) -> str:
        """A new individual; `Ref` links to others, `URIRef` to terms, anything else is a literal."""
        assert name not in self.rows, name
        self.rows[name] = [
            ("rdf:type", URIRef((NAMESPACE if kind in ("Door", "Skilled", "Token") else CORE) + kind)),
            *rows,
        ]
        return name


@dataclass(frozen=True, slots=True)
class Ref:
    """A link to an individual."""

    name: str


def core(name: str) -> URIRef:
    """A term of core.owl."""
    return URIRef(CORE + name)


def own(name: str) -> URIRef:
    """A term of the random ontology."""
    return URIRef(NAMESPACE + name)


_ATOMIC: dict[str, tuple[str, ...]] = {
    "Beep": ("robot",),
    "Check": ("token",),
    "Count": (),
    "Look": ("robot", "seen"),
    "Pass": ("robot", "door"),
    "Spend": ("robot", "token"),
}
_SORTS = {
    "robot": ("RobotParameter", "hasInput", core("Robot")),
    "door": ("Input", "hasInput", own("Door")),
    "room": ("Input", "hasInput", core("Area")),
    "token": ("Input", "hasInput", own("Token")),
    "seen": ("Output", "hasOutput", core("TruthValue")),
}


_GIVEN = ("robot", "door", "room")
_WITH_BODY = {"RepeatWhile", "RepeatUntil", "Iterate", "ForEach", "Pick", "Interrupt", "Lookahead", "Deadline"}


def graph_of(program: Program) -> Graph:
    """The processes of a program, all that they perform, and a little world."""
    graph = Graph()
    for robot in ROBOTS:
        graph.add(robot, "Skilled" if robot == SKILLED else "Robot")
    for room in ("room_1", "room_2"):
        graph.add(room, "Room")
    for door, (is_open, width_m, room) in DOORS.items():
        graph.add(door, "Door", ("r:isOpen", is_open), ("r:width_m", width_m), ("core:inArea", Ref(room)))
    for token in TOKENS:
        graph.add(token, "Token", ("r:isSpent", False))
    for process, parameters in _ATOMIC.items():
        rows = [_parameter(graph, process, name, number) for number, name in enumerate(parameters)]
        if process == "Pass":
            rows.append(("core:hasPrecondition", Ref(_holds(graph, "Pass_open", "Pass_door", True))))
        spent = [("core:ofProperty", own("isSpent")), ("core:subjectParameter", Ref(f"{process}_token"))]
        if process in ("Check", "Spend"):
            before = graph.add(f"{process}_before", "Holds", *spent, ("core:hasValue", process == "Check"))
            rows.append(("core:hasPrecondition", Ref(before)))
        if process == "Spend":
            rows.append(("core:hasEffect", Ref(graph.add("Spend_after", "Effect", *spent, ("core:hasValue", True)))))
        graph.add(process, "AtomicProcess", *rows, ("core:duration_s", 1.0))
    graph.add("Part", "SimpleProcess", *(_parameter(graph, "Part", p, n) for n, p in enumerate(_GIVEN)))
    for process, tree in program.composites.items():
        _Composite(graph, process, skilled=process in program.skilled).write(tree)
    return graph


def _holds(graph: Graph, name: str, door: str, value: bool | float | str) -> str:
    rows: list[tuple[str, object]] = [("core:ofProperty", own("isOpen")), ("core:subjectParameter", Ref(door))]
    return graph.add(name, "Holds", *rows, ("core:hasValue", value))


def _parameter(
    graph: Graph, process: str, name: str, number: int, sort: tuple[str, str, URIRef] | None = None
) -> tuple[str, object]:
    kind, prop, values = sort or _SORTS[name]
    entity = graph.add(
        f"{process}_{name}",
        kind,
        ("core:parameterName", name),
        ("core:parameterNumber", 10 * (number + 1)),
        ("core:parameterType", values),
    )
    return f"core:{prop}", Ref(entity)


class _Composite:
    """Writes one composite process; its steps are called by its name and a number."""

    def __init__(self, graph: Graph, process: str, *, skilled: bool) -> None:
        self._graph, self._process = graph, process
        self._numbers = itertools.count(1)
        self._rows = [_parameter(graph, process, p, n) for n, p in enumerate(_GIVEN)]
        if process.startswith("Part_"):
            self._rows.append(("core:realizes", Ref("Part")))
        if skilled:
            self._rows.append(("core:requiresCapability", own("Skilled")))
        self._rows.append(_parameter(graph, process, "seen", 3, ("Local", "hasLocal", core("TruthValue"))))

    def write(self, tree: Node) -> None:
        """The process that consists of a tree."""
        body = self._construct(tree, {})
        self._graph.add(self._process, "CompositeProcess", *self._rows, ("core:composedOf", Ref(body)))

    def _local(self, kind: URIRef) -> str:
        number = next(self._numbers)
        self._rows.append(
            _parameter(self._graph, self._process, f"local{number}", 9 + number, ("Local", "hasLocal", kind))
        )
        return f"local{number}"

    def _construct(self, node: Node, bound: Mapping[str, str], step: int | None = None) -> str:
        """Write a construct; returns its name.

        Args:
            bound: The locals that stand for `robot` and `door` here.
        """
        name = f"{self._process}_{next(self._numbers):03}"
        rows: list[tuple[str, object]] = [] if step is None else [("core:stepNumber", step)]
        within = dict(bound)
        if node.kind in ("ForEach", "Pick", "Interrupt"):
            of = node.over if node.kind == "Pick" else "door"
            within[of] = self._local(_SORTS[of][2])
            rows.append(("core:overParameter", Ref(f"{self._process}_{within[of]}")))
        if node.condition is not None:
            rows.append(("core:hasCondition", Ref(self._condition(node.condition, within))))
        if node.kind == "Perform":
            rows.append(("core:performs", Ref(str(node.value))))
            rows += self._bindings(name, str(node.value), bound)
        if node.kind == "Deadline":
            rows.append(("core:deadline_s", 1000.0))
        links = {"IfThenElse": ("thenStep", "elseStep")}.get(node.kind)
        one = node.kind in (
            "RepeatWhile",
            "RepeatUntil",
            "Iterate",
            "ForEach",
            "Pick",
            "Interrupt",
            "Lookahead",
            "Deadline",
        )
        for number, part in enumerate(node.parts):
            link = links[number] if links else "bodyStep" if one else "hasStep"
            # As texts they would be in another order.
            ordered = node.kind in ("Sequence", "Prioritized")
            rows.append((f"core:{link}", Ref(self._construct(part, within, (9, 30, 200)[number] if ordered else None))))
        return self._graph.add(name, node.kind, *rows)

    def _bindings(self, step: str, callee: str, bound: Mapping[str, str]) -> Iterator[tuple[str, object]]:
        sources = {p: ("core:fromParameter", Ref(f"{self._process}_{local}")) for p, local in bound.items()}
        if callee == "Check":
            sources["token"] = ("core:fromIndividual", Ref(TOKENS[-1]))
        for name in (p for p in _ATOMIC.get(callee, ("robot", "door")) if p in sources):
            to = ("core:toParameter", Ref(f"{callee}_{name}"))
            yield "core:hasBinding", Ref(self._graph.add(f"{step}_{name}", "Binding", to, sources[name]))

    def _condition(self, node: Node, bound: Mapping[str, str]) -> str:
        name = f"{self._process}_{next(self._numbers):03}"
        door = Ref(f"{self._process}_{bound.get('door', 'door')}")
        rows: list[tuple[str, object]] = []
        match node.kind:
            case "IsTrue":
                rows = [("core:ofTruthValue", Ref(f"{self._process}_seen"))]
            case "Holds":
                return _holds(self._graph, name, door.name, node.value)
            case "Compare":
                rows = [("core:ofProperty", own("width_m")), ("core:subjectParameter", door)]
                rows += [("core:comparison", "at least"), ("core:hasValue", node.value)]
            case _:
                rows = [("core:operand", Ref(self._condition(part, bound))) for part in node.parts]
        return self._graph.add(name, node.kind, *rows)


# --------------------------------------------------------------------------------------------- files

_HEAD = f"""<?xml version="1.0"?>
<rdf:RDF xmlns:core="{CORE}" xmlns:r="{NAMESPACE}" xmlns:owl="{OWL}" xmlns:rdf="{RDF}" xmlns:rdfs="{RDFS}">
"""
_TERMS = f"""    <owl:Class rdf:about="{NAMESPACE}Door"/>
    <owl:Class rdf:about="{NAMESPACE}Token"/>
    <owl:Class rdf:about="{NAMESPACE}Skilled">
        <rdfs:subClassOf rdf:resource="{CORE}Robot"/>
    </owl:Class>
    <owl:DatatypeProperty rdf:about="{NAMESPACE}isSpent">
        <rdf:type rdf:resource="{OWL.FunctionalProperty}"/>
        <rdfs:range rdf:resource="{XSD.boolean}"/>
        <core:fluent rdf:datatype="{XSD.boolean}">true</core:fluent>
    </owl:DatatypeProperty>
    <owl:DatatypeProperty rdf:about="{NAMESPACE}isOpen">
        <rdf:type rdf:resource="{OWL.FunctionalProperty}"/>
        <rdfs:range rdf:resource="{XSD.boolean}"/>
        <core:fluent rdf:datatype="{XSD.boolean}">true</core:fluent>
    </owl:DatatypeProperty>
    <owl:DatatypeProperty rdf:about="{NAMESPACE}width_m">
        <rdf:type rdf:resource="{OWL.FunctionalProperty}"/>
        <rdfs:range rdf:resource="{XSD.double}"/>
    </owl:DatatypeProperty>
"""


_CORE_WITHOUT_REMARKS = "".join(
    line
    for line in (SHIPPED / "core" / "core.owl").read_text(encoding="utf-8").splitlines(keepends=True)
    if not line.lstrip().startswith(("<rdfs:comment", "<rdfs:label", "<skos:"))
)
"""Half the triples, with the same meaning: tests take less long."""


def write(
    graph: Graph,
    folder: Path,
    *,
    names: Callable[[str], str] = str,
    files: Sequence[tuple[str, Sequence[str]]] | None = None,
    backwards: bool = False,
) -> Path:
    """Write a graph as ontology files; returns the first, which imports the others.

    Args:
        names: What each individual is called.
        files: Paths below the folder, each with the individuals that it describes; one file of all where not given.
        backwards: What an individual has for its properties, the last first.
    """
    (folder / "vocabulary.owl").write_text(_CORE_WITHOUT_REMARKS, encoding="utf-8")
    listed = files or [("random.owl", list(graph.rows))]
    iris = [f"http://example.org/concertmaster/random_{n}.owl" for n in range(len(listed))]
    for number, (path, individuals) in enumerate(listed):
        imports = [CORE_IRI, *(iris[1:] if number == 0 else [])]
        lines = [_HEAD, f'    <owl:Ontology rdf:about="{iris[number]}">\n']
        lines += [f'        <owl:imports rdf:resource="{iri}"/>\n' for iri in imports]
        lines += ["    </owl:Ontology>\n", *([_TERMS] if number == 0 else [])]
        for name in individuals:
            rows = [_row(prop, value, names) for prop, value in graph.rows[name]]
            lines.append(f'    <owl:NamedIndividual rdf:about="{NAMESPACE}{names(name)}">\n')
            lines += [*(reversed(rows) if backwards else rows), "    </owl:NamedIndividual>\n"]
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("".join([*lines, "</rdf:RDF>\n"]), encoding="utf-8")
    return folder / listed[0][0]


def _row(prop: str, value: object, names: Callable[[str], str]) -> str:
    match value:
        case Ref(name):
            return f'        <{prop} rdf:resource="{NAMESPACE}{names(name)}"/>\n'
        case URIRef():
            return f'        <{prop} rdf:resource="{value}"/>\n'
        case bool():
            return f'        <{prop} rdf:datatype="{XSD.boolean}">{str(value).lower()}</{prop}>\n'
        case int() | float():
            datatype = XSD.integer if isinstance(value, int) else XSD.double
            return f'        <{prop} rdf:datatype="{datatype}">{value}</{prop}>\n'
        case _:
            return f"        <{prop}>{escape(str(value))}</{prop}>\n"


def kinds_below(kind: str) -> set[str]:
    """The classes of core.owl directly below one."""
    triples = Triples().parse(SHIPPED / "core" / "core.owl", format="xml")
    return {local_name(str(c)) for c in triples.subjects(RDFS.subClassOf, core(kind))}


def told(files: OntologyFiles) -> Classification:
    """What a reasoner would find in files that say all there is: named classes, and classes above them."""
    graph = files.merged()

    def above(node: object) -> frozenset[str]:
        assert isinstance(node, URIRef)
        return frozenset(str(c) for c in graph.transitive_objects(node, RDFS.subClassOf) if isinstance(c, URIRef))

    classes = {c: above(c) for c in graph.subjects(RDF.type, OWL.Class) if isinstance(c, URIRef)}
    types: dict[str, frozenset[str]] = {}
    for individual in graph.subjects(RDF.type, OWL.NamedIndividual):
        stated = [classes[o] for o in graph.objects(individual, RDF.type) if o in classes and isinstance(o, URIRef)]
        types[str(individual)] = frozenset[str]().union(*stated)
    return Classification(superclasses={str(c): a for c, a in classes.items()}, types=types)
