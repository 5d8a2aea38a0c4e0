"""Beginnings and ends of steps and processes, as the checker replays them: who may, what it changes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import floor

from kb.terms import Struct, Term, Var
from kb.vocabulary import Property
from planner.checking.demands import Demand, Demands
from planner.checking.knowledge import Knowledge
from planner.checking.moment import Binding, Moment, OnlyActingTells, Run, bound, shown

HERE = "here"
"""Where a robot is when the plan is made."""

MS_PER_S = 1000


class Refused(Exception):
    """A step or process may not begin now; the text says why."""


class Stage:
    """Who may do what when, and what is different afterwards."""

    def __init__(
        self, knowledge: Knowledge, demands: Demands, travel_times: Mapping[tuple[str, str, str], float], robots: int
    ) -> None:
        """Take what does not change.

        Args:
            travel_times: Seconds by (robot, from, to).
            robots: At most so many may take part.
        """
        self._knowledge = knowledge
        self._demands = demands
        self._travel_times = travel_times
        self._team = robots

    def begin_step(self, step_id: str, name: str, arguments: tuple[Term, ...], moment: Moment) -> Moment:
        """The moment after a step has started.

        Raises:
            Refused: It may not.
        """
        demand = self._demands.of(name)
        robots = self._may_begin(step_id, demand, arguments, moment)
        if step_id in moment.running:
            raise Refused(f"{step_id} is running already")
        for robot in robots:
            if robot in moment.busy:
                raise Refused(f"{robot} does {moment.busy[robot]} and {step_id} at once")
        team = moment.team.union(robots)
        if len(team) > self._team:
            raise Refused(f"{len(team)} robots take part; at most {self._team} may")
        takes_ms = self._duration_ms(demand, arguments, moment)
        worked_ms = self._worked(robots, takes_ms, moment)
        run = Run(name=name, arguments=arguments, robots=robots, end_ms=moment.now_ms + takes_ms)
        return replace(
            moment,
            running={**moment.running, step_id: run},
            busy={**moment.busy, **dict.fromkeys(robots, step_id)},
            claimed=self._claimed(step_id, demand, arguments, moment),
            team=team,
            worked_ms=worked_ms,
        )

    def end_step(self, step_id: str, moment: Moment) -> Moment:
        """The moment after a running step has succeeded."""
        run = moment.running[step_id]
        demand = self._demands.of(run.name)
        running, busy = dict(moment.running), dict(moment.busy)
        del running[step_id]
        for robot in run.robots:
            del busy[robot]
        return replace(
            moment,
            running=running,
            busy=busy,
            claimed=_released(step_id, demand, moment),
            fluents={**moment.fluents, **self._effects(demand, run.arguments)},
        )

    def begin_process(self, process_id: str, name: str, arguments: tuple[Term, ...], moment: Moment) -> Moment:
        """The moment after a composite process has begun.

        Raises:
            Refused: It may not.
        """
        demand = self._demands.of(name)
        robots = self._may_begin(process_id, demand, arguments, moment)
        claimed = self._claimed(process_id, demand, arguments, moment)
        if demand.keeps_robots:
            held = {**moment.held, **{r: process_id for r in robots if r not in moment.held}}
            return replace(moment, held=held, claimed=claimed)
        return moment if claimed is moment.claimed else replace(moment, claimed=claimed)

    def end_process(self, process_id: str, name: str, arguments: tuple[Term, ...], moment: Moment) -> Moment:
        """The moment after a composite process has ended."""
        demand = self._demands.of(name)
        if not (demand.keeps_robots or demand.claims or demand.effects):
            return moment
        return replace(
            moment,
            held={r: i for r, i in moment.held.items() if i != process_id},
            claimed=_released(process_id, demand, moment),
            fluents={**moment.fluents, **self._effects(demand, arguments)},
        )

    def changes(self, step_id: str, moment: Moment) -> dict[tuple[str, str], Term]:
        """What the end of a running step will set."""
        run = moment.running[step_id]
        return self._effects(self._demands.of(run.name), run.arguments)

    # Whether it may begin

    def _may_begin(self, step_id: str, demand: Demand, arguments: tuple[Term, ...], moment: Moment) -> tuple[str, ...]:
        """The robots of what may begin."""
        robots = tuple([str(arguments[n]) for n in demand.robots])
        if len(set(robots)) < len(robots):
            raise Refused(f"{step_id} needs {len(robots)} robots, and {robots[0]} is but one")
        for robot, capabilities in zip(robots, demand.capabilities, strict=True):
            if False in self._knowledge.values(Property.IS_REACHABLE, robot, moment):
                raise Refused(f"{robot} does {demand.name} but does not answer")
            for capability in sorted(capabilities):
                if not self._knowledge.is_a(robot, capability):
                    raise Refused(f"{robot} does {demand.name} but is no {capability}")
            holder = moment.held.get(robot)
            if holder is not None and not _within(step_id, holder):
                raise Refused(f"{step_id} comes between the steps of {holder}, which keeps its robot {robot}")
        binding = dict(zip(demand.parameters, arguments, strict=True))
        for claim in demand.claims:
            self._may_claim(step_id, str(bound(claim, binding)), moment)
        for condition in demand.preconditions:
            self._must_hold(step_id, demand, condition, binding, moment)
        return robots

    def _may_claim(self, step_id: str, resource: str, moment: Moment) -> None:
        holders = moment.claimed.get(resource, ())
        if any(_within(step_id, holder) for holder in holders):
            return  # it uses what the process around it has
        capacity = self._knowledge.number(Property.CAPACITY, resource, moment)
        if len(holders) >= (1 if capacity is None else capacity):
            raise Refused(f"{step_id} uses {resource} while {' and '.join(holders)} does")

    def _must_hold(self, step_id: str, demand: Demand, condition: Term, binding: Binding, moment: Moment) -> None:
        told = f"{written(bound(condition, binding))}, which {demand.name} needs"
        try:
            if not self._knowledge.holds(condition, binding, moment):
                raise Refused(f"{step_id} begins at {seconds(moment.now_ms)} without {told}")
        except OnlyActingTells as tells:
            raise Refused(f"{step_id} begins before {tells.place} is known, and so whether {told}") from None

    # How long it takes

    def _duration_ms(self, demand: Demand, arguments: tuple[Term, ...], moment: Moment) -> int:
        """Expected, done again until it succeeds: the mean of the geometric distribution is 1/odds tries."""
        way_ms = 0
        if demand.travel is not None:
            binding = dict(zip(demand.parameters, arguments, strict=True))
            robot, goal = (str(bound(term, binding)) for term in demand.travel)
            at = str(moment.fluents.get((Property.LOCATED_AT, robot), HERE))
            way_s = self._travel_times.get((robot, at, goal))
            if way_s is None:
                raise Refused(f"{robot} has no way from {at} to {goal}")
            way_ms = round(way_s * MS_PER_S)
        fixed_ms, odds = self._one_try(demand, arguments, moment)
        if odds == 1.0:
            return way_ms + fixed_ms
        return round(way_ms / odds) + round(fixed_ms / odds)

    def _one_try(self, demand: Demand, arguments: tuple[Term, ...], moment: Moment) -> tuple[int, float]:
        """What a try takes besides the travel, and its odds: of the robot here, else of the robot, else of all."""
        if not demand.measured:
            return demand.fixed_ms, demand.odds
        robot = str(arguments[demand.robots[0]])
        at = self._knowledge.values(Property.LOCATED_AT, robot, moment) if demand.place is None else ()
        place = str(arguments[demand.place]) if demand.place is not None else str(at[0]) if at else ""
        generally = demand.measured.get((robot, ""), (demand.fixed_ms, demand.odds))
        return demand.measured.get((robot, place), generally)

    def _worked(self, robots: Iterable[str], takes_ms: int, moment: Moment) -> Mapping[str, int]:
        """How long robots have worked; no longer than their energy lasts."""
        worked_ms = dict(moment.worked_ms)
        for robot in robots:
            worked_ms[robot] = worked_ms.get(robot, 0) + takes_ms
            energy_J = self._knowledge.number(Property.ENERGY_J, robot, moment)
            power_W = self._knowledge.number(Property.POWER_W, robot, moment)
            if energy_J is None or power_W is None or power_W <= 0:
                continue
            lasts_ms = floor(MS_PER_S * energy_J / power_W)
            if worked_ms[robot] > lasts_ms:
                worked, lasts = seconds(worked_ms[robot]), seconds(lasts_ms)
                raise Refused(f"{robot} works {worked} in all; its energy lasts for {lasts}")
        return worked_ms

    # What is different afterwards

    def _claimed(
        self, step_id: str, demand: Demand, arguments: tuple[Term, ...], moment: Moment
    ) -> Mapping[str, tuple[str, ...]]:
        if not demand.claims:
            return moment.claimed
        binding, claimed = dict(zip(demand.parameters, arguments, strict=True)), dict(moment.claimed)
        for claim in demand.claims:
            resource = str(bound(claim, binding))
            holders = claimed.get(resource, ())
            if not any(_within(step_id, holder) for holder in holders):
                claimed[resource] = (*holders, step_id)
        return claimed

    def _effects(self, demand: Demand, arguments: Sequence[Term]) -> dict[tuple[str, str], Term]:
        binding = dict(zip(demand.parameters, arguments, strict=True))
        return {(p, str(bound(s, binding))): bound(v, binding) for p, s, v in demand.effects}


def written(condition: Term) -> str:
    """A condition for people."""
    match condition:
        case Struct("all" | "any" as word, (list(parts),)):
            return f"{word} of ({', '.join(map(written, parts))})"
        case Struct("not", (part,)):
            return f"not {written(part)}"
        case Struct("holds", (prop, subject, value)):
            return f"{prop}({shown(subject)}) = {shown(value)}"
        case Struct("compare", (comparison, left, right)):
            return f"{written(left)} {str(comparison).replace('_', ' ')} {written(right)}"
        case Struct("value", (prop, subject)):
            return f"{prop}({shown(subject)})"
        case Struct("is_true", (place,)):
            return shown(place)
        case Struct("some", (list(over), part)):
            return f"some {', '.join(_named(v) for v in over)} with {written(part)}"
        case Struct("is_a", (individual, kind)):
            return f"{shown(individual)} is a {kind}"
        case Struct("same", (one, other)):
            return f"{shown(one)} is {shown(other)}"
        case Struct("plus" | "minus" | "times" as word, (one, other)):
            return f"({written(one)} {word} {written(other)})"
        case _:
            return shown(condition)


def _named(variable: Term) -> str:
    match variable:
        case Struct("-", (Var(name), kind)):
            return f"{kind} {name}"
        case _:
            return written(variable)


def _released(step_id: str, demand: Demand, moment: Moment) -> Mapping[str, tuple[str, ...]]:
    if not demand.claims:
        return moment.claimed
    return {r: tuple([i for i in holders if i != step_id]) for r, holders in moment.claimed.items()}


def _within(step_id: str, process_id: str) -> bool:
    return step_id.startswith(process_id) and step_id[len(process_id) : len(process_id) + 1] == "/"


def seconds(milliseconds: int) -> str:
    """A time for people."""
    return f"{milliseconds / MS_PER_S:.3f} s"
