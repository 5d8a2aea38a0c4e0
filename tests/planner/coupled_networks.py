"""Networks in which robots wait for each other: what one has found, another one fetches through a door."""

from __future__ import annotations

import math
import random  # noqa: TID251 - as tests.planner.fleet_networks draws
from collections.abc import Sequence

import numpy as np

from planner.network import (
    NO_WAY,
    Alternatives,
    AnyOrder,
    Claimed,
    Deadline,
    Held,
    InSequence,
    Milliseconds,
    Network,
    Node,
    Option,
    Robot,
    SideBySide,
    Step,
    Travel,
    Underway,
)
from tests.planner.all_schedules import ways

UNIT_MS = 100
LOOK_MS = 1000
GRASP_MS = 2000
PLACE_MS = 2000
PASS_MS = 2000
TABLE = "table"
_PASSAGE = 10
_TO_TABLE = 40
_ARMS_SEED = 7
MOST_SCHEDULES = 40_000


def anyone(choice: str, robots: Sequence[str], node: Node) -> Node:
    """Some robot of several does `node`, in which it is `?CHOICE`."""
    if len(robots) > 1:
        return Alternatives(id=choice, options=(Option(labels=tuple(robots), node=node),))
    return Alternatives(id=choice, options=(Option(labels=tuple(robots), node=_named(node, f"?{choice}", robots[0])),))


def _named(node: Node, symbol: str, robot: str) -> Node:
    match node:
        case Step(robots=robots):
            return Step(
                id=node.id,
                robots=tuple(robot if r == symbol else r for r in robots),
                fixed_ms=node.fixed_ms,
                goal=node.goal,
                odds=node.odds,
                ends=node.ends,
                claims=node.claims,
            )
        case InSequence(parts=parts):
            return InSequence(parts=tuple(_named(part, symbol, robot) for part in parts))
        case Held(id=id_, robot=holder, part=part):
            return Held(id=id_, robot=robot if holder == symbol else holder, part=_named(part, symbol, robot))
        case Alternatives(id=id_, options=options):
            return Alternatives(
                id=id_, options=tuple(Option(labels=o.labels, node=_named(o.node, symbol, robot)) for o in options)
            )
        case _:
            raise ValueError(f"a robot cannot be named in {node!r}")


def find(job: str, spot: str) -> Node:
    """`?JOB/finder` travels to the spot and looks."""
    robot = f"?{job}/finder"
    go = Step(id=f"{job}/find/go", robots=(robot,), fixed_ms=0, goal=spot, ends=(spot,))
    look = Step(id=f"{job}/find/look", robots=(robot,), fixed_ms=LOOK_MS, ends=(None,))
    return Held(id=f"{job}/find", robot=robot, part=InSequence(parts=(go, look)))


def fetch(job: str, spot: str, doors: int) -> Node:
    """`?JOB/fetcher` brings what is at the spot through a door to the table, and comes back."""
    robot, key = f"?{job}/fetcher", f"{job}/fetch"

    def go(name: str, goal: str) -> Step:
        return Step(id=f"{key}/{name}", robots=(robot,), fixed_ms=0, goal=goal, ends=(goal,))

    def pass_door(name: str, here: str, there: str) -> Node:
        ways = [
            InSequence(
                parts=(
                    go(f"{name}/go", f"door_{door}_{here}"),
                    Step(
                        id=f"{key}/{name}/pass",
                        robots=(robot,),
                        fixed_ms=PASS_MS,
                        ends=(f"door_{door}_{there}",),
                        claims=(f"door_{door}",),
                    ),
                )
            )
            for door in range(1, doors + 1)
        ]
        if doors == 1:
            return ways[0]
        options = tuple(Option(labels=(f"door_{i}",), node=way) for i, way in enumerate(ways, start=1))
        return Alternatives(id=f"{key}/{name}", options=options)

    grasp = Step(id=f"{key}/grasp", robots=(robot,), fixed_ms=GRASP_MS, ends=(None,))
    place = Step(id=f"{key}/place", robots=(robot,), fixed_ms=PLACE_MS, ends=(None,))
    parts = (
        go("to_drink", spot),
        grasp,
        pass_door("out", "inside", "outside"),
        go("to_table", TABLE),
        place,
        pass_door("back", "outside", "inside"),
    )
    return Held(id=key, robot=robot, part=InSequence(parts=parts))


