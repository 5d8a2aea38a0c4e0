"""Maps from files in the format of ROS map_server: a YAML file beside a PGM picture.

Format: http://wiki.ros.org/map_server#YAML_format, mode `trinary`. A pixel p of 0..maxval has occupancy
1 - p/maxval (p/maxval with `negate`); above `occupied_thresh` it is occupied, below `free_thresh` free, otherwise
unknown. The picture's last row is the grid's first.
"""

from __future__ import annotations

import functools
import math
import pathlib
import re
from typing import NoReturn

import numpy as np
import yaml
from numpy.typing import NDArray

from grounding.compute.errors import ComputeFailed, MapFileError
from grounding.compute.grids import FREE, OCCUPIED, UNKNOWN, Grid, grid_message, inflated
from grounding.messages import OccupancyGrid

_PGM_HEADER = re.compile(rb"(P[25])" + rb"(?:\s|#[^\n]*\n)+(\d{1,6})" * 3 + rb"\s")


def loc_map(*, map_file: pathlib.Path, t_s: float) -> dict[str, OccupancyGrid]:
    """Map to localize in.

    Args:
        map_file: The YAML file; the picture's name in it is relative to it.
        t_s: Stamp of the map.

    Returns:
        `map`: the grid in frame `map`; 0 free, 100 occupied, -1 unknown; its data is read-only.

    Raises:
        MapFileError: A file is missing or malformed.
    """
    return {"map": grid_message(read_grid(map_file), t_s=t_s)}


def nav_map(*, map_file: pathlib.Path, radius_m: float, t_s: float) -> dict[str, OccupancyGrid]:
    """Map of where the center of a round robot may be: obstacles and unknown cells grown by its radius.

    Args:
        map_file: The YAML file; the picture's name in it is relative to it.
        radius_m: Radius of the robot.
        t_s: Stamp of the map.

    Returns:
        `map`: the grid in frame `map`; 0 free, 100 not; its data is read-only.

    Raises:
        MapFileError: A file is missing or malformed.
        ComputeFailed: BadInput, if `radius_m` is negative or not a number.
    """
    if not (math.isfinite(radius_m) and radius_m >= 0.0):
        raise ComputeFailed("BadInput", f"radius_m is {radius_m}; it must be 0 m or more")
    return {"map": grid_message(inflated(read_grid(map_file), radius_m), t_s=t_s)}


def read_grid(map_file: pathlib.Path) -> Grid:
    """The grid of a map file.

    The files are read at each call; what they mean is worked out once per content.

    Raises:
        MapFileError: A file is missing or malformed.
    """
    text = _bytes_of(map_file, map_file, "file")
    image_file = map_file.parent / _image_name(map_file, text)
    return _grid(map_file, text, image_file, _bytes_of(image_file, map_file, "image"))


def image_of(map_file: pathlib.Path) -> pathlib.Path:
    """The picture of a map.

    Raises:
        MapFileError: The map file is missing or malformed.
    """
    return map_file.parent / _image_name(map_file, _bytes_of(map_file, map_file, "file"))


def _bytes_of(file: pathlib.Path, map_file: pathlib.Path, field: str) -> bytes:
    try:
        return file.read_bytes()
    except OSError as error:
        raise MapFileError(map_file, field, f"cannot read {file}: {error.strerror}") from error


@functools.lru_cache(maxsize=16)
def _image_name(map_file: pathlib.Path, text: bytes) -> str:
    image = _fields(map_file, text).get("image")
    if not isinstance(image, str) or not image:
        raise MapFileError(map_file, "image", f"is {image!r}; it must name the PGM picture")
    return image


