"""The types of messages, services and actions, by name, with their fields.

Messages are those of ROS 2 Humble, or of ROS 1 Noetic, as `rosbags` has them. Services and actions are read from the
`.srv` and `.action` files below `interfaces/`, in ROS's own format; a service without a standard type gets one made of
its fields. A request, reply, goal, result or feedback is a message type of its own: `std_srvs/srv/SetBool_Request`.

Names are taken as `pkg/Type` or in full, `pkg/msg/Type`; the types here carry the full name.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Literal

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from grounding.rosbridge.actionlib import messages_of
from grounding.rosbridge.wording import shortened
from kb.errors import ConcertmasterError

PLACEHOLDER = "structure_needs_at_least_one_member"
"""The field that ROS 2 gives to messages without fields; never on the wire."""

Family = Literal["msg", "srv", "action"]
_PARTS: Mapping[str, tuple[str, ...]] = {
    "msg": ("",),
    "srv": ("_Request", "_Response"),
    "action": ("_Goal", "_Result", "_Feedback"),
}
_ROS_1_TIMES: Mapping[str, str] = {
    "builtin_interfaces/msg/Time": "time",
    "builtin_interfaces/msg/Duration": "duration",
}


class UnknownType(ConcertmasterError):
    """There is no such type, or it cannot be had.

    Attributes:
        name: As it was given.
    """

    fault = "request"

    def __init__(self, name: str, problem: str) -> None:
        super().__init__(f"type {shortened(name)}: {problem}")
        self.name = name


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """A field of a message type.

    Attributes:
        kind: A ROS primitive such as `float32`, or the full name of a message type.
        length: None if it is a single value, 0 if it is a list of any length, else the length of the list.
        bound: Most elements of a list of any length; 0 if there is no bound.
        text_bound: Most characters of a string; 0 if there is no bound.
    """

    name: str
    kind: str
    is_message: bool
    length: int | None
    bound: int = 0
    text_bound: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceType:
    """A service type and the message types of its request and reply."""

    name: str
    request: str
    reply: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionType:
    """An action type and the message types of its goal, result and feedback."""

    name: str
    goal: str
    result: str
    feedback: str


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeDetails:
    """What rosapi tells of a message type (`rosapi_msgs/TypeDef`), one element per field or constant.

    Attributes:
        fieldarraylen: -1 if it is a single value, 0 if a list of any length, else the length.
    """

    type: str
    fieldnames: tuple[str, ...]
    fieldtypes: tuple[str, ...]
    fieldarraylen: tuple[int, ...]
    examples: tuple[str, ...]
    constnames: tuple[str, ...]
    constvalues: tuple[str, ...]


class Types:
    """All types that are known, of one ROS version.

    Attributes:
        ros_version: 1 or 2.
        store: The message types, for serialization.
    """

    def __init__(self, ros_version: Literal[1, 2] = 2) -> None:
        self.ros_version = ros_version
        self.store: Typestore = get_typestore(Stores.ROS2_HUMBLE if ros_version == 2 else Stores.ROS1_NOETIC)
        self._services: set[str] = set()
        self._actions: set[str] = set()
        definitions = dict(_shipped())
        for name in definitions:
            self._note(name)
        self.store.register(definitions | self._of_ros_1(self._actions, definitions))

    def message(self, name: str) -> str:
        """The full name of a message type.

        Raises:
            UnknownType: There is none of this name.
        """
        full = _full_name(name, "msg")
        if full not in self.store.fielddefs:
            raise UnknownType(name, "there is no message type of this name")
        return full

    def service(self, name: str) -> ServiceType:
        """A service type.

        Raises:
            UnknownType: There is none of this name.
        """
        full = _full_name(name, "srv")
        if full not in self._services:
            raise UnknownType(name, "there is no service type of this name")
        return ServiceType(name=full, request=f"{full}_Request", reply=f"{full}_Response")

    def action(self, name: str) -> ActionType:
        """An action type.

        Raises:
            UnknownType: There is none of this name.
        """
        full = _full_name(name, "action")
        if full not in self._actions:
            raise UnknownType(name, "there is no action type of this name")
        return ActionType(name=full, goal=f"{full}_Goal", result=f"{full}_Result", feedback=f"{full}_Feedback")

    def names(self) -> list[str]:
        """Full names of all message, service and action types, sorted."""
        parts = {f"{name}{part}" for name in self._services for part in _PARTS["srv"]}
        parts |= {f"{name}{part}" for name in self._actions for part in _PARTS["action"]}
        return sorted((self.store.fielddefs.keys() - parts) | self._services | self._actions)

    def add(self, family: Family, name: str, text: str) -> str:
        """Add a type in ROS's own format, the parts of services and actions divided by `---`.

        Returns:
            Its full name.

        Raises:
            UnknownType: The text is wrong, or there is a type of this name with other fields.
        """
        full = _full_name(name, family)
        try:
            definitions = _parsed(full, family, text)
            for kind in sorted(_kinds_in(definitions) - self.store.fielddefs.keys() - definitions.keys()):
                raise UnknownType(name, f"has a field of type {short_name(kind)}, which there is not")
            self.store.register(definitions | self._of_ros_1([full] if family == "action" else [], definitions))
        except TypesysError as error:
            raise UnknownType(name, " ".join(str(error).split())) from None
        self._note(full)
        return full

    def add_service_of(self, name: str, request: Mapping[str, str], reply: Mapping[str, str]) -> ServiceType:
        """The type `concertmaster_msgs/srv/<name>` of a service that has no standard one.

        Args:
            name: Such as `Laser`.
            request: ROS types by name of field: `sensor_msgs/LaserScan`, `bool`, `string[]`.
            reply: Likewise.

        Raises:
            UnknownType: A field has no such type, or there is a type of this name with other fields.
        """
        full = f"concertmaster_msgs/srv/{name}"
        texts = ("\n".join(f"{kind} {field}" for field, kind in part.items()) for part in (request, reply))
        return self.service(self.add("srv", full, "\n---\n".join(texts)))

    def fields(self, message_type: str) -> tuple[Field, ...]:
        """The fields of a message type in their order.

        Args:
            message_type: Full name.
        """
        _, definitions = self.store.fielddefs[message_type]
        return tuple(_field_of(name, kind, detail) for name, (kind, detail) in definitions if name != PLACEHOLDER)

    def details(self, message_type: str) -> list[TypeDetails]:
        """A message type and, after it, all types in it, each once.

        Args:
            message_type: Full name.
        """
        found: dict[str, TypeDetails] = {}
        waiting = [message_type]
        while waiting:
            name = waiting.pop(0)
            if name not in found:
                found[name] = self._details_of_one(name)
                waiting += [field.kind for field in self.fields(name) if field.is_message]
        return list(found.values())

    def _details_of_one(self, name: str) -> TypeDetails:
        fields = self.fields(name)
        constants, _ = self.store.fielddefs[name]
        is_time_of_ros_1 = self.ros_version == 1 and name in _ROS_1_TIMES
        return TypeDetails(
            type=self._told(name),
            fieldnames=("secs", "nsecs") if is_time_of_ros_1 else tuple(field.name for field in fields),
            fieldtypes=tuple(self._told(field.kind) for field in fields),
            fieldarraylen=tuple(-1 if field.length is None else field.length for field in fields),
            examples=tuple(_example(field) for field in fields),
            constnames=tuple(constant for constant, _, _ in constants),
            constvalues=tuple(str(value) for _, _, value in constants),
        )

    def _told(self, kind: str) -> str:
        """How rosapi calls a type: times are primitives in ROS 1."""
        return _ROS_1_TIMES[kind] if self.ros_version == 1 and kind in _ROS_1_TIMES else short_name(kind)

    def _of_ros_1(self, actions: Iterable[str], definitions: Mapping[str, Any]) -> dict[str, Any]:
        """Definitions of the messages that carry these actions, if it is ROS 1 where messages do."""
        found: dict[str, Any] = {}
        if self.ros_version == 1:
            for action in actions:
                found |= messages_of(action, definitions)
        return found

    def _note(self, name: str) -> None:
        """Take down a service or action, of which a part or the name itself is given."""
        whole = name.rpartition("_")[0] if name.endswith(_PARTS["srv"] + _PARTS["action"]) else name
        if "/srv/" in whole:
            self._services.add(whole)
        elif "/action/" in whole:
            self._actions.add(whole)


@cache
def standard(ros_version: Literal[1, 2] = 2) -> Types:
    """The types that come with us. Who adds some makes a `Types` of their own."""
    return Types(ros_version)


def short_name(full_name: str) -> str:
    """`sensor_msgs/msg/LaserScan` as `sensor_msgs/LaserScan`."""
    package, _, rest = full_name.partition("/")
    return f"{package}/{rest.rpartition('/')[2]}" if rest else full_name


def _full_name(name: str, family: Family) -> str:
    package, _, rest = name.partition("/")
    if package == "rosapi":  # its name in ROS 1, which clients still use
        package = "rosapi_msgs"
    return f"{package}/{rest}" if "/" in rest else f"{package}/{family}/{rest}"


@cache
def _shipped() -> Mapping[str, Any]:
    """Definitions of the types below `interfaces/`."""
    found: dict[str, Any] = {}
    for package in sorted(_folders(files("grounding.rosbridge") / "interfaces"), key=lambda f: f.name):
        for family in sorted(_folders(package), key=lambda f: f.name):
            for file in sorted(family.iterdir(), key=lambda f: f.name):
                name = f"{package.name}/{family.name}/{file.name.partition('.')[0]}"
                found |= _parsed(name, family.name, file.read_text(encoding="utf-8"))
    return found


def _folders(folder: Any) -> Iterator[Any]:
    return (entry for entry in folder.iterdir() if entry.is_dir())


def _parsed(full_name: str, family: str, text: str) -> dict[str, Any]:
    """Definitions of a type in ROS's format: one for a message, one each for the parts of others."""
    package, simple = full_name.partition("/")[0], full_name.rpartition("/")[2]
    parts: list[list[str]] = [[]]
    for line in text.splitlines():
        if family != "msg" and line.strip() == "---":
            parts.append([])
        else:
            parts[-1].append(line)
    suffixes = _PARTS[family]
    if len(parts) != len(suffixes):
        raise UnknownType(full_name, f"has {len(parts)} parts, a {family} has {len(suffixes)}")
    definitions = {}
    for suffix, lines in zip(suffixes, parts, strict=True):
        # rosbags knows messages only: it reads the part as one, which then gets its own name.
        (definition,) = get_types_from_msg("\n".join(lines), f"{package}/msg/{simple}{suffix}").values()
        definitions[f"{full_name}{suffix}"] = definition
    return definitions


