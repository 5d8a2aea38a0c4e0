"""Compute services of installed packages: which there are, where they run, and what is particular to our processes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path

import pytest

from grounding.compute import registry
from grounding.compute.settings import ComputeSettings, WorkerSettings
from grounding.placed import Placed
from grounding.runner import Fields, Runner
from grounding.workers import Workers
from kb.errors import ServiceFailed
from kb.files import SHIPPED
from tests.contracts.borrowed_lab import borrowed_lab

_SITE = SHIPPED / "sites" / "tue_lab"


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A package that offers compute services is installed."""
    with borrowed_lab(tmp_path_factory.mktemp("site_packages")):
        yield


def _submit(runner: Runner, name: str, timeout_s: float = 60.0, **fields: object) -> Future[Fields]:
    return runner.submit(f"/compute/{name}", fields, t_s=2.5, timeout_s=timeout_s)


def _failure(ended: Future[Fields]) -> tuple[str, str]:
    error = ended.exception(timeout=120.0)
    assert isinstance(error, ServiceFailed)
    return error.code, error.message


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("timeless", "does not take t_s, the time of the call"),
        ("loose", "takes fields other than by name; fields have names"),
        ("nothing", "is int, not a function"),
        ("missing", "cannot be loaded: module 'borrowed_lab' has no attribute 'missing'"),
        ("elsewhere", "cannot be loaded: No module named 'no_such_module'"),
    ],
)
def test_what_cannot_be_a_service_is_told(package: None, name: str, problem: str) -> None:
    """With its entry point; the check of groundings tells the same before anything runs."""
    with pytest.raises(registry.BadComputeService, match=problem) as caught:
        registry.function_of(f"/compute/{name}")
    assert str(caught.value) in registry.wrong_fields(f"/compute/{name}", set())


def test_how_a_worker_ended_is_told(package: None) -> None:
    """By the number that its system gives."""
    pool = Workers(WorkerSettings(count=1))
    assert _failure(_submit(pool, "crash")) == (
        "WorkerDied",
        "/compute/crash: its worker ended with exit code 3; another has taken its place",
    )
    pool.close()


@pytest.mark.parametrize("file", ["/etc/passwd", str(_SITE / ".." / "objects.owl"), "navMap.yaml"])
@pytest.mark.parametrize("place", ["here", "workers"])
def test_files_of_others_are_refused(package: None, tmp_path: Path, file: str, place: str) -> None:
    """Also where the way to them begins in the site's folder, and wherever the service runs."""
    placed = Placed(ComputeSettings(places={"/compute/nav_map": place}), tmp_path)
    placed.allow(_SITE)
    code, told = _failure(_submit(placed, "nav_map", map_file=file, radius_m=0.35))
    assert (code, f"is not in {_SITE}, where files of this site are" in told) == ("BadInput", True)
    placed.close()


def test_calls_that_were_taken_go_on_when_more_are_refused(package: None) -> None:
    """There is room again when they have ended."""
    pool = Workers(WorkerSettings(count=1, waiting=1))
    taken = [_submit(pool, "double", number=float(n)) for n in range(2)]
    refused = _submit(pool, "double", number=2.0)
    assert _failure(refused)[0] == "Busy"
    assert [ended.result(timeout=120.0)["twice"] for ended in taken] == [0.0, 2.0]
    assert _submit(pool, "double", number=3.0).result(timeout=120.0)["twice"] == 6.0
    pool.close()


def test_services_run_where_the_settings_say(package: None, tmp_path: Path) -> None:
    """One here, one in a worker, which is not started before it is needed."""
    placed = Placed(ComputeSettings(places={"/compute/see": "workers"}), tmp_path)
    assert _submit(placed, "double", number=2.0).result()["process"] == os.getpid()
    assert _submit(placed, "see", variable="MAP_TOKEN").result(timeout=120.0) == {"value": ""}
    placed.close()
