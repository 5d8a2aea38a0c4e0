"""The transport to ROS 2, with a robot of rclpy in a process of its own.

The contract of all transports (tests/contracts) is checked here with types that exist in ROS 2: it has none made of the
fields of groundings, and its services cannot fail.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from executive import Fleet
from executive.topic_readings import TopicReadings
from grounding.actions import Goal, GoalResult, GoalStatus
from grounding.messages import Image, LaserScan, PoseStamped, header, pose_stamped
from grounding.outcome import Outcome
from grounding.ros2.client import Ros2Transport
from grounding.ros2.installed import ros_2_python
from grounding.rosbridge.client import RosbridgeTransport
from grounding.rosbridge.connection import Endpoint
from grounding.rosbridge.types import Types
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import WallClock
from kb.errors import ConcertmasterError
from tests.contracts.ros2_graph import graph, stock_robot
from tests.contracts.ros_master import until
from tests.executive.topic_grounding import topic_grounding

pytestmark = pytest.mark.ros2

WAIT_S = 40.0
"""A node that dies without a word is missed after 20 s, the lease of Fast DDS."""

_BASIC = "string string_value\nint64 int64_value\nfloat64 float64_value"
_FIBONACCI = "int32 order\n---\nint32[] sequence\n---\nint32[] sequence"
_TRIGGERS = ("slow", "hang", "trigger", "crash", "none")


class _World:
    """A robot, and the transport to it.

    Attributes:
        replies: Of calls, in the order in which they came.
    """

    def __init__(self, clock: WallClock, transport: Ros2Transport) -> None:
        self.clock, self.transport = clock, transport
        self.replies: list[ServiceReply] = []
        self._count = 0

    def until(self, done: Callable[[], bool]) -> None:
        """Run the clock until something holds."""
        until(self.clock, done, WAIT_S, "it does not come")

    def send(self, service: str, fields: Mapping[str, object], timeout_s: float = WAIT_S) -> int:
        """Make a call; its number."""
        self._count += 1
        call = ServiceCall(id=self._count, service=f"/stock/{service}", fields=fields, timeout_s=timeout_s)
        self.transport.call(call, self.replies.append)
        return self._count

    def call(self, service: str, /, **fields: object) -> ServiceReply:
        """Make a call and wait for its reply."""
        number = self.send(service, fields)
        self.until(lambda: any(reply.call_id == number for reply in self.replies))
        return next(reply for reply in self.replies if reply.call_id == number)

    def start(self, order: int) -> tuple[int, list[Mapping[str, object]], list[GoalResult]]:
        """Send a goal; its number, and lists that feedback and result will come to."""
        self._count += 1
        fed: list[Mapping[str, object]] = []
        ended: list[GoalResult] = []
        goal = Goal(id=self._count, action="/stock/fibonacci", fields={"order": order})
        self.transport.send_goal(goal, fed.append, ended.append)
        return self._count, fed, ended

    def offered(self) -> list[str]:
        """The services that are there."""
        told: list[list[str]] = []
        self.transport.services(lambda names: told.append(list(names or ())))
        self.until(lambda: bool(told))
        return told[0]


@contextmanager
def _connected() -> Iterator[_World]:
    types, clock = Types(), WallClock()
    basic = types.service(types.add("srv", "test_msgs/BasicTypes", f"{_BASIC}\n---\n{_BASIC}"))
    set_bool, trigger = types.service("std_srvs/SetBool"), types.service("std_srvs/Trigger")
    services = {
        **{f"/stock/{name}": trigger for name in _TRIGGERS},
        "/stock/echo": basic,
        "/stock/last": set_bool,
        "/stock/nothing": set_bool,
        "/stock/plan": types.service("nav_msgs/GetPlan"),
    }
    actions = {"/stock/fibonacci": types.action(types.add("action", "test_msgs/Fibonacci", _FIBONACCI))}
    with Ros2Transport(
        clock, services=services, actions=actions, types=types, rng=np.random.default_rng(1)
    ) as transport:
        assert transport.wait_connected(WAIT_S), transport.problem
        yield _World(clock, transport)


@pytest.fixture(scope="module")
def world() -> Iterator[_World]:
    """One for the tests that leave it as it is: it takes seconds until all know each other."""
    with graph(), stock_robot(), _connected() as made:
        yield made


@pytest.fixture
def empty_graph() -> Iterator[None]:
    """Without the robot of the other tests."""
    with graph(1):
        yield


def test_a_reply_comes_later_once_and_whole(world: _World) -> None:
    """Every character and every bit; not within the call."""
    fields = {"string_value": "\u00e4\u4e2d", "int64_value": 2**63 - 1, "float64_value": float("-inf")}
    number = world.send("echo", fields)
    assert all(reply.call_id != number for reply in world.replies)
    world.until(lambda: any(reply.call_id == number for reply in world.replies))
    world.call("trigger")
    came = [reply for reply in world.replies if reply.call_id == number]
    assert came == [ServiceReply(call_id=number, fields=fields, failure="", reason="")]


def test_a_service_without_success_says_so_in_its_fields(world: _World) -> None:
    """ROS 2 has no other way."""
    reply = world.call("trigger")
    assert (reply.fields, reply.failure) == ({"success": False, "message": "the arm is folded"}, "")


def test_a_service_that_is_not_there_is_named(world: _World) -> None:
    """As by every transport."""
    reply = world.call("none")
    assert (reply.fields, reply.failure, reply.reason) == ({}, "NoSuchService", "there is no service /stock/none")


def test_a_service_of_another_type_is_a_bad_request(world: _World) -> None:
    """The field that it does not have is named."""
    reply = world.call("nothing", data=True)
    assert reply.failure == "BadRequest"
    assert "data" in reply.reason


def test_a_quicker_service_overtakes_a_slower_one(world: _World) -> None:
    """Replies are told apart by the id of the call."""
    slow, quick = world.send("slow", {}), world.send("trigger", {})
    world.until(lambda: any(reply.call_id == slow for reply in world.replies))
    assert [reply.call_id for reply in world.replies if reply.call_id in (slow, quick)] == [quick, slow]


def test_a_reply_after_the_time_allowed_is_not_delivered(world: _World) -> None:
    """It would answer what nobody asks any more."""
    number = world.send("slow", {}, timeout_s=0.1)
    world.call("slow")
    assert [r.failure for r in world.replies if r.call_id == number] in ([], ["TimedOut"])


def test_stamps_and_frames_are_those_of_the_sender(world: _World) -> None:
    """Also where the clocks disagree, and before 1970."""
    start = pose_stamped(1.0, 2.0, 0.5, t_s=1_700_000_000.25, frame_id="amigo_1/odom")
    goal = pose_stamped(3.0, 4.0, 0.0, t_s=-1.5, frame_id="")
    [plan] = world.call("plan", start=start, goal=goal, tolerance=0.5).fields.values()
    assert plan.poses == [start, goal]  # type: ignore[attr-defined]


def test_what_a_sensor_says_is_heard(world: _World) -> None:
    """It speaks as best it can, and is listened to so; no echo is infinity."""
    heard: list[LaserScan] = []
    world.transport.subscribe("/stock/scan", "sensor_msgs/LaserScan", heard.append)  # type: ignore[arg-type]
    world.until(lambda: len(heard) >= 3)
    world.transport.unsubscribe("/stock/scan")
    assert heard[0].header.frame_id == "stock/laser"
    assert (heard[0].header.stamp.sec, heard[0].header.stamp.nanosec) == (1_700_000_000, 250_000_000)
    expected = np.array([1.0, np.inf, np.nan, 0.1], dtype=np.float32)
    assert np.asarray(heard[0].ranges).tobytes() == expected.tobytes()


def test_a_reading_is_the_newest_message(world: _World) -> None:
    """By one subscription, as over every transport."""
    readings = TopicReadings(world.transport, world.clock)
    grounding = topic_grounding("sensor_msgs/LaserScan", output="scan", max_age_s=WAIT_S, timeout_s=WAIT_S)
    outcomes: list[Outcome] = []
    for number in (1, 2):
        call = ServiceCall(id=number, service="/stock/scan", fields={}, timeout_s=WAIT_S)
        readings.read(call, grounding, lambda outcome, fields: outcomes.append(outcome))
        world.until(lambda number=number: len(outcomes) == number)  # type: ignore[misc]
    assert all(isinstance(outcome.outputs["scan"], LaserScan) for outcome in outcomes)
    assert outcomes[1].elapsed_s < 1.0
    world.transport.unsubscribe("/stock/scan")


def test_what_was_said_and_kept_is_heard_by_who_comes_later(world: _World) -> None:
    """ROS 2 calls it transient local."""
    heard: list[object] = []
    world.transport.subscribe("/stock/kept", "std_msgs/String", heard.append)
    world.until(lambda: bool(heard))
    world.transport.unsubscribe("/stock/kept")
    assert heard[0].data == "said before you came"  # type: ignore[attr-defined]


def test_an_image_of_10_mb_goes_and_comes_back(world: _World) -> None:
    """Every byte, there over one topic and back over another."""
    image = Image(
        header=header("amigo_1/camera", 12.5),
        height=2000,
        width=2500,
        encoding="16UC1",
        is_bigendian=1,
        step=5000,
        data=np.random.default_rng(5).integers(0, 256, 10_000_000, dtype=np.uint8),
    )
    back = _echoed(world, "image", "sensor_msgs/Image", image)
    assert isinstance(back, Image)
    assert np.array_equal(back.data, image.data)
    assert (back.header, back.is_bigendian, back.step) == (image.header, 1, 5000)


def test_a_flood_of_images_takes_bounded_memory(world: _World) -> None:
    """Read by nobody for a while: old ones go, calls go on, and what comes at last is whole."""
    heard: list[Image] = []
    image = Image(
        header=header("amigo_1/camera", 12.5),
        height=1000,
        width=1000,
        encoding="mono8",
        is_bigendian=0,
        step=1000,
        data=np.arange(1_000_000, dtype=np.uint32).astype(np.uint8),
    )
    world.transport.subscribe("/stock/image_back", "sensor_msgs/Image", heard.append)  # type: ignore[arg-type]
    world.transport.advertise("/stock/image", "sensor_msgs/Image")
    world.call("slow")  # by then all are connected
    sent = sum(world.transport.publish("/stock/image", image) for _ in range(500))
    assert world.call("trigger").failure == ""
    world.until(lambda: bool(heard))
    assert sent > 0
    assert np.array_equal(heard[-1].data, image.data)
    assert _most_memory_bytes(_process_of(world.transport).pid) < 800e6
    world.transport.unsubscribe("/stock/image_back")
    world.transport.unadvertise("/stock/image")


def _most_memory_bytes(process: int) -> float:
    """The most that a process has had."""
    status = Path(f"/proc/{process}/status").read_text(encoding="utf-8")
    return 1000.0 * int(next(line.split()[1] for line in status.splitlines() if line.startswith("VmHWM:")))


def test_many_calls_at_once_are_all_answered(world: _World) -> None:
    """Each once."""
    numbers = [world.send("trigger", {}) for _ in range(300)]
    world.until(lambda: len([reply for reply in world.replies if reply.call_id in numbers]) == len(numbers))
    came = [reply for reply in world.replies if reply.call_id in numbers]
    assert sorted(reply.call_id for reply in came) == numbers
    assert {reply.failure for reply in came} == {""}


def test_a_pose_is_said_once_and_not_echoed_by_ourselves(world: _World) -> None:
    """What we say in ROS 2 is not heard as if another had said it."""
    own: list[object] = []
    world.transport.subscribe("/stock/pose", "geometry_msgs/PoseStamped", own.append)
    pose = pose_stamped(1.0, 2.0, 0.5, t_s=1.0, frame_id="map")
    back = _echoed(world, "pose", "geometry_msgs/PoseStamped", pose)
    world.transport.unsubscribe("/stock/pose")
    assert isinstance(back, PoseStamped)
    assert back == pose
    assert not own or own == [pose] * len(own)


def _echoed(world: _World, topic: str, kind: str, message: object) -> object:
    """What comes back over a topic: said until it does, as ROS 2 gives messages only to who is connected by then."""
    heard: list[object] = []
    world.transport.subscribe(f"/stock/{topic}_back", kind, heard.append)
    world.transport.advertise(f"/stock/{topic}", kind)
    said_s: list[float] = []

    def came() -> bool:
        if not heard and (not said_s or world.clock.now_s > said_s[-1] + 1.0):
            said_s.append(world.clock.now_s)
            assert world.transport.publish(f"/stock/{topic}", message)
        return bool(heard)

    world.until(came)
    world.transport.unsubscribe(f"/stock/{topic}_back")
    world.transport.unadvertise(f"/stock/{topic}")
    return heard[0]


def test_a_latched_word_reaches_who_listens_as_ever(world: _World) -> None:
    """Said right after the topic was made, before anybody is connected; kept for who wants what was kept."""
    types = Types()
    make = types.store.types["std_msgs/msg/String"]
    world.transport.advertise("/stock/kept_words", "std_msgs/String", latch=True)
    world.transport.publish("/stock/kept_words", make(data="first"))
    world.until(lambda: world.call("last", data=True).fields["message"] == "first")
    world.transport.unadvertise("/stock/kept_words")


def test_a_type_that_is_not_installed_is_told(world: _World) -> None:
    """Its name, and where it would have to be."""
    world.transport.subscribe("/tf", "tf2_msgs/TFMessage")
    expected = "BadRequest: type tf2_msgs/msg/TFMessage: is not installed in the environment of ROS 2 (tf2_msgs.msg)"
    world.until(lambda: getattr(world.transport.last_status, "msg", "") == expected)
    world.transport.unsubscribe("/tf")


def test_a_name_that_no_topic_can_have_is_told(world: _World) -> None:
    """And nothing else is disturbed."""
    world.transport.subscribe("/two words", "std_msgs/String")
    expected = "BadRequest: /two words of type std_msgs/msg/String cannot be a topic in ROS 2"
    world.until(lambda: getattr(world.transport.last_status, "msg", "") == expected)
    world.transport.unsubscribe("/two words")
    assert world.call("trigger").failure == ""


def test_a_type_of_our_own_is_none_of_ros_2(world: _World) -> None:
    """The server has it for rosapi alone."""
    world.transport.advertise("/ours", "rosapi_msgs/TypeDef")
    expected = "BadRequest: /ours of type rosapi_msgs/msg/TypeDef cannot be a topic in ROS 2"
    world.until(lambda: getattr(world.transport.last_status, "msg", "") == expected)
    world.transport.unadvertise("/ours")
    assert world.call("trigger").failure == ""


def test_all_installed_messages_are_read_but_those_that_differ() -> None:
    """In the bytes that rclpy writes; types with fields that are unknown here are refused, not misread."""
    reader = Path(__file__).with_name("read_all_types.py")
    roots = [str(Path(__file__).parents[3]), *(path for path in sys.path if path.endswith("site-packages"))]
    done = subprocess.run(
        [ros_2_python(), "-P", reader, *roots], capture_output=True, text=True, check=True, timeout=WAIT_S
    )
    assert done.stdout.splitlines() == [
        "type sensor_msgs/Range: has other fields in this version of ROS 2 than are known here",
        "type test_msgs/msg/WStrings: has a field of type test_msgs/wstring, which there is not",
        "132 read",
    ]


def test_a_goal_is_fed_and_succeeds(world: _World) -> None:
    """Feedback in order, the result last."""
    number, fed, ended = world.start(order=5)
    world.until(lambda: bool(ended))
    assert [len(f["sequence"]) for f in fed] == [3, 4, 5, 6, 7]  # type: ignore[arg-type]
    [result] = ended
    assert (result.goal_id, result.status, result.failure) == (number, GoalStatus.SUCCEEDED, "")
    assert list(result.fields["sequence"]) == [0, 1, 1, 2, 3, 5, 8]  # type: ignore[call-overload]


def test_a_goal_is_canceled(world: _World) -> None:
    """It ends as canceled, with what it has come to."""
    number, fed, ended = world.start(order=40)
    world.until(lambda: len(fed) >= 2)
    world.transport.cancel_goal(number)
    world.until(lambda: bool(ended))
    [result] = ended
    assert (result.status, result.failure) == (GoalStatus.CANCELED, "Canceled")
    assert len(result.fields["sequence"]) < 40  # type: ignore[arg-type]


def test_a_goal_is_canceled_before_it_is_taken(world: _World) -> None:
    """The cancellation follows once there is something to cancel."""
    number, _, ended = world.start(order=40)
    world.transport.cancel_goal(number)
    world.until(lambda: bool(ended))
    assert ended[0].status is GoalStatus.CANCELED


def test_a_goal_is_aborted_or_rejected(world: _World) -> None:
    """Aborted, it still has a result; rejected, a reason."""
    _, _, aborted = world.start(order=7)
    _, _, rejected = world.start(order=-1)
    world.until(lambda: bool(aborted and rejected))
    assert (aborted[0].status, aborted[0].failure) == (GoalStatus.ABORTED, "GoalFailed")
    assert len(aborted[0].fields["sequence"]) == 9  # type: ignore[arg-type]
    assert (rejected[0].failure, rejected[0].status) == ("Busy", GoalStatus.ABORTED)
    assert rejected[0].reason == "the action /stock/fibonacci has rejected the goal"


@pytest.mark.slow
def test_who_is_there_is_known_from_the_start(empty_graph: None) -> None:
    """Services of the robot, of rosapi, and none of our own node."""
    with stock_robot(), _connected() as world:
        names = world.offered()
    assert {"/stock/echo", "/stock/trigger"} <= set(names)
    assert {name.split("/")[1] for name in names} == {"stock", "stock_robot", "rosapi"}


def test_nobody_else_on_this_computer_is_served(world: _World) -> None:
    """The address alone is not enough."""
    clock, types = WallClock(), Types()
    told: list[object] = []
    uri = world.transport._bridge.uri
    with RosbridgeTransport(
        Endpoint(uri=uri), clock, services={}, types=types, rng=np.random.default_rng(1)
    ) as stranger:
        assert stranger.wait_connected(WAIT_S)
        stranger.services(told.append)
        until(clock, lambda: bool(told), WAIT_S, "it does not come")
    assert told == [None]


@pytest.mark.slow
def test_a_node_that_leaves_is_lost_and_may_come_back(empty_graph: None) -> None:
    """A call that it leaves without a reply is lost at once; with another robot of this name, calls go on."""
    with stock_robot() as robot, _connected() as world:
        hung = world.send("hang", {})
        world.call("trigger")  # comes after it: it hangs
        robot.send_signal(signal.SIGTERM)
        world.until(lambda: world.replies[-1].call_id == hung)
        reply = world.replies[-1]
        assert (reply.failure, reply.reason) == ("Lost", "who offered service /stock/hang is gone")
        with stock_robot():
            world.until(lambda: "/stock/trigger" in world.offered())
            assert world.call("trigger").failure == ""


@pytest.mark.slow
def test_a_node_that_dies_without_a_word_is_lost(empty_graph: None) -> None:
    """After the 20 s for which the others trust in it."""
    with stock_robot(), _connected() as world:
        _, fed, ended = world.start(order=1000)
        world.until(lambda: bool(fed))
        reply = world.call("crash")
        world.until(lambda: bool(ended))
    assert (reply.failure, reply.reason) == ("Lost", "who offered service /stock/crash is gone")
    assert (ended[0].failure, ended[0].reason) == ("Lost", "who offered action /stock/fibonacci is gone")


@pytest.mark.slow
def test_a_process_that_dies_loses_what_is_under_way(empty_graph: None) -> None:
    """At once, and calls after it too."""
    with stock_robot(), _connected() as world:
        hung = world.send("hang", {})
        os.kill(_process_of(world.transport).pid, signal.SIGKILL)
        world.until(lambda: bool(world.replies))
        late = world.call("trigger")
    assert [(reply.call_id, reply.failure) for reply in (world.replies[0], late)] == [(hung, "Lost"), (2, "Lost")]


_PARENT = """
import sys
import numpy as np
from grounding.actions import Goal
from grounding.ros2.client import Ros2Transport
from grounding.rosbridge.types import Types
from kb.clock import WallClock
types, clock, fed = Types(), WallClock(), []
action = types.action(types.add("action", "test_msgs/Fibonacci", sys.argv[1]))
robot = Ros2Transport(
    clock, services={}, actions={"/stock/fibonacci": action}, types=types, rng=np.random.default_rng(1)
)
robot.open()
robot.wait_connected(20.0)
robot.send_goal(Goal(id=1, action="/stock/fibonacci", fields={"order": 100000}), fed.append, print)
clock.run_until(lambda: bool(fed))
print(robot._bridge._process.pid, flush=True)
sys.stdin.read()
"""


@pytest.mark.slow
def test_the_process_ends_with_who_started_it_and_stops_the_robot(world: _World) -> None:
    """Also if that is killed: its goals are canceled, and nothing is left behind."""
    with subprocess.Popen(
        [sys.executable, "-c", _PARENT, _FIBONACCI], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        bridge = int(parent.stdout.readline())
        parent.kill()
    world.until(lambda: not _runs(bridge))
    world.until(lambda: "canceled" in str(world.call("last").fields["message"]))


@pytest.mark.slow
def test_a_process_that_is_coming_up_ends_with_who_started_it(empty_graph: None) -> None:
    """It is killed while it waits for the address."""
    clock = WallClock()
    with subprocess.Popen([sys.executable, "-c", _PARENT, _FIBONACCI], stdin=subprocess.PIPE) as parent:
        children = Path(f"/proc/{parent.pid}/task/{parent.pid}/children")
        until(clock, lambda: bool(children.read_text(encoding="utf-8")), WAIT_S, "it does not start")
        bridge = int(children.read_text(encoding="utf-8").split()[0])
        until(clock, lambda: b"grounding.ros2.bridge" in _command(bridge), WAIT_S, "it does not start")
        parent.kill()
    until(clock, lambda: not _runs(bridge), WAIT_S, "it does not end")


def _command(process: int) -> bytes:
    return Path(f"/proc/{process}/cmdline").read_bytes()


def _process_of(transport: Ros2Transport) -> subprocess.Popen[str]:
    return transport._bridge._process


def _runs(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text(encoding="utf-8")
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state.rpartition(")")[2].split()[0] != "Z"


@pytest.mark.slow
def test_it_ends_well(empty_graph: None) -> None:
    """By itself and without an abort, time after time; threads and sockets are gone."""
    before = threading.active_count()
    for _ in range(3):
        with _connected() as world:
            process = _process_of(world.transport)
        assert process.returncode == 0
    assert threading.active_count() == before


@pytest.mark.slow
def test_a_site_whose_robots_are_not_in_ros_2_is_told(empty_graph: None) -> None:
    """Which robot lacks which service; nothing begins."""
    with pytest.raises(ConcertmasterError, match=r"/(amigo|pico)_1/\w+"):
        Fleet.open("tue_lab", connect="ros2:")
