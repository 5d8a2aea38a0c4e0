"""Travel times for the planner: what is asked for, where, and how often."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from executive.opening import prepare
from executive.travel import travel_times
from grounding.caching import CacheCount
from grounding.compute.settings import ComputeSettings
from grounding.messages import PoseStamped, pose_stamped
from grounding.placed import Placed
from grounding.runner import Here
from kb.errors import ServiceFailed
from kb.store import Snapshot
from planner.network import Travel

SERVICE = "/compute/travel"
ROBOTS, PLACES = ("amigo_1", "pico_1"), ("at_bar", "start_west")


@pytest.fixture
def placed(snapshot: Snapshot, tmp_path: Path) -> Iterator[Placed]:
    """The runner of the shipped site, without settings."""
    made = Placed(ComputeSettings(), tmp_path)
    prepare(snapshot, made)
    yield made
    made.close()


def asked(placed: Placed, snapshot: Snapshot, t_s: float, *, x_m: float = 2.0, measured_s: float = 0.0) -> Travel:
    """Travel times at a time, from poses that were measured at another."""

    def pose(robot: str) -> PoseStamped:
        return pose_stamped(x_m, 2.0, 0.0, t_s=measured_s)

    return travel_times(ROBOTS, PLACES, snapshot, pose, placed, t_s=t_s)


def test_where_robots_stand_still_an_estimate_is_known(snapshot: Snapshot, placed: Placed) -> None:
    """Whenever it is asked for and their poses were measured; it is what is computed without a cache."""
    first = asked(placed, snapshot, 1.0)
    misses = placed.cache_counts()[SERVICE].misses
    later = asked(placed, snapshot, 9.0, measured_s=8.0)
    assert placed.cache_counts() == {SERVICE: CacheCount(hits=misses, misses=misses)}
    alone = travel_times(ROBOTS, PLACES, snapshot, lambda robot: pose_stamped(2.0, 2.0, 0.0, t_s=0.0), Here(), t_s=1.0)
    for travel in (later, alone):
        assert (travel.places, travel.profile) == (first.places, first.profile)
        for one, other in zip(travel.between, first.between, strict=True):
            np.testing.assert_array_equal(one, other)
        for robot in ROBOTS:
            np.testing.assert_array_equal(travel.here[robot], first.here[robot])


def test_who_stands_elsewhere_is_estimated_anew(snapshot: Snapshot, placed: Placed) -> None:
    """Another place is another request."""
    asked(placed, snapshot, 1.0)
    misses = placed.cache_counts()[SERVICE].misses
    asked(placed, snapshot, 1.0, x_m=3.0)
    assert placed.cache_counts()[SERVICE] == CacheCount(hits=0, misses=2 * misses)


def test_files_of_others_are_not_read(snapshot: Snapshot, tmp_path: Path) -> None:
    """A site's own are allowed by its knowledge, as those of other services are."""
    made = Placed(ComputeSettings(), tmp_path)
    with pytest.raises(ServiceFailed, match=r"map_file .* is not in .* where files of this site are"):
        asked(made, snapshot, 1.0)
    made.close()
