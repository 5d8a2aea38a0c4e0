from __future__ import annotations

import contextlib
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grounding.messages import (
    Header,
    Image,
    LaserScan,
    Odometry,
    PoseStamped,
    Time,
    planar_pose,
    pose_stamped,
    problem_with,
    type_name,
)
from grounding.messages import Path as NavPath
from grounding.rosbridge.framing import Decoder, frames
from grounding.rosbridge.operations import Publish
from grounding.rosbridge.types import Field, Types, UnknownType, standard
from grounding.rosbridge.values import (
    BadValue,
    default,
    fields_from_tree,
    fields_to_tree,
    from_bytes,
    from_tree,
    to_bytes,
    to_tree,
)

_NOW_S = 12.5
_MESSAGES = [name for name in standard().names() if "/msg/" in name]


def _scan(ranges: list[float]) -> LaserScan:
    scan = default("sensor_msgs/LaserScan")
    assert isinstance(scan, LaserScan)
    scan.ranges = np.array(ranges, np.float32)
    return scan


def test_a_message_becomes_a_tree_by_its_fields() -> None:
    """Objects by the names of the fields, numbers as numbers, times as ROS 2 names them."""
    tree = to_tree(pose_stamped(1.0, 2.0, 0.0, t_s=3.25))
    assert tree == {
        "header": {"stamp": {"sec": 3, "nanosec": 250_000_000}, "frame_id": "map"},
        "pose": {
            "position": {"x": 1.0, "y": 2.0, "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        },
    }
    assert from_tree("geometry_msgs/PoseStamped", tree, now_s=0.0) == pose_stamped(1.0, 2.0, 0.0, t_s=3.25)


def test_bytes_are_base64_in_json_and_bytes_else() -> None:
    """An image's data are a text for JSON, and stay an array for CBOR."""
    image = default("sensor_msgs/Image")
    assert isinstance(image, Image)
    image.data = np.array([0, 1, 255], np.uint8)
    assert to_tree(image)["data"] == "AAH/"
    exact = to_tree(image, numbers="exact")["data"]
    assert isinstance(exact, np.ndarray)
    assert exact.tobytes() == b"\x00\x01\xff"


@pytest.mark.parametrize(
    "given_data", ["AAH/", [0, 1, 255], b"\x00\x01\xff", np.array([0, 1, 255], np.int64), [0.0, 1, 255.0]]
)
def test_bytes_are_read_however_they_come(given_data: object) -> None:
    """As base64, as a list, as bytes, as an array of another type, and as numbers with a point."""
    image = from_tree("sensor_msgs/Image", {"data": given_data}, now_s=0.0)
    assert isinstance(image, Image)
    assert problem_with("sensor_msgs/Image", image) == ""
    assert image.data.tolist() == [0, 1, 255]


def test_nan_and_infinity_are_null_in_json_and_themselves_else() -> None:
    """Null is read as NaN, and numbers that are exact keep their infinity."""
    scan = _scan([1.5, math.nan])
    scan.range_max = math.inf
    assert to_tree(scan)["range_max"] is None
    assert to_tree(scan, numbers="exact")["range_max"] == math.inf
    back = from_tree("sensor_msgs/LaserScan", {"range_max": None, "ranges": [1.5, None]}, now_s=0.0)
    assert isinstance(back, LaserScan)
    assert math.isnan(back.range_max)
    assert back.ranges.dtype == np.float32
    assert np.array_equal(back.ranges, scan.ranges, equal_nan=True)


def test_null_is_no_whole_number_text_or_truth_value() -> None:
    """It stands for NaN alone."""
    for message_type in ("std_msgs/Int32", "std_msgs/String", "std_msgs/Bool", "std_msgs/Header"):
        field = "frame_id" if message_type.endswith("Header") else "data"
        with pytest.raises(BadValue, match=f"^{field} is null, should be"):
            from_tree(message_type, {field: None}, now_s=0.0)


@pytest.mark.parametrize("stamp", [{"sec": 7, "nanosec": 8}, {"secs": 7, "nsecs": 8}])
def test_times_are_read_as_either_ros_names_them(stamp: dict[str, int]) -> None:
    """ROS 1 calls them secs and nsecs; both are read."""
    assert from_tree("std_msgs/Header", {"stamp": stamp}, now_s=0.0) == Header(
        stamp=Time(sec=7, nanosec=8), frame_id=""
    )


def test_now_is_a_time_but_no_duration() -> None:
    """The text now stands for the time that is given."""
    now = Time(sec=12, nanosec=500_000_000)
    assert from_tree("std_msgs/Header", {"stamp": "now"}, now_s=_NOW_S) == Header(stamp=now, frame_id="")
    with pytest.raises(BadValue, match=r"^lifetime is 'now', should be an object with sec and nanosec$"):
        from_tree("visualization_msgs/Marker", {"lifetime": "now"}, now_s=_NOW_S)


def test_a_header_that_is_missing_is_of_now_and_so_is_a_missing_stamp() -> None:
    """The protocol's section 3.2.3; a stamp that is given stays."""
    now = Time(sec=12, nanosec=500_000_000)
    trees: list[dict[str, object]] = [{}, {"header": {}}, {"header": {"frame_id": ""}}]
    for tree in trees:
        pose = from_tree("geometry_msgs/PoseStamped", tree, now_s=_NOW_S)
        assert isinstance(pose, PoseStamped)
        assert pose.header == Header(stamp=now, frame_id="")
    path = from_tree("nav_msgs/Path", {"poses": [{"header": {"stamp": {}}}]}, now_s=_NOW_S)
    assert isinstance(path, NavPath)
    assert path.poses[0].header.stamp == Time(sec=0, nanosec=0)


def test_missing_fields_are_0_false_or_empty() -> None:
    """So does ROS make new messages, and lists of fixed length have it."""
    odometry = from_tree("nav_msgs/Odometry", {"pose": {"pose": {"position": {"x": 1}}}}, now_s=0.0)
    assert isinstance(odometry, Odometry)
    assert problem_with("nav_msgs/Odometry", odometry) == ""
    assert odometry.pose.pose.position.x == 1.0
    assert odometry.pose.covariance.tolist() == [0.0] * 36


def test_a_list_gives_the_fields_in_their_order() -> None:
    """As the protocol allows for arguments; fewer are filled up, more are wrong, and no list is an empty one."""
    assert fields_from_tree("example_interfaces/srv/AddTwoInts_Request", [1, 2], now_s=0.0) == {"a": 1, "b": 2}
    assert fields_from_tree("example_interfaces/srv/AddTwoInts_Request", [1], now_s=0.0) == {"a": 1, "b": 0}
    assert fields_from_tree("example_interfaces/srv/AddTwoInts_Request", None, now_s=0.0) == {"a": 0, "b": 0}
    with pytest.raises(BadValue, match=r"is a list of 3 values, .* has 2 fields"):
        fields_from_tree("example_interfaces/srv/AddTwoInts_Request", [1, 2, 3], now_s=0.0)


def test_optional_fields_may_stay_away() -> None:
    """A service can tell what was not said from what was said to be 0."""
    read = fields_from_tree("example_interfaces/srv/AddTwoInts_Request", {}, now_s=0.0, optional=("b",))
    assert read == {"a": 0}
    assert fields_to_tree("example_interfaces/srv/AddTwoInts_Request", {"a": 4}) == {"a": 4}


def test_both_forms_of_a_type_s_name_are_read() -> None:
    """With and without msg in the middle."""
    assert from_tree("geometry_msgs/msg/Twist", {}, now_s=0.0) == from_tree("geometry_msgs/Twist", {}, now_s=0.0)


def test_messages_without_fields_are_empty_objects() -> None:
    """The field that ROS 2 gives them is never on the wire."""
    empty = from_tree("std_msgs/Empty", {}, now_s=0.0)
    assert to_tree(empty) == {}
    with pytest.raises(BadValue, match=r"^structure_needs_at_least_one_member is no field"):
        from_tree("std_msgs/Empty", {"structure_needs_at_least_one_member": 0}, now_s=0.0)


def test_whole_numbers_keep_all_64_bits() -> None:
    """Single ones and those in lists."""
    for kind, number in (("UInt64", 2**64 - 1), ("Int64", -(2**63)), ("Int64", 2**53 + 1)):
        message: Any = from_tree(f"std_msgs/{kind}", {"data": number}, now_s=0.0)
        assert message.data == number
        assert to_tree(message) == {"data": number}
        array: Any = from_tree(f"std_msgs/{kind}MultiArray", {"data": [number]}, now_s=0.0)
        assert array.data.tolist() == [number]


@pytest.mark.parametrize(
    ("message_type", "tree", "path", "what"),
    [
        ("geometry_msgs/Twist", 3, "", "is 3, should be an object with the fields of geometry_msgs/msg/Twist"),
        ("geometry_msgs/Twist", {"linear": [1, 2, 3]}, "linear", "is a list, should be an object"),
        ("geometry_msgs/Twist", {"linear": {"x": "1"}}, "linear.x", "is '1', should be a number (float64)"),
        ("geometry_msgs/Twist", {"linear": {"x": True}}, "linear.x", "is true, should be a number"),
        ("geometry_msgs/Twist", {"linear": {"x": 10**400}}, "linear.x", "is a very large number, float64 goes to"),
        ("geometry_msgs/Twist", {"lin": {}}, "lin", "is no field of geometry_msgs/msg/Twist, which has linear, a"),
        ("std_msgs/Empty", {"a": 1}, "a", "is no field of std_msgs/msg/Empty, which has none"),
        ("std_msgs/UInt8", {"data": 300}, "data", "is 300, uint8 goes from 0 to 255"),
        ("std_msgs/Byte", {"data": -1}, "data", "is -1, byte goes from 0 to 255"),
        ("std_msgs/Int8", {"data": 1.5}, "data", "is 1.5, should be a whole number (int8)"),
        ("std_msgs/Int64", {"data": 2**63}, "data", "is 9223372036854775808, int64 goes from"),
        ("std_msgs/Int64", {"data": 1e18}, "data", "is 1e+18, should be a whole number"),
        ("std_msgs/Bool", {"data": 1}, "data", "is 1, should be true or false"),
        ("std_msgs/String", {"data": 5}, "data", "is 5, should be a text"),
        ("std_msgs/Float32", {"data": 1e39}, "data", "is 1e+39, float32 goes to 3.40282e+38"),
        ("std_msgs/Header", {"stamp": 3}, "stamp", "should be an object with sec and nanosec or the text now"),
        ("std_msgs/Header", {"stamp": "later"}, "stamp", "is 'later'"),
        ("std_msgs/Header", {"stamp": {"sec": 2**31}}, "stamp.sec", "is 2147483648, int32 goes from"),
        ("std_msgs/Header", {"stamp": {"nsecs": -1}}, "stamp.nsecs", "is -1, uint32 goes from"),
        ("std_msgs/Header", {"stamp": {"ns": 1}}, "stamp.ns", "is no field of a time"),
        ("std_msgs/Header", {"stamp": np.zeros(2)}, "stamp", "is a ndarray"),
        ("nav_msgs/Path", {"poses": {}}, "poses", "is an object, should be a list of geometry_msgs/msg/PoseStamped"),
        ("nav_msgs/Path", {"poses": [{}, {"pose": 1}]}, "poses[1].pose", "is 1, should be an object"),
        ("sensor_msgs/LaserScan", {"ranges": [1, "a"]}, "ranges[1]", "is 'a', should be a number (float32)"),
        ("sensor_msgs/LaserScan", {"ranges": [1, 1e39]}, "ranges[1]", "is 1e+39, float32 goes to"),
        ("sensor_msgs/LaserScan", {"ranges": [True]}, "ranges[0]", "is true"),
        ("sensor_msgs/LaserScan", {"ranges": "AAAA"}, "ranges", "is 'AAAA', should be a list of float32"),
        ("sensor_msgs/LaserScan", {"ranges": np.array([1e39])}, "ranges", "is an array of float64 with values that fl"),
        ("sensor_msgs/Image", {"data": [1, 256]}, "data[1]", "is 256, uint8 goes from 0 to 255"),
        ("sensor_msgs/Image", {"data": [1, None]}, "data[1]", "is null, should be a whole number"),
        ("sensor_msgs/Image", {"data": "A"}, "data", "is a text that is no base64"),
        ("sensor_msgs/Image", {"data": "Ü"}, "data", "is a text that is no base64"),
        ("sensor_msgs/Image", {"data": np.array([-1])}, "data", "is an array of int64 with values that uint8"),
        ("sensor_msgs/Image", {"data": np.array([0.5])}, "data", "is an array of float64 with values that uint8"),
        ("sensor_msgs/Image", {"data": np.array([np.nan])}, "data", "is an array of float64 with values that uint8"),
        ("std_msgs/UInt64MultiArray", {"data": np.array([2.0**64])}, "data", "is an array of float64 with values that"),
        ("std_msgs/Int64MultiArray", {"data": np.array([-(2.0**63)])}, "data", "is an array of float64 with values"),
        ("std_msgs/UInt64MultiArray", {"data": np.array([-1])}, "data", "is an array of int64 with values that uint64"),
        ("std_msgs/Int64MultiArray", {"data": np.array([2**64 - 1], np.uint64)}, "data", "with values that int64"),
        ("nav_msgs/Odometry", {"pose": {"covariance": [1.0]}}, "pose.covariance", "has 1 elements, should have 36"),
        ("unique_identifier_msgs/UUID", {"uuid": "AAAA"}, "uuid", "has 3 elements, should have 16"),
        ("sensor_msgs/JointState", {"name": ["a", 1]}, "name[1]", "is 1, should be a text"),
        ("shape_msgs/SolidPrimitive", {"dimensions": [1, 2, 3, 4]}, "dimensions", "has 4 elements, 3 are allowed"),
    ],
)  # fmt: skip
def test_wrong_values_are_told_by_path(message_type: str, tree: object, path: str, what: str) -> None:
    """Where it is, what it is, and what it should be."""
    with pytest.raises(BadValue) as caught:
        from_tree(message_type, tree, now_s=0.0)
    assert caught.value.path == path
    assert what in caught.value.what
    assert str(caught.value).startswith(path or "the message")


@pytest.mark.parametrize(
    ("change", "path"),
    [
        ({"header": None}, "header"),
        ({"ranges": None}, "ranges"),
        ({"ranges": [1.0, "x"]}, "ranges[1]"),
        ({"angle_min": "x"}, "angle_min"),
        ({"header": Header(stamp=Time(sec=0, nanosec=0), frame_id=7)}, "header.frame_id"),  # type: ignore[arg-type]
    ],
)
def test_messages_that_are_not_what_their_type_says_are_not_sent(change: dict[str, object], path: str) -> None:
    """A handler's mistake is told where it is made, not at the other end."""
    scan = _scan([1.0])
    for name, value in change.items():
        setattr(scan, name, value)
    with pytest.raises(BadValue) as caught:
        to_tree(scan)
    assert caught.value.path == path


def test_other_layouts_of_arrays_are_sent_right() -> None:
    """A list, a tuple, another type with the same numbers, or an array with gaps, as handlers have them."""
    for ranges in ([1.0, 2.0], (1.0, 2.0), np.array([1.0, 2.0]), np.array([1.0, 9.0, 2.0], np.float32)[::2]):
        scan = _scan([])
        scan.ranges = ranges  # type: ignore[assignment]
        sent = to_tree(scan)["ranges"]
        assert isinstance(sent, np.ndarray)
        assert sent.dtype == np.float32
        assert sent.flags.c_contiguous
        assert sent.tolist() == [1.0, 2.0]


def test_what_is_no_message_is_told() -> None:
    """A value without a ROS type, and a type that there is not."""
    with pytest.raises(UnknownType, match="type dict"):
        to_tree({"a": 1})
    with pytest.raises(UnknownType, match="type no/Such: there is no message type of this name"):
        from_tree("no/Such", {}, now_s=0.0)
    with pytest.raises(BadValue, match=r"^pose is geometry_msgs/msg/Pose, should be geometry_msgs/msg/PoseStamped$"):
        fields_to_tree("nav2_msgs/action/NavigateToPose_Goal", {"pose": planar_pose(0.0, 0.0, 0.0)})
    with pytest.raises(BadValue, match=r"^speed is no field of nav2_msgs/action/NavigateToPose_Goal"):
        fields_to_tree("nav2_msgs/action/NavigateToPose_Goal", {"speed": 1.0})


def test_arrays_of_cbor_are_not_copied() -> None:
    """What comes as a typed array of the right type is the message's array itself, over the bytes of the frame."""
    ranges = np.arange(3, dtype=np.float32)
    scan = from_tree("sensor_msgs/LaserScan", {"ranges": ranges}, now_s=0.0)
    assert isinstance(scan, LaserScan)
    assert scan.ranges is ranges
    data = b"\x00" * 1000
    image = from_tree("sensor_msgs/Image", {"data": data}, now_s=0.0)
    assert isinstance(image, Image)
    assert np.shares_memory(image.data, np.frombuffer(data, np.uint8))


# ---------------------------------------------------------------------- every type, any value

_NUMBERS = {
    **{f"{sign}int{bits}": (0 if sign else -(2 ** (bits - 1)), 2 ** (bits - (not sign)) - 1)
       for sign in ("", "u") for bits in (8, 16, 32, 64)},
    "byte": (0, 127), "char": (0, 255),  # rosbags cannot serialize a single byte above 127
}  # fmt: skip


def _single(kind: str) -> st.SearchStrategy[Any]:
    if kind == "bool":
        return st.booleans()
    if kind == "string":
        return st.text(max_size=8)
    if kind.startswith("float"):
        return st.floats(width=32 if kind == "float32" else 64, allow_nan=False)
    return st.integers(*_NUMBERS[kind])


def _field(field: Field) -> st.SearchStrategy[Any]:
    one = _trees(field.kind) if field.is_message else _single(field.kind)
    if field.length is None:
        return one
    most = field.length or field.bound or 3
    return st.lists(one, min_size=field.length, max_size=min(most, max(field.length, 3)))


def _trees(message_type: str) -> st.SearchStrategy[Any]:
    fields = standard().fields(message_type)
    return st.fixed_dictionaries({field.name: _field(field) for field in fields})


@pytest.mark.parametrize("message_type", _MESSAGES)
def test_every_type_has_a_default_that_is_right_and_arrives(message_type: str) -> None:
    """All message types that ship: by tree in both encodings, and by bytes."""
    message = default(message_type)
    assert type_name(message).replace("/", "/msg/", 1) == message_type
    for numbers, compression in (("json", "none"), ("exact", "cbor")):
        tree = to_tree(message, numbers=numbers)  # type: ignore[arg-type]
        (frame,) = frames(Publish(topic="/a", msg=tree), compression=compression)
        received = Decoder().feed(frame, 0.0)
        assert isinstance(received, Publish)
        back = from_tree(message_type, received.msg, now_s=99.0)
        assert to_bytes(back) == to_bytes(message)
    assert to_bytes(from_bytes(message_type, to_bytes(message))) == to_bytes(message)


@settings(deadline=None, derandomize=True)
@given(st.sampled_from(_MESSAGES), st.data())
def test_any_message_arrives_bit_for_bit(message_type: str, data: st.DataObject) -> None:
    """Random messages of all types, by JSON and by CBOR: their bytes in CDR are equal, but for infinity in JSON."""
    tree = data.draw(_trees(message_type))
    message = from_tree(message_type, tree, now_s=0.0)
    for numbers, compression in (("json", "none"), ("exact", "cbor")):
        if compression == "none" and "inf" in repr(tree):
            continue
        sent = to_tree(message, numbers=numbers)  # type: ignore[arg-type]
        (frame,) = frames(Publish(topic="/a", msg=sent), compression=compression)
        received = Decoder().feed(frame, 0.0)
        assert isinstance(received, Publish)
        assert to_bytes(from_tree(message_type, received.msg, now_s=0.0)) == to_bytes(message)


_ANY = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4) | st.binary(max_size=4)
    | st.sampled_from([np.array([1.5, np.nan]), np.array([], np.int8), np.array([300]), np.array([True]),
                       np.array(["a"]), np.zeros((2, 2)), np.array([2**64 - 1], np.uint64)]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=2),
    max_leaves=5,
)  # fmt: skip