def coupled(robots: int, drinks: int, seed: int = 1, *, doors: int = 1) -> Network:
    """Robots at docks, drinks at spots of a hall, as `tests.planner.fleet_networks.fleet` draws them.

    Every drink is found by some robot (some drinks need a Kinect) and then fetched by one of those with an arm, half
    of the robots. The hall is square; its doors are spread evenly along the wall at x = 0, 1 m deep; the table is
    4 m in front of the middle of that wall. What is inside can be reached from outside through a door alone.

    Travel: the distance along the walls in steps of 0.1 m, at 1 or 2 m/s, rounded up to 0.1 s.
    """
    rng = random.Random(1000 * robots + 10 * drinks + seed)
    side = 10 * max(10, math.ceil(math.sqrt(robots + drinks) * 4))
    drawn = [(rng.randrange(side), rng.randrange(side)) for _ in range(robots + drinks)]
    speeds = [rng.choice([1, 2]) for _ in range(robots)]
    kinect = [True] * robots
    for robot in rng.sample(range(robots), robots // 3):
        kinect[robot] = False
    needs_kinect = [rng.random() < 0.6 for _ in range(drinks)]
    arms = sorted(random.Random(_ARMS_SEED + robots).sample(range(robots), (robots + 1) // 2))

    at = {f"spot_{d:03}": xy for d, xy in enumerate(drawn[robots:])}
    for door in range(1, doors + 1):
        y = side * door // (doors + 1)
        at[f"door_{door}_inside"] = (0, y)
        at[f"door_{door}_outside"] = (-_PASSAGE, y)
    at[TABLE] = (-_TO_TABLE, side // 2)
    xy = np.array(list(at.values()), dtype=np.int64)
    docks = np.array(drawn[:robots], dtype=np.int64)
    inside = xy[:, 0] >= 0

    def table(froms: Milliseconds, speed: int) -> Milliseconds:
        ms = -(-np.abs(froms[:, None] - xy[None]).sum(axis=2) // speed) * UNIT_MS
        return np.where((froms[:, 0] >= 0)[:, None] == inside[None], ms, NO_WAY)

    names = [f"robot_{r:02}" for r in range(robots)]
    fetchers = [names[r] for r in arms]
    jobs = []
    for d, spot in enumerate(f"spot_{d:03}" for d in range(drinks)):
        job = f"drink_{d:03}"
        finders = [name for name, k in zip(names, kinect, strict=True) if k or not needs_kinect[d]]
        finding = anyone(f"{job}/finder", finders, find(job, spot))
        fetching = anyone(f"{job}/fetcher", fetchers, fetch(job, spot, doors))
        jobs.append(InSequence(parts=(finding, fetching)))
    return Network(
        root=SideBySide(parts=tuple(jobs)),
        robots={name: Robot(name=name) for name in names},
        team=robots,
        travel=Travel(
            places=tuple(at),
            profile={name: speeds[r] - 1 for r, name in enumerate(names)},
            between=tuple(table(xy, speed) for speed in (1, 2)),
            here={name: table(docks, speeds[r])[r] for r, name in enumerate(names)},
        ),
        capacity={},
        exact=True,
    )


class RandomNetwork:
    """Draws small networks with every kind of node, a few steps each.

    Args:
        begun: Whether some steps are under way.
    """

    def __init__(self, rng: np.random.Generator, *, begun: bool = False) -> None:
        self._rng = rng
        self._robots = [f"r{i}" for i in range(int(rng.integers(2, 4)))]
        self._places = ["a", "b", "c"]
        self._count = 0
        self._begun = begun
        self._held: list[str] = []

    def network(self) -> Network:
        """The next one; each has its own travel times, resources and limits."""
        rng, n = self._rng, len(self._places)
        parts = [self._node(2, ()) for _ in range(int(rng.integers(1, 4)))]
        if self._begun:
            parts = [self._underway(robot, part) for robot, part in zip(self._robots[:2], parts, strict=False)]
        tables = [rng.integers(0, 30, size=(n, n)) for _ in range(2)]
        tables = [np.where(rng.random((n, n)) < 0.1, NO_WAY, table) for table in tables]
        here = {name: rng.integers(0, 30, size=n) for name in self._robots}
        limits = {name: int(rng.integers(20, 90)) if rng.random() < 0.2 else None for name in self._robots}
        return Network(
            root=SideBySide(parts=tuple(parts))
            if self._begun or rng.random() < 0.8
            else InSequence(parts=tuple(parts)),
            robots={
                name: Robot(name=name, at="a" if rng.random() < 0.2 else None, work_ms=limits[name])
                for name in self._robots
            },
            team=int(rng.integers(len(self._robots) - 1, len(self._robots) + 1)),
            travel=Travel(
                places=tuple(self._places),
                profile={name: int(rng.integers(2)) for name in self._robots},
                between=tuple(tables),
                here=here,
            ),
            capacity={"gate": int(rng.integers(1, 3))},
            exact=True,
        )

    def _next(self, prefix: str) -> str:
        self._count += 1
        return f"{prefix}{self._count}"

    def _underway(self, robot: str, rest: Node) -> Node:
        left = Underway(
            id=self._next("u"),
            robots=(robot,),
            left_ms=int(self._rng.integers(0, 20)),
            ends=(str(self._rng.choice(self._places)),),
            claims=("door",) if robot == "r0" and self._rng.random() < 0.5 else (),
        )
        parts = InSequence(parts=(left, rest))
        if robot == "r1" and self._rng.random() < 0.5:
            begun = Underway(id=self._next("u"), robots=(), left_ms=0)
            return Claimed(id=self._next("k"), claims=("gate",), part=InSequence(parts=(begun, rest)))
        return Held(id=self._next("h"), robot=robot, part=parts) if self._rng.random() < 0.5 else parts

    def _node(self, depth: int, around: tuple[str, ...]) -> Node:
        """A part; `around` stand for robots that were chosen outside of it."""
        rng = self._rng
        kind = (
            "step" if depth == 0 else rng.choice(["step", "seq", "side", "any", "alt", "pick", "held", "claim", "by"])
        )
        match str(kind):
            case "seq":
                return InSequence(parts=self._nodes(depth, around))
            case "side":
                return SideBySide(parts=self._nodes(depth, around))
            case "any":
                return AnyOrder(id=self._next("o"), parts=self._nodes(depth, around))
            case "alt":
                id_ = None if rng.random() < 0.2 else self._next("c")
                nodes = self._nodes(depth, around)
                return Alternatives(
                    id=id_, options=tuple(Option(labels=(i,), node=node) for i, node in enumerate(nodes, start=1))
                )
            case "pick":
                id_ = self._next("p")
                node = self._node(depth - 1, (*around, f"?{id_}"))
                return Alternatives(id=id_, options=(Option(labels=tuple(self._robots), node=node),))
            case "held":
                robot = str(rng.choice([*around, *self._robots[:1]]))
                if robot in self._held:
                    return self._step(around)
                self._held.append(robot)
                node = self._node(depth - 1, (robot,))
                self._held.remove(robot)
                return Held(id=self._next("h"), robot=robot, part=node)
            case "claim":
                return Claimed(id=self._next("k"), claims=self._claims(1.0), part=self._node(depth - 1, around))
            case "by":
                return Deadline(ms=int(rng.integers(20, 120)), part=self._node(depth - 1, around))
            case _:
                return self._step(around)

    def _nodes(self, depth: int, around: tuple[str, ...]) -> tuple[Node, ...]:
        return tuple(self._node(depth - 1, around) for _ in range(2))

    def _claims(self, odds: float) -> tuple[str, ...]:
        return tuple(name for name in ("door", "gate") if self._rng.random() < odds / 2)

    def _step(self, around: tuple[str, ...]) -> Step:
        rng = self._rng
        symbols = any(robot.startswith("?") for robot in self._held)
        who = list(around) if symbols else [*around, *around, *self._robots]
        robots: tuple[str, ...] = (str(rng.choice(who)),)
        if rng.random() < 0.15 and not symbols:
            robots = tuple(dict.fromkeys((*robots, str(rng.choice(self._robots)))))
        if rng.random() < 0.1:
            robots = ()
        travels = bool(robots) and rng.random() < 0.6
        goal = str(rng.choice(self._places)) if travels else None
        ends = tuple(goal if rng.random() < 0.7 else None for _ in robots)
        return Step(
            id=self._next("s"),
            robots=robots,
            fixed_ms=int(rng.integers(0, 20)),
            goal=goal,
            odds=float(rng.choice([1.0, 1.0, 0.7])),
            ends=ends,
            claims=self._claims(0.5),
        )


def line_network(*parts: Node) -> Network:
    """Parts side by side, for robots r0 at p0 and r1 at p9 of places p0 ... p9, 10 ms apart, and `nowhere`.

    One at a time may use any resource, two at a time `hall`.
    """
    places = (*(f"p{i}" for i in range(10)), "nowhere")
    n = len(places)
    between = 10 * np.abs(np.arange(n)[:, None] - np.arange(n)[None])
    between[-1, :-1] = between[:-1, -1] = NO_WAY
    return Network(
        root=SideBySide(parts=parts),
        robots={"r0": Robot(name="r0"), "r1": Robot(name="r1")},
        team=2,
        travel=Travel(
            places=places,
            profile={"r0": 0, "r1": 0},
            between=(between,),
            here={"r0": between[0], "r1": between[9]},
        ),
        capacity={"hall": 2},
        exact=True,
    )


def is_small(network: Network) -> bool:
    """Whether brute force takes well below a second."""
    count, steps = 0, 0
    for _, node in ways(network.root):
        count, steps = count + 1, max(steps, size(node))
        if count * math.factorial(steps) > MOST_SCHEDULES:
            return False
    return True


def size(node: Node) -> int:
    """How many steps a part without choices has."""
    match node:
        case Step() | Underway():
            return 1
        case InSequence(parts=parts) | SideBySide(parts=parts) | AnyOrder(parts=parts):
            return sum(map(size, parts))
        case Held(part=part) | Claimed(part=part) | Deadline(part=part):
            return size(part)
        case Alternatives():
            raise ValueError("a choice remains")
