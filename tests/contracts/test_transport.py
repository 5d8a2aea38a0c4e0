"""What every transport keeps to, whatever carries its calls."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pytest

from grounding.inprocess import Handler, InProcessTransport, Service
from grounding.messages import Image, LaserScan, PoseStamped, header, pose_stamped
from grounding.ros1.client import Ros1Transport
from grounding.ros1.node import Master, Node
from grounding.ros1.services import Services
from grounding.ros1.wire import Wire
from grounding.rosbridge.client import RosbridgeTransport
from grounding.rosbridge.connection import Endpoint
from grounding.rosbridge.framing import Limits
from grounding.rosbridge.hub import Hub
from grounding.rosbridge.policy import Allowance, Policy
from grounding.rosbridge.server import serve
from grounding.rosbridge.types import ServiceType, Types
from grounding.transport import ServiceCall, ServiceReply, Transport
from kb.clock import Clock, SimClock, WallClock
from kb.errors import ServiceFailed
from tests.contracts.far_end import FarEnd
from tests.contracts.ros_master import HOST, RosMaster

WAIT_S = 20.0
SLACK_S = 5.0
"""How late a real reply may be on a machine that is busy."""

TEXT_AND_NUMBER = {"text": "string", "number": "int64"}
SCAN = {"scan": "sensor_msgs/LaserScan"}
IMAGE = {"image": "sensor_msgs/Image"}
POSE = {"pose": "geometry_msgs/PoseStamped"}
DOOR = {"door": "string"}

TYPES: Mapping[str, tuple[Mapping[str, str], Mapping[str, str]]] = {
    "/echo": (TEXT_AND_NUMBER, TEXT_AND_NUMBER),
    "/broken": (TEXT_AND_NUMBER, TEXT_AND_NUMBER),
    "/quick": ({}, {}),
    "/look": ({}, DOOR),
    "/scan": (SCAN, SCAN),
    "/image": (IMAGE, IMAGE),
    "/pose": (POSE, POSE),
}
"""Types of the fields of request and reply, which some transports have to know."""


Offer = Callable[[str, Handler, float], None]


@dataclass(kw_only=True)
class Setup:
    """A transport under test.

    Attributes:
        offer: Makes a service known at the far end: name, handler, latency in seconds.
        late_s: How much later than said a reply may come.
        has_infinity: Whether infinity arrives; in the texts of rosbridge it is null, as is NaN.
        lists_services: Whether the far end tells what it offers.
        keeps_order: Whether replies of one time come in the order of their calls: not where each has a connection.
        began_s: Time at which the test begins.
    """

    clock: Clock
    transport: Transport
    offer: Offer
    late_s: float
    has_infinity: bool = True
    keeps_order: bool = True
    lists_services: bool = True
    began_s: float = field(init=False)

    def __post_init__(self) -> None:
        self.began_s = self.clock.now_s

    def at(self, t_s: float, callback: Callable[[], None]) -> None:
        """Do something so many seconds after the test has begun."""
        self.clock.call_at(self.began_s + t_s, callback)

    def came_at(self, inbox: Inbox, *expected_s: float) -> bool:
        """Whether the replies came at these times after the test has begun: never early, little late."""
        assert len(inbox.times_s) == len(expected_s)
        delays = [t_s - self.began_s - due_s for t_s, due_s in zip(inbox.times_s, expected_s, strict=True)]
        return all(-1e-9 <= delay <= self.late_s for delay in delays)

    def let_all_happen(self) -> None:
        """Until nothing is left to happen."""
        assert not self.clock.run_until(lambda: False)


@contextmanager
def in_process() -> Iterator[Setup]:
    """Services are functions in this process, time is simulated."""
    clock = SimClock()
    transport = InProcessTransport(clock)
    yield Setup(
        clock=clock,
        transport=transport,
        offer=lambda name, handler, latency_s: transport.offer(name, Service(handler=handler, latency_s=latency_s)),
        late_s=0.0,
    )


@contextmanager
def rosbridge(*, binary: bool) -> Iterator[Setup]:
    """Services are behind our server, which goes by a clock of its own; time is real."""
    types, served = Types(), SimClock()
    known = _service_types(types)
    allowance = Allowance(frame=Limits(max_bytes=64_000_000))
    hub = Hub(served, types=types, policy=Policy(allowance=allowance))
    with serve(hub, served) as server:

        def offer(name: str, handler: Handler, latency_s: float) -> None:
            done = threading.Event()
            server.post(lambda: hub.services.offer(name, known[name].name, handler, latency_s))
            server.post(done.set)
            assert done.wait(WAIT_S)

        with _connected(server.uri, known, types, offer, binary=binary) as setup:
            yield setup


@contextmanager
def rosbridge_of_others() -> Iterator[Setup]:
    """Services are behind another server than ours, which takes texts."""
    types = Types()
    known = _service_types(types)
    with FarEnd(types) as far_end:

        def offer(name: str, handler: Handler, latency_s: float) -> None:
            far_end.offer(name, known[name], handler, latency_s)

        with _connected(far_end.uri, known, types, offer, binary=False) as setup:
            setup.lists_services = False
            yield setup


@contextmanager
def ros_1(master: RosMaster) -> Iterator[Setup]:
    """Services are behind rospy, which is also the client's: there is one node for each process."""
    types, clock, served = Types(), WallClock(), WallClock()
    known = _service_types(types)
    ended: list[bool] = []
    stop_listening = served.listen()
    thread = threading.Thread(target=lambda: served.run_until(lambda: bool(ended)), name="ros1 services")
    thread.start()
    with Ros1Transport(Master(uri=master.uri, host=HOST), clock, services=known, types=types) as transport:
        assert transport.wait_connected(WAIT_S), transport.problem
        node = Node(Master(uri=master.uri), complain=pytest.fail)
        node.open()
        services = Services(node, Wire(types), served.post, served)

        def offer(name: str, handler: Handler, latency_s: float) -> None:
            services.offer(name, known[name], handler, latency_s)
            done = threading.Event()
            node.do(done.set)
            assert done.wait(WAIT_S)

        with _watched(clock):
            yield Setup(clock=clock, transport=transport, offer=offer, late_s=SLACK_S, keeps_order=False)
        services.close()
        node.close()
    stop_listening()
    served.post(lambda: ended.append(True))
    thread.join()


