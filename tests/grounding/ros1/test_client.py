"""The transport over ROS 1, with a robot of another process and a master that comes and goes.

What holds for every transport is in tests/contracts.
"""

from __future__ import annotations

import gc
import subprocess
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from grounding.actions import Goal, GoalResult, GoalStatus
from grounding.messages import LaserScan, header
from grounding.ros1 import goals
from grounding.ros1.client import Ros1Transport
from grounding.ros1.node import BadMaster, Master
from grounding.rosbridge.types import ServiceType, Types
from grounding.rosbridge.values import BadValue
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import WallClock
from tests.contracts.ros_master import HOST, RosMaster, until

# rospy leaves sockets to the garbage collector; `transport` sees to it that it comes before the next test.
pytestmark = [pytest.mark.ros1, pytest.mark.filterwarnings("ignore:unclosed <socket:ResourceWarning")]

WAIT_S = 30.0
_TEST = "int32 goal\n---\nint32 result\n---\nint32 feedback"


@contextmanager
def _robot(master: RosMaster) -> Iterator[subprocess.Popen[str]]:
    """A robot that is ready."""
    command = ["/usr/bin/python3", str(Path(__file__).with_name("stock_robot.py"))]
    with subprocess.Popen(
        command, env={**master.environment, "PYTHONPATH": ""}, stdout=subprocess.PIPE, text=True
    ) as robot:
        try:
            assert robot.stdout is not None
            assert robot.stdout.readline() == "ready\n"
            yield robot
        finally:
            robot.kill()


@pytest.fixture
def robot(ros_master: RosMaster) -> Iterator[subprocess.Popen[str]]:
    """A robot of its own for each test: to a second one of its name ROS ends the first."""
    with _robot(ros_master) as made:
        yield made


@pytest.fixture
def clock() -> Iterator[WallClock]:
    """A clock that stops a test which waits for what does not come."""
    made = WallClock()
    stuck = threading.Timer(2 * WAIT_S, lambda: made.post(_give_up))
    stuck.start()
    yield made
    stuck.cancel()
    stuck.join()


def _give_up() -> None:
    raise AssertionError("the transport waits for something that does not come")


@pytest.fixture
def transport(ros_master: RosMaster, clock: WallClock) -> Iterator[Ros1Transport]:
    """Connected, with the types of the robot's services and of some that it does not have."""
    types = Types()
    trigger, set_bool = types.service("std_srvs/Trigger"), types.service("std_srvs/SetBool")
    services: Mapping[str, ServiceType] = {
        "/robot/trigger": trigger,
        "/robot/hang": trigger,
        "/robot/set": set_bool,
        "/robot/none": trigger,
        "/ours": set_bool,
    }
    action = types.action(types.add("action", "actionlib/Test", _TEST))
    actions = {"/robot/test": action, "/robot/refuse": action, "/robot/nothing": action}
    master = Master(uri=ros_master.uri, host=HOST)
    with Ros1Transport(master, clock, services=services, actions=actions, types=types) as made:
        assert made.wait_connected(WAIT_S), made.problem
        yield made
    gc.collect()


class _Caller:
    """Makes calls, one after the other."""

    def __init__(self, transport: Ros1Transport, clock: WallClock) -> None:
        self._transport, self._clock = transport, clock
        self.calls: list[ServiceCall] = []
        self.replies: list[ServiceReply] = []

    def send(self, service: str, fields: Mapping[str, object], timeout_s: float = WAIT_S) -> None:
        self.calls.append(ServiceCall(id=len(self.calls), service=service, fields=fields, timeout_s=timeout_s))
        self._transport.call(self.calls[-1], self.replies.append)

    def __call__(self, service: str, /, **fields: object) -> ServiceReply:
        self.send(service, fields)
        self._clock.run_until(lambda: len(self.replies) == len(self.calls))
        return self.replies[-1]


