"""Random programs of all constructs over the robots of a yard, and the exact search's plans for them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import numpy as np

from kb.prolog import Entry, PrologError
from kb.store import Snapshot
from kb.terms import Data, Fluent, Struct, Term, Var, render, struct
from planner.plan import Plan, PlannedStep, PlanStatus
from tests.planner.yard import Job, Timetable, Yard, yard

_load_facts = Entry(search_path="kb_rules", file="facts", name="load_facts")
_drop_facts = Entry(search_path="kb_rules", file="facts", name="drop_facts")
_open_session = Entry(search_path="planner_golog", file="steps", name="open_session")
_close_session = Entry(search_path="planner_golog", file="steps", name="close_session")
_look_ahead = Entry(search_path="planner_golog", file="planning", name="look_ahead")
_propose = Entry(search_path="planner_golog", file="planning", name="propose")
_search_plan = Entry(search_path="planner_golog", file="planning", name="search_plan")

ROBOTS = ("ann", "bob", "cat")
LIFTERS = ("ann", "bob")
PLACES = ("a", "b", "c")
BOXES = ("red", "blue", "gray")
_REVISION = -2
_FRAME = Var("Frame")


@dataclass(slots=True)
class Maker:
    """Makes one random program."""

    rng: np.random.Generator
    tasks_left: int = 4
    _names: Any = field(default_factory=lambda: count(1))

    def body(self) -> Term:
        """The body of `Main`; loops have an end, so that every search has one."""
        body = self._part(3, _FRAME)
        return (
            struct("deadline", 12_000, body) if any(w in render(body) for w in ("star(", "while(", "until(")) else body
        )

    def _one_of(self, options: Sequence[str]) -> str:
        return options[int(self.rng.integers(len(options)))]

    def _name(self) -> str:
        return f"s{next(self._names)}"

    def _parts(self, depth: int, frame: Term) -> list[Term]:
        return [self._part(depth - 1, frame) for _ in range(int(self.rng.integers(2, 4)))]

    def _condition(self) -> Term:
        box = self._one_of(BOXES)
        lifted = struct("holds", "lifted", box, True)
        options: list[Term] = [
            lifted,
            struct("not", lifted),
            struct("any", [lifted, struct("holds", "lifted", self._one_of(BOXES), True)]),
            struct("all", [struct("holds", "heavy", box, True), struct("not", lifted)]),
            struct("holds", "locatedAt", self._one_of(ROBOTS), self._one_of(PLACES)),
            struct("compare", "more", struct("value", "weight", box), 3),
        ]
        return options[int(self.rng.integers(len(options)))]

    def _part(self, depth: int, frame: Term) -> Term:
        if depth == 0 or self.tasks_left <= 1:
            return self._task(frame)
        name = self._name()
        match self._one_of(CONSTRUCTS):
            case "sequence":
                return self._parts(depth, frame)
            case "conc" | "pconc" as word:
                return struct(word, self._parts(depth, frame))
            case "choice":
                return struct(
                    "choice", frame, name, [*self._parts(depth, frame), *([[]] if self.rng.random() < 0.2 else [])]
                )
            case "any_order":
                return struct("any_order", frame, name, self._parts(depth, frame))
            case "star":
                return [struct("star", frame, name, self._part(depth - 1, frame)), struct("test", self._condition())]
            case "if":
                return struct("if", self._condition(), self._part(depth - 1, frame), self._part(depth - 1, frame))
            case "while":
                self.tasks_left -= 1
                box = self._one_of(BOXES)
                lift = struct("call", frame, name, struct("Lift", self._one_of(LIFTERS), box))
                return struct(
                    "while", struct("not", struct("holds", "lifted", box, True)), self._before(depth, frame, lift)
                )
            case "until":
                self.tasks_left -= 1
                box = self._one_of(BOXES)
                lift = struct("call", frame, name, struct("Lift", self._one_of(LIFTERS), box))
                return struct("until", self._before(depth, frame, lift), struct("holds", "lifted", box, True))
            case "await":
                return [struct("test", self._condition()), self._part(depth - 1, frame)]
            case "interrupt":
                self.tasks_left -= 1
                drop = struct("call", frame, name, struct("Drop", self._one_of(ROBOTS), Var("Box")))
                watched = struct("holds", "lifted", Var("Box"), True)
                over: list[Term] = [struct("-", Var("Box"), "Box")]
                return struct(
                    "pconc", [struct("interrupt", frame, name, over, watched, drop), self._part(depth - 1, frame)]
                )
            case "deadline":
                return struct("deadline", int(self.rng.integers(2, 12)) * 1000, self._part(depth - 1, frame))
            case "search":
                return struct("search", self._part(depth - 1, frame))
            case "pick":
                self.tasks_left -= 1
                picked, inner = Var(f"Robot_{name}"), self._name()
                heads = [
                    struct("Work", picked),
                    struct("Go", picked, self._one_of(PLACES)),
                    struct("Lift", picked, self._one_of(BOXES)),
                    struct("Cross", picked, "door"),
                ]
                doing = struct("call", frame, inner, heads[int(self.rng.integers(len(heads)))])
                return struct("pick", frame, name, picked, "Robot", doing)
            case _:
                self.tasks_left -= 2
                turn, robot = Var("Inner"), self._one_of(LIFTERS)
                return struct(
                    "foreach",
                    frame,
                    name,
                    [struct("-", Var("Box"), "Box")],
                    struct(
                        "all",
                        [
                            struct("holds", "heavy", Var("Box"), True),
                            struct("not", struct("holds", "lifted", Var("Box"), True)),
                        ],
                    ),
                    turn,
                    struct("call", turn, "up", struct("Lift", robot, Var("Box"))),
                )

    def _before(self, depth: int, frame: Term, last: Term) -> list[Term]:
        return [self._part(depth - 1, frame), last] if self.rng.random() < 0.4 else [last]

    def _task(self, frame: Term) -> Term:
        self.tasks_left -= 1
        robot, lifter, place, box = (self._one_of(o) for o in (ROBOTS, LIFTERS, PLACES, BOXES))
        heads: list[Term] = [
            struct("Work", robot),
            "Think",
            struct("Go", robot, place),
            struct("Go", robot, struct("fluent", "stands", box)),
            struct("Lift", lifter, box),
            struct("Drop", robot, box),
            struct("Carry", *(("ann", "bob") if self.rng.random() < 0.5 else ("bob", "ann")), place),
            struct("Pass", robot, self._one_of(("door", "lot"))),
            struct("Try", robot),
            struct("Seek", robot, place),
            struct("Cross", robot, "door"),
            struct("Clear", lifter, box),
        ]
        return struct("call", frame, self._name(), heads[int(self.rng.integers(len(heads)))])


CONSTRUCTS = (
    "sequence",
    "conc",
    "pconc",
    "choice",
    "any_order",
    "star",
    "if",
    "while",
    "until",
    "await",
    "interrupt",
    "deadline",
    "search",
    "pick",
    "foreach",
)


def wider(made: Yard) -> Yard:
    """A yard with composite processes too: one that keeps its robot and a door, one with a precondition and recipes."""
    robot, door, box = Var("Robot"), Var("Door"), Var("Box")
    steps: list[Term] = [
        struct("call", _FRAME, "in", struct("Pass", robot, door)),
        struct("call", _FRAME, "on", struct("Work", robot)),
    ]
    made.process("Cross", "robot", "door", keeps=True, claims=["door"], body=steps)
    recipes: list[Term] = [
        struct("call", _FRAME, "up", struct("Lift", robot, box)),
        [struct("call", _FRAME, "think", "Think"), struct("call", _FRAME, "try", struct("Try", robot))],
    ]
    made.process(
        "Clear",
        "robot",
        "box",
        needs=[struct("not", struct("holds", "lifted", Var("box"), True))],
        effects=[("cleared", "box", True)],
        body=struct("choice", _FRAME, "recipe", recipes),
    )
    return made


def random_job(base: Snapshot, seed: int) -> Job:
    """A request for a random program."""
    rng = np.random.default_rng(seed)
    made = wider(yard(base))
    made.process("Main", body=Maker(rng).body())
    return Job(yard=made, robots=int(rng.integers(2, 4)))


def lasting(job: Job) -> Callable[[PlannedStep], bool]:
    """Whether a step is asked for whatever the others do: it depends on no condition."""
    names = set(_unconditional(job.yard.program().definitions[-1]))
    return lambda step: step.action.id.split("/")[2] in names


def _unconditional(term: Term) -> Iterator[str]:
    match term:
        case Struct("if" | "while" | "until" | "foreach" | "interrupt" | "star"):
            return
        case Struct("call", (_, str(step), _)):
            yield step
        case Struct(_, parts) | list(parts):
            for part in parts:
                yield from _unconditional(part)
        case _:
            return


def found(job: Job, *, made_at_s: float = 0.0, max_nodes: int = 400) -> tuple[Plan, Plan | None] | None:
    """The plan of the exact search, and what comes of its choices and orders if every step begins as early as it can.

    None if there is no plan, or the program is refused; no second plan if the first relies on waiting.
    """
    _load_facts(job.yard.facts(_REVISION))
    try:
        _open_session(struct("request", "task", _REVISION, "Main", job.robots, round(made_at_s * 1000)))
        _look_ahead(struct("ahead", "task", round(made_at_s * 1000), travel_tables(job.times)))
        answer = _search_plan(struct("search", "task", max_nodes, -1))
        if not str(answer["status"]).startswith("solved"):
            return None
        plan = _plan(job, answer, made_at_s)
        again = _propose(_proposal(job, answer))
        return plan, None if again["status"] == "stuck" else _plan(job, again, made_at_s)
    except PrologError as error:
        if error.formal[0] != "malformed_program":
            raise
        return None
    finally:
        _close_session("task")
        _drop_facts(_REVISION)


def _proposal(job: Job, answer: Mapping[str, Any]) -> Term:
    choices: list[Term] = [struct("-", at, chosen) for at, chosen in answer["choices"]]
    steps: list[Term] = []
    for _, _, step_id, robots, name, *values in answer["steps"]:
        claimed: list[Term] = [struct("resource", values[1])] if name == "Pass" else []
        steps.append(struct("-", step_id, [*robots, *claimed]))
    return struct("proposal", "task", choices, steps, -1)


def _plan(job: Job, answer: Mapping[str, Any], made_at_s: float) -> Plan:
    table, choices = Timetable(job.yard, made_at_s), dict[str, tuple[str | int, ...]]()
    for start, end, step_id, _, name, *values in answer["steps"]:
        action = table.action(step_id, name, [_value(value) for value in values])
        table.steps.append(PlannedStep(action=action, start_s=start / 1000, end_s=end / 1000))
    for at, chosen in answer["choices"]:
        choices[at] = (*choices.get(at, ()), chosen)
    return Plan(
        status=PlanStatus(answer["status"].upper()),
        made_at_s=made_at_s,
        makespan_s=answer["makespan"] / 1000,
        lower_bound_s=answer["bound"] / 1000,
        steps=tuple(table.steps),
        choices=choices,
        nodes=answer["nodes"],
        reason="",
        waits_for=tuple(answer["waits_for"]),
    )


def _value(row: Any) -> str | Data | Fluent:
    match row:
        case [place]:
            return Data(place)
        case [prop, subject]:
            return Fluent(prop, subject)
        case _:
            return str(row)


def travel_tables(times: Mapping[tuple[str, str, str], float]) -> Term:
    """The travel times as look_ahead takes them: every robot has a table of its own."""

    def row(robot: str, origin: str) -> list[Term]:
        return [round(times.get((robot, origin, goal), -0.001) * 1000) for goal in PLACES]

    robots: list[Term] = [struct("robot", r, n, row(r, "here")) for n, r in enumerate(ROBOTS, start=1)]
    tables: list[Term] = [[row(r, origin) for origin in PLACES] for r in ROBOTS]
    return struct("tables", list(PLACES), robots, tables)
