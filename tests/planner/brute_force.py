"""Small random programs, and the least makespan of each by trying every execution.

A program is made twice: as the term that the planner reads, and as a tree of tasks for `least`. They
share no code with the planner: `least` lists every choice, and for each, every order in which tasks can
be appended to the robots' schedules, each as early as can be. What is done at once needs nothing that
others need, and of equal starts any order will do, so that one of the orders gives the best schedule.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import permutations, product
from math import floor
from typing import TypeAlias

import numpy as np

from kb.store import Snapshot
from kb.terms import Struct, Term, Var, struct
from tests.planner.yard import Job, Yard

ROBOTS = ("anna", "bert", "carl")
PLACES = ("p1", "p2", "p3")
CAPACITY = {"door": 1, "lot": 2}
POWER_W = 2.0
TRAVELS = ("Go", "Seek", "Carry")
FIXED_MS = {"Go": 5, "Seek": 3, "Carry": 9, "Think": 7, "Look": 10, "Lift": 20, "Mark": 30, "Pass": 12, "Try": 11}
"""What a process takes, besides the travel."""
ODDS = {"Seek": 0.7, "Try": 0.8}
LARGEST = 5
"""So many steps and composite processes has a program, whatever is chosen."""
CAPABLE = ("Lift", "Carry")
"""What needs a lifter, or two."""

_FRAME = Var("Frame")


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """The robots, how long they travel, who can lift, how much energy who has, how many may take part."""

    robots: tuple[str, ...]
    lifters: frozenset[str]
    limit: int
    travel_ms: Mapping[tuple[str, str, str], int]
    drinks: Mapping[str, str]
    energy_J: Mapping[str, float]  # noqa: N815 - as the ontology has it
    learned: Mapping[tuple[str, str, str], tuple[int, float]] = field(default_factory=dict)
    """How long a try takes, and its odds: of a process and a robot, at a place or everywhere ("")."""

    def job(self, base: Snapshot, body: Term) -> Job:
        """A request for the process `Main` with this body."""
        yard = Yard(base)
        for robot in self.robots:
            energy = {"energy_J": self.energy_J[robot], "power_W": POWER_W} if robot in self.energy_J else {}
            yard.add(robot, "Robot", *(["Lifter"] if robot in self.lifters else []), **energy)
        for place in PLACES:
            yard.add(place, "Place")
        for drink, place in self.drinks.items():
            yard.add(drink, "Drink", standsAt=place)
        yard.add("door", "Door")
        yard.add("lot", "Lot", capacity=CAPACITY["lot"])
        _add_processes(yard)
        for (process, robot, place), (ms, odds) in self.learned.items():
            yard.learned(process, robot, place, duration_s=ms / 1000, odds=odds)
        yard.process("Main", body=body)
        seconds = {way: ms / 1000 for way, ms in self.travel_ms.items()}
        return Job(yard=yard, robots=self.limit, times=seconds)


def _add_processes(yard: Yard) -> None:
    def atomic(name: str, *parameters: str, claims: tuple[str, ...] = (), marks: bool = False) -> None:
        travels = name in TRAVELS
        yard.process(
            name,
            *parameters,
            duration_s=FIXED_MS[name] / 1000,
            to="place" if travels else "",
            claims=claims,
            odds=ODDS.get(name),
            requires="Lifter" if name in CAPABLE else "",
            effects=[("locatedAt", r, "place") for r in parameters if travels and r.startswith("robot")]
            + ([("marked", "place", True)] if marks else []),
        )
        if travels:
            yard.definitions.append(struct("proc", Struct(name, tuple(Var(p.capitalize()) for p in parameters)), []))

    robot, door, place = Var("Robot"), Var("Door"), Var("Place")
    atomic("Go", "robot", "place")
    atomic("Seek", "robot", "place")
    atomic("Carry", "robot1", "robot2", "place")
    atomic("Think")
    atomic("Look", "robot")
    atomic("Lift", "robot")
    atomic("Mark", "robot", "place", marks=True)
    atomic("Pass", "robot", "door", claims=("door",))
    atomic("Try", "robot")
    search: list[Term] = [_call("go", "Go", robot, place), _call("think", "Think"), _call("look", "Look", robot)]
    cross: list[Term] = [_call("in", "Pass", robot, door), _call("on", "Go", robot, place)]
    park: list[Term] = [_call("look", "Look", robot), _call("think", "Think")]
    yard.process("Search", "robot", "place", keeps=True, body=search)
    yard.process("Cross", "robot", "door", "place", keeps=True, claims=["door"], body=cross)
    yard.process("Park", "robot", "door", claims=["door"], body=park)
    yard.process("CleanDry", "robot", "place", body=[_call("go", "Go", robot, place), _call("look", "Look", robot)])
    yard.process("CleanWet", "robot", "place", body=[_call("think", "Think"), _call("mark", "Mark", robot, place)])
    recipes: list[Term] = [_call(recipe, recipe, robot, place) for recipe in ("CleanDry", "CleanWet")]
    yard.process("Clean", "robot", "place", body=struct("choice", _FRAME, "recipe", recipes))


def _call(step: str, name: str, *arguments: Term, frame: Term = _FRAME) -> Term:
    return struct("call", frame, step, Struct(name, arguments) if arguments else name)


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A composite process: it does not begin while something else keeps its robot.

    Attributes:
        keeps: It keeps its robot from its first step to its end.
        claims: It uses these resources from its first step to its end.
    """

    id: str
    robot: str
    keeps: bool = False
    claims: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """A step.

    Attributes:
        robots: All that do it; the first one travels.
        what: The place that it goes to, or that it marks.
        claims: What it uses, if the block around it does not.
        gate: The place that has to be marked before.
        by_ms: When it has to have ended.
    """

    process: str
    robots: tuple[str, ...] = ()
    what: str = ""
    claims: tuple[str, ...] = ()
    block: Block | None = None
    gate: str = ""
    by_ms: int | None = None


