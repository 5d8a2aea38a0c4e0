"""Networks that fall apart into jobs, and what their plans come to by other means than the planner's."""

from __future__ import annotations

import math
import random  # noqa: TID251 - the published instances are drawn with it
from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations, product

import numpy as np

from planner.network import (
    NO_WAY,
    Alternatives,
    Held,
    InSequence,
    Label,
    Milliseconds,
    Network,
    Node,
    Option,
    Robot,
    SideBySide,
    Solution,
    Step,
    Travel,
)

LOOK_MS = 1000
MS_PER_UNIT = 100
OPTIMA_MS = {(2, 2): 5700, (3, 4): 13800, (4, 6): 8900, (6, 10): 8600, (10, 20): 10200, (20, 50): 14100}
"""Of `fleet` with seed 1, by (robots, drinks); several programs that share no code with the planner agree on them."""


def find(job: str, robots: Sequence[str], spot: str) -> Node:
    """A drink: one of the robots travels to its spot and looks, without doing anything else between."""
    robot = robots[0] if len(robots) == 1 else f"?{job}"
    go = Step(id=f"{job}/go", robots=(robot,), fixed_ms=0, goal=spot, ends=(spot,))
    look = Step(id=f"{job}/look", robots=(robot,), fixed_ms=LOOK_MS)
    held = Held(id=job, robot=robot, part=InSequence(parts=(go, look)))
    return Alternatives(id=job, options=(Option(labels=tuple(robots), node=held),))


def network(
    parts: Sequence[Node],
    places: Sequence[str],
    between: Sequence[Milliseconds],
    robots: Mapping[str, tuple[int, Milliseconds]],
    *,
    team: int | None = None,
    work_ms: Mapping[str, int] | None = None,
) -> Network:
    """Parts side by side, for robots by name: which table holds for it, and its ways from where it is."""
    limits = work_ms or {}
    return Network(
        root=SideBySide(parts=tuple(parts)),
        robots={name: Robot(name=name, work_ms=limits.get(name)) for name in robots},
        team=len(robots) if team is None else team,
        travel=Travel(
            places=tuple(places),
            profile={name: profile for name, (profile, _) in robots.items()},
            between=tuple(between),
            here={name: here for name, (_, here) in robots.items()},
        ),
        capacity={},
        exact=True,
    )