@pytest.fixture
def call(transport: Ros1Transport, clock: WallClock) -> _Caller:
    """Calls a service and waits for the reply."""
    return _Caller(transport, clock)


def _scan(distance_m: float) -> LaserScan:
    return LaserScan(
        header=header("laser", 1.0),
        angle_min=0.0,
        angle_max=0.0,
        angle_increment=0.0,
        time_increment=0.0,
        scan_time=0.0,
        range_min=0.0,
        range_max=9.0,
        ranges=np.array([distance_m], np.float32),
        intensities=np.array([], np.float32),
    )


# ---------------------------------------------------------------------------------------- services


@pytest.mark.usefixtures("robot")
def test_services_of_a_robot_are_called(call: _Caller) -> None:
    """Also again, over the same connection, and after a refusal, which comes with its class."""
    assert call("/robot/trigger").fields == {"success": True, "message": "ok"}
    refused = call("/robot/set", data=False)
    assert (refused.failure, refused.reason) == ("BaseMoves", "stop first")
    assert call("/robot/set", data=True).fields == {"success": True, "message": "set"}


@pytest.mark.usefixtures("robot")
def test_a_service_that_is_not_there_is_named(call: _Caller) -> None:
    """Beside those that there are, whether we have a type for it or not."""
    for service in ("/robot/none", "/robot/other"):
        reply = call(service)
        assert reply.failure == "NoSuchService"
        assert reply.reason.startswith(f"there is no service {service}; there is ")
        assert "/robot/trigger" in reply.reason


@pytest.mark.usefixtures("robot")
def test_a_service_of_another_type_is_told(ros_master: RosMaster, clock: WallClock) -> None:
    """ROS compares the sums of the types before anything is sent."""
    types = Types()
    services = {"/robot/set": types.service("std_srvs/Trigger")}
    with Ros1Transport(Master(uri=ros_master.uri), clock, services=services, types=types) as transport:
        assert transport.wait_connected(WAIT_S)
        reply = _Caller(transport, clock)("/robot/set")
    assert reply.failure == "BadRequest"
    assert "md5sums do not match" in reply.reason


@pytest.mark.usefixtures("robot")
def test_values_that_are_wrong_are_not_sent(call: _Caller) -> None:
    """The field is named."""
    reply = call("/robot/set", data="yes")
    assert reply.failure == "BadRequest"
    assert "data is 'yes'" in reply.reason


@pytest.mark.usefixtures("robot")
def test_a_service_that_hangs_is_forgotten_after_its_time(call: _Caller, clock: WallClock) -> None:
    """Nothing waits on, and the next call has a connection of its own."""
    call.send("/robot/hang", {}, timeout_s=0.3)
    assert not clock.run_until(lambda: False)
    assert call.replies == []
    until(clock, lambda: _threads_of("/robot/hang") == 0, WAIT_S, "the thread of the connection is still there")


def _threads_of(service: str) -> int:
    return sum(thread.name == f"ros1 {service}" for thread in threading.enumerate())


def test_a_robot_that_dies_answers_lost_and_serves_again_when_it_is_back(
    ros_master: RosMaster, call: _Caller, clock: WallClock
) -> None:
    """The call under way at once; later ones too, as long as the master believes that it is there."""
    with _robot(ros_master) as first:
        assert call("/robot/trigger").failure == ""
        call.send("/robot/hang", {})
        until(clock, lambda: _threads_of("/robot/hang") == 1, WAIT_S, "the call is not made")
        first.kill()
        clock.run_until(lambda: len(call.replies) == len(call.calls))
        assert call.replies[-1].failure == "Lost"
        assert call("/robot/trigger").failure == "Lost"
    with _robot(ros_master):
        assert call("/robot/trigger").failure == ""


def test_a_connection_that_ended_between_two_calls_is_made_again(ros_master: RosMaster, call: _Caller) -> None:
    """Whoever calls does not notice that the robot was restarted."""
    with _robot(ros_master):
        assert call("/robot/trigger").failure == ""
    with _robot(ros_master):
        assert call("/robot/trigger").failure == ""


