"""Steps that OWL-S has and we need a service for: giving a value on, and answering a condition about data."""

from __future__ import annotations

from dataclasses import dataclass

from rdflib import URIRef

from kb.imports.draft import Draft
from kb.imports.names import local
from kb.imports.owls_conditions import Test
from kb.imports.owls_groundings import DURATION_S, ground
from kb.imports.owls_types import TRUTH, Slot
from kb.imports.report import Fate
from kb.imports.source import Source
from kb.vocabulary import CORE, Kind, Property
from kb.writing import Literal

_COPY = "/compute/copy"
_COMPARE = "/compute/compare"
_SHORT_S = 0.001
_KINDS = {"string": "Text", "bool": "TruthValue"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Service:
    """An atomic process that was added.

    Attributes:
        process: Its name.
        inputs: The names of its parameters, by what they are for: `value`, or the name of a parameter of the caller.
        output: The name of its output.
    """

    process: str
    inputs: dict[str, str]
    output: str


@dataclass(frozen=True, slots=True, kw_only=True)
class _Input:
    """A parameter to be made: what it is for, its name, the class of its values, and their ROS type."""

    purpose: str
    name: str
    kind: str
    message: str


class Services:
    """Makes such processes, each once."""

    def __init__(self, source: Source, draft: Draft) -> None:
        self._source, self._draft = source, draft
        self._copiers: dict[str, Service] = {}

    def copier(self, slot: Slot) -> Service:
        """What copies a value of the type of a parameter."""
        message = slot.type.message
        if message not in self._copiers:
            kind = _KINDS.get(message, "Number")
            value = _Input(purpose="value", name="value", kind=CORE + kind, message=message)
            wanted = f"Copy{kind}" if message != "int64" else "CopyInteger"
            self._copiers[message] = self._made(wanted, _COPY, [value], value, {})
        return self._copiers[message]

    def tester(self, test: Test, wanted: str) -> Service:
        """What answers a condition: a comparison of values, or a service that has to be offered."""
        if test.sides is None:
            return self._asked(test, wanted)
        left, comparison, right = test.sides
        constants: dict[str, Literal] = {"comparison": comparison}
        inputs = []
        for side, operand in (("left", left), ("right", right)):
            constants[f"{side}_key"] = local(operand.prop) if operand.prop else ""
            if operand.slot is None:
                constants[side] = str(operand.number)
            else:
                own = operand.slot
                inputs.append(_Input(purpose=own.name, name=side, kind=own.type.kind, message=own.type.message))
        truth = _Input(purpose="", name="result", kind=TRUTH.kind, message=TRUTH.message)
        told = f"the condition {test.says}, about data, became a step that asks {_COMPARE}"
        self._source.note(self._source.iri, Fate.CHANGED, told)
        return self._made(wanted, _COMPARE, inputs, truth, constants)

    def _made(
        self, wanted: str, service: str, inputs: list[_Input], output: _Input, constants: dict[str, Literal]
    ) -> Service:
        name, draft = self._draft.names.fresh(wanted), self._draft
        links, fields = [], []
        entities: dict[str, str] = {}
        result = ""
        for number, made in enumerate([*inputs, output], start=1):
            is_output = number > len(inputs)
            entity = self._parameter(name, "result" if is_output else made.name, made.kind, number, is_output=is_output)
            if is_output:
                result = entity
            else:
                entities[made.purpose] = entity
            links.append((Property.HAS_OUTPUT if is_output else Property.HAS_INPUT, entity))
            field = draft.names.fresh(f"{entity}_field")
            said: list[tuple[Property, Literal]] = [
                (Property.FIELD_NAME, "result" if is_output else made.name),
                (Property.MESSAGE_TYPE, made.message),
            ]
            draft.individual(field, Kind.FIELD, [(Property.MAPS_PARAMETER, entity)], said)
            fields.append((Property.HAS_REPLY_FIELD if is_output else Property.HAS_REQUEST_FIELD, field))
        for constant, value in sorted(constants.items()):
            field = draft.names.fresh(f"{name}_{constant}_field")
            said = [(Property.FIELD_NAME, constant), (Property.MESSAGE_TYPE, "string"), (Property.HAS_VALUE, value)]
            draft.individual(field, Kind.FIELD, [], said)
            fields.append((Property.HAS_REQUEST_FIELD, field))
        draft.individual(name, Kind.ATOMIC_PROCESS, links, [(Property.DURATION_S, _SHORT_S)])
        grounding = draft.names.fresh(f"{name}_Grounding")
        values: list[tuple[Property, Literal]] = [(Property.SERVICE_NAME, service), (Property.TIMEOUT_S, 1.0)]
        draft.individual(grounding, Kind.COMPUTE_GROUNDING, [(Property.GROUNDS, name), *fields], values)
        return Service(process=name, inputs=entities, output=result)

    def _asked(self, test: Test, wanted: str) -> Service:
        name = self._draft.names.fresh(wanted)
        service = f"/{local(self._draft.iri).removesuffix('.owl')}/{name}"
        slots = []
        for number, asked in enumerate(test.slots, start=1):
            entity = self._parameter(name, asked.parameter, asked.type.kind, number, is_output=False)
            slots.append(self._slot(entity, asked.parameter, "Input", asked))
        output = self._parameter(name, "holds", TRUTH.kind, len(slots) + 1, is_output=True)
        inputs = {asked.name: made.name for asked, made in zip(test.slots, slots, strict=True)}
        slots.append(Slot(source=URIRef(output), name=output, parameter="holds", role="Output", type=TRUTH))
        links = [(Property.HAS_OUTPUT if s.role == "Output" else Property.HAS_INPUT, s.name) for s in slots]
        comment = f"Asks a service whether {test.says}."
        self._draft.individual(
            name, Kind.ATOMIC_PROCESS, links, [(Property.DURATION_S, DURATION_S)], comments=[comment]
        )
        ground(self._draft, name, service, slots)
        told = (
            f"the condition {test.says} became a step that asks the compute service {service}; offer one of this name"
        )
        self._source.note(self._source.iri, Fate.CHANGED, told)
        return Service(process=name, inputs=inputs, output=output)

    def _slot(self, entity: str, parameter: str, role: str, of: Slot) -> Slot:
        return Slot(source=URIRef(entity), name=entity, parameter=parameter, role=role, type=of.type)

    def _parameter(self, process: str, name: str, kind: str, number: int, *, is_output: bool) -> str:
        entity = self._draft.names.fresh(f"{process}_{name}")
        values: list[tuple[Property, Literal]] = [
            (Property.PARAMETER_NAME, name),
            (Property.PARAMETER_NUMBER, 10 * number),
        ]
        return self._draft.individual(
            entity, "Output" if is_output else "Input", [(Property.PARAMETER_TYPE, kind)], values
        )
