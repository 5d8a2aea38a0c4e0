"""Finding a drink of a known color in a color and depth picture."""

from __future__ import annotations

import dataclasses
import functools
import math
import pathlib

import numpy as np
import yaml
from numpy.typing import NDArray
from scipy import ndimage

from grounding.compute.errors import ComputeFailed
from grounding.messages import CameraInfo, Image, Point, PointStamped, PoseStamped, header, stamp_s, xyyaw

PIXELS_AT_LEAST = 6
# A blob must look as wide and as high as the object may, in radii; partly hidden or touching ones vary.
WIDTH_RADII = (1.0, 4.0)
HEIGHT_RADII = (1.0, 9.0)


def detection(
    *,
    color: Image,
    depth: Image,
    camera_info: CameraInfo,
    pose: PoseStamped,
    hue_file: pathlib.Path,
    object_class: str,
    camera_x_m: float,
    camera_z_m: float,
    camera_pitch_rad: float,
    t_s: float,
) -> dict[str, PointStamped]:
    """Look for an object of a class in a picture.

    The pixels of the class's color that hang together and are as large as the object may be at their depth are the
    object; of several, the one with the most pixels.

    Args:
        color: rgb8.
        depth: 32FC1, m along the optical axis (REP 118), pixel by pixel as `color`; not finite or 0 where unknown.
        camera_info: `k` is used, lens distortion is not.
        pose: map_from_base when the picture was taken.
        hue_file: Colors and sizes of object classes (HUE.yaml).
        object_class: One of the classes in `hue_file`.
        camera_x_m: Mount, base_from_camera, forward.
        camera_z_m: Mount, base_from_camera, up.
        camera_pitch_rad: How far the optical axis points below the horizontal.
        t_s: Time of the call; the position bears the stamp of `color`.

    Returns:
        `position`: its middle in the frame of `pose`, at the stamp of `color`.

    Raises:
        ComputeFailed: ObjectNotFound, if there is none in the picture; BadInput, if an encoding or size is not as
            told above, or the file or class is not usable.
    """
    look = _look(hue_file, object_class)
    rgb = _pixels(color, "color", "rgb8", np.dtype(np.uint8), 3)
    depth_m = _pixels(depth, "depth", "32FC1", np.dtype(">f4" if depth.is_bigendian else "<f4"), 1)[..., 0].astype(
        np.float64
    )
    if rgb.shape[:2] != depth_m.shape:
        raise ComputeFailed("BadInput", f"detection: color is {rgb.shape[:2]}, depth {depth_m.shape}; they must agree")
    fx, fy, cx, cy = (float(camera_info.k[index]) for index in (0, 4, 2, 5))
    if not (fx > 0.0 and fy > 0.0):
        raise ComputeFailed("BadInput", f"detection: camera_info.k has focal lengths {fx}, {fy}; they must be above 0")

    x_m, y_m, yaw_rad = xyyaw(pose.pose)
    blob = _largest_blob(_colored(rgb, look) & np.isfinite(depth_m) & (depth_m > 0.0), depth_m, look, fx, fy)
    if blob is None:
        raise ComputeFailed(
            "ObjectNotFound",
            f"no {object_class} in the picture taken at ({x_m:.2f}, {y_m:.2f}), heading {yaw_rad:.2f} rad",
        )
    row, column, blob_depth_m = blob
    ray = np.array([(column - cx) / fx, (row - cy) / fy, 1.0])
    in_camera_m = ray * blob_depth_m + ray / np.linalg.norm(ray) * look.radius_m

    c, s = math.cos(camera_pitch_rad), math.sin(camera_pitch_rad)
    # Columns: the camera's x (right), y (down) and z (forward) in base_link.
    base_from_camera = np.array([[0.0, -s, c], [-1.0, 0.0, 0.0], [0.0, -c, -s]])
    in_base_m = base_from_camera @ in_camera_m + (camera_x_m, 0.0, camera_z_m)
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    position = Point(
        x=float(x_m + c * in_base_m[0] - s * in_base_m[1]),
        y=float(y_m + s * in_base_m[0] + c * in_base_m[1]),
        z=float(pose.pose.position.z + in_base_m[2]),
    )
    stamped = PointStamped(header=header(pose.header.frame_id, stamp_s(color.header.stamp)), point=position)
    return {"position": stamped}


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class _Look:
    """What a class of objects looks like; hues from `low` up to `high`, through 0 if `low` is above `high`."""

    hue_low_deg: float
    hue_high_deg: float
    saturation_min: float
    value_min: float
    radius_m: float


def _look(hue_file: pathlib.Path, object_class: str) -> _Look:
    try:
        text = hue_file.read_bytes()
    except OSError as error:
        raise ComputeFailed("BadInput", f"hue file {hue_file}: cannot be read: {error.strerror}") from error
    looks = _looks(hue_file, text)
    if object_class not in looks:
        raise ComputeFailed(
            "BadInput", f"hue file {hue_file}: no class {object_class!r}; it knows {', '.join(sorted(looks))}"
        )
    return looks[object_class]