def fleet(robots: int, drinks: int, seed: int = 1) -> Network:
    """Robots at docks, drinks at spots of a hall; some robots are slow, some have no Kinect, which some drinks need.

    Travel: the distance along the walls in steps of 0.1 m, at 1 or 2 m/s, rounded up to 0.1 s.
    """
    rng = random.Random(1000 * robots + 10 * drinks + seed)
    side = 10 * max(10, math.ceil(math.sqrt(robots + drinks) * 4))
    at = np.array([(rng.randrange(side), rng.randrange(side)) for _ in range(robots + drinks)], dtype=np.int64)
    speeds = [rng.choice([1, 2]) for _ in range(robots)]
    kinect = [True] * robots
    for robot in rng.sample(range(robots), robots // 3):
        kinect[robot] = False
    needs_kinect = [rng.random() < 0.6 for _ in range(drinks)]
    distance = np.abs(at[:, None] - at[None]).sum(axis=2)
    tables = [-(-distance // speed) * MS_PER_UNIT for speed in (1, 2)]
    names = [f"robot_{r:02}" for r in range(robots)]
    return network(
        [
            find(f"drink_{d:03}", [n for n, k in zip(names, kinect, strict=True) if k or not need], f"spot_{d:03}")
            for d, need in enumerate(needs_kinect)
        ],
        [f"spot_{d:03}" for d in range(drinks)],
        [table[robots:, robots:] for table in tables],
        {name: (speeds[r] - 1, tables[speeds[r] - 1][r, robots:]) for r, name in enumerate(names)},
    )


def random_network(
    rng: np.random.Generator, robots: int, jobs: int, *, triangle: bool, limits: bool = False
) -> Network:
    """Jobs that some robots can do in two ways each, with travel times drawn at random.

    Args:
        rng: Draws all.
        robots: How many.
        jobs: How many.
        triangle: Whether no detour is shorter than the way that it avoids; else some places cannot be reached from
            some others, too.
        limits: Whether robots have little energy, and one of them must stay idle.
    """
    places = [f"p{i}" for i in range(jobs)]
    names = [f"r{i}" for i in range(robots)]
    n = jobs + robots
    if triangle:
        at = rng.integers(0, 40, size=(n, 2))
        table = np.abs(at[:, None] - at[None]).sum(axis=2)
    else:
        table = np.where(rng.random((n, n)) < 0.1, NO_WAY, rng.integers(0, 60, size=(n, n)))
    return network(
        [_random_job(rng, f"j{i}", names, places) for i in range(jobs)],
        places,
        [table[:jobs, :jobs]],
        {name: (0, table[jobs + i, :jobs]) for i, name in enumerate(names)},
        team=robots - 1 if limits else None,
        work_ms={name: int(rng.integers(40, 200)) for name in names} if limits else None,
    )


def _random_job(rng: np.random.Generator, job: str, robots: Sequence[str], places: Sequence[str]) -> Node:
    able = sorted(rng.choice(robots, size=int(rng.integers(1, len(robots) + 1)), replace=False).tolist())
    spot, other = rng.choice(places, size=2).tolist()
    if len(able) > 1 and rng.random() < 0.5:
        return find(job, able, spot)
    ways = []
    for robot in able:
        go = Step(id=f"{job}/go", robots=(robot,), fixed_ms=int(rng.integers(0, 9)), goal=spot, odds=0.8, ends=(spot,))
        look = Step(id=f"{job}/look", robots=(robot,), fixed_ms=int(rng.integers(0, 50)))
        carry = Step(id=f"{job}/carry", robots=(robot,), fixed_ms=2, goal=other, odds=0.7, ends=(other,))
        think = Step(id=f"{job}/think", robots=(), fixed_ms=3)
        how = Alternatives(id=f"{job}/how", options=(Option(labels=(1,), node=look), Option(labels=(2,), node=carry)))
        body = Held(id=job, robot=robot, part=InSequence(parts=(think, go, how)))
        stay = Step(id=f"{job}/stay", robots=(robot,), fixed_ms=int(rng.integers(30, 90)))
        ways.append(Option(labels=(robot,), node=stay if rng.random() < 0.2 else body))
    return Alternatives(id=job, options=tuple(ways))


Way = tuple[dict[str, Label], tuple[Step, ...]]


def ways(node: Node) -> Iterator[Way]:
    """All choices in a part, with the steps that they lead to, in order."""
    match node:
        case Step():
            yield {}, (node,)
        case Held(part=part):
            yield from ways(part)
        case InSequence(parts=parts):
            for chosen in product(*(list(ways(part)) for part in parts)):
                yield (
                    {key: label for choices, _ in chosen for key, label in choices.items()},
                    tuple(step for _, steps in chosen for step in steps),
                )
        case Alternatives(id=choice, options=options):
            for option in options:
                for label in option.labels:
                    for choices, steps in ways(option.node):
                        done_by = tuple(_filled_in(step, f"?{choice}", str(label)) for step in steps)
                        yield {str(choice): label, **choices}, done_by
        case _:
            raise ValueError(node)


def _filled_in(step: Step, name: str, robot: str) -> Step:
    robots = tuple(robot if r == name else r for r in step.robots)
    return Step(id=step.id, robots=robots, fixed_ms=step.fixed_ms, goal=step.goal, odds=step.odds, ends=step.ends)


def run_ms(network: Network, robot: str, steps: Sequence[Step]) -> tuple[int, int] | None:
    """How long a robot is busy with steps one after the other, and how long it works; None: there is no way."""
    travel, at, ms, work_ms = network.travel, network.robots[robot].at, 0, 0
    for step in steps:
        took = step.fixed_ms
        if step.goal is not None:
            row = travel.here[robot] if at is None else travel.between[travel.profile[robot]][travel.places.index(at)]
            way = int(row[travel.places.index(step.goal)])
            if way == NO_WAY:
                return None
            took += round(way / step.odds)
        if step.robots:
            work_ms += took
            at = step.ends[0] if step.ends and step.ends[0] is not None else at
        ms += took
    limit = network.robots[robot].work_ms
    return None if limit is not None and work_ms > limit else (ms, work_ms)


def least_makespan_ms(network: Network) -> int | None:
    """By trying everything: who does what, how and in which order; None: there is no plan."""
    assert isinstance(network.root, SideBySide)
    by_robot: list[dict[str, list[tuple[Step, ...]]]] = []
    for part in network.root.parts:
        own: dict[str, list[tuple[Step, ...]]] = {}
        for _, steps in ways(part):
            (robot,) = {r for step in steps for r in step.robots}
            own.setdefault(robot, []).append(steps)
        by_robot.append(own)
    least: dict[tuple[str, tuple[int, ...]], int | None] = {}

    def run(robot: str, jobs: tuple[int, ...]) -> int | None:
        if (robot, jobs) not in least:
            runs = [
                run_ms(network, robot, [step for steps in chosen for step in steps])
                for order in permutations(jobs)
                for chosen in product(*(by_robot[job].get(robot, []) for job in order))
            ]
            least[robot, jobs] = min((done[0] for done in runs if done is not None), default=None)
        return least[robot, jobs]

    best: int | None = None
    for robots in product(*by_robot):
        if len(set(robots)) > network.team:
            continue
        ends = [run(robot, tuple(j for j, r in enumerate(robots) if r == robot)) for robot in sorted(set(robots))]
        if None not in ends:
            makespan_ms = max((ms for ms in ends if ms is not None), default=0)
            best = makespan_ms if best is None else min(best, makespan_ms)
    return best


def check(network: Network, solution: Solution) -> None:
    """Fail unless a solution is one: every part done as chosen, every robot at one job at a time, all times right."""
    assert isinstance(network.root, SideBySide)
    started = {step.id: step for step in solution.steps}
    assert len(started) == len(solution.steps)
    runs: dict[str, list[tuple[int, tuple[Step, ...]]]] = {}
    count = 0
    for part in network.root.parts:
        fitting = [
            steps
            for choices, steps in ways(part)
            if all(solution.choices.get(key) == label for key, label in choices.items())
        ]
        assert len(fitting) == 1, part
        count += len(fitting[0])
        (robot,) = {r for step in fitting[0] for r in step.robots}
        runs.setdefault(robot, []).append((started[fitting[0][0].id].start_ms, fitting[0]))
    assert count == len(solution.steps)
    assert len(runs) <= network.team
    for robot, parts in runs.items():
        steps = [
            step for _, part in sorted(parts, key=lambda at: (at[0], started[at[1][-1].id].end_ms)) for step in part
        ]
        for i, step in enumerate(steps):
            until, before = run_ms(network, robot, steps[: i + 1]), run_ms(network, robot, steps[:i])
            assert until is not None
            assert before is not None
            told = started[step.id]
            assert (told.robots, told.start_ms, told.end_ms) == (step.robots, before[0], until[0])
    assert solution.makespan_ms == max((step.end_ms for step in solution.steps), default=0)