def _kinds_in(definitions: Mapping[str, Any]) -> set[str]:
    """Full names of the message types that definitions have fields of."""
    kinds = set()
    for _, fields in definitions.values():
        for _, (kind, detail) in fields:
            element, name = (kind, detail) if kind in (Nodetype.BASE, Nodetype.NAME) else detail[0]
            if element is Nodetype.NAME:
                kinds.add(name)
    return kinds


def _field_of(name: str, kind: Nodetype, detail: Any) -> Field:
    if kind is Nodetype.BASE:
        return Field(name=name, kind=detail[0], is_message=False, length=None, text_bound=detail[1])
    if kind is Nodetype.NAME:
        return Field(name=name, kind=detail, is_message=True, length=None)
    (element, element_detail), size = detail
    fixed = kind is Nodetype.ARRAY
    return Field(
        name=name,
        kind=element_detail if element is Nodetype.NAME else element_detail[0],
        is_message=element is Nodetype.NAME,
        length=size if fixed else 0,
        bound=0 if fixed else size,
        text_bound=0 if element is Nodetype.NAME else element_detail[1],
    )


def _example(field: Field) -> str:
    if field.length is not None:
        return "[]"
    if field.is_message:
        return "{}"
    return {"string": "", "bool": "False", "float32": "0.0", "float64": "0.0"}.get(field.kind, "0")
