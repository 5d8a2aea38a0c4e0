"""Paths over a map that is inflated by the robot's radius.

Cells are joined to their eight neighbors (no diagonal step past the corner of an occupied cell) and searched by
Dijkstra's algorithm. A meter costs 1 in the open and up to 2 right beside an inflated obstacle, so that paths keep a
little more clearance than they must. The steps are then replaced by straight lines wherever a line costs no more and
touches free cells only.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from grounding.compute.errors import ComputeFailed
from grounding.compute.grids import FREE, Grid, grid_of
from grounding.compute.scans import moved, points_of
from grounding.messages import LaserScan, OccupancyGrid, Path, PoseStamped, header, pose_stamped, xyyaw

SHY_WITHIN_M = 0.30  # nearer than this to an inflated obstacle a meter costs more
LEAVE_WITHIN_M = 0.50  # a robot that stands in the inflation may go this far straight to a free cell
TIGHTENINGS = 3  # rounds of pulling the path straight; further ones gain less than 1 %
POINT_EVERY_M = 0.25  # at most, between corners, from which a round of pulling may start
OCCUPIED_WITHIN_M = 0.25  # what blocks a place so near to the goal stands at it
APART_M = 0.05
LOOKS_AT_M = 1.0  # ahead of a location is what a robot has to do with there
ROOMY_COST = 1.5  # of a meter, 0.15 m from an inflated obstacle
NEARER_IS_WORTH = 4.0  # meters of way for each meter nearer to that
KNOWN_WITHIN_M = 0.10  # a return this near to where the map has an obstacle is that obstacle

Point = tuple[float, float]


def path(
    *,
    map: OccupancyGrid,  # noqa: A002  (the field's name)
    start: PoseStamped,
    goal: PoseStamped,
    scan: LaserScan | None,
    radius_m: float,
    laser_x_m: float,
    laser_y_m: float,
    laser_yaw_rad: float,
    tolerance_m: float | None = None,
    t_s: float,
) -> dict[str, Path]:
    """A short path from start to goal that keeps clear of obstacles.

    What the scan shows and the map does not have is kept clear of as well, if there is a way around it; if not, the
    path is that of the map alone (what is in the way may move). A start inside the inflation is joined to the nearest
    free cell within 0.5 m by a straight line.

    Args:
        map: Inflated by the robot's radius (`nav_map`): 0 where the robot's center may be.
        start: Robot's pose in the map's frame, where the scan was taken.
        goal: Pose to reach, in the map's frame.
        scan: What the laser sees at the start, or None.
        radius_m: Radius of the robot.
        laser_x_m: Mount, base_from_laser.
        laser_y_m: Mount, base_from_laser.
        laser_yaw_rad: Mount, base_from_laser.
        tolerance_m: If somebody stands at the goal, as the scan shows, the path leads beside it, at most so far from
            it, and turned to the same point 1 m ahead of it, if there is such a place; None: it leads to the goal.
        t_s: Stamp of the path.

    Returns:
        `path`: poses in the map's frame, each a corner of the path with the yaw of the way on from it; the first is
        at the start, the last is the goal itself, position and yaw.

    Raises:
        ComputeFailed: NoPath, if the goal is occupied, outside the map or out of reach, or the start is not within
            0.5 m of a free cell; BadInput, if the frames differ, a pose is not finite or the
            tolerance is negative.
    """
    frame_id = map.header.frame_id
    for name, pose in (("start", start), ("goal", goal)):
        if pose.header.frame_id != frame_id:
            raise ComputeFailed(
                "BadInput",
                f"path: {name} is in frame {pose.header.frame_id!r}, the map in {frame_id!r}; they must agree",
            )
    if tolerance_m is not None and not 0.0 <= tolerance_m < math.inf:
        raise ComputeFailed("BadInput", f"path: tolerance_m is {tolerance_m}; it must be finite, 0 or more")
    start_x_m, start_y_m, start_yaw_rad = _finite("start", start)
    goal_x_m, goal_y_m, goal_yaw_rad = _finite("goal", goal)
    grid = grid_of(map)
    static = _roads(grid)
    corners_m: NDArray[np.float64] | None = None
    if scan is not None:
        returns_m = points_of(scan, x_m=laser_x_m, y_m=laser_y_m, yaw_rad=laser_yaw_rad)
        seen = _seen_blocked(grid, moved(returns_m, start_x_m, start_y_m, start_yaw_rad), radius_m)
        start_m, goal_m = (start_x_m, start_y_m), (goal_x_m, goal_y_m)
        if tolerance_m and (seen & _disk(grid, goal_m, OCCUPIED_WITHIN_M)).any():
            # Of who stands there the scan shows one side: it is taken to be as large as the robot itself.
            taken = _disk(grid, goal_m, 2.0 * radius_m + APART_M)
            ahead_m = goal_x_m + LOOKS_AT_M * math.cos(goal_yaw_rad), goal_y_m + LOOKS_AT_M * math.sin(goal_yaw_rad)
            beside = _disk(grid, goal_m, tolerance_m) & ~seen & ~taken
            if place := _place_beside(static, seen | taken, start_m, beside, ahead_m):
                goal_x_m, goal_y_m = place
                goal_yaw_rad = math.atan2(ahead_m[1] - goal_y_m, ahead_m[0] - goal_x_m)
                seen |= taken
        seen &= ~_disk(grid, start_m, radius_m)  # a robot beside an obstacle may leave
        if (seen & ~static.blocked).any():
            roads = _build_roads(grid, static.blocked | seen)
            [corners_m] = _corners(roads, (start_x_m, start_y_m), [(goal_x_m, goal_y_m)])
    if corners_m is None:
        [corners_m] = _corners(static, (start_x_m, start_y_m), [(goal_x_m, goal_y_m)])
    if corners_m is None:
        raise ComputeFailed("NoPath", _why_not(static, (start_x_m, start_y_m), (goal_x_m, goal_y_m)))

    steps_m = np.diff(corners_m, axis=0)
    yaws_rad = [*np.arctan2(steps_m[:, 1], steps_m[:, 0]).tolist(), goal_yaw_rad]
    poses = [
        pose_stamped(x_m, y_m, yaw_rad, t_s=t_s, frame_id=frame_id)
        for (x_m, y_m), yaw_rad in zip(corners_m.tolist(), yaws_rad, strict=True)
    ]
    return {"path": Path(header=header(frame_id, t_s), poses=poses)}


def path_lengths_m(
    grid: Grid,
    starts: list[Point],
    goals: list[Point],
) -> NDArray[np.float64]:
    """Lengths of the paths that `path` returns without a scan, one search per start.

    Args:
        grid: Inflated by the robot's radius (`nav_map`).
        starts: Positions in the map's frame, m.
        goals: Positions in the map's frame, m.

    Returns:
        Shape (len(starts), len(goals)), m; inf where there is no path.
    """
    roads = _roads(grid)
    lengths_m = np.full((len(starts), len(goals)), np.inf)
    for row, start in enumerate(starts):
        for column, corners_m in enumerate(_corners(roads, start, goals)):
            if corners_m is not None:
                lengths_m[row, column] = np.linalg.norm(np.diff(corners_m, axis=0), axis=1).sum()
    return lengths_m


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Roads:
    """Where the robot's center may be and what going there costs.

    Attributes:
        grid: The map.
        blocked: Cells it may not be in, shape (rows, columns).
        cost: Cost of a meter in each cell, shape (rows, columns).
        graph: Cost of each step between neighboring cells, shape (cells, cells), each pair once.
    """

    grid: Grid
    blocked: NDArray[np.bool_]
    cost: NDArray[np.float64]
    graph: sparse.csr_array


def _build_roads(grid: Grid, blocked: NDArray[np.bool_]) -> _Roads:
    clearance_m = ndimage.distance_transform_edt(~blocked) * grid.resolution_m if blocked.any() else np.inf
    cost = 1.0 + np.maximum(0.0, 1.0 - clearance_m / SHY_WITHIN_M) * np.ones(blocked.shape)
    number = np.arange(blocked.size, dtype=np.int32).reshape(blocked.shape)
    free = ~blocked
    sources, targets, weights = [], [], []
    for d_row, d_column in ((0, 1), (1, 0), (1, 1), (1, -1)):
        here, there = _shifted(d_row, d_column)
        open_ = free[here] & free[there]
        if d_row and d_column:
            # Both cells beside the diagonal must be free.
            open_ &= free[here[0], there[1]] & free[there[0], here[1]]
        sources.append(number[here][open_])
        targets.append(number[there][open_])
        step_m = math.hypot(d_row, d_column) * grid.resolution_m
        weights.append(step_m * 0.5 * (cost[here][open_] + cost[there][open_]))
    edges = (np.concatenate(sources), np.concatenate(targets))
    graph = sparse.coo_array((np.concatenate(weights), edges), shape=(blocked.size, blocked.size)).tocsr()
    return _Roads(grid=grid, blocked=blocked, cost=cost, graph=graph)


@functools.lru_cache(maxsize=8)
def _roads(grid: Grid) -> _Roads:
    return _build_roads(grid, grid.cells != FREE)


def _shifted(d_row: int, d_column: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Index of all cells that have a neighbor at this offset, and of these neighbors; d_row is 0 or 1."""
    rows, rows_there = (slice(None, -1), slice(1, None)) if d_row else (slice(None), slice(None))
    columns = {0: slice(None), 1: slice(None, -1), -1: slice(1, None)}[d_column]
    columns_there = {0: slice(None), 1: slice(1, None), -1: slice(None, -1)}[d_column]
    return (rows, columns), (rows_there, columns_there)


