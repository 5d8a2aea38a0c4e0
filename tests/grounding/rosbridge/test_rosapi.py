"""What rosapi tells of topics, services, actions, types and parameters."""

from __future__ import annotations

from typing import Any

import orjson
import pytest

from grounding.rosbridge.framing import Decoder
from grounding.rosbridge.hub import Hub
from grounding.rosbridge.operations import ServiceResponse
from grounding.rosbridge.outbox import Packet
from grounding.rosbridge.rosapi import MOST_PARAM_CHARACTERS
from grounding.rosbridge.session import Session
from grounding.rosbridge.types import Types
from kb.clock import SimClock

# The services that clients call: roslibjs, roslibpy and web tools.
_NAMES = {
    "action_servers", "delete_param", "get_param", "get_param_names", "get_ros_version", "get_time", "has_param",
    "message_details", "node_details", "nodes", "publishers", "service_node", "service_providers",
    "service_request_details", "service_response_details", "service_type", "services", "services_for_type",
    "set_param", "subscribers", "topic_type", "topics", "topics_and_raw_types", "topics_for_type",
}  # fmt: skip


class Client:
    """A hub with some things in it, and a client that asks about them."""

    def __init__(self, types: Types | None = None) -> None:
        self.clock = SimClock()
        self.hub = Hub(self.clock, types=types)
        self.hub.topics.offer("/scan", "sensor_msgs/LaserScan")
        self.hub.services.offer("/lamp", "std_srvs/SetBool", lambda _: {})
        self.hub.actions.offer("/count", "example_interfaces/Fibonacci", lambda _: None)
        self._packets: list[Packet] = []
        self.session: Session = self.hub.connect(self._packets.append, lambda _: None, self.hub.policy.default_role)

    def __call__(self, name: str, /, **args: object) -> Any:
        call = {"op": "call_service", "service": f"/rosapi/{name}", "args": args}
        self.hub.take(self.session, orjson.dumps(call).decode())
        answer = Decoder().feed(self._packets.pop().frames[0], 0.0)
        assert isinstance(answer, ServiceResponse)
        return answer.values


@pytest.fixture(scope="module")
def ask() -> Client:
    """Asks a hub that offers a topic, a service and an action."""
    client = Client()
    client.hub.take(client.session, '{"op": "subscribe", "topic": "/scan"}')
    client.hub.take(client.session, '{"op": "advertise", "topic": "/chat", "type": "std_msgs/String"}')
    client.hub.take(client.session, '{"op": "advertise_service", "service": "/mine", "type": "std_srvs/Empty"}')
    return client


def test_all_services_of_rosapi_are_there(ask: Client) -> None:
    """Those of the protocol table, and ours."""
    assert {f"/rosapi/{name}" for name in _NAMES} <= set(ask("services")["services"])


def test_topics(ask: Client) -> None:
    """Names and types, who publishes and who listens; /rosout is listed."""
    assert ask("topics") == {
        "topics": ["/chat", "/rosout", "/scan"],
        "types": ["std_msgs/String", "rcl_interfaces/Log", "sensor_msgs/LaserScan"],
    }
    assert ask("topics_for_type", type="sensor_msgs/msg/LaserScan") == {"topics": ["/scan"]}
    assert ask("topic_type", topic="/scan") == {"type": "sensor_msgs/LaserScan"}
    assert ask("topic_type", topic="/none") == {"type": ""}
    assert ask("publishers", topic="/chat") == {"publishers": ["/client_1"]}
    assert ask("subscribers", topic="/scan") == {"subscribers": ["/client_1"]}
    raw = ask("topics_and_raw_types")
    assert "float32[] ranges" in raw["typedefs_full_text"][2]
    assert "MSG: std_msgs/Header" in raw["typedefs_full_text"][2]


def test_services_and_actions(ask: Client) -> None:
    """Names, types and who offers them."""
    assert ask("services_for_type", type="std_srvs/srv/SetBool") == {"services": ["/lamp"]}
    assert ask("service_type", service="/lamp") == {"type": "std_srvs/SetBool"}
    assert ask("service_node", service="/mine") == {"node": "/client_1"}
    assert ask("service_providers", service="/lamp") == {"providers": ["/concertmaster"]}
    assert ask("service_providers", service="std_srvs/Empty") == {"providers": ["/client_1"]}
    assert ask("action_servers") == {"action_servers": ["/count"]}
    assert ask("action_type", action="/count") == {"type": "example_interfaces/Fibonacci"}