def _service_types(types: Types) -> dict[str, ServiceType]:
    """By name of the service; the client knows also one that nobody offers."""
    known = {
        name: types.add_service_of(name.strip("/").capitalize(), request, reply)
        for name, (request, reply) in TYPES.items()
    }
    return {**known, "/eco": known["/echo"]}


@contextmanager
def _connected(
    uri: str, services: Mapping[str, ServiceType], types: Types, offer: Offer, *, binary: bool
) -> Iterator[Setup]:
    clock, rng = WallClock(), np.random.default_rng(1)
    with RosbridgeTransport(
        Endpoint(uri=uri), clock, services=services, types=types, binary=binary, rng=rng
    ) as transport:
        assert transport.wait_connected(WAIT_S), transport.problem
        with _watched(clock):
            yield Setup(clock=clock, transport=transport, offer=offer, late_s=SLACK_S, has_infinity=binary)


@contextmanager
def _watched(clock: WallClock) -> Iterator[None]:
    """A test that waits for what does not come fails, and does not wait on."""
    stuck = threading.Timer(60.0, lambda: clock.post(_give_up))
    stuck.start()
    yield
    stuck.cancel()
    stuck.join()


def _give_up() -> None:
    raise AssertionError("the transport waits for something that does not come")


TRANSPORTS: Mapping[str, Callable[[], AbstractContextManager[Setup]]] = {
    "in process": in_process,
    "rosbridge, binary": partial(rosbridge, binary=True),
    "rosbridge, text": partial(rosbridge, binary=False),
    "rosbridge of others": rosbridge_of_others,
}
ROS_1 = "ROS 1"


@pytest.fixture(params=[*TRANSPORTS, pytest.param(ROS_1, marks=pytest.mark.ros1)])
def setup(request: pytest.FixtureRequest) -> Iterator[Setup]:
    """Each transport in turn; the tests below hold for all."""
    with (
        ros_1(request.getfixturevalue("ros_master")) if request.param == ROS_1 else TRANSPORTS[request.param]() as made
    ):
        made.offer("/echo", dict, 0.025)
        made.offer("/broken", broken, 0.025)
        yield made


def broken(fields: Mapping[str, object]) -> Mapping[str, object]:
    """A service that fails."""
    raise ServiceFailed("DeviceBroken", "it smokes")


class Inbox:
    """Takes replies, and notes when they come."""

    def __init__(self, clock: Clock) -> None:
        self.replies: list[ServiceReply] = []
        self.times_s: list[float] = []
        self._clock = clock

    def __call__(self, reply: ServiceReply) -> None:
        self.replies.append(reply)
        self.times_s.append(self._clock.now_s)


