"""The services of rosapi, by which clients find out what there is: topics, services, actions, types, parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from grounding.rosbridge.hub_actions import Actions
from grounding.rosbridge.hub_services import Services
from grounding.rosbridge.hub_topics import TopicInfo, Topics
from grounding.rosbridge.types import Types, short_name
from kb.clock import Clock

Fields = Mapping[str, object]

MOST_PARAMS = 1000
MOST_PARAM_CHARACTERS = 10_000


class RosApi:
    """Answers from what the hub knows. Types are told as `pkg/Type`, as clients expect them.

    Args:
        params: Texts of JSON by name; clients may change them.
        node: Name of this process.
    """

    def __init__(
        self,
        clock: Clock,
        types: Types,
        topics: Topics,
        services: Services,
        actions: Actions,
        params: dict[str, str],
        node: str,
    ) -> None:
        self._clock, self._types, self._node = clock, types, node
        self._topics, self._services, self._actions = topics, services, actions
        self._params = params

    def offer(self) -> None:
        """Offer all of them, as `/rosapi/topics` and so on."""
        for name, (service_type, handler) in self._handlers().items():
            self._services.offer(f"/rosapi/{name}", f"rosapi_msgs/srv/{service_type}", handler)

    def _handlers(self) -> Mapping[str, tuple[str, Callable[[Any], Fields]]]:
        types = self._types
        return {
            "topics": ("Topics", lambda _: self._listed(self._topics.told())),
            "topics_for_type": ("TopicsForType", self._topics_for_type),
            "topics_and_raw_types": ("TopicsAndRawTypes", self._topics_and_raw_types),
            "topic_type": ("TopicType", lambda q: {"type": self._type_of_topic(q["topic"])}),
            "publishers": ("Publishers", lambda q: {"publishers": list(self._at_topic(q["topic"]).publishers)}),
            "subscribers": ("Subscribers", lambda q: {"subscribers": list(self._at_topic(q["topic"]).subscribers)}),
            "services": ("Services", lambda _: {"services": [name for name, _, _ in self._services.told()]}),
            "services_for_type": ("ServicesForType", self._services_for_type),
            "service_type": ("ServiceType", lambda q: {"type": self._of_service(q["service"])[0]}),
            "service_node": ("ServiceNode", lambda q: {"node": self._of_service(q["service"])[1]}),
            "service_providers": ("ServiceProviders", self._service_providers),
            "action_servers": (
                "GetActionServers",
                lambda _: {"action_servers": [name for name, _, _ in self._actions.told()]},
            ),
            "action_type": ("ActionType", self._action_type),
            "interfaces": ("Interfaces", lambda _: {"interfaces": types.names()}),
            "message_details": ("MessageDetails", lambda q: self._details(types.message(q["type"]))),
            "service_request_details": (
                "ServiceRequestDetails",
                lambda q: self._details(types.service(q["type"]).request),
            ),
            "service_response_details": (
                "ServiceResponseDetails",
                lambda q: self._details(types.service(q["type"]).reply),
            ),
            "action_goal_details": ("ActionGoalDetails", lambda q: self._details(types.action(q["type"]).goal)),
            "action_result_details": ("ActionResultDetails", lambda q: self._details(types.action(q["type"]).result)),
            "action_feedback_details": (
                "ActionFeedbackDetails",
                lambda q: self._details(types.action(q["type"]).feedback),
            ),
            "nodes": ("Nodes", lambda _: {"nodes": self._nodes()}),
            "node_details": ("NodeDetails", self._node_details),
            "get_param": ("GetParam", self._get_param),
            "set_param": ("SetParam", self._set_param),
            "has_param": ("HasParam", lambda q: {"exists": q["name"] in self._params}),
            "delete_param": ("DeleteParam", self._delete_param),
            "get_param_names": ("GetParamNames", lambda _: {"names": sorted(self._params)}),
            "get_time": ("GetTime", self._get_time),
            "get_ros_version": ("GetROSVersion", self._get_ros_version),
        }

    def _listed(self, topics: list[TopicInfo]) -> Fields:
        return {"topics": [t.name for t in topics], "types": [short_name(t.type) for t in topics]}

    def _topics_for_type(self, query: Any) -> Fields:
        wanted = short_name(query["type"])
        return {"topics": [t.name for t in self._topics.told() if short_name(t.type) == wanted]}

    def _topics_and_raw_types(self, _query: Any) -> Fields:
        topics = self._topics.told()
        texts = [self._types.store.generate_msgdef(t.type, ros_version=self._types.ros_version)[0] for t in topics]
        return {**self._listed(topics), "typedefs_full_text": texts}

    def _at_topic(self, name: str) -> TopicInfo:
        """A topic; one that nobody publishes or listens to is told as empty, as ROS does it."""
        found = (topic for topic in self._topics.told() if topic.name == name)
        return next(found, TopicInfo(name, "", (), ()))

    def _type_of_topic(self, name: str) -> str:
        return short_name(self._at_topic(name).type)

    def _of_service(self, name: str) -> tuple[str, str]:
        """Type and node of a service; empty if there is none, as ROS does it."""
        for service, service_type, node in self._services.told():
            if service == name:
                return short_name(service_type), node
        return "", ""

    def _services_for_type(self, query: Any) -> Fields:
        wanted = short_name(query["type"])
        return {"services": [name for name, kind, _ in self._services.told() if short_name(kind) == wanted]}

    def _service_providers(self, query: Any) -> Fields:
        # The field is called `service`, but means a type in ROS 1 and a name in ROS 2: take either.
        asked = query["service"]
        nodes = {
            node for name, kind, node in self._services.told() if name == asked or short_name(kind) == short_name(asked)
        }
        return {"providers": sorted(nodes)}

    def _action_type(self, query: Any) -> Fields:
        kinds = {name: kind for name, kind, _ in self._actions.told()}
        return {"type": short_name(kinds.get(query["action"], ""))}

    def _details(self, full_name: str) -> Fields:
        make = self._types.store.types["rosapi_msgs/msg/TypeDef"]
        return {"typedefs": [make(**_as_ros(asdict(details))) for details in self._types.details(full_name)]}

    def _nodes(self) -> list[str]:
        topics = self._topics.told()
        nodes = {node for topic in topics for node in (*topic.publishers, *topic.subscribers)}
        nodes |= {node for _, _, node in (*self._services.told(), *self._actions.told())}
        return sorted(nodes)

    def _node_details(self, query: Any) -> Fields:
        node, topics = query["node"], self._topics.told()
        return {
            "subscribing": [topic.name for topic in topics if node in topic.subscribers],
            "publishing": [topic.name for topic in topics if node in topic.publishers],
            "services": [name for name, _, provider in self._services.told() if provider == node],
        }

    def _get_param(self, query: Any) -> Fields:
        name = query["name"]
        if name in self._params:
            return {"value": self._params[name], "successful": True, "reason": ""}
        return {"value": query["default_value"], "successful": False, "reason": f"there is no parameter {name}"}

    def _set_param(self, query: Any) -> Fields:
        name, value = query["name"], query["value"]
        if len(name) + len(value) > MOST_PARAM_CHARACTERS:
            return {"successful": False, "reason": f"name and value may have {MOST_PARAM_CHARACTERS} characters"}
        if name not in self._params and len(self._params) >= MOST_PARAMS:
            return {"successful": False, "reason": f"there are {MOST_PARAMS} parameters already"}
        self._params[name] = value
        return {"successful": True, "reason": ""}

    def _delete_param(self, query: Any) -> Fields:
        if self._params.pop(query["name"], None) is None:
            return {"successful": False, "reason": f"there is no parameter {query['name']}"}
        return {"successful": True, "reason": ""}

    def _get_time(self, _query: Any) -> Fields:
        sec, nanosec = divmod(round(self._clock.now_s * 1e9), 1_000_000_000)
        return {"time": self._types.store.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)}

    def _get_ros_version(self, _query: Any) -> Fields:
        version = self._types.ros_version
        return {"version": version, "distro": "humble" if version == 2 else "noetic"}


def _as_ros(details: Mapping[str, Any]) -> dict[str, Any]:
    """Values as the fields of `rosapi_msgs/TypeDef` hold them."""
    return {
        key: value if isinstance(value, str) else np.array(value, np.int32) if key == "fieldarraylen" else list(value)
        for key, value in details.items()
    }