def test_nodes(ask: Client) -> None:
    """Each client is a node, and this process is one."""
    assert ask("nodes") == {"nodes": ["/client_1", "/concertmaster"]}
    assert ask("node_details", node="/client_1") == {
        "subscribing": ["/scan"],
        "publishing": ["/chat"],
        "services": ["/mine"],
    }


def test_types(ask: Client) -> None:
    """A type and the types in it, with constants; of services and actions each part."""
    typedefs = ask("message_details", type="geometry_msgs/Twist")["typedefs"]
    assert [typedef["type"] for typedef in typedefs] == ["geometry_msgs/Twist", "geometry_msgs/Vector3"]
    assert typedefs[0]["fieldnames"] == ["linear", "angular"]
    assert typedefs[1] == {
        "type": "geometry_msgs/Vector3",
        "fieldnames": ["x", "y", "z"],
        "fieldtypes": ["float64"] * 3,
        "fieldarraylen": [-1] * 3,
        "examples": ["0.0"] * 3,
        "constnames": [],
        "constvalues": [],
    }
    goal_status = ask("message_details", type="action_msgs/GoalStatus")["typedefs"][0]
    assert goal_status["constvalues"][goal_status["constnames"].index("STATUS_CANCELED")] == "5"
    for name, kind, fields in (
        ("service_request_details", "std_srvs/SetBool", ["data"]),
        ("service_response_details", "std_srvs/SetBool", ["success", "message"]),
        ("action_goal_details", "example_interfaces/Fibonacci", ["order"]),
        ("action_result_details", "example_interfaces/Fibonacci", ["sequence"]),
        ("action_feedback_details", "example_interfaces/Fibonacci", ["sequence"]),
    ):
        assert ask(name, type=kind)["typedefs"][0]["fieldnames"] == fields
    assert ask("message_details", type="no/Such").startswith("BadRequest: type no/Such: ")
    assert "sensor_msgs/msg/LaserScan" in ask("interfaces")["interfaces"]


def test_parameters(ask: Client) -> None:
    """They are texts, kept until they are deleted, and not without end."""
    assert ask("get_param", name="/speed", default_value="1") == {
        "value": "1",
        "successful": False,
        "reason": "there is no parameter /speed",
    }
    assert ask("set_param", name="/speed", value="0.5")["successful"] is True
    assert ask("get_param", name="/speed")["value"] == "0.5"
    assert ask("has_param", name="/speed") == {"exists": True}
    assert ask("get_param_names") == {"names": ["/speed"]}
    assert ask("delete_param", name="/speed")["successful"] is True
    assert ask("delete_param", name="/speed")["successful"] is False
    assert ask("set_param", name="/long", value="x" * MOST_PARAM_CHARACTERS)["successful"] is False
    assert ask("has_param", name="/long") == {"exists": False}


def test_time_and_version(ask: Client) -> None:
    """The time is that of the hub's clock."""
    ask.clock.call_at(2.5, lambda: None)
    ask.clock.run_until(lambda: ask.clock.now_s >= 2.5)
    assert ask("get_time") == {"time": {"sec": 2, "nanosec": 500_000_000}}
    assert ask("get_ros_version") == {"version": 2, "distro": "humble"}


def test_in_the_dialect_of_ros_1_times_have_its_field_names() -> None:
    """And the log its type."""
    ask = Client(Types(1))
    assert ask("get_time") == {"time": {"secs": 0, "nsecs": 0}}
    assert ask("get_ros_version") == {"version": 1, "distro": "noetic"}
    assert ask("topic_type", topic="/rosout") == {"type": "rosgraph_msgs/Log"}
    assert "uint32 seq" in ask("topics_and_raw_types")["typedefs_full_text"][0]
    assert ask("message_details", type="std_msgs/Header")["typedefs"][0]["fieldnames"] == ["seq", "stamp", "frame_id"]
