"""What every transport keeps to that carries topics, as who reads them sees it."""

from __future__ import annotations

import gc
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pytest

from executive.topic_readings import TopicReadings
from grounding.faults import FaultyTransport
from grounding.inprocess import InProcessTransport
from grounding.messages import PoseStamped, pose_stamped
from grounding.outcome import Outcome, OutcomeStatus
from grounding.ros1.client import Ros1Transport
from grounding.ros1.node import Master, Node
from grounding.ros1.topics import Topics
from grounding.ros1.wire import Wire
from grounding.rosbridge.client import RosbridgeTransport
from grounding.rosbridge.connection import Endpoint
from grounding.rosbridge.dropped import Dropped
from grounding.rosbridge.hub import Hub
from grounding.rosbridge.operations import Publish, Subscribe, Unsubscribe
from grounding.rosbridge.server import serve
from grounding.rosbridge.types import Types
from grounding.topics import TopicTransport
from grounding.transport import ServiceCall
from kb.clock import Clock, SimClock, WallClock
from tests.contracts.far_end import FarEnd
from tests.contracts.ros_master import HOST, RosMaster
from tests.executive.topic_grounding import topic_grounding

WAIT_S = 20.0
TOPIC = "/r1/pose"
TYPE = "geometry_msgs/PoseStamped"


@dataclass(kw_only=True)
class Setup:
    """A transport under test, and who reads what comes over it.

    Attributes:
        say: Says a message at the far end.
        listeners: How many listen there.
        fall_silent: The far end is gone; None where there is none that could be.
        come_back: It is there again.
    """

    clock: Clock
    transport: TopicTransport
    say: Callable[[PoseStamped], None]
    listeners: Callable[[], int]
    fall_silent: Callable[[], None] | None = None
    come_back: Callable[[], None] = lambda: None
    readings: TopicReadings = field(init=False)
    asked: int = 0

    def __post_init__(self) -> None:
        self.readings = TopicReadings(self.transport, self.clock)

    def until(self, done: Callable[[], bool]) -> None:
        """Run the clock until something holds that nobody tells of."""
        late_s = self.clock.now_s + WAIT_S
        while not done():
            assert self.clock.now_s < late_s
            self.pass_time(0.01)

    def pass_time(self, seconds: float) -> None:
        """Run the clock so long."""
        over: list[bool] = []
        self.clock.call_at(self.clock.now_s + seconds, partial(over.append, True))
        self.clock.run_until(partial(bool, over))

    def begin(self, max_age_s: float = WAIT_S, timeout_s: float = WAIT_S) -> list[Outcome]:
        """Begin to read; the outcome will be in the list."""
        self.asked += 1
        grounding = topic_grounding(TYPE, max_age_s=max_age_s, timeout_s=timeout_s)
        outcomes: list[Outcome] = []
        call = ServiceCall(id=self.asked, service=TOPIC, fields={}, timeout_s=timeout_s)
        self.readings.read(call, grounding, lambda outcome, fields: outcomes.append(outcome))
        assert outcomes == [], "nothing comes within the call"
        return outcomes

    def read(self, max_age_s: float = WAIT_S, timeout_s: float = WAIT_S) -> Outcome:
        """Read, and wait for the outcome."""
        outcomes = self.begin(max_age_s, timeout_s)
        self.clock.run_until(lambda: bool(outcomes))
        return outcomes[0]

    def heard(self, x_m: float) -> None:
        """Say something new, and wait until a reading tells it: from then on it is the newest."""
        waiting = self.begin(max_age_s=1e-9)
        self.until(lambda: self.listeners() == 1)
        self.say(pose_stamped(x_m, 0.0, 0.0, t_s=0.0))
        self.clock.run_until(lambda: bool(waiting))
        assert x_of(waiting[0]) == x_m


def x_of(outcome: Outcome) -> float:
    """Which message a reading took."""
    assert outcome.succeeded, outcome.reason
    pose = outcome.outputs["at"]
    assert isinstance(pose, PoseStamped)
    return pose.pose.position.x


