"""How a value of each ROS type is written to a tree, read from one, and what it is by default.

A form for each kind of type, put together once for each type: see `form_of`. `values` tells what trees are.
"""

from __future__ import annotations

import base64
import binascii
import math
from collections.abc import Callable, Collection, Mapping
from typing import Any, Literal, Protocol
from weakref import WeakKeyDictionary

import numpy as np
from rosbags.typesys.base import normalize_fieldname

from grounding.rosbridge.types import PLACEHOLDER, Field, Types
from grounding.rosbridge.wording import shortened, shown
from kb.errors import ConcertmasterError

Numbers = Literal["json", "exact"]
"""What becomes of bytes, NaN and infinity: base64 and null, or what they are."""


class BadValue(ConcertmasterError):
    """A tree does not hold a value of a ROS type, or a message does not hold what its type says.

    Attributes:
        path: The field, such as `pose.position.x` or `poses[3].header`; empty if it is the whole.
        what: What it is and what it should be.
    """

    fault = "request"

    def __init__(self, path: str, what: str) -> None:
        super().__init__(f"{path or 'the message'} {what}")
        self.path, self.what = path, what

    def inside(self, outer: str) -> BadValue:
        """The same, told from outside."""
        return BadValue(outer + ("." if self.path and self.path[0] != "[" else "") + self.path, self.what)


class Form(Protocol):
    """What is known of a type. `write` and `read` raise BadValue."""

    def write(self, value: Any, numbers: Numbers) -> object: ...

    def read(self, tree: Any, now_s: float) -> object: ...

    def default(self) -> object: ...


class _Truth:
    def write(self, value: Any, numbers: Numbers) -> object:
        return self.read(value, 0.0)

    def read(self, tree: Any, now_s: float) -> object:
        if isinstance(tree, bool | np.bool_):
            return bool(tree)
        raise BadValue("", f"is {shown(tree)}, should be true or false")

    def default(self) -> object:
        return False


class _Whole:
    """A whole number; one with a point counts if it is whole, as some clients have no others."""

    def __init__(self, kind: str) -> None:
        limits = np.iinfo(_dtype(kind))
        self._kind, self._least, self._greatest = kind, int(limits.min), int(limits.max)

    def write(self, value: Any, numbers: Numbers) -> object:
        return self.read(value, 0.0)

    def read(self, tree: Any, now_s: float) -> object:
        if type(tree) is int and self._least <= tree <= self._greatest:
            return tree
        if type(tree) is float and tree.is_integer() and abs(tree) <= 2**53:
            tree = int(tree)
        if isinstance(tree, bool) or not isinstance(tree, int | np.integer):
            raise BadValue("", f"is {shown(tree)}, should be a whole number ({self._kind})")
        if not self._least <= tree <= self._greatest:
            raise BadValue("", f"is {shown(tree)}, {self._kind} goes from {self._least} to {self._greatest}")
        return int(tree)

    def default(self) -> object:
        return 0


class _Real:
    def __init__(self, kind: str) -> None:
        self._kind, self._greatest = kind, float(np.finfo(_dtype(kind)).max)

    def write(self, value: Any, numbers: Numbers) -> object:
        if type(value) is not float:
            if isinstance(value, bool) or not isinstance(value, int | float | np.floating | np.integer):
                raise BadValue("", f"is {shown(value)}, should be a number ({self._kind})")
            value = float(value)
        return value if numbers == "exact" or math.isfinite(value) else None

    def read(self, tree: Any, now_s: float) -> object:
        if type(tree) is float and -self._greatest <= tree <= self._greatest:
            return tree
        if tree is None:
            return math.nan
        if isinstance(tree, bool) or not isinstance(tree, int | float):
            raise BadValue("", f"is {shown(tree)}, should be a number ({self._kind})")
        if abs(tree) > self._greatest and not (isinstance(tree, float) and math.isinf(tree)):
            raise BadValue("", f"is {shown(tree)}, {self._kind} goes to {self._greatest:g}")
        return float(tree)

    def default(self) -> object:
        return 0.0


