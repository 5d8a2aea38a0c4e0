"""Task networks: what is left open in a program, for solvers that know nothing of Golog.

planner/golog/network.pl steps through a program and writes down all that it may come to: steps with
their durations, what follows what, what is side by side, and the choices. A network drops what a solver
cannot know (conditions and preconditions on what changes meanwhile): it is a relaxation, so that a lower
bound of the network is one of the program. Whether a solution is an execution, the Golog semantics
decides (planner/golog/replay.pl).

All times are integer milliseconds since the plan is made.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Label: TypeAlias = str | int
"""What is chosen: an individual, or the number of a branch, from 1."""

Milliseconds: TypeAlias = npt.NDArray[np.int64]

NO_WAY = -1
"""In a table of travel times: it cannot be reached."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Travel:
    """How long robots travel.

    Attributes:
        places: In the order of rows and columns.
        profile: By robot, which table of `between` holds for it.
        between: Tables [from, to] of shape (places, places); NO_WAY where there is none; robots that travel alike
            share one.
        here: By robot, shape (places,): from where it is when the plan is made.
    """

    places: tuple[str, ...]
    profile: Mapping[str, int]
    between: tuple[Milliseconds, ...]
    here: Mapping[str, Milliseconds]


@dataclass(frozen=True, slots=True, kw_only=True)
class Robot:
    """A robot when the plan is made.

    Attributes:
        at: A place of the travel table; None: where `Travel.here` counts from.
        work_ms: It can do further steps for so long in all (its battery), what is under way not counted; None: as long
            as it takes.
    """

    name: str
    at: str | None = None
    work_ms: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One durative step. It takes the first robot's travel time to `goal`, divided by `odds`, and `fixed_ms`.

    Attributes:
        robots: All that do it, together; none: a computation.
        goal: Where the first robot travels to first; None: no travel.
        odds: Of success; the expected time is the travel time over the odds, rounded (half to even).
        ends: By robot, where it is afterwards; None: where it was.
        claims: Resources that nobody else uses meanwhile (as far as their capacity goes).
    """

    id: str
    robots: tuple[str, ...]
    fixed_ms: int
    goal: str | None = None
    odds: float = 1.0
    ends: tuple[str | None, ...] = ()
    claims: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Underway:
    """A step that has begun: it runs for `left_ms` more."""

    id: str
    robots: tuple[str, ...]
    left_ms: int
    ends: tuple[str | None, ...] = ()
    claims: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class InSequence:
    """One after the other: each part begins when the one before it has ended."""

    parts: tuple[Node, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class SideBySide:
    """All parts, concurrently."""

    parts: tuple[Node, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class AnyOrder:
    """All parts, one after the other, in an order to be chosen.

    The choice at `{id}/{k}`, where k parts remain to be begun, is the number (from 1) of the part that is next.
    """

    id: str
    parts: tuple[Node, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """One way to choose, or several that differ in the robot alone.

    Attributes:
        labels: If there is more than one, they are robots, and `?ID` (ID is that of the alternatives) stands for the
            chosen one among the robots of `node`'s steps.
    """

    labels: tuple[Label, ...]
    node: Node


@dataclass(frozen=True, slots=True, kw_only=True)
class Alternatives:
    """Exactly one of the options is done. `id` is None where the program decides and not the planner."""

    id: str | None
    options: tuple[Option, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Held:
    """From the start of its first step to its end, the robot does nothing but the steps of this part."""

    id: str
    robot: str
    part: Node


@dataclass(frozen=True, slots=True, kw_only=True)
class Claimed:
    """From the start of its first step to its end, this part uses the resources."""

    id: str
    claims: tuple[str, ...]
    part: Node


@dataclass(frozen=True, slots=True, kw_only=True)
class Deadline:
    """This part has ended by then."""

    ms: int
    part: Node


Node: TypeAlias = Step | Underway | InSequence | SideBySide | AnyOrder | Alternatives | Held | Claimed | Deadline


@dataclass(frozen=True, slots=True, kw_only=True)
class Network:
    """All that a request may come to.

    Attributes:
        robots: All that may take part, by name.
        team: At most so many robots may take part.
        capacity: How many may use a resource at once, where it is not one.
        exact: Nothing was dropped: every solution of the network is an execution of the program.
    """

    root: Node
    robots: Mapping[str, Robot]
    team: int
    travel: Travel
    capacity: Mapping[str, int]
    exact: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class StartedStep:
    """A step of a solution."""

    id: str
    robots: tuple[str, ...]
    start_ms: int
    end_ms: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Solution:
    """A way through a network.

    Attributes:
        choices: What is chosen, by the id of alternatives and any-orders that are come to.
        steps: Ordered by start, then end, then as the program has them; those that were under way are not among them.
        makespan_ms: Latest end, of steps under way too.
    """

    choices: Mapping[str, Label]
    steps: tuple[StartedStep, ...]
    makespan_ms: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Improvement:
    """What a solver found out since it last told.

    Attributes:
        solution: The best so far; None: none yet.
        bound_ms: No solution takes less.
        unsolvable: Proven: there is no solution.
        phase: What found it, for people: "greedy", "run cover", ...
        effort: Work done since the beginning, in deterministic seconds (CP-SAT's measure; own phases count alike).
    """

    solution: Solution | None
    bound_ms: int
    unsolvable: bool = False
    phase: str
    effort: float


def read_network(answer: Mapping[str, Any], travel: Travel) -> Network:
    """The network that planner/golog/planning.pl answers (task_network), with travel times."""
    return Network(
        root=_node(answer["root"]),
        robots={name: Robot(name=name, work_ms=work) for name, work in answer["robots"]},
        team=answer["team"],
        travel=travel,
        capacity=dict(answer["capacity"]),
        exact=answer["exact"],
    )


def _node(row: Sequence[Any]) -> Node:
    match row:
        case ["step", id_, robots, goal, odds, fixed, ends, claims]:
            return Step(
                id=id_,
                robots=tuple(robots),
                goal=goal,
                odds=odds,
                fixed_ms=fixed,
                ends=tuple(ends),
                claims=tuple(claims),
            )
        case ["underway", id_, robots, left, ends, claims]:
            return Underway(id=id_, robots=tuple(robots), left_ms=left, ends=tuple(ends), claims=tuple(claims))
        case ["seq", *parts]:
            return InSequence(parts=tuple(map(_node, parts)))
        case ["side", *parts]:
            return SideBySide(parts=tuple(map(_node, parts)))
        case ["any_order", id_, *parts]:
            return AnyOrder(id=id_, parts=tuple(map(_node, parts)))
        case ["alt", id_, *options]:
            return Alternatives(
                id=id_, options=tuple(Option(labels=tuple(labels), node=_node(node)) for labels, node in options)
            )
        case ["held", id_, robot, part]:
            return Held(id=id_, robot=robot, part=_node(part))
        case ["claimed", id_, claims, part]:
            return Claimed(id=id_, claims=tuple(claims), part=_node(part))
        case ["by", ms, part]:
            return Deadline(ms=ms, part=_node(part))
        case _:
            raise ValueError(f"no node of a network: {row!r}")


def claims_of(node: Node, choices: Mapping[str, Label]) -> dict[str, tuple[str, ...]]:
    """What steps and claimed parts claim, by id, under these choices."""
    found: dict[str, tuple[str, ...]] = {}
    todo = [node]
    while todo:
        match todo.pop():
            case Step(id=id_, claims=claims) | Underway(id=id_, claims=claims):
                found |= {id_: claims} if claims else {}
            case Claimed(id=id_, claims=claims, part=part):
                found[id_] = claims
                todo.append(part)
            case Held(part=part) | Deadline(part=part):
                todo.append(part)
            case Alternatives(id=id_, options=options):
                todo += [o.node for o in options if id_ is None or choices.get(id_) in o.labels]
            case InSequence(parts=parts) | SideBySide(parts=parts) | AnyOrder(parts=parts):
                todo += parts
    return found
