"""The executive and robots in another process, over ROS 1, in real time."""

from __future__ import annotations

import gc
import math
from pathlib import Path

import pytest

from executive import Fleet
from executive.trace import PlanMade
from grounding.errors import GroundingError
from tests.contracts.ros_master import RosMaster
from tests.scenarios.conftest import ROBOTS, Edit
from tests.scenarios.laser_topic import ground_laser_in_topic
from tests.scenarios.test_over_rosbridge import LASER, SAME_PLACE_M, both_found, found, served

pytestmark = pytest.mark.ros1


def test_a_task_is_the_same_over_ros_1(ros_master: RosMaster) -> None:
    """Assignment, actions and what is found; only times differ."""
    with Fleet.open("tue_lab") as fleet:
        there, trace = both_found(fleet)
    robots = served("--ros1", ros_master.uri, environment=ros_master.environment)
    with robots, Fleet.open("tue_lab", connect=ros_master.uri) as fleet:
        remote, remote_trace = both_found(fleet)
    assert found(remote_trace) == found(trace)
    plan, remote_plan = (next(e for e in events if isinstance(e, PlanMade)) for events in (trace, remote_trace))
    assert [step[:2] for step in remote_plan.steps] == [step[:2] for step in plan.steps]
    for drink, position in there.outputs["position"].items():
        other = remote.outputs["position"][drink].point
        assert math.dist((position.point.x, position.point.y), (other.x, other.y)) < SAME_PLACE_M


@pytest.mark.filterwarnings("ignore:unclosed <socket:ResourceWarning")  # rospy leaves sockets to the collector
def test_scans_are_heard_over_ros_1(ros_master: RosMaster, knowledge: Path) -> None:
    """The same task with the laser read from a topic, which each robot is asked for once."""
    ground_laser_in_topic(knowledge, max_age_s=0.5)
    robots = served("--ros1", ros_master.uri, environment=ros_master.environment)
    with robots, Fleet.open("tue_lab", connect=ros_master.uri, knowledge=knowledge) as fleet:
        both_found(fleet)
        calls = {use.service: use.calls for use in fleet.metrics.uses()}
    gc.collect()
    for robot in ROBOTS:
        assert calls[f"/{robot}/scan"] >= calls[f"/{robot}/base"]
        assert f"/{robot}/laser" not in calls


def test_a_service_that_no_robot_offers_is_told_at_once(ros_master: RosMaster, knowledge: Path, edit: Edit) -> None:
    """Before anything moves, as the master tells what there is."""
    edit(knowledge / LASER, "/{robot}/laser<", "/{robot}/lidar<")
    with pytest.raises(GroundingError, match="offers no service /amigo_1/"):
        Fleet.open("tue_lab", connect=ros_master.uri, knowledge=knowledge)
