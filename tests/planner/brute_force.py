"""Small random programs, and the least makespan of each by trying every execution.

A program is made twice: as the term that the planner reads, and as a tree of tasks for `least`. They
share no code with the planner: `least` lists every choice, and for each, every order in which tasks can
be appended to the robots' schedules, each as early as can be.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import TypeAlias

import numpy as np

from kb.terms import Term, Var, struct

ROBOTS = ("anna", "bert", "carl")
PLACES = ("p1", "p2", "p3")
SETUP_MS = 5
"""What a Go takes besides the travel."""
THINK_MS, LOOK_MS, LIFT_MS, MARK_MS = 7, 10, 20, 30


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """The robots, how long they travel, who can lift, how many may take part."""

    robots: tuple[str, ...]
    lifters: frozenset[str]
    limit: int
    travel_ms: Mapping[tuple[str, str, str], int]
    drinks: Mapping[str, str]

    def facts(self, revision: int) -> list[Term]:
        """The world and the processes as facts of kb/rules/facts.pl."""
        r, x = Var("R"), Var("X")
        facts: list[Term] = [struct("kind", revision, robot, "Robot") for robot in self.robots]
        facts += [struct("kind", revision, robot, "Lifter") for robot in sorted(self.lifters)]
        facts += [struct("kind", revision, place, "Place") for place in PLACES]
        for drink, place in self.drinks.items():
            facts += [struct("kind", revision, drink, "Drink"), struct("value", revision, "standsAt", drink, place)]
        for head, duration in (
            (struct("Go", r, x), struct("travel", r, x, SETUP_MS)),
            (struct("Look", r), struct("fixed", LOOK_MS)),
            (struct("Lift", r), struct("fixed", LIFT_MS)),
            (struct("Mark", r, x), struct("fixed", MARK_MS)),
            ("Think", struct("fixed", THINK_MS)),
        ):
            facts.append(struct("duration", revision, head, duration))
            facts += [] if isinstance(head, str) else [struct("agent", revision, head, r)]
        frame, search = Var("Frame"), struct("Search", r, x)
        body: list[Term] = [
            struct("call", frame, "go", struct("Go", r, x)),
            struct("call", frame, "think", "Think"),
            struct("call", frame, "look", struct("Look", r)),
        ]
        facts += [
            struct("effect", revision, struct("Go", r, x), struct("fluent", "locatedAt", r), x),
            struct("effect", revision, struct("Mark", r, x), struct("fluent", "marked", x), True),
            struct("requires", revision, "Lift", "Lifter"),
            struct("agent", revision, search, r),
            struct("definition", revision, search, frame, body),
            struct("keeps_robot", revision, "Search"),
        ]
        return facts


@dataclass(frozen=True, slots=True)
class Task:
    """A step: process, robot ('' for none), place or mark, block that keeps its robot, mark it waits for."""

    process: str
    robot: str
    what: str = ""
    block: str = ""
    gate: str = ""


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


Tree: TypeAlias = Task | Seq | Conc | Any
Named: TypeAlias = tuple[Term, Callable[[str], Tree]]
"""A term, and the tree for the robot that is picked around it."""


@dataclass(slots=True)
class Maker:
    """Makes one random program."""

    rng: np.random.Generator
    world: World
    tasks_left: int = 5
    _steps: int = field(default=0)

    def program(self) -> tuple[Term, Tree]:
        """The body of the process `Main`, and its tree."""
        term, tree = self._part(3, Var("Frame"), "")
        return term, tree("")

    def _name(self) -> str:
        self._steps += 1
        return f"s{self._steps}"

    def _part(self, depth: int, frame: Term, robot: str) -> Named:
        """`robot` is the variable of the innermost pick around it, "" outside of any."""
        kinds = ["task"] if depth == 0 or self.tasks_left <= 1 else ["seq", "conc", "choice", "pick", "foreach", "gate"]
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
            case kind:
                step = self._name()
                parts = [self._part(depth - 1, frame, robot) for _ in range(int(self.rng.integers(2, 4)))]
                terms, trees = [t for t, _ in parts], [t for _, t in parts]
                if kind == "choice":
                    if self.rng.random() < 0.2:
                        terms, trees = [*terms, []], [*trees, lambda _: Seq(())]
                    return struct("choice", frame, step, terms), lambda r: Any(tuple(t(r) for t in trees))
                if kind == "seq":
                    return terms, lambda r: Seq(tuple(t(r) for t in trees))
                return struct("conc", terms), lambda r: Conc(tuple(t(r) for t in trees))

    def _who(self, robot: str) -> tuple[Term, Callable[[str], str]]:
        if robot:
            return Var(robot), lambda r: r
        fixed = str(self.rng.choice(self.world.robots))
        return fixed, lambda _: fixed

    def _task(self, frame: Term, robot: str) -> Named:
        self.tasks_left -= 1
        step, (who, name) = self._name(), self._who(robot)
        what = str(self.rng.choice(PLACES))
        match str(self.rng.choice(["Think", "Lift", "Mark", "Go", "Search"])):
            case "Think":
                return struct("call", frame, step, "Think"), lambda _: Task("Think", "")
            case "Lift":
                return struct("call", frame, step, struct("Lift", who)), lambda r: Task("Lift", name(r))
            case "Mark":
                return struct("call", frame, step, struct("Mark", who, what)), lambda r: Task("Mark", name(r), what)
            case "Go":
                return struct("call", frame, step, struct("Go", who, what)), lambda r: Task("Go", name(r), what)
            case _:
                call = struct("call", frame, step, struct("Search", who, what))
                return call, lambda r: search(name(r), what, step)

    def _gate(self, frame: Term, robot: str) -> Named:
        self.tasks_left -= 1
        step, (who, name) = self._name(), self._who(robot)
        gate = str(self.rng.choice(PLACES))
        look = struct("call", frame, step, struct("Look", who))
        test = struct("test", struct("holds", "marked", gate, True))
        return [test, look], lambda r: Task("Look", name(r), gate=gate)

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
            struct("pick", inner, pick, robot, "Robot", struct("call", inner, "find", struct("Search", robot, place))),
        )
        turns = tuple(
            Any(tuple(search(r, place_name, f"{step}/{drink_name}") for r in self.world.robots))
            for drink_name, place_name in self.world.drinks.items()
        )
        return term, lambda _: Conc(turns)


def search(robot: str, place: str, block: str) -> Tree:
    """The steps of a Search, which keeps its robot."""
    return Seq((Task("Go", robot, place, block), Task("Think", "", "", block), Task("Look", robot, "", block)))


def random_world(rng: np.random.Generator) -> World:
    """One to three robots, up to three drinks; some ways are blocked."""
    robots = ROBOTS[: int(rng.integers(1, 4))]
    travel = {
        (robot, origin, goal): int(rng.integers(1, 100))
        for robot, origin, goal in product(robots, ("here", *PLACES), PLACES)
        if rng.random() < 0.93
    }
    return World(
        robots=robots,
        lifters=frozenset(r for r in robots if rng.random() < 0.85),
        limit=int(rng.integers(1, 4)),
        travel_ms=travel,
        drinks={f"d{n}": str(rng.choice(PLACES)) for n in range(int(rng.integers(0, 4)))},
    )


# ------------------------------------------------------------------------------------- every execution


Job: TypeAlias = tuple[Task, tuple[int, ...]]
"""A task and the numbers of the jobs before it."""


def least(tree: Tree, world: World) -> tuple[int, int] | None:
    """Least makespan, and of those least robot time, in milliseconds; None if there is no execution."""
    found = [result for jobs in _resolved(tree) for result in _schedules(jobs, world)]
    return min(found, default=None)


def _resolved(tree: Tree) -> Iterator[list[Job]]:
    """The jobs for every way to choose."""
    for tasks in _choices(tree):
        jobs: list[Job] = []
        _number(tasks, (), jobs)
        yield jobs


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


def _number(tree: Tree, before: tuple[int, ...], jobs: list[Job]) -> tuple[int, ...]:
    """Add the jobs of a tree; the numbers of those that what follows it has to wait for."""
    match tree:
        case Task():
            jobs.append((tree, before))
            return (len(jobs) - 1,)
        case Seq(parts):
            for part in parts:
                before = _number(part, before, jobs)
            return before
        case Conc(parts) | Any(parts):
            ends = [_number(part, before, jobs) for part in parts]
            return tuple(sorted(set().union(*ends))) if ends else before


def _schedules(jobs: list[Job], world: World) -> Iterator[tuple[int, int]]:
    """(makespan, robot time) of every order in which the jobs can be appended."""
    team = {task.robot for task, _ in jobs} - {""}
    if len(team) > world.limit or any(t.process == "Lift" and t.robot not in world.lifters for t, _ in jobs):
        return
    ends: dict[int, int] = {}
    marked: dict[str, int] = {}
    free = dict.fromkeys(team, 0)
    at = dict.fromkeys(team, "here")
    keeps = dict.fromkeys(team, "")
    worked = 0

    def extend() -> Iterator[tuple[int, int]]:
        nonlocal worked
        if len(ends) == len(jobs):
            yield max(ends.values(), default=0), worked
        ready = [n for n, (_, before) in enumerate(jobs) if n not in ends and all(b in ends for b in before)]
        # What needs no robot takes nobody's place, and a robot in a block can do nothing else: at once.
        next_ones = [n for n in ready if not jobs[n][0].robot or (jobs[n][0].block and jobs[n][0].process != "Go")]
        for number in next_ones[:1] or ready:
            task, before = jobs[number]
            if task.robot and keeps[task.robot] not in ("", task.block):
                continue
            if task.gate and task.gate not in marked:
                continue
            start = max((ends[b] for b in before), default=0)
            start = max(start, free.get(task.robot, 0), marked.get(task.gate, 0))
            took = _took(task, at.get(task.robot, ""), world)
            if took is None:
                continue
            saved = (free.get(task.robot, 0), at.get(task.robot, ""), keeps.get(task.robot, ""), dict(marked))
            ends[number] = start + took
            if task.robot:
                free[task.robot], worked = start + took, worked + took
                keeps[task.robot] = task.block if task.process == "Go" else ""
                at[task.robot] = task.what if task.process == "Go" else at[task.robot]
            if task.process == "Mark":
                marked[task.what] = min(marked.get(task.what, start + took), start + took)
            yield from extend()
            del ends[number]
            if task.robot:
                free[task.robot], at[task.robot], keeps[task.robot] = saved[:3]
                worked -= took
            marked.clear()
            marked.update(saved[3])

    yield from extend()


def _took(task: Task, origin: str, world: World) -> int | None:
    match task.process:
        case "Go":
            way = world.travel_ms.get((task.robot, origin, task.what))
            return None if way is None else way + SETUP_MS
        case "Think":
            return THINK_MS
        case "Look":
            return LOOK_MS
        case "Lift":
            return LIFT_MS
        case _:
            return MARK_MS


def request(body: Term, revision: int) -> list[Term]:
    """The process `Main` with this body."""
    return [struct("definition", revision, "Main", Var("Frame"), body)]


def travel_tables(world: World) -> Term:
    """The travel times as look_ahead takes them: every robot has a table of its own."""

    def row(robot: str, origin: str) -> list[Term]:
        return [world.travel_ms.get((robot, origin, goal), -1) for goal in PLACES]

    robots: list[Term] = [struct("robot", r, n, row(r, "here")) for n, r in enumerate(world.robots, start=1)]
    tables: list[Term] = [[row(r, origin) for origin in PLACES] for r in world.robots]
    return struct("tables", list(PLACES), robots, tables)
