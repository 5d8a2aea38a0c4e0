"""What is learned from tries and trips: better durations, odds and travel factors than those that are stated.

What is stated counts as `PRIOR` tries, so that a few measurements change little and many decide:

  - odds: Beta-binomial. Stated odds p are Beta(PRIOR p, PRIOR (1 - p)); s successes and f failures make it
    Beta(PRIOR p + s, PRIOR (1 - p) + f), whose mean is learned (Gelman et al., Bayesian Data Analysis, 2.4).
  - duration of a try, whether it succeeds or not: normal-inverse-gamma around the stated one (Murphy, Conjugate
    Bayesian analysis of the Gaussian distribution, 2007, section 3). Its mean is learned, since the planner adds up
    expected times; over the odds it is the time until success, also where failures take longer (Wald's identity).
  - trips: took = factor of the robot * estimated way + duration_s of the process; Bayesian linear regression with
    the same kind of prior around factor 1 and the stated duration (Bishop, Pattern Recognition and Machine
    Learning, 3.3, with unknown variance), for all robots and processes at once.

Robots are told apart, and places of a robot, in the same way: what is learned from the tries of the others
counts as `PRIOR` tries of a robot, and what is learned from its tries elsewhere as those at a place, so that no try
counts twice. A robot, or a place, gets a number of its own only where the one that holds otherwise is not among
those that are likely at 99 percent: else it may well be chance, as many robots and places are compared.

Against outliers, the 5 percent longest and the 5 percent shortest (at least one of each) count as the next to
them: Winsorized means (Dixon 1960), whose spread is larger by n over those left as they are (Tukey, McLaughlin 1963).
From fewer than `FEWEST` tries nothing is learned.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv, stdtrit

from kb.experience import Tries, Trip
from kb.ontology import Ontology
from kb.vocabulary import Kind, Property

PRIOR = 10.0
FEWEST = 5
_TAIL = 0.05
_UP_TO = 0.995  # low and high leave out half a percent at each end
_SPREAD = 0.25  # of a stated duration: how far off it is taken to be before anything was measured
_SHAPE = PRIOR / 2  # of the inverse gamma: the spread is stated as firmly as the mean
_MS_PER_S = 1000.0
_DIGITS = {Property.DURATION_S: 3, Property.SUCCESS_ODDS: 4, Property.TRAVEL_FACTOR: 3, Property.RECOVERY_ODDS: 4}
_LEAST = {
    Property.DURATION_S: 0.0,
    Property.SUCCESS_ODDS: 0.0001,
    Property.TRAVEL_FACTOR: 0.05,
    Property.RECOVERY_ODDS: 0.0001,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Lesson:
    """A number that was learned, whether or not it differs from what is stated.

    Attributes:
        prop: duration_s, successOdds, travelFactor or recoveryOdds.
        subject: Name of the process, robot or recovery.
        stated: What the files of people say; of a single robot, what is learned of all; of a robot at a place, what
            is learned of the robot.
        learned: What tries and trips say, rounded as it is written.
        low, high: It is between these with a probability of 99 percent.
        tries: How many tries or trips it comes from.
        robot: Of a process: the robot that it is about, if it is about one.
        place: Where, if it is about that robot at a place.
    """

    prop: Property
    subject: str
    stated: float
    learned: float
    low: float
    high: float
    tries: int
    robot: str = ""
    place: str = ""

    @property
    def differs(self) -> bool:
        """Whether it would change a plan; of a single robot or a place, if it is hardly chance."""
        doubtful = self.robot != "" and self.low <= self.stated <= self.high
        return not doubtful and self.learned != round(self.stated, _DIGITS[self.prop])

    @property
    def source(self) -> str:
        """Where it comes from, in a sentence."""
        measured = "trips" if self.prop == Property.TRAVEL_FACTOR else "tries"
        otherwise = f"of {self.robot}" if self.place else "of all robots" if self.robot else "stated"
        return (
            f"{self.tries} {measured}; {otherwise} {_short(self.stated)}, "
            f"with 99 percent between {_short(self.low)} and {_short(self.high)}"
        )


def learn(tries: Sequence[Tries], trips: Sequence[Trip], stated: Ontology) -> list[Lesson]:
    """What a site can learn, by property and subject.

    Args:
        stated: The knowledge without what was learned before.
    """
    lessons: list[Lesson] = []
    for name in sorted({t.process for t in tries}):
        own = [t for t in tries if t.process == name]
        if sum(t.count for t in own) < FEWEST:
            continue
        if stated.is_a(name, Kind.RECOVERY):
            helps = _odds(name, own, _stated(stated, Property.RECOVERY_ODDS, name, 1.0))
            lessons.append(replace(helps, prop=Property.RECOVERY_ODDS))
        if not _is_step(name, stated):
            continue
        lessons += _by_robot(_odds(name, own, _stated(stated, Property.SUCCESS_ODDS, name, 1.0)), own, _odds, stated)
        if stated.is_a(name, Kind.ATOMIC_PROCESS):
            of_all = _duration(name, own, _stated(stated, Property.DURATION_S, name, 0.0))
            lessons += _by_robot(of_all, own, _duration, stated)
    known = [t for t in trips if _travels(t.process, stated) and stated.is_a(t.robot, Kind.ROBOT)]
    if len(known) >= FEWEST:
        lessons += _travel(known, stated)
    return sorted(lessons, key=lambda lesson: (lesson.prop, lesson.subject, lesson.robot, lesson.place))


def _is_step(process: str, stated: Ontology) -> bool:
    """Whether there still is such a process, and as one step: it may have been changed since it was tried."""
    return stated.is_a(process, Kind.ATOMIC_PROCESS) or _travels(process, stated)


def _travels(process: str, stated: Ontology) -> bool:
    return stated.value(Property.HAS_DURATION_MODEL, process) is not None


def _stated(ontology: Ontology, prop: Property, subject: str, otherwise: float) -> float:
    value = ontology.value(prop, subject)
    return float(value) if isinstance(value, int | float) else otherwise


def _by_robot(
    of_all: Lesson,
    tries: Sequence[Tries],
    learned: Callable[[str, Sequence[Tries], float], Lesson],
    stated: Ontology,
) -> Iterator[Lesson]:
    """What is learned of a process, then of each robot, and of each robot at each place."""
    yield of_all
    name, before = of_all.subject, of_all.stated
    for robot, own, others in _told_apart(tries, "robot", Kind.ROBOT, stated):
        prior = learned(name, others, before).learned
        of_robot = replace(learned(name, own, prior), stated=of_all.learned, robot=robot)
        yield of_robot
        above = of_robot.learned if of_robot.differs else of_all.learned
        for place, there, elsewhere in _told_apart(own, "place", Kind.LOCATION, stated):
            at_place = learned(name, there, learned(name, elsewhere, prior).learned)
            yield replace(at_place, stated=above, robot=robot, place=place)


def _told_apart(
    tries: Sequence[Tries], by: str, kind: Kind, stated: Ontology
) -> Iterator[tuple[str, list[Tries], list[Tries]]]:
    """Each robot or place that there still is, of which there are enough tries, with those and with all others."""
    for name in sorted({getattr(t, by) for t in tries}):
        own = [t for t in tries if getattr(t, by) == name]
        others = [t for t in tries if getattr(t, by) != name]
        if stated.is_a(name, kind) and sum(t.count for t in own) >= FEWEST and others:
            yield name, own, others


def _odds(name: str, tries: Iterable[Tries], stated: float) -> Lesson:
    succeeded = failed = 0
    for t in tries:
        succeeded, failed = succeeded + t.count * t.succeeded, failed + t.count * (not t.succeeded)
    a, b = PRIOR * stated + succeeded, PRIOR * (1 - stated) + failed
    low, high = (float(betaincinv(a, b, q)) for q in (1 - _UP_TO, _UP_TO)) if b > 0 else (1.0, 1.0)
    return _lesson(Property.SUCCESS_ODDS, name, stated, a / (a + b), low, high, succeeded + failed)


def _duration(name: str, tries: Iterable[Tries], stated: float) -> Lesson:
    took = np.concatenate([np.full(t.count, t.took_ms / _MS_PER_S) for t in tries])
    x = winsorized(took)
    n, mean = len(x), float(x.mean())
    spread = float(((x - mean) ** 2).sum()) * (n / (n - 2 * _moved(n))) ** 2
    kappa, alpha = PRIOR + n, _SHAPE + n / 2
    learned = (PRIOR * stated + n * mean) / kappa
    beta = _SHAPE * max(_SPREAD * stated, 1 / _MS_PER_S) ** 2
    beta += spread / 2 + PRIOR * n * (mean - stated) ** 2 / (2 * kappa)
    off = float(stdtrit(2 * alpha, _UP_TO)) * math.sqrt(beta / (alpha * kappa))
    return _lesson(Property.DURATION_S, name, stated, learned, learned - off, learned + off, n)


def _travel(trips: Sequence[Trip], stated: Ontology) -> list[Lesson]:
    robots, processes = sorted({t.robot for t in trips}), sorted({t.process for t in trips})
    way, took = (np.array([getattr(t, f) / _MS_PER_S for t in trips]) for f in ("way_ms", "took_ms"))
    design = np.zeros((len(trips), len(robots) + len(processes)))
    for row, trip in enumerate(trips):
        design[row, robots.index(trip.robot)] = way[row]
        design[row, len(robots) + processes.index(trip.process)] = 1.0
    prior = np.array(
        [_stated(stated, Property.TRAVEL_FACTOR, r, 1.0) for r in robots]
        + [_stated(stated, Property.DURATION_S, p, 0.0) for p in processes]
    )
    firmness = np.diag([PRIOR * max(float((way**2).mean()), 1e-6)] * len(robots) + [PRIOR] * len(processes))
    theta, scale = _regression(design, took, prior, firmness)
    fitted = design @ theta
    theta, scale = _regression(design, fitted + winsorized(took - fitted), prior, firmness)
    off = float(stdtrit(2 * _SHAPE + len(trips), _UP_TO)) * scale
    lessons = []
    for place, name in enumerate([*robots, *processes]):
        prop = Property.TRAVEL_FACTOR if place < len(robots) else Property.DURATION_S
        count = sum(name in (t.robot, t.process) for t in trips)
        low, high = float(theta[place] - off[place]), float(theta[place] + off[place])
        lesson = _lesson(prop, name, float(prior[place]), float(theta[place]), low, high, count)
        if place < len(robots):
            lessons.append(lesson)
            continue
        beside = took - design[:, : len(robots)] @ theta[: len(robots)]
        own = [_beside(t, s) for t, s in zip(trips, beside, strict=True) if t.process == name]
        lessons += _by_robot(lesson, own, _duration, stated)
    return lessons


def _beside(trip: Trip, seconds: float) -> Tries:
    """What a trip took besides its way, at the pace of its robot."""
    return Tries(
        process=trip.process,
        robot=trip.robot,
        place=trip.place,
        took_ms=round(seconds * _MS_PER_S),  # below 0 too, else what scatters would seem to take longer
        succeeded=True,
        count=1,
    )


def _regression(
    design: NDArray[np.float64], y: NDArray[np.float64], prior: NDArray[np.float64], firmness: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Means of the coefficients, and the scales of their t distributions."""
    precision: NDArray[np.float64] = design.T @ design + firmness
    theta = np.linalg.solve(precision, design.T @ y + firmness @ prior).astype(np.float64)
    alpha = _SHAPE + len(y) / 2
    left = float(((y - design @ theta) ** 2).sum() + (theta - prior) @ firmness @ (theta - prior))
    beta = _SHAPE * (_SPREAD * float(y.mean())) ** 2 + left / 2
    variances: NDArray[np.float64] = beta / alpha * np.diag(np.linalg.inv(precision))
    return theta, np.sqrt(variances)


def winsorized(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same, with the 5 percent largest and smallest, at least one of each, moved to the next to them."""
    moved = _moved(len(x))
    ordered = np.sort(x)
    return np.clip(x, ordered[moved], ordered[-1 - moved])


def _moved(count: int) -> int:
    """How many of so many count as the next to them, at each end."""
    return max(1, math.floor(_TAIL * count)) if count > 2 else 0


def _lesson(prop: Property, subject: str, stated: float, learned: float, low: float, high: float, tries: int) -> Lesson:
    digits = _DIGITS[prop]
    return Lesson(
        prop=prop,
        subject=subject,
        stated=stated,
        learned=max(round(learned, digits), _LEAST[prop]),
        low=max(low, 0.0),
        high=high,
        tries=tries,
    )


def _short(number: float) -> str:
    return f"{number:.4g}"
