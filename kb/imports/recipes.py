"""RoboEarth and early KnowRob recipes (classes) -> processes of ours (individuals).

Such a recipe is a class whose members have parts, `subAction some X`, with ordering constraints beside it
([RoboEarth] 3.4; Tenorth and Beetz, "KnowRob", IJRR 2013). Under an open world that says neither that these
are all the parts nor, always, in which order: what was taken for granted is in the report.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rdflib import OWL, RDF, RDFS, URIRef
from rdflib.term import Node

from kb.imports.draft import Draft
from kb.imports.knowrob import KNOWROB, Restriction, axioms, canonical, is_vocabulary
from kb.imports.names import local, parameter_name, snake
from kb.imports.ordering import arrange
from kb.imports.report import Fate, Imported, NotImportable, in_order
from kb.imports.source import Source, texts
from kb.vocabulary import CORE, CORE_IRI, Kind, Property
from kb.writing import Literal

DURATION_S = 10.0
"""Assumed of every action: recipes do not say how long one takes."""

TIMEOUT_S = 60.0

_PARTS = {"subAction", "subEvents"}
_ORDER = "orderingConstraints"
_INPUTS = {"objectActedOn": (CORE + Kind.PHYSICAL_OBJECT,), "toLocation": (), "fromLocation": ()}
"""Properties whose fillers become inputs, and what their classes are below."""


def import_recipes(path: Path, iri: str) -> Imported:
    """Read recipes.

    Args:
        path: The file.
        iri: Of the ontology to make.

    Raises:
        NotImportable: The file does not parse, or has no recipe in it.
    """
    source = Source(path, is_vocabulary=is_vocabulary, canonical=canonical)
    draft = Draft(iri)
    _Recipes(source, draft).write()
    source.tell_unread("there is no place for it in our model")
    return Imported(
        iri=iri,
        entities=tuple(draft.entities.values()),
        imports=(CORE_IRI,),
        comments=(f"Imported from the recipe file {path.name}, ontology <{source.iri}>.",),
        label=local(source.iri).removesuffix(".owl"),
        notes=in_order(source.notes),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Input:
    """An input of a process: the individual always meant, if there is one."""

    name: str
    parameter: str
    kind: str
    individual: str


@dataclass(frozen=True, slots=True, kw_only=True)
class _Part:
    """A step of a recipe: the class of actions, and what is said of it for this step. Either makes the process."""

    process: Node
    restrictions: tuple[Restriction, ...] = ()


class _Recipes:
    def __init__(self, source: Source, draft: Draft) -> None:
        self._source, self._draft = source, draft
        self._inputs: dict[_Part, list[_Input]] = {}
        kinds = [c for c in source.of_type(OWL.Class) if isinstance(c, URIRef)]
        self._axioms: dict[Node, tuple[list[Node], list[Restriction]]] = {c: axioms(source, c) for c in kinds}

    def write(self) -> None:
        """All recipes, and the actions that are their steps."""
        recipes = [k for k, (_, said) in self._axioms.items() if any(r.prop in _PARTS for r in said)]
        if not recipes:
            told = "has no recipe in it: no class with a restriction of subAction or subEvents"
            raise NotImportable(self._source.path, 0, told)
        for recipe in recipes:
            self._process(_Part(process=recipe))
        described = {part.process for part in self._inputs}
        actions = sum(part.process not in recipes for part in self._inputs)
        told = f"duration_s {DURATION_S:g}, timeout_s {TIMEOUT_S:g} and a robot's service for each of {actions} actions"
        self._source.note(self._source.iri, Fate.ASSUMED, f"{told}; correct them")
        for kind in self._axioms:
            if kind not in described and (kind, RDF.type, OWL.Class) in self._source.graph:
                told = "is neither a recipe nor a step of one; what it says of itself is not carried over"
                if any(self._axioms[kind]):
                    self._source.note(kind, Fate.LEFT_OUT, told)

    def _name(self, node: Node) -> str:
        return self._draft.names.of(str(node), local(str(node)))

    def _called(self, part: _Part) -> str:
        said = "".join(f" {r.prop} {r.filler}" for r in part.restrictions)
        return self._draft.names.of(f"{part.process}{said}", local(str(part.process)))

    def _process(self, part: _Part) -> list[_Input]:
        """Write the process that a class of actions becomes, once; its inputs but for the robot."""
        if part in self._inputs:
            return self._inputs[part]
        self._inputs[part] = []
        kind = part.process
        above, said = self._axioms.get(kind, ([], []))
        parts = [self._part(r) for r in said if r.prop in _PARTS]
        if kind not in self._axioms:
            self._source.note(kind, Fate.ASSUMED, "is described nowhere; it became an action without more")
        name = self._called(part)
        links = [(Property.HAS_INPUT, self._robot(name))]
        values: list[tuple[Property, Literal]] = []
        rest = [r for r in (*said, *part.restrictions) if r.prop not in _PARTS and r.prop != _ORDER]
        if parts:
            links.append((Property.COMPOSED_OF, self._body(part, name, parts, said)))
            self._tell_rest(kind, rest)
        else:
            self._inputs[part] = self._own_inputs(kind, name, rest)
            values.append((Property.DURATION_S, DURATION_S))
            self._ground(name, self._inputs[part])
        links += [(Property.HAS_INPUT, i.name) for i in self._inputs[part]]
        comments = [f"A kind of {local(str(a))}." for a in above if a != kind]
        comments += [*texts(self._source.values(kind, RDFS.comment)), f"Stands for <{kind}>."]
        labels = list(texts(self._source.values(kind, RDFS.label)))
        which = Kind.COMPOSITE_PROCESS if parts else Kind.ATOMIC_PROCESS
        self._draft.individual(name, which, links, values, comments=comments, label=labels[0] if labels else "")
        return self._inputs[part]

    def _part(self, restriction: Restriction) -> _Part:
        if isinstance(restriction.filler, URIRef):
            return _Part(process=restriction.filler)
        above, said = axioms(self._source, restriction.filler)
        return _Part(process=above[0] if above else restriction.filler, restrictions=tuple(said))

    def _robot(self, name: str) -> str:
        return self._parameter(f"{name}_robot", Kind.ROBOT_PARAMETER, "robot", CORE + Kind.ROBOT, 10)

    def _parameter(self, wanted: str, role: str, name: str, kind: str, number: int) -> str:
        values: list[tuple[Property, Literal]] = [(Property.PARAMETER_NAME, name), (Property.PARAMETER_NUMBER, number)]
        entity = self._draft.names.fresh(wanted)
        return self._draft.individual(entity, role, [(Property.PARAMETER_TYPE, kind)], values)

    # Actions

    def _own_inputs(self, kind: Node, name: str, said: list[Restriction]) -> list[_Input]:
        inputs: list[_Input] = []
        for r in said:
            if r.prop not in _INPUTS:
                told = f"{r.prop} {local(str(r.filler))}: what an action needs of a robot is said by requiresCapability"
                self._source.note(kind, Fate.LEFT_OUT, told)
                continue
            taken = {i.parameter for i in inputs}
            parameter = next(p for p in (r.prop, *(f"{r.prop}_{n}" for n in range(2, 1000))) if p not in taken)
            of, individual = self._class_of(kind, r)
            entity = self._parameter(f"{name}_{parameter}", "Input", parameter, of, 10 * (len(inputs) + 2))
            inputs.append(_Input(name=entity, parameter=parameter, kind=of, individual=individual))
        return inputs

    def _class_of(self, action: Node, r: Restriction) -> tuple[str, str]:
        """The class of an input, and the individual that it always is, if so."""
        if not r.is_value:
            return self._kind(r.filler, _INPUTS[r.prop]), ""
        kinds = [k for k in self._source.types(r.filler) if k != OWL.NamedIndividual]
        kind = kinds[0] if kinds else r.filler
        if not kinds:
            told = f"{r.prop} {local(str(r.filler))}, described nowhere, became an individual of a class of its own"
            self._source.note(action, Fate.ASSUMED, told)
        of = self._kind(kind, _INPUTS[r.prop], wanted="" if kinds else f"{local(str(r.filler))}_class")
        if r.prop != "objectActedOn":
            told = f"{local(str(r.filler))} has no pose; make it a Location with poseX_m, poseY_m and poseYaw_rad"
            self._source.note(r.filler, Fate.ASSUMED, f"{told} so that a robot can be sent there")
        label = local(str(r.filler))
        return of, self._draft.individual(self._name(r.filler), of, label=label)

    def _kind(self, node: Node, above: tuple[str, ...], wanted: str = "") -> str:
        name = self._draft.names.of(f"class {node}", wanted or local(str(node)))
        return self._draft.kind(name, above, comments=[f"Stands for <{node}>."])

    def _ground(self, name: str, inputs: list[_Input]) -> None:
        grounding = self._draft.names.fresh(f"{name}_Grounding")
        links = [(Property.GROUNDS, name)]
        for given in inputs:
            field = self._draft.names.fresh(f"{grounding}_{snake(given.parameter)}")
            said: list[tuple[Property, Literal]] = [
                (Property.FIELD_NAME, snake(given.parameter)),
                (Property.MESSAGE_TYPE, "string"),
            ]
            self._draft.individual(field, Kind.FIELD, [(Property.MAPS_PARAMETER, given.name)], said)
            links.append((Property.HAS_REQUEST_FIELD, field))
        values: list[tuple[Property, Literal]] = [
            (Property.SERVICE_NAME, f"/{{robot}}/{snake(name)}"),
            (Property.TIMEOUT_S, TIMEOUT_S),
        ]
        self._draft.individual(grounding, Kind.ROBOT_GROUNDING, links, values)

    def _tell_rest(self, recipe: Node, said: list[Restriction]) -> None:
        for r in said:
            told = f"{r.prop} {local(str(r.filler))}, said of the whole: its steps say what they act on"
            self._source.note(recipe, Fate.LEFT_OUT, told)

    # Recipes

    def _body(self, recipe: _Part, name: str, parts: list[_Part], said: list[Restriction]) -> str:
        given: dict[str, _Input] = {}
        steps: dict[_Part, str] = {}
        links: dict[str, list[tuple[Property, str]]] = {}
        for part in dict.fromkeys(parts):
            inputs = self._process(part)
            step = self._draft.names.fresh(f"{name}_{local(str(part.process))}")
            steps[part] = step
            links[step] = [(Property.PERFORMS, self._called(part))]
            links[step] += [
                (Property.HAS_BINDING, self._binding(step, i, self._lifted(recipe.process, name, given, i)))
                for i in inputs
            ]
        self._inputs[recipe] = list(given.values())
        layers = self._layers(recipe.process, steps, said)
        return self._write(name, layers, links)

    def _lifted(self, recipe: Node, name: str, given: dict[str, _Input], wanted: _Input) -> tuple[Property, str]:
        """What a step's input is bound to: an individual, or an input of the recipe for all things of that class."""
        if wanted.individual:
            return Property.FROM_INDIVIDUAL, wanted.individual
        if wanted.kind in given:
            told = f"its steps' inputs of the class {local(wanted.kind)} are taken to be the same one throughout"
            self._source.note(recipe, Fate.ASSUMED, f"{told}; where they are not, give it another parameter")
        else:
            taken = {i.parameter for i in given.values()} | {"robot"}
            plain = parameter_name(local(wanted.kind))
            parameter = next(p for p in (plain, *(f"{plain}_{n}" for n in range(2, 1000))) if p not in taken)
            entity = self._parameter(f"{name}_{parameter}", "Input", parameter, wanted.kind, 10 * (len(given) + 2))
            given[wanted.kind] = _Input(name=entity, parameter=parameter, kind=wanted.kind, individual="")
        return Property.FROM_PARAMETER, given[wanted.kind].name

    def _binding(self, step: str, to: _Input, given: tuple[Property, str]) -> str:
        name = self._draft.names.fresh(f"{step}_{to.parameter}")
        return self._draft.individual(name, "Binding", [(Property.TO_PARAMETER, to.name), given])

    def _layers(self, recipe: Node, steps: dict[_Part, str], said: list[Restriction]) -> list[list[str]]:
        """Steps in layers: those of one in any order, one layer after the other."""
        pairs = []
        for constraint in [r.filler for r in said if r.prop == _ORDER]:
            self._source.types(constraint)
            ends = [
                self._source.value(constraint, KNOWROB[p]) for p in ("occursBeforeInOrdering", "occursAfterInOrdering")
            ]
            if None in ends:
                self._source.note(constraint, Fate.LEFT_OUT, "an ordering constraint without both ends")
            else:
                pairs.append((ends[0], ends[1]))
        known = self._resolved(recipe, steps, [e for pair in pairs for e in pair if e is not None])
        before = {(s, t) for a, b in pairs for s in known.get(a, ()) for t in known.get(b, ())}
        if not pairs and len(steps) > 1:
            self._source.note(recipe, Fate.ASSUMED, f"gives no order of its {len(steps)} steps; any order will do")
        arranged = arrange(list(steps.values()), before)
        if arranged.cycle:
            told = f"its ordering constraints go round in a circle: {' before '.join(arranged.cycle)}; none is kept"
            self._source.note(recipe, Fate.LEFT_OUT, told)
        if arranged.added:
            told = f"its order is partial; also {', '.join(f'{a} before {b}' for a, b in arranged.added[:5])}"
            self._source.note(recipe, Fate.CHANGED, told)
        return arranged.layers

    def _resolved(self, recipe: Node, steps: dict[_Part, str], named: list[Node]) -> dict[Node | None, list[str]]:
        """The steps that each name in an ordering constraint means."""
        known: dict[Node | None, list[str]] = {}
        for part, step in steps.items():
            if part.process in named:
                known.setdefault(part.process, []).append(step)
        strange = [n for n in dict.fromkeys(named) if n not in known]
        unordered = [part for part in steps if part.process not in known]
        for node in strange:
            told = f"its ordering constraints speak of {local(str(node))}, which is no step of it"
            if len(strange) == len(unordered) == 1:
                meant = unordered[0]
                known[node] = [steps[meant]]
                told = f"{told}; it was taken for {local(str(meant.process))}, the only step without an order"
                self._source.note(recipe, Fate.GUESSED, told)
            else:
                self._source.note(recipe, Fate.LEFT_OUT, f"{told}; these constraints are not kept")
        return known

    def _write(self, name: str, layers: list[list[str]], links: dict[str, list[tuple[Property, str]]]) -> str:
        blocks = []
        number = len(layers) > 1
        for place, layer in enumerate(layers, start=1):
            values: list[tuple[Property, Literal]] = [(Property.STEP_NUMBER, 10 * place)] if number else []
            for step in layer:
                self._draft.individual(step, Kind.PERFORM, links[step], values if len(layer) == 1 else ())
            if len(layer) == 1:
                blocks.append(layer[0])
            else:
                block = self._draft.names.fresh(f"{name}_AnyOrder")
                self._draft.individual(block, Kind.ANY_ORDER, [(Property.HAS_STEP, s) for s in layer], values)
                blocks.append(block)
        if len(blocks) == 1:
            return blocks[0]
        whole = self._draft.names.fresh(f"{name}_Sequence")
        return self._draft.individual(whole, Kind.SEQUENCE, [(Property.HAS_STEP, b) for b in blocks])
