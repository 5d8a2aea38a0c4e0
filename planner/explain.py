"""Explanations of plans: why so, why not otherwise, and what would make an impossible request possible.

Every answer to "what if" is a plan: the request is planned anew with a choice or a fact changed
(planner/hypotheses.py), by the same solvers and under the same independent checker. The session that is
asked about is left as it is.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from kb.errors import ConcertmasterError
from kb.vocabulary import Kind, Property
from planner.answers import (
    MOST_REMEDIES,
    Alternative,
    ChoiceReason,
    Help,
    OrderAlternative,
    PlanExplanation,
    Remedy,
    alternative_text,
    help_text,
    possible_text,
)
from planner.explaining_starts import start_reasons
from planner.hypotheses import Change, ChangeKind, Option, Prospects, Supposed, with_ways
from planner.making import MS_PER_S
from planner.network import Label, Travel
from planner.obstacles import PLENTY_MS, Obstacle, energy_change, read_obstacles
from planner.plan import Plan, PlanStatus
from planner.planner import Session, TravelTimes

EFFORT = 1.0
"""Budget of the optimizer for each plan that is made for an explanation, in deterministic seconds."""

MOST_PLANS = 200
"""So many plans an explainer makes at most."""

MOST_NODES = 60_000
"""After so many configurations of the exact search, in all its plans, it makes no more."""

_PAIR = 2


class NoSuchChoice(ConcertmasterError):
    """What is asked about is no choice or step of the plan.

    Attributes:
        asked: What was asked about.
    """

    fault = "request"

    def __init__(self, asked: str, message: str) -> None:
        self.asked = asked
        super().__init__(message)


class Explainer:
    """Answers questions about the plan of a session, as things stand at one moment."""

    def __init__(
        self,
        session: Session,
        travel_times: TravelTimes,
        *,
        now_s: float,
        effort: float = EFFORT,
        most_plans: int = MOST_PLANS,
    ) -> None:
        """Ask about what remains of a session.

        Args:
            travel_times: Asked once for the same robots and places.
            effort: For each plan, in deterministic seconds.
            most_plans: In all; what is not answered for want of plans says so.
        """
        self._session = session
        self._key, self._robots, self._began_s = session._key, session._robots, session._beginning.began_s
        self._ontology = session._snapshot.ontology
        self._ask = travel_times
        self._known: dict[tuple[tuple[str, ...], tuple[str, ...]], Travel] = {}
        self._now_s = now_s
        self._effort = effort
        self._left = most_plans
        self._nodes = 0
        self._keys = itertools.count(1)

    def why(self, plan: Plan) -> PlanExplanation:
        """Why each step starts when it does, and what would come of every other choice."""
        prospects = self._prospects({c: labels[0] for c, labels in plan.choices.items() if len(set(labels)) == 1})
        everything = self._prospects({})
        return PlanExplanation(
            status=plan.status,
            makespan_s=plan.makespan_s,
            reason=plan.reason,
            starts=start_reasons(plan, prospects.claims),
            choices=tuple(self._reason(plan, c, everything.options) for c in plan.choices),
            obstacles=self._obstacles(everything),
        )

    def why_not(self, plan: Plan, choice: str, label: Label) -> Alternative:
        """What would come of another label at a choice; if there is no plan with it, what would make it possible.

        Args:
            choice: Id of the choice, or a segment that no other choice of the plan has, such as `drink_1`.
            label: An individual, or the number or name of a branch.

        Raises:
            NoSuchChoice: The plan comes to no such choice, or it has no such label, or has it already.
        """
        choice = self._choice(plan, choice)
        option = _option(choice, plan, self._prospects({}).options)
        label = _label(option, label)
        if set(plan.choices[choice]) == {label}:
            raise NoSuchChoice(choice, f"{label} is what the plan chooses at {choice}; ask about another label")
        return self._alternative(plan, option, label, most_changes=_PAIR)

    def why_not_first(self, plan: Plan, first: str, before: str) -> OrderAlternative:
        """What would come of doing one part of the plan before another, all else being as planned.

        Args:
            first: A segment of step ids, such as `drink_2`: what would come first.
            before: Another: what it would come before.

        Raises:
            NoSuchChoice: No step has such a segment, or no robot and no resource serves both.
        """
        claims = self._prospects({c: labels[0] for c, labels in plan.choices.items()}).claims
        rows = [(s.action.id, s.action.robots, claims.get(s.action.id, ())) for s in plan.steps]
        moved = [row for row in rows if first in row[0].split("/")]
        place = next((n for n, row in enumerate(rows) if before in row[0].split("/")), None)
        if not moved or place is None:
            asked = before if moved else first
            raise NoSuchChoice(asked, f"no step of the plan belongs to {asked!r}; name a part of a step's id")
        after = [row for row in rows if before in row[0].split("/")]
        if not _serving(moved) & _serving(after):
            told = f"{first} and {before} share no robot and no resource, so neither comes before the other"
            raise NoSuchChoice(first, told)
        kept = [row for row in rows[:place] if row not in moved]
        order = [*kept, *moved, *(row for row in rows[place:] if row not in moved)]
        with self._supposed({}, ()) as supposed:
            supposed.look(self._travel_times(()), self._now_s)
            makespan_s = supposed.makespan_in_order(plan.choices, order)
        if all(row in rows[:place] for row in moved):
            text = f"{first} comes before {before} as it is"
        elif makespan_s is None:
            text = f"{first} before {before} is not possible with all else as planned"
        else:
            text = (
                f"{first} before {before}, all else as planned: {makespan_s:.3f} s instead of {plan.makespan_s:.3f} s"
            )
        return OrderAlternative(first=first, before=before, makespan_s=makespan_s, text=text)

    def what_would_help(self) -> Help:
        """The smallest changes of facts that would make the request possible: one change, else two together."""
        plan = self._planned({}, ())
        if plan is None or plan.status is not PlanStatus.UNSOLVABLE_PROVEN:
            status = PlanStatus.TIMEOUT if plan is None else plan.status
            return Help(status=status, obstacles=(), remedies=(), complete=True, text=possible_text(plan))
        prospects = self._prospects({})
        obstacles = self._obstacles(prospects)
        remedies, complete = self._remedies({}, obstacles, most_changes=_PAIR)
        return Help(
            status=plan.status,
            obstacles=obstacles,
            remedies=remedies,
            complete=complete,
            text=help_text(obstacles, remedies, complete=complete),
        )

    # Choices

    def _reason(self, plan: Plan, choice: str, options: Mapping[str, Option]) -> ChoiceReason:
        option, chosen = _option(choice, plan, options), plan.choices[choice]
        others = [label for label in option.labels if set(chosen) != {label}]
        alternatives = tuple(self._alternative(plan, option, label, most_changes=1) for label in others)
        name = ", ".join(_name(option, label) for label in chosen)
        told = "; ".join(a.text for a in alternatives) or "there is no other choice"
        return ChoiceReason(
            choice=choice,
            chosen=chosen,
            name=name,
            alternatives=alternatives,
            text=f"{name} at {self._short(choice)}: {told}",
        )

    def _alternative(self, plan: Plan, option: Option, label: Label, *, most_changes: int) -> Alternative:
        only = {option.id: label}
        found = self._planned(only, ())
        obstacles: tuple[Obstacle, ...] = ()
        remedies: tuple[Remedy, ...] = ()
        complete = True
        if found is not None and not found.solved:
            prospects = self._prospects(only, below=option.id)
            obstacles = self._obstacles(prospects)
            candidates = obstacles if most_changes == 1 else (*obstacles, *self._obstacles(self._prospects(only)))
            remedies, complete = self._remedies(only, candidates, most_changes=most_changes)
        solved = found is not None and found.solved
        name = _name(option, label)
        return Alternative(
            choice=option.id,
            label=label,
            name=name,
            status=None if found is None else found.status,
            makespan_s=found.makespan_s if found is not None and solved else None,
            lower_bound_s=found.lower_bound_s if found is not None and solved else 0.0,
            obstacles=obstacles,
            remedies=remedies,
            text=alternative_text(name, plan, found, obstacles, remedies, complete=complete),
        )

    def _choice(self, plan: Plan, asked: str) -> str:
        found = [c for c in plan.choices if asked in (c, self._short(c)) or asked in c.split("/")]
        match found:
            case [choice]:
                return choice
            case []:
                known = ", ".join(map(self._short, plan.choices)) or "none"
                raise NoSuchChoice(asked, f"no choice of the plan belongs to {asked!r}; there is {known}")
            case _:
                several = ", ".join(map(self._short, found))
                raise NoSuchChoice(asked, f"{asked!r} stands for several choices: {several}; name one")

    # What would help

    def _remedies(
        self, only: Mapping[str, Label], obstacles: Sequence[Obstacle], *, most_changes: int
    ) -> tuple[tuple[Remedy, ...], bool]:
        """All changes of the least size that help, and whether everything up to `most_changes` was tried."""
        prospects = self._prospects({})
        candidates = list(self._candidates(obstacles, prospects))
        for size in range(1, most_changes + 1):
            found: list[Remedy] = []
            for changes in itertools.combinations(candidates, size):
                if len({(c.kind, c.subject, c.what) for c in changes}) < size:
                    continue  # two values of one fact
                plan = self._planned(only, changes)
                if plan is None:
                    return _best(found), False
                if plan.solved:
                    found.append(self._least(only, changes, plan, prospects))
                if size > 1 and len(found) == MOST_REMEDIES:
                    break
            if found:
                return _best(found), True
        return (), True

    def _candidates(self, obstacles: Sequence[Obstacle], prospects: Prospects) -> Iterator[Change]:
        """Single changes that may help, each once: what removes an obstacle, then what relaxes the whole."""
        found = [o.change for o in obstacles if o.change is not None]
        found += [energy_change(b) for b in prospects.batteries]
        fleet = self._ontology.individuals(Kind.ROBOT)
        if self._robots < len(fleet):
            found.append(_team(len(fleet), self._robots, enough=True))
        found += [_deadline(process, ms, PLENTY_MS) for process, ms in prospects.deadlines]
        yield from dict.fromkeys(found)

    def _least(self, only: Mapping[str, Label], changes: Sequence[Change], plan: Plan, prospects: Prospects) -> Remedy:
        """Changes that were tried with plenty, with no more than what the plan found needs; planned again."""
        least = tuple(self._needed(change, plan, prospects) for change in changes)
        if least != tuple(changes):
            again = self._planned(only, least)
            if again is not None and again.solved:
                return Remedy(changes=least, makespan_s=again.makespan_s)
        return Remedy(changes=tuple(changes), makespan_s=plan.makespan_s)

    def _needed(self, change: Change, plan: Plan, prospects: Prospects) -> Change:
        match change.kind:
            case ChangeKind.TEAM:
                robots = {r for s in plan.steps for r in s.action.robots}
                return _team(len(robots), self._robots, enough=False)
            case ChangeKind.DEADLINE:
                needed_s = plan.made_at_s + plan.makespan_s - self._began_s
                assert isinstance(change.now, int)
                return _deadline(change.subject, change.now, round(needed_s * MS_PER_S))
            case ChangeKind.VALUE if change.what == Property.ENERGY_J:
                [battery] = (b for b in prospects.batteries if b.robot == change.subject)
                own = (s for s in plan.steps if battery.robot in s.action.robots)
                work_s = sum(s.end_s - s.start_s for s in own)
                return energy_change(battery, battery.worked_ms + round(work_s * MS_PER_S))
            case _:
                return change

    # Plans and prospects of what is supposed

    def _planned(self, only: Mapping[str, Label], changes: Sequence[Change]) -> Plan | None:
        """The best plan; None if the budget of plans is spent."""
        if not self._left or self._nodes > MOST_NODES:
            return None
        self._left -= 1
        with self._supposed(only, changes) as supposed:
            plan = supposed.plan(self._travel_times(changes), now_s=self._now_s, effort=self._effort)
        self._nodes += plan.nodes
        return plan

    def _prospects(self, only: Mapping[str, Label], below: str = "all") -> Prospects:
        with self._supposed(only, ()) as supposed:
            return supposed.look(self._travel_times(()), self._now_s, below)

    def _obstacles(self, prospects: Prospects) -> tuple[Obstacle, ...]:
        return read_obstacles(prospects.obstacles, prospects.batteries, self._ontology)

    def _supposed(self, only: Mapping[str, Label], changes: Sequence[Change]) -> Supposed:
        key = f"{self._key}?{next(self._keys)}"
        return Supposed(self._session, key, changes=changes, only=only)

    def _travel_times(self, changes: Sequence[Change]) -> TravelTimes:
        def times(robots: Sequence[str], places: Sequence[str]) -> Travel:
            asked = (tuple(robots), tuple(places))
            if asked not in self._known:
                self._known[asked] = self._ask(robots, places)
            return with_ways(self._known[asked], changes)

        return times

    def _short(self, choice: str) -> str:
        return choice.removeprefix(f"{self._key}/task/")


def _option(choice: str, plan: Plan, options: Mapping[str, Option]) -> Option:
    """The choice as it presents itself when the plan comes to it."""
    option = options.get(choice)
    if option is None:  # a loop, or what is not known before it comes to that
        labels: tuple[Label, ...] = ("again", "enough") if "again" in plan.choices[choice] else plan.choices[choice]
        unique = tuple(dict.fromkeys(labels))
        return Option(id=choice, kind="branch", labels=unique, names=tuple(map(str, unique)))
    if option.kind != "part":
        return option
    frame, _, left = choice.rpartition("/")
    begun = {plan.choices[f"{frame}/{n}"][0] for n in range(int(left) + 1, len(option.labels) + 1)}
    pairs = [(label, name) for label, name in zip(option.labels, option.names, strict=True) if label not in begun]
    return replace(option, labels=tuple(label for label, _ in pairs), names=tuple(name for _, name in pairs))


def _label(option: Option, asked: Label) -> Label:
    for label, name in zip(option.labels, option.names, strict=True):
        if str(asked) in (str(label), name):
            return label
    known = ", ".join(_name(option, label) for label in option.labels)
    raise NoSuchChoice(str(asked), f"{asked} cannot be chosen at {option.id}; there is {known}")


def _name(option: Option, label: Label) -> str:
    """What a label is called: an individual, or the process that the branch begins with, numbered if others do too."""
    name = option.names[option.labels.index(label)]
    return name if isinstance(label, str) or option.names.count(name) == 1 else f"{label} ({name})"


def _serving(rows: Sequence[tuple[str, Sequence[str], Sequence[str]]]) -> frozenset[str]:
    return frozenset(who for _, robots, resources in rows for who in (*robots, *resources))


def _best(found: list[Remedy]) -> tuple[Remedy, ...]:
    return tuple(sorted(found, key=lambda r: (r.makespan_s, r.text))[:MOST_REMEDIES])


def _team(robots: int, now: int, *, enough: bool) -> Change:
    told = "enough robots" if enough else f"{robots} robots"
    return Change(kind=ChangeKind.TEAM, value=robots, now=now, text=f"{told} might take part (now at most {now})")


def _deadline(process: str, now_ms: int, value_ms: int) -> Change:
    told = "no deadline" if value_ms == PLENTY_MS else f"{value_ms / MS_PER_S:.3f} s"
    return Change(
        kind=ChangeKind.DEADLINE,
        subject=process,
        value=value_ms,
        now=now_ms,
        text=f"{process} had {told} (now a deadline of {now_ms / MS_PER_S:.3f} s)",
    )
