"""A person tells of a change in the world while robots are at work: the rest is planned anew where that matters."""

from __future__ import annotations

from pathlib import Path

import pytest

from executive import Fleet, TaskStatus
from executive.errors import BadRequest
from executive.replay import first_difference
from executive.trace import ActionStarted, FactsTold, PlanMade, Replanned
from kb.files import SHIPPED
from tests.scenarios.test_faults import finished, scenario_with

IN_TRUTH = {"at_cabinet": "[0.45, 4.1, 1.0]", "at_bar": "[7.5, 2.6, 1.0]"}
"""Where drink_2 truly stands, if it is at these locations."""


@pytest.mark.parametrize(("place", "searcher"), [("at_cabinet", "amigo_1"), ("at_bar", "pico_1")])
def test_a_drink_that_was_moved_is_found_where_it_is_now(tmp_path: Path, place: str, searcher: str) -> None:
    """Pico is on its way to it: in the west, Amigo gets it, being nearer; in the east, Pico turns round."""
    scenario = scenario_with(tmp_path, "position = [8.3, 5.6, 0.75]", f"position = {IN_TRUTH[place]}")
    with Fleet.open("tue_lab", scenario=scenario) as fleet:
        task = fleet.request("FindEmptyDrink", room="tue_lab")
        assert task.wait_until(3.0) is None
        before = len(fleet.trace)
        fleet.tell("locatedAt", "drink_2", place)
        result = task.wait()
        assert result.status is TaskStatus.COMPLETED, result.reason
        detected = {e.action.split('"')[1]: e.robot for e in finished(fleet, "Detection")}
        assert detected == {"drink_1": "amigo_1", "drink_2": searcher}
        found, truth = result.outputs["position"]["drink_2"].point, fleet.parts.simulation.true_position("drink_2")
        assert (found.x, found.y) == pytest.approx(truth[:2], abs=0.1)
        assert fleet.parts.simulation.collisions == 0
        after = list(fleet.trace)[before:]
        assert isinstance(after[0], FactsTold)
        assert (after[0].task, after[0].prop, after[0].value) == ("", "locatedAt", place)
        [anew] = [e for e in after if isinstance(e, Replanned)]
        assert anew.reason == f"locatedAt(drink_2) is {place} now, for which the plan was not made"
        assert [e.t_s for e in after if isinstance(e, PlanMade)] == [pytest.approx(anew.t_s + 0.5)]


@pytest.mark.parametrize("at_s", [0.0, 0.2])
def test_a_change_before_the_first_plan_is_part_of_it(at_s: float) -> None:
    """While it is being made, nothing is done yet: it is made for what is so now."""
    with Fleet.open("tue_lab") as fleet:
        task = fleet.request("FindEmptyDrink", room="tue_lab")
        fleet.let_time_pass(at_s)
        fleet.tell("locatedAt", "drink_1", "at_cabinet")
        fleet.tell("isEmpty", "drink_2", False)
        assert task.wait_until(1.0) is None
        assert not [e for e in fleet.trace if isinstance(e, ActionStarted) and e.t_s < at_s + 0.5]
        *_, plan = [e for e in fleet.trace if isinstance(e, PlanMade)]
        assert {action.split('"')[3] for action, *_ in plan.steps if action.startswith("Navigate(")} == {"at_cabinet"}
        task.cancel()
        recorded = list(fleet.trace)
    assert first_difference(recorded, SHIPPED) == ""


def test_a_change_that_no_plan_asks_for_is_noted_and_nothing_else() -> None:
    """The task goes on as planned, and later ones begin with what is so now."""
    with Fleet.open("tue_lab") as fleet:
        task = fleet.request("FindEmptyDrink", room="kitchen")
        task.wait_until(2.0)
        fleet.tell("isEmpty", "drink_1", False)
        assert task.wait().status is TaskStatus.COMPLETED
        assert not [e for e in fleet.trace if isinstance(e, Replanned)]
        nothing = fleet.request("FindEmptyDrink", room="living_room").wait()
        assert nothing.status is TaskStatus.COMPLETED
        assert nothing.took_s < 1.0


def test_a_run_with_changes_replays_the_same() -> None:
    """What was told is told again where it came in the order of events."""
    with Fleet.open("tue_lab") as fleet:
        task = fleet.request("FindEmptyDrink", room="tue_lab")
        task.wait_until(2.5)
        fleet.tell("isEmpty", "drink_2", False)
        task.wait_until(2.75)
        fleet.tell("isEmpty", "drink_2", True)
        assert task.wait().status is TaskStatus.COMPLETED
        recorded = list(fleet.trace)
    assert len([e for e in recorded if isinstance(e, Replanned)]) == 2
    assert first_difference(recorded, SHIPPED) == ""


@pytest.mark.parametrize(
    ("prop", "subject", "value", "why"),
    [
        ("locatedAd", "drink_1", "at_bar", "there is no property 'locatedAd' that a person can tell of; did you mean"),
        ("hasPoseEstimate", "amigo_1", "at_bar", "there is no property 'hasPoseEstimate' that a person can tell of"),
        ("locatedAt", "drink_7", "at_bar", "drink_7 is not known; did you mean drink_"),
        ("locatedAt", "drink_1", "at_bra", "cannot be 'at_bra', which is not known; did you mean at_bar?"),
        ("locatedAt", "drink_1", True, "locatedAt(drink_1) cannot be True; its values are individuals"),
        ("isEmpty", "drink_1", "yes", "isEmpty(drink_1) cannot be 'yes'; its values are true or false"),
        ("locatedAt", "drink_1", "kitchen", "kitchen is a Room, not a Location; a Location is at_bar"),
        ("isEmpty", "amigo_1", True, "amigo_1 is an Amigo, not a PhysicalObject; a PhysicalObject is bar_1"),
        ("isEmpty", "drink_1", float("nan"), "isEmpty(drink_1) cannot be nan; give an individual, a number or"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(prop: str, subject: str, value: str | float | bool, why: str) -> None:
    """With what would be right; nothing is told."""
    with Fleet.open("tue_lab") as fleet:
        events = len(fleet.trace)
        with pytest.raises(BadRequest) as refused:
            fleet.tell(prop, subject, value)
        assert why in str(refused.value)
        assert len(fleet.trace) == events
    with pytest.raises(BadRequest, match="this fleet is closed"):
        fleet.tell("locatedAt", "drink_1", "at_bar")