@dataclass(frozen=True, slots=True)
class Seq:
    """One after the other."""

    parts: tuple[Tree, ...]


@dataclass(frozen=True, slots=True)
class Conc:
    """Side by side."""

    parts: tuple[Tree, ...]


@dataclass(frozen=True, slots=True)
class Any:
    """One of them."""

    parts: tuple[Tree, ...]


@dataclass(frozen=True, slots=True)
class By:
    """Ended by then."""

    ms: int
    part: Tree


Tree: TypeAlias = Task | Seq | Conc | Any | By
Named: TypeAlias = tuple[Term, Callable[[str], Tree]]
"""A term, and the tree for the robot that is picked around it."""

_LEAVES = ("Think", "Lift", "Mark", "Go", "Search", "Carry", "Pass", "Try", "Seek", "Cross", "Park", "Clean")
_INNER = (
    "seq",
    "seq",
    "conc",
    "conc",
    "any_order",
    "any_order",
    "choice",
    "pick",
    "foreach",
    "gate",
    "deadline",
    "task",
)


@dataclass(slots=True)
class Maker:
    """Makes one random program."""

    rng: np.random.Generator
    world: World
    tasks_left: int = 4
    _steps: int = field(default=0)

    def program(self) -> tuple[Term, Tree]:
        """The body of the process `Main`, and its tree."""
        term, tree = self._part(3, _FRAME, "")
        return term, tree("")

    def _name(self) -> str:
        self._steps += 1
        return f"s{self._steps}"

    def _part(self, depth: int, frame: Term, robot: str) -> Named:
        """`robot` is the variable of the innermost pick around it, "" outside of any."""
        kinds = ("task",) if depth == 0 or self.tasks_left <= 1 else _INNER[:-1] if depth == 3 else _INNER
        match str(self.rng.choice(kinds)):
            case "task":
                return self._task(frame, robot)
            case "gate":
                return self._gate(frame, robot)
            case "foreach":
                return self._foreach(frame)
            case "pick":
                step = self._name()
                picked = f"Robot_{step}"
                term, tree = self._part(depth - 1, frame, picked)
                robots = self.world.robots
                return struct("pick", frame, step, Var(picked), "Robot", term), lambda _: Any(tuple(map(tree, robots)))
            case "deadline":
                by_ms = int(self.rng.integers(40, 400))
                term, tree = self._part(depth - 1, frame, robot)
                return struct("deadline", by_ms, term), lambda r: By(by_ms, tree(r))
            case kind:
                return self._parts(kind, depth, frame, robot)

    def _parts(self, kind: str, depth: int, frame: Term, robot: str) -> Named:
        step = self._name()
        parts = [self._part(depth - 1, frame, robot) for _ in range(int(self.rng.integers(2, 4)))]
        terms, trees = [t for t, _ in parts], [t for _, t in parts]
        match kind:
            case "choice":
                if self.rng.random() < 0.2:
                    terms, trees = [*terms, []], [*trees, lambda _: Seq(())]
                return struct("choice", frame, step, terms), lambda r: Any(tuple(t(r) for t in trees))
            case "seq":
                return terms, lambda r: Seq(tuple(t(r) for t in trees))
            case "any_order":
                return struct("any_order", frame, step, terms), lambda r: Any(
                    tuple(Seq(tuple(t(r) for t in order)) for order in permutations(trees))
                )
            case _:
                return struct("conc", terms), lambda r: Conc(tuple(t(r) for t in trees))

    def _who(self, robot: str) -> tuple[Term, Callable[[str], str]]:
        if robot and self.rng.random() < 0.9:
            return Var(robot), lambda r: r
        fixed = str(self.rng.choice(self.world.robots))
        return fixed, lambda _: fixed

    def _task(self, frame: Term, robot: str) -> Named:
        self.tasks_left -= 1
        step, (who, name) = self._name(), self._who(robot)
        place, door = str(self.rng.choice(PLACES)), str(self.rng.choice(list(CAPACITY)))
        process = str(self.rng.choice(_LEAVES))
        match process:
            case "Think":
                return _call(step, process, frame=frame), lambda _: Task(process=process)
            case "Lift" | "Try":
                return _call(step, process, who, frame=frame), lambda r: Task(process=process, robots=(name(r),))
            case "Mark" | "Go" | "Seek":
                return _call(step, process, who, place, frame=frame), lambda r: Task(
                    process=process, robots=(name(r),), what=place
                )
            case "Carry":
                other = str(self.rng.choice([r for r in self.world.robots if r != who] or list(self.world.robots)))
                return _call(step, process, who, other, place, frame=frame), lambda r: Task(
                    process=process, robots=(name(r), other), what=place
                )
            case "Pass":
                return _call(step, process, who, door, frame=frame), lambda r: Task(
                    process=process, robots=(name(r),), claims=(door,)
                )
            case "Cross":
                self.tasks_left -= 1
                return _call(step, process, who, door, place, frame=frame), lambda r: cross(name(r), door, place, step)
            case "Park":
                self.tasks_left -= 1
                return _call(step, process, who, door, frame=frame), lambda r: park(name(r), door, step)
            case "Clean":
                self.tasks_left -= 1
                return _call(step, process, who, place, frame=frame), lambda r: clean(name(r), place, step)
            case _:
                return _call(step, process, who, place, frame=frame), lambda r: search(name(r), place, step)

    def _gate(self, frame: Term, robot: str) -> Named:
        self.tasks_left -= 1
        step, (who, name) = self._name(), self._who(robot)
        gate = str(self.rng.choice(PLACES))
        look: Named = (
            [struct("test", struct("holds", "marked", gate, True)), _call(step, "Look", who, frame=frame)],
            lambda r: Task(process="Look", robots=(name(r),), gate=gate),
        )
        if self.rng.random() < 0.3:
            return look
        self.tasks_left -= 1
        marker = str(self.rng.choice(self.world.robots))
        mark = Task(process="Mark", robots=(marker,), what=gate)
        marking = _call(self._name(), "Mark", marker, gate, frame=frame)
        return struct("conc", [look[0], marking]), lambda r: Conc((look[1](r), mark))

    def _foreach(self, frame: Term) -> Named:
        self.tasks_left -= len(self.world.drinks)
        step, pick, inner = self._name(), self._name(), Var("Inner")
        drink, place, robot = Var("Drink"), Var("Place"), Var("Searcher")
        term = struct(
            "foreach",
            frame,
            step,
            [struct("-", drink, "Drink"), struct("-", place, "Place")],
            struct("holds", "standsAt", drink, place),
            inner,
            struct("pick", inner, pick, robot, "Robot", _call("find", "Search", robot, place, frame=inner)),
        )
        turns = tuple(
            Any(tuple(search(r, place_name, f"{step}/{drink_name}") for r in self.world.robots))
            for drink_name, place_name in self.world.drinks.items()
        )
        return term, lambda _: Conc(turns)


