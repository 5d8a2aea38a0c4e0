"""Whether to try again or to plan for another robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import permutations

import numpy as np
import pytest

from executive.recovering import UNDONE_S, decide
from kb.recoveries import Recovery


def way(name: str, time_s: float, odds: float, attempts: int = 1) -> Recovery:
    """A way to try again."""
    return Recovery(name=name, time_s=time_s, odds=odds, attempts=attempts, pause_s=0.0)


def helped(ways: Sequence[Recovery], remaining_s: float) -> dict[str, float]:
    """Until the task is done if each has helped, with so much left to do then."""
    return {one.name: one.time_s + remaining_s for one in ways}


QUICK, SURE = way("quick", 1.0, 0.3, 2), way("sure", 11.0, 0.9, 1)


def test_what_is_over_sooner_in_expectation_is_chosen() -> None:
    """Two quick tries at odds of 0.3, with 5 s left after one that helps, and 12 s without the robot."""
    decision = decide([QUICK], {}, helped_s=helped([QUICK], 5.0), other_s=12.0)
    assert decision.recovery == QUICK
    once = 1.0 + 0.3 * 5.0 + 0.7 * 12.0
    twice = 1.0 + 0.3 * 5.0 + 0.7 * once
    assert decision.reason == f"{twice:.1f} s with quick or 12.0 s without what has failed"


@pytest.mark.parametrize(
    ("tried", "remaining_s", "other_s", "chosen"),
    [
        ({}, 5.0, 6.0, ""),  # the other one is hardly slower
        ({"quick": 2}, 5.0, 100.0, "sure"),
        ({"quick": 2, "sure": 1}, 5.0, 100.0, ""),
        ({}, 5.0, None, "quick"),  # and then the sure one
        ({"quick": 2}, 5.0, None, "sure"),
        ({"quick": 2, "sure": 1}, 5.0, None, ""),
        ({}, 90_000.0, None, ""),  # no better than a task that fails
    ],
)
def test_what_is_tried_depends_on_what_is_left(
    tried: Mapping[str, int], remaining_s: float, other_s: float | None, chosen: str
) -> None:
    """Each way as often as it may be; without another robot, whatever may help."""
    decision = decide([QUICK, SURE], tried, helped_s=helped([QUICK, SURE], remaining_s), other_s=other_s)
    assert (decision.recovery.name if decision.recovery else "") == chosen
    assert decision.reason


def tries(ways: Sequence[Recovery]) -> list[Recovery]:
    """Each way as often as it may be tried."""
    return [w for w in ways for _ in range(w.attempts)]


def test_no_order_of_tries_is_better() -> None:
    """Against all sequences of tries, the first of which is the one that is chosen: random ways."""
    rng = np.random.default_rng(11)
    for _ in range(60):
        ways = [
            way(f"w{n}", float(rng.uniform(0.5, 30)), float(rng.uniform(0.05, 1)), int(rng.integers(1, 3)))
            for n in range(int(rng.integers(1, 4)))
        ]
        remaining_s, other_s = float(rng.uniform(0, 40)), float(rng.uniform(5, 60))
        expected: dict[tuple[str, ...], float] = {(): other_s}
        for count in range(1, len(tries(ways)) + 1):
            for order in permutations(tries(ways), count):
                after = other_s
                for one in reversed(order):
                    after = one.time_s + one.odds * remaining_s + (1 - one.odds) * after
                expected[tuple(w.name for w in order)] = after
        best = min(expected, key=lambda names: expected[names])
        chosen = decide(ways, {}, helped_s=helped(ways, remaining_s), other_s=other_s).recovery
        assert expected[best] == pytest.approx(
            min(s for names, s in expected.items() if names[:1] == ((chosen.name,) if chosen else ()))
        )


def test_a_task_that_fails_counts_as_a_day() -> None:
    """Odds of one in ten thousand are still worth eight seconds, and not nine."""
    for time_s, worth in ((8.0, True), (9.0, False)):
        slim = way("slim", time_s, 0.0001)
        assert (decide([slim], {}, helped_s={"slim": time_s}, other_s=None).recovery is not None) is worth
    assert UNDONE_S == 86_400.0
