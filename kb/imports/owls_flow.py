"""Where the values of an OWL-S process come from: its bindings, read once.

OWL-S binds an input of a step to an output of another step; we hand values on through parameters of the
composite process: its own inputs and outputs, and locals that are added here.
"""

from __future__ import annotations

from dataclasses import dataclass

from rdflib import Literal
from rdflib.term import Node

from kb.imports.owls_terms import PROCESS
from kb.imports.report import Fate
from kb.imports.source import Source

_FORMS = (PROCESS.valueFunction, PROCESS.valueSpecifier, PROCESS.valueForm, PROCESS.valueType)


@dataclass(frozen=True, slots=True, kw_only=True)
class Origin:
    """What a binding gives: a parameter of the process itself or of a step, a literal, or an individual.

    Attributes:
        step: The step whose output it is; None for a parameter of the process itself.
    """

    parameter: Node | None = None
    step: Node | None = None
    literal: Literal | None = None
    individual: Node | None = None


def bindings_of(source: Source, owner: Node, *properties: Node) -> list[tuple[Node, Origin]]:
    """The bindings of a step, result or Produce: what gets a value, and from where."""
    found: dict[Node, Origin] = {}
    for binding in source.values(owner, *properties):  # type: ignore[arg-type]
        for kind in ("InputBinding", "OutputBinding", "LocBinding", "LinkBinding", "Binding"):
            source.is_a(binding, PROCESS[kind])
        to = source.value(binding, PROCESS.toVar, PROCESS.toParam)
        origin = _origin(source, binding)
        if to is None:
            source.note(owner, Fate.LEFT_OUT, "a binding does not say what it gives a value")
        elif origin is None:
            source.note(to, Fate.LEFT_OUT, "its binding computes a value (valueFunction, valueForm): not supported")
        elif found.setdefault(to, origin) != origin:
            source.note(to, Fate.LEFT_OUT, "is bound twice; only the first binding is kept")
    return list(found.items())


def _origin(source: Source, binding: Node) -> Origin | None:
    source.values(binding, *_FORMS)
    data = source.value(binding, PROCESS.valueData)
    if isinstance(data, Literal):
        return Origin(literal=data)
    individual = source.value(binding, PROCESS.valueObject)
    if individual is not None:
        return Origin(individual=individual)
    of = source.value(binding, PROCESS.valueSource)
    if of is None:
        return None
    source.is_a(of, PROCESS.ValueOf)
    parameter, step = source.value(of, PROCESS.theVar, PROCESS.theParam), source.value(of, PROCESS.fromProcess)
    if parameter is None:
        return None
    return Origin(parameter=parameter, step=None if step == PROCESS.ThisPerform else step)
