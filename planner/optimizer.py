"""The optimizer: better and better ways through a network, and how good they can become.

A network that falls apart into jobs (planner/jobs.py) is a question of who does what: greedy runs, then the ejection
pool (planner/ejection.py) for shorter ones, then run tables (planner/runs.py) and covers by them (planner/cover.py)
to show that there are none, or to find them. Any other network is left to planner/timetable.py.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from planner.cover import Cover
from planner.ejection import EFFORT_PER_LOOK_S, Pool, Runs, least_ms
from planner.jobs import NEVER, SAME_ROW, Crew, Jobs, Leg, separate
from planner.network import Improvement, Label, Network, Solution, StartedStep
from planner.runs import RunTable, fill
from planner.timetable import improve as improve_timetable

SEED = 1
"""Chance has no say in what is found, only in the order in which it is looked for."""

FIRST_ROUNDS = 300
"""Of the first search for shorter runs, in looks at all places in all runs; after each failure twice as many."""

POOL_SHARE = 0.4
"""The pool has at least this part of all effort."""

FIRST_NODES = 5
"""Of the first exact covers, in nodes of branch and bound; after each round twice as many."""

FIRST_REACH = 256
"""The first horizon that a cover is looked for in is above the bound by this part of it."""

MAX_COLUMNS = 20_000
"""An exact cover by more runs than this is not tried."""

MAX_LABELS = 1_500_000
"""Of a layer of a run table: some 150 MB while it is made."""

LONGEST_MS = 1 << 40
"""A plan of 35 years is none."""

TIDY_SHUFFLES = 5_000
"""Changes tried at the end for less robot time at the same makespan."""

NEAR = 0.01
"""No tables that are wider than the bound by less than this part of it are made where wider ones were too large."""

_EFFORT_PER_LABEL_S = 8e-7
_HORIZONS = (0.5, 0.75, 0.9, 1.0)
"""Of run tables, as parts of the way from the bound to the best plan: small tables raise the bound cheaply."""


def improve(
    network: Network, *, effort: float, stop: Callable[[], bool], start: Solution | None = None
) -> Iterator[Improvement]:
    """Find ways through a network.

    Args:
        network: What to do.
        effort: Give up after about so many deterministic seconds.
        stop: Asked often; once it is true, the stream ends.
        start: A solution to begin with, such as what remains of a plan.

    Yields:
        Improvements, each with a better solution or bound than the one before. With one solution and one bound
        that are equal, or with `unsolvable`, the question is settled; a last one may follow that takes less robot
        time. The same arguments lead to the same stream, as long as `stop` is false.
    """
    jobs = separate(network)
    if jobs is None:
        yield from improve_timetable(network, effort=effort, stop=stop, start=start)
    else:
        yield from _Search(jobs, effort, stop).improve(start)


class _Search:
    """The best runs so far, and a bound."""

    def __init__(self, jobs: Jobs, effort: float, stop: Callable[[], bool]) -> None:
        self._jobs = jobs
        self._limit = effort
        self._stop = stop
        self._spent = 0.0
        self._rng = np.random.default_rng(SEED)
        self._runs: Runs | None = None
        self._best_ms = NEVER
        self._bound_ms = max([jobs.least_ms, *least_ms(jobs)])
        self._cover: Cover | None = None
        self._pool_spent = 0.0
        self._too_wide_ms = NEVER
        self._fractional_ms = -1

    def improve(self, start: Solution | None) -> Iterator[Improvement]:
        if self._bound_ms > LONGEST_MS:
            yield self._tell("jobs")  # there is one that nobody can do
            return
        given = None if start is None else _runs_of(self._jobs, start)
        if given is not None:
            pool = Pool(self._jobs, given, NEVER - 1, self._rng)  # takes out what is too much work by now
            if pool.complete and pool.robots <= self._jobs.team:
                self._accept(pool.runs)
        yield self._first()
        robots = sum(len(crew.robots) for crew in self._jobs.crews)
        looks, nodes = FIRST_ROUNDS * (self._jobs.count + robots), FIRST_NODES
        while not self._done():
            before = self._bound_ms, self._best_ms
            yield from self._squeeze(looks)
            yield from self._raise()
            yield from self._dive(looks)
            yield from self._decide(nodes)
            if before == (self._bound_ms, self._best_ms):
                looks, nodes = 2 * looks, 2 * nodes
        yield from self._tidy()

    def _done(self) -> bool:
        return self._bound_ms >= min(self._best_ms, LONGEST_MS + 1) or self._spent >= self._limit or self._stop()

    def _tell(self, phase: str) -> Improvement:
        solution = None if self._runs is None else _solution(self._jobs, self._runs)
        bound_ms = min(self._bound_ms, self._best_ms, LONGEST_MS)
        unsolvable = self._bound_ms > LONGEST_MS
        return Improvement(solution=solution, bound_ms=bound_ms, unsolvable=unsolvable, phase=phase, effort=self._spent)

    def _accept(self, runs: Runs) -> bool:
        """Take runs over if they are better than those so far."""
        ms = max(self._jobs.least_ms, *(_end_ms(crew, run) for crew, run in _by_robot(self._jobs, runs)), 0)
        if ms >= self._best_ms:
            return False
        self._runs, self._best_ms = runs, ms
        return True

    def _first(self) -> Improvement:
        pool = Pool(self._jobs, (), NEVER - 1, self._rng)
        pool.greedy()
        self._spent += pool.looks * EFFORT_PER_LOOK_S
        if pool.complete:
            self._accept(pool.runs)
        return self._tell("greedy")

    def _squeeze(self, looks: int) -> Iterator[Improvement]:
        """Ask the ejection pool for shorter and shorter runs, in smaller and smaller steps."""
        step_ms = max(1, (self._best_ms - self._bound_ms) // 8)
        while not self._done():
            horizon_ms = max(self._bound_ms, self._best_ms - step_ms)
            pool = Pool(self._jobs, self._runs or (), horizon_ms, self._rng)
            while not (pool.complete or pool.looks > looks or self._stop()):
                pool.step()
            self._spent += pool.looks * EFFORT_PER_LOOK_S
            self._pool_spent += pool.looks * EFFORT_PER_LOOK_S
            if pool.complete and self._accept(pool.runs):
                yield self._tell("ejection pool")
            elif step_ms > 1 and self._runs is not None:
                step_ms = max(1, step_ms // 8)
            elif self._pool_spent < POOL_SHARE * self._spent:
                step_ms = max(1, (self._best_ms - self._bound_ms) // 8)
            else:
                return

    def _tabulate(self, horizon_ms: int) -> Cover | None:
        """Run tables for a horizon; None: too large."""
        if horizon_ms >= self._too_wide_ms:
            return None
        tables: list[RunTable] = []
        for crew in self._jobs.crews:
            table = None if self._stop() else fill(crew, self._jobs.count, horizon_ms, MAX_LABELS)
            if table is None:
                self._too_wide_ms = horizon_ms
                return None
            self._spent += table.labels * _EFFORT_PER_LABEL_S
            tables.append(table)
        return Cover(self._jobs, tables)

    def _widen(self, horizon_ms: int) -> bool:
        """See to it that the tables reach a horizon."""
        if self._cover is not None and self._cover.horizon_ms >= horizon_ms:
            return True
        cover = self._tabulate(horizon_ms)
        if cover is not None:
            self._cover = cover
        return cover is not None

    def _raise(self) -> Iterator[Improvement]:
        """Raise the bound by fractional covers."""
        for part in _HORIZONS:
            last_ms = min(self._last_ms(), self._too_wide_ms - 1)
            near = self._cover is not None and last_ms - self._bound_ms < NEAR * self._bound_ms
            if self._bound_ms == self._fractional_ms or self._done() or (near and last_ms < self._last_ms()):
                return
            if not self._widen(self._bound_ms + int((last_ms - self._bound_ms) * part)):
                return
            assert self._cover is not None
            before = self._cover.effort
            for bound_ms in self._cover.raised(self._bound_ms, self._stop):
                self._bound_ms = bound_ms
                yield self._tell("fractional cover")
            self._spent += self._cover.effort - before
            if self._bound_ms <= self._cover.horizon_ms:
                self._fractional_ms = self._bound_ms

    def _dive(self, looks: int) -> Iterator[Improvement]:
        """Let the pool complete rounded fractional covers, for shorter and shorter horizons."""
        part = 0.25
        while self._cover is not None and self._bound_ms == self._fractional_ms and not self._done():
            last_ms = min(self._last_ms(), self._cover.horizon_ms)
            horizon_ms = self._bound_ms + int((last_ms - self._bound_ms) * part)
            before = self._cover.effort
            runs = self._cover.dive(horizon_ms, self._rng, self._stop)
            pool = Pool(self._jobs, runs, horizon_ms, self._rng)
            while not (pool.complete or pool.looks > looks or self._stop()):
                pool.step()
            self._spent += self._cover.effort - before + pool.looks * EFFORT_PER_LOOK_S
            if pool.complete and self._accept(pool.runs):
                yield self._tell("rounded cover")
            elif part == 1.0:
                return
            else:
                part = min(1.0, part * 2)

    def _last_ms(self) -> int:
        """The last time at which a better plan than the best so far may end."""
        return LONGEST_MS if self._runs is None else self._best_ms - 1

    def _decide(self, nodes: int) -> Iterator[Improvement]:
        """Find exact covers, or that there are none, from the bound up: near to it they are decided soonest."""
        if not self._done():
            self._widen(self._last_ms())
        reach_ms = self._bound_ms // FIRST_REACH
        while self._cover is not None and not self._done():
            last_ms = min(self._last_ms(), self._cover.horizon_ms)
            times = self._cover.times(self._bound_ms, last_ms + 1)
            if len(times) == 0:
                self._bound_ms = max(self._bound_ms, last_ms + 1)
                yield self._tell("run cover")
                return
            at = max(0, int(np.searchsorted(times, self._bound_ms + reach_ms, side="right")) - 1)
            answer = None
            if self._cover.columns(int(times[at])) <= MAX_COLUMNS:
                before = self._cover.effort
                answer = self._cover.exact(int(times[at]), nodes, self._stop)
                self._spent += self._cover.effort - before
            if answer is not None and answer.runs is not None:
                accepted = self._accept(answer.runs)
                assert accepted, "a cover by runs that are no shorter"
                yield self._tell("run cover")
                return
            elif answer is not None and answer.none:
                self._bound_ms = int(times[at + 1]) if at + 1 < len(times) else last_ms + 1
                reach_ms *= 2
                yield self._tell("run cover")
            elif at == 0:
                return
            else:
                reach_ms //= 4

    def _tidy(self) -> Iterator[Improvement]:
        """Look for a plan as short with less robot time."""
        if self._runs is None or not self._jobs.count or self._stop():
            return
        pool = Pool(self._jobs, self._runs, self._best_ms, self._rng)
        before_ms = pool.total_ms
        pool.tidy(TIDY_SHUFFLES)
        self._spent += pool.looks * EFFORT_PER_LOOK_S
        if pool.total_ms < before_ms:
            self._runs = pool.runs
            yield self._tell("less robot time")


def _by_robot(jobs: Jobs, runs: Runs) -> Iterator[tuple[Crew, tuple[int, ...]]]:
    crews = [crew for crew in jobs.crews for _ in crew.robots]
    return zip(crews, runs, strict=True)


def _names(jobs: Jobs) -> list[str]:
    """Of all robots, in the order of runs."""
    return [name for crew in jobs.crews for name in crew.robots]


def _durations(crew: Crew, run: tuple[int, ...]) -> Iterator[int]:
    """How long each leg of a run takes."""
    row = crew.first_ms
    for leg in run:
        yield int(row[leg])
        if crew.end[leg] != SAME_ROW:
            row = crew.ms[crew.end[leg]]


def _end_ms(crew: Crew, run: tuple[int, ...]) -> int:
    return crew.start.ms + sum(_durations(crew, run))


def _solution(jobs: Jobs, runs: Runs) -> Solution:
    """What runs come to, step by step."""
    choices: dict[str, Label] = dict(jobs.choices)
    steps = list(jobs.steps)
    makespan_ms = jobs.least_ms
    for name, (crew, run) in zip(_names(jobs), _by_robot(jobs, runs), strict=True):
        if crew.start.leg is not None:
            steps += _steps(crew.start.leg, name, crew.start.leg_ms, 0, choices)
        at = crew.start.ms
        for leg, ms in zip(run, _durations(crew, run), strict=True):
            steps += _steps(crew.legs[leg], name, at, ms - crew.legs[leg].ms, choices)
            at += ms
        makespan_ms = max(makespan_ms, at)
    return Solution(
        choices=choices, steps=tuple(sorted(steps, key=lambda s: (s.start_ms, s.id))), makespan_ms=makespan_ms
    )


def _steps(leg: Leg, robot: str, at: int, travel_ms: int, choices: dict[str, Label]) -> Iterator[StartedStep]:
    """The steps of a leg that begins at a time; its choices are added to `choices`."""
    choices.update(leg.choices)
    choices.update(dict.fromkeys(leg.own, robot))
    for step in leg.steps:
        end = at + step.ms + (travel_ms if step.travels else 0)
        yield StartedStep(id=step.id, robots=(robot,) if step.robot else (), start_ms=at, end_ms=end)
        at = end


def _runs_of(jobs: Jobs, solution: Solution) -> Runs | None:
    """The runs that make up a solution; None if it is not one of this network."""
    started = {step.id: step for step in solution.steps}
    runs: list[tuple[int, ...]] = []
    found = 0
    crews = [crew for crew in jobs.crews for _ in crew.robots]
    for name, crew in zip(_names(jobs), crews, strict=True):
        legs = [i for i, leg in enumerate(crew.legs) if _is_done(leg, name, started, solution.choices)]
        legs.sort(key=lambda i: started[crew.legs[i].steps[0].id].start_ms)
        found += len({crew.legs[i].job for i in legs})
        runs.append(tuple(legs))
    return tuple(runs) if found == jobs.count == sum(map(len, runs)) else None


def _is_done(leg: Leg, robot: str, started: Mapping[str, StartedStep], choices: Mapping[str, Label]) -> bool:
    return (
        all(step.id in started and (robot in started[step.id].robots) == step.robot for step in leg.steps)
        and any(step.robot for step in leg.steps)
        and all(choices.get(choice) == label for choice, label in leg.choices)
        and all(choices.get(choice) == robot for choice in leg.own)
    )