@functools.lru_cache(maxsize=4)
def _looks(hue_file: pathlib.Path, text: bytes) -> dict[str, _Look]:
    try:
        classes = yaml.safe_load(text)
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ComputeFailed("BadInput", f"hue file {hue_file}: not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(classes, dict):
        raise ComputeFailed("BadInput", f"hue file {hue_file}: expected object classes, each with its fields")
    looks = {}
    for name, fields in classes.items():
        try:
            low, high = fields["hue_deg"]
            look = _Look(
                hue_low_deg=float(low),
                hue_high_deg=float(high),
                saturation_min=float(fields["saturation_min"]),
                value_min=float(fields["value_min"]),
                radius_m=float(fields["radius_m"]),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise ComputeFailed(
                "BadInput",
                f"hue file {hue_file}, {name}: {error!r}; "
                "expected hue_deg: [low, high] and the numbers saturation_min, value_min, radius_m",
            ) from error
        _check(hue_file, str(name), look)
        looks[str(name)] = look
    return looks


def _check(hue_file: pathlib.Path, name: str, look: _Look) -> None:
    for field, value, greatest in (
        ("hue_deg", look.hue_low_deg, 360.0),
        ("hue_deg", look.hue_high_deg, 360.0),
        ("saturation_min", look.saturation_min, 1.0),
        ("value_min", look.value_min, 1.0),
        ("radius_m", look.radius_m, 1.0),
    ):
        if not 0.0 <= value <= greatest:
            raise ComputeFailed(
                "BadInput", f"hue file {hue_file}, {name}, {field}: {value}; it must be in 0..{greatest:g}"
            )


def _pixels(image: Image, name: str, encoding: str, dtype: np.dtype[np.generic], channels: int) -> NDArray[np.generic]:
    """The pixels of an image, shape (height, width, channels), without the padding of its rows."""
    if image.encoding != encoding:
        raise ComputeFailed("BadInput", f"detection: {name} has encoding {image.encoding!r}; it must be {encoding!r}")
    row_bytes = image.width * channels * dtype.itemsize
    if image.step < row_bytes or image.data.size != image.step * image.height or image.data.size == 0:
        raise ComputeFailed(
            "BadInput",
            f"detection: {name} of {image.width} x {image.height} pixels, step {image.step}, has {image.data.size} "
            f"bytes; expected height * step of them, step at least {row_bytes}",
        )
    rows = image.data.astype(np.uint8, copy=False).reshape(image.height, image.step)[:, :row_bytes]
    return np.ascontiguousarray(rows).view(dtype).reshape(image.height, image.width, channels)


def _colored(rgb: NDArray[np.generic], look: _Look) -> NDArray[np.bool_]:
    """Pixels (height, width, 3) of the look's hue, saturation and value (HSV, hue in degrees, the others 0..1)."""
    channels = rgb.astype(np.float32)
    red, green, blue = channels[..., 0], channels[..., 1], channels[..., 2]
    greatest = channels.max(axis=-1)
    spread = greatest - channels.min(axis=-1)
    safe = np.maximum(spread, 1.0)
    sector = np.where(
        greatest == red,
        (green - blue) / safe,
        np.where(greatest == green, 2.0 + (blue - red) / safe, 4.0 + (red - green) / safe),
    )
    hue_deg = sector * 60.0 % 360.0
    vivid = (spread > 0) & (spread >= look.saturation_min * greatest) & (greatest >= look.value_min * 255.0)
    above, below = hue_deg >= look.hue_low_deg, hue_deg <= look.hue_high_deg
    of_hue = above & below if look.hue_low_deg <= look.hue_high_deg else above | below
    colored: NDArray[np.bool_] = vivid & of_hue
    return colored


def _largest_blob(
    mask: NDArray[np.bool_], depth_m: NDArray[np.float64], look: _Look, fx: float, fy: float
) -> tuple[float, float, float] | None:
    """Centroid (row, column, in pixels) and median depth (m) of the largest blob of a plausible size, if any."""
    labels, count = ndimage.label(mask, structure=np.ones((3, 3)))
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    for blob in sorted(range(1, count + 1), key=lambda label: -sizes[label]):
        if sizes[blob] < PIXELS_AT_LEAST:
            return None
        rows, columns = np.nonzero(labels == blob)
        blob_depth_m = float(np.median(depth_m[rows, columns]))
        width_m = (np.ptp(columns) + 1) * blob_depth_m / fx
        height_m = (np.ptp(rows) + 1) * blob_depth_m / fy
        if (
            WIDTH_RADII[0] * look.radius_m <= width_m <= WIDTH_RADII[1] * look.radius_m
            and HEIGHT_RADII[0] * look.radius_m <= height_m <= HEIGHT_RADII[1] * look.radius_m
        ):
            return float(rows.mean()), float(columns.mean()), blob_depth_m
    return None
