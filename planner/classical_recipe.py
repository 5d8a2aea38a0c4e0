"""A plan for a goal, kept as a recipe: a composite process in the ontology.

What the goal names becomes an input, so that the recipe serves for other individuals too; what the plan
chose beside (robots, places) is left to be picked anew, as fast as may be, wherever the recipe is used.
At its end, the recipe awaits what the goal asks for, as far as conditions of the ontology can tell it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from kb.store import Snapshot
from kb.terms import Struct, Term
from kb.vocabulary import CORE, CORE_IRI, Kind, Property
from kb.writing import Entity, Sort, ontology_text
from planner.classical_goal import BadGoal, GoalPlan
from planner.classical_realizes import task_inputs

_NAME = re.compile(r"[A-Z][A-Za-z0-9_]*")


def as_owl(plan: GoalPlan, name: str, snapshot: Snapshot, *, kept_at_s: float = 0.0, realizes: str = "") -> str:
    """Write a plan as an ontology file with one composite process, which tells where it comes from.

    Args:
        plan: One with steps.
        name: Of the process, such as `FindBoth`; the file is to be saved as `tasks/find_both.owl`, say, and imported
            where it shall be known.
        kept_at_s: Time now, since the fleet was opened.
        realizes: The task type that it is a way to accomplish, such as `SeeDrink`, with the individuals that stand for
            its inputs where that is not plain: `SeeDrink(drink=drink_1)`.

    Returns:
        RDF/XML in UTF-8. Its ontology is named for the process and imports what defines the processes it performs.

    Raises:
        BadGoal: The plan has no steps, the name is no new name of a process, or it is no way to accomplish the task.
    """
    check_name(name, snapshot)
    if not plan.steps:
        raise BadGoal(plan.goal.text, f"there are no steps to keep as a recipe: {plan.reason}")
    return _Writer(plan, name, snapshot).text(kept_at_s, realizes)


def check_name(name: str, snapshot: Snapshot) -> None:
    """Check that a recipe may have this name.

    Raises:
        BadGoal: It is no name for a process, or that of something else.
    """
    if not _NAME.fullmatch(name):
        raise BadGoal(name, "is no name for a process; begin with a capital, then letters, digits and underscores")
    if name in snapshot.ontology.kinds or name in snapshot.processes:
        raise BadGoal(name, "is the name of something else already; choose another for the recipe")


def file_name(name: str) -> str:
    """Of the file that a recipe is to be saved in, which its ontology is named for: `find_both.owl` for `FindBoth`."""
    return f"{_snake(name)}.owl"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Thing:
    """An individual of the file: its class, what it is related to, its numbers and names."""

    name: str
    kind: str
    relations: tuple[tuple[str, str], ...] = ()
    values: tuple[tuple[str, str | int | float | bool], ...] = ()


class _Writer:
    def __init__(self, plan: GoalPlan, name: str, snapshot: Snapshot) -> None:
        self._plan, self._name, self._snapshot = plan, name, snapshot
        self._program: Term = plan.program or []
        graph = snapshot.ontology.graph
        self._iris = {str(s).rpartition("#")[2]: str(s) for s in graph.subjects() if "#" in str(s)}
        self._iri = f"{CORE_IRI.rpartition('/')[0]}/{file_name(name)}"
        self._kinds = self._parameters()
        self._names = {individual: _camel(individual) for individual in self._kinds}
        self._things: list[_Thing] = []

    def text(self, kept_at_s: float, realizes: str) -> str:
        """The file."""
        relations: list[tuple[str, str]] = []
        task = None
        if realizes:
            inputs = {i: kind for i, kind in self._kinds.items() if i in self._plan.goal.names}
            task, names = task_inputs(realizes, inputs, self._snapshot)
            self._names |= names
            relations.append((Property.REALIZES, task))
        body = self._until_reached(self._construct(self._program))
        picked = [i for i in self._kinds if i not in self._plan.goal.names]
        for individual in reversed(picked):
            thing = f"{self._name}_pick_{individual}"
            over = (Property.OVER_PARAMETER, self._parameter(individual))
            self._things.append(_Thing(name=thing, kind=Kind.PICK, relations=(over, (Property.BODY_STEP, body))))
            body = thing
        relations.append((Property.COMPOSED_OF, body))
        for number, (individual, kind) in enumerate(self._kinds.items(), start=1):
            role = "Local" if individual in picked else "Input"
            relations.append(
                (Property.HAS_LOCAL if role == "Local" else Property.HAS_INPUT, self._parameter(individual))
            )
            values = ((Property.PARAMETER_NAME, self._names[individual]), (Property.PARAMETER_NUMBER, 10 * number))
            relation = ((Property.PARAMETER_TYPE, kind),)
            self._things.append(_Thing(name=self._parameter(individual), kind=role, relations=relation, values=values))
        provenance: tuple[tuple[str, str | float], ...] = (
            (Property.FOUND_FOR_GOAL, self._plan.goal.text),
            (Property.FOUND_IN_KNOWLEDGE, self._snapshot.ontology.files.digest),
            (Property.FOUND_MAKESPAN_S, self._plan.makespan_ms / 1000),
            (Property.KEPT_AT_S, float(kept_at_s)),
        )
        kind = Kind.COMPOSITE_PROCESS
        process = _Thing(name=self._name, kind=kind, relations=tuple(relations), values=provenance)
        comment = f"Kept from a plan for the goal {self._plan.goal.text}."
        individuals = [self._individual(thing) for thing in [process, *self._things]]
        return ontology_text(self._iri, individuals, imports=self._imports(task), comments=[comment])

    def _parameters(self) -> dict[str, str]:
        """The class that each individual of the plan has to be of, by individual, in order of coming up."""
        kinds: dict[str, str] = {}
        for _, callee, arguments in calls(self._program):
            for parameter, argument in zip(self._snapshot.processes[callee].arguments, arguments, strict=True):
                if isinstance(argument, str):
                    kind = kinds.setdefault(argument, parameter.kind)
                    if kind in self._snapshot.ontology.superclasses.get(parameter.kind, ()):
                        kinds[argument] = parameter.kind
        return kinds

    def _parameter(self, individual: str) -> str:
        return f"{self._name}_{individual}"

    def _construct(self, program: Term) -> str:
        match program:
            case Struct("conc", (list(parts),)):
                return self._block(Kind.SPLIT_JOIN, parts)
            case list():
                return self._block(Kind.SEQUENCE, program)
            case Struct("call", (_, str(step), _)):
                self._perform(program)
                return f"{self._name}_{step}"
            case _:
                raise AssertionError(f"no part of a plan: {program!r}")

    def _block(self, kind: Kind, parts: list[Term]) -> str:
        number = sum(thing.kind in (Kind.SPLIT_JOIN, Kind.SEQUENCE) for thing in self._things) + 1
        name = f"{self._name}_block_{number}"
        place = len(self._things)
        self._things.append(_Thing(name=name, kind=kind))
        steps = [self._construct(part) for part in parts]
        self._things[place] = _Thing(name=name, kind=kind, relations=tuple((Property.HAS_STEP, s) for s in steps))
        if kind is Kind.SEQUENCE:
            self._number(steps)
        return name

    def _number(self, steps: list[str]) -> None:
        for place, thing in enumerate(self._things):
            if thing.name in steps:
                number = 10 * (steps.index(thing.name) + 1)
                self._things[place] = _Thing(
                    name=thing.name,
                    kind=thing.kind,
                    relations=thing.relations,
                    values=((Property.STEP_NUMBER, number),),
                )

    def _until_reached(self, body: str) -> str:
        """The body, and after it an Await of the goal, as far as that is about inputs of the recipe and no messages."""
        wishes = [w for n, c in enumerate(self._plan.goal.conditions, start=1) if (w := self._wish(c, f"wish_{n}"))]
        if not wishes:
            return body
        reached = wishes[0]
        if len(wishes) > 1:
            reached = f"{self._name}_reached"
            operands = tuple((Property.OPERAND, wish) for wish in wishes)
            self._things.append(_Thing(name=reached, kind=Kind.ALL_OF, relations=operands))
        end, whole = f"{self._name}_end", f"{self._name}_whole"
        self._things.append(_Thing(name=end, kind=Kind.AWAIT, relations=((Property.HAS_CONDITION, reached),)))
        steps = [body, end]
        self._things.append(
            _Thing(name=whole, kind=Kind.SEQUENCE, relations=tuple((Property.HAS_STEP, s) for s in steps))
        )
        self._number(steps)
        return whole

    def _wish(self, condition: Struct, name: str) -> str | None:
        """A condition of the goal as an individual; None if a recipe cannot ask for it."""
        own = f"{self._name}_{name}"
        match condition:
            case Struct("not", (Struct() as negated,)):
                operand = self._wish(negated, f"not_{name}")
                if operand is not None:
                    self._things.append(_Thing(name=own, kind=Kind.NOT, relations=((Property.OPERAND, operand),)))
                return own if operand else None
            case Struct("holds", (str(prop), str(subject), str() | int() | float() as value)):
                if subject not in self._kinds or (isinstance(value, str) and value not in self._kinds):
                    return None
                relations = [(Property.OF_PROPERTY, prop), (Property.SUBJECT_PARAMETER, self._parameter(subject))]
                values: tuple[tuple[str, int | float], ...] = ()
                if isinstance(value, str):
                    relations.append((Property.OBJECT_PARAMETER, self._parameter(value)))
                else:
                    values = ((Property.HAS_VALUE, value),)
                self._things.append(_Thing(name=own, kind=Kind.HOLDS, relations=tuple(relations), values=values))
                return own
            case _:
                raise AssertionError(f"no condition of a goal: {condition!r}")

    def _perform(self, call: Struct) -> None:
        [(step, callee, arguments)] = calls(call)
        name = f"{self._name}_{step}"
        relations = [(str(Property.PERFORMS), callee)]
        place = len(self._things)
        self._things.append(_Thing(name=name, kind=Kind.PERFORM))
        for parameter, argument in zip(self._snapshot.processes[callee].arguments, arguments, strict=True):
            if isinstance(argument, str):
                binding = f"{name}_{parameter.name}"
                ends = ((Property.TO_PARAMETER, parameter.entity), (Property.FROM_PARAMETER, self._parameter(argument)))
                relations.append((Property.HAS_BINDING, binding))
                self._things.append(_Thing(name=binding, kind="Binding", relations=ends))
        self._things[place] = _Thing(name=name, kind=Kind.PERFORM, relations=tuple(relations))

    def _imports(self, task: str | None) -> set[str]:
        used = (
            {callee for _, callee, _ in calls(self._program)} | set(self._kinds.values()) | ({task} if task else set())
        )
        return {self._about(name).partition("#")[0] for name in used}

    def _about(self, name: str) -> str:
        own = name == self._name or name.startswith(f"{self._name}_")
        return f"{self._iri}#{name}" if own else self._iris.get(name, CORE + name)

    def _individual(self, thing: _Thing) -> Entity:
        return Entity(
            iri=self._about(thing.name),
            sort=Sort.INDIVIDUAL,
            types=(CORE + thing.kind,),
            links=tuple((CORE + prop, self._about(to)) for prop, to in thing.relations),
            values=tuple((CORE + prop, value) for prop, value in thing.values),
        )


def calls(program: Term) -> Iterator[tuple[str, str, tuple[Term, ...]]]:
    """Step, process and arguments of all calls."""
    match program:
        case list():
            for part in program:
                yield from calls(part)
        case Struct("call", (_, str(step), Struct(callee, arguments))):
            yield step, callee, arguments
        case Struct("call", (_, str(step), str(callee))):
            yield step, callee, ()
        case Struct(_, parts):
            yield from calls(list(parts))
        case _:
            return


def _snake(name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def _camel(individual: str) -> str:
    first, *rest = re.split(r"[^A-Za-z0-9]+", individual)
    return first[:1].lower() + first[1:] + "".join(word.capitalize() for word in rest)