def search(robot: str, place: str, step: str) -> Tree:
    """The steps of a Search, which keeps its robot."""
    block = Block(id=step, robot=robot, keeps=True)
    go = Task(process="Go", robots=(robot,), what=place, block=block)
    look = Task(process="Look", robots=(robot,), block=block)
    return Seq((go, Task(process="Think", block=block), look))


def cross(robot: str, door: str, place: str, step: str) -> Tree:
    """The steps of a Cross, which keeps its robot and the door; its Pass uses the door that it has."""
    block = Block(id=step, robot=robot, keeps=True, claims=(door,))
    passing = Task(process="Pass", robots=(robot,), block=block)
    return Seq((passing, Task(process="Go", robots=(robot,), what=place, block=block)))


def park(robot: str, door: str, step: str) -> Tree:
    """The steps of a Park, which keeps the door but not its robot."""
    block = Block(id=step, robot=robot, claims=(door,))
    return Seq((Task(process="Look", robots=(robot,), block=block), Task(process="Think", block=block)))


def clean(robot: str, place: str, step: str) -> Tree:
    """A Clean, by one of two recipes."""
    block = Block(id=step, robot=robot)
    go = Task(process="Go", robots=(robot,), what=place, block=block)
    mark = Task(process="Mark", robots=(robot,), what=place, block=block)
    dry = Seq((go, Task(process="Look", robots=(robot,), block=block)))
    return Any((dry, Seq((Task(process="Think", block=block), mark))))