def test_what_is_under_way_at_the_end_is_lost(
    ros_master: RosMaster, transport: Ros1Transport, call: _Caller, clock: WallClock
) -> None:
    """And so is what is called after it."""
    with _robot(ros_master):
        call.send("/robot/hang", {})
        transport.close()
        call.send("/robot/hang", {})
        assert not clock.run_until(lambda: False)
    assert [reply.failure for reply in call.replies] == ["Lost", "Lost"]


# ------------------------------------------------------------------------------------------ topics


@pytest.mark.usefixtures("robot")
def test_topics_go_there_and_back(transport: Ros1Transport, clock: WallClock) -> None:
    """What we say is heard, what the robot says is taken, and no more when the topic is left."""
    taken: list[object] = []
    subscription = transport.subscribe("/robot/echo", "sensor_msgs/LaserScan", taken.append)
    transport.advertise("/robot/scan", "sensor_msgs/LaserScan", latch=True)
    until(clock, lambda: transport.publish("/robot/scan", _scan(1.5)) and bool(taken), WAIT_S, "nothing comes back")
    assert isinstance(taken[0], LaserScan)
    assert taken[0] == subscription.newest
    assert taken[0].ranges.tolist() == [1.5]
    assert subscription.age_s is not None
    transport.unsubscribe("/robot/echo")
    transport.unadvertise("/robot/scan")
    assert not clock.run_until(lambda: False)


def test_messages_of_another_type_are_not_sent(transport: Ros1Transport) -> None:
    """They would be read as something else; and a topic has one type."""
    transport.advertise("/robot/scan", "sensor_msgs/LaserScan")
    with pytest.raises(BadValue, match="is std_msgs/msg/Header, /robot/scan has sensor_msgs/msg/LaserScan"):
        transport.publish("/robot/scan", header("map", 0.0))
    transport.unadvertise("/robot/scan")


# ----------------------------------------------------------------------------------------- actions


class _Sender:
    """Sends a goal and waits for its end."""

    def __init__(self, transport: Ros1Transport, clock: WallClock) -> None:
        self._transport, self._clock, self._sent = transport, clock, 0
        self.feedback: list[Mapping[str, object]] = []
        self.results: list[GoalResult] = []

    def __call__(self, action: str, goal: object, then: Callable[[int], None] = lambda goal_id: None) -> GoalResult:
        """Send a goal; `then` is told its id at the first feedback."""
        self._sent += 1
        number = self._sent

        def feedback(fields: Mapping[str, object]) -> None:
            self.feedback.append(fields)
            then(number)

        self._transport.send_goal(Goal(id=number, action=action, fields={"goal": goal}), feedback, self.results.append)
        self._clock.run_until(lambda: len(self.results) == number)
        assert self.results[-1].goal_id == number
        return self.results[-1]


@pytest.fixture
def send(transport: Ros1Transport, clock: WallClock) -> _Sender:
    """Sends goals."""
    return _Sender(transport, clock)


@pytest.mark.usefixtures("robot")
def test_a_goal_brings_feedback_and_a_result(send: _Sender) -> None:
    """One that fails says why, in the words of the action."""
    done = send("/robot/test", 4)
    assert (done.status, done.fields, done.failure, done.reason) == (GoalStatus.SUCCEEDED, {"result": 4}, "", "")
    assert send.feedback == [{"feedback": 5}]
    failed = send("/robot/test", 5)
    assert (failed.status, failed.fields) == (GoalStatus.ABORTED, {"result": 5})
    assert (failed.failure, failed.reason) == ("NoPath", "there is a wall")
    refused = send("/robot/refuse", 1)
    assert (refused.status, refused.failure, refused.reason) == (GoalStatus.ABORTED, "Busy", "not now")


