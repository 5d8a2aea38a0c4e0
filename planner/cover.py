"""Covers: which robot takes which run, so that all jobs are done and all runs end by a horizon.

The fractional cover (a linear program over all runs, of which only those are written down that its prices ask for)
shows for short horizons that there is none. What it says is checked in integers: prices of jobs, such that no choice
of runs is worth as much as all jobs together, prove that there is no cover (Farkas' lemma), and up to which horizon.
It is so close that SCIP decides on the exact cover near that horizon after few nodes, mostly at the root.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ortools.linear_solver import pywraplp  # type: ignore[import-untyped]

from planner.ejection import Runs
from planner.jobs import Jobs
from planner.network import Milliseconds
from planner.runs import Integers, RunTable

_PRICE = 1_000_000
"""A price of 1 as an integer."""

_PER_CREW = 10
"""How many runs of a crew are added to the linear program at once."""

_TOLERANCE = 1e-6
_WHOLE = 0.99
"""So much of a run is all of it."""

_AT_ONCE = 16
"""Of so many crews, one more run is taken at once."""

_CHANCE = 0.3
"""In rounding, a run may be taken instead of one of which the fractional cover takes more by this."""

_POLL_S = 0.02
_EFFORT_PER_COLUMN_AND_PIVOT_S, _PIVOTS_AT_LEAST = 1.8e-7, 50
"""What SCIP's work counts for."""

_EFFORT_PER_ROUND_S, _EFFORT_PER_COLUMN_S, _EFFORT_PER_LP_COLUMN_S = 5e-4, 2e-8, 4e-6
"""What a round of pricing counts for, and each run looked at and each column of the linear program in it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What an exact cover came to.

    Attributes:
        runs: The runs, if there is a cover.
        none: There is no cover.
    """

    runs: Runs | None
    none: bool


