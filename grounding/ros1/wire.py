"""Messages as ROS 1 sends them, and the classes by which rospy knows their types.

The messages of this project are those of ROS 2 (`grounding.messages`). ROS 1 has the same ones but for some names of
fields, the `seq` of a header, and times that are primitives; where a type differs in more it is refused. What rospy
sees of a message is its bytes: rosbags makes and reads them, genmsg gives the sums by which both ends of a connection
know that they mean the same type.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys.base import normalize_fieldname
from rosbags.typesys.store import Typestore

from grounding.ros1.installed import ros
from grounding.rosbridge.actionlib import messages_of
from grounding.rosbridge.types import PLACEHOLDER, ActionType, ServiceType, Types, UnknownType, short_name
from grounding.rosbridge.values import BadValue, fields_to_tree, from_tree, to_tree

_HEADER = "std_msgs/msg/Header"


class Wire:
    """The types of a ROS 2 dialect in ROS 1.

    Args:
        types: Of ROS 2; the messages around the parts of actions are added to them.
    """

    def __init__(self, types: Types) -> None:
        self._types = types
        self._ros_1 = Types(1).store
        self._sound: set[str] = set()
        self._messages: dict[str, Any] = {}
        self._services: dict[str, Any] = {}

    def encode(self, message: object) -> bytes:
        """A message's bytes.

        Raises:
            BadValue: A field of the message is not what its type says.
            UnknownType: It is no message of a known type, or of one that ROS 1 has otherwise.
        """
        tree = to_tree(message, numbers="exact", types=self._types)
        return self.encode_tree(str(getattr(message, "__msgtype__", "")), tree)

    def encode_fields(self, message_type: str, values: Mapping[str, object]) -> bytes:
        """The bytes of a message with these values by field; what is not given is 0, false or empty."""
        return self.encode_tree(message_type, fields_to_tree(message_type, values, numbers="exact", types=self._types))

    def encode_tree(self, message_type: str, tree: Mapping[str, object]) -> bytes:
        """The bytes of the message in a tree (see `grounding.rosbridge.values`)."""
        name = self._checked(message_type)
        message = from_tree(name, tree, now_s=0.0, types=self._types)
        store = self._types.store
        return bytes(store.cdr_to_ros1(store.serialize_cdr(message, name, little_endian=True), name))

    def decode(self, message_type: str, data: bytes) -> object:
        """The message in bytes, the inverse of `encode`.

        Raises:
            BadValue: The bytes are none of this type.
        """
        name, store = self._checked(message_type), self._types.store
        try:
            return store.deserialize_cdr(store.ros1_to_cdr(data, name), name)
        except (SerdeError, IndexError) as error:
            raise BadValue("", f"is no {short_name(name)}: {error}") from None

    def decode_fields(self, message_type: str, data: bytes) -> dict[str, object]:
        """The values by field of the message in bytes."""
        return self.values(message_type, self.decode(message_type, data))

    def values(self, message_type: str, message: object) -> dict[str, object]:
        """The values of a message by field."""
        names = [field.name for field in self._types.fields(self._types.message(message_type))]
        return {name: getattr(message, normalize_fieldname(name)) for name in names}

    def wrappers(self, action: ActionType) -> Mapping[str, str]:
        """The types of an action's messages, by the names of its topics below the action's own."""
        package, _, simple = action.name.split("/")
        self._types.store.register(messages_of(action.name, self._types.store.fielddefs))
        around = {part: f"{package}/msg/{simple}Action{part.capitalize()}" for part in ("goal", "feedback", "result")}
        return {**around, "cancel": "actionlib_msgs/msg/GoalID", "status": "actionlib_msgs/msg/GoalStatusArray"}

    def message_class(self, message_type: str) -> Any:
        """What rospy takes for the class of a message: it holds its bytes, in `data`."""
        name = self._checked(message_type)
        if name not in self._messages:
            text, md5sum = self._ros_1.generate_msgdef(name, ros_version=1)
            self._messages[name] = _message_class(ros_1_name(name), md5sum, text)
        return self._messages[name]

    def service_class(self, service: ServiceType) -> Any:
        """What rospy takes for the class of a service."""
        if service.name not in self._services:
            parts = {
                "_request_class": self.message_class(service.request),
                "_response_class": self.message_class(service.reply),
            }
            told = {"_type": ros_1_name(service.name), "_md5sum": self._md5sum(service)}
            self._services[service.name] = type(service.name.rpartition("/")[2], (), told | parts)
        return self._services[service.name]

    def service_text(self, service: ServiceType) -> str:
        """The text of the `.srv` file of a service."""
        request, reply = (
            self._ros_1.gendefhash(self._checked(part), {}, 1)[0] for part in (service.request, service.reply)
        )
        return f"{request}---\n{reply}"

    def _md5sum(self, service: ServiceType) -> str:
        """The sum of a service, by genmsg: of the texts of both parts, with the sums of the messages in them."""
        genmsg = ros("genmsg")
        loader, context = ros("genmsg.msg_loader"), genmsg.MsgContext.create_default()
        inside: dict[str, tuple[str, str]] = {}
        for part in (service.request, service.reply):
            self._ros_1.gendefhash(self._checked(part), inside, 1)
        for kind, (text, _) in inside.items():
            loader.load_msg_from_string(context, text, short_name(kind))
        try:
            spec = loader.load_srv_from_string(context, self.service_text(service), ros_1_name(service.name))
        except genmsg.InvalidMsgSpec as error:
            raise UnknownType(service.name, f"ROS 1 does not have it: {error}") from None
        return str(genmsg.compute_md5(context, spec))

    def _checked(self, message_type: str) -> str:
        """The full name of a type, which ROS 1 has too; one that only we have it gets from us."""
        name = self._types.message(message_type)
        if name in self._sound:
            return name
        if name not in self._ros_1.fielddefs:
            self._ros_1.register(_with_inner(self._types.store, name, self._ros_1))
        if not _same_layout(self._types.store, self._ros_1, name):
            raise UnknownType(name, "its fields in ROS 1 are others than in ROS 2, so that it cannot be sent there")
        self._sound.add(name)
        return name


def ros_1_name(full_name: str) -> str:
    """`concertmaster_msgs/srv/Laser_Request` as `concertmaster_msgs/LaserRequest`."""
    name = short_name(full_name)
    for part in ("_Request", "_Response") if "/srv/" in full_name else ():
        if name.endswith(part):
            return name.removesuffix(part) + part[1:]
    return name


def _message_class(name: str, md5sum: str, text: str) -> Any:
    def begin(self: Any, data: bytes = b"") -> None:
        self.data = data

    def serialize(self: Any, buffer: Any) -> None:
        buffer.write(self.data)

    def deserialize(self: Any, data: bytes) -> Any:
        self.data = bytes(data)
        return self

    return type(
        name.rpartition("/")[2],
        (ros("genpy").Message,),
        {
            "__slots__": ("data",),
            "__init__": begin,
            "_type": name,
            "_md5sum": md5sum,
            "_full_text": text,
            "_has_header": False,  # so that rospy leaves the bytes alone
            "_slot_types": (),
            "serialize": serialize,
            "deserialize": deserialize,
        },
    )


def _with_inner(store: Typestore, name: str, known: Typestore) -> dict[str, Any]:
    """The definition of a type, and of the types in it that are not known."""
    found = {name: store.fielddefs[name]}
    for field, (kind, detail) in store.fielddefs[name][1]:
        inner = _inner(kind, detail)
        if field != PLACEHOLDER and inner is not None and inner not in known.fielddefs:
            found |= _with_inner(store, inner, known)
    return found


def _inner(kind: Nodetype, detail: Any) -> str | None:
    """The message type of a field, or of its elements."""
    if kind in (Nodetype.BASE, Nodetype.NAME):
        return detail if kind is Nodetype.NAME else None
    element_kind, element = detail[0]
    return element if element_kind is Nodetype.NAME else None


def _same_layout(store: Typestore, other: Typestore, name: str) -> bool:
    """Whether the bytes of a type are the same in both, but for the `seq` that only headers of ROS 1 have."""
    if name == _HEADER:
        return True
    ours, others = ([detail for field, detail in s.fielddefs[name][1] if field != PLACEHOLDER] for s in (store, other))
    inner = {found for detail in ours if (found := _inner(*detail)) is not None}
    return ours == others and all(_same_layout(store, other, one) for one in inner)
