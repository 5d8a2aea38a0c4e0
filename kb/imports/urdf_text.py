"""The XML of a URDF file: what is no URDF is told of before anything else, with its line."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

from kb.imports.report import NotImportable

_LARGEST_BYTES = 20_000_000
_NAMED = ("link", "joint")
_CARRIED_OVER = {"link", "joint", "visual", "collision", "parent", "child", "limit", "mimic"}
"""Or told of where they are."""
_XACRO = ("http://www.ros.org/wiki/xacro", "http://wiki.ros.org/xacro", "http://ros.org/wiki/xacro")


class Text:
    """A file that is XML, whose root is a robot.

    Attributes:
        root: The element <robot>.
    """

    def __init__(self, path: Path) -> None:
        """Read a file.

        Raises:
            NotImportable: No file, no XML, no robot, xacro that is not expanded, or two links or joints of one name.
        """
        self._path = path
        self._lines: dict[tuple[str, str], int] = {}
        content = self._content()
        self._xml = expat.ParserCreate(namespace_separator=" ")
        self._depth = 0
        self._xml.StartElementHandler = self._start
        self._xml.EndElementHandler = self._end
        self._xml.StartDoctypeDeclHandler = self._refuse_doctype
        try:
            self._xml.Parse(content, True)
        except expat.ExpatError as error:
            told = f"does not parse as XML: {expat.ErrorString(error.code)}"
            raise NotImportable(path, error.lineno, told) from error
        self.root = ElementTree.fromstring(content)
        if self.root.tag != "robot":
            raise NotImportable(path, 1, f"is no URDF: its outermost element is <{self.root.tag}>, not <robot>")

    def _content(self) -> bytes:
        if not self._path.is_file():
            raise NotImportable(self._path, 0, "is no file")
        if self._path.stat().st_size > _LARGEST_BYTES:
            raise NotImportable(self._path, 0, f"is larger than {_LARGEST_BYTES // 1_000_000} MB")
        return self._path.read_bytes()

    def line(self, sort: str, name: str) -> int:
        """Where a link or joint begins; 0 if it is not known."""
        return self._lines.get((sort, name), 0)

    def names(self, sort: str) -> list[str]:
        """The names of all links or joints."""
        return sorted(n for s, n in self._lines if s == sort)

    def sensors(self) -> Iterator[tuple[str, str]]:
        """Link and type of each sensor of the simulator: <gazebo reference="link"><sensor type="ray">."""
        for about in self.root.iter("gazebo"):
            for sensor in about.iter("sensor"):
                yield about.get("reference", ""), sensor.get("type", "unknown")

    def others(self) -> list[tuple[str, int]]:
        """What is not carried over, or not all of it: beside links and joints, and in them; tag and how often."""
        within = (part for e in self.root if e.tag in _NAMED for part in e)
        tags = Counter(e.tag for e in (*self.root, *within))
        return sorted((t, n) for t, n in tags.items() if t not in _CARRIED_OVER)

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        line = self._xml.CurrentLineNumber
        expression = any("${" in v or ("$(" in v and k != "filename") for k, v in attributes.items())
        if tag.startswith(_XACRO) or expression:
            told = "is a xacro file, a URDF in the making; expand it first: xacro FILE > robot.urdf"
            raise NotImportable(self._path, line, told)
        self._depth += 1
        if self._depth == 2 and tag in _NAMED and "name" in attributes:  # deeper ones only refer to links and joints
            first = self._lines.setdefault((tag, attributes["name"]), line)
            if first != line:
                told = f"a second {tag} is called {attributes['name']}, as that of line {first}; rename one"
                raise NotImportable(self._path, line, told)

    def _end(self, tag: str) -> None:
        self._depth -= 1

    def _refuse_doctype(self, name: str, system: str | None, public: str | None, has_internal: bool) -> None:
        if has_internal or system or public:
            raise NotImportable(self._path, self._xml.CurrentLineNumber, "has a DOCTYPE; remove it")
