"""Messages: checked field by field, built from plain numbers and back."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grounding import messages
from grounding.messages import (
    Float64MultiArray,
    LaserScan,
    MultiArrayLayout,
    Odometry,
    Path,
    PointStamped,
    PoseStamped,
    PoseWithCovariance,
    Time,
    Twist,
    TwistWithCovariance,
    Vector3,
    header,
    planar_pose,
    pose_stamped,
    problem_with,
    quaternion_of,
    stamp_of,
    stamp_s,
    type_name,
    xyyaw,
    yaw_of,
)

ZERO = Vector3(x=0.0, y=0.0, z=0.0)


def scan(**changed: object) -> LaserScan:
    """A scan of two beams, with some fields changed."""
    fields: dict[str, object] = {
        "header": header("r1/laser", 1.0),
        "angle_min": -0.1,
        "angle_max": 0.1,
        "angle_increment": 0.2,
        "time_increment": 0.0,
        "scan_time": 0.0,
        "range_min": 0.05,
        "range_max": 12.0,
        "ranges": np.array([1.0, math.inf], dtype=np.float32),
        "intensities": np.zeros(0, dtype=np.float32),
    }
    return LaserScan(**{**fields, **changed})  # type: ignore[arg-type]


def path(*poses: object) -> Path:
    """A path, of poses if it is to be right."""
    return Path(header=header("map", 0.0), poses=list(poses))  # type: ignore[arg-type]


def odometry(*, w: object = 1.0, covariance: object = None) -> Odometry:
    """An odometry reading whose heading or covariance may be changed."""
    pose = planar_pose(0.0, 0.0, 0.0)
    pose.orientation.w = w  # type: ignore[assignment]
    square = np.zeros(36)
    spread = square if covariance is None else covariance
    return Odometry(
        header=header("r1/odom", 0.0),
        child_frame_id="r1/base_link",
        pose=PoseWithCovariance(pose=pose, covariance=spread),  # type: ignore[arg-type]
        twist=TwistWithCovariance(twist=Twist(linear=ZERO, angular=ZERO), covariance=square),
    )


POSE = pose_stamped(1.0, 2.0, 0.5, t_s=1.0)


@pytest.mark.parametrize(
    ("message_type", "value"),
    [
        ("sensor_msgs/LaserScan", scan()),
        ("sensor_msgs/LaserScan", scan(angle_min=1, range_min=np.float32(0.05))),
        ("nav_msgs/Path", path()),
        ("nav_msgs/Path", path(POSE, POSE)),
        ("nav_msgs/Odometry", odometry()),
        ("geometry_msgs/PoseStamped", POSE),
        (
            "std_msgs/Float64MultiArray",
            Float64MultiArray(layout=MultiArrayLayout(dim=[], data_offset=0), data=np.zeros(4)),
        ),
        ("float64", 1.5),
        ("float64", 3),
        ("float64", np.float64(3)),
        ("float64", math.inf),
        ("int64", 3),
        ("int64", np.int32(3)),
        ("bool", True),
        ("bool", np.bool_(False)),
        ("string", ""),
    ],
)
def test_what_is_right_has_no_problem(message_type: str, value: object) -> None:
    """Whole numbers pass as floats; numpy's own numbers pass as numbers."""
    assert problem_with(message_type, value) == ""


