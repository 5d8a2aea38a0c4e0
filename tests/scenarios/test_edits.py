"""What is edited in the ontology is what the fleet plans on: nothing else states it."""

from __future__ import annotations

from pathlib import Path

import pytest

from executive import Fleet
from grounding.errors import GroundingError
from tests.scenarios.conftest import Edit

TUE_LAB = "http://example.org/concertmaster/tue_lab.owl#"
CORE = "http://example.org/concertmaster/core.owl#"


def goals(fleet: Fleet, room: str = "tue_lab") -> set[tuple[str, str]]:
    """Which robot is to drive where."""
    plan, _ = fleet.plan("FindEmptyDrink", room=room)
    return {
        (s.action.robot or "", str(s.action.argument("location"))) for s in plan.steps if s.action.process == "Navigate"
    }


def test_a_drink_moved_in_the_ontology_is_looked_for_there(knowledge: Path, edit: Edit) -> None:
    """LocatedAt of drink_1 becomes the cabinet."""
    file = knowledge / "sites" / "tue_lab" / "tue_lab.owl"
    edit(
        file,
        f'<core:locatedAt rdf:resource="{TUE_LAB}at_coffee_table"/>',
        f'<core:locatedAt rdf:resource="{TUE_LAB}at_cabinet"/>',
    )
    with Fleet.open("tue_lab", knowledge=str(knowledge)) as fleet:
        assert goals(fleet) == {("amigo_1", "at_cabinet"), ("pico_1", "at_dining_table")}


def test_a_robot_moved_in_the_ontology_starts_there(knowledge: Path, edit: Edit) -> None:
    """LocatedAt of pico_1 becomes a place of the living room, and so it is the nearer one to the coffee table."""
    file = knowledge / "sites" / "tue_lab" / "tue_lab.owl"
    edit(
        file,
        f'<core:locatedAt rdf:resource="{TUE_LAB}start_east"/>',
        f'<core:locatedAt rdf:resource="{TUE_LAB}at_cabinet"/>',
    )
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        assert fleet.parts.simulation.true_pose("pico_1")[:2] == pytest.approx((1.7, 4.0), abs=0.2)
        assert ("pico_1", "at_coffee_table") in goals(fleet, room="living_room")


def test_a_faster_robot_has_a_shorter_plan(knowledge: Path, edit: Edit) -> None:
    """Twice the speed of Pico: half the travel time to the dining table."""
    with Fleet.open("tue_lab") as fleet:
        slow, _ = fleet.plan("FindEmptyDrink", room="kitchen")
    edit(knowledge / "robots" / "pico.owl", ">0.6<", ">1.2<")
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        fast, _ = fleet.plan("FindEmptyDrink", room="kitchen")
    fixed_s = 1.5 + 0.149  # Navigate's own duration, and the steps after it
    assert fast.makespan_s - fixed_s == pytest.approx((slow.makespan_s - fixed_s) / 2, abs=0.01)


def test_a_task_that_loops_on_sensing_without_a_duration_model_is_planned_as_far_as_can_be_foreseen(
    knowledge: Path, edit: Edit
) -> None:
    """Navigate without its duration model: the plan says where it ends, why, and what would help."""
    edit(
        knowledge / "tasks" / "navigation.owl",
        '<core:hasDurationModel rdf:resource="http://example.org/concertmaster/navigation.owl#Navigate_duration"/>',
        "",
    )
    with Fleet.open("tue_lab", knowledge=knowledge) as fleet:
        plan, _ = fleet.plan("FindEmptyDrink", room="kitchen")
        assert plan.solved
        [place] = plan.waits_for
        assert place.endswith("/blocked")
        assert "give the composite process that goes on by it a hasDurationModel" in plan.reason


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (">/compute/vel_cmd<", ">/compute/vel_cmdx<", "VelCmd, field VelCmd_service: there is no /compute/vel_cmdx"),
        (">/{robot}/kinect<", ">/{robot}/camera<", "amigo_1 offers no service /amigo_1/camera"),
        (">hue_file<", ">hues<", "/compute/detection takes the fields"),
    ],
)
def test_a_grounding_that_cannot_work_is_refused_before_anything_moves(
    knowledge: Path, edit: Edit, old: str, new: str, told: str
) -> None:
    """A service that does not exist, or does not take the field, is named when the fleet is opened."""
    edit(knowledge / "tasks" / "groundings.owl", old, new)
    with pytest.raises(GroundingError) as caught:
        Fleet.open("tue_lab", knowledge=knowledge)
    assert told in str(caught.value)
