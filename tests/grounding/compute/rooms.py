"""Rooms made of boxes: their maps, and laser scans cast in them with numpy."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from grounding.compute.grids import FREE, OCCUPIED, Grid
from grounding.messages import LaserScan, PoseStamped, header, pose_stamped

Box = tuple[float, float, float, float]  # x min, y min, x max, y max, m
MOUNT = {"laser_x_m": 0.2, "laser_y_m": 0.0, "laser_yaw_rad": 0.0}
RADIUS_M = 0.35

WALLS: tuple[Box, ...] = ((-0.1, -0.1, 6.1, 0.0), (-0.1, 4.0, 6.1, 4.1), (-0.1, 0.0, 0.0, 4.0), (6.0, 0.0, 6.1, 4.0))
# Two rooms of 3 m by 4 m, a wall of 0.1 m with an opening between them, a cabinet and a table of which the legs show.
INSIDE: tuple[Box, ...] = (
    (2.95, 0.0, 3.05, 1.4),
    (2.95, 2.9, 3.05, 4.0),
    (0.0, 1.5, 0.5, 2.7),
    (4.4, 3.0, 4.5, 3.1),
    (5.3, 3.0, 5.4, 3.1),
    (4.4, 3.6, 4.5, 3.7),
    (5.3, 3.6, 5.4, 3.7),
)
ROOMS = WALLS + INSIDE
TABLETOP: Box = (4.4, 3.0, 5.4, 3.7)


def grid_with(boxes: tuple[Box, ...], *, width_m: float = 6.5, height_m: float = 4.5, margin_m: float = 0.25) -> Grid:
    """Map of boxes, 0.05 m a cell, with a margin of free cells around (0, 0)..(width - 2 margins, ...)."""
    resolution_m = 0.05
    cells = np.full((round(height_m / resolution_m), round(width_m / resolution_m)), FREE, dtype=np.int8)
    for box in boxes:
        left, bottom, right, top = (round((edge + margin_m) / resolution_m) for edge in box)
        cells[bottom:top, left:right] = OCCUPIED
    rows, columns = cells.shape
    return Grid(
        data=cells.tobytes(), rows=rows, columns=columns, resolution_m=resolution_m, x_m=-margin_m, y_m=-margin_m
    )


def ranges_m(boxes: tuple[Box, ...], x_m: float, y_m: float, angles_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance from a point to the first box in each direction (slab method); inf where there is none."""
    if not boxes:
        return np.full(len(angles_rad), math.inf)
    edges_m = np.array(boxes)
    beams = np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=-1)[:, None, :]
    beams = np.where(np.abs(beams) < 1e-12, 1e-12, beams)
    one, other = (edges_m[:, :2] - (x_m, y_m)) / beams, (edges_m[:, 2:] - (x_m, y_m)) / beams
    enter, leave = np.minimum(one, other).max(axis=-1), np.maximum(one, other).min(axis=-1)
    nearest: NDArray[np.float64] = np.where((enter <= leave) & (enter > 0.0), enter, math.inf).min(axis=1)
    return nearest


def scan_from(
    boxes: tuple[Box, ...],
    state: tuple[float, float, float],
    *,
    t_s: float = 0.0,
    noise: np.random.Generator | None = None,
    range_max_m: float = 12.0,
) -> LaserScan:
    """The scan of a robot at (x m, y m, yaw rad): 271 beams over 270 degrees, sigma 0.01 m if `noise` is given."""
    x_m, y_m, yaw_rad = state
    first_rad, step_rad = -0.75 * math.pi, math.pi / 180.0
    angles_rad = yaw_rad + first_rad + step_rad * np.arange(271, dtype=np.float64)
    mount_m = MOUNT["laser_x_m"]
    measured_m = ranges_m(boxes, x_m + mount_m * math.cos(yaw_rad), y_m + mount_m * math.sin(yaw_rad), angles_rad)
    if noise is not None:
        measured_m = measured_m + noise.normal(0.0, 0.01, len(measured_m))
    return LaserScan(
        header=header("robot/laser", t_s),
        angle_min=first_rad,
        angle_max=-first_rad,
        angle_increment=step_rad,
        time_increment=0.0,
        scan_time=0.0,
        range_min=0.05,
        range_max=range_max_m,
        ranges=np.where(measured_m <= range_max_m, measured_m, math.inf).astype(np.float32),
        intensities=np.zeros(0, dtype=np.float32),
    )


def at(x_m: float, y_m: float, yaw_rad: float = 0.0, *, t_s: float = 0.0) -> PoseStamped:
    """Pose in the map frame."""
    return pose_stamped(x_m, y_m, yaw_rad, t_s=t_s)


@dataclasses.dataclass(slots=True)
class OmniBase:
    """An omnidirectional base: acceleration limits of 1 m/s2 and 3 rad/s2, commands take effect after 25 ms.

    Attributes:
        state: x m, y m, yaw rad on the map.
        velocity: x m/s, y m/s, yaw rad/s in base_link.
        command: The velocity it is bound for.
    """

    state: NDArray[np.float64]
    velocity: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.zeros(3))
    command: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.zeros(3))

    def drive(self, command: NDArray[np.float64]) -> None:
        """One period of 1/30 s in steps of 1/120 s; three of them pass before the new command takes effect."""
        step_s = 1.0 / 120.0
        for step in range(4):
            if step == 3:
                self.command = command
            change = self.command - self.velocity
            size = float(np.hypot(change[0], change[1]))
            change[:2] *= min(1.0, 1.0 * step_s / size) if size > 0.0 else 1.0
            change[2] = np.clip(change[2], -3.0 * step_s, 3.0 * step_s)
            self.velocity = self.velocity + change
            c, s = math.cos(self.state[2]), math.sin(self.state[2])
            vx, vy, wz = self.velocity
            self.state = self.state + np.array([c * vx - s * vy, s * vx + c * vy, wz]) * step_s
