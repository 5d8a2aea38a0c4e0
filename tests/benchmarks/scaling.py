"""How path planning scales with workers: processes of this machine and workers on a Ray cluster, side by side.

Plans paths across the map of tue_lab, each with another start, in this process, with 1 and 2 workers, and on Ray with 1
and 2 workers, on a cluster that is started here; `RAY_ADDRESS` names another. `*_per_s` is calls finished in a second
of wall time once the workers are warm, `*_speedup` that of 2 workers over 1. It is bounded by the processors that
are free: `processors` tells how many there are.
"""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Mapping

import numpy as np

from grounding.compute.settings import RaySettings, WorkerSettings
from grounding.messages import OccupancyGrid, pose_stamped
from grounding.on_ray import OnRay
from grounding.runner import Fields, Here, Runner, compute
from grounding.workers import Workers
from kb.files import SHIPPED
from tests.benchmarks.harness import Figure, main

_MAP_FILE = SHIPPED / "sites" / "tue_lab" / "navMap.yaml"
_SEED = 1


def run(quick: bool) -> Mapping[str, Figure]:
    """Measure each runner with the same calls."""
    asked = _requests(40 if quick else 400)
    figures: dict[str, Figure] = {"calls": len(asked), "processors": os.cpu_count() or 1}
    figures["here_per_s"] = _per_s(Here(), asked)
    ray = RaySettings(address=os.environ.get("RAY_ADDRESS", "local"))
    for kind in ("workers", "ray"):
        rates = []
        for count in (1, 2):
            settings = WorkerSettings(count=count, waiting=len(asked))
            begun = time.perf_counter()
            runner: Runner = Workers(settings) if kind == "workers" else OnRay(ray, settings)
            try:
                _per_s(runner, asked[: 4 * count])  # the workers start
                figures[f"{kind}_{count}_start_s"] = time.perf_counter() - begun
                rates.append(_per_s(runner, asked))
            finally:
                runner.close()
            figures[f"{kind}_{count}_per_s"] = rates[-1]
        figures[f"{kind}_speedup"] = rates[1] / rates[0]
    return figures


def _per_s(runner: Runner, asked: list[Fields]) -> float:
    begun = time.perf_counter()
    calls = [runner.submit("/compute/path", fields, t_s=0.0, timeout_s=120.0) for fields in asked]
    for call in calls:
        call.result()
    return len(asked) / (time.perf_counter() - begun)


def _requests(count: int) -> list[Fields]:
    """Paths between free cells of the map, the same with every call of this function."""
    grid = compute("/compute/nav_map", {"map_file": str(_MAP_FILE), "radius_m": 0.35}, t_s=0.0)["map"]
    assert isinstance(grid, OccupancyGrid)
    free = np.argwhere(np.asarray(grid.data).reshape(grid.info.height, grid.info.width) == 0)
    ends = np.random.default_rng(_SEED).choice(len(free), size=(count, 2))
    origin, cell_m = grid.info.origin.position, grid.info.resolution

    def pose(index: int) -> object:
        row, column = (float(x) for x in free[index])
        return pose_stamped(origin.x + (column + 0.5) * cell_m, origin.y + (row + 0.5) * cell_m, math.pi, t_s=0.0)

    mount = {"radius_m": 0.35, "laser_x_m": 0.0, "laser_y_m": 0.0, "laser_yaw_rad": 0.0}
    return [{"map": grid, "start": pose(a), "goal": pose(b), "scan": None, **mount} for a, b in ends]


if __name__ == "__main__":
    sys.exit(main("scaling", run))
