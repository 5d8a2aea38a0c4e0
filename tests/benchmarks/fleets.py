"""Fleets of robots that find empty drinks: the instances that the benchmark of the planner goes through.

A hall is a square; robots wait at docks, drinks stand at spots, both on a grid of 0.1 m. A robot drives along
the grid (Manhattan distance) at 1 or 2 m/s and takes 1 s to detect a drink at its spot. About 60 percent of the drinks
are told only by a Kinect, which two thirds of the robots have; the others by any color camera, which all have.

In the coupled variant a drink that has been found is fetched by a robot with an arm (every other one): to the drink,
grasp it, to the door, through it, to the table, put it down, and back through the door. The door is in the middle of
the hall's south wall and lets one robot through at a time; the table is 2 m east of it and 2 m further south. The
robot that fetches sets off when the drink has been found, and does nothing else until it is back in the hall.

All times are integer milliseconds, all lengths integer decimeters.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from planner.network import NO_WAY, Milliseconds, Travel

SIZES = ((2, 2), (3, 4), (4, 6), (6, 10), (10, 20), (20, 50), (50, 200))
OPTIMA_MS = {
    (2, 2): 5_700,
    (3, 4): 13_800,
    (4, 6): 8_900,
    (6, 10): 8_600,
    (10, 20): 10_200,
    (20, 50): 14_100,
}
"""Least makespans of the instances of seed 1, without fetching: proven by two methods that share nothing."""

DETECT_MS, GRASP_MS, PUT_MS, PASS_MS = 1_000, 2_000, 2_000, 2_000
DOOR_LENGTH_DM, TABLE_EAST_DM, TABLE_SOUTH_DM = 10, 20, 20

FIND, COLLECT, LEAVE, SERVE, RETURN = "find", "collect", "leave", "serve", "return"
FETCHING = (COLLECT, LEAVE, SERVE, RETURN)

Act = tuple[str, int, int]
"""What, which robot, which drink; a plan is a sequence of these in order of start.

FIND: drive there, detect. COLLECT: drive there, grasp, drive to the door. LEAVE: through the door. SERVE: drive to
the table, put it down, drive to the door. RETURN: through the door.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Instance:
    """One fleet and its drinks.

    Attributes:
        xy_dm: Docks by robot, then spots by drink, then the door's inside and outside and the table.
        speed_mps: By robot; 1 or 2.
        has_kinect: By robot.
        has_arm: By robot.
        needs_kinect: By drink.
    """

    robots: int
    drinks: int
    seed: int
    coupled: bool
    xy_dm: tuple[tuple[int, int], ...]
    speed_mps: tuple[int, ...]
    has_kinect: tuple[bool, ...]
    has_arm: tuple[bool, ...]
    needs_kinect: tuple[bool, ...]

    @property
    def inside(self) -> int:
        """The place on this side of the door."""
        return self.robots + self.drinks

    @property
    def outside(self) -> int:
        """The place on the other side of the door."""
        return self.inside + 1

    @property
    def table(self) -> int:
        """The place where drinks are put."""
        return self.inside + 2

    def spot(self, drink: int) -> int:
        """The place of a drink."""
        return self.robots + drink

    def finders(self, drink: int) -> list[int]:
        """The robots that can find a drink."""
        return [r for r in range(self.robots) if self.has_kinect[r] or not self.needs_kinect[drink]]

    def fetchers(self) -> list[int]:
        """The robots that can fetch."""
        return [r for r in range(self.robots) if self.has_arm[r]]

    def travel_ms(self, robot: int, start: int, goal: int) -> int:
        """How long a robot drives between two places on the same side of the door."""
        return self.alike_travel_ms(self.speed_mps[robot], start, goal)

    def alike_travel_ms(self, speed_mps: int, start: int, goal: int) -> int:
        """How long robots of a speed drive."""
        (x1, y1), (x2, y2) = self.xy_dm[start], self.xy_dm[goal]
        return 100 * math.ceil((abs(x1 - x2) + abs(y1 - y2)) / speed_mps)

    def duration_ms(self, what: str, robot: int, drink: int, start: int) -> int:
        """How long an act takes from where the robot is."""
        match what:
            case "find":
                return self.travel_ms(robot, start, self.spot(drink)) + DETECT_MS
            case "collect":
                there = self.travel_ms(robot, start, self.spot(drink))
                return there + GRASP_MS + self.travel_ms(robot, self.spot(drink), self.inside)
            case "serve":
                there = self.travel_ms(robot, self.outside, self.table)
                return there + PUT_MS + self.travel_ms(robot, self.table, self.outside)
            case _:
                return PASS_MS

    def end_of(self, what: str, drink: int) -> int:
        """Where an act ends."""
        match what:
            case "find":
                return self.spot(drink)
            case "collect" | "return":
                return self.inside
            case _:
                return self.outside


