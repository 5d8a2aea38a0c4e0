"""What is in ROS 2, in the hub of a rosbridge server: services and actions as those of a client, topics as its own.

Everything happens on the hub's thread, but for what the node does.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping
from functools import partial

from grounding.actions import GoalStatus
from grounding.ros2.interfaces import InstalledTypes
from grounding.ros2.node import Graph, Node
from grounding.rosbridge.framing import Decoder, Limits
from grounding.rosbridge.hub import NODE, Hub
from grounding.rosbridge.operations import (
    ActionFeedback,
    ActionResult,
    AdvertiseAction,
    AdvertiseService,
    CallService,
    CancelActionGoal,
    Operation,
    SendActionGoal,
    ServiceResponse,
    UnadvertiseAction,
    UnadvertiseService,
)
from grounding.rosbridge.outbox import Packet
from grounding.rosbridge.policy import Role
from grounding.rosbridge.session import Refused
from grounding.rosbridge.types import UnknownType
from grounding.rosbridge.values import BadValue, from_tree, to_bytes, to_tree
from kb.clock import Callback, Clock

_OWN = "/rosapi/"


class Follower:
    """Keeps a hub to the graph of ROS 2.

    Args:
        types: Those of the hub.
        limits: Of frames, as the hub's.
        node: Which has yet to be started.
    """

    def __init__(self, hub: Hub, types: InstalledTypes, clock: Clock, limits: Limits, node: Node) -> None:
        self._hub, self._types, self._clock, self._node = hub, types, clock, node
        self._decoder = Decoder(limits)
        self._session = hub.connect(self._take, lambda reason: None, Role(name="ROS 2"))
        self._session.binary = True
        self._services: Mapping[str, str] = {}
        self._actions: Mapping[str, str] = {}
        self._topics: Mapping[str, str] = {}
        self._heard: set[str] = set()
        self._spoken: dict[str, Callback] = {}
        self._saying = False
        self._impossible: set[str] = set()
        self._complained: set[str] = set()
        hub.topics.changed = self._follow_clients

    def follow(self, graph: Graph) -> None:
        """Offer what has come to ROS 2, and no more what has gone."""
        services = {name: kind for name, kind in graph.services.items() if not name.startswith(_OWN)}
        services, self._hub.services.out_of_reach = _within_reach("service", services, self._types.service)
        actions, self._hub.actions.out_of_reach = _within_reach("action", graph.actions, self._types.action)
        topics, _ = _within_reach("topic", graph.topics, self._types.message)
        for name in _gone(self._services, services):
            self._tell(UnadvertiseService(service=name))
        for name in _gone(services, self._services):
            self._tell(AdvertiseService(service=name, type=services[name]))
        for name in _gone(self._actions, actions):
            self._tell(UnadvertiseAction(action=name))
        for name in _gone(actions, self._actions):
            self._tell(AdvertiseAction(action=name, type=actions[name]))
        for name in _gone(self._topics, topics):
            self._hub.topics.withdraw(name)
        in_use = {topic.name: topic.type for topic in self._hub.topics.told()}
        self._topics = {name: kind for name, kind in topics.items() if in_use.get(name, kind) == kind}
        for name, kind in self._topics.items():
            self._hub.topics.offer(name, kind)
        self._services, self._actions = services, actions

    def _follow_clients(self) -> None:
        """Listen in ROS 2 to what clients listen to, and speak where they do.

        Raises:
            Refused: A topic cannot be there, which is said to who has asked for it first.
        """
        everything = {topic.name: topic for topic in self._hub.topics.told()}
        impossible = {
            name
            for name, topic in everything.items()
            if not self._types.class_of(topic.type) or not self._node.can_name(name)
        }
        refused, self._impossible = impossible - self._impossible, impossible
        told = {name: topic for name, topic in everything.items() if name not in impossible}
        heard = {name for name, topic in told.items() if set(topic.subscribers) - {NODE}}
        spoken = {name for name, topic in told.items() if set(topic.publishers) - {NODE}}
        for name in self._heard - heard:
            self._node.unsubscribe(name)
        for name in heard - self._heard:
            kind = told[name].type
            self._node.subscribe(name, self._types.class_of(kind), partial(self._hear, name, kind))
        for name in self._spoken.keys() - spoken:
            self._spoken.pop(name)()
            self._node.unadvertise(name)
        for name in spoken - self._spoken.keys():
            self._node.advertise(name, self._types.class_of(told[name].type), latch=told[name].latched)
            self._spoken[name] = self._hub.topics.listen(name, told[name].type, partial(self._speak, name))
        self._heard = heard
        for name in refused:
            raise Refused("BadRequest", f"{name} of type {everything[name].type} cannot be a topic in ROS 2")

    def _hear(self, name: str, kind: str, message: bytes) -> None:
        if name not in self._heard:
            return
        try:
            value = self._types.read(kind, message)
        except BadValue as error:
            self._complain(f"a message on {name} was dropped: {error}")
            return
        self._saying = True
        self._hub.topics.say(name, value)
        self._saying = False

    def _speak(self, name: str, message: object) -> None:
        if not self._saying:  # else it comes from ROS 2
            self._node.publish(name, to_bytes(message, types=self._types))

    def _tell(self, operation: Operation) -> None:
        self._hub.do(self._session, operation)

    def _take(self, packet: Packet) -> None:
        """What the hub asks of who offers services and actions."""
        for frame in packet.frames:
            operation = self._decoder.feed(frame, self._clock.now_s)
            if isinstance(operation, CallService):
                self._call(operation)
            elif isinstance(operation, SendActionGoal):
                self._send_goal(operation)
            elif isinstance(operation, CancelActionGoal):
                self._node.goals.cancel(str(operation.id))

    def _call(self, call: CallService) -> None:
        kind = self._types.service(self._services[call.service])

        def answer(values: dict[str, object] | str) -> None:
            succeeded = not isinstance(values, str)
            self._tell(ServiceResponse(service=call.service, id=call.id, result=succeeded, values=values))

        def done(reply: bytes | str) -> None:
            try:
                answer(reply if isinstance(reply, str) else self._tree(kind.reply, reply))
            except BadValue as error:
                answer(f"BadReply: {call.service}: {error}")

        try:
            request = self._bytes(kind.request, call.args)
        except BadValue as error:
            answer(f"BadRequest: {error}")
        else:
            assert call.timeout is not None  # the hub says it
            self._node.calls.call(call.service, self._types.class_of(kind.name), request, call.timeout, done)

    def _send_goal(self, goal: SendActionGoal) -> None:
        kind, number = self._types.action(self._actions[goal.action]), str(goal.id)

        def fed(feedback: bytes) -> None:
            try:
                values = self._tree(kind.feedback, feedback)
            except BadValue as error:
                self._complain(f"feedback of {goal.action} was dropped: {error}")
            else:
                self._tell(ActionFeedback(action=goal.action, id=number, values=values))

        def ended(status: int, result: bytes | str) -> None:
            try:
                values = result if isinstance(result, str) else self._tree(kind.result, result)
            except BadValue as error:
                values = f"BadReply: {goal.action}: {error}"
            succeeded = not isinstance(values, str)
            self._tell(ActionResult(action=goal.action, id=number, status=status, result=succeeded, values=values))

        try:
            data = self._bytes(kind.goal, goal.args)
        except BadValue as error:
            ended(int(GoalStatus.ABORTED), f"BadRequest: {error}")
        else:
            self._node.goals.send(goal.action, self._types.class_of(kind.name), number, data, fed, ended)

    def _complain(self, problem: str) -> None:
        """Say what is lost to who looks, once: nobody has asked for it by a call that could be answered."""
        if problem not in self._complained:
            self._complained.add(problem)
            sys.stderr.write(f"ROS 2: {problem}\n")

    def _tree(self, kind: str, data: bytes) -> dict[str, object]:
        return to_tree(self._types.read(kind, data), numbers="exact", types=self._types)

    def _bytes(self, kind: str, tree: object) -> bytes:
        return to_bytes(from_tree(kind, tree, now_s=self._clock.now_s, types=self._types), types=self._types)


def _within_reach(
    what: str, offered: Mapping[str, str], type_of: Callable[[str], object]
) -> tuple[dict[str, str], dict[str, str]]:
    """What has a type that is installed, and why the others cannot be used."""
    usable, unusable = {}, {}
    for name, kind in offered.items():
        try:
            type_of(kind)
        except UnknownType as error:
            unusable[name] = f"there is a {what} {name}, but it cannot be used: {error}"
        else:
            usable[name] = kind
    return usable, unusable


def _gone(before: Mapping[str, str], now: Mapping[str, str]) -> Iterable[str]:
    """Names that are no more, or not of the same type."""
    return [name for name, kind in before.items() if now.get(name) != kind]
