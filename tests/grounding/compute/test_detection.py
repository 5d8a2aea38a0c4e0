from __future__ import annotations

import dataclasses
import math
import pathlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from grounding.compute.detection import detection
from grounding.compute.errors import ComputeFailed
from grounding.messages import CameraInfo, Image, PointStamped, RegionOfInterest, header, stamp_s
from tests.grounding.compute.rooms import at

HUE_FILE = pathlib.Path(__file__).parents[3] / "kb" / "ontologies" / "sites" / "tue_lab" / "HUE.yaml"
WIDTH, HEIGHT = 320, 240
FOCAL_PX = 160.0 / math.tan(0.51)
CAMERA_X_M, CAMERA_Z_M, PITCH_RAD = 0.15, 1.20, 0.45
ROBOT = (2.0, 3.0, 0.7)
GREEN, RED, GRAY, BROWN = (30, 160, 40), (200, 25, 30), (120, 120, 125), (110, 90, 70)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Drink:
    """A colored upright cylinder in the frame of the robot, m."""

    x_m: float
    y_m: float
    bottom_m: float = 0.75
    radius_m: float = 0.04
    height_m: float = 0.20
    color: tuple[int, int, int] = GREEN


def picture(*drinks: Drink) -> tuple[Image, Image, CameraInfo]:
    """Color and depth of cylinders before a gray wall 4 m ahead of the robot, by ray casting."""
    column, row = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    right, down = (column - 159.5) / FOCAL_PX, (row - 119.5) / FOCAL_PX
    c, s = math.cos(PITCH_RAD), math.sin(PITCH_RAD)
    # Rays in base_link of which one unit is 1 m of depth along the optical axis.
    ray = np.stack([c - s * down, -right, -s - c * down], axis=-1)
    depth_m = (4.0 - CAMERA_X_M) / ray[..., 0]
    rgb = np.full((HEIGHT, WIDTH, 3), GRAY, dtype=np.uint8)
    rgb[row > 200] = BROWN
    for drink in drinks:
        dx_m, dy_m = CAMERA_X_M - drink.x_m, -drink.y_m
        a = ray[..., 0] ** 2 + ray[..., 1] ** 2
        b = dx_m * ray[..., 0] + dy_m * ray[..., 1]
        root = b**2 - a * (dx_m**2 + dy_m**2 - drink.radius_m**2)
        hit_m = (-b - np.sqrt(np.maximum(root, 0.0))) / a
        z_m = CAMERA_Z_M + hit_m * ray[..., 2] - drink.bottom_m
        hit = (root > 0.0) & (z_m >= 0.0) & (z_m <= drink.height_m) & (hit_m < depth_m)
        depth_m = np.where(hit, hit_m, depth_m)
        shade = 0.6 + 0.4 * np.linspace(0.0, 1.0, WIDTH)
        rgb[hit] = (np.array(drink.color) * shade[column[hit]][:, None]).astype(np.uint8)
    return image(rgb, "rgb8"), image(depth_m.astype("<f4"), "32FC1"), info()


def image(pixels: NDArray[np.generic], encoding: str) -> Image:
    """A message of pixels (height, width, ...)."""
    data = np.frombuffer(pixels.tobytes(), dtype=np.uint8)
    height, width = pixels.shape[:2]
    return Image(
        header=header("robot/camera", 4.5),
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=0,
        step=data.size // height,
        data=data,
    )


def info() -> CameraInfo:
    """The camera of `picture`."""
    k = np.array([FOCAL_PX, 0.0, 159.5, 0.0, FOCAL_PX, 119.5, 0.0, 0.0, 1.0])
    return CameraInfo(
        header=header("robot/camera", 4.5),
        height=HEIGHT,
        width=WIDTH,
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=k,
        r=np.eye(3).ravel(),
        p=np.zeros(12),
        binning_x=0,
        binning_y=0,
        roi=RegionOfInterest(x_offset=0, y_offset=0, height=0, width=0, do_rectify=False),
    )


def seen(
    color: Image, depth: Image, camera_info: CameraInfo, object_class: str = "Beer", hue_file: pathlib.Path = HUE_FILE
) -> PointStamped:
    """What `detection` says for the robot at ROBOT."""
    reply = detection(
        color=color,
        depth=depth,
        camera_info=camera_info,
        pose=at(*ROBOT),
        hue_file=hue_file,
        object_class=object_class,
        camera_x_m=CAMERA_X_M,
        camera_z_m=CAMERA_Z_M,
        camera_pitch_rad=PITCH_RAD,
        t_s=5.0,
    )
    return reply["position"]


def on_map(x_m: float, y_m: float) -> tuple[float, float]:
    """A point of the robot's frame on the map."""
    c, s = math.cos(ROBOT[2]), math.sin(ROBOT[2])
    return ROBOT[0] + c * x_m - s * y_m, ROBOT[1] + s * x_m + c * y_m


@settings(deadline=None, max_examples=30, derandomize=True)
@given(x_m=st.floats(0.9, 2.2), across=st.floats(-0.35, 0.35), can=st.booleans())
def test_a_drink_is_found_where_it_stands(x_m: float, across: float, can: bool) -> None:
    """Bottle or can, near or far, left or right: within 0.02 m on the map, and its height within 0.06 m."""
    drink = Drink(x_m=x_m, y_m=across * x_m)
    if can:
        drink = dataclasses.replace(drink, radius_m=0.035, height_m=0.13, color=RED)
    position = seen(*picture(drink), object_class="SoftDrink" if can else "Beer")
    assert math.dist((position.point.x, position.point.y), on_map(drink.x_m, drink.y_m)) <= 0.02
    assert position.point.z == pytest.approx(drink.bottom_m + drink.height_m / 2.0, abs=0.06)
    assert (position.header.frame_id, stamp_s(position.header.stamp)) == ("map", 4.5)