def call(number: int, service: str, /, **fields: object) -> ServiceCall:
    """A call."""
    return ServiceCall(id=number, service=service, fields=fields, timeout_s=WAIT_S)


def test_the_reply_comes_later_once_and_on_the_clock(setup: Setup) -> None:
    """Not during the call: the caller has taken note of it before. It holds what the service said."""
    inbox = Inbox(setup.clock)
    setup.transport.call(call(7, "/echo", text="hello", number=3), inbox)
    assert inbox.replies == []
    setup.let_all_happen()
    assert inbox.replies == [ServiceReply(call_id=7, fields={"text": "hello", "number": 3}, failure="", reason="")]


def test_the_latency_is_honored(setup: Setup) -> None:
    """From the call to the reply, whenever the call is made; a failure takes as long as a success."""
    inbox = Inbox(setup.clock)
    setup.at(0.05, lambda: setup.transport.call(call(1, "/echo"), inbox))
    setup.at(0.2, lambda: setup.transport.call(call(2, "/broken"), inbox))
    setup.let_all_happen()
    assert setup.came_at(inbox, 0.075, 0.225)


def test_no_latency_is_still_later(setup: Setup) -> None:
    """At the time of the call, but not within it."""
    setup.offer("/quick", lambda fields: {}, 0.0)
    inbox = Inbox(setup.clock)
    setup.transport.call(call(1, "/quick"), inbox)
    assert inbox.replies == []
    setup.let_all_happen()
    assert setup.came_at(inbox, 0.0)


def test_a_failure_comes_through_with_its_code(setup: Setup) -> None:
    """As a reply, not as an exception."""
    inbox = Inbox(setup.clock)
    setup.transport.call(call(1, "/broken"), inbox)
    setup.let_all_happen()
    assert inbox.replies == [ServiceReply(call_id=1, fields={}, failure="DeviceBroken", reason="it smokes")]


def test_an_unknown_service_is_a_failure_that_names_it(setup: Setup) -> None:
    """It comes like any other reply: later."""
    inbox = Inbox(setup.clock)
    setup.transport.call(call(1, "/eco"), inbox)
    assert inbox.replies == []
    setup.let_all_happen()
    [reply] = inbox.replies
    assert (reply.call_id, reply.fields, reply.failure) == (1, {}, "NoSuchService")
    assert reply.reason.startswith("there is no service /eco")


def test_replies_of_one_time_keep_the_order_of_their_calls(setup: Setup) -> None:
    """Also where some fail."""
    inbox = Inbox(setup.clock)
    for number in range(10):
        setup.transport.call(call(number, "/broken" if number % 3 == 0 else "/echo"), inbox)
    setup.let_all_happen()
    came = [reply.call_id for reply in inbox.replies]
    assert (came if setup.keeps_order else sorted(came)) == list(range(10))


def test_a_quicker_service_overtakes_a_slower_one(setup: Setup) -> None:
    """Replies are told apart by the id of the call."""
    setup.offer("/look", lambda fields: {"door": "open"}, 0.5)
    inbox = Inbox(setup.clock)
    setup.transport.call(call(1, "/look"), inbox)
    setup.transport.call(call(2, "/echo"), inbox)
    setup.let_all_happen()
    assert [reply.call_id for reply in inbox.replies] == [2, 1]
    assert setup.came_at(inbox, 0.025, 0.5)


def test_the_service_sees_the_world_as_of_the_call(setup: Setup) -> None:
    """A laser reading is of the moment of the request, not of that of the reply."""
    world = {"door": "open"}
    looked: list[str] = []

    def look(fields: Mapping[str, object]) -> Mapping[str, object]:
        looked.append(world["door"])
        return {"door": world["door"]}

    def close_once_looked_at() -> None:
        if looked:
            world["door"] = "closed"
        else:
            setup.clock.call_at(setup.clock.now_s + 0.01, close_once_looked_at)

    setup.offer("/look", look, 0.5)
    inbox = Inbox(setup.clock)
    setup.transport.call(call(1, "/look"), inbox)
    close_once_looked_at()
    setup.let_all_happen()
    assert inbox.replies[0].fields == {"door": "open"}
    setup.transport.call(call(2, "/look"), inbox)
    setup.let_all_happen()
    assert inbox.replies[1].fields == {"door": "closed"}


