"""Tours: in what order a robot does its tasks, and how long it travels between them.

A tour is a circuit ([Miller, Tucker, Zemlin 1960], times being the potentials) through the visits that the robot makes;
those that neither travel nor move it are not part of it, but do not overlap the rest either.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from planner.network import Network
from planner.timetable_tasks import way_ms
from planner.timetable_variables import Given, Literal, Task, Variable, Variables


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Visit:
    """What a robot does as part of a task, in all modes that look the same to its tour.

    Attributes:
        modes: Numbers of these modes.
        on: Whether it does one of them.
        goal: Where it travels to; None: it does not, or follows another robot.
        edge: After which edge of the task it travels.
        end: Where it is afterwards; None: where it was.
    """

    task: Task
    modes: tuple[int, ...]
    on: Variable
    goal: str | None
    odds: float
    edge: int
    end: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Arc:
    """A robot does one task right after another; None: nothing is before the first one, or after the last one."""

    before: Task | None
    after: Task | None
    on: Variable


class Tour:
    """The tour of a robot in the model.

    Attributes:
        takes_part: Whether the robot does anything but being held.
        arcs: One of which leads to and from each task that it does.
    """

    def __init__(
        self,
        variables: Variables,
        network: Network,
        robot: str,
        visits: Sequence[Visit],
        *,
        place: str | None,
        free_ms: int,
        span: Variable,
    ) -> None:
        """Args:
        place: Where the robot is at first; None: where `Travel.here` counts from.
        free_ms: It begins with nothing before.
        span: The makespan.
        """
        self._vars = variables
        self._network = network
        self._robot = robot
        self._visits = visits
        self._movers = [visit for visit in visits if visit.goal is not None or visit.end is not None]
        self._place = place
        self._free = free_ms // variables.unit_ms
        self._orders: dict[int, Mapping[int, int]] = {}
        self._ways: list[tuple[Variable, int]] = []
        self._rides: list[Variable] = []
        self._load: list[tuple[Variable, int]] = []
        self.arcs: list[Arc] = []
        self.takes_part = variables.literal()
        work = [on for v in visits for m in v.modes if robot in v.task.modes[m].workers for on in [v.task.on[m]]]
        variables.guess(self.takes_part, lambda g: max((g[on] for on in work), default=0))
        for on in work:
            variables.model.add_implication(on, self.takes_part)
        if self._movers:
            self._circuit()
        self._bound_load(span)

    def _circuit(self) -> None:
        model = self._vars.model
        rests = self._vars.literal()
        self._vars.guess(rests, lambda g: int(not any(g[visit.on] for visit in self._movers)))
        places = [None, *self._movers]
        # Where the robot is after visits that leave it where it was, as a row of `_row`.
        at: dict[int, Variable] = {}
        for j, after in enumerate(self._movers, start=1):
            if after.end is None:
                at[j] = model.new_int_var(0, len(self._network.travel.places), "")
                self._vars.guess(at[j], lambda g, j=j: self._row(self._place_after(g, j)))  # type: ignore[misc]
        circuit: list[tuple[int, int, Literal]] = [(0, 0, rests)]
        kept = sorted(
            (visit.task.kept_ms, j) for j, visit in enumerate(self._movers, start=1) if visit.task.kept_ms is not None
        )
        # Of what keeps its order: what is next; nothing of it is between.
        follows = {i: j for (_, i), (_, j) in zip([((), 0), *kept], [*kept, ((), 0)], strict=True)}
        for j, after in enumerate(self._movers, start=1):
            circuit.append((j, j, ~after.on))
            if follows.get(j, 0) == 0:
                circuit.append((j, 0, self._arc(j, 0)))
            for i, before in enumerate(places):
                if before is not None and not may_follow(before.task, after.task):
                    continue
                if i in follows and j in follows and follows[i] != j:
                    continue
                known = before is None or before.end is not None
                place = self._place if before is None else before.end
                way = self._way(place, after) if known else 0
                if way is None:
                    continue
                arc = self._arc(i, j)
                circuit.append((i, j, arc))
                if before is None:
                    model.add(after.task.start >= self._free).only_enforce_if(arc)
                else:
                    model.add(after.task.start >= before.task.end).only_enforce_if(arc)
                if after.end is None:
                    model.add(at[j] == (self._row(place) if known else at[i])).only_enforce_if(arc)
                if after.goal is not None:
                    self._travel(arc, after, way if known else self._ride(at[i], after, arc, (i, j)))
        model.add_circuit(circuit)

    def _arc(self, i: int, j: int) -> Variable:
        arc = self._vars.literal()
        self._vars.guess(arc, lambda g: int(self._successors(g).get(i) == j))
        before, after = (None if n == 0 else self._movers[n - 1].task for n in (i, j))
        self.arcs.append(Arc(before=before, after=after, on=arc))
        return arc

    def _successors(self, given: Given) -> Mapping[int, int]:
        """Which visit a solution has after which one; 0 is where the tour begins and ends."""
        if id(given) not in self._orders:
            tasks = {i: visit.task for i, visit in enumerate(self._movers, start=1) if given[visit.on]}
            order = sorted(tasks, key=lambda i: (given[tasks[i].start], given[tasks[i].end]))
            self._orders = {id(given): dict(zip([0, *order], [*order, 0], strict=True))}
        return self._orders[id(given)]

    def _place_after(self, given: Given, j: int) -> str | None:
        """Where a solution has the robot after a visit."""
        place, i = self._place, 0
        successors = self._successors(given)
        while i != j and successors.get(i, 0) != 0:
            i = successors[i]
            end = self._movers[i - 1].end
            place = place if end is None else end
        return place

    def _travel(self, arc: Variable, after: Visit, way: Variable | int) -> None:
        after.task.ways.append((after.edge, arc, way))
        if isinstance(way, int):
            self._ways.append((arc, way))
        else:
            self._rides.append(way)

    def _way(self, place: str | None, after: Visit) -> int | None:
        """How long it travels from a place to a visit."""
        if after.goal is None:
            return 0
        ms = way_ms(self._network.travel, self._robot, place, after.goal, after.odds)
        return None if ms is None else ms // self._vars.unit_ms

    def _row(self, place: str | None) -> int:
        places = self._network.travel.places
        return len(places) if place is None else places.index(place)

    def _ride(self, at: Variable, after: Visit, arc: Variable, ends: tuple[int, int]) -> Variable:
        """How long it travels by an arc from where something before has left it; 0 if it does not."""
        ways = [self._way(place, after) for place in (*self._network.travel.places, None)]
        ride = self._vars.model.new_int_var(0, max((way for way in ways if way is not None), default=0), "")
        rows = [(row, way, 1) for row, way in enumerate(ways) if way is not None]
        rows += [(row, 0, 0) for row in range(len(ways))]
        self._vars.model.add_allowed_assignments([at, ride, arc], rows)
        self._vars.guess(ride, lambda g: (ways[g[at]] or 0) if g[arc] else 0)
        return ride

    def _bound_load(self, span: Variable) -> None:
        """What the robot does takes no longer than the plan; with what comes before and after, if it has one tour."""
        unit = self._vars.unit_ms
        load = [(visit.task.on[m], visit.task.modes[m].ms // unit) for visit in self._visits for m in visit.modes]
        if len(self._movers) == len(self._visits):
            for arc in self.arcs:
                if arc.before is None and arc.after is not None:
                    load.append((arc.on, max(self._free, arc.after.head_ms // unit)))
                if arc.after is None and arc.before is not None:
                    load.append((arc.on, arc.before.tail_ms // unit))
        self._vars.model.add(sum(on * ms for on, ms in [*load, *self._ways]) + sum(self._rides) <= span)

    def limit_work(self) -> None:
        """It works no longer than it can; once all tours are made, since where another robot travels, it goes along."""
        limit_ms = self._network.robots[self._robot].work_ms
        if limit_ms is None:
            return
        work: list[tuple[Variable, int]] = list(self._ways)
        rides = list(self._rides)
        for visit in self._visits:
            modes = visit.task.modes
            work += ((visit.task.on[m], modes[m].work_ms // self._vars.unit_ms) for m in visit.modes)
            if visit.goal is None and any(modes[m].goal is not None for m in visit.modes):
                rides.append(self._along(visit))
        self._vars.model.add(sum(on * ms for on, ms in work) + sum(rides) <= limit_ms // self._vars.unit_ms)

    def _along(self, visit: Visit) -> Variable:
        along, task = self._vars.time(), visit.task
        way = sum(way * arc if isinstance(way, int) else way for _, arc, way in task.ways)
        self._vars.model.add(along >= way).only_enforce_if(visit.on)
        self._vars.guess(along, lambda g: g[visit.on] * task.way(g.__getitem__))
        return along


def may_follow(before: Task, after: Task) -> bool:
    """Whether both may be done, in this order, by what they are in."""
    if before is after:
        return False
    for (a, i, ordered), (b, j, _) in zip(before.path, after.path, strict=False):
        if a != b:
            return True
        if i != j:
            return ordered and i < j
    return True
