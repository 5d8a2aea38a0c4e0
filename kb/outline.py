"""A process as a tree of steps for people: what kb/chart.py draws, and `concertmaster kb show` prints."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from rdflib import RDFS

from kb.constructs import Constructs
from kb.entities import text_of
from kb.ontology import Ontology
from kb.processes import Parameter, Process, Role, realizing
from kb.scope import Scope
from kb.store import Snapshot
from kb.vocabulary import Kind, Property
from kb.wording import condition_text, signature, typed, variable_names


class Form(StrEnum):
    """What sort of process a step does."""

    PRIMITIVE = "primitive"
    COMPOSITE = "composite"
    TASK_TYPE = "task type"


class Side(StrEnum):
    """Who does a primitive action."""

    ROBOT = "robot"
    COMPUTE = "compute"
    NEITHER = ""
    """It is no primitive action, or nothing grounds it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A step within another.

    Attributes:
        label: When it is done: `yes`, `no`, `1` for the first priority; empty where that is clear.
    """

    label: str
    step: Step


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A control construct, or a process that is done.

    Attributes:
        kind: The construct; PERFORM for a process that is done.
        text: The name of the process; else the condition, or what a construct goes over.
        form: What sort of process, of a PERFORM.
        side: Who does it, of a primitive action.
        given: What it takes, `robot`, `area ← room` where the names differ; of a PERFORM.
        made: What it gives.
        parts: The steps within; of a PERFORM the one step that it consists of, if that is to be shown.
    """

    kind: Kind
    text: str = ""
    form: Form = Form.PRIMITIVE
    side: Side = Side.NEITHER
    given: tuple[str, ...] = ()
    made: tuple[str, ...] = ()
    parts: tuple[Part, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Outline:
    """A process from its beginning to its end.

    Attributes:
        signature: What it takes and gives.
        notes: Its comment, what must hold before it and what holds after it, a line each.
    """

    name: str
    signature: str
    notes: tuple[str, ...]
    step: Step


def outline(snapshot: Snapshot, process: str, *, expand: bool = False) -> Outline:
    """Read a process.

    Args:
        process: The name of a process of the snapshot.
        expand: Show what the processes that it does consist of, down to primitive actions.
    """
    reader = _Reader(snapshot, expand=expand)
    found = snapshot.processes[process]
    return Outline(
        name=process,
        signature=signature(found),
        notes=tuple(reader.notes(found)),
        step=reader.inside(found, (process,)) or reader.performed(found, (), (), ()),
    )


class _Reader:
    def __init__(self, snapshot: Snapshot, *, expand: bool) -> None:
        self._snapshot = snapshot
        self._ontology: Ontology = snapshot.ontology
        self._expand = expand
        # Its problems are of no interest: the processes have been compiled.
        self._constructs = Constructs(snapshot.ontology, snapshot.processes)

    def notes(self, process: Process) -> Iterator[str]:
        """What is said of a process as a whole."""
        comment = text_of(self._ontology.graph, self._ontology.iri(process.name), RDFS.comment)
        if comment:
            yield comment
        scope, names = self._constructs.scope(process), variable_names(process)
        for entity in self._constructs.parts(process.name, Property.HAS_PRECONDITION):
            yield f"before: {condition_text(self._constructs.condition(scope, entity), names)}"
        for entity in self._constructs.parts(process.name, Property.HAS_EFFECT):
            prop = self._constructs.part(entity, Property.OF_PROPERTY)
            subject, value = (condition_text(term, names) for term in (scope.subject(entity), scope.object(entity)))
            yield f"after: {prop}({subject}) = {value}"

    def inside(self, process: Process, trail: tuple[str, ...]) -> Step | None:
        """What a process consists of; None for a primitive action."""
        if self._ontology.is_a(process.name, Kind.SIMPLE_PROCESS):
            recipes = [self._snapshot.processes[name] for name in realizing(self._ontology, process.name)]
            given, made = _own(process.inputs), _own(process.outputs)
            parts = tuple(Part(label="", step=self.performed(r, given, made, trail)) for r in recipes)
            return Step(kind=Kind.CHOICE, text="one of the recipes", parts=parts)
        body = self._ontology.value(Property.COMPOSED_OF, process.name)
        return None if body is None else self._construct(process, self._constructs.scope(process), str(body), trail)

    def performed(
        self, process: Process, given: tuple[str, ...], made: tuple[str, ...], trail: tuple[str, ...]
    ) -> Step:
        """A process that is done as a step; with what it consists of where that is wanted."""
        grounding = self._snapshot.groundings.get(process.name)
        side = Side.NEITHER if grounding is None else Side.ROBOT if grounding.on_robot else Side.COMPUTE
        form = Form.PRIMITIVE if process.is_atomic else Form.COMPOSITE
        if self._ontology.is_a(process.name, Kind.SIMPLE_PROCESS):
            form = Form.TASK_TYPE
        shown = self._expand and process.name not in trail
        inside = self.inside(process, (*trail, process.name)) if shown else None
        return Step(
            kind=Kind.PERFORM,
            text=process.name,
            form=form,
            side=side,
            given=given,
            made=made,
            parts=() if inside is None else (Part(label="", step=inside),),
        )

    def _construct(self, process: Process, scope: Scope, entity: str, trail: tuple[str, ...]) -> Step:
        kind = self._constructs.construct_kind(entity)
        assert kind is not None, entity  # else it would not have compiled
        if kind is Kind.PERFORM:
            return self._perform(process, entity, trail)
        over = [p for p in process.parameters if p.entity in self._constructs.parts(entity, Property.OVER_PARAMETER)]
        within = scope.binding(entity) if over else scope

        def part(prop: Property, label: str = "") -> list[Part]:
            return [
                Part(label=label, step=self._construct(process, within, step, trail))
                for step in self._constructs.parts(entity, prop)
            ]

        if kind is Kind.IF_THEN_ELSE:
            parts = [*part(Property.THEN_STEP, "yes"), *part(Property.ELSE_STEP, "no")]
        elif kind in (Kind.SEQUENCE, Kind.PRIORITIZED):
            parts = [
                Part(
                    label=str(number) if kind is Kind.PRIORITIZED else "",
                    step=self._construct(process, within, step, trail),
                )
                for number, step in enumerate(self._constructs.in_order(entity), start=1)
            ]
        else:
            parts = part(Property.HAS_STEP)
        return Step(kind=kind, text=self._text(kind, process, within, entity, over), parts=tuple(parts))

    def _text(self, kind: Kind, process: Process, scope: Scope, entity: str, over: list[Parameter]) -> str:
        asked = self._ontology.value(Property.HAS_CONDITION, entity)
        condition = ""
        if asked is not None:
            condition = condition_text(self._constructs.condition(scope, str(asked)), variable_names(process))
        listed = ", ".join(map(typed, over))
        match kind:
            case Kind.FOR_EACH:
                return f"for each {listed} where {condition}"
            case Kind.PICK:
                return f"pick {listed}"
            case Kind.INTERRUPT:
                return f"whenever {condition}" + (f", for {listed}" if over else "")
            case Kind.AWAIT:
                return f"wait until {condition}"
            case Kind.LOOKAHEAD:
                return "planned to its end before it begins"
            case Kind.DEADLINE:
                seconds = self._ontology.value(Property.DEADLINE_S, entity)
                return f"ended within {float(str(seconds)):g} s of the request"
            case Kind.CHOICE:
                return "one of these"
            case Kind.ANY_ORDER:
                return "in any order"
            case Kind.PRIORITIZED:
                return "by priority"
            case Kind.ITERATE:
                return "once more?"
            case _:
                return condition

    def _perform(self, process: Process, entity: str, trail: tuple[str, ...]) -> Step:
        callee = self._snapshot.processes[self._constructs.part(entity, Property.PERFORMS)]
        names = {p.entity: p.name for p in process.parameters}
        sources: dict[str, str] = {}
        for binding in self._constructs.parts(entity, Property.HAS_BINDING):
            source = names.get(self._constructs.part(binding, Property.FROM_PARAMETER), "")
            for constant in (Property.HAS_VALUE, Property.FROM_INDIVIDUAL):
                value = self._ontology.value(constant, binding)
                source = source if value is None else condition_text(value)
            of_property = self._ontology.value(Property.OF_PROPERTY, binding)
            if of_property is not None:
                source = f"{of_property}({source})"
            sources[self._constructs.part(binding, Property.TO_PARAMETER)] = source

        def told(parameter: Parameter) -> str:
            source = sources.get(parameter.entity, parameter.name)
            arrow = "→" if parameter.role is Role.OUTPUT else "←"
            return parameter.name if source == parameter.name else f"{parameter.name} {arrow} {source}"

        return self.performed(callee, tuple(map(told, callee.inputs)), tuple(map(told, callee.outputs)), trail)


def _own(parameters: tuple[Parameter, ...]) -> tuple[str, ...]:
    return tuple(p.name for p in parameters)


# -------------------------------------------------------------------------------------------- text


def outline_text(drawn: Outline, *, data: bool = False) -> str:
    """An outline as indented lines.

    Args:
        data: Tell what steps take and give.
    """
    head = [drawn.signature, *(f"  {note}" for note in drawn.notes), ""]
    return "\n".join([*head, *_lines(drawn.step, "", data=data)])


def _lines(step: Step, label: str, *, data: bool) -> Iterator[str]:
    shown = f"{label}: " if label else ""
    if step.kind is Kind.SEQUENCE and not label:
        for part in step.parts:
            yield from _lines(part.step, part.label, data=data)
        return
    yield shown + _line(step, data=data)
    for part in step.parts:
        yield from (f"  {line}" for line in _lines(part.step, part.label, data=data))


def _line(step: Step, *, data: bool) -> str:
    match step.kind:
        case Kind.PERFORM:
            marks = [m for m in (step.side, "" if step.form is Form.PRIMITIVE else step.form) if m]
            told = step.text + (f" [{', '.join(marks)}]" if marks else "")
            flow = f" ({', '.join(step.given)})" + (f" → {', '.join(step.made)}" if step.made else "")
            return told + (flow if data and (step.given or step.made) else "")
        case Kind.SEQUENCE:
            return "one after the other"
        case Kind.SPLIT:
            return "at the same time, without waiting for them"
        case Kind.SPLIT_JOIN:
            return "at the same time"
        case Kind.PRIORITIZED:
            return "at the same time, by priority"
        case Kind.IF_THEN_ELSE:
            return f"if {step.text}"
        case Kind.REPEAT_WHILE:
            return f"while {step.text}"
        case Kind.REPEAT_UNTIL:
            return f"until {step.text}"
        case Kind.ITERATE:
            return "any number of times"
        case _:
            return step.text
