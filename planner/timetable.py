"""Plans for networks in which robots wait for each other: list scheduling, then constraint programming with times.

First plans come from planner/dispatch.py. Large-neighborhood search makes it better; searches of the whole model
(planner/timetable_model.py), longer each time, raise the bound and end it: with an optimum, or with the proof that
there is no plan. Everything counts its work in CP-SAT's deterministic seconds: the same network, the same answers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from queue import Empty, SimpleQueue

import numpy as np
from ortools.sat.python import cp_model

from kb.errors import InternalError
from planner.dispatch import dispatch, sample
from planner.network import Improvement, Network, Solution
from planner.timetable_model import TimetableModel
from planner.timetable_neighborhoods import doings, neighborhood, pick
from planner.timetable_tasks import NEVER, grow, longest_ms, underway

AT_ONCE = 2
"""So many neighborhoods are searched at once, each by a thread. Other numbers give other plans."""

QUICK, THOROUGH = "reduced_costs", "max_lp"
"""Searches of the whole model, by CP-SAT's names. The first soon proves what is easy; the cuts of the second raise the
bound of tours several times faster than anything else. Each has one thread: with several, CP-SAT 9.15 has ended the
process ("Check failed: heuristics.fixed_search") where a model is closed while another thread is still reading it."""

SAMPLES, SAMPLING_EFFORT = 20, 0.15
"""So many list schedules are sampled, and as long as this takes."""

QUICK_EFFORT = 0.5
"""Effort of the quick search."""

FIRST_EFFORT = 2.0
"""Effort of the first thorough search, and of the neighborhoods after it; each later one has twice as much."""

NEIGHBORHOOD_EFFORT = 0.1
"""Effort of a search of a neighborhood, at most."""

LEAST_FREE, MOST_FREE = 4, 40
"""How many tasks of a neighborhood may be done by others."""

_POLL_S = 0.05
_SEED = 20
_EFFORT_PER_STEP_SQUARED = 1.7e-7
"""What a list schedule takes."""
_EFFORT_PER_SEARCH = 0.001
_EFFORT_PER_ARC = 1e-5
"""What it takes to make a model."""


def improve(
    network: Network, *, effort: float, stop: Callable[[], bool], start: Solution | None = None
) -> Iterator[Improvement]:
    """Tell of better and better plans, and of what no plan can do better than, until one is proven best.

    Args:
        network: What to plan.
        effort: Ends when so much work is done, in CP-SAT's deterministic seconds (about three CPU seconds each).
        stop: Asked every 50 ms; if it says so, it ends with what it has.
        start: A plan that is known, if any; a solution of this network or not.
    """
    run = _Run(network, effort, stop)
    try:
        yield from run.improvements(start)
    finally:
        run.close()


@dataclass(slots=True)
class _Found:
    """What a search has found out.

    Attributes:
        solution: The best; None: none.
        bound_ms: None of the network that it searched takes less, as far as it is within its horizon.
        ended: That is proven to be the optimum, or that there is none.
        effort: Of this search.
    """

    solution: Solution | None = None
    bound_ms: int = 0
    ended: bool = False
    effort: float = 0.0


class _Search(cp_model.CpSolverSolutionCallback):
    """One search of a model. It runs in a thread of its own; `news` gets what it finds meanwhile.

    Args:
        effort: At most.
        kind: What CP-SAT calls it; None: as is good for neighborhoods.
    """

    def __init__(
        self, model: TimetableModel, *, effort: float, kind: str | None = None, news: SimpleQueue[_Found] | None = None
    ) -> None:
        super().__init__()
        self._model = model
        self._news = news
        self._best = _Found()
        self._solver = cp_model.CpSolver()
        parameters = self._solver.parameters
        parameters.max_deterministic_time = effort
        parameters.num_workers = 1
        if kind is None:
            parameters.linearization_level = 0  # of little use where little is open
        else:
            parameters.subsolvers.append(kind)
        parameters.random_seed = _SEED
        parameters.cp_model_probing_level = 0  # on tours it takes longer than all the rest, and finds nothing
        self._solver.best_bound_callback = self._on_bound

    def run(self) -> _Found:
        status = self._solver.solve(self._model.vars.model, self)
        if status == cp_model.MODEL_INVALID:
            raise InternalError(f"the constraint model of a network is wrong: {self._solver.solution_info()}")
        best = self._best
        best.ended = status in (cp_model.OPTIMAL, cp_model.INFEASIBLE)
        best.effort = _EFFORT_PER_SEARCH + _EFFORT_PER_ARC * len(self._model.arcs)
        best.effort += self._solver.response_proto.deterministic_time
        if status in (cp_model.OPTIMAL, cp_model.FEASIBLE):
            self._on_bound(self._solver.best_objective_bound)
        return best

    def stop(self) -> None:
        self._solver.stop_search()

    def on_solution_callback(self) -> None:
        self._best.solution = self._model.solution(self.value)
        self._tell()

    def _on_bound(self, bound: float) -> None:
        self._best.bound_ms = max(self._best.bound_ms, round(bound) * self._model.vars.unit_ms)
        self._tell()

    def _tell(self) -> None:
        if self._news is not None:
            self._news.put(_Found(solution=self._best.solution, bound_ms=self._best.bound_ms))


class _Run:
    """All searches for one network.

    Attributes:
        best: The best plan so far.
        bound_ms: No plan takes less.
    """

    def __init__(self, network: Network, effort: float, stop: Callable[[], bool]) -> None:
        self._network = network
        self._root = grow(network)
        self._effort = effort
        self._stop = stop
        self._spent = 0.0
        self._stopped = False
        self._free = float(LEAST_FREE)
        self._rng = np.random.default_rng(_SEED)
        self._pool = ThreadPoolExecutor(AT_ONCE)
        self._running: dict[Future[_Found], _Search] = {}
        self.best: Solution | None = None
        self.bound_ms = 0

    def close(self) -> None:
        """End all threads."""
        self._stopped = True
        self._wait()
        self._pool.shutdown()

    def improvements(self, start: Solution | None) -> Iterator[Improvement]:
        """All that is found out, as it is found out."""
        if self._root.least_ms >= NEVER:
            yield Improvement(solution=None, bound_ms=0, unsolvable=True, phase="list schedule", effort=0.0)
            return
        self.bound_ms = max(self._root.least_ms, *(node.left_ms for node in underway(self._root)), 0)
        self._take(dispatch(self._network, self._root), self.bound_ms)
        yield self._improvement("list schedule")
        if start is not None and self._use(start):
            yield self._improvement("given")
        yield from self._sample()
        if self._goes_on():
            yield from self._search_all(QUICK_EFFORT, QUICK)
        effort = FIRST_EFFORT
        while self._goes_on():
            yield from self._search_all(effort, THOROUGH)
            if self.best is not None:
                yield from self._search_nearby(effort)
            effort *= 2

    def _goes_on(self) -> bool:
        self._stopped = self._stopped or self._stop()
        done = self.best is not None and self.best.makespan_ms <= self.bound_ms
        return not done and not self._stopped and self._spent < self._effort

    def _improvement(self, phase: str, more: float = 0.0, *, unsolvable: bool = False) -> Improvement:
        return Improvement(
            solution=self.best,
            bound_ms=self.bound_ms,
            unsolvable=unsolvable,
            phase=phase,
            effort=round(self._spent + more, 3),
        )

    def _take(self, solution: Solution | None, bound_ms: int = 0) -> bool:
        """Whether this is better than what is known; then it is what is known."""
        better = False
        if solution is not None and (self.best is None or solution.makespan_ms < self.best.makespan_ms):
            self.best, better = solution, True
        if bound_ms > self.bound_ms:
            self.bound_ms, better = bound_ms, True
        if self.best is not None:
            self.bound_ms = min(self.bound_ms, self.best.makespan_ms)
        return better

    def _use(self, start: Solution) -> bool:
        """Whether a plan from elsewhere, with who does what as it says, is better."""
        done = doings(self._root, start)
        if done is None:
            return False
        horizon_ms = start.makespan_ms if self.best is None else min(start.makespan_ms, self.best.makespan_ms - 1)
        model = TimetableModel(self._network, neighborhood(self._root, done, frozenset()), horizon_ms)
        if start.makespan_ms <= horizon_ms:
            model.vars.hint(start)
        (found,) = self._together([_Search(model, effort=NEIGHBORHOOD_EFFORT)])
        return self._take(found.solution)

    def _sample(self) -> Iterator[Improvement]:
        """Sample list schedules."""
        samples = sample(self._network, self._root, self._rng)
        for _ in range(SAMPLES):
            if self.best is None or self._spent >= SAMPLING_EFFORT or not self._goes_on():
                return
            self._spent += _EFFORT_PER_STEP_SQUARED * len(self.best.steps) ** 2
            if self._take(next(samples)):
                yield self._improvement("sampled list schedule")

    def _search_all(self, effort: float, kind: str) -> Iterator[Improvement]:
        """Search the whole model."""
        horizon_ms = longest_ms(self._root, self._network) if self.best is None else self.best.makespan_ms
        model = TimetableModel(self._network, self._root, horizon_ms)
        model.vars.model.add(model.span >= -(-self.bound_ms // model.vars.unit_ms))
        if self.best is not None:
            model.vars.hint(self.best)
        news: SimpleQueue[_Found] = SimpleQueue()
        limit = min(effort, self._effort - self._spent)
        search = _Search(model, effort=limit, kind=kind, news=news)
        future = self._begin(search)
        while not future.done() or not news.empty():
            try:
                found = news.get(timeout=_POLL_S)
            except Empty:
                self._poll()
                continue
            if self._take(found.solution, found.bound_ms):
                yield self._improvement("timetable", found.effort)
            self._poll()
        self._running.clear()
        found = future.result()
        self._spent += found.effort
        if found.ended and self.best is None:
            yield self._improvement("timetable", unsolvable=True)
            self._stopped = True
        elif found.ended and self.best is not None and self._take(None, self.best.makespan_ms):
            yield self._improvement("timetable")

    def _search_nearby(self, effort: float) -> Iterator[Improvement]:
        """Search neighborhoods of the best plan, several at once."""
        until = self._spent + effort
        while self._spent < until and self._goes_on():
            assert self.best is not None
            done = doings(self._root, self.best)
            assert done is not None
            if len(done) <= LEAST_FREE:
                return
            models = []
            for _ in range(AT_ONCE):
                free = pick(self._rng, done, round(self._free))
                root = neighborhood(self._root, done, free)
                model = TimetableModel(self._network, root, self.best.makespan_ms - 1)
                models.append(model)
            searches = [_Search(model, effort=NEIGHBORHOOD_EFFORT) for model in models]
            all_found = self._together(searches)
            self._spent += sum(found.effort for found in all_found)
            grown = self._free * (1.05 if all(found.ended for found in all_found) else 0.9)
            self._free = min(max(grown, LEAST_FREE), MOST_FREE)
            taken = [self._take(found.solution) for found in all_found]
            if any(taken):
                yield self._improvement("neighborhoods")

    def _begin(self, search: _Search) -> Future[_Found]:
        future = self._pool.submit(search.run)
        self._running[future] = search
        return future

    def _together(self, searches: Sequence[_Search]) -> list[_Found]:
        """What searches find that run at once."""
        futures = [self._begin(search) for search in searches]
        self._wait()
        return [future.result() for future in futures]

    def _wait(self) -> None:
        """Until all searches have ended. One that has not yet begun cannot be stopped, so they are told again."""
        while wait(self._running, timeout=_POLL_S).not_done:
            self._poll()
        self._running.clear()

    def _poll(self) -> None:
        self._stopped = self._stopped or self._stop()
        if self._stopped:
            for search in self._running.values():
                search.stop()