@functools.lru_cache(maxsize=16)
def _grid(map_file: pathlib.Path, text: bytes, image_file: pathlib.Path, image: bytes) -> Grid:
    fields = _fields(map_file, text)
    resolution_m = _number(map_file, fields, "resolution")
    occupied_above = _number(map_file, fields, "occupied_thresh")
    free_below = _number(map_file, fields, "free_thresh")
    negate = _number(map_file, fields, "negate")
    mode = fields.get("mode", "trinary")
    origin = fields.get("origin")
    if not isinstance(origin, list) or len(origin) != 3:
        raise MapFileError(map_file, "origin", f"is {origin!r}; it must be [x, y, yaw] of the lower left corner")
    x_m, y_m, yaw_rad = (_as_number(map_file, "origin", value) for value in origin)
    if resolution_m <= 0.0:
        raise MapFileError(map_file, "resolution", f"is {resolution_m}; it must be above 0 (m per cell)")
    if not 0.0 <= free_below <= occupied_above <= 1.0:
        raise MapFileError(
            map_file,
            "free_thresh, occupied_thresh",
            f"are {free_below} and {occupied_above}; they must be 0 <= free_thresh <= occupied_thresh <= 1",
        )
    if negate not in (0.0, 1.0):
        raise MapFileError(map_file, "negate", f"is {negate}; it must be 0 or 1")
    if mode != "trinary":
        raise MapFileError(map_file, "mode", f"is {mode!r}; only trinary is read")
    if yaw_rad != 0.0:
        raise MapFileError(map_file, "origin", f"has yaw {yaw_rad}; only 0 is read")

    brightness = _pgm(image_file, image)[::-1]
    occupancy = brightness if negate else 1.0 - brightness
    rows, columns = occupancy.shape
    cells = np.full((rows, columns), UNKNOWN, dtype=np.int8)
    cells[occupancy < free_below] = FREE
    cells[occupancy > occupied_above] = OCCUPIED
    return Grid(
        data=cells.tobytes(),
        rows=rows,
        columns=columns,
        resolution_m=resolution_m,
        x_m=x_m,
        y_m=y_m,
    )


def _fields(map_file: pathlib.Path, text: bytes) -> dict[object, object]:
    try:
        fields = yaml.safe_load(text)
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise MapFileError(map_file, "file", f"is not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(fields, dict):
        raise MapFileError(map_file, "file", "has no fields; expected image, resolution, origin and thresholds")
    return fields


def _number(map_file: pathlib.Path, fields: dict[object, object], name: str) -> float:
    if name not in fields:
        raise MapFileError(map_file, name, "is missing")
    return _as_number(map_file, name, fields[name])


def _as_number(map_file: pathlib.Path, name: str, value: object) -> float:
    # 5e-2 is a number for map_server's YAML reader and text for ours, hence float() of text as well.
    if isinstance(value, int | float | str):
        try:
            number = float(value)
        except (ValueError, OverflowError):
            number = math.nan
        if math.isfinite(number):
            return number
    raise MapFileError(map_file, name, f"is {value!r}; it must be a number")


def _pgm(file: pathlib.Path, image: bytes) -> NDArray[np.float64]:
    """Brightness 0..1 of a PGM picture, shape (height, width), top row first."""

    def refuse(part: str, problem: str) -> NoReturn:
        raise MapFileError(file, part, problem)

    match = _PGM_HEADER.match(image)
    if match is None:
        refuse("header", "is not that of a PGM picture (P2 or P5, width, height, greatest value)")
    width, height, greatest = (int(match[group]) for group in (2, 3, 4))
    if width == 0 or height == 0 or not 0 < greatest < 256:
        refuse("header", f"says {width} x {height} pixels of 0..{greatest}; expected some pixels of at most 0..255")
    raster = image[match.end() :]
    if match[1] == b"P5":
        pixels = np.frombuffer(raster[: width * height], dtype=np.uint8)
    else:
        try:
            pixels = np.array([int(word) for word in re.sub(rb"#[^\n]*", b"", raster).split()], dtype=np.uint8)
        except (ValueError, OverflowError):
            refuse("pixels", f"must be whole numbers of 0..{greatest}")
    if pixels.size != width * height:
        refuse("pixels", f"{pixels.size} found, {width} x {height} = {width * height} expected")
    if pixels.max() > greatest:
        refuse("pixels", f"one is {pixels.max()}, above the greatest value {greatest} the header tells")
    return pixels.reshape(height, width) / float(greatest)
