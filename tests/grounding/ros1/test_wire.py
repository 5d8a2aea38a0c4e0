"""Types and bytes are ROS 1's own: compared with the classes that Debian ships."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np
import pytest

from grounding.messages import LaserScan, PoseStamped, header, pose_stamped
from grounding.ros1.installed import ros
from grounding.ros1.wire import Wire
from grounding.rosbridge.types import Types, UnknownType
from grounding.rosbridge.values import BadValue

pytestmark = pytest.mark.ros1


def _as_ros_has_it(message_type: str) -> Any:
    package, _, name = message_type.partition("/")
    return getattr(ros(f"{package}.msg"), name)


@pytest.mark.parametrize(
    "message_type",
    [
        "std_msgs/Empty",
        "std_msgs/Float64MultiArray",
        "geometry_msgs/Twist",
        "geometry_msgs/PoseWithCovarianceStamped",
        "nav_msgs/OccupancyGrid",
        "nav_msgs/Odometry",
        "nav_msgs/Path",
        "sensor_msgs/CameraInfo",
        "sensor_msgs/Image",
        "sensor_msgs/LaserScan",
        "actionlib_msgs/GoalStatusArray",
    ],
)
def test_messages_have_the_name_and_the_sum_of_ros(message_type: str) -> None:
    """Else ROS refuses the connection."""
    ours, theirs = Wire(Types()).message_class(message_type), _as_ros_has_it(message_type)
    assert (ours._type, ours._md5sum) == (theirs._type, theirs._md5sum)


@pytest.mark.parametrize("name", ["std_srvs/Empty", "std_srvs/SetBool", "std_srvs/Trigger", "nav_msgs/GetPlan"])
def test_services_have_the_name_and_the_sum_of_ros(name: str) -> None:
    """Also where a part has no fields, or messages with headers."""
    types = Types()
    ours, theirs = Wire(types).service_class(types.service(name)), getattr(ros(f"{name[:8]}.srv"), name[9:])
    assert (ours._type, ours._md5sum) == (theirs._type, theirs._md5sum)
    assert ours._request_class._type == theirs._request_class._type
    assert ours._response_class._md5sum == theirs._response_class._md5sum


def test_actions_have_the_sums_of_ros() -> None:
    """Of the messages around their parts."""
    types = Types()
    action = types.add("action", "actionlib/Test", "int32 goal\n---\nint32 result\n---\nint32 feedback")
    wire = Wire(types)
    wrappers = wire.wrappers(types.action(action))
    for part in ("goal", "feedback", "result"):
        theirs = getattr(ros("actionlib.msg"), f"TestAction{part.capitalize()}")
        assert wire.message_class(wrappers[part])._md5sum == theirs._md5sum


def test_ros_reads_what_we_write() -> None:
    """Field by field, with the `seq` that our headers do not have."""
    ranges = np.array([0.5, np.inf, np.nan], dtype=np.float32)
    scan = LaserScan(
        header=header("amigo_1/laser", 12.25),
        angle_min=-1.0,
        angle_max=1.0,
        angle_increment=1.0,
        time_increment=0.0,
        scan_time=0.1,
        range_min=0.1,
        range_max=8.0,
        ranges=ranges,
        intensities=np.array([], dtype=np.float32),
    )
    read = _as_ros_has_it("sensor_msgs/LaserScan")().deserialize(Wire(Types()).encode(scan))
    assert (read.header.stamp.secs, read.header.stamp.nsecs, read.header.frame_id) == (12, 250_000_000, "amigo_1/laser")
    assert np.array_equal(np.array(read.ranges, np.float32), ranges, equal_nan=True)
    assert (read.angle_min, read.range_max) == (-1.0, 8.0)


def test_we_read_what_ros_writes() -> None:
    """The sequence number of the header is passed over."""
    theirs = _as_ros_has_it("geometry_msgs/PoseStamped")()
    theirs.header.seq, theirs.header.frame_id, theirs.pose.position.x, theirs.pose.orientation.w = 7, "map", 1.5, 1.0
    buffer = BytesIO()
    theirs.serialize(buffer)
    read = Wire(Types()).decode("geometry_msgs/PoseStamped", buffer.getvalue())
    assert isinstance(read, PoseStamped)
    assert read == pose_stamped(1.5, 0.0, 0.0, t_s=0.0)


def test_bytes_of_another_type_are_told() -> None:
    """Too few, too many, or a text that is none."""
    wire = Wire(Types())
    data = wire.encode(pose_stamped(1.0, 2.0, 0.0, t_s=1.0))
    for wrong in (data[:-1], data + b"\0", b"", data[:12] + b"\xff\xff\xff\xff" + data[16:]):
        with pytest.raises(BadValue, match="is no geometry_msgs/PoseStamped"):
            wire.decode("geometry_msgs/PoseStamped", wrong)


def test_a_type_that_is_another_in_ros_1_is_refused() -> None:
    """Its bytes would be read as something else."""
    with pytest.raises(UnknownType, match="its fields in ROS 1 are others"):
        Wire(Types()).message_class("visualization_msgs/Marker")


def test_values_that_are_wrong_are_told() -> None:
    """Which field, before anything is sent."""
    types = Types()
    service = types.add_service_of("Move", {"speed": "float64"}, {})
    with pytest.raises(BadValue, match="speed is 'fast'"):
        Wire(types).encode_fields(service.request, {"speed": "fast"})
    with pytest.raises(BadValue, match="sped is no field"):
        Wire(types).encode_fields(service.request, {"sped": 1.0})
