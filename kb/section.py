"""A section of a TOML file that is read field by field, so that every fault names its file and field."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Collection, Iterator
from importlib.resources.abc import Traversable

from kb.errors import BadFile

_NAME = re.compile(r"[a-z][a-z0-9_]*")


class Section:
    """One table of a TOML file. Read its fields, then call `end`, which refuses the fields that nobody read.

    Every reader raises `error` if the field is missing or is not what it should be.
    """

    def __init__(self, file: str, path: str, fields: dict[str, object], error: type[BadFile]) -> None:
        self._file = file
        self._error = error
        self._path = path
        self._fields = fields
        self._read: set[str] = set()

    def fault(self, key: str, problem: str) -> BadFile:
        """The error that says what is wrong with field `key`."""
        return self._error(self._file, self._path_of(key), problem)

    def text(self, key: str, choices: Collection[str] | None = None) -> str:
        """A string, which is one of `choices` if they are given."""
        value = self._value(key)
        if not isinstance(value, str) or not value:
            raise self.fault(key, f"{value!r} is not a text")
        if choices is not None and value not in choices:
            raise self.fault(key, f"unknown: {value!r}; known are {', '.join(sorted(choices))}")
        return value

    def name(self, key: str) -> str:
        """A string that can name a thing: lower case letters, digits and underscores."""
        value = self.text(key)
        if not _NAME.fullmatch(value):
            raise self.fault(key, f"{value!r} is not a name; a name is like kitchen_table_2")
        return value

    def integers(self, key: str, low: int = 0) -> tuple[int, ...]:
        """A list of whole numbers from `low`."""
        value = self._value(key)
        if not isinstance(value, list):
            raise self.fault(key, f"{value!r} is not a list of whole numbers >= {low}")
        return tuple(self._whole(key, item, low) for item in value)

    def texts(self, key: str) -> tuple[str, ...]:
        """A list of strings."""
        value = self._value(key)
        if not isinstance(value, list) or not all(isinstance(item, str) and item for item in value):
            raise self.fault(key, f"{value!r} is not a list of texts")
        return tuple(value)

    def name_if_given(self, key: str) -> str | None:
        """As `name`, or None where the field is left out."""
        self._read.add(key)
        return self.name(key) if key in self._fields else None

    def number(self, key: str, low: float = -math.inf, high: float = math.inf) -> float:
        """A finite number from `low` to `high`."""
        return self._checked(key, self._value(key), low, high)

    def numbers(self, key: str, count: int, low: float = -math.inf, high: float = math.inf) -> tuple[float, ...]:
        """A list of `count` finite numbers from `low` to `high`."""
        value = self._value(key)
        if not isinstance(value, list) or len(value) != count:
            raise self.fault(key, f"{value!r} is not a list of {count} numbers")
        return tuple(self._checked(key, item, low, high) for item in value)

    def integer(self, key: str, low: int = 0) -> int:
        """A whole number from `low`."""
        return self._whole(key, self._value(key), low)

    def __iter__(self) -> Iterator[str]:
        """The names of all fields, in the order of the file."""
        return iter(self._fields)

    def truth(self, key: str) -> bool:
        """A truth value."""
        value = self._value(key)
        if not isinstance(value, bool):
            raise self.fault(key, f"{value!r} is neither true nor false")
        return value

    def section(self, key: str) -> Section:
        """The table under `key`."""
        return self._as_section(key, self._value(key))

    def sections(self, key: str) -> Iterator[tuple[str, Section]]:
        """The named tables under `key`, in the order of the file."""
        below = self.section(key)
        return below.named()

    def sections_if_given(self, key: str) -> Iterator[tuple[str, Section]]:
        """As `sections`, or none where the field is left out."""
        self._read.add(key)
        return self.sections(key) if key in self._fields else iter(())

    def has(self, key: str) -> bool:
        """Whether the field is there."""
        self._read.add(key)
        return key in self._fields

    def named(self) -> Iterator[tuple[str, Section]]:
        """All fields as named tables, in the order of the file."""
        for name in self._fields:
            if not _NAME.fullmatch(name):
                raise self.fault(name, f"{name!r} is not a name; a name is like kitchen_table_2")
            yield name, self.section(name)

    def end(self) -> None:
        """Refuse the fields that were not read."""
        unknown = [key for key in self._fields if key not in self._read]
        if unknown:
            raise self.fault(unknown[0], f"unknown field; known here are {', '.join(sorted(self._read))}")

    def _path_of(self, key: str) -> str:
        return f"{self._path}.{key}" if self._path else key

    def _value(self, key: str) -> object:
        self._read.add(key)
        if key not in self._fields:
            raise self.fault(key, "missing")
        return self._fields[key]

    def _as_section(self, key: str, value: object) -> Section:
        if not isinstance(value, dict):
            raise self.fault(key, f"{value!r} is not a table [{self._path_of(key)}]")
        return Section(self._file, self._path_of(key), value, self._error)

    def _whole(self, key: str, value: object, low: int) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or value < low:
            raise self.fault(key, f"{value!r} is not a whole number >= {low}")
        return value

    def _checked(self, key: str, value: object, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise self.fault(key, f"{value!r} is not a number")
        if not low <= value <= high:
            raise self.fault(key, f"{value!r} is not from {low:g} to {high:g}")
        return float(value)


def read_file(file: Traversable, error: type[BadFile]) -> Section:
    """The whole of a TOML file.

    Args:
        error: What is raised about the file and its fields.

    Raises:
        BadFile: the file cannot be read, or is not TOML.
    """
    try:
        return Section(str(file), "", tomllib.loads(file.read_text(encoding="utf-8")), error)
    except OSError as failed:
        raise error(str(file), "file", f"cannot be read: {failed.strerror}") from failed
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as failed:
        raise error(str(file), "file", f"is not TOML: {failed}") from failed
