"""Goals: a plan for what shall be true, by the engines of unified-planning, as a program of ours.

The path of a goal:

    parse_goal   planner/classical_goal.py       text -> Goal, checked against the ontology
    offered      planner/classical_operators.py  processes -> operators
    World        planner/classical_ground.py     what is true, what can be reached at all, a lower bound
    Strips       planner/classical_strips.py     without time: pyperplan finds a plan, or proves that there is none
    Model        planner/classical_model.py      with time: aries finds a faster one
    solve        here                            either, followed step by step, costed anew, freed of needless order

The outcome is a Golog program: our own planner plans and conducts it like any other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product

from kb.processes import Role
from kb.store import Snapshot
from kb.terms import Struct, Term, Value, Var, struct
from planner.classical_engine import ARIES, PYPERPLAN, Answer, Engine
from planner.classical_goal import Goal, GoalPlan, GoalStep, parse_goal
from planner.classical_ground import POSITION, Ground, Literal, Subject, World, here
from planner.classical_model import Model
from planner.classical_operators import KNOWN, bound, expected_ms, offered
from planner.classical_strips import Strips
from planner.errors import InvalidPlan
from planner.network import NO_WAY, Travel
from planner.plan import PlanStatus

__all__ = ["Goal", "GoalPlan", "GoalStep", "parse_goal", "solve"]


def solve(goal: Goal, snapshot: Snapshot, travel: Travel, *, timeout_s: float = 20.0) -> GoalPlan:
    """Find a plan that reaches a goal from what is true now.

    Args:
        travel: With all locations among its places, for robots that do nothing now.
        timeout_s: Each engine is ended after so long.

    Raises:
        InvalidPlan: The plan of an engine does not reach the goal; our mistake.
    """
    world = World(snapshot, offered(snapshot), travel)
    times = world.earliest()
    wanted = next(world.cases(list(goal.conditions), {}), None)
    bound_ms = None if wanted is None else world.earliest_of(wanted, times)
    if wanted is None or bound_ms is None:
        return _no_plan(goal, PlanStatus.UNSOLVABLE_PROVEN, _out_of_reach(goal, world))
    if bound_ms == 0:
        return _plan(goal, world, (), 0, "no engine")
    strips = Strips(world, wanted, times)
    follower = _Follower(world, wanted)
    found: list[GoalPlan] = []
    with Engine(PYPERPLAN, strips.problem, timeout_s=timeout_s) as engine:
        for answer in engine.answers():
            if answer.unsolvable:
                reason = f"proven by {PYPERPLAN}: no sequence of {_offered(world)} leads there"
                return _no_plan(goal, PlanStatus.UNSOLVABLE_PROVEN, reason)
            if answer.actions is not None:
                grounds = [strips.steps[action.name] for action in answer.actions]
                done = follower.best(map(_key, grounds))
                found.append(_plan(goal, world, done, bound_ms, PYPERPLAN))
    if any(plan.makespan_ms == bound_ms for plan in found):
        return found[0]
    with Engine(ARIES, Model(world, goal, timed=True).problem, timeout_s=timeout_s) as engine:
        for answer in engine.answers():
            if answer.actions is not None:
                done = follower.best(_steps(answer, world))
                found.append(_plan(goal, world, done, bound_ms, ARIES))
                if found[-1].makespan_ms == bound_ms:
                    break
    if not found:
        reason = f"neither {PYPERPLAN} nor {ARIES} found a plan within {timeout_s:g} s"
        return _no_plan(goal, PlanStatus.UNSOLVABLE_INCOMPLETELY, reason)
    return min(found, key=lambda plan: plan.makespan_ms)


def adopt(steps: Sequence[Sequence[str]], goal: Goal, snapshot: Snapshot, travel: Travel, engine: str) -> GoalPlan:
    """Take over a plan from elsewhere, as it is.

    Args:
        steps: Process and individuals of each, as an action has them, in an order in which they can be done.
        engine: Who made it.

    Raises:
        InvalidPlan: It does not lead to the goal.
    """
    world = World(snapshot, offered(snapshot), travel)
    times = world.earliest()
    wanted = next(world.cases(list(goal.conditions), {}), None)
    bound_ms = None if wanted is None else world.earliest_of(wanted, times)
    if wanted is None or bound_ms is None:
        raise InvalidPlan([_out_of_reach(goal, world)])
    used = {operator.process: len(operator.used) for operator in world.offer.operators}
    plan = [(name, *objects[: used.get(name, 0)]) for name, *objects in steps]
    return _plan(goal, world, _Follower(world, wanted).exactly(plan), bound_ms, engine)


def _steps(answer: Answer, world: World) -> Iterator[tuple[str, ...]]:
    """Processes and their individuals; the objects after those are origins, profiles and slots."""
    used = {operator.process: len(operator.used) for operator in world.offer.operators}
    for action in answer.actions or ():
        yield (action.name, *action.objects[: used[action.name]])


# Following a plan

_MOST_TRIES = 10_000
"""Plans that are tried to make one faster: a number, not a time, so that the same plan becomes the same."""

_Cases = tuple[Ground, ...]
"""A step: the ground operators that differ only in the way in which its condition holds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Done:
    """A step as it turns out: what it read and wrote, and how long it takes."""

    ground: Ground
    robots: frozenset[str]
    claims: frozenset[str]
    duration_ms: int


