"""The simulated fleet behind a rosbridge server, in real time, with all that a client can use."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial

from executive.simulated_topics import offer_topics
from grounding.actions import GoalStatus
from grounding.messages import pose_stamped
from grounding.own_navigation import OWN_NAVIGATION_TYPE, Measures, OwnNavigation
from grounding.rosbridge.hub import Hub
from grounding.rosbridge.hub_actions import RunningGoal
from grounding.rosbridge.policy import Policy
from grounding.rosbridge.server import Server, serve
from kb.clock import SimClock
from kb.errors import ServiceFailed
from kb.files import SHIPPED
from sim.fleet import SimFleet
from sim.scenario import load_scenario

STARTS = {"amigo_1": (1.0, 1.0, 0.8), "pico_1": (9.0, 1.0, 2.3)}
MEASURES = Measures(
    loc_map_file=SHIPPED / "sites" / "tue_lab" / "locMap.yaml",
    nav_map_file=SHIPPED / "sites" / "tue_lab" / "navMap.yaml",
    radius_m=0.35,
    max_vel_lin_mps=0.7,
    max_vel_ang_radps=1.2,
    laser_x_m=0.2,
    laser_y_m=0.0,
    laser_yaw_rad=0.0,
)
"""Of an Amigo."""
FIELDS: Mapping[str, tuple[Mapping[str, str], Mapping[str, str]]] = {
    "laser": ({}, {"scan": "sensor_msgs/LaserScan"}),
    "base": ({"velocity": "geometry_msgs/Twist"}, {"odometry": "nav_msgs/Odometry"}),
    "kinect": (
        {},
        {"color": "sensor_msgs/Image", "depth": "sensor_msgs/Image", "camera_info": "sensor_msgs/CameraInfo"},
    ),
    "load": ({"object": "string"}, {}),
    "unload": ({}, {}),
}
COUNT_STEP_S = 0.1


class Fibonacci:
    """The action that everybody tries first: one number in each step, until it has them or is canceled."""

    def __init__(self, clock: SimClock) -> None:
        self._clock = clock

    def start(self, goal: RunningGoal) -> None:
        """Begin; orders below 0 are refused."""
        order = goal.fields["order"]
        assert isinstance(order, int)
        if order < 0:
            raise ServiceFailed("BadOrder", f"order is {order}, should be 0 or more")
        sequence = [0, 1]
        running = True

        def canceled() -> None:
            nonlocal running
            running = False
            goal.end(GoalStatus.CANCELED, {"sequence": sequence})

        def step() -> None:
            if not running:
                return
            if len(sequence) > order:
                goal.end(GoalStatus.SUCCEEDED, {"sequence": sequence})
                return
            sequence.append(sequence[-1] + sequence[-2])
            goal.feed({"sequence": sequence})
            self._clock.call_at(self._clock.now_s + COUNT_STEP_S, step)

        goal.canceled = canceled
        self._clock.call_at(self._clock.now_s + COUNT_STEP_S, step)


@contextmanager
def fleet_server(policy: Policy | None = None) -> Iterator[tuple[Server, SimFleet]]:
    """The robots of the tue_lab scenario: services, topics, own navigation, and the action /fibonacci."""
    clock = SimClock()
    with SimFleet(load_scenario("tue_lab"), starts=STARTS, clock=clock) as fleet:
        hub = Hub(clock, policy=policy)
        services = fleet.services()
        for name, service in services.items():
            request, reply = FIELDS[name.rpartition("/")[2]]
            hub.offer_service(name, request, reply, service.handler, service.latency_s)
        hub.actions.offer("/fibonacci", "example_interfaces/action/Fibonacci", Fibonacci(clock).start)

        for robot, pose in STARTS.items():
            navigation = OwnNavigation(
                MEASURES,
                clock,
                laser=services[f"/{robot}/laser"].handler,
                base=services[f"/{robot}/base"].handler,
                odometry=partial(fleet.odometry, robot),
                told=pose_stamped(*pose, t_s=0.0),
            )
            hub.actions.offer(f"/{robot}/navigate_to_pose", OWN_NAVIGATION_TYPE, navigation.start)
        offer_topics(
            hub.topics, clock, STARTS, {name: service.handler for name, service in services.items()}, fleet.odometry
        )
        with serve(hub, clock) as server:
            yield server, fleet
