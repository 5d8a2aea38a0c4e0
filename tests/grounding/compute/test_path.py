from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from grounding.compute.errors import ComputeFailed
from grounding.compute.grids import FREE, OCCUPIED, Grid, grid_message, grid_of, inflated
from grounding.compute.path import path, path_lengths_m
from grounding.messages import LaserScan, OccupancyGrid, Path, PoseStamped, pose_stamped, stamp_s, xyyaw
from tests.grounding.compute.rooms import MOUNT, RADIUS_M, ROOMS, TABLETOP, WALLS, Box, at, grid_with, scan_from

MAP_GRID = inflated(grid_with((*ROOMS, TABLETOP)), RADIUS_M)
MAP = grid_message(MAP_GRID, t_s=0.0)
HALL = grid_message(inflated(grid_with(WALLS), RADIUS_M), t_s=0.0)
ANYWHERE = st.tuples(st.floats(-0.3, 6.3), st.floats(-0.3, 4.3))
# A point in a free cell: the cell, and where in it.
OCCUPIED_GOAL = (4.0, 2.0, 0.5)
SOMEBODY: Box = (3.75, 1.75, 4.25, 2.25)
IN_FREE = st.builds(
    lambda cell, dx_m, dy_m: (cell[0] + dx_m, cell[1] + dy_m),
    st.sampled_from(MAP_GRID.centers_m(*np.nonzero(MAP_GRID.cells == FREE)).tolist()),
    st.floats(-0.024, 0.024),
    st.floats(-0.024, 0.024),
)


def found(start: PoseStamped, goal: PoseStamped, *, grid: OccupancyGrid = MAP, scan: LaserScan | None = None) -> Path:
    """The path of a robot of radius 0.35 m."""
    return path(map=grid, start=start, goal=goal, scan=scan, radius_m=RADIUS_M, t_s=3.0, **MOUNT)["path"]


def beside(scan: LaserScan, *, tolerance_m: float | None) -> tuple[float, float, float]:
    """Where the path ends that leads to (4.0, 2.0, 0.5) from (1.0, 2.0), past whom the scan shows there."""
    start, goal = at(3.0, 2.0, 0.0), at(*OCCUPIED_GOAL)
    way = path(
        map=HALL, start=start, goal=goal, scan=scan, radius_m=RADIUS_M, tolerance_m=tolerance_m, t_s=3.0, **MOUNT
    )["path"]
    return xyyaw(way.poses[-1].pose)


def corners_of(way: Path) -> NDArray[np.float64]:
    """Corners, shape (n, 2), m."""
    return np.array([xyyaw(pose.pose)[:2] for pose in way.poses])


def length_m(way: Path) -> float:
    """Length along the corners."""
    return float(np.linalg.norm(np.diff(corners_of(way), axis=0), axis=1).sum())


