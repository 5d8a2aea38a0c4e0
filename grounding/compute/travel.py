"""How long a robot travels between places, for planning."""

from __future__ import annotations

import functools
import pathlib

import numpy as np

from grounding.compute.grids import Grid, grid_of
from grounding.compute.maps import nav_map
from grounding.compute.path import path_lengths_m
from grounding.messages import Float64MultiArray, MultiArrayLayout, Path


def travel(
    *, map_file: pathlib.Path, radius_m: float, max_vel_lin_mps: float, starts: Path, places: Path, t_s: float
) -> dict[str, Float64MultiArray]:
    """Travel times to places, from where robots are and from each other: length of the path over the robot's speed.

    Args:
        map_file: The map that robots find their way in (ROS map_server yaml).
        radius_m: Radius of the robot.
        max_vel_lin_mps: Its speed.
        starts: Where robots are.
        places: Where they may go to, and on from there.
        t_s: Time of the call.

    Returns:
        `seconds`: row by row, from each start and then from each place, to each place; infinite where there is no way.

    Raises:
        ComputeFailed: BadInput, if the map file is not usable.
    """
    grid = nav_map(map_file=map_file, radius_m=radius_m, t_s=t_s)["map"]
    here, there = ([(p.pose.position.x, p.pose.position.y) for p in path.poses] for path in (starts, places))
    distinct = {point: row for row, point in enumerate(dict.fromkeys(here))}
    from_starts_m = _lengths_m(grid_of(grid), tuple(distinct), tuple(there))[[distinct[point] for point in here]]
    lengths_m = np.concatenate([from_starts_m, _lengths_m(grid_of(grid), tuple(there), tuple(there))])
    layout = MultiArrayLayout(dim=[], data_offset=0)
    return {"seconds": Float64MultiArray(layout=layout, data=(lengths_m / max_vel_lin_mps).ravel())}


@functools.lru_cache(maxsize=64)
def _lengths_m(
    grid: Grid, starts: tuple[tuple[float, float], ...], goals: tuple[tuple[float, float], ...]
) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return path_lengths_m(grid, list(starts), list(goals))
