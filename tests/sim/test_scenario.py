"""Scenario files: what is shipped loads, and every fault is told with file and field."""

from __future__ import annotations

from pathlib import Path

import pytest

from sim.errors import BadScenario
from sim.scenario import builtin_scenarios, load_scenario

GOOD = """
[scenario]
site = "tue_lab"
world = "tue_lab"
seed = 1
[robots.amigo_1]
model = "amigo"
start = "start_west"
placement_error_m = 0.03
placement_error_rad = 0.03
[objects.drink_1]
model = "beer_bottle"
position = [2.5, 6.0, 0.45]
believed_at = "at_coffee_table"
"""


def test_shipped_scenarios_load() -> None:
    """Every shipped scenario is valid and is named after its file."""
    names = builtin_scenarios()
    assert set(names) == {"tue_lab", "swapped_starts", "both_drinks_west", "ward", "ward_door_shut"}
    assert [load_scenario(name).name for name in names] == list(names)


def test_find_empty_drink_is_as_filed() -> None:
    """The default scenario has the robots and drinks it is described to have; the ontology tells where they are."""
    scenario = load_scenario("tue_lab")
    assert [(robot.name, robot.model.name, robot.start) for robot in scenario.robots] == [
        ("amigo_1", "amigo", None),
        ("pico_1", "pico", None),
    ]
    assert [(thing.name, thing.model.name, thing.position, thing.believed_at) for thing in scenario.objects] == [
        ("drink_1", "beer_bottle", (2.5, 6.0, 0.45), None),
        ("drink_2", "soft_drink_can", (8.3, 5.6, 0.75), None),
    ]
    assert (scenario.site, scenario.world.name, scenario.seed) == ("tue_lab", "tue_lab", 1)


def test_a_file_of_ones_own_loads(tmp_path: Path) -> None:
    """A good file outside of the package is read, which also shows that the faults below are the only ones."""
    file = tmp_path / "mine.toml"
    file.write_text(GOOD)
    scenario = load_scenario(file)
    assert scenario.name == "mine"
    assert scenario.objects[0].model.radius_m == 0.04


@pytest.mark.parametrize(
    ("old", "new", "field", "words"),
    [
        ("seed = 1", "", "scenario.seed", "missing"),
        ("seed = 1", "seed = -1", "scenario.seed", "whole number"),
        ("seed = 1", "seed = true", "scenario.seed", "whole number"),
        ("seed = 1", "seed = 1\nsede = 2", "scenario.sede", "unknown field"),
        ("seed = 1", "seed =", "file", "not TOML"),
        ('world = "tue_lab"', 'world = "atlantis"', "file", "cannot be read"),
        ('site = "tue_lab"', 'site = "TU/e lab"', "scenario.site", "not a name"),
        ('model = "amigo"', 'model = "hal"', "robots.amigo_1.model", "known are amigo, pico"),
        ("placement_error_m = 0.03", "placement_error_m = -0.03", "robots.amigo_1.placement_error_m", "from 0 to 1"),
        ("placement_error_m = 0.03", 'placement_error_m = "3cm"', "robots.amigo_1.placement_error_m", "not a number"),
        ("placement_error_rad = 0.03", "placement_error_rad = nan", "robots.amigo_1.placement_error_rad", "number"),
        ("[robots.amigo_1]", "[robots.Amigo-1]", "robots.Amigo-1", "not a name"),
        ("[robots.amigo_1]", "[robot.amigo_1]", "robots", "missing"),
        ('start = "start_west"', "start = 3", "robots.amigo_1.start", "not a text"),
        ("0.45]", "0.55]", "objects.drink_1.position", "nothing bears"),
        ("0.45]", "0.30]", "objects.drink_1.position", "nothing bears"),
        ("[2.5, 6.0, 0.45]", "[12.5, 6.0, 0.0]", "objects.drink_1.position", "nothing bears"),
        ("[2.5, 6.0, 0.45]", "[7.5, 2.7, 0.0]", "objects.drink_1.position", "nothing bears"),
        ("[2.5, 6.0, 0.45]", "[2.5, 6.0]", "objects.drink_1.position", "list of 3 numbers"),
        ('model = "beer_bottle"', 'model = "amigo"', "objects.drink_1.model", "known are beer_bottle"),
        ("[objects.drink_1]", "[objects.amigo_1]", "objects.amigo_1", "name of a robot too"),
        ("[objects.drink_1]", "[doors.drink_1]", "objects", "missing"),
        ('believed_at = "at_coffee_table"', 'believed_at = ""', "objects.drink_1.believed_at", "not a text"),
    ],
)
def test_a_fault_names_file_and_field(tmp_path: Path, old: str, new: str, field: str, words: str) -> None:
    """One fault in a good file gives one message with the file, the field and what would be right."""
    assert old in GOOD
    file = tmp_path / "faulty.toml"
    file.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(BadScenario) as caught:
        load_scenario(file)
    assert caught.value.field == field
    assert words in str(caught.value)
    assert ("atlantis.toml" if "atlantis" in new else str(file)) in str(caught.value)


def test_an_empty_fleet_is_refused(tmp_path: Path) -> None:
    """A scenario without robots is told so."""
    file = tmp_path / "empty.toml"
    file.write_text('[scenario]\nsite = "a"\nworld = "tue_lab"\nseed = 1\n[robots]\n[objects]\n')
    with pytest.raises(BadScenario, match="at least one robot"):
        load_scenario(file)


def test_a_missing_file_is_told() -> None:
    """A scenario that does not exist gives a message, not a traceback of the file system."""
    with pytest.raises(BadScenario, match=r"no_such_scenario\.toml: file: cannot be read"):
        load_scenario("no_such_scenario")
