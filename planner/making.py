"""Making a plan: solvers propose, Golog executes what they propose, the checker accepts it.

Every plan comes out of an execution of the program (planner/golog/replay.pl, planner/golog/search.pl),
whatever proposed it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from kb.prolog import Entry
from kb.terms import Term, struct
from planner.network import NO_WAY, Improvement, Network, Solution, Travel, claims_of
from planner.plan import Plan, PlannedStep, PlanStatus, Progress

MAX_NODES = 30_000
"""Budget of the exact search: configurations, not seconds, so that the same request has the same answer everywhere."""

HERE = "here"
"""Where a robot is when the plan is made."""

MS_PER_S = 1000
_NO_LIMIT = -1

_search_plan = Entry(search_path="planner_golog", file="planning", name="search_plan")
_cover_plan = Entry(search_path="planner_golog", file="planning", name="cover_plan")
_propose = Entry(search_path="planner_golog", file="planning", name="propose")
_present_plan = Entry(search_path="planner_golog", file="planning", name="present_plan")


class Making:
    """One run of planning: turns what solvers find into plans."""

    def __init__(
        self,
        key: str,
        *,
        now_s: float,
        steps: Callable[[Sequence[Sequence[Any]]], tuple[PlannedStep, ...]],
        checked: Callable[[Plan], Plan],
    ) -> None:
        """Make plans for a session.

        Args:
            key: Of the session; it has looked ahead.
            steps: Reads the rows of a plan's steps.
            checked: Returns a plan that the independent checker accepts, and raises for one that it does not.
        """
        self._key = key
        self._now_s = now_s
        self._steps = steps
        self._checked = checked
        self._history: list[Progress] = []

    def impossible(self) -> Plan:
        """There is nothing that could be done."""
        return self._none(PlanStatus.UNSOLVABLE_PROVEN, "the program has no execution: no choice leads to its end")

    @staticmethod
    def unsupported(why: str, *, now_s: float) -> Plan:
        """It cannot be looked ahead."""
        return _none(PlanStatus.UNSUPPORTED, why, now_s)

    def searched(self, best: Plan | None = None) -> Plan:
        """By exact search over executions; at least as good as the best plan so far."""
        limit = _NO_LIMIT if best is None else round(best.makespan_s * MS_PER_S)
        found = self.answered(_search_plan(struct("search", self._key, MAX_NODES, limit)), "best-first search")
        assert found is not None
        return found

    def answered(self, answer: Mapping[str, Any], phase: str) -> Plan | None:
        """What Prolog answers, as a plan; None if the solver is not made for this program."""
        status, nodes = answer["status"], answer["nodes"]
        match status:
            case "no_network":
                return None
            case "unsolvable_proven":
                why = f"the program has no execution ({nodes} configurations, all looked into)"
                return replace(self._none(PlanStatus.UNSOLVABLE_PROVEN, why), nodes=nodes)
            case "unsolvable_incompletely":
                why = f"no execution was found within the budget of {nodes} configurations"
                return replace(self._none(PlanStatus.UNSOLVABLE_INCOMPLETELY, why), nodes=nodes)
            case _:
                return self._plan(answer, answer["bound"], phase, nodes=nodes, pruned=answer["pruned"])

    def present(self) -> Plan | None:
        """The plan that is being done already, from now on; None if there is none or it has become impossible."""
        answer = _present_plan(self._key)
        return self._plan(answer, 0, "the plan so far") if answer["status"] != "stuck" else None

    def greedy(self) -> Plan | None:
        """A plan made job by job, at once; None where the program is not separable, or no such plan is found."""
        found = self.answered(_cover_plan(struct("cover", self._key, 0)), "job by job")
        return found if found is not None and found.solved else None

    def optimized(
        self, network: Network, improvements: Iterator[Improvement], best: Plan | None, stop: Callable[[], bool]
    ) -> Iterator[Plan]:
        """Plans from the optimizer, each executed before it is one; the best so far stays unless one is better."""
        bound_ms = 0 if best is None else round(best.lower_bound_s * MS_PER_S)
        for found in improvements:
            if found.unsolvable:
                yield replace(self.impossible(), effort=found.effort, phase=found.phase)
                return
            raised, bound_ms = found.bound_ms > bound_ms, max(bound_ms, found.bound_ms)
            answer = self._proposed(network, found.solution, best)
            if answer is not None:
                best = self._plan(answer, bound_ms, found.phase, effort=found.effort)
                yield best
            elif best is not None and raised:
                best = self._judged(replace(best, effort=found.effort, phase=found.phase), bound_ms)
                yield best
        if stop():
            if best is None:
                yield self._none(PlanStatus.TIMEOUT, "stopped before a plan was found")
        elif best is None or (best.status is not PlanStatus.SOLVED_OPTIMALLY and not network.exact):
            exact = self.searched(best)  # the network leaves out something that may matter
            if exact.solved and (best is None or exact.makespan_s <= best.makespan_s):
                yield self._judged(exact, max(bound_ms, round(exact.lower_bound_s * MS_PER_S)))
            elif best is not None:
                yield self._judged(best, max(bound_ms, round(exact.lower_bound_s * MS_PER_S)))
            else:
                yield exact

    def _proposed(self, network: Network, solution: Solution | None, best: Plan | None) -> Mapping[str, Any] | None:
        """What comes of a solution; None unless it is better than the best plan."""
        limit = _NO_LIMIT if best is None else round(best.makespan_s * MS_PER_S)
        if solution is None or (best is not None and solution.makespan_ms >= limit):
            return None
        answer = _propose(_proposal(self._key, network, solution, limit))
        return answer if answer["status"] == "solved_satisficing" else None

    def _plan(
        self,
        answer: Mapping[str, Any],
        bound_ms: int,
        phase: str,
        *,
        nodes: int = 0,
        pruned: int = 0,
        effort: float = 0.0,
    ) -> Plan:
        choices: dict[str, tuple[str | int, ...]] = {}
        for choice, chosen in answer["choices"]:
            choices[choice] = (*choices.get(choice, ()), chosen)
        plan = Plan(
            status=PlanStatus.SOLVED_SATISFICING,
            made_at_s=self._now_s,
            makespan_s=answer["makespan"] / MS_PER_S,
            lower_bound_s=0.0,
            steps=self._steps(answer["steps"]),
            choices=choices,
            waits_for=tuple(answer["waits_for"]),
            nodes=nodes,
            effort=effort,
            phase=phase,
            reason="",
        )
        return self._checked(self._judged(plan, bound_ms, pruned=pruned))

    def _judged(self, plan: Plan, bound_ms: int, *, pruned: int = 0) -> Plan:
        """A plan with what is known now: no execution takes less than the bound."""
        makespan_ms = round(plan.makespan_s * MS_PER_S)
        judged = replace(
            plan,
            status=PlanStatus.SOLVED_OPTIMALLY if bound_ms >= makespan_ms else PlanStatus.SOLVED_SATISFICING,
            lower_bound_s=min(bound_ms, makespan_ms) / MS_PER_S,
        )
        self._history.append(
            Progress(
                phase=judged.phase,
                effort=judged.effort,
                nodes=judged.nodes,
                pruned=pruned,
                makespan_s=judged.makespan_s,
                lower_bound_s=judged.lower_bound_s,
            )
        )
        return replace(judged, reason=_reason(judged), history=tuple(self._history))

    def _none(self, status: PlanStatus, reason: str) -> Plan:
        return _none(status, reason, self._now_s)


def _none(status: PlanStatus, reason: str, now_s: float) -> Plan:
    return Plan(
        status=status,
        made_at_s=now_s,
        makespan_s=0.0,
        lower_bound_s=0.0,
        steps=(),
        choices={},
        nodes=0,
        reason=reason,
    )


def _within_task(place: str) -> str:
    """A place without the key of its session, which differs from run to run."""
    return place.partition("/")[2]


def _reason(plan: Plan) -> str:
    work = f", {plan.nodes} configurations" if plan.nodes else f", effort {plan.effort:.2f}" if plan.effort else ""
    how = f"({plan.phase}{work})"
    until = ""
    if plan.waits_for:
        places = ", ".join(map(_within_task, plan.waits_for))
        until = (
            f"; it goes as far as to where {places} is found out: to look further, give the composite "
            "process that goes on by it a hasDurationModel"
        )
    if plan.status is PlanStatus.SOLVED_OPTIMALLY:
        return (
            f"makespan {plan.makespan_s:.3f} s is the least: every other execution takes at least "
            f"{plan.lower_bound_s:.3f} s {how}{until}"
        )
    return (
        f"makespan {plan.makespan_s:.3f} s; no execution takes less than {plan.lower_bound_s:.3f} s, "
        f"a gap of {plan.gap:.0%} {how}{until}"
    )


def travel_tables(travel: Travel) -> Term:
    """Travel times as planner/golog/travel.pl takes them."""
    robots: list[Term] = [
        struct("robot", name, profile + 1, travel.here[name].tolist())
        for name, profile in sorted(travel.profile.items())
    ]
    return struct("tables", list(travel.places), robots, [table.tolist() for table in travel.between])


def _proposal(key: str, network: Network, solution: Solution, limit_ms: int) -> Term:
    claims = claims_of(network.root, solution.choices)
    choices: list[Term] = [struct("-", choice, label) for choice, label in sorted(solution.choices.items())]
    steps: list[Term] = []
    for step in solution.steps:
        resources = [struct("resource", r) for r in claims.get(step.id, ())]
        steps.append(struct("-", step.id, [*step.robots, *resources]))
    return struct("proposal", key, choices, steps, limit_ms)


class TravelSeconds(Mapping[tuple[str, str, str], float]):
    """Travel times in seconds by (robot, from, to), from `here` too; without what cannot be reached."""

    def __init__(self, travel: Travel) -> None:
        self._travel = travel
        self._index = {place: n for n, place in enumerate(travel.places)}

    def __getitem__(self, way: tuple[str, str, str]) -> float:
        robot, origin, goal = way
        travel = self._travel
        row = travel.here[robot] if origin == HERE else travel.between[travel.profile[robot]][self._index[origin]]
        milliseconds = int(row[self._index[goal]])
        if milliseconds == NO_WAY:
            raise KeyError(way)
        return milliseconds / MS_PER_S

    def __iter__(self) -> Iterator[tuple[str, str, str]]:
        places = self._travel.places
        ways = ((r, a, b) for r in self._travel.here for a in (HERE, *places) for b in places)
        return (way for way in ways if way in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)
