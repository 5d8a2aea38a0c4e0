"""A task as a hierarchical problem: what it may come to, as tasks and methods.

Every part of the program becomes a task, with a method for each way to do it. What is known when the
task is asked for (its arguments, what never changes) is put in; what is picked becomes a variable of
the method. Processes that the planner may take as one step are the actions.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping, Sequence
from itertools import permutations, product

from unified_planning.model import Action, FNode, Parameter, Problem
from unified_planning.model.htn import HierarchicalProblem, Method, Subtask, Task

from kb.errors import ConcertmasterError
from kb.store import Snapshot
from kb.terms import Struct, Term, Var, struct
from planner.classical_ground import World
from planner.classical_model import Model
from planner.classical_operators import Facts, Operator, Unwritten, bound, offered, variables, written_out
from planner.network import Travel

_MOST_ORDERS = 4
"""Parts of an any-order that are written out in every order."""


class CannotExport(ConcertmasterError):
    """A language cannot say what it is asked to."""

    fault = "request"


def task_problem(
    process: str,
    arguments: Mapping[str, str],
    snapshot: Snapshot,
    travel: Travel,
    *,
    timed: bool = True,
    relational: bool = False,
) -> HierarchicalProblem:
    """A task as a hierarchical problem of unified-planning, durations in milliseconds.

    Args:
        process: The process that accomplishes the task.
        arguments: Individuals by the names of its inputs.
        timed: With durations; up-aries plans so, HDDL has none.
        relational: With truth values alone for what changes, as HDDL has it.

    Raises:
        CannotExport: The program has constructs that tasks and methods cannot express.
    """
    return _Translation(snapshot, travel, timed=timed, relational=relational).problem(process, arguments)


class _Translation:
    def __init__(self, snapshot: Snapshot, travel: Travel, *, timed: bool, relational: bool) -> None:
        self._snapshot = snapshot
        self._facts = Facts(snapshot)
        offer = offered(snapshot, parts=True)
        self._operators = {operator.process: operator for operator in offer.operators}
        self._world = World(snapshot, offer, travel)
        self._model = Model(self._world, None, timed=timed, relational=relational, hierarchical=True)
        problem: Problem = self._model.problem
        assert isinstance(problem, HierarchicalProblem)
        self._problem = problem
        self._numbers: dict[str, int] = {}

    def problem(self, process: str, arguments: Mapping[str, str]) -> HierarchicalProblem:
        signature = self._snapshot.processes[process]
        head = tuple(
            arguments[p.name] if p.name in arguments else struct("loc", "task", p.name) for p in signature.arguments
        )
        task = self._part(struct("call", "task", "task", Struct(process, head) if head else process), {}, process)
        self._problem.task_network.add_subtask(self._subtask(task))
        self._model.fill()
        return self._problem

    def _part(self, program: Term, kinds: Mapping[str, str], name: str) -> Task:
        """A part of a program as a task; its variables, with their classes, are what is picked around it."""
        task = self._task(program, kinds, name)
        match program:
            case list():
                self._method(task, program, ordered=True, kinds=kinds)
            case Struct("conc", (list(parts),)):
                self._method(task, parts, ordered=False, kinds=kinds)
            case Struct("choice", (_, _, list(branches))):
                for branch in branches:
                    self._method(task, [branch], kinds=kinds)
            case Struct("any_order", (_, _, list(parts))):
                if len(parts) > _MOST_ORDERS:
                    raise CannotExport(f"{name}: {len(parts)} parts in any order are too many to write out")
                for order in permutations(parts):
                    self._method(task, list(order), ordered=True, kinds=kinds)
            case Struct("pick", (_, _, Var(variable), str(kind), body)):
                fresh = self._fresh(variable)
                self._method(task, [bound(body, {variable: Var(fresh)})], kinds={**kinds, fresh: kind})
            case Struct("foreach", (_, _, list(over), condition, _, body)):
                self._method(task, self._turns(over, condition, body, name), ordered=False, kinds=kinds)
            case Struct("if", (condition, then, otherwise)):
                self._method(task, [then], kinds=kinds, condition=condition)
                self._method(task, [otherwise], kinds=kinds, condition=struct("not", condition))
            case Struct("test", (condition,)):
                self._method(task, [], kinds=kinds, condition=condition)
            case Struct("star", (_, _, body)):
                self._method(task, [], kinds=kinds)
                self._method(task, [body], kinds=kinds, then=task)
            case Struct("while", (condition, body)):
                self._method(task, [], kinds=kinds, condition=struct("not", condition))
                self._method(task, [body], kinds=kinds, condition=condition, then=task)
            case Struct("until", (body, condition)):
                loop = struct("while", struct("not", condition), body)
                self._method(task, [body, loop], ordered=True, kinds=kinds)
            case Struct("search", (body,)):
                self._method(task, [body], kinds=kinds)
            case Struct("call", (_, _, head)):
                self._call(task, head, kinds)
            case Struct(construct, _):
                raise CannotExport(f"{name} has {construct}(...), which tasks and methods cannot express")
            case _:
                raise AssertionError(f"no program: {program!r}")
        return task

    def _call(self, task: Task, head: Term, kinds: Mapping[str, str]) -> None:
        name, arguments = (head.functor, head.args) if isinstance(head, Struct) else (str(head), ())
        operator = self._operators.get(name)
        if operator is not None:
            self._action(task, operator, arguments, kinds)
            return
        definitions = self._facts.of("definition", name, arguments)
        if not definitions:
            raise CannotExport(f"{name} can be no action: {self._world.offer.refused[name]}")
        if self._facts.of("recursive", name):
            raise CannotExport(f"{name} performs itself, of which every turn would have to be written out")
        if self._facts.of("keeps_robot", name):
            raise CannotExport(f"{name} keeps its robot while it takes several steps, which actions cannot express")
        condition: Term = [c for (c,) in self._facts.of("precondition", name, arguments)]
        self._method(task, [definitions[0][1]], kinds=kinds, condition=condition)

    def _action(self, task: Task, operator: Operator, arguments: Sequence[Term], kinds: Mapping[str, str]) -> None:
        given = {
            parameter.name: argument
            for parameter, argument in zip(operator.arguments, arguments, strict=True)
            if isinstance(parameter, Var)
        }
        action = self._problem.action(operator.process)
        known = [name for name in operator.used if name in given]
        hidden = {parameter.name: parameter.type for parameter in action.parameters if parameter.name not in known}
        method = Method(self._named(task.name), _env=self._problem.environment, **self._signature(task), **hidden)
        own = {p.name: p for p in method.parameters}
        method.set_task(task, *(own[p.name] for p in task.parameters))
        values: list[FNode | Parameter] = [
            self._value(given[p.name], own) if p.name in known else own[p.name] for p in action.parameters
        ]
        method.add_subtask(self._subtask(action, *values))
        self._problem.add_method(method)

    def _method(
        self,
        task: Task,
        parts: Sequence[Term],
        *,
        kinds: Mapping[str, str],
        ordered: bool = False,
        condition: Term | None = None,
        then: Task | None = None,
    ) -> None:
        """A way to do a task: all parts, and `then`, which has the same variables, after them."""
        subtasks = [self._part(part, kinds, task.name) for part in parts]
        asked = [] if condition is None else [self._written_out(condition, task.name)]
        names = {p.name for p in task.parameters}.union(*({p.name for p in s.parameters} for s in subtasks))
        types = {name: self._model.parameter_type(kinds[name])[0] for name in sorted(names | variables(asked))}
        method = Method(self._named(task.name), _env=self._problem.environment, **types)
        own = {p.name: p for p in method.parameters}
        method.set_task(task, *(own[p.name] for p in task.parameters))
        for fnode in self._model.kind_conditions({name: kinds[name] for name in types}, own):
            method.add_precondition(fnode)
        for term in asked:
            method.add_precondition(self._model.condition(term, own))
        after = [] if then is None else [then]
        done = [method.add_subtask(self._subtask(s, *(own[p.name] for p in s.parameters))) for s in [*subtasks, *after]]
        if (ordered or after) and len(done) > 1:
            method.set_ordered(*done)
        self._problem.add_method(method)

    def _turns(self, over: list[Term], condition: Term, body: Term, name: str) -> list[Term]:
        names = [str(v.args[0].name) for v in over if isinstance(v, Struct) and isinstance(v.args[0], Var)]
        kinds = [str(v.args[1]) for v in over if isinstance(v, Struct)]
        condition = self._written_out(condition, name)
        turns = []
        for individuals in product(*(self._snapshot.ontology.individuals(kind) for kind in kinds)):
            binding: dict[str, Term] = dict(zip(names, individuals, strict=True))
            turn = bound(condition, binding)
            if variables(turn):
                raise CannotExport(f"{name} goes over individuals that depend on what is picked around it")
            cases = list(self._world.cases(turn, {}))
            if any(cases):
                raise CannotExport(f"{name} goes over individuals that depend on what the task itself may change")
            if cases:
                turns.append(bound(body, binding))
        return turns

    def _written_out(self, condition: Term, name: str) -> Term:
        self._refuse_sensing(condition, name)
        try:
            return written_out(condition, self._snapshot.ontology)
        except Unwritten as unwritten:
            raise CannotExport(f"{name} cannot be exported: {unwritten}") from unwritten

    def _refuse_sensing(self, condition: Term, name: str) -> None:
        match condition:
            case Struct("is_true" | "loc" | "fluent", _):
                raise CannotExport(f"{name} decides on what only acting finds out")
            case Struct(_, parts):
                self._refuse_sensing(list(parts), name)
            case list():
                for part in condition:
                    self._refuse_sensing(part, name)
            case _:
                return

    def _task(self, program: Term, kinds: Mapping[str, str], name: str) -> Task:
        signature = {v: self._model.parameter_type(kinds[v])[0] for v in sorted(variables(program)) if v in kinds}
        task = Task(self._named(name), OrderedDict(signature), self._problem.environment)
        self._problem.add_task(task)
        return task

    def _subtask(self, task: Task | Action, *values: FNode | Parameter) -> Subtask:
        return Subtask(task, *values, ident=self._named("step"), _env=self._problem.environment)

    def _signature(self, task: Task) -> dict[str, object]:
        return {p.name: p.type for p in task.parameters}

    def _value(self, term: Term, own: Mapping[str, Parameter]) -> FNode | Parameter:
        return own[term.name] if isinstance(term, Var) else self._model.individual(str(term))

    def _named(self, name: str) -> str:
        stem = name.partition("__")[0]
        self._numbers[stem] = self._numbers.get(stem, 0) + 1
        return f"{stem}__{self._numbers[stem]}"

    def _fresh(self, variable: str) -> str:
        return self._named(variable)
