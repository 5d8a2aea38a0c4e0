from __future__ import annotations

import pathlib
import pickle

import numpy as np
import pytest

from grounding.compute.errors import ComputeFailed, MapFileError
from grounding.compute.grids import FREE, OCCUPIED, UNKNOWN, grid_of
from grounding.compute.maps import loc_map, nav_map
from grounding.messages import stamp_s
from tests.grounding.compute.rooms import grid_with

FIELDS = {
    "image": "room.pgm",
    "resolution": "0.05",
    "origin": "[-0.5, -0.25, 0]",
    "negate": "0",
    "occupied_thresh": "0.65",
    "free_thresh": "0.196",
}
SITE = pathlib.Path(__file__).parents[3] / "kb" / "ontologies" / "sites" / "tue_lab"


def written(folder: pathlib.Path, picture: bytes, **changed: str | None) -> pathlib.Path:
    """A map file with some fields changed, or left out (None)."""
    (folder / "room.pgm").write_bytes(picture)
    fields = {name: value for name, value in {**FIELDS, **changed}.items() if value is not None}
    file = folder / "room.yaml"
    file.write_text("".join(f"{name}: {value}\n" for name, value in fields.items()), encoding="utf-8")
    return file


# Top row: occupied, unknown, free; bottom row: free, free, occupied.
P2 = b"P2\n# a comment\n3 2\n255\n0 205 254\n254 254 # another\n0\n"
P5 = b"P5\n# a comment\n3 2\n255\n" + bytes([0, 205, 254, 254, 254, 0])
CELLS = [[FREE, FREE, OCCUPIED], [OCCUPIED, UNKNOWN, FREE]]


@pytest.mark.parametrize("picture", [P2, P5])
def test_pixels_become_cells_from_the_bottom_up(tmp_path: pathlib.Path, picture: bytes) -> None:
    """Text and binary pictures give free, occupied and unknown cells, with origin, resolution and stamp."""
    grid = loc_map(map_file=written(tmp_path, picture), t_s=2.5)["map"]
    assert grid.data.reshape(2, 3).tolist() == CELLS
    assert (grid.info.width, grid.info.height, grid.info.resolution) == (3, 2, 0.05)
    assert (grid.info.origin.position.x, grid.info.origin.position.y) == (-0.5, -0.25)
    assert (grid.header.frame_id, stamp_s(grid.header.stamp)) == ("map", 2.5)


def test_negate_turns_black_and_white(tmp_path: pathlib.Path) -> None:
    """With negate, dark pixels are free and bright ones occupied."""
    grid = loc_map(map_file=written(tmp_path, P5, negate="1"), t_s=0.0)["map"]
    assert grid.data.reshape(2, 3).tolist() == [[100, 100, 0], [0, 100, 100]]


def test_numbers_may_be_written_with_an_exponent(tmp_path: pathlib.Path) -> None:
    """5e-2 is a number for map_server, so for us as well."""
    assert loc_map(map_file=written(tmp_path, P5, resolution="5e-2"), t_s=0.0)["map"].info.resolution == 0.05


def test_a_changed_file_is_read_anew(tmp_path: pathlib.Path) -> None:
    """Results are kept by content, not by name."""
    before = loc_map(map_file=written(tmp_path, P5), t_s=0.0)["map"]
    after = loc_map(map_file=written(tmp_path, P5.replace(b"\xfe", b"\x00")), t_s=0.0)["map"]
    assert (before.data != after.data).any()


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("image", None),
        ("image", "absent.pgm"),
        ("resolution", None),
        ("resolution", "0"),
        ("resolution", ".nan"),
        ("resolution", "fine"),
        ("origin", "[0, 0]"),
        ("origin", "[0, 0, 0.3]"),
        ("negate", "2"),
        ("free_thresh", "0.9"),
        ("occupied_thresh", "[]"),
        ("mode", "scale"),
    ],
)
def test_a_wrong_field_is_named(tmp_path: pathlib.Path, field: str, value: str | None) -> None:
    """The error tells the file and the field."""
    file = written(tmp_path, P5, **{field: value})
    with pytest.raises(MapFileError) as caught:
        loc_map(map_file=file, t_s=0.0)
    assert field in caught.value.field
    assert str(file) in str(caught.value)
    assert caught.value.code == "BadInput"


