"""Occupancy grids as values: hashable, so that what is derived from a map is computed once per map.

Cell (row, column) has its center at `origin + resolution * (column + 0.5, row + 0.5)`; row 0 is at the
bottom, as in nav_msgs/OccupancyGrid.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from grounding.compute.errors import ComputeFailed
from grounding.messages import MapMetaData, OccupancyGrid, header, planar_pose, stamp_of, yaw_of

FREE, OCCUPIED, UNKNOWN = 0, 100, -1


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Content of an occupancy grid, without frame and stamp.

    Attributes:
        data: One int8 per cell, row by row from the origin: 0 free, 100 occupied, -1 unknown.
        rows: Number of rows.
        columns: Number of columns.
        resolution_m: Edge of a cell.
        x_m: Lower left corner of cell (0, 0) in the map frame.
        y_m: Lower left corner of cell (0, 0) in the map frame.
    """

    data: bytes
    rows: int
    columns: int
    resolution_m: float
    x_m: float
    y_m: float

    @property
    def cells(self) -> NDArray[np.int8]:
        """The cells, read-only, shape (rows, columns)."""
        return np.frombuffer(self.data, dtype=np.int8).reshape(self.rows, self.columns)

    def cell_of(self, x_m: float, y_m: float) -> tuple[int, int]:
        """Row and column of the cell around a point of the map frame; may lie outside the grid."""
        return (
            int(np.floor((y_m - self.y_m) / self.resolution_m)),
            int(np.floor((x_m - self.x_m) / self.resolution_m)),
        )

    def cells_of(self, points_m: NDArray[np.float64]) -> NDArray[np.intp]:
        """(row, column) of points (n, 2) of the map frame, those outside the grid left out; shape (<= n, 2)."""
        columns_rows = np.floor((points_m - (self.x_m, self.y_m)) / self.resolution_m).astype(np.intp)
        inside = ((columns_rows >= 0) & (columns_rows < (self.columns, self.rows))).all(axis=1)
        return columns_rows[inside][:, ::-1]

    def holds(self, row: int, column: int) -> bool:
        """Whether the grid has this cell."""
        return 0 <= row < self.rows and 0 <= column < self.columns

    def centers_m(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> NDArray[np.float64]:
        """Centers of cells in the map frame, shape (n, 2)."""
        x_m = self.x_m + (columns + 0.5) * self.resolution_m
        y_m = self.y_m + (rows + 0.5) * self.resolution_m
        return np.stack([x_m, y_m], axis=-1)


def grid_of(message: OccupancyGrid) -> Grid:
    """The content of a grid message.

    Raises:
        ComputeFailed: BadInput, if size and data differ, cells have no size, or the grid is turned in its frame.
    """
    info = message.info
    if info.width <= 0 or info.height <= 0 or message.data.size != info.width * info.height:
        raise ComputeFailed(
            "BadInput",
            f"map: info says {info.width} x {info.height} cells, data has {message.data.size}; they must agree",
        )
    if not info.resolution > 0.0:
        raise ComputeFailed("BadInput", f"map: info.resolution is {info.resolution}; it must be above 0 m")
    if abs(yaw_of(info.origin.orientation)) > 1e-6:
        raise ComputeFailed("BadInput", "map: info.origin is turned; only grids along the axes of the map are read")
    return Grid(
        data=message.data.astype(np.int8, copy=False).tobytes(),
        rows=info.height,
        columns=info.width,
        resolution_m=float(info.resolution),
        x_m=float(info.origin.position.x),
        y_m=float(info.origin.position.y),
    )


def grid_message(grid: Grid, *, t_s: float, frame_id: str = "map") -> OccupancyGrid:
    """The grid as a message stamped `t_s`; its data is read-only."""
    return OccupancyGrid(
        header=header(frame_id, t_s),
        info=MapMetaData(
            map_load_time=stamp_of(t_s),
            resolution=grid.resolution_m,
            width=grid.columns,
            height=grid.rows,
            origin=planar_pose(grid.x_m, grid.y_m, 0.0),
        ),
        data=grid.cells.reshape(-1),
    )


@functools.lru_cache(maxsize=16)
def inflated(grid: Grid, radius_m: float) -> Grid:
    """Where the center of a round robot may be: 0, and where not: 100.

    A cell is occupied if its center is closer than `radius_m` and half a cell to the center of a cell that is
    occupied or unknown, or outside the grid: a robot in the center of a free cell touches no occupied cell's middle
    line.
    """
    free = np.pad(grid.cells == FREE, 1, constant_values=False)
    clearance_m = ndimage.distance_transform_edt(free)[1:-1, 1:-1] * grid.resolution_m
    occupied = clearance_m <= radius_m + grid.resolution_m / 2.0
    data = np.where(occupied, OCCUPIED, FREE).astype(np.int8)
    return dataclasses.replace(grid, data=data.tobytes())