@settings(deadline=None, derandomize=True)
@given(st.sampled_from(_MESSAGES), st.data())
def test_a_wrong_value_anywhere_is_a_message_or_a_reason(message_type: str, data: st.DataObject) -> None:
    """Random trees with one part replaced by anything: a message that its type allows, or BadValue."""
    tree = data.draw(_trees(message_type))
    node: Any = tree
    while True:
        keys = list(node) if isinstance(node, dict) else range(len(node))
        if not keys:
            break
        key = data.draw(st.sampled_from(keys))
        if isinstance(node[key], dict | list) and node[key] and data.draw(st.booleans()):
            node = node[key]
            continue
        node[key] = data.draw(_ANY)
        break
    with contextlib.suppress(BadValue):
        message = from_tree(message_type, tree, now_s=0.0)
        assert to_bytes(from_bytes(message_type, to_bytes(message))) == to_bytes(message)


@settings(deadline=None, derandomize=True)
@given(st.binary(max_size=200), st.sampled_from(["sensor_msgs/LaserScan", "nav_msgs/Path", "sensor_msgs/JointState"]))
def test_any_bytes_are_a_message_or_a_reason(data: bytes, message_type: str) -> None:
    """Nothing but BadValue comes out of serialized bytes."""
    for types in (standard(2), standard(1)):
        with contextlib.suppress(BadValue):
            from_bytes(message_type, b"\x00\x01\x00\x00" + data if types.ros_version == 2 else data, types=types)