@pytest.mark.parametrize(
    ("message_type", "value", "problem"),
    [
        ("float64", True, "is bool, not float64"),
        ("float64", "1.0", "is str, not float64"),
        ("float64", None, "is NoneType, not float64"),
        ("int64", False, "is bool, not int64"),
        ("int64", 1.0, "is float, not int64"),
        ("bool", 1, "is int, not bool"),
        ("bool", None, "is NoneType, not bool"),
        ("string", b"text", "is bytes, not string"),
        ("geometry_msgs/Twist", None, "is NoneType, not geometry_msgs/Twist"),
        ("geometry_msgs/Twist", {"linear": ZERO}, "is dict, not geometry_msgs/Twist"),
        ("geometry_msgs/Twist", ZERO, "is geometry_msgs/Vector3, not geometry_msgs/Twist"),
        ("geometry_msgs/Twist", Twist(linear=ZERO, angular=None), ".angular is NoneType, not geometry_msgs/Vector3"),  # type: ignore[arg-type]
        ("geometry_msgs/Vector3", Vector3(x=0.0, y=True, z=0.0), ".y is bool, not float64"),
        (
            "geometry_msgs/Twist",
            Twist(linear=ZERO, angular=Vector3(x=0.0, y=0.0, z="fast")),  # type: ignore[arg-type]
            ".angular.z is str, not float64",
        ),
        ("nav_msgs/Odometry", odometry(w=None), ".pose.pose.orientation.w is NoneType, not float64"),
        ("nav_msgs/Odometry", odometry(covariance=[0.0] * 36), ".pose.covariance is no array of float64"),
        ("sensor_msgs/LaserScan", scan(ranges=[1.0, 2.0]), ".ranges is no array of float32"),
        ("sensor_msgs/LaserScan", scan(ranges=np.zeros((2, 1), dtype=np.float32)), ".ranges is no array of float32"),
        ("sensor_msgs/LaserScan", scan(ranges=np.zeros(2)), ".ranges is no array of float32"),
        ("sensor_msgs/LaserScan", scan(range_max="far"), ".range_max is str, not float32"),
        ("sensor_msgs/LaserScan", scan(header=header(7, 0.0)), ".header.frame_id is int, not string"),  # type: ignore[arg-type]
        (
            "sensor_msgs/LaserScan",
            scan(header=messages.Header(stamp=Time(sec=0.5, nanosec=0), frame_id="")),  # type: ignore[arg-type]
            ".header.stamp.sec is float, not int32",
        ),
        ("nav_msgs/Path", path(POSE, ZERO), ".poses[1] is geometry_msgs/Vector3, not geometry_msgs/PoseStamped"),
        (
            "nav_msgs/Path",
            path(POSE, POSE, pose_stamped(1.0, "two", 0.0, t_s=0.0)),  # type: ignore[arg-type]
            ".poses[2].pose.position.y is str, not float64",
        ),
        ("nav_msgs/Path", Path(header=header("map", 0.0), poses=(POSE,)), ".poses is tuple, not list"),  # type: ignore[arg-type]
    ],
)
def test_what_is_wrong_is_named_by_its_path(message_type: str, value: object, problem: str) -> None:
    """Down to the field of the message in the list of the message."""
    assert problem_with(message_type, value) == problem


@pytest.mark.parametrize("length", [0, 35, 37])
def test_an_array_of_fixed_length_has_that_length(length: int) -> None:
    """A covariance is 6 by 6."""
    wrong = odometry(covariance=np.zeros(length))
    assert problem_with("nav_msgs/Odometry", wrong) == f".pose.covariance has {length} elements, not 36"


def test_types_are_named_as_in_ros() -> None:
    """What is no message is named by its Python type."""
    assert type_name(POSE) == "geometry_msgs/PoseStamped"
    assert type_name(PointStamped(header=header("map", 0.0), point=POSE.pose.position)) == "geometry_msgs/PointStamped"
    assert (type_name(None), type_name(True), type_name([])) == ("NoneType", "bool", "list")


def test_all_names_are_exported_in_order() -> None:
    """Classes, then functions, each by the alphabet."""
    assert [name for name in messages.__all__ if not hasattr(messages, name)] == []
    assert sorted(messages.__all__) == messages.__all__


@given(st.floats(0.0, 1e6))
def test_a_time_goes_there_and_back(t_s: float) -> None:
    """To the nanosecond, and never with a second's worth of nanoseconds."""
    stamp = stamp_of(t_s)
    assert 0 <= stamp.nanosec < 1_000_000_000
    assert stamp_s(stamp) == pytest.approx(t_s, abs=1e-9, rel=1e-15)


@given(st.floats(-100.0, 100.0), st.floats(-100.0, 100.0), st.floats(-3.14, 3.14))
def test_a_pose_goes_there_and_back(x_m: float, y_m: float, yaw_rad: float) -> None:
    """On the floor: no height, no roll, no pitch, a unit quaternion."""
    pose = planar_pose(x_m, y_m, yaw_rad)
    assert xyyaw(pose) == pytest.approx((x_m, y_m, yaw_rad))
    q = pose.orientation
    assert (pose.position.z, q.x, q.y) == (0.0, 0.0, 0.0)
    assert q.x**2 + q.y**2 + q.z**2 + q.w**2 == pytest.approx(1.0)


@pytest.mark.parametrize("turns", [-2, -1, 1, 2])
def test_whole_turns_make_no_difference(turns: int) -> None:
    """A heading is told between -pi and pi."""
    assert yaw_of(quaternion_of(1.0 + turns * math.tau)) == pytest.approx(1.0)


def test_a_stamped_pose_tells_frame_and_time() -> None:
    """The map, unless told otherwise."""
    pose = pose_stamped(1.0, 2.0, 0.0, t_s=1.25)
    assert isinstance(pose, PoseStamped)
    assert (pose.header.frame_id, pose.header.stamp) == ("map", Time(sec=1, nanosec=250_000_000))
    assert pose_stamped(1.0, 2.0, 0.0, t_s=0.0, frame_id="r1/odom").header.frame_id == "r1/odom"
