"""How fast services are called: the cycle of localizing and navigating, and images.

The cycle is the six calls LocMap, Laser, Pose, Path (50 poses), VelCmd, Base with the fields that the ontology gives
them, a map of 200 x 160 cells in three of them, answered with what was made before ([RoboEarth] 5, where through
services it came to 0.1 Hz): in process, and over rosbridge to another process, for one robot and for ten, each with a
connection of its own. `rosbridge_topics_hz` is the same with the laser read from a topic, 10 scans a second, so that
there are five calls. Text is what other servers take, CBOR what ours does. `rosbridge_cpu_ms` is what a cycle takes of
the client's processor, which says more than Hz where others share the machine. Images are one call for color and
depth, 640 x 480, as CBOR. A step is an outcome told to the planner and the actions that may start then, two robots
at two drinks.

At last the same with planner and real services: FindEmptyDrink by two simulated robots in another process, which move
in real time; the cycles between the first and the last one of each robot.

Where ROS 1 is installed, the cycle is measured over it too, with our transport on both sides, beside the time of a call
of the base as rospy makes it if nothing is said: over a new connection each time. Where ROS 2 is installed, the time of
a call of a service of another process in it (`ros2_call_ms`).
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import count

import numpy as np

from executive import Fleet, TaskStatus
from executive.topic_readings import TopicReadings
from executive.trace import ActionFinished
from grounding.actions import Carrier
from grounding.inprocess import InProcessTransport, Service
from grounding.outcome import Outcome
from grounding.ros1.client import Ros1Transport
from grounding.ros1.installed import ros
from grounding.ros1.node import Master
from grounding.ros1.wire import Wire
from grounding.ros2 import installed
from grounding.ros2.client import Ros2Transport
from grounding.rosbridge.client import RosbridgeTransport
from grounding.rosbridge.connection import Endpoint
from grounding.rosbridge.types import Types
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import WallClock
from kb.files import SHIPPED
from kb.store import KnowledgeBase
from tests.benchmarks.canned import CAMERA, CYCLE, LASER, ROBOTS, Canned, far_end_process
from tests.benchmarks.canned_ros1 import far_end_in_ros_1
from tests.benchmarks.decisions import decisions
from tests.benchmarks.harness import Figure, main
from tests.contracts.ros2_graph import graph, stock_robot

PAPER_HZ = 0.1


def run(quick: bool) -> Mapping[str, Figure]:
    """Measure: Hz for each robot, MB/s."""
    seconds = 1.0 if quick else 5.0
    canned = Canned()
    figures: dict[str, Figure] = {"paper_hz": PAPER_HZ}
    figures["in_process_hz"] = _in_process_hz(canned, seconds)
    with far_end_process() as uri:
        one, ten = ROBOTS[:1], ROBOTS
        alone = _over_rosbridge(canned, uri, one, seconds, binary=True)
        figures["rosbridge_hz"] = alone.hz
        figures["rosbridge_cpu_ms"] = alone.cpu_ms
        figures["rosbridge_topics_hz"] = _over_rosbridge(canned, uri, one, seconds, binary=True, by_topic=True).hz
        figures["rosbridge_text_hz"] = _over_rosbridge(canned, uri, one, seconds, binary=False).hz
        figures["rosbridge_ten_robots_hz"] = _over_rosbridge(canned, uri, ten, seconds, binary=True).hz
        figures["images_mb_per_s"] = _images_mb_per_s(canned, uri, seconds)
    figures |= _steps(2_000 if quick else 20_000)
    figures["task_hz"] = _task_hz()
    if shutil.which("rosmaster"):
        with far_end_in_ros_1() as master:
            figures |= _ros_1(canned, master, seconds)
    if installed.FOLDER.is_dir():
        figures["ros2_call_ms"] = _ros_2_call_ms(seconds)
    return figures


def _steps(count: int) -> Mapping[str, Figure]:
    knowledge = KnowledgeBase("tue_lab", SHIPPED)
    spent_s = sorted(decisions(knowledge.snapshot(), planned=False, cycles=count, steps=count, robots=2))
    knowledge.close()
    return {"step_median_ms": 1000.0 * spent_s[len(spent_s) // 2], "steps_per_s": len(spent_s) / sum(spent_s)}


def _task_hz() -> float:
    """Cycles a second of the slower robot while it drives."""
    command = [sys.executable, "-m", "executive.cli", "simulate", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            uri = next(line.split()[2] for line in server.stdout if line.startswith("serving at "))
            with Fleet.open("tue_lab", connect=uri) as fleet:
                result = fleet.request("FindEmptyDrink", room="tue_lab").wait()
                assert result.status is TaskStatus.COMPLETED, result.reason
                driven = [e for e in fleet.trace if isinstance(e, ActionFinished) and e.action.startswith("Base(")]
        finally:
            server.terminate()
    times = {robot: [e.t_s for e in driven if e.robot == robot] for robot in ("amigo_1", "pico_1")}
    return min((len(t_s) - 1) / (t_s[-1] - t_s[0]) for t_s in times.values())


def _in_process_hz(canned: Canned, seconds: float) -> float:
    clock = WallClock()
    transport = InProcessTransport(clock)
    for name, reply in canned.by_service().items():
        transport.offer(name, Service(handler=lambda fields, reply=reply: reply, latency_s=0.0))  # type: ignore[misc]
    return _slowest(canned, clock, {ROBOTS[0]: transport}, CYCLE, seconds).hz


def _over_rosbridge(
    canned: Canned, uri: str, robots: Sequence[str], seconds: float, *, binary: bool, by_topic: bool = False
) -> _Rate:
    clock = WallClock()
    with ExitStack() as stack:
        transports = {robot: stack.enter_context(_transport(canned, clock, uri, binary=binary)) for robot in robots}
        return _slowest(canned, clock, transports, CYCLE, seconds, by_topic=by_topic)


def _images_mb_per_s(canned: Canned, uri: str, seconds: float) -> float:
    clock = WallClock()
    with _transport(canned, clock, uri, binary=True) as transport:
        before = transport.traffic.received_bytes
        begun = time.perf_counter()
        _slowest(canned, clock, {ROBOTS[0]: transport}, (CAMERA,), seconds)
        return (transport.traffic.received_bytes - before) / 1e6 / (time.perf_counter() - begun)


def _ros_1(canned: Canned, master: Master, seconds: float) -> Mapping[str, float]:
    clock, robot = WallClock(), ROBOTS[0]
    with Ros1Transport(master, clock, services=canned.services, types=canned.types) as transport:
        assert transport.wait_connected(30.0), transport.problem
        hz = _slowest(canned, clock, {robot: transport}, CYCLE, seconds).hz
        base_hz = _slowest(canned, clock, {robot: transport}, ("Base",), seconds).hz
        wire, name = Wire(canned.types), canned.service("Base", robot)
        service = wire.service_class(canned.services[name])
        request = wire.encode_fields(canned.services[name].request, canned.request("Base"))
        call, calls = ros("rospy").ServiceProxy(name, service), 0
        begun = time.perf_counter()
        with warnings.catch_warnings():
            # A proxy of rospy for single calls leaves the socket by which it has asked the master to the collector.
            warnings.simplefilter("ignore", ResourceWarning)
            while time.perf_counter() - begun < seconds:
                call(service._request_class(request))
                calls += 1
        one_shot_ms = 1000.0 * (time.perf_counter() - begun) / calls
    return {"ros1_hz": hz, "ros1_call_ms": 1000.0 / base_hz, "ros1_new_connection_call_ms": one_shot_ms}


def _ros_2_call_ms(seconds: float) -> float:
    """The time of a call, on average, one after the other."""
    clock, types, ids = WallClock(), Types(), count()
    services = {"/stock/trigger": types.service("std_srvs/Trigger")}

    def call_next() -> None:
        transport.call(ServiceCall(id=next(ids), service="/stock/trigger", fields={}, timeout_s=60.0), took)

    def took(reply: ServiceReply) -> None:
        assert not reply.failure, reply.reason
        call_next()

    rng = np.random.default_rng(1)
    with graph(), stock_robot(), Ros2Transport(clock, services=services, types=types, rng=rng) as transport:
        assert transport.wait_connected(30.0), transport.problem
        call_next()
        begun = time.perf_counter()
        clock.run_until(lambda: time.perf_counter() - begun >= seconds)
        return 1000.0 * (time.perf_counter() - begun) / next(ids)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rate:
    """How fast cycles go.

    Attributes:
        hz: Cycles a second, of the slowest robot.
        cpu_ms: What a cycle takes of this process's processor, set-up left out.
    """

    hz: float
    cpu_ms: float


def _slowest(
    canned: Canned,
    clock: WallClock,
    transports: Mapping[str, Carrier],
    cycle: Sequence[str],
    seconds: float,
    *,
    by_topic: bool = False,
) -> _Rate:
    """Run the calls of the cycle one after the other, for all robots at once; scans by topic, if that is asked for."""
    ids = count()
    readings = {robot: TopicReadings(transport, clock) for robot, transport in transports.items()}
    laser = canned.laser_topic()
    requests = {process: canned.request(process) for process in cycle}
    done = dict.fromkeys(transports, 0)  # calls

    def call_next(robot: str) -> None:
        process = cycle[done[robot] % len(cycle)]
        if by_topic and process == LASER:
            topic = laser.service.replace("{robot}", robot)
            reading = ServiceCall(id=next(ids), service=topic, fields={}, timeout_s=60.0)
            readings[robot].read(reading, laser, lambda outcome, fields: was_read(robot, outcome))
            return
        call = ServiceCall(
            id=next(ids), service=canned.service(process, robot), fields=requests[process], timeout_s=60.0
        )
        transports[robot].call(call, lambda reply: took(robot, reply))

    def was_read(robot: str, outcome: Outcome) -> None:
        if not outcome.succeeded:
            raise AssertionError(f"{robot}: {outcome.failure}: {outcome.reason}")
        done[robot] += 1
        call_next(robot)

    def took(robot: str, reply: ServiceReply) -> None:
        if reply.failure:
            raise AssertionError(f"{robot}: {reply.failure}: {reply.reason}")
        done[robot] += 1
        call_next(robot)

    begun, begun_cpu_s = time.perf_counter(), time.process_time()
    for robot in transports:
        call_next(robot)
    clock.run_until(lambda: time.perf_counter() - begun >= seconds)
    took_s, took_cpu_s = time.perf_counter() - begun, time.process_time() - begun_cpu_s
    return _Rate(
        hz=min(done.values()) / len(cycle) / took_s, cpu_ms=1000.0 * took_cpu_s * len(cycle) / sum(done.values())
    )


@contextmanager
def _transport(canned: Canned, clock: WallClock, uri: str, *, binary: bool) -> Iterator[RosbridgeTransport]:
    rng = np.random.default_rng(1)
    made = RosbridgeTransport(
        Endpoint(uri=uri), clock, services=canned.services, types=canned.types, binary=binary, rng=rng
    )
    with made:
        assert made.wait_connected(30.0), made.problem
        yield made


if __name__ == "__main__":
    sys.exit(main("transport", run))