@pytest.mark.parametrize(
    "picture",
    [
        b"",
        b"P6\n1 1\n255\n\x00\x00\x00",
        P5[:-1],
        P2[:-3],
        P2.replace(b"205", b"2x5"),
        P2.replace(b"205", b"-1"),
        P2.replace(b"254", b"300"),
        P5.replace(b"255", b"100"),
        P5.replace(b"255", b"65535"),
        b"P5\n0 2\n255\n",
        b"P5\n999999 999999\n255\n\x00",
    ],
)
def test_a_broken_picture_is_refused(tmp_path: pathlib.Path, picture: bytes) -> None:
    """The error tells the picture's file."""
    with pytest.raises(MapFileError, match=r"room\.pgm"):
        loc_map(map_file=written(tmp_path, picture), t_s=0.0)


@pytest.mark.parametrize("text", ["", "- 1\n", "image: [\n", "image: room.pgm\n\tx"])
def test_what_is_no_map_file_is_refused(tmp_path: pathlib.Path, text: str) -> None:
    """Empty files, lists and broken YAML give our error, and so does a missing file."""
    file = tmp_path / "room.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(MapFileError):
        loc_map(map_file=file, t_s=0.0)
    with pytest.raises(MapFileError, match="cannot read"):
        loc_map(map_file=tmp_path / "absent.yaml", t_s=0.0)


def test_inflation_keeps_the_center_a_radius_away(tmp_path: pathlib.Path) -> None:
    """A cell is free exactly if its center is farther from all occupied, unknown and outside cells than the radius."""
    pixels = np.full((40, 50), 254, dtype=np.uint8)
    pixels[10, 20], pixels[30, 40] = 0, 205
    file = written(tmp_path, b"P5\n50 40\n255\n" + pixels.tobytes())
    radius_m = 0.33
    cells = grid_of(nav_map(map_file=file, radius_m=radius_m, t_s=0.0)["map"]).cells
    row, column = np.mgrid[0:40, 0:50]
    to_points = np.minimum(np.hypot(row - 29, column - 20), np.hypot(row - 9, column - 40))
    to_edge = np.minimum.reduce([row + 1, 40 - row, column + 1, 50 - column])
    expected = 0.05 * np.minimum(to_points, to_edge) > radius_m + 0.025
    assert ((cells == FREE) == expected).all()
    assert set(np.unique(cells).tolist()) == {FREE, OCCUPIED}


def test_a_radius_must_be_a_length(tmp_path: pathlib.Path) -> None:
    """Negative and undefined radii are refused."""
    for radius_m in (-0.1, float("nan")):
        with pytest.raises(ComputeFailed, match="radius_m"):
            nav_map(map_file=written(tmp_path, P5), radius_m=radius_m, t_s=0.0)


def test_maps_are_values(tmp_path: pathlib.Path) -> None:
    """A caller cannot spoil the map that the next caller gets."""
    grid = loc_map(map_file=written(tmp_path, P5), t_s=0.0)["map"]
    with pytest.raises(ValueError, match="read-only"):
        grid.data[0] = 100


def test_a_map_message_must_fit_its_own_size(tmp_path: pathlib.Path) -> None:
    """Data that is not width * height cells is refused."""
    grid = loc_map(map_file=written(tmp_path, P5), t_s=0.0)["map"]
    grid.info.width = 4
    with pytest.raises(ComputeFailed, match="BadInput"):
        grid_of(grid)


def test_errors_travel_between_processes() -> None:
    """Both errors survive pickling with their fields."""
    error = pickle.loads(pickle.dumps(MapFileError(pathlib.Path("a.yaml"), "origin", "is wrong")))
    assert (error.field, error.code, error.fault) == ("origin", "BadInput", "knowledge")
    assert pickle.loads(pickle.dumps(ComputeFailed("NoPath", "why"))).code == "NoPath"


def test_cells_and_points_agree() -> None:
    """The center of a cell lies in that cell."""
    grid = grid_with(())
    rows, columns = np.array([0, 3, 89]), np.array([0, 129, 5])
    assert grid.cells_of(grid.centers_m(rows, columns)).tolist() == [[0, 0], [3, 129], [89, 5]]
    assert not grid.holds(*grid.cell_of(-0.3, 0.0))
    assert grid.cells_of(np.array([[-9.0, 0.0]])).shape == (0, 2)


def test_the_shipped_site_can_be_read() -> None:
    """The lab's maps cover its 10 m by 8 m, and the robots' standing places are free for the larger robot."""
    assert loc_map(map_file=SITE / "locMap.yaml", t_s=0.0)["map"].info.width == 220
    grid = grid_of(nav_map(map_file=SITE / "navMap.yaml", radius_m=0.35, t_s=0.0)["map"])
    for place in ((1.0, 1.0), (9.0, 1.0), (2.6, 4.9), (8.2, 4.5), (7.5, 1.5), (1.7, 4.0), (4.4, 1.9)):
        assert grid.cells[grid.cell_of(*place)] == FREE
