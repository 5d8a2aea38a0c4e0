"""A robot that is somewhere else than it believes finds out where it is, and goes on."""

from __future__ import annotations

import math

import pytest

from executive import Fleet, TaskStatus
from executive.trace import ActionFinished, FactsTold, RecoveryChosen
from grounding.messages import pose_stamped
from kb.terms import Fluent
from kb.vocabulary import Property

POSE = Property.HAS_POSE_ESTIMATE


@pytest.mark.slow
def test_a_robot_that_was_carried_away_finds_out_where_it_is() -> None:
    """Somebody has put it down meters from where it was: the scan does not fit, then it fits all of the map."""
    believed = pose_stamped(4.4, 1.9, -1.5708, t_s=0.0)
    with Fleet.open("tue_lab") as fleet:
        fleet.parts.shell.remember(Fluent(POSE, "pico_1"), believed)
        task = fleet.request("SearchDrink", robot="pico_1", area="tue_lab", drink="drink_2", location="at_dining_table")
        result = task.wait()
        assert result.status is TaskStatus.COMPLETED, result.reason
        chosen = [e for e in fleet.trace if isinstance(e, RecoveryChosen)]
        assert {(e.failure, e.recovery) for e in chosen} == {("LocalizationLost", "relocalize")}
        [found, *_] = [e for e in fleet.trace if isinstance(e, ActionFinished) and e.action.startswith("PoseAnywhere")]
        assert not found.failure
        *_, known = [
            e.value for e in fleet.trace if isinstance(e, FactsTold) and (e.prop, e.subject) == (POSE, "pico_1")
        ]
        assert isinstance(known, list)
        x_m, y_m, _ = fleet.parts.simulation.true_pose("pico_1")
        assert math.dist((x_m, y_m), known[:2]) < 0.1
