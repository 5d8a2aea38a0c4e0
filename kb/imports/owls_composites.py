"""Composite processes of OWL-S -> control constructs of ours."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rdflib import RDF, RDFS, URIRef
from rdflib.term import Node

from kb.imports.draft import Draft
from kb.imports.names import local
from kb.imports.owls_conditions import Conditions, Test
from kb.imports.owls_flow import Origin, bindings_of
from kb.imports.owls_services import Services
from kb.imports.owls_terms import FIRST, NO_ITEMS, PROCESS, REST
from kb.imports.owls_types import TRUTH, Slot, Slots, Type
from kb.imports.report import Fate
from kb.imports.source import Source
from kb.vocabulary import Kind, Property
from kb.writing import Literal

_SEVERAL = {
    PROCESS.Sequence: Kind.SEQUENCE,
    PROCESS.Split: Kind.SPLIT,
    PROCESS["Split-Join"]: Kind.SPLIT_JOIN,
    PROCESS["Split+Join"]: Kind.SPLIT_JOIN,
    PROCESS["Any-Order"]: Kind.ANY_ORDER,
    PROCESS.Unordered: Kind.ANY_ORDER,
    PROCESS.Choice: Kind.CHOICE,
}
_COPYING = {PROCESS.Produce: PROCESS.producedBinding, PROCESS.Set: PROCESS.setBinding}
_LOCALS = (PROCESS.hasLocal, PROCESS.hasExistential, PROCESS.hasVar)


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A control construct of ours, by the name of its individual; parts by the property that names them."""

    name: str
    kind: Kind
    parts: tuple[tuple[Property, Step], ...] = ()
    links: tuple[tuple[Property, str], ...] = ()
    label: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """A constant that a step is given: a literal, or an individual by name."""

    value: Literal = ""
    individual: str = ""


class Composites:
    """Converts the composite processes of one source, callees first.

    Attributes:
        bodies: The name of the outermost construct of each.
    """

    def __init__(self, source: Source, draft: Draft, slots: Slots, conditions: Conditions) -> None:
        self.bodies: dict[Node, str] = {}
        self.source, self.draft, self.slots, self.conditions = source, draft, slots, conditions
        self._begun: set[Node] = set()
        self.services = Services(source, draft)

    def convert(self, process: Node) -> None:
        """Convert a composite process, and those that it performs before it."""
        if process in self._begun:
            return
        self._begun.add(process)
        construct = self.source.value(process, PROCESS.composedOf)
        if construct is None:
            self.source.note(process, Fate.LEFT_OUT, "is composed of nothing; the process cannot be done")
            return
        performs = self._performs(construct)
        for perform in performs:
            callee = self.source.value(perform, PROCESS.process)
            if callee is not None and self.source.is_a(callee, PROCESS.CompositeProcess):
                self.convert(callee)
        body = _Composite(self, process, performs).body(construct)
        if body is None:
            self.source.note(process, Fate.LEFT_OUT, "has no step that could be carried over; it cannot be done")
            return
        self.bodies[process] = self._emit(body)

    def _performs(self, construct: Node) -> list[Node]:
        """All steps in a construct, in order."""
        found: list[Node] = []
        if self.source.is_a(construct, PROCESS.Perform):
            return [construct]
        for part in self.parts(construct):
            found += self._performs(part)
        return found

    def parts(self, construct: Node) -> list[Node]:
        """What a construct consists of, in order, whatever the property."""
        source = self.source
        listed: list[Node] = []
        for part in source.values(construct, PROCESS.components):
            is_list = any((part, p, None) in source.graph for p in FIRST)
            listed += source.items(part, FIRST, REST) if is_list else [p for p in [part] if p not in NO_ITEMS]
        single = [PROCESS[p] for p in ("then", "else", "whileProcess", "untilProcess", "iterateProcess")]
        return listed + [v for p in single for v in source.values(construct, p)]

    def _emit(self, step: Step, number: int | None = None) -> str:
        links = list(step.links)
        for place, (prop, part) in enumerate(step.parts, start=1):
            ordered = step.kind in (Kind.SEQUENCE, Kind.PRIORITIZED)
            links.append((prop, self._emit(part, 10 * place if ordered else None)))
        values = [] if number is None else [(Property.STEP_NUMBER, number)]
        return self.draft.individual(step.name, step.kind, links, values, label=step.label)