def draw(robots: int, drinks: int, seed: int = 1, *, coupled: bool = False) -> Instance:
    """The instance of this size and seed, always the same."""
    chance = random.Random(1000 * robots + 10 * drinks + seed)
    side_dm = 10 * max(10, math.ceil(math.sqrt(robots + drinks) * 4))
    places = [(chance.randrange(side_dm), chance.randrange(side_dm)) for _ in range(robots + drinks)]
    speeds = [chance.choice([1, 2]) for _ in range(robots)]
    without_kinect = set(chance.sample(range(robots), robots // 3))
    needs_kinect = [chance.random() < 0.6 for _ in range(drinks)]
    armed = set(random.Random(7 + robots).sample(range(robots), (robots + 1) // 2))
    door_x_dm = side_dm // 2
    outside_y_dm = -DOOR_LENGTH_DM
    table = (door_x_dm + TABLE_EAST_DM, outside_y_dm - TABLE_SOUTH_DM)
    return Instance(
        robots=robots,
        drinks=drinks,
        seed=seed,
        coupled=coupled,
        xy_dm=(*places, (door_x_dm, 0), (door_x_dm, outside_y_dm), table),
        speed_mps=tuple(speeds),
        has_kinect=tuple(r not in without_kinect for r in range(robots)),
        has_arm=tuple(r in armed for r in range(robots)),
        needs_kinect=tuple(needs_kinect),
    )


def robot_name(robot: int) -> str:
    """The individual in the ontology."""
    return f"robot_{robot + 1:02}"


def drink_name(drink: int) -> str:
    """The individual in the ontology."""
    return f"drink_{drink + 1:03}"


def place_names(instance: Instance) -> list[str]:
    """The locations in the ontology, in the order of `Instance.xy_dm`."""
    docks = [f"dock_{r + 1:02}" for r in range(instance.robots)]
    spots = [f"spot_{d + 1:03}" for d in range(instance.drinks)]
    return [*docks, *spots, "door_inside", "door_outside", "table_side"]


def travel_times(instance: Instance) -> Callable[[Sequence[str], Sequence[str]], Travel]:
    """What the planner asks: how long robots drive, between the places that they may have to go to."""
    number_of = {name: n for n, name in enumerate(place_names(instance))}
    dock_of = {robot_name(r): r for r in range(instance.robots)}
    speeds = sorted(set(instance.speed_mps))
    xy_dm = np.array(instance.xy_dm, dtype=np.int64)
    is_beyond = np.isin(np.arange(len(xy_dm)), (instance.outside, instance.table))

    def table(speed_mps: int, starts: Sequence[int], goals: Sequence[int]) -> Milliseconds:
        distance_dm = np.abs(xy_dm[starts, np.newaxis] - xy_dm[np.newaxis, goals]).sum(axis=2)
        ms = -(-distance_dm // speed_mps) * 100  # rounded up to 0.1 s
        return np.where(is_beyond[starts, np.newaxis] == is_beyond[goals], ms, NO_WAY)

    def times(robots: Sequence[str], places: Sequence[str]) -> Travel:
        goals = [number_of[place] for place in places]
        speed_mps = {name: instance.speed_mps[dock_of[name]] for name in robots}
        return Travel(
            places=tuple(places),
            profile={name: speeds.index(speed) for name, speed in speed_mps.items()},
            between=tuple(table(speed, goals, goals) for speed in speeds),
            here={name: table(speed, [dock_of[name]], goals)[0] for name, speed in speed_mps.items()},
        )

    return times


class IllegalPlan(ValueError):
    """A plan does not do what the instance asks for, or not with these robots."""


def makespan_ms(instance: Instance, plan: Sequence[Act]) -> int:
    """What a plan is really worth: every act as early as the order of the plan allows.

    Raises:
        IllegalPlan: Something is not done, done twice, by a robot that cannot, or out of order.
    """
    at, free_ms = list(range(instance.robots)), [0] * instance.robots
    door_free_ms = 0
    carried: list[tuple[int, int] | None] = [None] * instance.robots
    """By robot: the drink that it fetches, and how much of FETCHING is done."""
    found_ms: dict[int, int] = {}
    fetched: set[int] = set()
    for what, robot, drink in plan:
        start_ms, load = free_ms[robot], carried[robot]
        if what == FIND:
            if load is not None or drink in found_ms or robot not in instance.finders(drink):
                raise IllegalPlan(f"{what} {drink} by {robot}: found already, the robot is at something else, or can't")
        elif (load or (drink, 0)) != (drink, FETCHING.index(what)) or not instance.has_arm[robot]:
            raise IllegalPlan(f"{what} {drink} by {robot}: not its turn, or it has no arm")
        elif what == COLLECT:
            if drink not in found_ms or drink in fetched:
                raise IllegalPlan(f"{what} {drink}: not found yet, or fetched already")
            fetched.add(drink)
            start_ms = max(start_ms, found_ms[drink])
        elif what in (LEAVE, RETURN):
            start_ms = max(start_ms, door_free_ms)
        end_ms = start_ms + instance.duration_ms(what, robot, drink, at[robot])
        if what == FIND:
            found_ms[drink] = end_ms
        else:
            carried[robot] = None if what == RETURN else (drink, FETCHING.index(what) + 1)
        if what in (LEAVE, RETURN):
            door_free_ms = end_ms
        at[robot], free_ms[robot] = instance.end_of(what, drink), end_ms
    missing = set(range(instance.drinks)) - (fetched if instance.coupled else set(found_ms))
    if missing or any(carried):
        raise IllegalPlan(f"the drinks {sorted(missing)} are not found or not fetched, or robots are not back")
    return max(free_ms, default=0)
