from __future__ import annotations

from typing import Any

import pytest

from grounding.rosbridge.types import Field, ServiceType, TypeDetails, Types, UnknownType, short_name, standard
from grounding.rosbridge.values import from_bytes, from_tree, to_bytes, to_tree

_ROSAPI = [
    "Topics", "TopicsForType", "TopicsAndRawTypes", "TopicType", "Services", "ServicesForType", "ServiceType",
    "ServiceRequestDetails", "ServiceResponseDetails", "MessageDetails", "Nodes", "NodeDetails", "GetActionServers",
    "Publishers", "Subscribers", "ServiceNode", "ServiceProviders", "GetParam", "SetParam", "HasParam", "DeleteParam",
    "GetParamNames", "GetTime", "GetROSVersion",
]  # fmt: skip


@pytest.mark.parametrize("name", ["sensor_msgs/LaserScan", "sensor_msgs/msg/LaserScan"])
def test_a_message_type_has_two_names(name: str) -> None:
    """Short and full; the full one is what we use."""
    assert standard().message(name) == "sensor_msgs/msg/LaserScan"


@pytest.mark.parametrize("name", ["", "/", "LaserScan", "sensor_msgs/laserscan", "a/b/c/d", "std_srvs/SetBool", "../x"])
def test_what_is_no_message_type_is_told(name: str) -> None:
    """With its name as it was given."""
    with pytest.raises(UnknownType, match="there is no message type of this name") as caught:
        standard().message(name)
    assert caught.value.name == name


def test_a_service_type_has_a_request_and_a_reply() -> None:
    """Message types of their own, with the fields of the two halves of its file."""
    types = standard()
    trigger = types.service("std_srvs/SetBool")
    assert trigger == types.service("std_srvs/srv/SetBool")
    assert trigger == ServiceType(
        name="std_srvs/srv/SetBool", request="std_srvs/srv/SetBool_Request", reply="std_srvs/srv/SetBool_Response"
    )
    assert [(field.name, field.kind) for field in types.fields(trigger.request)] == [("data", "bool")]
    assert [(field.name, field.kind) for field in types.fields(trigger.reply)] == [
        ("success", "bool"), ("message", "string"),
    ]  # fmt: skip


def test_an_action_type_has_goal_result_and_feedback() -> None:
    """In the order of the parts of its file."""
    types = standard()
    navigate = types.action("nav2_msgs/NavigateToPose")
    assert navigate.name == "nav2_msgs/action/NavigateToPose"
    assert [field.name for field in types.fields(navigate.goal)] == ["pose", "behavior_tree"]
    assert [field.name for field in types.fields(navigate.result)] == ["error_code", "error_msg"]
    assert types.fields(navigate.feedback)[0].kind == "geometry_msgs/msg/PoseStamped"


@pytest.mark.parametrize("name", _ROSAPI)
def test_all_services_of_rosapi_have_a_type_under_both_names_of_the_package(name: str) -> None:
    """Clients say rosapi, as in ROS 1; ROS 2 calls the package rosapi_msgs."""
    for types in (standard(2), standard(1)):
        assert types.service(f"rosapi/{name}") == types.service(f"rosapi_msgs/srv/{name}")


def test_a_service_is_no_action_and_no_message() -> None:
    """Each kind of type has its own names."""
    with pytest.raises(UnknownType, match="no action type"):
        standard().action("std_srvs/SetBool")
    with pytest.raises(UnknownType, match="no service type"):
        standard().service("nav2_msgs/NavigateToPose")
    with pytest.raises(UnknownType, match="no service type"):
        standard().service("std_srvs/srv/SetBool_Request")


def test_names_lists_every_type_once_and_no_parts() -> None:
    """Full names, sorted; requests and goals are no types of their own there."""
    names = standard().names()
    assert names == sorted(set(names))
    assert {"sensor_msgs/msg/LaserScan", "std_srvs/srv/SetBool", "nav2_msgs/action/NavigateToPose"} <= set(names)
    assert not [name for name in names if name.endswith(("_Request", "_Response", "_Goal", "_Result", "_Feedback"))]


def test_fields_tell_single_values_from_lists() -> None:
    """Of any length, of a fixed length, with a bound; messages and primitives."""
    types = Types()
    text = "string<=5 name\nuint8[16] id\nfloat32[<=3] some\ngeometry_msgs/Pose[] poses\nint8 CONSTANT=3\nint32 class\n"
    name = types.add("msg", "my_msgs/Thing", text)
    assert types.fields(name) == (
        Field(name="name", kind="string", is_message=False, length=None, text_bound=5),
        Field(name="id", kind="uint8", is_message=False, length=16),
        Field(name="some", kind="float32", is_message=False, length=0, bound=3),
        Field(name="poses", kind="geometry_msgs/msg/Pose", is_message=True, length=0),
        Field(name="class", kind="int32", is_message=False, length=None),
    )
    assert types.fields("std_msgs/msg/Empty") == ()