class _Composite:
    """One composite process on its way."""

    def __init__(self, whole: Composites, process: Node, performs: list[Node]) -> None:
        self._whole, self._process, self._performs = whole, process, performs
        self._source, self._draft, self._slots = whole.source, whole.draft, whole.slots
        self._name = self._draft.names.of(str(process), local(str(process)))
        self._flows: dict[tuple[Node, Node], Slot] = {}
        """What the outputs of steps go to, by step and output."""
        self._written: set[str] = set()

    def body(self, construct: Node) -> Step | None:
        """The outermost construct."""
        last = self._results()
        self._declare_locals()
        self._connect()
        body = self._construct(construct)
        if body is None:
            return None
        ends = [self._copy(to, origin) for to, origin in last]
        if ends:
            body = self._sequence([body, *(e for e in ends if e is not None)])
        for slot in [s for s in self._slots.of[self._process] if s.role == "Output" and s.name not in self._written]:
            self._slots.drop(self._process, slot)
            self._source.note(
                slot.source, Fate.LEFT_OUT, f"no step and no binding of {self._name} gives this output a value"
            )
        return body

    def _results(self) -> list[tuple[Slot, Origin]]:
        """Let steps write what the results bind; what is left is to be copied in the end."""
        last = []
        for result in self._source.values(self._process, PROCESS.hasResult):
            for to, origin in bindings_of(self._source, result, PROCESS.withOutput):
                slot = self._slots.find(self._process, to)
                if slot is None:
                    self._source.note(
                        to, Fate.LEFT_OUT, f"a result of {self._name} binds it, but it is no output of that"
                    )
                elif origin.step is None or origin.parameter is None or (origin.step, origin.parameter) in self._flows:
                    last.append((slot, origin))
                else:
                    self._flows[origin.step, origin.parameter] = slot
                    self._written.add(slot.name)
        return last

    def _declare_locals(self) -> None:
        for node in self._source.values(self._process, *_LOCALS):
            for kind in ("Local", "Loc", "Link", "Existential"):
                self._source.is_a(node, PROCESS[kind])
            set_by = self._source.graph.subjects(PROCESS.toVar, node)
            if any((None, PROCESS.setBinding, b) in self._source.graph for b in set_by):
                self._slots.add(self._process, node, local(str(node)), "Local", self._slots.type_of(node))
            else:
                self._source.value(node, PROCESS.parameterType)
                told = (
                    "is not needed: conditions ask for the value itself, steps hand values on by locals that were added"
                )
                self._source.note(node, Fate.LEFT_OUT, told)

    # Constructs

    def _construct(self, node: Node) -> Step | None:
        source = self._source
        kinds = [k for k in (*_SEVERAL, *_COPYING) if source.is_a(node, k)]
        if source.is_a(node, PROCESS.Perform):
            return self._perform(node)
        if kinds and kinds[0] in _COPYING:
            steps = self._copies(node, _COPYING[kinds[0]])
            return self._sequence(steps) if len(steps) > 1 else next(iter(steps), None)
        if kinds:
            return self._several(node, _SEVERAL[kinds[0]])
        if source.is_a(node, PROCESS["If-Then-Else"]):
            return self._if(node)
        for kind, condition in (
            ("Repeat-While", PROCESS.whileCondition),
            ("Repeat-Until", PROCESS.untilCondition),
        ):
            if source.is_a(node, PROCESS[kind]):
                return self._repeat(node, Kind.REPEAT_WHILE if kind == "Repeat-While" else Kind.REPEAT_UNTIL, condition)
        if source.is_a(node, PROCESS.Iterate):
            body = self._sequence_of(self._whole.parts(node))
            return self._made(node, Kind.ITERATE, [(Property.BODY_STEP, body)]) if body else None
        known = [local(str(k)) for k in source.values(node, RDF.type)]
        source.note(node, Fate.LEFT_OUT, f"a construct {', '.join(known) or 'without a class'}, which we do not have")
        return None

    def _made(self, node: Node, kind: Kind, parts: list[tuple[Property, Step]], condition: str = "") -> Step:
        links = ((Property.HAS_CONDITION, condition),) if condition else ()
        return Step(name=self._fresh(node, kind), kind=kind, parts=tuple(parts), links=links, label=self._label(node))

    def _fresh(self, node: Node, kind: Kind) -> str:
        named = isinstance(node, URIRef) and "#" in str(node)
        return self._draft.names.fresh(local(str(node)) if named else f"{self._name}_{kind}")

    def _label(self, node: Node) -> str:
        return " ".join(str(self._source.value(node, RDFS.label) or "").split())

    def _several(self, node: Node, kind: Kind) -> Step | None:
        steps = [s for part in self._whole.parts(node) if (s := self._construct(part)) is not None]
        if not steps:
            self._source.note(node, Fate.LEFT_OUT, f"a {kind} in which no step is left")
            return None
        return self._made(node, kind, [(Property.HAS_STEP, s) for s in steps])

    def _sequence_of(self, nodes: list[Node]) -> Step | None:
        steps = [s for n in nodes if (s := self._construct(n)) is not None]
        return self._sequence(steps) if len(steps) > 1 else next(iter(steps), None)

    def _sequence(self, steps: list[Step]) -> Step:
        name = self._draft.names.fresh(f"{self._name}_{Kind.SEQUENCE}")
        return Step(name=name, kind=Kind.SEQUENCE, parts=tuple((Property.HAS_STEP, s) for s in steps))

    def _if(self, node: Node) -> Step | None:
        then = self._sequence_of(self._source.values(node, PROCESS.then))
        otherwise = self._sequence_of(self._source.values(node, PROCESS["else"]))
        if then is None:
            self._source.note(node, Fate.LEFT_OUT, "an If-Then-Else without a step to do then")
            return None
        decided = self._decision(node, PROCESS.ifCondition)
        if decided is None:
            return then
        ask, condition = decided
        parts = [(Property.THEN_STEP, then)] + ([(Property.ELSE_STEP, otherwise)] if otherwise else [])
        step = self._made(node, Kind.IF_THEN_ELSE, parts, condition)
        return self._sequence([ask(), step]) if ask is not None else step

    def _repeat(self, node: Node, kind: Kind, prop: URIRef) -> Step | None:
        body = self._sequence_of(self._whole.parts(node))
        if body is None:
            self._source.note(node, Fate.LEFT_OUT, f"a {kind} without a step")
            return None
        decided = self._decision(node, prop)
        if decided is None:
            self._source.note(node, Fate.LEFT_OUT, f"the {kind} has no condition, or one that always holds; done once")
            return body
        ask, condition = decided
        if ask is not None:
            body = self._sequence([body, ask()])
        step = self._made(node, kind, [(Property.BODY_STEP, body)], condition)
        return self._sequence([ask(), step]) if ask is not None and kind is Kind.REPEAT_WHILE else step

    def _decision(self, node: Node, prop: URIRef) -> tuple[Callable[[], Step] | None, str] | None:
        """What asks for a condition, if a service has to, and the condition; None if it always holds."""
        expression = self._source.value(node, prop)
        if expression is None:
            return None
        decided = self._whole.conditions.decision(self._process, expression, self._name)
        if not isinstance(decided, Test):
            return None if decided is None else (None, decided)
        service = self._whole.services.tester(decided, f"{self._name}_Test")
        truth = self._local(f"{service.process}_result", TRUTH)
        condition = self._draft.names.fresh(f"{self._name}_condition")
        self._draft.individual(condition, "IsTrue", [(Property.OF_TRUTH_VALUE, truth.name)])

        def ask() -> Step:
            given: dict[str, str | Given] = {service.inputs[slot.name]: slot.name for slot in decided.slots}
            return self._call(f"{self._name}_Ask", service.process, {**given, service.output: truth.name})

        return ask, condition

    # Data

    def _local(self, wanted: str, kind: Type) -> Slot:
        return self._slots.add(self._process, URIRef(f"{self._draft.iri}#{wanted}"), wanted, "Local", kind)

    def _connect(self) -> None:
        """Give a local to each output of a step that another one reads."""
        read = [o for p in self._performs for _, o in bindings_of(self._source, p, PROCESS.hasDataFrom)]
        for node in self._performs:
            callee = self._source.value(node, PROCESS.process)
            for slot in self._slots.of.get(callee, ()) if callee is not None else ():
                key = (node, slot.source)
                if key not in self._flows and any((o.step, o.parameter) == key for o in read):
                    self._flows[key] = self._local(f"{self._short(node)}_{slot.parameter}", slot.type)

    def _short(self, perform: Node) -> str:
        return local(str(perform)) if isinstance(perform, URIRef) else "step"

    def _given(self, origin: Origin, to: Slot) -> str | Given | None:
        """What a binding gives a parameter: the name of a parameter of ours, or a constant."""
        if origin.literal is not None:
            value = origin.literal.toPython()
            return Given(value=value if isinstance(value, bool | int | float) else str(origin.literal))
        if origin.individual is not None:
            if to.type.is_datum:
                return Given(value=local(str(origin.individual)))
            return Given(individual=self._slots.member(origin.individual, to.type.kind))
        assert origin.parameter is not None
        if origin.step is None or origin.step == self._process:
            found = self._slots.find(self._process, origin.parameter)
        else:
            found = self._flows.get((origin.step, origin.parameter))
        if found is None:
            told = f"{local(str(origin.parameter))}, which is nothing that {self._name} or a step of it has"
            self._source.note(to.source, Fate.LEFT_OUT, f"its value was to come from {told}")
            return None
        return found.name

    # Steps

    def _perform(self, node: Node) -> Step | None:
        callee = self._source.value(node, PROCESS.process)
        if callee not in self._slots.of:
            told = f"performs {local(str(callee))}, which none of the files that were read describes"
            self._source.note(node, Fate.LEFT_OUT, told)
            return None
        assert callee is not None
        process = self._draft.names.of(str(callee), local(str(callee)))
        bound = dict(bindings_of(self._source, node, PROCESS.hasDataFrom))
        given: dict[str, str | Given] = {}
        for slot in list(self._slots.of[callee]):
            if slot.role == "Input":
                origin = bound.pop(slot.source, None)
                value = None if origin is None else self._given(origin, slot)
                given[slot.name] = self._lifted(slot, node) if value is None else value
            elif slot.role == "Output":
                to = self._flows.get((node, slot.source))
                if to is None and any(own.parameter == slot.parameter for own in self._slots.of[self._process]):
                    to = self._local(f"{self._short(node)}_{slot.parameter}", slot.type)  # not the namesake
                if to is not None:
                    given[slot.name] = to.name
        for stray in bound:
            self._source.note(node, Fate.LEFT_OUT, f"binds {local(str(stray))}, which is no input of {process}")
        named = isinstance(node, URIRef)
        return self._call(local(str(node)) if named else f"{self._name}_{process}", process, given, self._label(node))

    def _lifted(self, slot: Slot, node: Node) -> str:
        """The input that gives a step what nothing is bound to: one of that name and type, or a new one."""
        own = [s for s in self._slots.of[self._process] if s.role == "Input"]
        same = [s for s in own if s.parameter == slot.parameter and s.type == slot.type]
        told = f"nothing is bound to the input {slot.parameter} of its step {self._short(node)}"
        if same:
            self._source.note(self._process, Fate.ASSUMED, f"{told}; it gets the input of the same name and type")
            return same[0].name
        added = self._slots.add(
            self._process, URIRef(f"{self._draft.iri}#{slot.name}"), slot.parameter, "Input", slot.type
        )
        self._source.note(self._process, Fate.ASSUMED, f"{told}; the input {added.parameter} was added to {self._name}")
        return added.name

    def _copies(self, node: Node, prop: URIRef) -> list[Step]:
        steps = []
        for to, origin in bindings_of(self._source, node, prop):
            slot = self._slots.find(self._process, to)
            if slot is None:
                self._source.note(
                    node, Fate.LEFT_OUT, f"gives {local(str(to))} a value, which {self._name} does not have"
                )
            elif (step := self._copy(slot, origin, self._fresh_name(node))) is not None:
                steps.append(step)
        return steps

    def _fresh_name(self, node: Node) -> str:
        return local(str(node)) if isinstance(node, URIRef) else ""

    def _copy(self, to: Slot, origin: Origin, wanted: str = "") -> Step | None:
        given = self._given(origin, to)
        if given is None:
            return None
        self._written.add(to.name)
        service = self._whole.services.copier(to)
        bindings = {service.inputs["value"]: given, service.output: to.name}
        return self._call(wanted or f"{self._name}_Give_{to.parameter}", service.process, bindings)

    def _call(self, wanted: str, process: str, given: Mapping[str, str | Given], label: str = "") -> Step:
        name = self._draft.names.fresh(wanted)
        links = [(Property.PERFORMS, process)]
        for number, (to, value) in enumerate(given.items(), start=1):
            binding = self._draft.names.fresh(f"{name}_Binding_{number}")
            ends: list[tuple[Property, str]] = [(Property.TO_PARAMETER, to)]
            values: list[tuple[Property, Literal]] = []
            if isinstance(value, str):
                ends.append((Property.FROM_PARAMETER, value))
            elif value.individual:
                ends.append((Property.FROM_INDIVIDUAL, value.individual))
            else:
                values.append((Property.HAS_VALUE, value.value))
            self._draft.individual(binding, "Binding", ends, values)
            links.append((Property.HAS_BINDING, binding))
        return Step(name=name, kind=Kind.PERFORM, links=tuple(links), label=label)