def _corners(roads: _Roads, start: Point, goals: list[Point]) -> list[NDArray[np.float64] | None]:
    """The corners of the path to each goal, shape (n >= 2, 2), m, from start to goal; None where there is no path."""
    grid = roads.grid
    first = _free_cell_near(roads, start)
    if first is None:
        return [None] * len(goals)
    [cost_to], [before] = csgraph.dijkstra(
        roads.graph, directed=False, indices=[first[0] * grid.columns + first[1]], return_predecessors=True
    )
    paths: list[NDArray[np.float64] | None] = []
    for goal in goals:
        row, column = grid.cell_of(*goal)
        last = row * grid.columns + column
        if not grid.holds(row, column) or not math.isfinite(cost_to[last]):
            paths.append(None)
            continue
        cells = [last]
        while before[cells[-1]] >= 0:
            cells.append(int(before[cells[-1]]))
        rows, columns = np.divmod(np.array(cells[::-1], dtype=np.intp), grid.columns)
        turns = np.ones(len(rows), dtype=np.bool_)
        turns[1:-1] = (np.diff(rows, 2) != 0) | (np.diff(columns, 2) != 0)
        centers_m = grid.centers_m(rows[turns], columns[turns])
        # From a start in the inflation the way to the first free cell stays as it is.
        on_roads = first == grid.cell_of(*start)
        corners_m = np.concatenate([[start], centers_m, [goal]] if on_roads else [centers_m, [goal]])
        corners_m = _straightened(roads, corners_m)
        for _ in range(TIGHTENINGS):
            corners_m = _straightened(roads, _with_points_between(corners_m))
        paths.append(corners_m if on_roads else np.concatenate([[start], corners_m]))
    return paths