@contextmanager
def in_process() -> Iterator[Setup]:
    """Both ends are here, on the way on which faults happen; none does."""
    clock = SimClock()
    transport = InProcessTransport(clock)
    transport.topics.offer(TOPIC, TYPE, begun=lambda: None)
    yield Setup(
        clock=clock,
        transport=FaultyTransport(transport, clock, (), np.random.default_rng(1)),
        say=lambda message: transport.topics.say(TOPIC, message),
        listeners=lambda: int(transport.topics.is_heard(TOPIC)),
    )


@contextmanager
def rosbridge(*, binary: bool) -> Iterator[Setup]:
    """The robot is behind our server."""
    served = SimClock()
    hub = Hub(served)
    hub.topics.offer(TOPIC, TYPE)
    with serve(hub, served) as server, _connected(server.uri, binary=binary) as (clock, transport):
        yield Setup(
            clock=clock,
            transport=transport,
            say=lambda message: server.post(lambda: hub.topics.say(TOPIC, message)),
            listeners=lambda: sum(len(info.subscribers) for info in hub.topics.told() if info.name == TOPIC),
        )


@contextmanager
def rosbridge_of_others() -> Iterator[Setup]:
    """The robot is behind another server, whose connections break."""
    with FarEnd(Types()) as far, _connected(far.uri, binary=False) as (clock, transport):
        lost = 0

        def listeners() -> int:
            began = sum(isinstance(operation, Subscribe) for operation in far.came)
            return began - lost - sum(isinstance(operation, Unsubscribe) for operation in far.came)

        def fall_silent() -> None:
            nonlocal lost
            lost = listeners()
            far.break_connections()
            made.until(lambda: not transport.connected)

        made = Setup(
            clock=clock,
            transport=transport,
            say=lambda message: far.publish(TOPIC, message),
            listeners=listeners,
            fall_silent=fall_silent,
            come_back=lambda: made.until(lambda: transport.connected),
        )
        yield made


@contextmanager
def ros_1(master: RosMaster) -> Iterator[Setup]:
    """The robot is a node of ROS 1; there is one for each process, so that it is ours."""
    types, clock = Types(), WallClock()
    with (
        _watched(clock),
        Ros1Transport(Master(uri=master.uri, host=HOST), clock, services={}, types=types) as transport,
    ):
        assert transport.wait_connected(WAIT_S), transport.problem
        node = Node(Master(uri=master.uri), complain=pytest.fail)
        node.open()
        robot = Topics(node, clock, types, Wire(types), Dropped())
        robot.advertise(TOPIC, TYPE, False)
        yield Setup(
            clock=clock,
            transport=transport,
            say=lambda message: _ignored(robot.publish(TOPIC, message)),
            listeners=lambda: robot.partners(TOPIC),
            fall_silent=lambda: robot.unadvertise(TOPIC),
            come_back=lambda: robot.advertise(TOPIC, TYPE, False),
        )
        robot.unadvertise(TOPIC)
        node.close()
    gc.collect()  # rospy leaves sockets to it


def _ignored(value: bool) -> None:
    assert value, "the topic is known to a master"


@contextmanager
def _connected(uri: str, *, binary: bool) -> Iterator[tuple[WallClock, RosbridgeTransport]]:
    clock, rng = WallClock(), np.random.default_rng(1)
    with (
        _watched(clock),
        RosbridgeTransport(Endpoint(uri=uri), clock, services={}, types=Types(), binary=binary, rng=rng) as transport,
    ):
        assert transport.wait_connected(WAIT_S), transport.problem
        yield clock, transport


@contextmanager
def _watched(clock: WallClock) -> Iterator[None]:
    """A test that waits for what does not come fails, and does not wait on."""
    stuck = threading.Timer(60.0, lambda: clock.post(lambda: pytest.fail("waits for what does not come")))
    stuck.start()
    yield
    stuck.cancel()
    stuck.join()


TRANSPORTS: Mapping[str, Callable[[], AbstractContextManager[Setup]]] = {
    "in process": in_process,
    "rosbridge, binary": partial(rosbridge, binary=True),
    "rosbridge, text": partial(rosbridge, binary=False),
    "rosbridge of others": rosbridge_of_others,
}
ROS_1 = "ROS 1"
IN_ROS_1 = pytest.param(
    ROS_1,
    marks=[pytest.mark.ros1, pytest.mark.filterwarnings("ignore:unclosed <socket:ResourceWarning")],
)


