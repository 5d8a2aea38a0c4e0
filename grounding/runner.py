"""Runs the compute services ([RoboEarth] Table 2) in this process."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Set
from pathlib import Path
from typing import Any

from grounding.compute.detection import detection
from grounding.compute.localization import pose
from grounding.compute.maps import loc_map, nav_map
from grounding.compute.path import path
from grounding.compute.travel import travel
from grounding.compute.values import compare, copy
from grounding.compute.velocity import vel_cmd
from grounding.inprocess import Service
from kb.clock import Clock
from kb.errors import ServiceFailed

_COMPUTE: dict[str, Callable[..., Mapping[str, object]]] = {
    "/compute/compare": compare,
    "/compute/copy": copy,
    "/compute/detection": detection,
    "/compute/loc_map": loc_map,
    "/compute/nav_map": nav_map,
    "/compute/path": path,
    "/compute/pose": pose,
    "/compute/travel": travel,
    "/compute/vel_cmd": vel_cmd,
}


def compute(service: str, fields: Mapping[str, object], *, t_s: float) -> Mapping[str, object]:
    """Run a compute service now.

    Raises:
        ServiceFailed: It cannot do what it is asked, does not exist, or does not take these fields.
    """
    function = _COMPUTE.get(service)
    if function is None:
        raise ServiceFailed("NoSuchService", f"there is no {service}; there is {', '.join(sorted(_COMPUTE))}")
    arguments: dict[str, Any] = {
        name: Path(str(value)) if name.endswith("_file") else value for name, value in fields.items()
    }
    wrong = wrong_fields(service, set(arguments))
    if wrong:
        raise ServiceFailed("BadInput", wrong)
    return function(**arguments, t_s=t_s)


def wrong_fields(service: str, names: Set[str]) -> str:
    """What is wrong with calling a compute service with fields of these names; empty if nothing is."""
    function = _COMPUTE.get(service)
    if function is None:
        return f"there is no {service}; there is {', '.join(sorted(_COMPUTE))}"
    takes = set(function.__annotations__) - {"return", "t_s"}
    if names == takes:
        return ""
    return f"{service} takes the fields {', '.join(sorted(takes))}; given: {', '.join(sorted(names)) or 'none'}"


def is_ours(service: str) -> bool:
    """Whether this module runs a compute service of this name."""
    return service in _COMPUTE


def compute_services(clock: Clock, duration_s: Mapping[str, float]) -> dict[str, Service]:
    """The compute services for a transport.

    Args:
        duration_s: How long each is said to take, by name of the service: under simulated time, the time
            that passes until its reply.
    """

    def service(name: str, seconds: float) -> Service:
        return Service(handler=lambda fields: compute(name, fields, t_s=clock.now_s), latency_s=seconds)

    return {name: service(name, seconds) for name, seconds in duration_s.items() if name in _COMPUTE}