class _Follower:
    """Follows plans through the world, step by step, to the goal."""

    def __init__(self, world: World, wanted: frozenset[Literal]) -> None:
        self._world, self._wanted = world, wanted
        cases: dict[tuple[str, ...], list[Ground]] = {}
        for ground in world.ground:
            cases.setdefault(_key(ground), []).append(ground)
        self._cases: dict[tuple[str, ...], _Cases] = {key: tuple(grounds) for key, grounds in cases.items()}

    def best(self, steps: Iterable[tuple[str, ...]]) -> tuple[_Done, ...]:
        """The plan without the steps that nothing needs, and with others where that makes it faster.

        Args:
            steps: Process and individuals, in order.

        Raises:
            InvalidPlan: It does not lead to the goal.
        """
        plan = [self._cases.get(step, ()) for step in steps]
        done = self._sound(plan)
        tries = _MOST_TRIES
        best_ms = _makespan(done)
        pending = True
        while pending and tries > 0:
            pending = False
            for neighbor in self._neighbors(plan):
                tries -= 1
                other, _ = self._follow(neighbor)
                if other is not None and (_makespan(other), len(neighbor)) < (best_ms, len(plan)):
                    plan, done, best_ms = neighbor, other, _makespan(other)
                    pending = True
                    break
                if tries == 0:
                    break
        return done

    def exactly(self, steps: Iterable[tuple[str, ...]]) -> tuple[_Done, ...]:
        """The plan as it is.

        Raises:
            InvalidPlan: It does not lead to the goal.
        """
        return self._sound([self._cases.get(step, ()) for step in steps])

    def _sound(self, plan: Sequence[_Cases]) -> tuple[_Done, ...]:
        done, why = self._follow(plan)
        if done is None:
            raise InvalidPlan([why])
        return done

    def _neighbors(self, plan: list[_Cases]) -> Iterator[list[_Cases]]:
        """A step less, a step elsewhere, another step in the place of one, or two steps with their robots exchanged."""
        for place in range(len(plan)):
            rest = plan[:place] + plan[place + 1 :]
            yield rest
            for elsewhere in range(len(plan)):
                if elsewhere != place:
                    yield [*rest[:elsewhere], plan[place], *rest[elsewhere:]]
            for cases in self._cases.values():
                yield [*plan[:place], cases, *plan[place + 1 :]]
        for (place, one), (other_place, other) in combinations(enumerate(plan), 2):
            for robot, other_robot in product(_robots(one[0]), _robots(other[0])):
                first = self._cases.get(_renamed(one[0], robot, other_robot))
                second = self._cases.get(_renamed(other[0], other_robot, robot))
                if robot != other_robot and first and second:
                    yield [*plan[:place], first, *plan[place + 1 : other_place], second, *plan[other_place + 1 :]]

    def _follow(self, plan: Sequence[_Cases]) -> tuple[tuple[_Done, ...] | None, str]:
        """What the steps come to; None, and why, if they do not lead to the goal."""
        world = self._world
        state: dict[Subject, Value] = {}

        def holds(literal: Literal) -> bool:
            (prop, subject, value), positive = literal
            if (prop, subject) in state:
                return (state[prop, subject] == value) is positive
            return world.holds((prop, subject, value)) is positive

        done: list[_Done] = []
        for cases in plan:
            ground = next((g for g in cases if all(map(holds, g.conditions))), None)
            if ground is None:
                return None, f"step {len(done) + 1} is not possible when it begins"
            duration_ms = ground.rest_ms
            for robot, place, odds in ground.travels:
                way_ms = world.travel_ms(robot, str(state.get((POSITION, robot), here(robot))), place)
                if way_ms == NO_WAY:
                    return None, f"in step {len(done) + 1}, {robot} cannot travel to {place}"
                duration_ms += expected_ms(way_ms, odds)
            state.update(ground.effects)
            done.append(
                _Done(
                    ground=ground,
                    robots=frozenset(_robots(ground)),
                    claims=frozenset(str(bound(c, ground.binding)) for c in ground.operator.claims),
                    duration_ms=duration_ms,
                )
            )
        missed = [
            f"{prop}({subject})"
            for (prop, subject, value), yes in self._wanted
            if not holds(((prop, subject, value), yes))
        ]
        return (None, f"{missed[0]} is not as the goal wants it at the end") if missed else (tuple(done), "")


