"""World files become boxes."""

from __future__ import annotations

from pathlib import Path

import pytest

from sim.errors import BadScenario
from sim.world import load_world, object_models

WORLD = """
[world]
name = "hut"
size_m = [4.0, 3.0]
wall_thickness_m = 0.1
wall_height_m = 2.0
wall_color = [0.9, 0.9, 0.9]
floor_color = [0.7, 0.7, 0.7]
[inner_walls.middle]
x_m = [2.0, 2.1]
y_m = [0.0, 1.0]
[furniture.desk]
shape = "table"
center_m = [1.0, 2.0]
size_m = [1.0, 0.6]
height_m = 0.7
top_thickness_m = 0.05
leg_m = 0.06
color = [0.5, 0.4, 0.3]
"""


def test_walls_stand_outside_of_the_lab(tmp_path: Path) -> None:
    """The inner faces of the outer walls are the rectangle of the lab, and the walls meet in the corners."""
    (tmp_path / "hut.toml").write_text(WORLD)
    world = load_world(tmp_path / "hut.toml")
    south, north, west, east, middle = world.boxes[:5]
    assert (south.low[:2], south.high[:2]) == ((-0.1, -0.1), (4.1, 0.0))
    assert (north.low[:2], north.high[:2]) == ((-0.1, 3.0), (4.1, 3.1))
    assert (west.high[0], east.low[0]) == (0.0, 4.0)
    assert (middle.low, middle.high) == ((2.0, 0.0, 0.0), (2.1, 1.0, 2.0))


def test_a_table_is_a_top_on_four_legs_in_its_corners(tmp_path: Path) -> None:
    """The legs carry the top, do not stick out, and leave the floor below free."""
    (tmp_path / "hut.toml").write_text(WORLD)
    top, *legs = load_world(tmp_path / "hut.toml").boxes[5:]
    assert top.low == pytest.approx((0.5, 1.7, 0.65))
    assert top.high == pytest.approx((1.5, 2.3, 0.7))
    assert len(legs) == 4
    assert {(round(leg.low[0], 6), round(leg.low[1], 6)) for leg in legs} == {
        (0.5, 1.7),
        (1.44, 1.7),
        (0.5, 2.24),
        (1.44, 2.24),
    }
    assert all(leg.high[2] == top.low[2] and leg.low[2] == 0.0 for leg in legs)
    assert not any(leg.covers(1.0, 2.0) for leg in legs)


def test_objects_stand_on_tops_and_floors_only(tmp_path: Path) -> None:
    """On the table, below it and on free floor is fine; in the air, in a wall and outside is not."""
    (tmp_path / "hut.toml").write_text(WORLD)
    world = load_world(tmp_path / "hut.toml")
    assert all(world.bears(spot) for spot in [(1.0, 2.0, 0.7), (1.0, 2.0, 0.0), (3.0, 1.0, 0.0)])
    assert not any(world.bears(spot) for spot in [(1.0, 2.0, 0.8), (2.05, 0.5, 0.0), (3.0, 1.0, 0.7), (5.0, 1.0, 0.0)])


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ('shape = "table"', 'shape = "round"', "furniture.desk.shape"),
        ("x_m = [2.0, 2.1]", "x_m = [2.1, 2.0]", "inner_walls.middle.x_m"),
        ("color = [0.5, 0.4, 0.3]", "color = [128, 100, 80]", "furniture.desk.color"),
        ("leg_m = 0.06", "leg_m = 0.5", "furniture.desk.leg_m"),
        ('shape = "table"', 'shape = "solid"', "furniture.desk.top_thickness_m"),
        ("size_m = [4.0, 3.0]", "size_m = [4.0, 0.0]", "world.size_m"),
    ],
)
def test_a_fault_names_the_field(tmp_path: Path, old: str, new: str, field: str) -> None:
    """One fault in a good world file is told by its field."""
    assert old in WORLD
    (tmp_path / "hut.toml").write_text(WORLD.replace(old, new, 1))
    with pytest.raises(BadScenario) as caught:
        load_world(tmp_path / "hut.toml")
    assert caught.value.field == field


def test_drinks_are_as_described() -> None:
    """A beer bottle is green, a soft-drink can red, both the size of such things."""
    models = object_models()
    assert models["beer_bottle"].color[1] > 0.5 > models["beer_bottle"].color[0]
    assert models["soft_drink_can"].color[0] > 0.5 > models["soft_drink_can"].color[1]
    drinks = [models[name] for name in ("beer_bottle", "soft_drink_can")]
    assert all(0.035 <= model.radius_m <= 0.04 and 0.12 <= model.height_m <= 0.22 for model in drinks)
