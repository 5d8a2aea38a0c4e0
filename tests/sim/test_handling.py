"""Loading and unloading: what rides where, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import pytest

from sim.errors import ServiceRefused
from sim.scenario import load_scenario
from tests.sim.conftest import PLACES, Lab


def _refusal(lab: Lab, service: str, **request: object) -> tuple[str, str]:
    with pytest.raises(ServiceRefused) as refused:
        lab.call(service, **request)
    return refused.value.code, str(refused.value)


def test_what_is_loaded_rides_along_and_is_put_down_elsewhere(tue_lab: Callable[..., Lab]) -> None:
    """From the coffee table, over the floor, and back onto the table; the robot touches nothing."""
    lab = tue_lab(amigo="at_coffee_table")
    lab.call("/amigo_1/load", object="drink_1")
    lab.drive("amigo_1", -0.4, 0.0, 0.0, seconds=2.0)
    lab.wait(1.0)
    x, y, _ = lab.fleet.true_pose("amigo_1")
    assert lab.fleet.true_position("drink_1")[:2] == (x, y)
    assert lab.fleet.true_position("drink_1")[2] > 1.0
    assert _refusal(lab, "/amigo_1/unload")[0] == "NoSurface"
    lab.drive("amigo_1", 0.4, 0.0, 0.0, seconds=2.0)
    lab.wait(1.0)
    lab.call("/amigo_1/unload")
    put = lab.fleet.true_position("drink_1")
    assert put[2] == 0.45
    assert math.dist(put[:2], lab.fleet.true_pose("amigo_1")[:2]) <= 1.5
    assert lab.fleet.collisions == 0


def test_what_a_robot_does_not_load(tue_lab: Callable[..., Lab]) -> None:
    """What is too far away or unknown, a second object, or anything while it drives."""
    lab = tue_lab(amigo="at_coffee_table", pico="at_dining_table")
    code, told = _refusal(lab, "/amigo_1/load", object="drink_2")
    assert (code, "the reach is 1.5 m" in told) == ("OutOfReach", True)
    assert _refusal(lab, "/amigo_1/load", object="drink_9")[0] == "ObjectNotFound"
    assert _refusal(lab, "/amigo_1/load", thing="drink_1")[0] == "BadRequest"
    lab.drive("amigo_1", -0.3, 0.0, 0.0, seconds=0.3)
    assert _refusal(lab, "/amigo_1/load", object="drink_1")[0] == "BaseMoves"
    lab.command("amigo_1", 0.0, 0.0, 0.0)
    lab.call("/amigo_1/load", object="drink_1")  # it is slowing down to a stand
    assert _refusal(lab, "/amigo_1/load", object="drink_1")[0] == "AlreadyHolding"
    assert _refusal(lab, "/pico_1/load", object="drink_1")[0] == "ObjectNotFound"
    assert _refusal(lab, "/pico_1/unload")[0] == "NotHolding"


def test_things_are_not_put_upon_each_other(tue_lab: Callable[..., Lab]) -> None:
    """Where one stands, the next goes beside it."""
    lab = tue_lab(amigo="at_coffee_table")
    lab.call("/amigo_1/load", object="drink_1")
    lab.call("/amigo_1/unload")
    first = lab.fleet.true_position("drink_1")
    lab.call("/amigo_1/load", object="drink_1")
    lab.call("/amigo_1/unload")
    assert lab.fleet.true_position("drink_1") == first


def test_somebody_takes_an_object_from_a_robot(tmp_path: Path) -> None:
    """A scenario puts it elsewhere at its time; the robot holds nothing then, and nobody is told."""
    shipped = (files("sim") / "scenarios" / "tue_lab.toml").read_text()
    change = '\n[changes.tidied]\nat_s = 2.0\nobject = "drink_1"\nposition = [8.0, 5.6, 0.75]\n'
    (tmp_path / "tidied.toml").write_text(shipped + change)
    starts = {"amigo_1": PLACES["at_coffee_table"], "pico_1": PLACES["start_east"]}
    lab = Lab(load_scenario(tmp_path / "tidied.toml"), starts)
    lab.call("/amigo_1/load", object="drink_1")
    lab.wait(3.0)
    assert lab.fleet.true_position("drink_1") == (8.0, 5.6, 0.75)
    assert _refusal(lab, "/amigo_1/unload")[0] == "NotHolding"
    lab.fleet.close()
