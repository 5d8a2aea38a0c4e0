"""What simulated robots say and hear on topics: sensors for who wants to watch, velocities from who drives.

    /<robot>/scan                        sensor_msgs/LaserScan    10 Hz
    /<robot>/odom                        nav_msgs/Odometry        20 Hz
    /<robot>/camera/color/image_raw      sensor_msgs/Image         5 Hz
    /<robot>/camera/depth/image_raw      sensor_msgs/Image         5 Hz
    /<robot>/camera/color/camera_info    sensor_msgs/CameraInfo    5 Hz
    /<robot>/cmd_vel                     geometry_msgs/Twist      heard; a base stops half a second after the last one

A sensor measures only while somebody listens. Nothing that a robot could not know is told.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

from grounding.inprocess import Handler
from grounding.messages import Odometry
from grounding.topics import Board, HearingBoard
from kb.clock import SimClock
from kb.errors import ServiceFailed

_Measured = Callable[[str], Odometry]

SCAN_S, _ODOM_S, _CAMERA_S = 0.1, 0.05, 0.2
_CAMERA = {
    "camera/color/image_raw": ("sensor_msgs/Image", "color"),
    "camera/depth/image_raw": ("sensor_msgs/Image", "depth"),
    "camera/color/camera_info": ("sensor_msgs/CameraInfo", "camera_info"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Source:
    """A sensor that is read at a rate, and its topics: type and field by name."""

    read: Callable[[], Mapping[str, object]]
    topics: Mapping[str, tuple[str, str]]
    period_s: float


def offer_topics(
    board: HearingBoard, clock: SimClock, robots: Iterable[str], handlers: Mapping[str, Handler], odometry: _Measured
) -> list[str]:
    """Offer the topics of robots to others.

    Args:
        board: Of a server, or of ROS 1.
        clock: Of the simulator.
        handlers: The services of the robots by full name.
        odometry: What the wheels of a robot tell now.

    Returns:
        The names of the topics.
    """
    there = tuple(robots)
    driven = [_listen(board, robot, handlers[f"/{robot}/base"]) for robot in there]
    return [*offer_sensors(board, clock, there, handlers, odometry), *driven]


def offer_sensors(
    board: Board, clock: SimClock, robots: Sequence[str], handlers: Mapping[str, Handler], odometry: _Measured
) -> list[str]:
    """Offer what robots measure, without what they hear; see `offer_topics`."""
    names: list[str] = []
    for robot in robots:
        for source in _sources(robot, handlers, odometry):
            repeat = _Repeat(board, clock, source)
            for topic, (message_type, _) in source.topics.items():
                board.offer(topic, message_type, begun=repeat.begin)
                names.append(topic)
    return names


def _sources(robot: str, handlers: Mapping[str, Handler], odometry: _Measured) -> list[_Source]:
    laser, camera = handlers[f"/{robot}/laser"], handlers[f"/{robot}/kinect"]
    pictures = {f"/{robot}/{topic}": of for topic, of in _CAMERA.items()}
    return [
        _Source(
            read=lambda: laser({}),
            topics={f"/{robot}/scan": ("sensor_msgs/LaserScan", "scan")},
            period_s=SCAN_S,
        ),
        _Source(
            read=lambda: {"odometry": odometry(robot)},
            topics={f"/{robot}/odom": ("nav_msgs/Odometry", "odometry")},
            period_s=_ODOM_S,
        ),
        _Source(read=lambda: camera({}), topics=pictures, period_s=_CAMERA_S),
    ]


class _Repeat:
    """Reads a source again and again while somebody listens, and tells what it gives."""

    def __init__(self, board: Board, clock: SimClock, source: _Source) -> None:
        self._board, self._clock, self._source = board, clock, source
        self._is_running = False

    def begin(self) -> None:
        if not self._is_running:
            self._is_running = True
            self._clock.call_at(self._clock.now_s + self._source.period_s, self._say)

    def _say(self) -> None:
        self._is_running = False
        heard = {t: field for t, (_, field) in self._source.topics.items() if self._board.is_heard(t)}
        if heard:
            message = self._source.read()
            for topic, field in heard.items():
                self._board.say(topic, message[field])
            self.begin()


def _listen(board: HearingBoard, robot: str, base: Handler) -> str:
    name = f"/{robot}/cmd_vel"

    def drive(velocity: object) -> None:
        with suppress(ServiceFailed):  # a velocity that is no number: the base keeps to the last one, and stops
            base({"velocity": velocity})

    board.listen(name, "geometry_msgs/Twist", drive)
    return name
