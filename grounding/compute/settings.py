"""Where the compute services of a site run: a TOML file.

[services]                      # "here" in this process, one after the other, where nothing is said
"/compute/path" = "workers"

[workers]                       # processes of their own
count = 2
memory_mb = 2048                # each
waiting = 64                    # calls that may wait for a worker
variables = ["MAP_TOKEN"]       # of the environment, that workers may see
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from kb.errors import BadFile
from kb.section import Section, read_file

PLACES = ("here", "workers")


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
class ComputeSettings:
    """Where services run, by name; here, if nothing is said."""

    places: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    workers: WorkerSettings = field(default_factory=WorkerSettings)


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
    top.end()
    return ComputeSettings(places=places, workers=workers)


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