def test_colors_are_told_apart() -> None:
    """Beside each other, the bottle is the beer and the can is the soft drink."""
    bottle = Drink(x_m=1.3, y_m=0.15)
    can = Drink(x_m=1.3, y_m=-0.15, radius_m=0.035, height_m=0.13, color=RED)
    for drink, name in ((bottle, "Beer"), (can, "SoftDrink")):
        position = seen(*picture(bottle, can), object_class=name)
        assert math.dist((position.point.x, position.point.y), on_map(drink.x_m, drink.y_m)) <= 0.02


def test_nothing_of_the_color_is_nothing_found() -> None:
    """An empty scene is the failure ObjectNotFound, which tells what was looked for and from where."""
    with pytest.raises(ComputeFailed, match=r"ObjectNotFound: no Beer in the picture taken at \("):
        seen(*picture())


def test_what_cannot_be_a_drink_is_passed_over() -> None:
    """A green curtain is too wide; the bottle beside it is found nevertheless, a green speck is not."""
    bottle = Drink(x_m=1.3, y_m=0.2)
    curtain = Drink(x_m=2.8, y_m=-0.8, radius_m=0.5, height_m=1.2, bottom_m=0.0)
    position = seen(*picture(bottle, curtain))
    assert math.dist((position.point.x, position.point.y), on_map(bottle.x_m, bottle.y_m)) <= 0.02
    for nothing in (curtain, dataclasses.replace(bottle, radius_m=0.008)):
        with pytest.raises(ComputeFailed, match="ObjectNotFound"):
            seen(*picture(nothing))


def test_pixels_without_depth_do_not_count() -> None:
    """Half of the picture without depth: in the right place if it is found at all; all of it: not found."""
    color, depth, camera_info = picture(Drink(x_m=1.2, y_m=0.0))
    whole_m = np.frombuffer(depth.data.tobytes(), dtype="<f4").reshape(HEIGHT, WIDTH)
    outcomes: list[str] = []
    for rows_without in (slice(0, HEIGHT // 2), slice(HEIGHT // 2, HEIGHT)):
        half_m = whole_m.copy()
        half_m[rows_without] = math.nan
        try:
            position = seen(color, image(half_m, "32FC1"), camera_info)
        except ComputeFailed as failed:
            outcomes.append(failed.code)
        else:
            outcomes.append("found")
            assert math.dist((position.point.x, position.point.y), on_map(1.2, 0.0)) <= 0.03
    assert set(outcomes) <= {"found", "ObjectNotFound"}
    assert "found" in outcomes
    with pytest.raises(ComputeFailed, match="ObjectNotFound"):
        seen(color, image(np.zeros_like(whole_m), "32FC1"), camera_info)


def test_padded_rows_and_big_endian_depth_are_read() -> None:
    """The same picture in another layout gives the same position."""
    color, depth, camera_info = picture(Drink(x_m=1.2, y_m=0.1))
    padded = np.pad(color.data.reshape(HEIGHT, color.step), ((0, 0), (0, 8)))
    wide = dataclasses.replace(color, step=color.step + 8, data=padded.ravel())
    swapped = depth.data.reshape(-1, 4)[:, ::-1].ravel()
    other = dataclasses.replace(depth, is_bigendian=1, data=swapped)
    assert seen(wide, other, camera_info) == seen(color, depth, camera_info)


def test_bad_pictures_are_refused() -> None:
    """Other encodings, sizes that do not fit and focal lengths of 0 are BadInput and told by name."""
    color, depth, camera_info = picture()
    no_focal = dataclasses.replace(camera_info, k=np.zeros(9))
    for bad_color, bad_depth, bad_info, told in (
        (dataclasses.replace(color, encoding="bgr8"), depth, camera_info, "'bgr8'"),
        (color, dataclasses.replace(depth, encoding="16UC1"), camera_info, "'16UC1'"),
        (dataclasses.replace(color, data=color.data[:-3]), depth, camera_info, "color of 320 x 240"),
        (color, image(np.ones((120, 160), dtype="<f4"), "32FC1"), camera_info, "must agree"),
        (color, depth, no_focal, "focal lengths"),
    ):
        with pytest.raises(ComputeFailed) as caught:
            seen(bad_color, bad_depth, bad_info)
        assert caught.value.code == "BadInput"
        assert told in caught.value.message


def test_an_unknown_class_is_refused() -> None:
    """The error names the file and the classes it has."""
    with pytest.raises(ComputeFailed, match=r"BadInput.*HUE\.yaml.*'Wine'.*Beer, SoftDrink"):
        seen(*picture(), object_class="Wine")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("- Beer\n", "expected object classes"),
        ("Beer: {\n", "not YAML"),
        ("Beer: green\n", "Beer"),
        ("Beer: {hue_deg: [1], saturation_min: 0, value_min: 0, radius_m: 0.04}\n", "hue_deg"),
        ("Beer: {hue_deg: [1, 2], saturation_min: 0, value_min: 0}\n", "radius_m"),
        ("Beer: {hue_deg: [1, 400], saturation_min: 0, value_min: 0, radius_m: 0.04}\n", "400.0; it must be in 0..360"),
    ],
)
def test_a_broken_hue_file_is_refused(tmp_path: pathlib.Path, text: str, told: str) -> None:
    """The error names the file, the class and the field; a missing file is told too."""
    file = tmp_path / "colors.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ComputeFailed) as caught:
        seen(*picture(), hue_file=file)
    assert caught.value.code == "BadInput"
    assert "colors.yaml" in caught.value.message
    assert told in caught.value.message
    with pytest.raises(ComputeFailed, match="cannot be read"):
        seen(*picture(), hue_file=tmp_path / "absent.yaml")