def _key(ground: Ground) -> tuple[str, ...]:
    """Process and individuals."""
    return (ground.operator.process, *ground.binding.values())


def _renamed(ground: Ground, old: str, new: str) -> tuple[str, ...]:
    """The key of the step that has one individual in the place of another."""
    process, *individuals = _key(ground)
    return (process, *(new if individual == old else individual for individual in individuals))


def _robots(ground: Ground) -> list[str]:
    return [str(bound(robot, ground.binding)) for robot in ground.operator.robots]


def _must_follow(later: _Done, earlier: _Done) -> bool:
    """Whether two steps of a sequence must stay in order: they share a robot or a resource, or what changes."""

    def reads(step: _Done) -> set[Subject]:
        return {fact[:2] for fact, _ in step.ground.conditions}

    one, other = earlier.ground.effects, later.ground.effects
    clash = any(other[subject] != value for subject, value in one.items() if subject in other)
    return bool(
        earlier.robots & later.robots
        or earlier.claims & later.claims
        or reads(later) & one.keys()
        or reads(earlier) & other.keys()
        or clash
    )


# From the order that is needed to a program


def _before(done: Sequence[_Done]) -> list[set[int]]:
    """The steps, by number, that have to be done before each step."""
    before: list[set[int]] = []
    for later, step in enumerate(done):
        direct = [earlier for earlier in range(later) if _must_follow(step, done[earlier])]
        before.append(set(direct).union(*(before[earlier] for earlier in direct)))
    return before


def _makespan(done: Sequence[_Done]) -> int:
    structure = _structure(list(range(len(done))), _before(done))
    return _start(structure, 0, [step.duration_ms for step in done], {})


def _plan(goal: Goal, world: World, done: Sequence[_Done], bound_ms: int, engine: str) -> GoalPlan:
    calls = [_call(number, step, world) for number, step in enumerate(done, start=1)]
    structure = _structure(list(range(len(done))), _before(done))
    starts: dict[int, int] = {}
    makespan_ms = _start(structure, 0, [step.duration_ms for step in done], starts)
    steps = []
    for number, step in enumerate(done):
        _, name, head = calls[number].args
        steps.append(
            GoalStep(
                name=str(name),
                operator=step.ground.operator,
                binding=step.ground.binding,
                head=head,
                robots=tuple(sorted(step.robots)),
                start_ms=starts[number],
                end_ms=starts[number] + step.duration_ms,
            )
        )
    optimal = makespan_ms == bound_ms
    return GoalPlan(
        goal=goal,
        status=PlanStatus.SOLVED_OPTIMALLY if optimal else PlanStatus.SOLVED_SATISFICING,
        makespan_ms=makespan_ms,
        bound_ms=bound_ms,
        steps=tuple(sorted(steps, key=lambda s: (s.start_ms, s.name))),
        program=_program(structure, calls),
        engine=engine,
        reason=_reason(makespan_ms, bound_ms, engine),
    )


_Tree = int | tuple[str, list["_Tree"]]
"""A step by number, or `sequence` or `conc` of trees."""


def _structure(numbers: list[int], before: Sequence[set[int]]) -> _Tree:
    """An order as a program: what is unrelated side by side, what comes before all else first.

    Not every order can be written in this way; then those steps come first that wait for nothing, and all others
    wait for all of them. That is an execution too, if not always the fastest.
    """
    if len(numbers) == 1:
        return numbers[0]
    groups = _groups(numbers, lambda a, b: a in before[b] or b in before[a])
    if len(groups) != 1:
        return ("conc", [_structure(group, before) for group in groups])
    groups = _groups(numbers, lambda a, b: not (a in before[b] or b in before[a]))
    if len(groups) == 1:
        first = [n for n in numbers if not before[n] & set(numbers)]
        groups = [first, [n for n in numbers if n not in first]]
    groups.sort(key=lambda group: len(before[group[0]] & set(numbers)))
    return ("sequence", [_structure(group, before) for group in groups])


