"""Travel times: length over speed, the same there and back, infinite where there is no way."""

from __future__ import annotations

import itertools
import math
from pathlib import Path as FilePath

import numpy as np
import pytest
from numpy.typing import NDArray

from grounding.compute.errors import ComputeFailed
from grounding.compute.maps import nav_map
from grounding.compute.path import path
from grounding.compute.travel import travel
from grounding.messages import Path, header
from tests.grounding.compute.rooms import INSIDE, MOUNT, ROOMS, WALLS, Box, at, grid_with

SPEED_MPS = 0.5


def map_file(folder: FilePath, boxes: tuple[Box, ...]) -> FilePath:
    """A map of boxes as ROS map_server writes it: white is free, black is occupied."""
    grid = grid_with(boxes)
    cells = np.frombuffer(grid.data, dtype=np.int8).reshape(grid.rows, grid.columns)
    pixels = np.where(cells[::-1] > 0, 0, 254).astype(np.uint8)
    (folder / "map.pgm").write_bytes(f"P5\n{grid.columns} {grid.rows}\n255\n".encode() + pixels.tobytes())
    file = folder / "map.yaml"
    file.write_text(
        f"image: map.pgm\nresolution: {grid.resolution_m}\norigin: [{grid.x_m}, {grid.y_m}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )
    return file


def seconds(
    file: FilePath, *places: tuple[float, float], radius_m: float = 0.3, speed: float = SPEED_MPS
) -> NDArray[np.float64]:
    """Travel times between places, a row for each start; the same for robots that stand there."""
    stops = Path(header=header("map", 0.0), poses=[at(x_m, y_m) for x_m, y_m in places])
    robots = Path(header=header("map", 0.0), poses=[*reversed(stops.poses), *stops.poses])
    found = travel(map_file=file, radius_m=radius_m, max_vel_lin_mps=speed, starts=robots, places=stops, t_s=0.0)
    table: NDArray[np.float64] = found["seconds"].data.reshape(3 * len(places), len(places))
    between = table[2 * len(places) :]
    assert np.array_equal(table[: len(places)], between[::-1])
    assert np.array_equal(table[len(places) : 2 * len(places)], between)
    return between


def test_a_straight_way_takes_its_length_over_the_speed(tmp_path: FilePath) -> None:
    """2.0 m at 0.5 m/s is 4 s, along an axis and slantwise; staying takes no time; twice the speed, half the time."""
    file = map_file(tmp_path, WALLS)
    table = seconds(file, (1.0, 1.0), (3.0, 1.0), (1.0 + 2.0 * math.cos(0.5), 1.0 + 2.0 * math.sin(0.5)))
    assert table[0, 1] == pytest.approx(4.0, abs=0.1)
    assert table[0, 2] == pytest.approx(4.0, rel=0.09)
    assert np.diag(table) == pytest.approx(np.zeros(3), abs=1e-9)
    assert seconds(file, (1.0, 1.0), (3.0, 1.0), speed=1.0)[0, 1] == pytest.approx(table[0, 1] / 2.0)


def test_the_way_leads_around_the_wall_and_takes_the_same_back(tmp_path: FilePath) -> None:
    """As long as the path that is driven, through the opening, and within 2 % the same in both directions."""
    places = ((2.0, 0.6), (4.0, 0.6), (1.5, 3.2), (3.8, 2.2))
    file = map_file(tmp_path, ROOMS)
    table = seconds(file, *places)
    assert np.isfinite(table).all()
    off = ~np.eye(len(places), dtype=bool)
    assert (np.abs(table - table.T)[off] <= 0.02 * table[off]).all()
    around_m = 2.0 * math.dist((2.0, 0.6), (3.0, 1.4))  # a point could go by the corner itself
    assert around_m / SPEED_MPS < table[0, 1] < 1.5 * around_m / SPEED_MPS
    grid = nav_map(map_file=file, radius_m=0.3, t_s=0.0)["map"]
    start, goal = at(*places[0]), at(*places[1])
    driven = path(map=grid, start=start, goal=goal, scan=None, radius_m=0.3, **MOUNT, t_s=0.0)["path"].poses
    legs_m = [
        math.dist((a.pose.position.x, a.pose.position.y), (b.pose.position.x, b.pose.position.y))
        for a, b in itertools.pairwise(driven)
    ]
    assert table[0, 1] == pytest.approx(sum(legs_m) / SPEED_MPS, rel=0.02)


def test_where_there_is_no_way_it_takes_forever(tmp_path: FilePath) -> None:
    """The opening walled up; within each room there still is a way."""
    closed = (*ROOMS, (2.95, 1.4, 3.05, 2.9))
    table = seconds(map_file(tmp_path, closed), (1.5, 0.8), (4.5, 0.8), (4.2, 2.0))
    assert math.isinf(table[0, 1])
    assert math.isinf(table[1, 0])
    assert math.isfinite(table[1, 2])


def test_a_robot_too_wide_for_the_opening_does_not_get_through(tmp_path: FilePath) -> None:
    """1.5 m between the posts: a radius of 0.6 m passes, one of 0.8 m does not."""
    file = map_file(tmp_path, (*WALLS, *INSIDE[:2]))
    assert math.isfinite(seconds(file, (1.5, 2.1), (4.5, 2.1), radius_m=0.6)[0, 1])
    assert math.isinf(seconds(file, (1.5, 2.1), (4.5, 2.1), radius_m=0.8)[0, 1])


def test_no_place_has_no_times(tmp_path: FilePath) -> None:
    """An empty table."""
    assert seconds(map_file(tmp_path, WALLS)).shape == (0, 0)


def test_a_missing_map_is_told(tmp_path: FilePath) -> None:
    """BadInput with the name of the file."""
    with pytest.raises(ComputeFailed, match=r"nowhere\.yaml") as caught:
        seconds(tmp_path / "nowhere.yaml", (1.0, 1.0))
    assert caught.value.code == "BadInput"