@pytest.mark.usefixtures("robot")
def test_a_goal_is_canceled(transport: Ros1Transport, send: _Sender) -> None:
    """It has a result all the same; canceling once more does nothing."""
    canceled = send("/robot/test", -5, transport.cancel_goal)
    assert (canceled.status, canceled.fields, canceled.failure) == (GoalStatus.CANCELED, {"result": -1}, "Canceled")
    transport.cancel_goal(canceled.goal_id)
    assert send("/robot/test", 2).failure == ""


@pytest.mark.usefixtures("robot")
def test_a_goal_is_not_lost_while_the_clock_stands_still(
    transport: Ros1Transport, send: _Sender, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A planner may keep its thread for longer than silence is allowed to last."""
    monkeypatch.setattr(goals, "LOST_S", 0.7)

    def think_then_cancel(goal_id: int) -> None:
        elsewhere = WallClock()
        until(elsewhere, lambda: elsewhere.now_s > 1.5, WAIT_S, "time stands still")
        transport.cancel_goal(goal_id)

    assert send("/robot/test", -5, think_then_cancel).failure == "Canceled"


def test_a_goal_without_a_server_ends(send: _Sender) -> None:
    """Both where we know no type and where nobody answers; a wrong value is told before."""
    assert send("/robot/unheard_of", 1).failure == "NoSuchAction"
    assert send("/robot/nothing", 1).failure == "NoSuchAction"
    assert send("/robot/nothing", "far").failure == "BadRequest"


def test_a_goal_whose_robot_dies_is_lost(ros_master: RosMaster, send: _Sender) -> None:
    """Silence is what tells."""
    with _robot(ros_master) as dying:
        lost = send("/robot/test", -5, lambda goal_id: dying.kill())
    assert (lost.status, lost.failure) == (GoalStatus.UNKNOWN, "Lost")


# ------------------------------------------------------------------------------------------ master


def test_without_a_master_nothing_hangs_and_with_a_new_one_everything_is_there_again(
    ros_master: RosMaster, transport: Ros1Transport, call: _Caller, clock: WallClock
) -> None:
    """Connections that exist go on; what has to be looked up is lost. What we offer, the new master knows."""
    types = Types()
    told: list[Mapping[int, bool | None]] = []
    transport.offer("/ours", types.service("std_srvs/SetBool"), lambda fields: {"success": fields["data"]})
    until(clock, lambda: call("/ours", data=True).failure == "", WAIT_S, "our service is not offered")
    ros_master.stop()
    try:
        until(clock, lambda: not transport.connected, WAIT_S, "the loss is not noticed")
        assert "does not answer" in transport.problem
        assert call("/ours", data=True).fields == {"success": True, "message": ""}
        assert call("/robot/trigger").failure == "Lost"
        transport.reconcile(call.calls[-1:], told.append)
        clock.run_until(lambda: bool(told))
        assert told.pop() == {call.calls[-1].id: False}
    finally:
        ros_master.start()
    assert transport.wait_connected(WAIT_S)

    def offered() -> bool:
        transport.reconcile(call.calls[-2:], told.append)
        clock.run_until(lambda: bool(told))
        return told.pop() == {call.calls[-2].id: True, call.calls[-1].id: False}

    until(clock, offered, WAIT_S, "the new master does not know our service")
    transport.withdraw("/ours")


def test_a_process_has_one_master(transport: Ros1Transport, clock: WallClock) -> None:
    """Another is refused, and so is what is no address of one."""
    assert transport.connected
    with pytest.raises(BadMaster, match="one node for each process"):
        Ros1Transport(Master(uri="http://127.0.0.1:1"), clock, services={}, types=Types())
    for uri in ("", "127.0.0.1:11311", "http://127.0.0.1", "http://:11311", "http://robot:port"):
        with pytest.raises(BadMaster, match="is no address of a master"):
            Ros1Transport(Master(uri=uri), clock, services={}, types=Types())
