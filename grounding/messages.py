"""ROS messages: the types of every request and reply, checked field by field.

The classes are those of ROS 2 Humble as `rosbags` defines them; ROS 1 differs in a few field names,
which only the ROS 1 transport has to know. Types are named as in ROS: `sensor_msgs/LaserScan`.

Units: SI and radians (REP 103). Frames: `map`, `<robot>/odom`, `<robot>/base_link`, `<robot>/laser`,
`<robot>/camera` (optical) (REP 105).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore
from rosbags.typesys.stores.ros2_humble import (
    builtin_interfaces__msg__Duration as Duration,
)
from rosbags.typesys.stores.ros2_humble import (
    builtin_interfaces__msg__Time as Time,
)
from rosbags.typesys.stores.ros2_humble import (
    geometry_msgs__msg__Point as Point,
)
from rosbags.typesys.stores.ros2_humble import (
    geometry_msgs__msg__PointStamped as PointStamped,
)
from rosbags.typesys.stores.ros2_humble import (
    geometry_msgs__msg__Pose as Pose,
)
from rosbags.typesys.stores.ros2_humble import (
    geometry_msgs__msg__PoseStamped as PoseStamped,
)
from rosbags.typesys.stores.ros2_humble import (
    geometry_msgs__msg__PoseWithCovariance as PoseWithCovariance,
)
from rosbags.typesys.stores.ros2_humble import (
    geometry_msgs__msg__Quaternion as Quaternion,
)
from rosbags.typesys.stores.ros2_humble import (
    geometry_msgs__msg__Twist as Twist,
)
from rosbags.typesys.stores.ros2_humble import (
    geometry_msgs__msg__TwistWithCovariance as TwistWithCovariance,
)
from rosbags.typesys.stores.ros2_humble import (
    geometry_msgs__msg__Vector3 as Vector3,
)
from rosbags.typesys.stores.ros2_humble import (
    nav_msgs__msg__MapMetaData as MapMetaData,
)
from rosbags.typesys.stores.ros2_humble import (
    nav_msgs__msg__OccupancyGrid as OccupancyGrid,
)
from rosbags.typesys.stores.ros2_humble import (
    nav_msgs__msg__Odometry as Odometry,
)
from rosbags.typesys.stores.ros2_humble import (
    nav_msgs__msg__Path as Path,
)
from rosbags.typesys.stores.ros2_humble import (
    sensor_msgs__msg__CameraInfo as CameraInfo,
)
from rosbags.typesys.stores.ros2_humble import (
    sensor_msgs__msg__Image as Image,
)
from rosbags.typesys.stores.ros2_humble import (
    sensor_msgs__msg__LaserScan as LaserScan,
)
from rosbags.typesys.stores.ros2_humble import (
    sensor_msgs__msg__RegionOfInterest as RegionOfInterest,
)
from rosbags.typesys.stores.ros2_humble import (
    std_msgs__msg__Float64MultiArray as Float64MultiArray,
)
from rosbags.typesys.stores.ros2_humble import (
    std_msgs__msg__Header as Header,
)
from rosbags.typesys.stores.ros2_humble import (
    std_msgs__msg__MultiArrayLayout as MultiArrayLayout,
)

__all__ = [
    "CameraInfo",
    "Duration",
    "Float64MultiArray",
    "Header",
    "Image",
    "LaserScan",
    "MapMetaData",
    "MultiArrayLayout",
    "OccupancyGrid",
    "Odometry",
    "Path",
    "Point",
    "PointStamped",
    "Pose",
    "PoseStamped",
    "PoseWithCovariance",
    "Quaternion",
    "RegionOfInterest",
    "Time",
    "Twist",
    "TwistWithCovariance",
    "Vector3",
    "class_of",
    "header",
    "is_type",
    "planar_pose",
    "pose_stamped",
    "problem_with",
    "quaternion_of",
    "stamp_of",
    "stamp_s",
    "type_name",
    "xyyaw",
    "yaw_of",
]


def stamp_of(t_s: float) -> Time:
    """ROS time of `t_s` seconds."""
    nanoseconds = round(t_s * 1e9)
    return Time(sec=nanoseconds // 1_000_000_000, nanosec=nanoseconds % 1_000_000_000)


def stamp_s(time: Time) -> float:
    """Seconds of a ROS time."""
    return time.sec + time.nanosec * 1e-9


def header(frame_id: str, t_s: float) -> Header:
    """Header of a message taken at `t_s` in frame `frame_id`."""
    return Header(stamp=stamp_of(t_s), frame_id=frame_id)


def quaternion_of(yaw_rad: float) -> Quaternion:
    """Rotation about z (xyzw)."""
    return Quaternion(x=0.0, y=0.0, z=math.sin(yaw_rad / 2.0), w=math.cos(yaw_rad / 2.0))


def yaw_of(quaternion: Quaternion) -> float:
    """Heading of a rotation, in (-pi, pi]."""
    q = quaternion
    return math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))


def planar_pose(x_m: float, y_m: float, yaw_rad: float) -> Pose:
    """Pose on the floor."""
    return Pose(position=Point(x=x_m, y=y_m, z=0.0), orientation=quaternion_of(yaw_rad))


def pose_stamped(x_m: float, y_m: float, yaw_rad: float, *, t_s: float, frame_id: str = "map") -> PoseStamped:
    """Pose on the floor with frame and time."""
    return PoseStamped(header=header(frame_id, t_s), pose=planar_pose(x_m, y_m, yaw_rad))


def xyyaw(pose: Pose) -> tuple[float, float, float]:
    """Position and heading of a pose on the floor: m, m, rad."""
    return pose.position.x, pose.position.y, yaw_of(pose.orientation)


_PLAIN = {"bool", "int64", "float64", "string"}


def type_name(message: object) -> str:
    """ROS type of a message: `sensor_msgs/LaserScan`; the Python type of what is none."""
    return str(getattr(message, "__msgtype__", type(message).__name__)).replace("/msg/", "/")


def problem_with(message_type: str, value: object) -> str:
    """Check a value against a ROS type, field by field.

    Args:
        message_type: Such as `sensor_msgs/LaserScan`, or bool, int64, float64, string.

    Returns:
        What is wrong, with the path of the field; empty if nothing is.
    """
    if message_type in _PLAIN:
        return _problem_with_plain(message_type, value).strip()
    if type_name(value) != message_type:
        return f"is {type_name(value)}, not {message_type}"
    return _problem_in(value)


def class_of(message_type: str) -> type[Any] | None:
    """The class of the messages of a ROS type, such as `sensor_msgs/msg/LaserScan`; None if there is no such type."""
    return _typestore().types.get(message_type)


def is_type(message_type: str) -> bool:
    """Whether there is a ROS type of this name."""
    return message_type in _PLAIN or message_type.replace("/", "/msg/") in _typestore().fielddefs


def _problem_in(message: object) -> str:
    for name, check in _checks(type_name(message)):
        problem = check(getattr(message, name))
        if problem:
            return f".{name}{problem}"
    return ""


@cache
def _checks(message_type: str) -> tuple[tuple[str, Callable[[Any], str]], ...]:
    """For each field of a message type, what tells the problem with its value."""
    _, definitions = _typestore().fielddefs[message_type.replace("/", "/msg/")]
    return tuple((name, _check_for(kind, detail)) for name, (kind, detail) in definitions)


@cache
def _typestore() -> Typestore:
    return get_typestore(Stores.ROS2_HUMBLE)


def _check_for(kind: Nodetype, detail: Any) -> Callable[[Any], str]:
    match kind:
        case Nodetype.BASE:
            return lambda value: _problem_with_plain(detail[0], value)
        case Nodetype.NAME:
            wanted = detail.replace("/msg/", "/")
            return lambda value: (
                _problem_in(value) if type_name(value) == wanted else f" is {type_name(value)}, not {wanted}"
            )
        case _:
            (element_kind, element_detail), size = detail
            if element_kind is Nodetype.BASE and element_detail[0] != "string":
                dtype = np.dtype(element_detail[0])
                length = size if kind is Nodetype.ARRAY else None
                return lambda value: _problem_with_array(value, dtype, length)
            one = _check_for(element_kind, element_detail)
            return lambda value: _problem_in_list(value, one)


def _problem_with_array(value: object, dtype: np.dtype[Any], length: int | None) -> str:
    if not isinstance(value, np.ndarray) or value.dtype != dtype or value.ndim != 1:
        return f" is no array of {dtype}"
    return "" if length in (None, len(value)) else f" has {len(value)} elements, not {length}"


def _problem_in_list(value: object, one: Callable[[Any], str]) -> str:
    if not isinstance(value, list):
        return f" is {type(value).__name__}, not list"
    return next((f"[{i}]{problem}" for i, x in enumerate(value) if (problem := one(x))), "")


def _problem_with_plain(kind: str, value: object) -> str:
    """Check a number, truth value or text against a ROS primitive type such as `float32`."""
    wanted: type | tuple[type, ...] = str
    if kind.startswith("float"):
        wanted = (int, float, np.floating)
    elif kind.startswith(("int", "uint", "byte", "octet", "char")):
        wanted = (int, np.integer)
    elif kind.startswith("bool"):
        wanted = (bool, np.bool_)
    right = isinstance(value, wanted) and (kind.startswith("bool") or not isinstance(value, bool))
    return "" if right else f" is {type(value).__name__}, not {kind}"
