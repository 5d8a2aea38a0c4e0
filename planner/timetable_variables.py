"""Variables of the constraint model, and what a known solution says of each.

A search that starts from a solution needs a value for every variable, also for those that only help. So whoever makes
a variable says how it follows from the solution and from other variables.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from ortools.sat.python import cp_model

from planner.network import Label, Solution
from planner.timetable_tasks import Mode, done_as, edges_ms

Variable: TypeAlias = cp_model.IntVar
"""All times are in units of `Variables.unit_ms`."""

Literal: TypeAlias = cp_model.LiteralT

Path: TypeAlias = tuple[tuple[int, int, bool], ...]
"""What something is in, from the root: number of a node, number of its part, whether its parts follow each other."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Task:
    """A task in the model.

    Attributes:
        on: By mode, whether it is what is done.
        present: Whether the task is done; then exactly one mode is.
        times: Of the edges of its mode. If there are more, the last ones are when it ends.
        head_ms: It cannot start before.
        tail_ms: So long it takes at least from its end to the end of the plan.
        kept_ms: As in `Branch`.
        ways: Between which edges (the first's number), by which arc of a tour, how long it travels then.
    """

    modes: tuple[Mode, ...]
    on: tuple[Variable, ...]
    present: Variable
    times: tuple[Variable, ...]
    path: Path
    head_ms: int
    tail_ms: int
    kept_ms: tuple[int, ...] | None
    ways: list[tuple[int, Variable, Variable | int]] = field(default_factory=list)

    @property
    def start(self) -> Variable:
        return self.times[0]

    @property
    def end(self) -> Variable:
        return self.times[-1]

    def way(self, value: Callable[[Variable], int]) -> int:
        """How long it travels, given the values of variables."""
        return sum(value(arc) * (way if isinstance(way, int) else value(way)) for _, arc, way in self.ways)


class Given:
    """A solution, and what follows from it for the variables: `given[variable]`."""

    def __init__(self, solution: Solution, unit_ms: int, guesses: Mapping[int, Guess]) -> None:
        self.choices: Mapping[str, Label] = solution.choices
        self.steps = {step.id: step for step in solution.steps}
        self._unit_ms = unit_ms
        self._guesses = guesses
        self._values: dict[int, int] = {}
        self._modes: dict[int, int | None] = {}

    def __getitem__(self, variable: Variable) -> int:
        index = variable.index
        if index not in self._values:
            self._values[index] = self._guesses[index](self)
        return self._values[index]

    def mode(self, task: Task) -> int | None:
        """The number of the mode in which it does a task."""
        if id(task) not in self._modes:
            fitting = (m for m, mode in enumerate(task.modes) if done_as(mode, self.choices, self.steps))
            self._modes[id(task)] = next(fitting, None)
        return self._modes[id(task)]

    def edge(self, task: Task, k: int) -> int:
        """When it comes to an edge of a task."""
        m = self.mode(task)
        if m is None:
            return 0
        edges = edges_ms(task.modes[m], self.steps)
        return edges[min(k, len(edges) - 1)] // self._unit_ms


Guess: TypeAlias = Callable[[Given], int]


class Variables:
    """A constraint model that knows what solutions say of its variables.

    Attributes:
        unit_ms: All durations are multiples of it.
        horizon: No time is later.
    """

    def __init__(self, unit_ms: int, horizon_ms: int) -> None:
        self.model = cp_model.CpModel()
        self.unit_ms = unit_ms
        self.horizon = horizon_ms // unit_ms
        self._guesses: dict[int, Guess] = {}
        self._guessed: dict[int, Variable] = {}  # constants that are equal are one variable
        self.begun = self.constant(-1)  # what is under way began before everything else
        self.zero = self.constant(0)
        self.always = self.constant(1)

    def guess(self, variable: Variable, guess: Guess) -> None:
        """Say what a variable is, given a solution and other variables."""
        self._guesses[variable.index] = guess
        self._guessed[variable.index] = variable

    def hint(self, solution: Solution) -> None:
        """Let the search start from a solution."""
        given = Given(solution, self.unit_ms, self._guesses)
        self.model.clear_hints()  # type: ignore[no-untyped-call]
        for variable in self._guessed.values():
            self.model.add_hint(variable, given[variable])

    def constant(self, value: int) -> Variable:
        constant = self.model.new_constant(value)
        self.guess(constant, lambda _: value)
        return constant

    def time(self) -> Variable:
        """A time or duration; say what it is with `guess`."""
        return self.model.new_int_var(0, self.horizon, "")

    def literal(self) -> Variable:
        """A truth value; say what it is with `guess`."""
        return self.model.new_bool_var("")

    def one_of(self, literals: Sequence[Variable]) -> Variable:
        """Whether one of several literals holds, which exclude each other."""
        if len(literals) == 1:
            return literals[0]
        either = self.literal()
        self.model.add(sum(literals) == either)
        self.guess(either, lambda g: sum(g[literal] for literal in literals))
        return either

    def some_of(self, literals: Sequence[Variable]) -> Variable:
        """Whether any of several literals holds."""
        some = self.literal()
        self.model.add_max_equality(some, literals)
        self.guess(some, lambda g: max(g[literal] for literal in literals))
        return some

    def both(self, a: Variable, b: Variable) -> Variable:
        if b.index in (a.index, self.always.index):
            return a
        both = self.literal()
        self.model.add_min_equality(both, [a, b])
        self.guess(both, lambda g: min(g[a], g[b]))
        return both

    def latest(self, times: Sequence[Variable]) -> Variable:
        """No earlier than any of some times."""
        latest = self.time()
        for time in times:
            self.model.add(latest >= time)
        self.guess(latest, lambda g: max(g[time] for time in times))
        return latest

    def interval(self, start: Variable, end: Variable, present: Variable) -> cp_model.IntervalVar:
        size = self.model.new_int_var(0, self.horizon + 1, "")
        self.guess(size, lambda g: g[end] - g[start])
        return self.model.new_optional_interval_var(start, size, end, present, "")