def test_details_tell_a_type_and_all_types_in_it() -> None:
    """As rosapi does: the type first, each type once, lists by their length, constants as texts."""
    details = standard().details("nav_msgs/msg/Path")
    assert [detail.type for detail in details] == [
        "nav_msgs/Path", "std_msgs/Header", "geometry_msgs/PoseStamped", "builtin_interfaces/Time",
        "geometry_msgs/Pose", "geometry_msgs/Point", "geometry_msgs/Quaternion",
    ]  # fmt: skip
    assert details[0] == TypeDetails(
        type="nav_msgs/Path",
        fieldnames=("header", "poses"),
        fieldtypes=("std_msgs/Header", "geometry_msgs/PoseStamped"),
        fieldarraylen=(-1, 0),
        examples=("{}", "[]"),
        constnames=(),
        constvalues=(),
    )
    (status,) = standard().details("sensor_msgs/msg/NavSatStatus")
    assert dict(zip(status.constnames, status.constvalues, strict=True))["STATUS_NO_FIX"] == "-1"
    (uuid,) = standard().details("unique_identifier_msgs/msg/UUID")
    assert uuid.fieldarraylen == (16,)
    assert standard().details("std_srvs/srv/Trigger_Request")[0].fieldnames == ()


def test_a_service_without_a_standard_type_gets_one_of_its_fields() -> None:
    """Asked for twice it is the same; with other fields it is an error, as is a field of a type there is not."""
    types = Types()
    request = {"region": "int64", "poses": "geometry_msgs/Pose[]"}
    reply = {"scan": "sensor_msgs/LaserScan", "names": "string[]", "class": "bool"}
    laser = types.add_service_of("Laser", request, reply)
    assert laser.name == "concertmaster_msgs/srv/Laser"
    assert types.add_service_of("Laser", request, reply) == types.service("concertmaster_msgs/Laser") == laser
    assert [(field.name, field.kind, field.length) for field in types.fields(laser.reply)] == [
        ("scan", "sensor_msgs/msg/LaserScan", None), ("names", "string", 0), ("class", "bool", None),
    ]  # fmt: skip
    with pytest.raises(UnknownType, match="already present with different definition"):
        types.add_service_of("Laser", {}, reply)
    with pytest.raises(UnknownType, match="has a field of type no/Such, which there is not"):
        types.add_service_of("Other", {"a": "no/Such"}, {})
    with pytest.raises(UnknownType, match="no service type"):
        standard().service("concertmaster_msgs/Laser")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("bool on\n", "has 1 parts, a srv has 2"),
        ("bool on\n---\n---\n", "has 3 parts, a srv has 2"),
        ("bool\n---\n", "Could not parse"),
        ("lamp on\n---\n", "has a field of type my_msgs/lamp, which there is not"),
        ("int32 1st\n---\n", "Could not parse"),
        ("\x00\n---\n", "Could not parse"),
    ],
)
def test_wrong_definitions_are_told_and_leave_nothing_behind(text: str, problem: str) -> None:
    """In one line, with the name of the type."""
    types = Types()
    before = types.names()
    with pytest.raises(UnknownType, match=problem) as caught:
        types.add("srv", "my_msgs/Switch", text)
    assert "my_msgs/" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert types.names() == before


def test_the_registry_s_classes_are_those_of_messages() -> None:
    """What handlers make with `grounding.messages` is what the registry knows, in every registry of ROS 2."""
    one: Any = Types().store.types["sensor_msgs/msg/LaserScan"]
    assert one is standard().store.types["sensor_msgs/msg/LaserScan"]


def test_actions_of_ros_1_are_messages() -> None:
    """Around goal, result and feedback with header and goal id or status, as actionlib makes them; not in ROS 2."""
    types = Types(1)
    types.add("action", "my_msgs/Wave", "int32 times\n---\nbool done\n---\nint32 left\n")
    for action, inner in (("my_msgs/Wave", "times"), ("move_base_msgs/MoveBase", "target_pose")):
        goal = types.fields(types.message(f"{action}ActionGoal"))
        assert [field.name for field in goal] == ["header", "goal_id", "goal"]
        assert [field.name for field in types.fields(goal[2].kind)] == [inner]
        assert [field.name for field in types.fields(types.message(f"{action}Action"))] == [
            "action_goal", "action_result", "action_feedback",
        ]  # fmt: skip
        tree = {"goal_id": {"id": "g", "stamp": {"secs": 1, "nsecs": 2}}}
        message = from_tree(f"{action}ActionGoal", tree, now_s=0.0, types=types)
        assert to_tree(message, types=types)["goal_id"] == {"stamp": {"secs": 1, "nsecs": 2}, "id": "g"}
        assert from_bytes(f"{action}ActionGoal", to_bytes(message, types=types), types=types) == message
    with pytest.raises(UnknownType):
        standard(2).message("move_base_msgs/MoveBaseActionGoal")


def test_details_of_ros_1_tell_times_as_they_stand_on_the_wire() -> None:
    """As primitives with secs and nsecs."""
    header, time = standard(1).details("std_msgs/msg/Header")
    assert header.fieldtypes == ("uint32", "time", "string")
    assert (time.type, time.fieldnames) == ("time", ("secs", "nsecs"))


def test_short_names_leave_out_the_kind() -> None:
    """Of primitives nothing is left out."""
    assert short_name("sensor_msgs/msg/LaserScan") == "sensor_msgs/LaserScan"
    assert short_name("sensor_msgs/LaserScan") == "sensor_msgs/LaserScan"
    assert short_name("float32") == "float32"
