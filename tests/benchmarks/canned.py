"""The services of the localize-navigate cycle ([RoboEarth] 5), answered with what was made before; scans on topics too.

As a program it offers them to rosbridge clients, prints where it listens, and goes on until its standard
input ends.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from grounding.messages import (
    CameraInfo,
    Image,
    LaserScan,
    MapMetaData,
    OccupancyGrid,
    Odometry,
    Path,
    PoseWithCovariance,
    RegionOfInterest,
    Twist,
    TwistWithCovariance,
    Vector3,
    header,
    planar_pose,
    pose_stamped,
    stamp_of,
)
from grounding.rosbridge.client import service_types
from grounding.rosbridge.hub import Hub
from grounding.rosbridge.server import serve
from grounding.rosbridge.types import ServiceType, Types
from kb.clock import SimClock
from kb.groundings import Field, Grounding
from kb.store import KnowledgeBase

CYCLE = ("LocMap", "Laser", "Pose", "Path", "VelCmd", "Base")
CAMERA = "Kinect"
LASER = "Laser"
SCAN_S = 0.1
ROBOTS = tuple(f"amigo_{number}" for number in range(1, 11))

_ZERO = Vector3(x=0.0, y=0.0, z=0.0)
_STOP = Twist(linear=_ZERO, angular=_ZERO)


def _messages() -> Mapping[str, object]:
    """One message or value of each type; of the sizes that the simulated robots send."""
    rng = np.random.default_rng(1)
    color = rng.integers(0, 256, 640 * 480 * 3, dtype=np.uint8)
    depth = rng.uniform(0.5, 5.0, 640 * 480).astype(np.float32).view(np.uint8)
    scan = rng.uniform(0.1, 20.0, 360).astype(np.float32)
    return {
        "bool": False,
        "float64": 0.25,
        "string": "canned",
        "geometry_msgs/PoseStamped": pose_stamped(1.0, 2.0, 0.5, t_s=3.0),
        "geometry_msgs/Twist": _STOP,
        "nav_msgs/OccupancyGrid": OccupancyGrid(
            header=header("map", 0.0),
            info=MapMetaData(
                map_load_time=stamp_of(0.0), resolution=0.05, width=200, height=160, origin=planar_pose(0.0, 0.0, 0.0)
            ),
            data=rng.integers(-1, 101, 200 * 160, dtype=np.int8),
        ),
        "nav_msgs/Odometry": Odometry(
            header=header("odom", 3.0),
            child_frame_id="base_link",
            pose=PoseWithCovariance(pose=planar_pose(1.0, 2.0, 0.5), covariance=np.zeros(36)),
            twist=TwistWithCovariance(twist=_STOP, covariance=np.zeros(36)),
        ),
        "nav_msgs/Path": Path(
            header=header("map", 3.0), poses=[pose_stamped(0.1 * n, 2.0, 0.5, t_s=3.0) for n in range(50)]
        ),
        "sensor_msgs/LaserScan": LaserScan(
            header=header("laser", 3.0),
            angle_min=-2.0,
            angle_max=2.0,
            angle_increment=4.0 / 359,
            time_increment=0.0,
            scan_time=0.1,
            range_min=0.1,
            range_max=20.0,
            ranges=scan,
            intensities=np.array([], dtype=np.float32),
        ),
        "color": _image("rgb8", 3, color),
        "depth": _image("32FC1", 4, depth),
        "sensor_msgs/CameraInfo": CameraInfo(
            header=header("camera", 3.0),
            height=480,
            width=640,
            distortion_model="plumb_bob",
            d=np.zeros(5),
            k=np.zeros(9),
            r=np.zeros(9),
            p=np.zeros(12),
            binning_x=0,
            binning_y=0,
            roi=RegionOfInterest(x_offset=0, y_offset=0, height=0, width=0, do_rectify=False),
        ),
    }


def _image(encoding: str, pixel_bytes: int, data: np.ndarray[tuple[int], np.dtype[np.uint8]]) -> Image:
    return Image(
        header=header("camera", 3.0),
        height=480,
        width=640,
        encoding=encoding,
        is_bigendian=0,
        step=640 * pixel_bytes,
        data=data,
    )


class Canned:
    """Services by process, with the types and fields that the shipped ontology gives them."""

    def __init__(self) -> None:
        knowledge = KnowledgeBase("tue_lab")
        self._groundings: Mapping[str, Grounding] = dict(knowledge.snapshot().groundings)
        knowledge.close()
        self._messages = _messages()
        self.types = Types()
        self.services: Mapping[str, ServiceType] = service_types(self._groundings.values(), ROBOTS, self.types)

    def service(self, process: str, robot: str) -> str:
        """The name of the service."""
        return self._groundings[process].service.replace("{robot}", robot)

    def laser_topic(self) -> Grounding:
        """The laser as a topic, beside the service that the ontology has."""
        of = self._groundings[LASER]
        return replace(of, service="/{robot}/scan", max_age_s=2 * SCAN_S)

    def request(self, process: str) -> Mapping[str, object]:
        """What it is asked with."""
        return self._of(self._groundings[process].request)

    def reply(self, process: str) -> Mapping[str, object]:
        """What it answers."""
        return self._of(self._groundings[process].reply)

    def _of(self, fields: tuple[Field, ...]) -> Mapping[str, object]:
        return {f.name: self._messages.get(f.name, self._messages.get(f.message_type)) for f in fields}

    def by_service(self) -> Mapping[str, Mapping[str, object]]:
        """What each service answers, for all robots."""
        return {self.service(process, robot): self.reply(process) for process in (*CYCLE, CAMERA) for robot in ROBOTS}


@contextmanager
def far_end_process() -> Iterator[str]:
    """Where a server of these services in another process listens."""
    command = [sys.executable, "-m", "tests.benchmarks.canned"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdin is not None
        assert server.stdout is not None
        try:
            yield server.stdout.readline().strip()
        finally:
            server.stdin.close()


def _serve() -> None:
    canned, clock = Canned(), SimClock()
    hub = Hub(clock, types=canned.types)
    for name, reply in canned.by_service().items():
        hub.services.offer(name, canned.services[name].name, lambda fields, reply=reply: reply)  # type: ignore[misc]
    for robot in ROBOTS:
        _say_scans(canned, hub, clock, robot)
    with serve(hub, clock) as server:
        print(server.uri, flush=True)
        sys.stdin.read()


def _say_scans(canned: Canned, hub: Hub, clock: SimClock, robot: str) -> None:
    laser = canned.laser_topic()
    [field], topic = laser.reply, laser.service.replace("{robot}", robot)
    hub.topics.offer(topic, field.message_type)
    scan = canned.reply(LASER)[field.name]

    def say() -> None:
        hub.topics.say(topic, scan)
        clock.call_at(clock.now_s + SCAN_S, say)

    say()


if __name__ == "__main__":
    _serve()
