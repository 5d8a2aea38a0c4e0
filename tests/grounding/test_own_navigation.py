"""The navigation of a robot itself, in a simulated lab."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping

import pytest

from grounding.actions import Goal, GoalResult, GoalStatus
from grounding.inprocess import InProcessTransport
from grounding.messages import Odometry, PoseStamped, Twist, Vector3, planar_pose, pose_stamped, xyyaw
from grounding.own_navigation import OwnNavigation
from kb.clock import SimClock
from sim.fleet import SimFleet
from sim.scenario import load_scenario
from tests.grounding.rosbridge.fleet import MEASURES, STARTS

ACTION = "/amigo_1/navigate_to_pose"


class Robot:
    """A robot with its navigation, and what has come of its goals."""

    def __init__(self, clock: SimClock, fleet: SimFleet) -> None:
        self.clock, self.fleet = clock, fleet
        self.slip = 0.0
        self.fed: list[Mapping[str, object]] = []
        self.results: list[GoalResult] = []
        services = fleet.services()
        navigation = OwnNavigation(
            MEASURES,
            clock,
            laser=services["/amigo_1/laser"].handler,
            base=services["/amigo_1/base"].handler,
            odometry=self._odometry,
            told=pose_stamped(*STARTS["amigo_1"], t_s=0.0),
        )
        self.transport = InProcessTransport(clock)
        self.transport.offer_action(ACTION, navigation.start)
        self.navigation = navigation

    def _odometry(self) -> Odometry:
        """What the wheels tell, which slip for a part of each meter."""
        told = self.fleet.odometry("amigo_1")
        x_m, y_m, yaw_rad = xyyaw(told.pose.pose)
        pose = planar_pose(x_m * (1.0 - self.slip), y_m * (1.0 - self.slip), yaw_rad)
        return dataclasses.replace(told, pose=dataclasses.replace(told.pose, pose=pose))

    def go(self, number: int, x_m: float, y_m: float, yaw_rad: float = 0.0, frame_id: str = "map") -> None:
        """Give it a goal."""
        pose = pose_stamped(x_m, y_m, yaw_rad, t_s=self.clock.now_s, frame_id=frame_id)
        goal = Goal(id=number, action=ACTION, fields={"pose": pose})
        self.transport.send_goal(goal, self.fed.append, self.results.append)

    def until(self, done: Callable[[], bool]) -> None:
        """Let time pass."""
        assert self.clock.run_until(done)

    def let_pass(self, seconds: float) -> None:
        """Let some time pass."""
        over: list[bool] = []
        self.clock.call_at(self.clock.now_s + seconds, lambda: over.append(True))
        self.until(lambda: bool(over))

    @property
    def pose(self) -> tuple[float, float, float]:
        """Where it truly is."""
        return self.fleet.true_pose("amigo_1")


@pytest.fixture
def robot() -> Iterator[Robot]:
    """In the lab, where it is told to be."""
    clock = SimClock()
    with SimFleet(load_scenario("tue_lab"), starts=STARTS, clock=clock) as fleet:
        yield Robot(clock, fleet)


def test_it_drives_to_a_pose_and_tells_how_far_it_has_come(robot: Robot) -> None:
    """Feedback ten times a second, with poses that are true; it arrives within what the base's controller keeps."""
    robot.go(1, 2.0, 1.5, 1.0)
    robot.until(lambda: bool(robot.results))
    [result] = robot.results
    assert (result.status, result.fields) == (GoalStatus.SUCCEEDED, {"error_code": 0, "error_msg": ""})
    assert math.dist(robot.pose[:2], (2.0, 1.5)) < 0.1
    assert abs(math.remainder(robot.pose[2] - 1.0, math.tau)) < 0.1
    left = [float(str(fields["distance_remaining"])) for fields in robot.fed]
    assert left[0] > 0.9
    assert left[-1] < 0.1
    assert len(robot.fed) == pytest.approx(10.0 * robot.clock.now_s, abs=2)
    told = robot.fed[-1]["current_pose"]
    assert isinstance(told, PoseStamped)
    assert math.dist((told.pose.position.x, told.pose.position.y), robot.pose[:2]) < 0.1
    assert robot.fleet.collisions == 0


def test_a_canceled_goal_stops_it(robot: Robot) -> None:
    """At once, but for what its brakes need."""
    robot.go(1, 4.0, 1.5)
    robot.let_pass(2.0)
    robot.transport.cancel_goal(1)
    robot.let_pass(0.8)
    [result] = robot.results
    there = robot.pose
    robot.let_pass(1.0)
    assert (result.status, result.failure) == (GoalStatus.CANCELED, "Canceled")
    assert math.dist(there[:2], robot.pose[:2]) < 0.01


def test_a_new_goal_takes_the_place_of_the_one_that_it_drives_to(robot: Robot) -> None:
    """As in Nav2, the old one is aborted."""
    robot.go(1, 4.0, 1.5)
    robot.let_pass(1.0)
    robot.go(2, 1.5, 1.2)
    robot.until(lambda: len(robot.results) == 2)
    old, new = robot.results
    assert (old.goal_id, old.status, old.fields["error_code"]) == (1, GoalStatus.ABORTED, 1)
    assert (new.goal_id, new.status) == (2, GoalStatus.SUCCEEDED)


@pytest.mark.parametrize(
    ("x_m", "frame_id", "code"), [(-50.0, "map", 208), (2.0, "odom", 9002), (math.nan, "map", 9002)]
)
def test_where_it_cannot_go_it_says_why(x_m: float, frame_id: str, code: int, robot: Robot) -> None:
    """By a code of Nav2; it does not move."""
    robot.go(1, x_m, 1.5, frame_id=frame_id)
    robot.let_pass(0.5)
    [result] = robot.results
    assert (result.status, result.fields["error_code"]) == (GoalStatus.ABORTED, code)
    assert result.fields["error_msg"]
    assert robot.fed == []


@pytest.mark.parametrize("is_seen", [True, False])
def test_it_knows_where_others_have_driven_it(is_seen: bool, robot: Robot) -> None:
    """It sees the scans that they take; its wheels, which slip, would bring it to a wrong place."""
    robot.slip = 0.2
    services, away_rad = robot.fleet.services(), 0.165 - STARTS["amigo_1"][2]
    forward, left = 0.5 * math.cos(away_rad), 0.5 * math.sin(away_rad)
    velocity = Twist(linear=Vector3(x=forward, y=left, z=0.0), angular=Vector3(x=0.0, y=0.0, z=0.0))
    for _ in range(55):
        services["/amigo_1/base"].handler({"velocity": velocity})
        robot.let_pass(0.1)
        (robot.navigation.scan if is_seen else services["/amigo_1/laser"].handler)({})
    assert robot.fleet.collisions == 0
    robot.go(1, 2.0, 1.5)
    robot.until(lambda: bool(robot.results))
    arrived = robot.results[0].status is GoalStatus.SUCCEEDED and math.dist(robot.pose[:2], (2.0, 1.5)) < 0.1
    assert arrived is is_seen, robot.results[0].fields