def random_world(rng: np.random.Generator) -> World:
    """One to three robots, up to three drinks; some ways are blocked, some robots have little energy."""
    robots = ROBOTS[: int(rng.integers(1, 4))]
    travel = {
        (robot, origin, goal): int(rng.integers(1, 100))
        for robot, origin, goal in product(robots, ("here", *PLACES), PLACES)
        if rng.random() < 0.96
    }
    return World(
        robots=robots,
        lifters=frozenset(r for r in robots if rng.random() < 0.9),
        limit=int(rng.integers(1, 4)),
        travel_ms=travel,
        drinks={f"d{n}": str(rng.choice(PLACES)) for n in range(int(rng.integers(0, 4)))},
        energy_J={r: float(rng.integers(50, 600)) / 1000 for r in robots if rng.random() < 0.2},
    )


def _random_learned(rng: np.random.Generator, robots: Sequence[str]) -> dict[tuple[str, str, str], tuple[int, float]]:
    """In one of three worlds, something was learned of single robots, everywhere or at places."""
    share = float(rng.choice([0.0, 0.0, 0.3]))
    return {
        (process, robot, place): (int(rng.integers(1, 60)), float(rng.choice([1.0, 0.6, 0.9])))
        for process, robot, place in product(FIXED_MS, robots, ("", *PLACES))
        if process != "Think" and rng.random() < share
    }


def random_case(seed: int) -> tuple[World, Term, Tree]:
    """A world, the body of a program in it that is small enough to try everything, and its tree."""
    rng = np.random.default_rng(seed)
    world = random_world(rng)
    world = replace(world, learned=_random_learned(np.random.default_rng([seed, 1]), world.robots))
    while True:
        body, tree = Maker(rng, world).program()
        if _size(tree) <= LARGEST:
            return world, body, tree


def _size(tree: Tree) -> int:
    """So many steps and composite processes, at most."""
    match tree:
        case Task():
            return 1
        case Any(parts):
            return max(map(_size, parts))
        case By(_, part):
            return _size(part)
        case Seq(parts) | Conc(parts):
            blocks = {part.block.id if isinstance(part, Task) and part.block else "" for part in parts}
            return 1 if len(blocks) == 1 and "" not in blocks else sum(map(_size, parts))


# ------------------------------------------------------------------------------------- every execution


Ordered: TypeAlias = tuple[Task, tuple[int, ...]]
"""A task and the numbers of those before it."""


