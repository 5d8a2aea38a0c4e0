"""One contract for all runners: a service gives the same answer here, in a worker, and on a Ray cluster."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path

import numpy as np
import pytest

from grounding.compute.settings import RaySettings, WorkerSettings
from grounding.messages import OccupancyGrid, pose_stamped
from grounding.on_ray import OnRay
from grounding.runner import Fields, Here, Runner
from grounding.workers import Workers
from kb.errors import ServiceFailed
from kb.files import SHIPPED
from tests.contracts.borrowed_lab import borrowed_lab

_SITE = SHIPPED / "sites" / "tue_lab"
_SMALL = RaySettings(cpus=0.125)  # so that the runners of these tests have room beside each other
_RAY = pytest.param("ray", marks=pytest.mark.ray)


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A package that offers compute services is installed."""
    with borrowed_lab(tmp_path_factory.mktemp("site_packages")):
        yield


def _open(kind: str, settings: WorkerSettings, ray: RaySettings | None = None) -> Runner:
    return Workers(settings) if kind == "workers" else OnRay(ray or _SMALL, settings)


@pytest.fixture(scope="module", params=["workers", _RAY])
def elsewhere(package: None, request: pytest.FixtureRequest) -> Iterator[Runner]:
    """Runs services in two processes that may have 2 GB each and see one variable."""
    runner = _open(request.param, WorkerSettings(environment={"MAP_TOKEN": "s3cret"}))
    yield runner
    runner.close()


@pytest.fixture(scope="module", params=["here", "workers", _RAY])
def runner(package: None, request: pytest.FixtureRequest) -> Iterator[Runner]:
    """Runs services anywhere."""
    made = Here() if request.param == "here" else _open(request.param, WorkerSettings())
    yield made
    made.close()


def _submit(runner: Runner, name: str, timeout_s: float = 60.0, **fields: object) -> Future[Fields]:
    return runner.submit(f"/compute/{name}", fields, t_s=2.5, timeout_s=timeout_s)


def _failure(ended: Future[Fields]) -> tuple[str, str]:
    error = ended.exception(timeout=120.0)
    assert isinstance(error, ServiceFailed)
    return error.code, error.message


def test_messages_go_there_and_come_back(runner: Runner) -> None:
    """A map made from a file, and a path on it; to the byte what is computed here, with the time of the call."""

    def computed(by: Runner) -> tuple[OccupancyGrid, list[object]]:
        made = _submit(by, "nav_map", map_file=str(_SITE / "navMap.yaml"), radius_m=0.35).result(timeout=120.0)["map"]
        assert isinstance(made, OccupancyGrid)
        mount = dict.fromkeys(("laser_x_m", "laser_y_m", "laser_yaw_rad"), 0.0)
        free = np.argwhere(np.asarray(made.data).reshape(made.info.height, made.info.width) == 0)
        at = [(0.05 * column + 0.025, 0.05 * row + 0.025) for row, column in (free[0], free[-1])]
        origin = made.info.origin.position
        start, goal = (pose_stamped(x + origin.x, y + origin.y, 0.0, t_s=1.0) for x, y in at)
        asked = {"map": made, "start": start, "goal": goal, "scan": None, "radius_m": 0.35, **mount}
        found = by.submit("/compute/path", asked, t_s=3.0, timeout_s=60.0).result(timeout=120.0)["path"]
        return made, [found.header, *found.poses]  # type: ignore[attr-defined]

    (there, way), (here, same_way) = computed(runner), computed(Here())
    assert (there.header, there.header.stamp.sec) == (here.header, 2)
    assert bytes(there.data) == bytes(here.data)
    assert len(way) > 2
    assert way == same_way


def test_what_a_service_does_wrong_is_its_failure(runner: Runner) -> None:
    """Its own errors, wrong fields, and names that nobody has."""
    assert _failure(_submit(runner, "stumble")) == (
        "ServiceBroken",
        "/compute/stumble raised ZeroDivisionError: division by zero",
    )
    assert _failure(_submit(runner, "double", nummer=4.0)) == (
        "BadInput",
        "/compute/double takes the fields number; given: nummer",
    )
    assert _failure(_submit(runner, "dance"))[0] == "NoSuchService"


