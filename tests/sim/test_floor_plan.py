"""Maps drawn from the world."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import kb
from sim.floor_plan import draw_floor_plans, main, occupied_cells
from sim.world import load_world


def _read(file: Path) -> NDArray[np.uint8]:
    """Pixels of a P5 picture, bottom row first."""
    magic, size, most, pixels = file.read_bytes().split(b"\n", 3)
    assert (magic, most) == (b"P5", b"255")
    width, height = map(int, size.split())
    return np.frombuffer(pixels, np.uint8).reshape(height, width)[::-1]


def _cell(x_m: float, y_m: float) -> tuple[int, int]:
    """Row and column of a point of the map."""
    return int((y_m + 0.5) / 0.05), int((x_m + 0.5) / 0.05)


@pytest.mark.parametrize("site", ["tue_lab", "ward"])
def test_shipped_maps_are_those_of_the_world(site: str, tmp_path: Path) -> None:
    """Drawing the rooms again gives the very files of the knowledge base."""
    shipped = Path(kb.__file__).parent / "ontologies" / "sites" / site
    drawn = draw_floor_plans(load_world(site), tmp_path)
    assert [file.name for file in drawn] == ["locMap.yaml", "locMap.pgm", "navMap.yaml", "navMap.pgm"]
    for file in drawn:
        assert file.read_bytes() == (shipped / file.name).read_bytes(), f"draw {file.name} again: sim.floor_plan"


def test_maps_show_what_they_should(tmp_path: Path) -> None:
    """Walls are in both maps; below a table there is room for the laser but not for a robot."""
    draw_floor_plans(load_world("tue_lab"), tmp_path)
    loc, nav = _read(tmp_path / "locMap.pgm"), _read(tmp_path / "navMap.pgm")
    assert loc.shape == nav.shape == (180, 220)
    assert set(np.unique(loc)) == set(np.unique(nav)) == {0, 254}
    free, occupied = 254, 0
    for x, y, in_loc, in_nav in (
        (1.0, 1.0, free, free),  # floor
        (5.5, 4.0, free, free),  # passage between the rooms
        (5.5, 1.0, occupied, occupied),  # inner wall
        (-0.05, 4.0, occupied, occupied),  # outer wall
        (-0.3, 4.0, free, free),  # outside
        (8.2, 5.8, free, occupied),  # under the dining table
        (7.53, 5.43, occupied, occupied),  # its leg
        (7.5, 2.7, occupied, occupied),  # bar
    ):
        assert (loc[_cell(x, y)], nav[_cell(x, y)]) == (in_loc, in_nav), (x, y)


def test_inner_wall_is_as_thick_as_it_is() -> None:
    """A wall of 0.1 m along the grid takes two cells, and what is above the cut is not in it."""
    world = load_world("tue_lab")
    assert occupied_cells(world, 0.3, 0.3)[_cell(5.0, 1.0)[0], _cell(5.25, 0.0)[1] : _cell(5.76, 0.0)[1]].sum() == 2
    assert not occupied_cells(world, 2.5, 3.0).any()


def test_command_line_draws(tmp_path: Path) -> None:
    """The command makes the folder and the four files."""
    assert main(["tue_lab", str(tmp_path / "new" / "maps")]) == 0
    assert len(list((tmp_path / "new" / "maps").iterdir())) == 4


def test_command_line_tells_what_is_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An unknown world gives one line and exit code 1."""
    assert main(["atlantis", str(tmp_path)]) == 1
    assert "atlantis.toml: file: cannot be read" in capsys.readouterr().err