def least(tree: Tree, world: World) -> tuple[int, int] | None:
    """Least makespan, and of those least robot time, in milliseconds; None if there is no execution."""
    found = (result for tasks in _resolved(tree) for result in _Schedules(tasks, world).all())
    return min(found, default=None)


def _resolved(tree: Tree) -> Iterator[list[Ordered]]:
    """The tasks for every way to choose."""
    for chosen in _choices(tree):
        tasks: list[Ordered] = []
        _number(chosen, (), None, tasks)
        yield tasks


def _choices(tree: Tree) -> Iterator[Tree]:
    match tree:
        case Task():
            yield tree
        case Any(parts):
            for part in parts:
                yield from _choices(part)
        case Seq(parts):
            yield from (Seq(chosen) for chosen in product(*map(_choices, parts)))
        case Conc(parts):
            yield from (Conc(chosen) for chosen in product(*map(_choices, parts)))
        case By(ms, part):
            yield from (By(ms, chosen) for chosen in _choices(part))


def _number(tree: Tree, before: tuple[int, ...], by_ms: int | None, tasks: list[Ordered]) -> tuple[int, ...]:
    """Add the tasks of a tree; the numbers of those that what follows it has to wait for."""
    match tree:
        case Task():
            tasks.append((replace(tree, by_ms=by_ms), before))
            return (len(tasks) - 1,)
        case Seq(parts):
            for part in parts:
                before = _number(part, before, by_ms, tasks)
            return before
        case By(ms, part):
            # Nothing to do is something that has to be over in time, too.
            after = _number(part, before, ms if by_ms is None else min(ms, by_ms), tasks)
            return _number(Task(process=""), after, ms, tasks)
        case Conc(parts) | Any(parts):
            ends = [_number(part, before, by_ms, tasks) for part in parts]
            return tuple(sorted(set().union(*ends))) if ends else before