def test_calls_may_be_made_while_a_reply_is_taken(setup: Setup) -> None:
    """A chain of calls, each made from the reply to the one before."""
    inbox = Inbox(setup.clock)

    def again(reply: ServiceReply) -> None:
        inbox(reply)
        if reply.call_id < 4:
            setup.transport.call(call(reply.call_id + 1, "/echo"), again)

    setup.transport.call(call(1, "/echo"), again)
    setup.let_all_happen()
    assert setup.came_at(inbox, 0.025, 0.05, 0.075, 0.1)


def test_an_image_of_10_mb_arrives_as_it_is(setup: Setup) -> None:
    """There and back, every byte, and of which byte order it says it is."""
    rng = np.random.default_rng(5)
    image = Image(
        header=header("amigo_1/camera", 12.5),
        height=2000,
        width=2500,
        encoding="16UC1",
        is_bigendian=1,
        step=5000,
        data=rng.integers(0, 256, 10_000_000, dtype=np.uint8),
    )
    setup.offer("/image", dict, 0.0)
    inbox = Inbox(setup.clock)
    setup.transport.call(call(1, "/image", image=image), inbox)
    setup.let_all_happen()
    [reply] = inbox.replies
    assert reply.failure == "", reply.reason
    echoed = reply.fields["image"]
    assert isinstance(echoed, Image)
    assert np.array_equal(echoed.data, image.data)
    assert (echoed.data.dtype, echoed.is_bigendian, echoed.step) == (np.dtype(np.uint8), 1, 5000)
    assert echoed.header == image.header


def test_numbers_keep_every_bit(setup: Setup) -> None:
    """No echo is infinity, not "not a number"; what no text of digits holds arrives all the same."""
    ranges = np.array([0.1, np.inf, -np.inf, np.nan, 1e-45, 3.4028235e38, -0.0], dtype=np.float32)
    scan = LaserScan(
        header=header("amigo_1/laser", 1.0),
        angle_min=-1.5,
        angle_max=1.5,
        angle_increment=0.5,
        time_increment=0.0,
        scan_time=0.1,
        range_min=0.1,
        range_max=float("inf"),
        ranges=ranges,
        intensities=np.array([], dtype=np.float32),
    )
    setup.offer("/scan", dict, 0.0)
    inbox = Inbox(setup.clock)
    setup.transport.call(call(1, "/scan", scan=scan), inbox)
    setup.transport.call(call(2, "/echo", text="\u00e4\u4e2d\0", number=2**63 - 1), inbox)
    setup.let_all_happen()
    by_id = {reply.call_id: reply for reply in inbox.replies}
    echoed = by_id[1].fields["scan"]
    assert isinstance(echoed, LaserScan)
    assert echoed.ranges.dtype == np.float32
    if setup.has_infinity:
        assert echoed.ranges.tobytes() == ranges.tobytes()
        assert echoed.range_max == float("inf")
    else:
        assert np.array_equal(echoed.ranges, np.where(np.isfinite(ranges), ranges, np.nan), equal_nan=True)
        assert np.isnan(echoed.range_max)
    assert by_id[2].fields == {"text": "\u00e4\u4e2d\0", "number": 2**63 - 1}


def test_stamps_and_frames_are_those_of_the_sender(setup: Setup) -> None:
    """Also where the clocks disagree: a stamp from before, or far ahead, is not put right on the way."""
    poses: list[PoseStamped] = [
        pose_stamped(1.0, 2.0, 0.5, t_s=t_s, frame_id=frame)
        for t_s, frame in ((0.0, "map"), (0.000000001, "amigo_1/odom"), (1_700_000_000.25, ""), (-1.5, "map"))
    ]
    setup.offer("/pose", dict, 0.0)
    inbox = Inbox(setup.clock)
    for number, pose in enumerate(poses):
        setup.transport.call(call(number, "/pose", pose=pose), inbox)
    setup.let_all_happen()
    by_id = {reply.call_id: reply.fields["pose"] for reply in inbox.replies}
    assert [by_id[number] for number in range(len(poses))] == poses


def test_what_was_lost_can_be_asked_for(setup: Setup) -> None:
    """Whether there is somebody at the service, for each call."""
    told: list[Mapping[int, bool | None]] = []
    setup.transport.reconcile([call(1, "/echo"), call(2, "/eco")], told.append)
    assert told == []
    setup.clock.run_until(lambda: bool(told))
    assert told == [{1: True, 2: False} if setup.lists_services else {1: None, 2: None}]