def points_on(corners_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points every 2 mm or less along the corners."""
    pieces = [
        np.linspace(begin, end, max(2, round(math.dist(begin, end) / 0.002)))
        for begin, end in itertools.pairwise(corners_m)
    ]
    return np.concatenate(pieces)


def clearance_m(corners_m: NDArray[np.float64], box: Box) -> float:
    """Least distance of the path to a box."""
    points_m = points_on(corners_m)
    outside_m = np.maximum(np.maximum(box[:2] - points_m, points_m - box[2:]), 0.0)
    return float(np.hypot(outside_m[:, 0], outside_m[:, 1]).min())


def free(grid: Grid, x_m: float, y_m: float) -> bool:
    """Whether the robot's center may be there."""
    return bool(grid.cells[grid.cell_of(x_m, y_m)] == FREE)


@settings(deadline=None, max_examples=40, derandomize=True)
@given(start=IN_FREE, goal=IN_FREE)
def test_a_path_stays_in_free_cells(start: tuple[float, float], goal: tuple[float, float]) -> None:
    """From free start to free goal no point of the path is in an inflated cell, and its ends are exact."""
    corners_m = corners_of(found(at(*start), at(*goal)))
    assert corners_m[0] == pytest.approx(start)
    assert corners_m[-1] == pytest.approx(goal)
    points_m = points_on(corners_m)
    # A line through the very corner of a cell may round to either side: look at points well inside cells only.
    in_cell = (points_m - (MAP_GRID.x_m, MAP_GRID.y_m)) / MAP_GRID.resolution_m % 1.0
    rows, columns = MAP_GRID.cells_of(points_m[((in_cell > 1e-6) & (in_cell < 1.0 - 1e-6)).all(axis=1)]).T
    assert (MAP_GRID.cells[rows, columns] == FREE).all()


@settings(deadline=None, max_examples=15, derandomize=True)
@given(points=st.lists(IN_FREE | ANYWHERE, min_size=2, max_size=4))
def test_lengths_are_those_of_the_paths(points: list[tuple[float, float]]) -> None:
    """`path_lengths_m` tells the length of what `path` returns, inf where there is none, and hardly minds direction."""
    lengths_m = path_lengths_m(grid_of(MAP), points[:2], points)
    for row, start in enumerate(points[:2]):
        for column, goal in enumerate(points):
            try:
                assert lengths_m[row, column] == pytest.approx(length_m(found(at(*start), at(*goal))), rel=1e-9)
            except ComputeFailed:
                assert lengths_m[row, column] == math.inf
            assert lengths_m[row, column] >= math.dist(start, goal) - 1e-9
    both = [point for point in points[:2] if free(MAP_GRID, *point)]
    there_and_back_m = path_lengths_m(grid_of(MAP), both, both)
    assert there_and_back_m == pytest.approx(there_and_back_m.T, rel=0.05, abs=0.05)


def test_in_the_open_a_path_is_one_straight_line() -> None:
    """Nothing between start and goal: two poses, the first looks along the line, the last is the goal."""
    way = found(at(1.0, 1.2), at(5.0, 2.7, -2.0), grid=HALL)
    assert [xyyaw(pose.pose) for pose in way.poses] == [
        pytest.approx((1.0, 1.2, math.atan2(1.5, 4.0))),
        pytest.approx((5.0, 2.7, -2.0)),
    ]
    assert (way.header.frame_id, stamp_s(way.header.stamp)) == ("map", 3.0)
    assert {pose.header.frame_id for pose in way.poses} == {"map"}


def test_a_path_keeps_more_clearance_than_it_must() -> None:
    """Around the end of the wall the path stays 0.1 m farther off than the radius, and near the shortest way."""
    way = found(at(2.2, 0.6), at(3.9, 0.6))
    assert clearance_m(corners_of(way), (2.95, 0.0, 3.05, 1.4)) >= RADIUS_M + 0.1
    assert length_m(way) <= 1.3 * (math.hypot(0.75, 0.8 + RADIUS_M) + 0.1 + math.hypot(0.85, 0.8 + RADIUS_M))


def test_start_and_goal_in_one_place() -> None:
    """A path to where the robot is has no length and ends in the goal's yaw."""
    way = found(at(1.0, 1.0, 0.5), at(1.0, 1.0, 2.0))
    assert length_m(way) == 0.0
    assert xyyaw(way.poses[-1].pose)[2] == pytest.approx(2.0)


def test_a_robot_that_stands_in_the_inflation_leaves_it() -> None:
    """It goes straight to the nearest free cell, and in free cells from there."""
    corners_m = corners_of(found(at(0.25, 1.0), at(2.0, 1.0)))
    assert corners_m[0] == pytest.approx((0.25, 1.0))
    assert math.dist(corners_m[0], corners_m[1]) <= 0.5
    assert all(free(MAP_GRID, *point) for point in corners_m[1:])


def test_what_the_scan_shows_is_gone_around() -> None:
    """A person whom the map does not have is passed at more than the robot's radius."""
    person = (2.8, 1.8, 3.2, 2.2)
    start = (1.0, 2.0, 0.0)
    scan = scan_from((*WALLS, person), start, noise=np.random.default_rng(0))
    straight = found(at(*start), at(5.0, 2.0), grid=HALL)
    around = found(at(*start), at(5.0, 2.0), grid=HALL, scan=scan)
    seen_side = (2.8, 1.8, 2.85, 2.2)
    assert clearance_m(corners_of(straight), seen_side) == 0.0
    assert clearance_m(corners_of(around), seen_side) > RADIUS_M


def test_the_scan_of_what_the_map_has_changes_nothing() -> None:
    """Noise on the returns of the walls does not cost free cells."""
    start = (1.2, 1.0, 0.4)
    scan = scan_from(ROOMS, start, noise=np.random.default_rng(0))
    plain, with_scan = found(at(*start), at(5.0, 1.0)), found(at(*start), at(5.0, 1.0), scan=scan)
    assert corners_of(with_scan) == pytest.approx(corners_of(plain))


def test_if_the_scan_closes_all_ways_the_map_decides() -> None:
    """A crowd in the opening may go away: the path leads through it rather than nowhere."""
    start = (1.2, 2.1, 0.0)
    scan = scan_from((*ROOMS, (2.9, 1.4, 3.0, 2.9)), start)
    assert corners_of(found(at(*start), at(5.0, 2.0), scan=scan)) == pytest.approx(
        corners_of(found(at(*start), at(5.0, 2.0)))
    )


def test_a_robot_beside_something_unknown_can_leave() -> None:
    """Returns right beside the robot do not shut it in."""
    start = (1.5, 2.0, 0.0)
    box = (1.9, 1.6, 2.0, 2.4)
    way = found(at(*start), at(5.0, 2.0), grid=HALL, scan=scan_from((*WALLS, box), start))
    assert clearance_m(corners_of(way)[1:], box) >= RADIUS_M - 0.05


@pytest.mark.parametrize(
    ("start", "goal", "reason"),
    [
        ((1.0, 1.0), (4.9, 3.4), "goal (4.90, 3.40) is occupied"),
        ((1.0, 1.0), (9.0, 1.0), "outside the map"),
        ((-9.0, 1.0), (1.0, 1.0), "start (-9.00, 1.00)"),
    ],
)
def test_no_path_tells_why(start: tuple[float, float], goal: tuple[float, float], reason: str) -> None:
    """Occupied goals and starts or goals off the map are NoPath with the reason."""
    with pytest.raises(ComputeFailed) as caught:
        found(at(*start), at(*goal))
    assert caught.value.code == "NoPath"
    assert reason in caught.value.message


def test_what_is_right_beside_does_not_turn_the_way() -> None:
    """A robot that all but touches something beside it drives on ahead, not first away from it."""
    start = (2.0, 2.0, 0.0)
    post = (1.95, 2.36, 2.05, 2.46)
    way = found(at(*start), at(4.0, 2.0), grid=HALL, scan=scan_from((*WALLS, post), start))
    assert abs(xyyaw(way.poses[0].pose)[2]) < 0.8


def test_no_path_slips_between_touching_corners() -> None:
    """A diagonal row of occupied cells that touch at their corners is closed."""
    cells = np.full((20, 20), FREE, dtype=np.int8)
    np.fill_diagonal(cells, OCCUPIED)
    grid = Grid(data=cells.tobytes(), rows=20, columns=20, resolution_m=0.05, x_m=0.0, y_m=0.0)
    assert path_lengths_m(grid, [(0.8, 0.2)], [(0.2, 0.8)]).tolist() == [[math.inf]]


def test_parted_rooms_have_no_path() -> None:
    """A wall without an opening: NoPath names both ends, and the length is inf."""
    grid = grid_message(inflated(grid_with((*WALLS, (2.95, 0.0, 3.05, 4.0))), RADIUS_M), t_s=0.0)
    with pytest.raises(ComputeFailed, match=r"NoPath.*\(1\.00, 1\.00\) to \(5\.00, 1\.00\).*obstacles part them"):
        found(at(1.0, 1.0), at(5.0, 1.0), grid=grid)
    assert path_lengths_m(grid_of(grid), [(1.0, 1.0)], [(5.0, 1.0), (1.0, 2.0)]).tolist() == [[math.inf, 1.0]]


def test_bad_requests_are_refused() -> None:
    """Poses in another frame and poses that are not numbers are BadInput."""
    for goal in (pose_stamped(1.0, 1.0, 0.0, t_s=0.0, frame_id="odom"), at(math.nan, 1.0), at(1.0, math.inf)):
        with pytest.raises(ComputeFailed, match="BadInput"):
            found(at(1.0, 1.0), goal)


def test_where_somebody_stands_at_the_goal_the_path_leads_beside_it() -> None:
    """Not nearer than two robots may be, and turned to what is 1 m ahead of the goal."""
    scan = scan_from((*WALLS, SOMEBODY), (3.0, 2.0, 0.0))
    x_m, y_m, yaw_rad = beside(scan, tolerance_m=1.0)
    goal_x_m, goal_y_m, goal_yaw_rad = OCCUPIED_GOAL
    assert 2.0 * RADIUS_M <= math.dist((x_m, y_m), (goal_x_m, goal_y_m)) <= 1.0
    ahead_m = goal_x_m + math.cos(goal_yaw_rad), goal_y_m + math.sin(goal_yaw_rad)
    assert yaw_rad == pytest.approx(math.atan2(ahead_m[1] - y_m, ahead_m[0] - x_m))


@pytest.mark.parametrize("tolerance_m", [-1.0, math.nan, math.inf])
def test_a_tolerance_that_is_none_is_refused(tolerance_m: float) -> None:
    """With what would be right."""
    with pytest.raises(ComputeFailed, match="it must be finite, 0 or more"):
        beside(scan_from(WALLS, (3.0, 2.0, 0.0)), tolerance_m=tolerance_m)


@pytest.mark.parametrize(("boxes", "tolerance_m"), [(SOMEBODY, None), (SOMEBODY, 0.0), (SOMEBODY, 0.3), (None, 1.0)])
def test_else_it_leads_to_the_goal(boxes: Box | None, tolerance_m: float | None) -> None:
    """Nobody stands there, or there is no place so near, or the robot has to be there: what is in the way may move."""
    scan = scan_from((*WALLS, boxes) if boxes else WALLS, (3.0, 2.0, 0.0))
    assert beside(scan, tolerance_m=tolerance_m) == pytest.approx(OCCUPIED_GOAL)