def _place_beside(
    static: _Roads, taken: NDArray[np.bool_], start: Point, beside: NDArray[np.bool_], ahead: Point
) -> Point | None:
    """The best of the places beside a goal that can be reached; None if there is none.

    It is near to what is ahead of the goal, and near to the robot: so it stays the same as the robot comes closer,
    whatever else the scan shows then, though there may be one as good on the other side.
    """
    grid = static.grid
    roads = _build_roads(grid, static.blocked | taken)
    first = _free_cell_near(roads, start)
    if first is None:
        return None
    [cost_to], _ = csgraph.dijkstra(
        roads.graph, directed=False, indices=[first[0] * grid.columns + first[1]], return_predecessors=True
    )
    reached = np.isfinite(cost_to).reshape(grid.rows, grid.columns)
    roomy = roads.cost <= ROOMY_COST  # where something is nearer, a robot hardly dares to move on
    rows, columns = np.nonzero(beside & ~roads.blocked & reached & roomy)
    if not rows.size:
        return None
    centers_m = grid.centers_m(rows, columns)
    away_m = np.linalg.norm(centers_m - ahead, axis=1)
    x_m, y_m = centers_m[np.argmin(cost_to[rows * grid.columns + columns] + NEARER_IS_WORTH * away_m)].tolist()
    return x_m, y_m


