"""Checks a plan by its own reading of the program; shares no code with what makes plans.

The program is walked with the times of the plan's steps: a sequence's parts follow one another, the
parts of a concurrency run side by side, a pick has the individual that the plan chose, a for-each a
turn for every combination of individuals that satisfies its condition. Every step must be found so,
with the duration that the ontology gives it, on a robot that is capable and does nothing else then.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise, product

from kb.compiler import Program
from kb.ontology import Value
from kb.processes import Role
from kb.store import Snapshot
from kb.terms import Data, Fluent, Struct, Term, Var
from kb.vocabulary import Property
from planner.plan import Plan, PlannedStep, PlanStatus

_TOLERANCE_S = 1e-6
_ROUNDING_S = 2e-3
"""Each part of a duration is rounded to a millisecond."""
_HERE = "here"


def violations(
    plan: Plan,
    snapshot: Snapshot,
    program: Program,
    request: Term,
    *,
    key: str,
    robots: int,
    travel_times: Mapping[tuple[str, str, str], float],
    from_start: bool,
    under_way: frozenset[str] = frozenset(),
) -> list[str]:
    """What is wrong with a plan, one sentence each; empty if it is sound.

    Raises:
        CannotCheck: The program loops before anything is known of how often, or asks for what the plan changes.

    Args:
        request: The process with its arguments, as it was asked for.
        key: Name of the task: the frame of the request.
        robots: At most so many may take part.
        travel_times: Seconds by (robot, from, to).
        from_start: Whether nothing has been done yet; else the program is not walked, as part of it is done.
        under_way: Ids of the steps that had begun before the plan was made; part of their time has passed.
    """
    walk = _Walk(plan, snapshot, program)
    found = [*_robots(plan, walk, robots), *_durations(plan, snapshot, travel_times, under_way)]
    found += [
        f"{s.action} starts at {s.start_s:.3f} s, before the plan is made"
        for s in plan.steps
        if s.start_s < plan.made_at_s - _TOLERANCE_S
    ]
    end_s = max((s.end_s for s in plan.steps), default=plan.made_at_s)
    if abs(end_s - plan.made_at_s - plan.makespan_s) > _TOLERANCE_S:
        found.append(f"the makespan is {end_s - plan.made_at_s:.3f} s, not {plan.makespan_s:.3f} s")
    if plan.lower_bound_s > plan.makespan_s + _TOLERANCE_S:
        found.append(f"the lower bound {plan.lower_bound_s:.3f} s is above the makespan")
    if plan.status is PlanStatus.SOLVED_OPTIMALLY and plan.lower_bound_s < plan.makespan_s - _TOLERANCE_S:
        found.append(f"the lower bound {plan.lower_bound_s:.3f} s does not prove {plan.makespan_s:.3f} s the least")
    if from_start:
        walk.call(Struct("call", (key, "task", request)), plan.made_at_s)
        found += walk.violations
        found += [f"the program does not ask for {s.action}" for s in plan.steps if s.action.id not in walk.visited]
    return found


def _robots(plan: Plan, walk: _Walk, robots: int) -> Iterator[str]:
    by_robot: dict[str, list[PlannedStep]] = {}
    for step in plan.steps:
        if step.action.robot:
            by_robot.setdefault(step.action.robot, []).append(step)
    if len(by_robot) > robots:
        yield f"{len(by_robot)} robots take part; at most {robots} may"
    for robot, steps in by_robot.items():
        for one, next_one in pairwise(sorted(steps, key=lambda s: (s.start_s, s.end_s))):
            if next_one.start_s < one.end_s - _TOLERANCE_S:
                yield f"{robot} does {one.action} and {next_one.action} at once"
        for step in steps:
            yield from (
                f"{robot} does {step.action} but is no {lack}" for lack in walk.lacks(robot, step.action.process)
            )


def _durations(
    plan: Plan, snapshot: Snapshot, travel_times: Mapping[tuple[str, str, str], float], under_way: frozenset[str]
) -> Iterator[str]:
    at: dict[str, str] = {}
    for step in plan.steps:
        action, took_s = step.action, step.end_s - step.start_s
        seconds = snapshot.ontology.value(Property.DURATION_S, action.process)
        expected_s = float(seconds) if isinstance(seconds, int | float) else 0.0
        model = snapshot.ontology.value(Property.HAS_DURATION_MODEL, action.process)
        if model is not None:
            goal = str(action.argument(_parameter_name(snapshot, str(model), Property.TRAVEL_GOAL)))
            robot = str(action.argument(_parameter_name(snapshot, str(model), Property.TRAVELING_ROBOT)))
            expected_s += travel_times.get((robot, at.get(robot, _HERE), goal), float("nan"))
            at[robot] = goal
        least_s = 0.0 if action.id in under_way else expected_s
        if not least_s - _ROUNDING_S <= took_s <= expected_s + _ROUNDING_S:
            yield f"{action} takes {took_s:.3f} s, not {expected_s:.3f} s"


def _parameter_name(snapshot: Snapshot, model: str, prop: Property) -> str:
    entity = snapshot.ontology.value(prop, model)
    return str(snapshot.ontology.value(Property.PARAMETER_NAME, str(entity)))


class CannotCheck(Exception):
    """The program goes beyond what is checked here; the text says where."""


class _Walk:
    """One walk through the program along the plan."""

    def __init__(self, plan: Plan, snapshot: Snapshot, program: Program) -> None:
        self._steps = {step.action.id: step for step in plan.steps}
        self._choices = plan.choices
        self._snapshot = snapshot
        self._definitions = {}
        for definition in program.definitions:
            match definition:
                case Struct("proc", (Struct(name, parameters), body)):
                    self._definitions[name] = (parameters, body)
                case Struct("proc", (str(name), body)):
                    self._definitions[name] = ((), body)
                case _:
                    raise ValueError(f"no procedure: {definition}")
        self._changed = {change for name in {program.name, *self._definitions} for change in self._changes(name)}
        self.violations: list[str] = []
        self.visited: set[str] = set()

    def _changes(self, process: str) -> Iterator[tuple[str, str]]:
        """Property and class of subject of the effects of a process and of all that it performs."""
        ontology, todo = self._snapshot.ontology, [process]
        for name in todo:
            body = self._definitions.get(name, ((), []))[1]
            todo += [callee for callee in _calls(body) if callee not in todo]
            for effect in ontology.values(Property.HAS_EFFECT, name):
                subject = str(ontology.value(Property.SUBJECT_PARAMETER, str(effect)))
                prop = str(ontology.value(Property.OF_PROPERTY, str(effect)))
                yield prop, str(ontology.value(Property.PARAMETER_TYPE, subject))

    def lacks(self, robot: str, process: str) -> list[str]:
        """The capabilities that a process, or what it has its robot do, requires and a robot has not."""
        required = sorted(self._required(process))
        return [c for c in required if not self._snapshot.ontology.is_a(robot, c)]

    def _required(self, process: str) -> set[str]:
        own = {str(c) for c in self._snapshot.ontology.values(Property.REQUIRES_CAPABILITY, process)}
        robot = next((p for p in self._snapshot.processes[process].arguments if p.role is Role.ROBOT), None)
        if robot is None or process not in self._definitions:
            return own
        position = self._snapshot.processes[process].arguments.index(robot)
        parameters, body = self._definitions[process]
        return own.union(*(self._required(callee) for callee in _always_does(body, parameters[position])))

    def run(self, program: Term, binding: Mapping[str, Term], start_s: float) -> float:
        """The time when a program that starts at `start_s` is done."""
        match program:
            case list():
                for part in program:
                    start_s = self.run(part, binding, start_s)
                return start_s
            case Struct("conc", (list(parts),)):
                return max((self.run(part, binding, start_s) for part in parts), default=start_s)
            case Struct("choice", (frame, step, list(parts))):
                branch = self._choice(_id(frame, step, binding))
                return self.run(parts[branch - 1], binding, start_s) if isinstance(branch, int) else start_s
            case Struct("pick", (frame, step, Var(name), str(kind), body)):
                chosen = self._choice(_id(frame, step, binding))
                if not self._snapshot.ontology.is_a(str(chosen), kind):
                    self.violations.append(f"{chosen} is no {kind}")
                return self.run(body, {**binding, name: chosen}, start_s)
            case Struct("foreach", (frame, step, list(variables), condition, Var(inner), body)):
                return self._turns(frame, step, variables, condition, inner, body, binding, start_s)
            case Struct("if", (_, then, otherwise)):
                return self._either(then, otherwise, binding, start_s)
            case Struct("test"):
                return start_s
            case Struct("call"):
                return self.call(_bind(program, binding), start_s)
            case _:
                loop = program.functor if isinstance(program, Struct) else str(program)
                raise CannotCheck(f"it loops ({loop}), and how often only acting tells")

    def call(self, call: Term, start_s: float) -> float:
        """The time when a call is done."""
        assert isinstance(call, Struct)
        frame, step, head = call.args
        name, values = (head.functor, head.args) if isinstance(head, Struct) else (str(head), ())
        call_id = f"{frame}/{step}"
        planned = self._steps.get(call_id)
        if planned is not None:
            self.visited.add(call_id)
            if planned.start_s < start_s - _TOLERANCE_S:
                self.violations.append(f"{planned.action} starts at {planned.start_s:.3f} s, before {start_s:.3f} s")
            asked = tuple(_shown(value) for value in values)
            given = tuple(_told(argument.value) for argument in planned.action.arguments)
            if planned.action.process != name or asked != given:
                self.violations.append(f"the plan does {planned.action} where the program asks for {name}{asked}")
            return planned.end_s
        one_step = self._snapshot.ontology.value(Property.HAS_DURATION_MODEL, name) is not None
        if one_step or name not in self._definitions:
            self.violations.append(f"the plan lacks {name} ({call_id})")
            return start_s
        parameters, body = self._definitions[name]
        binding: dict[str, Term] = {"Frame": call_id}
        binding.update({p.name: value for p, value in zip(parameters, values, strict=True) if isinstance(p, Var)})
        end_s = self.run(body, binding, start_s)
        self._check_kept(call_id, name)
        return end_s

    def _check_kept(self, call_id: str, name: str) -> None:
        """A robot does nothing else between the steps of a process that keeps it."""
        if self._snapshot.ontology.value(Property.KEEPS_ROBOT, name) is not True:
            return
        own = [step for step in self._steps.values() if step.action.id.startswith(f"{call_id}/")]
        for other in self._steps.values():
            between = (
                own and own[0].start_s + _TOLERANCE_S < other.end_s and other.start_s < own[-1].end_s - _TOLERANCE_S
            )
            if between and other not in own and other.action.robot == own[0].action.robot:
                self.violations.append(f"{other.action} comes between the steps of {name}, which keeps its robot")

    def _either(self, then: Term, otherwise: Term, binding: Mapping[str, Term], start_s: float) -> float:
        """The branch that the plan's steps follow; effects are not followed here, so the condition is not asked."""
        so_far, visited = list(self.violations), set(self.visited)
        end_s = self.run(then, binding, start_s)
        if self.violations == so_far:
            return end_s
        self.violations, self.visited = so_far, visited
        return self.run(otherwise, binding, start_s)

    def _choice(self, choice_id: str) -> str | int:
        if choice_id not in self._choices:
            self.violations.append(f"the plan does not choose at {choice_id}")
        return self._choices.get(choice_id, "")

    def _turns(
        self,
        frame: Term,
        step: Term,
        variables: list[Term],
        condition: Term,
        inner: str,
        body: Term,
        binding: Mapping[str, Term],
        start_s: float,
    ) -> float:
        names = [v.args[0].name for v in variables if isinstance(v, Struct) and isinstance(v.args[0], Var)]
        kinds = [str(v.args[1]) for v in variables if isinstance(v, Struct)]
        turns = []
        for individuals in product(*(self._snapshot.ontology.individuals(kind) for kind in kinds)):
            turn: dict[str, Term] = {**binding, **dict(zip(names, individuals, strict=True))}
            if self._holds(condition, turn):
                turns.append((individuals, turn))
        ends = [start_s]
        for individuals, turn in turns:
            alone = sum(other[0] == individuals[0] for other, _ in turns) == 1
            turn[inner] = f"{_id(frame, step, binding)}/{individuals[0] if alone else '+'.join(individuals)}"
            ends.append(self.run(body, turn, start_s))
        return max(ends)

    def _holds(self, condition: Term, binding: Mapping[str, Term]) -> bool:
        match condition:
            case Struct("all", (list(parts),)):
                return all(self._holds(part, binding) for part in parts)
            case Struct("any", (list(parts),)):
                return any(self._holds(part, binding) for part in parts)
            case Struct("not", (part,)):
                return not self._holds(part, binding)
            case Struct("holds", (str(prop), subject, value)):
                subject_name, wanted = str(_bind(subject, binding)), _bind(value, binding)
                for changed, kind in self._changed:
                    if changed == prop and self._snapshot.ontology.is_a(subject_name, kind):
                        raise CannotCheck(
                            f"it asks for {prop}({subject_name}), which the plan itself may change before"
                        )
                told = self._snapshot.fluents.get((prop, subject_name))
                values: tuple[Value, ...] = (
                    self._snapshot.ontology.values(prop, subject_name) if told is None else (told,)
                )
                return wanted in values
            case _:
                raise CannotCheck("it decides on what only acting finds out")


