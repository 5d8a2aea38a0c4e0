"""Where the compute services of a site run: a TOML file.

[services]                      # "here" in this process, one after the other, where nothing is said
"/compute/path" = "workers"
"/compute/detection" = "ray"

[workers]                       # processes of their own
count = 2
memory_mb = 2048                # each
waiting = 64                    # calls that may wait for a worker
variables = ["MAP_TOKEN"]       # of the environment, that workers may see

[ray]                           # what [workers] says holds for workers on a Ray cluster too; beyond that
address = "local"               # a cluster started here; else where one is, such as "10.0.0.5:6379"
cpus = 1.0                      # processors reserved for each worker
retries = 1                     # of a call whose worker dies
start_s = 60.0                  # how long the cluster may take to find room for a worker

[cache]                         # of what is computed from equal inputs, where the ontology allows it
memory_mb = 64
on_disk = ["/compute/nav_map"]  # kept for later runs as well
disk_mb = 512
folder = "/var/cache/lab"       # that of the user if left out
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from kb.errors import BadFile
from kb.section import Section, read_file

PLACES = ("here", "workers", "ray")


class BadComputeSettings(BadFile):
    """A file of settings for compute services is wrong."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerSettings:
    """How the workers of a site are set up.

    Attributes:
        count: How many there are.
        memory_mb: How much memory each may have.
        waiting: How many calls may wait for one; further ones are refused.
        environment: Variables that they see, beside those that every program needs.
    """

    count: int = 2
    memory_mb: int = 2048
    waiting: int = 64
    environment: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True, slots=True, kw_only=True)
class RaySettings:
    """Where workers on a Ray cluster are; how many, and how they are limited, is said by WorkerSettings.

    Attributes:
        address: Of the cluster; `local` for one that is started on this machine, and ends with us.
        cpus: Processors that are reserved for each worker.
        retries: How often a call whose worker dies is made again.
        start_s: How long the cluster may take to find room for a worker.
    """

    address: str = "local"
    cpus: float = 1.0
    retries: int = 1
    start_s: float = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CacheSettings:
    """What is kept of what was computed.

    Attributes:
        memory_mb: Bound on what is kept in memory, of services whose grounding says `isCacheable`.
        on_disk: Services, of deterministic processes, whose replies are kept for later runs.
        disk_mb: Bound on what is kept on disk.
        folder: Where that is; None for the cache folder of the user.
    """

    memory_mb: int = 64
    on_disk: tuple[str, ...] = ()
    disk_mb: int = 512
    folder: Path | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ComputeSettings:
    """Where services run, by name; here, if nothing is said."""

    places: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    workers: WorkerSettings = field(default_factory=WorkerSettings)
    ray: RaySettings = field(default_factory=RaySettings)
    cache: CacheSettings = field(default_factory=CacheSettings)


def read_settings(file: Path, environment: Mapping[str, str]) -> ComputeSettings:
    """Read a file of settings.

    Args:
        environment: The variables that are set.

    Raises:
        BadComputeSettings: It is wrong, or names a variable that is not set.
    """
    top = read_file(file, BadComputeSettings)
    services = top.section("services")
    places = {}
    for service in services:
        if not service.startswith("/"):
            raise services.fault(service, "is no name of a service; one is like /compute/path")
        places[service] = services.text(service, choices=PLACES)
    services.end()
    workers = _workers(top.section("workers"), environment) if top.has("workers") else WorkerSettings()
    ray = _ray(top.section("ray")) if top.has("ray") else RaySettings()
    cache = _cache(top.section("cache")) if top.has("cache") else CacheSettings()
    top.end()
    return ComputeSettings(places=places, workers=workers, ray=ray, cache=cache)


def _workers(section: Section, environment: Mapping[str, str]) -> WorkerSettings:
    usual = WorkerSettings()
    count = section.integer("count", low=1) if section.has("count") else usual.count
    memory_mb = section.integer("memory_mb", low=256) if section.has("memory_mb") else usual.memory_mb
    waiting = section.integer("waiting") if section.has("waiting") else usual.waiting
    variables = section.texts("variables") if section.has("variables") else ()
    for name in variables:
        if name not in environment:
            raise section.fault("variables", f"{name} is not set in the environment")
    section.end()
    seen = {name: environment[name] for name in variables}
    return WorkerSettings(count=count, memory_mb=memory_mb, waiting=waiting, environment=seen)


def _ray(section: Section) -> RaySettings:
    usual = RaySettings()
    address = section.text("address") if section.has("address") else usual.address
    cpus = section.number("cpus", low=0.01) if section.has("cpus") else usual.cpus
    retries = section.integer("retries") if section.has("retries") else usual.retries
    start_s = section.number("start_s", low=0.1) if section.has("start_s") else usual.start_s
    section.end()
    return RaySettings(address=address, cpus=cpus, retries=retries, start_s=start_s)


def _cache(section: Section) -> CacheSettings:
    usual = CacheSettings()
    memory_mb = section.integer("memory_mb") if section.has("memory_mb") else usual.memory_mb
    on_disk = section.texts("on_disk") if section.has("on_disk") else usual.on_disk
    for service in on_disk:
        if not service.startswith("/"):
            raise section.fault("on_disk", f"{service} is no name of a service; one is like /compute/nav_map")
    disk_mb = section.integer("disk_mb", low=1) if section.has("disk_mb") else usual.disk_mb
    folder = Path(section.text("folder")) if section.has("folder") else usual.folder
    section.end()
    return CacheSettings(memory_mb=memory_mb, on_disk=on_disk, disk_mb=disk_mb, folder=folder)
