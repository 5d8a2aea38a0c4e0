"""The types of ROS 2 as they are installed where this runs: what a message may hold is what its class there says.

Only for the process that has ROS 2 (see bridge.py).
"""

from __future__ import annotations

import re
import struct
from importlib import import_module
from typing import Any

from grounding.rosbridge.types import ActionType, Family, ServiceType, Types, UnknownType, short_name
from grounding.rosbridge.values import BadValue

_OUR_OWN = "rosapi_msgs"  # of services that the server itself offers
_PARTS = {"msg": (), "srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}
_BYTE_ORDERS = (b"\0\0", b"\0\1")
_PRIMITIVES = {"boolean": "bool", "octet": "byte", "float": "float32", "double": "float64"}
_SAME = {"char": "uint8"}
_SEQUENCE = re.compile(r"sequence<(?P<of>.+?)(, (?P<bound>\d+))?>")
_ARRAY = re.compile(r"(?P<of>.+)\[(?P<length>\d+)\]")
_TEXT = re.compile(r"string<(?P<bound>\d+)>")


class InstalledTypes(Types):
    """All types that have a class here; others are unknown, also where their fields are known elsewhere."""

    def __init__(self) -> None:
        super().__init__(2)
        self._classes: dict[str, Any] = {}

    def message(self, name: str) -> str:
        if "/srv/" not in name and "/action/" not in name:  # the parts of others come with the whole
            self._learn(name, "msg")
        return super().message(name)

    def service(self, name: str) -> ServiceType:
        self._learn(name, "srv")
        return super().service(name)

    def action(self, name: str) -> ActionType:
        self._learn(name, "action")
        return super().action(name)

    def class_of(self, full_name: str) -> Any:
        """The class of a type that has been asked for before; None for our own, which nobody else has."""
        return self._classes.get(full_name)

    def read(self, full_name: str, data: bytes) -> object:
        """The message in bytes (CDR); rclpy leaves room behind it, which is passed over.

        Raises:
            BadValue: The bytes are none of this type.
        """
        definition = self.store.get_msgdef(full_name)
        if data[:2] not in _BYTE_ORDERS:
            raise BadValue("", f"is in a form of CDR that is not known: {data[:2].hex()}")
        read = definition.deserialize_cdr_le if data[1] else definition.deserialize_cdr_be
        try:
            message, _ = read(memoryview(data)[4:], 0, definition.cls, self.store)
        except (struct.error, ValueError) as error:
            raise BadValue("", f"is no {full_name}: {error}") from None
        return message

    def _learn(self, name: str, family: Family) -> None:
        """Take the fields of a type, and of those in it, from their classes.

        Raises:
            UnknownType: It is not installed here.
        """
        package, simple = name.partition("/")[0], name.rpartition("/")[2]
        full = f"{package}/{family}/{simple}"
        if full in self._classes or package in (_OUR_OWN, "rosapi"):
            return
        try:
            found = getattr(import_module(f"{package}.{family}"), simple)
        except (ImportError, AttributeError):
            raise UnknownType(name, f"is not installed in the environment of ROS 2 ({package}.{family})") from None
        parts = [getattr(found, part) for part in _PARTS[family]] or [found]
        names = [f"{full}_{part}" for part in _PARTS[family]] or [full]
        texts = [self._text(part) for part in parts]
        if names[0] not in self.store.fielddefs:
            self.add(family, full, "\n---\n".join(texts))
        for part_name, part in zip(names, parts, strict=True):
            self._compare(part_name, part)
        self._classes[full] = found

    def _text(self, of: Any) -> str:
        """The fields of a class in ROS's format."""
        lines = []
        for field, kind in of.get_fields_and_field_types().items():
            told = _told(kind)
            element = told.partition("[")[0]
            if "/" in element:
                self._learn(element, "msg")
            lines.append(f"{told} {field}")
        return "\n".join(lines)

    def _compare(self, name: str, of: Any) -> None:
        """A type that we have of another version of ROS 2 is not used: its bytes would be misread."""
        known = [
            (field.name, _SAME.get(field.kind, field.kind).rpartition("/")[2], field.length)
            for field in self.fields(name)
        ]
        here = []
        for field, kind in of.get_fields_and_field_types().items():
            element, _, size = _told(kind).partition("[")
            digits = size.rstrip("]")
            length = None if not size else int(digits) if digits.isdecimal() else 0
            here.append((field, element.rpartition("/")[2].partition("<=")[0], length))
        if known != here:
            raise UnknownType(short_name(name), "has other fields in this version of ROS 2 than are known here")


def _told(kind: str) -> str:
    """`sequence<double, 3>` as `float64[<=3]`."""
    if found := _SEQUENCE.fullmatch(kind):
        return f"{_told(found['of'])}[{'<=' + found['bound'] if found['bound'] else ''}]"
    if found := _ARRAY.fullmatch(kind):
        return f"{_told(found['of'])}[{found['length']}]"
    if found := _TEXT.fullmatch(kind):
        return f"string<={found['bound']}"
    return _PRIMITIVES.get(kind, kind)