class Cover:
    """Run tables of all crews for one horizon, and the linear program over them."""

    def __init__(self, jobs: Jobs, tables: Sequence[RunTable]) -> None:
        self.effort = 0.0
        self.horizon_ms = min(table.horizon_ms for table in tables)
        self._jobs = jobs
        self._tables = tables
        self._sizes = [len(crew.robots) for crew in jobs.crews]
        self._begun = [crew.start.begun for crew in jobs.crews]
        self._closed = all(table.closed for table in tables)
        self._added = [np.zeros(len(table.ms), dtype=bool) for table in tables]
        self._lp = pywraplp.Solver.CreateSolver("GLOP")
        self._runs_in: list[tuple[int, int, Any]] = []
        infinity = self._lp.infinity()
        # Cover as many jobs as possible: each at most once, and by as much as runs over it are taken.
        self._covered = [self._lp.Constraint(-infinity, 0.0) for _ in range(jobs.count)]
        for row in self._covered:
            job = self._lp.NumVar(0.0, 1.0, "")
            row.SetCoefficient(job, 1.0)
            self._lp.Objective().SetCoefficient(job, 1.0)
        self._lp.Objective().SetMaximization()
        self._one_each = [self._lp.Constraint(-infinity, float(size)) for size in self._sizes]
        self._team = self._lp.Constraint(-infinity, float(self._places_left()))

    def _places_left(self) -> int:
        return max(0, self._jobs.team - sum(self._begun))

    def raised(self, bound_ms: int, stop: Callable[[], bool]) -> Iterator[int]:
        """Raise a lower bound as far as the fractional cover does.

        Args:
            bound_ms: No plan is shorter.
            stop: Whether to give up.

        Yields:
            Better and better bounds; one beyond the horizon says no more than that.
        """
        while bound_ms <= self.horizon_ms and not stop():
            prices = self._price(bound_ms, stop)
            if prices is None:
                return
            bound_ms = self._proven(prices, bound_ms)
            yield bound_ms

    def times(self, bound_ms: int, limit_ms: int) -> Milliseconds:
        """All times from the bound to below the limit at which some run ends: a shortest plan takes one of them."""
        return np.unique(np.concatenate([t.ms[(t.ms >= bound_ms) & (t.ms < limit_ms)] for t in self._tables]))

    def columns(self, horizon_ms: int) -> int:
        """How many runs an exact cover is looked for among."""
        return sum(len(chosen) for chosen in self._choice(horizon_ms))

    def _choice(self, horizon_ms: int) -> list[Integers]:
        """By crew, the sets that matter within a horizon.

        Where with each set all its subsets are there, jobs may as well be covered twice, and the largest sets do.
        """
        if self._closed:
            return self._largest(horizon_ms)
        return [np.flatnonzero(table.ms <= horizon_ms) for table in self._tables]

    def _largest(self, horizon_ms: int) -> list[Integers]:
        return [np.flatnonzero((t.ms <= horizon_ms) & (horizon_ms < t.longer_ms)) for t in self._tables]

    def _price(self, horizon_ms: int, stop: Callable[[], bool]) -> Integers | None:
        """Prices of jobs that prove that there is no cover within a horizon; None: none found."""
        columns = self._largest(horizon_ms)
        rows = [table.jobs[chosen] for table, chosen in zip(self._tables, columns, strict=True)]
        looked_at = sum(row.size for row in rows)
        for crew, index, run in self._runs_in:
            if run.Lb() == 0.0:
                run.SetUb(1.0 if self._tables[crew].ms[index] <= horizon_ms else 0.0)
        while not stop():
            self._lp.Solve()
            self.effort += (
                _EFFORT_PER_ROUND_S
                + _EFFORT_PER_COLUMN_S * looked_at
                + _EFFORT_PER_LP_COLUMN_S * self._lp.NumVariables()
            )
            if self._lp.Objective().Value() > self._jobs.count - _TOLERANCE:
                return None
            prices = np.array([max(0, round(row.dual_value() * _PRICE)) for row in self._covered] + [0], dtype=np.int64)
            team_price = self._team.dual_value()
            crew_prices = [
                row.dual_value() + (0.0 if begun else team_price)
                for row, begun in zip(self._one_each, self._begun, strict=True)
            ]
            worths, added = [], 0
            for crew, (chosen, jobs) in enumerate(zip(columns, rows, strict=True)):
                worth = prices[jobs].sum(axis=1)
                worths.append(int(worth.max(initial=0)))
                dear = worth > (crew_prices[crew] + _TOLERANCE) * _PRICE
                good = np.flatnonzero(dear & ~self._added[crew][chosen])
                for i in good[np.argsort(-worth[good], kind="stable")[:_PER_CREW]].tolist():
                    self._add(crew, int(chosen[i]))
                    added += 1
            if self._worth(worths) < prices.sum():
                return prices
            if not added:
                return None
        return None

    def _add(self, crew: int, index: int) -> None:
        """Write a run down in the linear program."""
        table = self._tables[crew]
        self._added[crew][index] = True
        run = self._lp.NumVar(0.0, 1.0, "")
        self._runs_in.append((crew, index, run))
        self._one_each[crew].SetCoefficient(run, 1.0)
        if not self._begun[crew]:
            self._team.SetCoefficient(run, 1.0)
        for job in table.jobs[index, : table.size[index]].tolist():
            self._covered[job].SetCoefficient(run, -1.0)

    def _worth(self, worths: Sequence[int]) -> int:
        """The most that a choice of runs is worth, given the most that a run of each crew is."""
        begun = sum(worth for worth, begun in zip(worths, self._begun, strict=True) if begun)
        others = [
            worth
            for worth, size, begun in zip(worths, self._sizes, self._begun, strict=True)
            for _ in range(0 if begun else size)
        ]
        return begun + sum(sorted(others, reverse=True)[: self._places_left()])

    def _proven(self, prices: Integers, bound_ms: int) -> int:
        """The least horizon, beyond `bound_ms`, in which a choice of runs is worth as much as all jobs together."""
        total = int(prices.sum())
        values = []
        for table in self._tables:
            order = np.argsort(table.ms, kind="stable")
            worth = np.maximum.accumulate(prices[table.jobs[order]].sum(axis=1)) if len(order) else order
            values.append((table.ms[order], worth))
        times = self.times(bound_ms + 1, self.horizon_ms + 1)
        low, high = 0, len(times)
        while low < high:
            middle = (low + high) // 2
            worths = []
            for ms, worth in values:
                at = int(np.searchsorted(ms, times[middle], side="right"))
                worths.append(int(worth[at - 1]) if at else 0)
            low, high = (low, middle) if self._worth(worths) >= total else (middle + 1, high)
        return int(times[low]) if low < len(times) else self.horizon_ms + 1

    def dive(self, horizon_ms: int, rng: np.random.Generator, stop: Callable[[], bool]) -> Runs:
        """Round the fractional cover: take a run that it takes much of, solve what remains, and so on.

        Args:
            horizon_ms: At most that of the tables.
            rng: For which run is taken.
            stop: Whether to give up.

        Returns:
            Runs that end by the horizon, as a rule over nearly all jobs, none in two of them.
        """
        taken: list[tuple[int, int]] = []
        while not stop():
            self._price(horizon_ms, stop)
            if stop():
                break
            shares = [(run.solution_value(), crew, index, run) for crew, index, run in self._runs_in if run.Lb() < 1.0]
            shares = [share for share in shares if share[0] > _TOLERANCE]
            if not shares:
                break
            whole = [share for share in shares if share[0] > _WHOLE]
            lots = rng.random(len(shares)).tolist()
            order = sorted(range(len(shares)), key=lambda i: -shares[i][0] - _CHANCE * lots[i])
            for _, crew, index, run in whole or [shares[i] for i in order[: 1 + len(self._tables) // _AT_ONCE]]:
                if any(crew == other for other, _ in taken) and self._sizes[crew] == 1:
                    continue
                run.SetBounds(1.0, 1.0)
                taken.append((crew, index))
        for _, _, run in self._runs_in:
            run.SetBounds(0.0, 1.0)
        return self._runs(taken)

    def exact(self, horizon_ms: int, nodes: int, stop: Callable[[], bool]) -> Answer:
        """Look for a cover by runs that end by a horizon.

        Args:
            horizon_ms: At most that of the tables.
            nodes: Give up after so many nodes of branch and bound.
            stop: Whether to give up.
        """
        assert horizon_ms <= self.horizon_ms, "beyond the tables"
        program = pywraplp.Solver.CreateSolver("SCIP")
        infinity = program.infinity()
        covered = [program.Constraint(1.0, infinity if self._closed else 1.0) for _ in range(self._jobs.count)]
        team = program.Constraint(-infinity, float(self._places_left()))
        runs: list[tuple[int, int, Any]] = []
        for crew, (table, chosen) in enumerate(zip(self._tables, self._choice(horizon_ms), strict=True)):
            one_each = program.Constraint(-infinity, float(self._sizes[crew]))
            for index in chosen.tolist():
                run = program.IntVar(0.0, 1.0, "")
                runs.append((crew, index, run))
                one_each.SetCoefficient(run, 1.0)
                if not self._begun[crew]:
                    team.SetCoefficient(run, 1.0)
                for job in table.jobs[index, : table.size[index]].tolist():
                    covered[job].SetCoefficient(run, 1.0)
        program.SetSolverSpecificParametersAsString(f"limits/totalnodes = {nodes}\n")
        status = _solve(program, stop)
        self.effort += _EFFORT_PER_COLUMN_AND_PIVOT_S * len(runs) * (_PIVOTS_AT_LEAST + program.iterations())
        if status in (pywraplp.Solver.OPTIMAL, pywraplp.Solver.FEASIBLE):
            picked = [(crew, index) for crew, index, run in runs if run.solution_value() > 0.5]
            return Answer(runs=self._runs(picked), none=False)
        return Answer(runs=None, none=status == pywraplp.Solver.INFEASIBLE)

    def _runs(self, picked: Sequence[tuple[int, int]]) -> Runs:
        """The runs of a cover, each job in one of them; without those of which no run is left then."""
        done: set[int] = set()
        by_crew: list[list[tuple[int, ...]]] = [[] for _ in self._tables]
        for crew, index in picked:
            table = self._tables[crew]
            jobs = [job for job in table.jobs[index, : table.size[index]].tolist() if job not in done]
            left = table.find(jobs) if jobs else None
            if left is not None:
                done.update(jobs)
                by_crew[crew].append(table.legs(left))
        return tuple(
            run
            for size, found in zip(self._sizes, by_crew, strict=True)
            for run in (*found, *[()] * (size - len(found)))
        )


def _solve(program: Any, stop: Callable[[], bool]) -> int:
    """Run a solver in its own thread, so that `stop` is heard."""
    statuses: list[int] = []
    thread = threading.Thread(target=lambda: statuses.append(program.Solve()))
    thread.start()
    while thread.is_alive():
        thread.join(_POLL_S)
        if stop():
            program.InterruptSolve()
    return statuses[0]
