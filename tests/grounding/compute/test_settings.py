"""Settings of compute services: what a file says, and what is told of a wrong one."""

from __future__ import annotations

from pathlib import Path

import pytest

from grounding.compute.settings import (
    BadComputeSettings,
    CacheSettings,
    ComputeSettings,
    RaySettings,
    WorkerSettings,
    read_settings,
)

_WHOLE = """
[services]
"/compute/path" = "workers"
"/compute/pose" = "here"

[workers]
count = 3
memory_mb = 512
waiting = 0
variables = ["MAP_TOKEN"]

[ray]
address = "10.0.0.5:6379"
cpus = 0.5
retries = 0
start_s = 5

[cache]
memory_mb = 0
on_disk = ["/compute/nav_map"]
disk_mb = 10
folder = "kept"
"""


def _read(tmp_path: Path, text: str) -> ComputeSettings:
    (tmp_path / "compute.toml").write_text(text)
    return read_settings(tmp_path / "compute.toml", {"MAP_TOKEN": "s3cret", "OTHER": "x"})


def test_a_file_says_where_services_run(tmp_path: Path) -> None:
    """And how the workers are set up: they see the variables that are named."""
    assert _read(tmp_path, _WHOLE) == ComputeSettings(
        places={"/compute/path": "workers", "/compute/pose": "here"},
        workers=WorkerSettings(count=3, memory_mb=512, waiting=0, environment={"MAP_TOKEN": "s3cret"}),
        ray=RaySettings(address="10.0.0.5:6379", cpus=0.5, retries=0, start_s=5.0),
        cache=CacheSettings(memory_mb=0, on_disk=("/compute/nav_map",), disk_mb=10, folder=Path("kept")),
    )


def test_what_is_not_said_is_as_usual(tmp_path: Path) -> None:
    """Two workers, 2 GB each, and they see no variable."""
    assert _read(tmp_path, "[services]") == ComputeSettings()
    assert _read(tmp_path, "[services]\n[workers]\n") == ComputeSettings()


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("[services]", "[service]", "compute.toml: services: missing"),
        ('"workers"\n"', '"moon"\n"', "services./compute/path: unknown: 'moon'; known are here, ray, workers"),
        ('"/compute/pose"', '"compute_pose"', "services.compute_pose: is no name of a service"),
        ("count = 3", "count = 0", "workers.count: 0 is not a whole number >= 1"),
        ("memory_mb = 512", "memory_mb = 5", "workers.memory_mb: 5 is not a whole number >= 256"),
        ("waiting = 0", "waiting = true", "workers.waiting: True is not a whole number >= 0"),
        ('["MAP_TOKEN"]', '["MAP_KEY"]', "workers.variables: MAP_KEY is not set in the environment"),
        ('["MAP_TOKEN"]', '"MAP_TOKEN"', "workers.variables: 'MAP_TOKEN' is not a list of texts"),
        ("count = 3", "counts = 3", "workers.counts: unknown field; known here are count, memory_mb"),
        ("cpus = 0.5", "cpus = 0", "ray.cpus: 0 is not from 0.01 to inf"),
        ("disk_mb = 10", "disk_mb = 0", "cache.disk_mb: 0 is not a whole number >= 1"),
        ('["/compute/nav_map"]', '["nav_map"]', "cache.on_disk: nav_map is no name of a service"),
        ("[workers]", "[workers", "compute.toml: file: is not TOML"),
    ],
)
def test_what_is_wrong_is_told_with_its_field(tmp_path: Path, old: str, new: str, told: str) -> None:
    """And what would be right."""
    assert old in _WHOLE
    with pytest.raises(BadComputeSettings) as caught:
        _read(tmp_path, _WHOLE.replace(old, new, 1))
    assert told in str(caught.value)


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    """With its name."""
    with pytest.raises(BadComputeSettings, match=r"no\.toml: file: cannot be read: No such file"):
        read_settings(tmp_path / "no.toml", {})