@dataclass(slots=True)
class _Schedules:
    """Every order in which tasks can be appended."""

    tasks: list[Ordered]
    world: World
    ends: dict[int, int] = field(default_factory=dict)
    marked: dict[str, int] = field(default_factory=dict)
    free: Counter[str] = field(default_factory=Counter)
    """When each robot is."""
    at: dict[str, str] = field(default_factory=dict)
    keeper: dict[str, str] = field(default_factory=dict)
    """The block that keeps a robot."""
    released: dict[str, int] = field(default_factory=dict)
    """When the last one that has ended has released it."""
    begun: Counter[str] = field(default_factory=Counter)
    """When a robot's composite processes have begun: what keeps it begins no sooner, if it is appended later."""
    slots: dict[str, list[int | str]] = field(default_factory=dict)
    """Of each resource, as many as its capacity: when it is free, or the block that has it."""
    worked: Counter[str] = field(default_factory=Counter)

    def all(self) -> Iterator[tuple[int, int]]:
        """(makespan, robot time) of each."""
        team = {robot for task, _ in self.tasks for robot in task.robots}
        if len(team) <= self.world.limit and all(self._able(task) for task, _ in self.tasks):
            self.slots = {resource: [0] * n for resource, n in CAPACITY.items()}
            yield from self._extended()

    def _able(self, task: Task) -> bool:
        able = task.process not in CAPABLE or set(task.robots) <= self.world.lifters
        return able and len(set(task.robots)) == len(task.robots)

    def _extended(self) -> Iterator[tuple[int, int]]:
        if len(self.ends) == len(self.tasks):
            yield max(self.ends.values(), default=0), self.worked.total()
        ready = [n for n, (_, b) in enumerate(self.tasks) if n not in self.ends and all(m in self.ends for m in b)]
        at_once = [n for n in ready if self._takes_nothing(self.tasks[n][0])]
        for number in at_once[:1] or ready:
            task, _ = self.tasks[number]
            if all(self.keeper.get(r, "") in ("", task.block.id if task.block else "") for r in self._needed(task)):
                yield from self._appended(number)

    def _takes_nothing(self, task: Task) -> bool:
        """Of what others may want: it claims nothing, and its robots are kept for it."""
        kept = all(task.block and self.keeper.get(robot) == task.block.id for robot in self._needed(task))
        claims = task.claims or (task.block and task.block.claims and not self._has_begun(task.block))
        return kept and not claims and not task.gate

    def _needed(self, task: Task) -> tuple[str, ...]:
        """The robots that have to be kept by nothing else."""
        begins = task.block is not None and not self._has_begun(task.block)
        return (*task.robots, task.block.robot) if task.block and begins else task.robots

    def _has_begun(self, block: Block) -> bool:
        return any(self.tasks[n][0].block == block for n in self.ends)

    def _appended(self, number: int) -> Iterator[tuple[int, int]]:
        task, before = self.tasks[number]
        block = task.block
        wanted = task.claims + (block.claims if block and not self._has_begun(block) else ())
        times = [[free for free in self.slots[r] if isinstance(free, int)] for r in wanted]
        took = _took(task, self.at, self.world)
        if took is None or not all(times) or (task.gate and task.gate not in self.marked):
            return
        start = max([self.ends[b] for b in before] + [self.free[r] for r in task.robots] + [*map(min, times), 0])
        start = max(start, self.marked.get(task.gate, 0), *(self.released.get(r, 0) for r in self._needed(task)), 0)
        if block and block.keeps and not self._has_begun(block):
            start = max(start, self.begun[block.robot])
        end = start + took
        late = task.by_ms is not None and end > task.by_ms
        if late or any(self.worked[r] + took > _limit_ms(r, self.world) for r in task.robots):
            return
        then = _Schedules(
            tasks=self.tasks,
            world=self.world,
            ends={**self.ends, number: end},
            marked=dict(self.marked),
            free=self.free | Counter(dict.fromkeys(task.robots, end)),
            at={**self.at, **(dict.fromkeys(task.robots, task.what) if task.process in TRAVELS else {})},
            keeper=dict(self.keeper),
            released=dict(self.released),
            begun=self.begun | Counter({block.robot: start} if block and not self._has_begun(block) else {}),
            slots={resource: list(times) for resource, times in self.slots.items()},
            worked=self.worked + Counter(dict.fromkeys(task.robots, took)),
        )
        if task.process == "Mark":
            then.marked[task.what] = min(then.marked.get(task.what, end), end)
        for resource, free in zip(wanted, times, strict=True):
            then.slots[resource].remove(min(free))
            then.slots[resource].append(block.id if block and resource in block.claims else end)
        if block is not None:
            then.keeper |= dict.fromkeys(task.robots, block.id) if block.keeps else {}
            if all(n in then.ends for n, (t, _) in enumerate(self.tasks) if t.block == block):
                then.release(block, end)
        yield from then._extended()

    def release(self, block: Block, end: int) -> None:
        """The block ends."""
        self.released |= {robot: end for robot, keeper in self.keeper.items() if keeper == block.id}
        self.keeper = {robot: keeper for robot, keeper in self.keeper.items() if keeper != block.id}
        self.slots = {
            resource: [end if slot == block.id else slot for slot in slots] for resource, slots in self.slots.items()
        }


def _limit_ms(robot: str, world: World) -> int:
    energy = world.energy_J.get(robot)
    return 1 << 40 if energy is None else floor(1000 * energy / POWER_W)


def _took(task: Task, at: Mapping[str, str], world: World) -> int | None:
    fixed, odds = FIXED_MS.get(task.process, 0), ODDS.get(task.process, 1.0)
    if task.robots:
        robot = task.robots[0]
        here = task.what or at.get(robot, "")
        for place in ("", here):
            fixed, odds = world.learned.get((task.process, robot, place), (fixed, odds))
    if task.process not in TRAVELS:
        return round(fixed / odds)
    way = world.travel_ms.get((task.robots[0], at.get(task.robots[0], "here"), task.what))
    return None if way is None else round(way / odds) + round(fixed / odds)


def travel_tables(world: World) -> Term:
    """The travel times as look_ahead takes them: every robot has a table of its own."""

    def row(robot: str, origin: str) -> list[Term]:
        return [world.travel_ms.get((robot, origin, goal), -1) for goal in PLACES]

    robots: list[Term] = [struct("robot", r, n, row(r, "here")) for n, r in enumerate(world.robots, start=1)]
    tables: list[Term] = [[row(r, origin) for origin in PLACES] for r in world.robots]
    return struct("tables", list(PLACES), robots, tables)