def _straightened(roads: _Roads, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """The points without those that a straight line of no more cost can leave out."""
    kept = [0]
    cost_since = _line_cost(roads, points_m[0], points_m[1])  # from the last point kept to points_m[index]
    for index in range(1, len(points_m) - 1):
        step_cost = _line_cost(roads, points_m[index], points_m[index + 1])
        straight_cost = _line_cost(roads, points_m[kept[-1]], points_m[index + 1])
        if straight_cost <= (cost_since + step_cost) * (1.0 + 1e-9):
            cost_since = straight_cost
        else:
            kept.append(index)
            cost_since = step_cost
    return points_m[[*kept, len(points_m) - 1]]


def _with_points_between(corners_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same line with further points on it, shape (n, 2)."""
    pieces = [
        np.linspace(begin, end, math.ceil(math.dist(begin, end) / POINT_EVERY_M) or 1, endpoint=False)
        for begin, end in itertools.pairwise(corners_m)
    ]
    return np.concatenate([*pieces, corners_m[-1:]])


def _line_cost(roads: _Roads, from_m: NDArray[np.float64], to_m: NDArray[np.float64]) -> float:
    """Cost of a straight line, exact over the cells it crosses; inf if one of them is blocked."""
    grid = roads.grid
    origin_m = np.array([grid.x_m, grid.y_m])
    begin, end = (from_m - origin_m) / grid.resolution_m, (to_m - origin_m) / grid.resolution_m
    cuts = [np.array([0.0, 1.0])]
    for axis in (0, 1):
        low, high = sorted((begin[axis], end[axis]))
        edges = np.arange(math.ceil(low), math.floor(high) + 1)
        if high > low:
            cuts.append((edges - begin[axis]) / (end[axis] - begin[axis]))
    parts = np.sort(np.concatenate(cuts))
    lengths = np.diff(parts)
    middles = begin + np.outer((parts[:-1] + parts[1:]) / 2.0, end - begin)
    crossed = lengths > 1e-9
    columns, rows = np.floor(middles[crossed]).astype(np.intp).T
    rows, columns = np.minimum(rows, grid.rows - 1), np.minimum(columns, grid.columns - 1)  # on the edge of the map
    if roads.blocked[rows, columns].any():
        return math.inf
    return float((roads.cost[rows, columns] * lengths[crossed]).sum() * math.dist(from_m, to_m))


def _free_cell_near(roads: _Roads, point: Point) -> tuple[int, int] | None:
    """The cell of a point if it is free, else the nearest free one within 0.5 m; ties by row, then column."""
    row, column = roads.grid.cell_of(*point)
    if roads.grid.holds(row, column) and not roads.blocked[row, column]:
        return row, column
    rows, columns = np.nonzero(_disk(roads.grid, point, LEAVE_WITHIN_M) & ~roads.blocked)
    if rows.size == 0:
        return None
    nearest = np.argmin(np.linalg.norm(roads.grid.centers_m(rows, columns) - point, axis=1))
    return int(rows[nearest]), int(columns[nearest])


def _seen_blocked(grid: Grid, returns_m: NDArray[np.float64], radius_m: float) -> NDArray[np.bool_]:
    """Cells within a robot's radius of returns (n, 2) in the map's frame that the map does not explain.

    The inflated map has its obstacles a radius deep inside what is blocked; returns there are the obstacles
    themselves, and noise on them must not eat into the free cells beside them.
    """
    blocked = np.pad(grid.cells != FREE, 1, constant_values=False)
    depth_m = ndimage.distance_transform_edt(blocked)[1:-1, 1:-1] * grid.resolution_m
    cells = grid.cells_of(returns_m)
    cells = cells[depth_m[cells[:, 0], cells[:, 1]] < radius_m - KNOWN_WITHIN_M]
    free = np.ones((grid.rows, grid.columns), dtype=np.bool_)
    free[cells[:, 0], cells[:, 1]] = False
    if free.all():
        return ~free
    near: NDArray[np.bool_] = (
        ndimage.distance_transform_edt(free) * grid.resolution_m <= radius_m + grid.resolution_m / 2.0
    )
    return near


def _disk(grid: Grid, center: Point, radius_m: float) -> NDArray[np.bool_]:
    """Cells whose center is within a radius of a point, shape (rows, columns)."""
    dx_m = grid.x_m + (np.arange(grid.columns) + 0.5) * grid.resolution_m - center[0]
    dy_m = grid.y_m + (np.arange(grid.rows) + 0.5) * grid.resolution_m - center[1]
    disk: NDArray[np.bool_] = dy_m[:, None] ** 2 + dx_m[None, :] ** 2 <= radius_m**2
    return disk


def _finite(name: str, pose: PoseStamped) -> tuple[float, float, float]:
    x_m, y_m, yaw_rad = xyyaw(pose.pose)
    if not math.isfinite(x_m + y_m + yaw_rad):
        raise ComputeFailed("BadInput", f"path: {name} is ({x_m}, {y_m}, {yaw_rad}); it must be finite")
    return x_m, y_m, yaw_rad


def _why_not(roads: _Roads, start: Point, goal: Point) -> str:
    start_text, goal_text = (f"({x_m:.2f}, {y_m:.2f})" for x_m, y_m in (start, goal))
    grid = roads.grid
    row, column = grid.cell_of(*goal)
    if not grid.holds(row, column):
        reason = f"goal {goal_text} is outside the map"
    elif roads.blocked[row, column]:
        reason = f"goal {goal_text} is occupied or nearer to an obstacle than the robot's radius"
    elif _free_cell_near(roads, start) is None:
        reason = f"no free place within {LEAVE_WITHIN_M} m of start {start_text}"
    else:
        reason = "obstacles part them"
    return f"no path from {start_text} to {goal_text} m: {reason}"