def _groups(numbers: list[int], tied: Callable[[int, int], bool]) -> list[list[int]]:
    """Connected components, each in order."""
    groups: list[list[int]] = []
    for number in numbers:
        own = [group for group in groups if any(tied(other, number) for other in group)]
        groups = [group for group in groups if group not in own]
        groups.append(sorted([*(n for group in own for n in group), number]))
    return sorted(groups)


def _start(tree: _Tree, start_ms: int, durations: Sequence[int], starts: dict[int, int]) -> int:
    """Set when each step starts at the earliest; when the tree ends."""
    match tree:
        case int():
            starts[tree] = start_ms
            return start_ms + durations[tree]
        case ("sequence", parts):
            for part in parts:
                start_ms = _start(part, start_ms, durations, starts)
            return start_ms
        case (_, parts):
            return max((_start(part, start_ms, durations, starts) for part in parts), default=start_ms)


def _program(tree: _Tree, calls: Sequence[Struct]) -> Term:
    match tree:
        case int():
            return calls[tree]
        case ("sequence", parts):
            return [_program(part, calls) for part in parts]
        case (_, parts):
            return struct("conc", [_program(part, calls) for part in parts]) if parts else []


def _call(number: int, step: _Done, world: World) -> Struct:
    operator, snapshot = step.ground.operator, world.snapshot
    name = f"goal_{number}"
    binding: dict[str, Term] = dict(step.ground.binding)
    for variable, kind in operator.kinds.items():
        if variable not in binding:
            binding[variable] = _any(kind, step.ground.binding.values(), snapshot)
    arguments = [
        struct("loc", Var("Frame"), f"{name}_{parameter.name}")
        if parameter.is_datum or parameter.role is Role.OUTPUT
        else bound(argument, binding)
        for parameter, argument in zip(snapshot.processes[operator.process].arguments, operator.arguments, strict=True)
    ]
    head = Struct(operator.process, tuple(arguments)) if arguments else operator.process
    return struct("call", Var("Frame"), name, head)


def _any(kind: str, others: Iterable[str], snapshot: Snapshot) -> str:
    """An individual where nothing depends on it: one that is said of another argument (its area, say), if any is."""
    right = snapshot.ontology.individuals(kind)
    others = set(others)
    said = [v for _, subject, v in snapshot.ontology.all_values() if subject in others and v in right]
    return str(min(said, default=right[0]))


# Reasons


def _no_plan(goal: Goal, status: PlanStatus, reason: str) -> GoalPlan:
    return GoalPlan(
        goal=goal, status=status, makespan_ms=0, bound_ms=0, steps=(), program=None, engine="no engine", reason=reason
    )


def _reason(makespan_ms: int, bound_ms: int, engine: str) -> str:
    if makespan_ms == 0:
        return "the goal holds already"
    if makespan_ms == bound_ms:
        return f"makespan {makespan_ms / 1000:.3f} s is the least: some part of the goal takes as long ({engine})"
    return (
        f"makespan {makespan_ms / 1000:.3f} s; no plan takes less than {bound_ms / 1000:.3f} s, "
        f"as far as is known ({engine})"
    )


def _offered(world: World) -> str:
    return ", ".join(operator.process for operator in world.offer.operators) or "no process"


def _out_of_reach(goal: Goal, world: World) -> str:
    """Why a goal is not reached even if nothing were ever undone."""
    times = world.earliest()
    for condition in goal.conditions:
        case = next(world.cases(condition, {}), None)
        if case is not None and world.earliest_of(case, times) is not None:
            continue
        holds = condition.args[0] if condition.functor == "not" else condition
        assert isinstance(holds, Struct)
        prop, subject, value = map(str, holds.args)
        shown = f"{prop}({subject})"
        setting = [o.process for o in world.offer.operators if any(e.prop == prop for e in o.effects)]
        reaching = [g for g in world.ground if (prop, subject) in g.effects]
        wish = "known" if value == KNOWN else f"{'other than ' if condition.functor == 'not' else ''}{value}"
        if not setting:
            return f"no process that can be planned with sets {prop}, so {shown} cannot become {wish}"
        if not reaching:
            return f"{' and '.join(setting)} set {prop}, but not of {subject}: {shown} cannot become {wish}"
        if (
            value != KNOWN
            and condition.functor != "not"
            and not any(str(g.effects[prop, subject]) == value for g in reaching)
        ):
            return f"{' and '.join(setting)} never set {shown} to {value}"
        return f"{shown} cannot become {wish}: {' and '.join(setting)} cannot begin for that, or cannot get there"
    return "its parts contradict what never changes"
