"""Draw the floor plans of a world as ROS map_server files: `python -m sim.floor_plan WORLD OUT_DIR`.

locMap is what a laser sees, a cut at the height of the scan; navMap is what a body can hit, everything up to the
height of the tallest robot, so tabletops too. Objects and robots are in neither. A cell is occupied if its center
is in a box: at 0.05 m a table leg of 6 cm is never lost.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim.errors import BadScenario
from sim.world import World, load_world

RESOLUTION_M = 0.05
MARGIN_M = 0.5  # around the inner rectangle of the lab
LASER_HEIGHT_M = 0.30
ROBOT_HEIGHT_M = 1.4

# As map_server writes them.
_FREE = 254
_OCCUPIED = 0
_YAML = """\
image: {name}.pgm
resolution: {resolution:g}
origin: [{origin:g}, {origin:g}, 0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""


def draw_floor_plans(world: World, folder: Path) -> tuple[Path, ...]:
    """Write locMap and navMap of `world` into `folder` (created if missing).

    Returns:
        The files written: for each map its `.yaml` and its `.pgm`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, low_m, high_m in (("locMap", LASER_HEIGHT_M, LASER_HEIGHT_M), ("navMap", 0.0, ROBOT_HEIGHT_M)):
        cells = occupied_cells(world, low_m, high_m)
        # The first row of a picture is its top, the last one of the map.
        pixels = np.where(cells[::-1], _OCCUPIED, _FREE).astype(np.uint8)
        head = f"P5\n{pixels.shape[1]} {pixels.shape[0]}\n255\n".encode("ascii")
        (folder / f"{name}.pgm").write_bytes(head + pixels.tobytes())
        text = _YAML.format(name=name, resolution=RESOLUTION_M, origin=-MARGIN_M)
        (folder / f"{name}.yaml").write_text(text, encoding="ascii")
        written += [folder / f"{name}.yaml", folder / f"{name}.pgm"]
    return tuple(written)


def occupied_cells(world: World, low_m: float, high_m: float) -> NDArray[np.bool_]:
    """Cells (rows along y, columns along x) where a box is between the heights `low_m` and `high_m`."""
    columns, rows = (round((size + 2 * MARGIN_M) / RESOLUTION_M) for size in world.size_m)
    x = (np.arange(columns) + 0.5) * RESOLUTION_M - MARGIN_M
    y = (np.arange(rows) + 0.5) * RESOLUTION_M - MARGIN_M
    cells = np.zeros((rows, columns), dtype=np.bool_)
    for box in world.boxes:
        if box.low[2] <= high_m and box.high[2] >= low_m:
            in_x = (box.low[0] <= x) & (x <= box.high[0])
            in_y = (box.low[1] <= y) & (y <= box.high[1])
            cells |= in_y[:, None] & in_x[None, :]
    return cells


def main(arguments: Sequence[str] | None = None) -> int:
    """Run from the command line; gives the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sim.floor_plan", description="Draw the maps of a world.")
    parser.add_argument("world", help="name of a world that comes with the simulator, or a .toml file")
    parser.add_argument("out_dir", type=Path, help="folder for {locMap,navMap}.{yaml,pgm}")
    options = parser.parse_args(arguments)
    source = Path(options.world) if options.world.endswith(".toml") else options.world
    try:
        draw_floor_plans(load_world(source), options.out_dir)
    except BadScenario as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
