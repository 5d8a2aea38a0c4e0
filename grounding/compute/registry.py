"""The compute services by name: ours ([RoboEarth] Table 2), and those of installed packages.

A package offers services through the entry point group `concertmaster.compute`; `grasp_pose = "my_lab.grasping:pose"`
is the service `/compute/grasp_pose`. A service is a function that takes the fields of the request by name, each
annotated with its type (a class of grounding/messages.py, or str, bool, int, float), and `t_s`, the time of the call; a
field that has a default may be left out. It gives the fields of the reply by name, or raises ServiceFailed. It keeps
nothing between calls, so that it may run in any process.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Mapping, Set
from functools import cache
from importlib.metadata import EntryPoint, entry_points, version
from pathlib import Path
from typing import TypeAlias

from grounding.compute.detection import detection
from grounding.compute.global_localization import pose_anywhere
from grounding.compute.localization import pose
from grounding.compute.maps import image_of, loc_map, nav_map
from grounding.compute.path import path
from grounding.compute.travel import travel
from grounding.compute.values import compare, copy
from grounding.compute.velocity import vel_cmd
from kb.errors import ConcertmasterError, ServiceFailed

GROUP = "concertmaster.compute"

ComputeFunction: TypeAlias = Callable[..., Mapping[str, object]]

_OURS: dict[str, ComputeFunction] = {
    "/compute/compare": compare,
    "/compute/copy": copy,
    "/compute/detection": detection,
    "/compute/loc_map": loc_map,
    "/compute/nav_map": nav_map,
    "/compute/path": path,
    "/compute/pose": pose,
    "/compute/pose_anywhere": pose_anywhere,
    "/compute/travel": travel,
    "/compute/vel_cmd": vel_cmd,
}


class BadComputeService(ConcertmasterError):
    """An installed package offers a compute service that cannot be one.

    Attributes:
        service: Its name.
        origin: The entry point.
    """

    fault = "world"

    def __init__(self, service: str, origin: str, problem: str) -> None:
        super().__init__(f"compute service {service} ({origin}): {problem}")
        self.service = service
        self.origin = origin


def function_of(service: str) -> ComputeFunction:
    """The function that runs a service.

    Raises:
        ServiceFailed: There is none (NoSuchService).
        BadComputeService: A package offers something else under this name.
    """
    if service in _OURS:
        return _OURS[service]
    if service not in _installed():
        known = ", ".join(sorted({*_OURS, *_installed()}))
        raise ServiceFailed("NoSuchService", f"there is no {service}; there is {known}")
    return _loaded(service)


def is_compute_service(service: str) -> bool:
    """Whether a compute service of this name is here."""
    return service in _OURS or service in _installed()


def wrong_fields(service: str, names: Set[str]) -> str:
    """What is wrong with calling a compute service with fields of these names; empty if nothing is."""
    try:
        function = function_of(service)
    except ConcertmasterError as error:
        return error.message if isinstance(error, ServiceFailed) else str(error)
    takes = {name: p for name, p in inspect.signature(function).parameters.items() if name != "t_s"}
    needs = {name for name, parameter in takes.items() if parameter.default is inspect.Parameter.empty}
    if needs <= names <= set(takes):
        return ""
    told = ", ".join(name if name in needs else f"{name} (may be left out)" for name in sorted(takes))
    return f"{service} takes the fields {told}; given: {', '.join(sorted(names)) or 'none'}"


def files_read(service: str, file: Path) -> list[Path]:
    """The files that a service reads when it is given one: that, and the pictures of our maps."""
    return [file, image_of(file)] if service in _READ_MAPS else [file]


def code_of(service: str) -> str:
    """What the reply to a request depends on beside the request: a digest of the code that computes it.

    That is the package, in its version, in which the function is written, and the versions of numpy and scipy.

    Raises:
        ServiceFailed: There is no such service.
        BadComputeService: A package offers something else under this name.
        TypeError: It is not written in Python.
    """
    function = function_of(service)
    digest = hashlib.sha256(f"numpy {version('numpy')} scipy {version('scipy')}".encode())
    if service not in _OURS and (package := _installed()[service].dist) is not None:
        digest.update(f"{package.name} {package.version}".encode())
    source = Path(inspect.getfile(function))
    in_package = "." in function.__module__
    for file in sorted(source.parent.rglob("*.py")) if in_package else [source]:
        digest.update(file.read_bytes())
    return digest.hexdigest()


_READ_MAPS = {"/compute/loc_map", "/compute/nav_map", "/compute/travel"}


@cache
def _installed() -> Mapping[str, EntryPoint]:
    return {f"/compute/{point.name}": point for point in entry_points(group=GROUP)}


@cache
def _loaded(service: str) -> ComputeFunction:
    point = _installed()[service]
    try:
        function = point.load()
    except (ImportError, AttributeError) as error:
        raise BadComputeService(service, point.value, f"cannot be loaded: {error}") from error
    if not callable(function):
        raise BadComputeService(service, point.value, f"is {type(function).__name__}, not a function")
    parameters = inspect.signature(function).parameters
    if "t_s" not in parameters:
        raise BadComputeService(service, point.value, "does not take t_s, the time of the call")
    plain = [name for name, p in parameters.items() if p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD, p.POSITIONAL_ONLY)]
    if plain:
        problem = f"takes {', '.join(plain)} other than by name; fields have names"
        raise BadComputeService(service, point.value, problem)
    return function  # type: ignore[no-any-return]