def _calls(program: Term) -> Iterator[str]:
    """Every process that a program may do."""
    match program:
        case Struct("call", (_, _, Struct(callee) | str(callee))):
            yield callee
        case Struct(_, parts):
            yield from _calls(list(parts))
        case list():
            for part in program:
                yield from _calls(part)
        case _:
            return


def _always_does(program: Term, robot: Term) -> Iterator[str]:
    """The processes that a program has its robot do whatever is chosen or found out."""
    match program:
        case list():
            for part in program:
                yield from _always_does(part, robot)
        case Struct("conc" | "until", (part, *_)):
            yield from _always_does(part, robot)
        case Struct("call", (_, _, Struct(callee, arguments))) if robot in arguments:
            yield callee
        case _:
            return


def _id(frame: Term, step: Term, binding: Mapping[str, Term]) -> str:
    return f"{_bind(frame, binding)}/{step}"


def _bind(term: Term, binding: Mapping[str, Term]) -> Term:
    match term:
        case Var(name):
            return binding.get(name, term)
        case Struct(functor, args):
            return Struct(functor, tuple(_bind(a, binding) for a in args))
        case list():
            return [_bind(a, binding) for a in term]
        case _:
            return term


def _shown(value: Term) -> str:
    match value:
        case Struct("loc", (frame, name)):
            return f"{frame}/{name}"
        case Struct("fluent", (prop, subject)):
            return f"{prop}({subject})"
        case _:
            return str(value)


def _told(value: object) -> str:
    return value.place if isinstance(value, Data | Fluent) else str(value)