def test_a_service_elsewhere_is_in_another_process(elsewhere: Runner) -> None:
    """With the time of the call."""
    there = _submit(elsewhere, "double", number=4.0).result(timeout=120.0)
    assert (there["twice"], there["t_s"]) == (8.0, 2.5)
    assert there["process"] != os.getpid()


def test_workers_that_crash_hang_or_hoard_cost_their_own_calls_only(elsewhere: Runner) -> None:
    """Each is told for what it is; another worker takes the place, and the others go on."""
    code, told = _failure(_submit(elsewhere, "crash"))
    assert (code, told.startswith("/compute/crash: its worker ended")) == ("WorkerDied", True)
    assert told.endswith("another has taken its place")
    assert _failure(_submit(elsewhere, "hang", timeout_s=0.5)) == (
        "TookTooLong",
        "/compute/hang was stopped after 0.5 s",
    )
    assert _failure(_submit(elsewhere, "hoard"))[0] == "OutOfMemory"
    assert _submit(elsewhere, "double", number=1.0).result(timeout=120.0)["twice"] == 2.0


@pytest.mark.parametrize("kind", ["workers", _RAY])
def test_a_worker_sees_what_is_meant_for_it(package: None, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The variable that its site has; not those of who starts it."""
    monkeypatch.setenv("OTHER_TOKEN", "not for you")
    pool = _open(kind, WorkerSettings(count=1, environment={"MAP_TOKEN": "s3cret"}))
    seen = [_submit(pool, "see", variable=name).result(timeout=120.0)["value"] for name in ("MAP_TOKEN", "OTHER_TOKEN")]
    pool.close()
    assert seen == ["s3cret", ""]


@pytest.mark.parametrize("kind", ["workers", _RAY])
def test_more_calls_than_may_wait_are_refused_and_closing_ends_what_runs(package: None, kind: str) -> None:
    """At once and with the reason, and nothing is left running."""
    pool = _open(kind, WorkerSettings(count=1, waiting=1))
    assert _submit(pool, "double", number=1.0).result(timeout=120.0)["twice"] == 2.0
    hanging, waiting = _submit(pool, "hang"), _submit(pool, "double", number=0.0)
    refused = _submit(pool, "double", number=2.0)
    assert refused.done()
    assert _failure(refused) == ("Busy", "/compute/double: 2 calls are open, and no more than 2 may be")
    pool.close()
    assert _failure(hanging) == ("WorkerDied", "/compute/hang was stopped: the workers are closed")
    assert _failure(waiting) == ("WorkerDied", "/compute/double was stopped: the workers are closed")


@pytest.mark.ray
def test_a_call_whose_worker_dies_is_made_again(package: None, tmp_path: Path) -> None:
    """On Ray, where machines get lost: as often as the settings say, then its worker has died."""
    pool = _open("ray", WorkerSettings(count=1), RaySettings(cpus=0.125, retries=2))
    assert "process" in _submit(pool, "once", flag_file=str(tmp_path / "flag")).result(timeout=120.0)
    assert _failure(_submit(pool, "note", log_file=str(tmp_path / "log")))[0] == "WorkerDied"
    pool.close()
    assert (tmp_path / "log").read_text() == "xxx"


@pytest.mark.ray
def test_a_cluster_without_room_is_told(package: None) -> None:
    """After as long as it may take to find room; with what was asked for."""
    pool = _open("ray", WorkerSettings(count=1, memory_mb=1 << 24), RaySettings(cpus=0.125, start_s=1.0))
    code, told = _failure(_submit(pool, "double", number=1.0))
    pool.close()
    assert code == "Busy"
    assert "the cluster has had no room for a worker of 0.125 processors and 16777216 MB for 1 s" in told
