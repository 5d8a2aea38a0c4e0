"""The constraint model of a network: when is what done, by whom, and who comes after whom.

Tasks (planner/timetable_tasks.py) have a literal for each mode, and times for their edges. Robots make tours through
them (planner/timetable_tours.py). Resources are disjunctive, or cumulative where their capacity is more than one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import gcd

from ortools.sat.python import cp_model

from planner.network import (
    Alternatives,
    AnyOrder,
    Claimed,
    Deadline,
    Held,
    InSequence,
    Label,
    Network,
    Node,
    SideBySide,
    Solution,
    StartedStep,
    Step,
    Underway,
)
from planner.timetable_tasks import FREE, NEVER, TAKE, Branch, Mode, is_begun, way_ms
from planner.timetable_tours import Arc, Tour, Visit
from planner.timetable_variables import Given, Path, Task, Variable, Variables


@dataclass(frozen=True, slots=True, kw_only=True)
class _In:
    """What holds for all that is in a node.

    Attributes:
        after: It begins no earlier.
        symbols: `?ID` -> robot -> whether it is chosen for it.
        holders: Robots that are held by what is around.
        claims: Resources that what is around has.
    """

    present: Variable
    after: Variable
    path: Path = ()
    symbols: Mapping[str, Mapping[str, Variable]]
    holders: frozenset[str] = frozenset()
    claims: frozenset[str] = frozenset()
    head_ms: int = 0
    tail_ms: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Stretch:
    """Between two edges of a task, this one and the next one, its modes take so long, travel not counted.

    Attributes:
        tight: And no longer.
    """

    task: Task
    edge: int
    took: tuple[int, ...]
    tight: bool


class TimetableModel:
    """The constraint model of a network.

    Attributes:
        vars: All that the solver is given.
        span: The makespan.
        tasks: In the order in which they are written.
        arcs: All arcs of tours.
    """

    def __init__(self, network: Network, root: Branch, horizon_ms: int) -> None:
        self.vars = Variables(unit_of(network, root), horizon_ms)
        self.tasks: list[Task] = []
        self.arcs: list[Arc] = []
        self._network = network
        self._model = self.vars.model
        self._forks: list[tuple[Alternatives, Mapping[tuple[int, Label], Variable], Variable]] = []
        self._orders: list[tuple[AnyOrder, Sequence[tuple[Variable, Variable]], Variable]] = []
        self._nodes = 0
        self._begun: set[str] = set()
        self._free_ms: dict[str, int] = {}
        self._place: dict[str, str | None] = {name: robot.at for name, robot in network.robots.items()}
        self._visits: dict[str, list[Visit]] = {}
        self._busy: dict[str, list[cp_model.IntervalVar]] = {}
        self._outer: dict[str, list[cp_model.IntervalVar]] = {}
        self._used: dict[str, list[cp_model.IntervalVar]] = {}
        self._kept: dict[str, list[tuple[int, Variable, Variable]]] = {}
        self._stretches: list[_Stretch] = []
        self.span = self.vars.time()
        everything = _In(present=self.vars.always, after=self.vars.zero, symbols={})
        end = self._add(root, everything)
        self._model.add(self.span >= end)
        for free_ms in self._free_ms.values():
            self._model.add(self.span >= free_ms // self.vars.unit_ms)
        least = max(self._free_ms.values(), default=0) // self.vars.unit_ms
        self.vars.guess(self.span, lambda g: max(least, g[end]))
        self._add_tours()
        self._add_durations()
        self._add_resources()
        self._model.minimize(self.span)

    # ------------------------------------------------------------------------------------------- nodes

    def _add(self, branch: Branch, within: _In) -> Variable:
        """Take in a part of the network; when it has ended."""
        if branch.modes is not None:
            return self._add_task(branch.modes, branch.kept_ms, within)
        self._nodes += 1
        parts = branch.parts
        match branch.node:
            case InSequence():
                return self._add_sequence(parts, within)
            case SideBySide():
                ends = [self._add(part, within) for part in parts]
                return self.vars.latest(ends) if ends else within.after
            case AnyOrder() as node:
                return self._add_any_order(node, parts, within)
            case Alternatives() as node:
                return self._add_fork(node, parts, within)
            case Held(robot=robot):
                return self._add_held(robot, parts[0], within)
            case Claimed(claims=claims):
                return self._add_claimed(claims, parts[0], within)
            case Deadline(ms=ms):
                end = self._add(parts[0], within)
                self._model.add(end <= ms // self.vars.unit_ms).only_enforce_if(within.present)
                return end
            case Underway() as node:
                return self._add_underway(node, within)
            case Step():
                raise AssertionError("a step is a task")

    def _add_sequence(self, parts: Sequence[Branch], within: _In) -> Variable:
        number, after = self._nodes, within.after
        for i, part in enumerate(parts):
            inner = replace(
                within,
                after=after,
                path=(*within.path, (number, i, True)),
                head_ms=within.head_ms + sum(p.least_ms for p in parts[:i]),
                tail_ms=within.tail_ms + sum(p.least_ms for p in parts[i + 1 :]),
            )
            after = self._add(part, inner)
        return after

    def _add_any_order(self, node: AnyOrder, parts: Sequence[Branch], within: _In) -> Variable:
        if not parts:
            return within.after
        spans = []
        for part in parts:
            start, end, _ = self._add_span(part, within)
            spans.append((start, end))
        self._model.add_no_overlap(self.vars.interval(start, end, within.present) for start, end in spans)
        self._orders.append((node, spans, within.present))
        return self.vars.latest([end for _, end in spans])

    def _add_fork(self, node: Alternatives, parts: Sequence[Branch], within: _In) -> Variable:
        number = self._nodes
        options = [(i, o, part) for i, (o, part) in enumerate(zip(node.options, parts, strict=True))]
        options = [(i, option, part) for i, option, part in options if part.least_ms < NEVER]
        chosen = {(i, label): self.vars.literal() for i, option, _ in options for label in option.labels}
        self._model.add(sum(chosen.values()) == within.present)
        self._forks.append((node, chosen, within.present))
        for (i, label), literal in chosen.items():
            self.vars.guess(literal, partial(_is_chosen, node=node, option=i, label=label, present=within.present))
        end = self.vars.time()
        self._model.add(end >= within.after)
        ends = []
        for i, option, part in options:
            labels = {str(label): chosen[i, label] for label in option.labels}
            present = self.vars.one_of(list(labels.values()))
            symbols = {**within.symbols, f"?{node.id}": labels} if len(labels) > 1 else within.symbols
            inner = replace(within, present=present, path=(*within.path, (number, i, False)), symbols=symbols)
            inner_end = self._add(part, inner)
            self._model.add(end >= inner_end).only_enforce_if(present)
            ends.append((present, inner_end))
        self.vars.guess(end, lambda g: max([g[within.after], *(g[e] for present, e in ends if g[present])]))
        return end

    def _add_span(self, part: Branch, within: _In) -> tuple[Variable, Variable, Variable | None]:
        """From when to when a part has what it has, and whether it has a step at all; None: it never has."""
        start, since = self.vars.time(), len(self.tasks)
        self._model.add(start >= within.after)
        end = self._add(part, replace(within, after=start))
        inside = self.tasks[since:]
        if is_begun(part):
            self.vars.guess(start, lambda _: 0)
            return self.vars.begun, end, within.present
        self.vars.guess(start, lambda g: min((g[t.start] for t in inside if g[t.present]), default=g[within.after]))
        if any(task.present.index == within.present.index for task in inside):
            return start, end, within.present
        return start, end, self.vars.some_of([task.present for task in inside]) if inside else None

    def _add_held(self, robot: str, part: Branch, within: _In) -> Variable:
        holders = within.symbols.get(robot, {robot: within.present})
        start, end, begun = self._add_span(part, replace(within, holders=within.holders | set(holders)))
        for name, chosen in holders.items():
            if begun is not None and name not in within.holders and name in self._network.robots:
                held = self.vars.interval(start, end, self.vars.both(chosen, begun))
                self._outer.setdefault(name, []).append(held)
        return end

    def _add_claimed(self, claims: Sequence[str], part: Branch, within: _In) -> Variable:
        start, end, begun = self._add_span(part, replace(within, claims=within.claims | set(claims)))
        for claim in dict.fromkeys(claims):
            if begun is not None and claim not in within.claims:
                self._used.setdefault(claim, []).append(self.vars.interval(start, end, begun))
        return end

    def _add_underway(self, node: Underway, within: _In) -> Variable:
        self._model.add(within.after <= 0).only_enforce_if(within.present)
        interval = self._model.new_fixed_size_interval_var(-1, node.left_ms // self.vars.unit_ms + 1, "")
        for i, robot in enumerate(node.robots):
            self._begun.add(robot)
            self._free_ms[robot] = max(node.left_ms, self._free_ms.get(robot, 0))
            if node.ends and node.ends[i] is not None:
                self._place[robot] = node.ends[i]
            self._busy.setdefault(robot, []).append(interval)
            if robot not in within.holders:
                self._outer.setdefault(robot, []).append(interval)
        for claim in node.claims:
            if claim not in within.claims:
                self._used.setdefault(claim, []).append(interval)
        return self.vars.constant(node.left_ms // self.vars.unit_ms)

    # ------------------------------------------------------------------------------------------- tasks

    def _add_task(self, modes: tuple[Mode, ...], kept_ms: tuple[int, ...] | None, within: _In) -> Variable:
        on = (within.present,) if len(modes) == 1 else tuple(self.vars.literal() for _ in modes)
        size = max((len(mode.edges) for mode in modes), default=2)
        task = Task(
            modes=modes,
            on=on,
            present=within.present,
            times=tuple(self.vars.time() for _ in range(size)),
            path=within.path,
            head_ms=within.head_ms,
            tail_ms=within.tail_ms,
            kept_ms=kept_ms,
        )
        self.tasks.append(task)
        if len(modes) != 1:
            self._model.add(sum(on) == within.present)
            for m, literal in enumerate(on):
                self.vars.guess(literal, partial(_is_mode, task=task, number=m))
        for literal, mode in zip(on, modes, strict=True):
            for symbol, robot in mode.given:
                self._model.add_implication(literal, within.symbols[symbol][robot])
        for k, time in enumerate(task.times):
            self.vars.guess(time, partial(_edge, task=task, edge=k, absent=self.vars.horizon))
        unit_ms = self.vars.unit_ms
        self._model.add(task.start >= within.after)
        self._model.add(task.start >= within.head_ms // unit_ms).only_enforce_if(within.present)
        self._model.add(task.end + within.tail_ms // unit_ms <= self.span).only_enforce_if(within.present)
        self._add_uses(task, within.claims)
        self._add_visits(task, within.holders)
        return task.end

    def _add_uses(self, task: Task, had: frozenset[str]) -> None:
        """When it uses which resources, and how long it takes between its edges."""
        windows: dict[tuple[str, int, int], list[int]] = {}
        for m, mode in enumerate(task.modes):
            for use in mode.uses:
                if use.resource not in had:
                    edges = mode.edges.index((use.first, TAKE)), mode.edges.index((use.last + 1, FREE))
                    windows.setdefault((use.resource, *edges), []).append(m)
        for (resource, a, b), numbers in windows.items():
            used = self.vars.interval(task.times[a], task.times[b], self._on(task, numbers))
            self._used.setdefault(resource, []).append(used)
            if task.kept_ms is not None:
                self._kept.setdefault(resource, []).append((task.kept_ms[a], task.times[a], task.times[b]))
        for k in range(len(task.times) - 1):
            took = tuple(_took_ms(mode, k) // self.vars.unit_ms for mode in task.modes)
            # Whoever uses a resource and does one thing only meanwhile does not wait before it lets go of it.
            only = {m for (_, a, b), numbers in windows.items() if (a, b) == (k, k + 1) for m in numbers}
            self._stretches.append(_Stretch(task=task, edge=k, took=took, tight=len(only) == len(task.modes)))

    def _on(self, task: Task, modes: Sequence[int]) -> Variable:
        """Whether a task is done in one of these modes."""
        return task.present if len(modes) == len(task.modes) else self.vars.one_of([task.on[m] for m in modes])

    def _add_visits(self, task: Task, holders: frozenset[str]) -> None:
        alike: dict[tuple[str, str | None, float, int, str | None], list[int]] = {}
        by_robot: dict[str, list[int]] = {}
        for m, mode in enumerate(task.modes):
            for i, robot in enumerate(mode.robots):
                goal = mode.goal if i == 0 else None
                alike.setdefault((robot, goal, mode.odds, _way_edge(mode), mode.ends[i]), []).append(m)
                by_robot.setdefault(robot, []).append(m)
        for (robot, goal, odds, edge, end), modes in alike.items():
            on = self._on(task, modes)
            visit = Visit(task=task, modes=tuple(modes), on=on, goal=goal, odds=odds, edge=edge, end=end)
            self._visits.setdefault(robot, []).append(visit)
        for robot, modes in by_robot.items():
            interval = self.vars.interval(task.start, task.end, self._on(task, modes))
            self._busy.setdefault(robot, []).append(interval)
            if robot not in holders:
                self._outer.setdefault(robot, []).append(interval)

    # ------------------------------------------------------------------------- what ties tasks together

    def _add_tours(self) -> None:
        tours = {
            robot: Tour(
                self.vars,
                self._network,
                robot,
                visits,
                place=self._place[robot],
                free_ms=self._free_ms.get(robot, 0),
                span=self.span,
            )
            for robot, visits in self._visits.items()
        }
        for tour in tours.values():
            tour.limit_work()
            self.arcs += tour.arcs
        for robot in self._network.robots:
            busy, outer = self._busy.get(robot, []), self._outer.get(robot, [])
            self._model.add_no_overlap(busy)
            if outer != busy:
                self._model.add_no_overlap(outer)
        joining = [tour.takes_part for robot, tour in tours.items() if robot not in self._begun]
        if len(joining) + len(self._begun) > self._network.team:
            self._model.add(sum(joining) <= self._network.team - len(self._begun))

    def _add_durations(self) -> None:
        for stretch in self._stretches:
            task, k = stretch.task, stretch.edge
            terms = [on * ms for on, ms in zip(task.on, stretch.took, strict=True)]
            terms += (arc * way if isinstance(way, int) else way for edge, arc, way in task.ways if edge == k)
            took = cp_model.LinearExpr.sum(terms)
            if stretch.tight:
                self._model.add(task.times[k + 1] == task.times[k] + took)
            else:
                self._model.add(task.times[k + 1] >= task.times[k] + took)

    def _add_resources(self) -> None:
        for resource, uses in self._used.items():
            capacity = self._network.capacity.get(resource, 1)
            if capacity == 1:
                self._model.add_no_overlap(uses)
                kept = sorted(self._kept.get(resource, []), key=lambda use: use[0])
                for (_, _, end), (_, start, _) in pairwise(kept):
                    self._model.add(end <= start)
            else:
                self._model.add_cumulative(uses, [1] * len(uses), capacity)

    # ---------------------------------------------------------------------------------------- solutions

    def solution(self, value: Callable[[Variable], int]) -> Solution:
        """What the values of the variables say."""
        choices: dict[str, Label] = {}
        for fork, chosen, present in self._forks:
            if value(present) and fork.id is not None:
                choices[fork.id] = next(label for (_, label), literal in chosen.items() if value(literal))
        for order, spans, present in self._orders:
            if value(present):
                numbered = sorted((value(start), value(end), n) for n, (start, end) in enumerate(spans, start=1))
                choices |= {f"{order.id}/{len(numbered) - i}": n for i, (_, _, n) in enumerate(numbered)}
        steps: list[StartedStep] = []
        for task in self.tasks:
            if value(task.present):
                mode = next(mode for mode, on in zip(task.modes, task.on, strict=True) if value(on))
                choices.update(mode.choices)
                steps += self._steps(task, mode, value)
        in_order = sorted(enumerate(steps), key=lambda s: (s[1].start_ms, s[1].end_ms, s[0]))
        return Solution(
            choices=choices,
            steps=tuple(step for _, step in in_order),
            makespan_ms=value(self.span) * self.vars.unit_ms,
        )

    def _steps(self, task: Task, mode: Mode, value: Callable[[Variable], int]) -> list[StartedStep]:
        """The steps of a task, each as soon as it can be."""
        edges = dict(zip(mode.edges, (value(time) * self.vars.unit_ms for time in task.times), strict=False))
        way_ms = task.way(value) * self.vars.unit_ms
        steps = []
        at_ms = 0
        for n, piece in enumerate(mode.pieces):
            start_ms = max(at_ms, edges.get((n, TAKE), 0))
            at_ms = start_ms + piece.ms + (way_ms if piece.travels else 0)
            steps.append(StartedStep(id=piece.id, robots=piece.robots, start_ms=start_ms, end_ms=at_ms))
        return steps


def unit_of(network: Network, root: Branch) -> int:
    """The greatest unit, in ms, of which all durations are multiples."""
    unit, todo = 0, [root]
    travels = set()
    while todo:
        branch = todo.pop()
        todo += branch.parts
        if isinstance(branch.node, Underway):
            unit = gcd(unit, branch.node.left_ms)
        for mode in branch.modes or ():
            unit = gcd(unit, *(piece.ms for piece in mode.pieces))
            if mode.goal is not None:
                travels.add((mode.robots[0], mode.goal, mode.odds))
    for robot, goal, odds in travels:
        for place in (*network.travel.places, None):
            unit = gcd(unit, way_ms(network.travel, robot, place, goal, odds) or 0)
    return max(unit, 1)


def _took_ms(mode: Mode, k: int) -> int:
    """How long its pieces between two edges take, without the travel."""
    edges = mode.edges
    return sum(piece.ms for piece in mode.pieces[edges[k][0] : edges[k + 1][0]]) if k + 1 < len(edges) else 0


def _way_edge(mode: Mode) -> int:
    """The last edge before it travels; 0 if it does not."""
    travels = next((n for n, piece in enumerate(mode.pieces) if piece.travels), 0)
    return max(k for k, (piece, _) in enumerate(mode.edges[:-1]) if piece <= travels)


def _is_mode(given: Given, *, task: Task, number: int) -> int:
    return int(given[task.present] == 1 and given.mode(task) == number)


def _edge(given: Given, *, task: Task, edge: int, absent: int) -> int:
    return given.edge(task, edge) if given[task.present] else absent


def _is_chosen(given: Given, *, node: Alternatives, option: int, label: Label, present: Variable) -> int:
    """Whether a solution takes an option; where the program decides, the one of which it has steps."""
    if not given[present]:
        return 0
    if node.id is not None:
        return int(given.choices.get(node.id) == label)
    return int(option == next((i for i, o in enumerate(node.options) if _ids(o.node) & given.steps.keys()), 0))


def _ids(node: Node) -> set[str]:
    match node:
        case Step(id=id_) | Underway(id=id_):
            return {id_}
        case InSequence(parts=parts) | SideBySide(parts=parts) | AnyOrder(parts=parts):
            return {id_ for part in parts for id_ in _ids(part)}
        case Alternatives(options=options):
            return {id_ for option in options for id_ in _ids(option.node)}
        case Held(part=part) | Claimed(part=part) | Deadline(part=part):
            return _ids(part)