# --------------------------------------------------------------------------------------- ROS 1


def test_ros_1_has_its_own_header_and_times() -> None:
    """`seq` in headers, secs and nsecs in times; both names of times are read."""
    types = standard(1)
    header: Any = from_tree("std_msgs/Header", {"stamp": {"sec": 3, "nsecs": 4}}, now_s=0.0, types=types)
    assert to_tree(header, types=types) == {"seq": 0, "stamp": {"secs": 3, "nsecs": 4}, "frame_id": ""}
    stamped: Any = from_tree("geometry_msgs/PoseStamped", {}, now_s=_NOW_S, types=types)
    assert to_tree(stamped, types=types)["header"] == {
        "seq": 0, "stamp": {"secs": 12, "nsecs": 500_000_000}, "frame_id": "",
    }  # fmt: skip


@pytest.mark.parametrize("name", ["sensor_msgs/LaserScan", "nav_msgs/Odometry", "std_msgs/Time", "actionlib/TestGoal"])
def test_messages_of_ros_1_arrive(name: str) -> None:
    """By tree and by ROS 1's own bytes."""
    types = standard(1)
    message = default(name, types=types)
    back = from_tree(name, to_tree(message, types=types, numbers="exact"), now_s=99.0, types=types)
    assert to_bytes(back, types=types) == to_bytes(message, types=types)
    assert to_bytes(from_bytes(name, to_bytes(message, types=types), types=types), types=types) == to_bytes(
        message, types=types
    )


