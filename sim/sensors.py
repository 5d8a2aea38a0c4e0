"""The sensors: a laser scanner and a camera of color and depth, computed when asked."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from grounding.messages import CameraInfo, Header, Image, LaserScan, RegionOfInterest, header
from sim.physics import Floats, Mount, Physics
from sim.robot import Base, Pose2

# The laser scanner: one beam a degree over three quarters of the circle.
BEAMS = 271
ANGLE_MIN_RAD = math.radians(-135.0)
ANGLE_STEP_RAD = math.radians(1.0)
RANGE_MIN_M = 0.05
RANGE_MAX_M = 12.0
RANGE_SIGMA_M = 0.01
# Beams start this far within the own surface, so that a wall that the body is pressed against is still ahead of them;
# the engine does not report a convex shape that a ray starts in.
_WITHIN_SKIN_M = 0.02

# The camera.
WIDTH = 320
HEIGHT = 240
FOV_X_RAD = 1.02
NEAR_M = 0.1
FAR_M = 12.0


class Laser:
    """A laser scanner that looks through its own robot, but not through others.

    Args:
        physics: The world that it scans.
        base: The base that carries it.
        mount: Where it sits on the base, level.
        footprint_radius_m: Radius of the own body, around the origin of base_link; the mount is within.
        frame_id: Frame of the scans.
        chance: Source of the noise.
    """

    def __init__(
        self,
        physics: Physics,
        base: Base,
        mount: Mount,
        footprint_radius_m: float,
        frame_id: str,
        chance: np.random.Generator,
    ) -> None:
        self._physics = physics
        self._base = base
        self._frame_id = frame_id
        self._chance = chance
        angles = ANGLE_MIN_RAD + ANGLE_STEP_RAD * np.arange(BEAMS)
        directions = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(BEAMS))) @ mount.rotation.T
        # A beam from m in direction d leaves the circle of radius r at t = -m.d + sqrt((m.d)^2 + r^2 - m.m).
        along = directions[:, :2] @ mount.position[:2]
        inside = footprint_radius_m**2 - float(mount.position[:2] @ mount.position[:2])
        self._skip_m = -along + np.sqrt(along**2 + inside) - _WITHIN_SKIN_M  # (BEAMS,) length within the own body
        self._starts = mount.position + directions * self._skip_m[:, None]  # (BEAMS, 3) in base_link
        self._ends = mount.position + directions * RANGE_MAX_M

    def scan(self, t_s: float) -> LaserScan:
        """A scan of what is there now, stamped `t_s`; beams that hit nothing within range are +inf."""
        pose = self._base.pose
        fractions = self._physics.cast(_to_map(pose, self._starts), _to_map(pose, self._ends))
        noise = self._chance.normal(0.0, RANGE_SIGMA_M, BEAMS)
        ranges = self._skip_m + fractions * (RANGE_MAX_M - self._skip_m) + noise
        ranges[ranges > RANGE_MAX_M] = math.inf
        return LaserScan(
            header=header(self._frame_id, t_s),
            angle_min=ANGLE_MIN_RAD,
            angle_max=ANGLE_MIN_RAD + ANGLE_STEP_RAD * (BEAMS - 1),
            angle_increment=ANGLE_STEP_RAD,
            time_increment=0.0,
            scan_time=0.0,
            range_min=RANGE_MIN_M,
            range_max=RANGE_MAX_M,
            ranges=ranges.astype(np.float32),
            intensities=np.zeros(0, dtype=np.float32),
        )


class Camera:
    """A camera of color and depth; both images have the same geometry.

    Args:
        physics: The world that it sees.
        base: The base that carries it.
        mount: Where it sits on the base; an optical frame (z forward, x right, y down).
        frame_id: Frame of the images.
        chance: Source of the noise in depth.
    """

    def __init__(self, physics: Physics, base: Base, mount: Mount, frame_id: str, chance: np.random.Generator) -> None:
        self._physics = physics
        self._base = base
        self._mount = mount
        self._frame_id = frame_id
        self._chance = chance

    def take(self, t_s: float) -> tuple[Image, Image, CameraInfo]:
        """Color image, depth image and calibration, all stamped `t_s`."""
        pose = self._base.pose
        axes = _rotation(pose[2]) @ self._mount.rotation  # columns: right, down, forward in map
        eye = _to_map(pose, self._mount.position)
        colors, depths = self._physics.render(
            eye,
            forward=axes[:, 2],
            up=-axes[:, 1],
            width=WIDTH,
            height=HEIGHT,
            fov_y_rad=2.0 * math.atan(math.tan(FOV_X_RAD / 2.0) * HEIGHT / WIDTH),
            near_m=NEAR_M,
            far_m=FAR_M,
        )
        # Axial noise of a structured-light camera: Nguyen, Izadi, Lovell, "Modeling Kinect Sensor Noise", 2012.
        noise = self._chance.standard_normal(depths.shape)
        seen = np.isfinite(depths)
        depths[seen] += (0.0012 + 0.0019 * (depths[seen] - 0.4) ** 2) * noise[seen]
        stamp = header(self._frame_id, t_s)
        return _image(stamp, "rgb8", colors), _image(stamp, "32FC1", depths.astype("<f4")), _calibration(stamp)


def _image(stamp: Header, encoding: str, pixels: NDArray[np.uint8] | NDArray[np.float32]) -> Image:
    """Image message of pixels (height, width) or (height, width, 3)."""
    raw = np.ascontiguousarray(pixels).view(np.uint8).reshape(-1)
    return Image(
        header=stamp,
        height=pixels.shape[0],
        width=pixels.shape[1],
        encoding=encoding,
        is_bigendian=0,
        step=raw.size // pixels.shape[0],
        data=raw,
    )


def _calibration(stamp: Header) -> CameraInfo:
    """Pinhole camera without distortion; the principal point is where the renderer has it (`Physics.render`)."""
    focal = WIDTH / 2.0 / math.tan(FOV_X_RAD / 2.0)
    center_x, center_y = WIDTH / 2.0, HEIGHT / 2.0 - 1.0
    return CameraInfo(
        header=stamp,
        height=HEIGHT,
        width=WIDTH,
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=np.array([focal, 0.0, center_x, 0.0, focal, center_y, 0.0, 0.0, 1.0]),
        r=np.eye(3).reshape(9),
        p=np.array([focal, 0.0, center_x, 0.0, 0.0, focal, center_y, 0.0, 0.0, 0.0, 1.0, 0.0]),
        binning_x=0,
        binning_y=0,
        roi=RegionOfInterest(x_offset=0, y_offset=0, height=0, width=0, do_rectify=False),
    )


def _rotation(yaw_rad: float) -> Floats:
    """Rotation (3, 3) about z."""
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _to_map(pose: Pose2, points: Floats) -> Floats:
    """Points (..., 3) of base_link in map."""
    moved: Floats = points @ _rotation(pose[2]).T + np.array([pose[0], pose[1], 0.0])
    return moved