class _Text:
    def __init__(self, bound: int) -> None:
        self._bound = bound

    def write(self, value: Any, numbers: Numbers) -> object:
        return self.read(value, 0.0)

    def read(self, tree: Any, now_s: float) -> object:
        if not isinstance(tree, str):
            raise BadValue("", f"is {shown(tree)}, should be a text")
        if self._bound and len(tree) > self._bound:
            raise BadValue("", f"has {len(tree)} characters, {self._bound} are allowed")
        return tree

    def default(self) -> object:
        return ""


class _Array:
    """A list of numbers or truth values: a numpy array."""

    def __init__(self, field: Field) -> None:
        self._kind, self._dtype = field.kind, _dtype(field.kind)
        self._length, self._bound = field.length, field.bound
        self._one = _PLAIN[field.kind]
        self._as_base64 = field.kind in ("uint8", "char")

    def write(self, value: Any, numbers: Numbers) -> object:
        if not isinstance(value, np.ndarray) or value.dtype != self._dtype or value.ndim != 1:
            value = self.read(list(value) if isinstance(value, tuple) else value, 0.0)
        self._check_length(len(value))
        if numbers == "json" and self._as_base64:
            return base64.b64encode(np.ascontiguousarray(value).data).decode("ascii")
        return np.ascontiguousarray(value)

    def read(self, tree: Any, now_s: float) -> object:
        if isinstance(tree, str | bytes) and self._dtype == np.uint8:
            array = np.frombuffer(self._bytes_of(tree), np.uint8)
        elif isinstance(tree, np.ndarray) and tree.ndim == 1:
            array = self._converted(tree)
        elif isinstance(tree, list):
            array = self._from_list(tree)
        else:
            raise BadValue("", f"is {shown(tree)}, should be a list of {self._kind}")
        self._check_length(len(array))
        return array

    def default(self) -> object:
        return np.zeros(self._length or 0, self._dtype)

    def _check_length(self, length: int) -> None:
        if self._length and length != self._length:
            raise BadValue("", f"has {length} elements, should have {self._length}")
        if self._bound and length > self._bound:
            raise BadValue("", f"has {length} elements, {self._bound} are allowed")

    def _bytes_of(self, tree: str | bytes) -> bytes:
        if isinstance(tree, bytes):
            return tree
        try:
            return base64.b64decode(tree, validate=True)
        except (binascii.Error, ValueError) as error:
            raise BadValue("", f"is a text that is no base64: {error}") from None

    def _from_list(self, tree: list[object]) -> np.ndarray[Any, Any]:
        kinds, of = set(map(type, tree)), self._dtype.kind
        try:
            if of == "f" and kinds <= {float, int, type(None)}:
                return self._converted(np.array(tree, np.float64))
            if kinds <= ({bool} if of == "b" else {int}):
                return np.array(tree, self._dtype)
        except (OverflowError, BadValue):
            pass  # which element it is, is told below
        values = []
        for index, element in enumerate(tree):
            try:
                values.append(self._one.read(element, 0.0))
            except BadValue as error:
                raise error.inside(f"[{index}]") from None
        return np.array(values, self._dtype)

    def _converted(self, array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        """A numeric array in the field's own type, if that holds the same numbers."""
        if array.dtype == self._dtype:
            return array
        kind = array.dtype.kind
        if self._dtype.kind != "b" and kind in "iuf" and array.size:
            with np.errstate(all="ignore"):
                result = array.astype(self._dtype)
                if self._dtype.kind == "f":
                    same = bool(np.all(np.isfinite(result) == np.isfinite(array)))
                elif kind == "f":
                    same = bool(np.all((result == array) & (abs(array) <= 2**53)))
                else:
                    same = bool(np.all((result == array) & ((result < 0) == (array < 0))))
            if same:
                return result
        elif not array.size:
            return array.astype(self._dtype)
        raise BadValue("", f"is an array of {array.dtype.name} with values that {self._kind} does not have")


class _List:
    """A list of texts or messages."""

    def __init__(self, one: Form, field: Field) -> None:
        self._one, self._kind, self._length, self._bound = one, field.kind, field.length, field.bound

    def write(self, value: Any, numbers: Numbers) -> object:
        return self._each(value, lambda element: self._one.write(element, numbers))

    def read(self, tree: Any, now_s: float) -> object:
        return self._each(tree, lambda element: self._one.read(element, now_s))

    def default(self) -> object:
        return [self._one.default() for _ in range(self._length or 0)]

    def _each(self, elements: Any, turn: Callable[[Any], object]) -> list[object]:
        if not isinstance(elements, list):
            raise BadValue("", f"is {shown(elements)}, should be a list of {self._kind}")
        if self._length and len(elements) != self._length:
            raise BadValue("", f"has {len(elements)} elements, should have {self._length}")
        if self._bound and len(elements) > self._bound:
            raise BadValue("", f"has {len(elements)} elements, {self._bound} are allowed")
        result = []
        try:
            for element in elements:
                result.append(turn(element))  # the length so far tells which one is wrong
        except BadValue as error:
            raise error.inside(f"[{len(result)}]") from None
        return result


class _Time:
    """A time or duration: two whole numbers, named as in ROS 1 or ROS 2; both are read. "now" is a time."""

    def __init__(self, types: Types, name: str) -> None:
        self._class: Any = types.store.types[name]
        self._is_time = name.endswith("/Time")
        self._names = ("sec", "nanosec") if types.ros_version == 2 else ("secs", "nsecs")

    def write(self, value: Any, numbers: Numbers) -> object:
        if not isinstance(value, self._class):
            raise BadValue("", f"is {shown(value)}, should be {self._class.__msgtype__}")
        whole, part = self._names
        return {whole: int(value.sec), part: int(value.nanosec)}

    def read(self, tree: Any, now_s: float) -> object:
        if isinstance(tree, str) and tree == "now" and self._is_time:
            sec, nanosec = divmod(round(now_s * 1e9), 1_000_000_000)
            return self._class(sec=sec, nanosec=nanosec)
        if not isinstance(tree, dict):
            words = " or the text now" if self._is_time else ""
            raise BadValue("", f"is {shown(tree)}, should be an object with {' and '.join(self._names)}{words}")
        values: list[object] = [0, 0]
        for name, number in tree.items():
            place = _TIME_PLACES.get(name)
            if place is None:
                raise BadValue(shortened(str(name)), f"is no field of a time, which has {' and '.join(self._names)}")
            try:
                values[place] = _TIME_NUMBERS[place].read(number, 0.0)
            except BadValue as error:
                raise error.inside(name) from None
        return self._class(*values)

    def default(self) -> object:
        return self._class(sec=0, nanosec=0)


class MessageForm:
    """Messages of one type.

    Attributes:
        fields: Names of the fields in their order.
    """

    def __init__(self, types: Types, name: str) -> None:
        fields = types.fields(name)
        self.name = name
        self.fields = tuple(field.name for field in fields)
        self._class: Any = types.store.types[name]
        self._forms = {field.name: _form_of_field(types, field) for field in fields}
        self._attributes = {field.name: normalize_fieldname(field.name) for field in fields}
        self._headers = {field.name for field in fields if field.kind == _HEADER and field.length is None}
        has_placeholder = any(field == PLACEHOLDER for field, _ in types.store.fielddefs[name][1])
        self._placeholder = (0,) if has_placeholder else ()
        self._known = {*self.fields, "seq"} if name == _HEADER else set(self.fields)  # clients of ROS 1 send a seq
        # Bound once: a path of a hundred poses takes a thousand of these steps.
        self._writers = [(name, self._attributes[name], form.write) for name, form in self._forms.items()]
        self._readers = [(name, form.read) for name, form in self._forms.items()]

    def write(self, value: Any, numbers: Numbers) -> dict[str, object]:
        if not isinstance(value, self._class):
            raise BadValue("", f"is {shown(value)}, should be {self.name}")
        result = {}
        name = ""
        try:
            for name, attribute, write in self._writers:
                result[name] = write(getattr(value, attribute), numbers)
        except BadValue as error:
            raise error.inside(name) from None
        return result

    def write_fields(self, values: Mapping[str, object], numbers: Numbers) -> dict[str, object]:
        """Some of the fields, by name."""
        self._check_names(values)
        result = {}
        name = ""
        try:
            for name, value in values.items():
                result[name] = self._forms[name].write(value, numbers)
        except BadValue as error:
            raise error.inside(name) from None
        return result

    def read(self, tree: Any, now_s: float) -> object:
        return self._class(*self.read_fields(tree, now_s, ()).values(), *self._placeholder)

    def read_fields(self, tree: Any, now_s: float, optional: Collection[str]) -> dict[str, object]:
        """All fields by name in their order, but for those of `optional` that are missing."""
        if type(tree) is not dict and not isinstance(tree, Mapping):
            raise BadValue("", f"is {shown(tree)}, should be an object with the fields of {self.name}")
        self._check_names(tree)
        result = {}
        name = ""
        try:
            for name, read in self._readers:
                if name in tree:
                    result[name] = read(tree[name], now_s)
                elif name not in optional:
                    result[name] = self._missing(name, now_s)
        except BadValue as error:
            raise error.inside(name) from None
        return result

    def default(self) -> object:
        return self._class(*(form.default() for form in self._forms.values()), *self._placeholder)

    def _missing(self, name: str, now_s: float) -> object:
        """The protocol's section 3.2.3: a header without a stamp, or a message without its header, is of now."""
        if name in self._headers:
            return self._forms[name].read({}, now_s)
        if name == "stamp" and self.name == _HEADER:
            return self._forms[name].read("now", now_s)
        return self._forms[name].default()

    def _check_names(self, given: Mapping[str, object]) -> None:
        if not given.keys() <= self._known:
            unknown = next(name for name in given if name not in self._known)
            known = ", ".join(self.fields) or "none"
            raise BadValue(shortened(str(unknown)), f"is no field of {self.name}, which has {known}")


def form_of(types: Types, name: str) -> MessageForm:
    """The form of a message type, by its full name; made once."""
    known = _FORMS.setdefault(types, {})
    form = known.get(name)
    if form is None:
        form = known[name] = MessageForm(types, name)
    return form


_FORMS: WeakKeyDictionary[Types, dict[str, MessageForm]] = WeakKeyDictionary()


def _form_of_field(types: Types, field: Field) -> Form:
    if field.is_message:
        one: Form = _Time(types, field.kind) if field.kind in _TIMES else form_of(types, field.kind)
    elif field.kind == "string":
        one = _Text(field.text_bound)
    else:
        one = _PLAIN[field.kind]
    if field.length is None:
        return one
    return _List(one, field) if field.is_message or field.kind == "string" else _Array(field)


_HEADER = "std_msgs/msg/Header"
_TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_TIME_PLACES = {"sec": 0, "secs": 0, "nanosec": 1, "nsecs": 1}

_OCTETS = ("byte", "char")
_NUMBERS = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64")


def _dtype(kind: str) -> np.dtype[Any]:
    return np.dtype("uint8" if kind in _OCTETS else kind)


_PLAIN: Mapping[str, Form] = {
    "bool": _Truth(),
    **{kind: _Real(kind) if kind.startswith("float") else _Whole(kind) for kind in (*_OCTETS, *_NUMBERS)},
}
_TIME_NUMBERS = (_PLAIN["int32"], _PLAIN["uint32"])