@pytest.fixture(params=[*TRANSPORTS, IN_ROS_1])
def setup(request: pytest.FixtureRequest) -> Iterator[Setup]:
    """Each transport in turn; the tests below hold for all."""
    with (
        ros_1(request.getfixturevalue("ros_master")) if request.param == ROS_1 else TRANSPORTS[request.param]() as made
    ):
        yield made


def test_the_first_message_is_waited_for(setup: Setup) -> None:
    """The topic is subscribed to when it is first read."""
    assert setup.listeners() == 0
    reading = setup.begin()
    setup.until(lambda: setup.listeners() == 1)
    assert reading == []
    setup.say(pose_stamped(1.0, 0.0, 0.0, t_s=0.0))
    setup.clock.run_until(lambda: bool(reading))
    assert x_of(reading[0]) == 1.0


def test_the_newest_message_is_taken_at_once(setup: Setup) -> None:
    """Again and again, by one subscription."""
    for x_m in (1.0, 2.0):
        setup.heard(x_m)
    for _ in range(3):
        outcome = setup.read()
        assert x_of(outcome) == 2.0
        assert outcome.elapsed_s < 1.0
    assert setup.listeners() == 1


def test_a_message_that_is_too_old_is_not_taken(setup: Setup) -> None:
    """If no other comes, the reading fails, and tells how old it is."""
    setup.heard(1.0)
    setup.pass_time(0.02)
    outcome = setup.read(max_age_s=0.01, timeout_s=0.1)
    assert (outcome.status, outcome.failure) == (OutcomeStatus.TIMED_OUT, "NoMessage")
    assert outcome.reason.startswith("no message of /r1/pose came within 0.1 s; the newest is 0.1")


def test_a_message_that_never_comes(setup: Setup) -> None:
    """The reading fails, and the next one that comes is taken by the next reading."""
    outcome = setup.read(timeout_s=0.05)
    assert outcome.reason == "no message of /r1/pose came within 0.05 s; there has been none"
    setup.heard(1.0)


def test_who_hears_no_more_is_forgotten(setup: Setup) -> None:
    """At the far end too; and may begin again."""
    for _ in range(2):
        heard: list[object] = []
        end = setup.transport.hear_topic(TOPIC, TYPE, lambda message, problem, heard=heard: heard.append(message))  # type: ignore[misc]
        setup.until(lambda: setup.listeners() == 1)
        setup.say(pose_stamped(1.0, 0.0, 0.0, t_s=0.0))
        setup.until(partial(bool, heard))
        end()
        setup.until(lambda: setup.listeners() == 0)


@pytest.mark.parametrize("setup", ["rosbridge of others", IN_ROS_1], indirect=True)
def test_a_robot_that_is_gone_is_silent_and_is_heard_when_it_is_back(setup: Setup) -> None:
    """What it said before is too old soon; who reads subscribes once, whatever the connection does."""
    assert setup.fall_silent is not None
    setup.heard(1.0)
    setup.fall_silent()
    setup.until(lambda: setup.listeners() == 0)
    assert setup.read(max_age_s=1e-9, timeout_s=0.05).failure == "NoMessage"
    setup.come_back()
    setup.heard(2.0)
    assert setup.listeners() == 1


def test_a_message_that_cannot_be_read_is_told() -> None:
    """With the field that is wrong, and not as silence."""
    with FarEnd(Types()) as far, _connected(far.uri, binary=False) as (clock, transport):
        setup = Setup(clock=clock, transport=transport, say=lambda message: None, listeners=lambda: 1)
        reading = setup.begin()
        setup.until(lambda: any(isinstance(operation, Subscribe) for operation in far.came))
        far.send(Publish(topic=TOPIC, msg={"header": {}, "pose": {"position": {"x": "far"}}}))
        clock.run_until(lambda: bool(reading))
    assert (reading[0].status, reading[0].failure) == (OutcomeStatus.POSTCONDITION_FAILED, "BadReply")
    assert reading[0].reason.startswith("message of /r1/pose: ")
    assert "position.x" in reading[0].reason
