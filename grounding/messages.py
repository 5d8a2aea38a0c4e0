"""ROS messages: the types of every request and reply, checked field by field.

The classes are those of ROS 2 Humble as `rosbags` defines them; ROS 1 differs in a few field names,
which only the ROS 1 transport has to know. Types are named as in ROS: `sensor_msgs/LaserScan`.

Units: SI and radians (REP 103). Frames: `map`, `<robot>/odom`, `<robot>/base_link`, `<robot>/laser`,
`<robot>/camera` (optical) (REP 105).
"""

from __future__ import annotations

import math

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
    std_msgs__msg__Header as Header,
)

__all__ = [
    "CameraInfo",
    "Header",
    "Image",
    "LaserScan",
    "MapMetaData",
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
    "header",
    "planar_pose",
    "pose_stamped",
    "quaternion_of",
    "stamp_of",
    "stamp_s",
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
