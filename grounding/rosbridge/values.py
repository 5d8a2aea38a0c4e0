"""ROS messages to and from trees of objects and lists, as they stand in frames.

    tree = to_tree(scan)                              # {"header": {...}, "ranges": array(...), ...}
    scan = from_tree("sensor_msgs/LaserScan", tree, now_s=clock.now_s)

A tree holds dict, list, str, int, float, bool, None and one-dimensional numpy arrays, which `framing` writes as they
are. For JSON, bytes are base64 texts, and NaN and infinity null (rosbridge v2, sections 3.2.3 and 4.6); arrays of
numbers stay arrays, in which `framing` does that. For CBOR, all numbers stay what they are.

What comes in is read strictly: every field is of its type and in its range, or BadValue says where and what. Only what
the protocol leaves open is filled in: missing fields get their defaults, a missing stamp of a header the time now.
Arrays may be views of the frame's bytes, which cannot be written to.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Mapping

from rosbags.serde import SerdeError

from grounding.rosbridge.forms import BadValue, MessageForm, Numbers, form_of
from grounding.rosbridge.types import Types, standard

__all__ = [
    "BadValue",
    "Numbers",
    "default",
    "fields_from_tree",
    "fields_to_tree",
    "from_bytes",
    "from_tree",
    "to_bytes",
    "to_tree",
]


def to_tree(message: object, *, numbers: Numbers = "json", types: Types | None = None) -> dict[str, object]:
    """A message as a tree.

    Args:
        types: Those of its dialect; the standard ones of ROS 2 if None.

    Raises:
        BadValue: A field of the message is not what its type says.
        UnknownType: It is no message of a known type.
    """
    return _form(types, _name_of(message)).write(message, numbers)


def fields_to_tree(
    message_type: str, values: Mapping[str, object], *, numbers: Numbers = "json", types: Types | None = None
) -> dict[str, object]:
    """Values by field as a tree; fields without a value are left out.

    Args:
        message_type: Mostly of a request or reply: `std_srvs/srv/SetBool_Request`.

    Raises:
        BadValue: A value is not what its type says, or the type has no such field.
        UnknownType: There is no such type.
    """
    return _form(types, message_type).write_fields(values, numbers)


def from_tree(message_type: str, tree: object, *, now_s: float, types: Types | None = None) -> object:
    """The message in a tree: an object by field, a list in the order of the fields, or None if nothing is said.

    Args:
        now_s: Time for the stamps of headers that have none, and for times that are given as "now".

    Raises:
        BadValue: The tree holds a field that the type does not have, or a value that is wrong.
        UnknownType: There is no such type.
    """
    form = _form(types, message_type)
    return form.read(_by_name(form, tree), now_s)


def fields_from_tree(
    message_type: str, tree: object, *, now_s: float, optional: Collection[str] = (), types: Types | None = None
) -> dict[str, object]:
    """As `from_tree`, but the values by field.

    Args:
        optional: Fields that are left out if they are missing, instead of getting a default.
    """
    form = _form(types, message_type)
    return form.read_fields(_by_name(form, tree), now_s, optional)


def default(message_type: str, *, types: Types | None = None) -> object:
    """The message of a type in which everything is 0, false or empty."""
    return _form(types, message_type).default()


def to_bytes(message: object, *, types: Types | None = None) -> bytes:
    """A message as ROS sends it: CDR in ROS 2, with its head of four bytes; ROS 1's own format in ROS 1.

    Raises:
        BadValue: A field of the message is not what its type says, or a single `byte` is above 127, for which
            rosbags has no bytes.
        UnknownType: It is no message of a known type.
    """
    types = types or standard()
    name = types.message(_name_of(message))
    _form(types, name).write(message, "exact")  # checks it: rosbags writes what it gets
    serialize = types.store.serialize_cdr if types.ros_version == 2 else types.store.serialize_ros1
    try:
        return bytes(serialize(message, name))
    except struct.error as error:
        raise BadValue("", f"cannot be serialized as {name}: {error}") from None


def from_bytes(message_type: str, data: bytes | memoryview, *, types: Types | None = None) -> object:
    """The message in bytes, the inverse of `to_bytes`; also of CDR in the other byte order.

    Raises:
        BadValue: The bytes are none of this type.
        UnknownType: There is no such type.
    """
    types = types or standard()
    name = types.message(message_type)
    deserialize = types.store.deserialize_cdr if types.ros_version == 2 else types.store.deserialize_ros1
    try:
        return deserialize(data, name)
    except SerdeError as error:
        raise BadValue("", f"is no {name}: {error}") from None


def _name_of(message: object) -> str:
    return str(getattr(message, "__msgtype__", type(message).__name__))


def _form(types: Types | None, message_type: str) -> MessageForm:
    types = types or standard()
    return form_of(types, types.message(message_type))


def _by_name(form: MessageForm, tree: object) -> object:
    if tree is None:
        return {}
    if not isinstance(tree, list):
        return tree
    if len(tree) > len(form.fields):
        raise BadValue("", f"is a list of {len(tree)} values, {form.name} has {len(form.fields)} fields")
    return dict(zip(form.fields, tree, strict=False))
