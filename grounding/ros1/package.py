"""The services of a knowledge base as a ROS 1 package: `.srv` files, of which catkin or genpy make classes.

In ROS 1 both ends of a service need a class of its type, so whoever calls or offers a service that is grounded needs
these files.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from grounding.ros1.wire import Wire
from grounding.rosbridge.types import ServiceType

_PACKAGE = """<?xml version="1.0"?>
<package format="2">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>Services in which processes are grounded.</description>
  <maintainer email="nobody@example.org">nobody</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>catkin</buildtool_depend>
  <build_depend>message_generation</build_depend>
  <exec_depend>message_runtime</exec_depend>
{depends}</package>
"""

_BUILD = """cmake_minimum_required(VERSION 3.0.2)
project({name})
find_package(catkin REQUIRED COMPONENTS message_generation {depends})
add_service_files(FILES {files})
generate_messages(DEPENDENCIES {depends})
catkin_package(CATKIN_DEPENDS message_runtime {depends})
"""


def write_package(folder: Path, services: Iterable[ServiceType], wire: Wire) -> list[Path]:
    """Write the packages of service types into a folder, such as the `src` of a catkin workspace.

    Returns:
        The folders of the packages.

    Raises:
        UnknownType: ROS 1 cannot have one of these types.
        OSError: A file cannot be written.
    """
    by_package: dict[str, dict[str, str]] = {}
    for service in services:
        package, _, name = service.name.split("/")
        by_package.setdefault(package, {})[name] = wire.service_text(service)
    for package, texts in by_package.items():
        (folder / package / "srv").mkdir(parents=True, exist_ok=True)
        kinds = {line.split()[0] for text in texts.values() for line in text.splitlines() if "/" in line.split()[0]}
        depends = sorted({kind.partition("/")[0] for kind in kinds})
        tags = "".join(f"  <depend>{other}</depend>\n" for other in depends)
        files = " ".join(f"{name}.srv" for name in sorted(texts))
        _write(folder / package / "package.xml", _PACKAGE.format(name=package, depends=tags))
        _write(folder / package / "CMakeLists.txt", _BUILD.format(name=package, depends=" ".join(depends), files=files))
        for name, text in texts.items():
            _write(folder / package / "srv" / f"{name}.srv", text)
    return [folder / package for package in sorted(by_package)]


def _write(file: Path, text: str) -> None:
    file.write_text(text, encoding="utf-8")