def test_types_of_one_registry_do_not_leak_into_another() -> None:
    """A type that is added to one is unknown to the others."""
    types = Types()
    types.add("msg", "my_msgs/Lamp", "bool on\nstring<=3 name\n")
    assert from_tree("my_msgs/Lamp", {"on": True}, now_s=0.0, types=types) is not None
    with pytest.raises(BadValue, match=r"^name has 4 characters, 3 are allowed$"):
        from_tree("my_msgs/Lamp", {"name": "long"}, now_s=0.0, types=types)
    with pytest.raises(UnknownType):
        from_tree("my_msgs/Lamp", {}, now_s=0.0)


@pytest.mark.parametrize(
    ("message_type", "tree"),
    [
        ("x" * 5_000, {}),
        ("std_msgs/String", {"x" * 5_000: 1}),
        ("std_msgs/Header", {"stamp": {"x" * 5_000: 1}}),
        ("std_msgs/Header", {"stamp": "x" * 5_000}),
        ("std_msgs/Int8", {"data": 10**4_000}),
        ("std_msgs/Int8", {"data": [[0] * 5_000]}),
    ],
)
def test_reasons_stay_short_however_long_the_value_is(message_type: str, tree: object) -> None:
    """A megabyte that is wrong is not sent back in the reason."""
    with pytest.raises((BadValue, UnknownType)) as caught:
        from_tree(message_type, tree, now_s=0.0)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize(
    ("tree", "reason"),
    [
        ({"corners": [{}]}, "corners has 1 elements, should have 2"),
        ({"names": ["a", "b", "c"]}, "names has 3 elements, 2 are allowed"),
        ({"names": ["a", "long"]}, "names[1] has 4 characters, 3 are allowed"),
    ],
)
def test_lists_of_messages_and_texts_keep_their_lengths(tree: object, reason: str) -> None:
    """Of fixed length and with a bound; a default has the fixed length."""
    types = Types()
    types.add("msg", "my_msgs/Zone", "geometry_msgs/Point[2] corners\nstring<=3[<=2] names\n")
    with pytest.raises(BadValue) as caught:
        from_tree("my_msgs/Zone", tree, now_s=0.0, types=types)
    assert str(caught.value) == reason
    assert to_tree(default("my_msgs/Zone", types=types), types=types) == {
        "corners": [{"x": 0.0, "y": 0.0, "z": 0.0}] * 2,
        "names": [],
    }


def test_numbers_and_times_of_other_kinds_in_messages() -> None:
    """A numpy number is a number, a number is no time."""
    scan = _scan([])
    scan.angle_min = np.float32(1.5)  # type: ignore[assignment]
    assert to_tree(scan)["angle_min"] == 1.5
    assert isinstance(to_tree(scan)["angle_min"], float)
    scan.header.stamp = 3.5  # type: ignore[assignment]
    with pytest.raises(BadValue, match=r"^header\.stamp is 3\.5, should be builtin_interfaces/msg/Time$"):
        to_tree(scan)


def test_what_cannot_be_serialized_is_told() -> None:
    """A single byte above 127 goes through trees, but rosbags has no bytes for it."""
    message = from_tree("std_msgs/Byte", {"data": 200}, now_s=0.0)
    assert to_tree(message) == {"data": 200}
    with pytest.raises(BadValue, match="cannot be serialized as std_msgs/msg/Byte"):
        to_bytes(message)
