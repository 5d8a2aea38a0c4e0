"""Compute services of an installed package, in processes of their own: what they do to each other and to us."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path

import pytest

from grounding.compute import registry
from grounding.compute.settings import ComputeSettings, WorkerSettings
from grounding.messages import OccupancyGrid
from grounding.placed import Placed
from grounding.runner import Fields, Here, Runner
from grounding.workers import Workers
from kb.errors import ServiceFailed
from kb.files import SHIPPED

_PACKAGE = """
import os

def double(*, number: float, t_s: float):
    return {"twice": 2 * number, "t_s": t_s, "process": os.getpid()}

def see(*, variable: str, t_s: float):
    return {"value": os.environ.get(variable, "")}

def crash(*, t_s: float):
    os._exit(3)

def hang(*, t_s: float):
    while True:
        pass

def hoard(*, t_s: float):
    return {"bytes": len(bytearray(8 << 30))}

def stumble(*, t_s: float):
    return {"x": 1 / 0}

def timeless():
    return {}

def loose(*fields, t_s: float):
    return {}

NOTHING = 3
"""
_SERVICES = ("double", "see", "crash", "hang", "hoard", "stumble", "timeless", "loose", "NOTHING", "missing")
_SITE = SHIPPED / "sites" / "tue_lab"


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A package that offers compute services is installed."""
    folder = tmp_path_factory.mktemp("site_packages")
    (folder / "borrowed_lab.py").write_text(_PACKAGE)
    info = folder / "borrowed_lab-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: borrowed_lab\nVersion: 1.0\n")
    lines = [f"{name.lower()} = borrowed_lab:{name}" for name in _SERVICES] + ["elsewhere = no_such_module:f"]
    (info / "entry_points.txt").write_text("[concertmaster.compute]\n" + "\n".join(lines) + "\n")
    sys.path.insert(0, str(folder))
    _forget()
    yield
    sys.path.remove(str(folder))
    _forget()


def _forget() -> None:
    registry._installed.cache_clear()
    registry._loaded.cache_clear()


@pytest.fixture(scope="module")
def workers(package: None) -> Iterator[Workers]:
    """Two workers that may have 2 GB each and see one variable."""
    pool = Workers(WorkerSettings(environment={"MAP_TOKEN": "s3cret"}))
    yield pool
    pool.close()


def _submit(runner: Runner, name: str, timeout_s: float = 60.0, **fields: object) -> Future[Fields]:
    return runner.submit(f"/compute/{name}", fields, t_s=2.5, timeout_s=timeout_s)


def _failure(ended: Future[Fields]) -> tuple[str, str]:
    error = ended.exception(timeout=120.0)
    assert isinstance(error, ServiceFailed)
    return error.code, error.message


def test_a_service_runs_elsewhere_and_messages_come_back(workers: Workers) -> None:
    """With files given by name; the time is that of the call, and the process is another."""
    found = _submit(workers, "nav_map", map_file=str(_SITE / "navMap.yaml"), radius_m=0.35).result(timeout=120.0)["map"]
    assert isinstance(found, OccupancyGrid)
    assert (found.header.frame_id, found.header.stamp.sec) == ("map", 2)
    there = _submit(workers, "double", number=4.0).result(timeout=120.0)
    here = _submit(Here(), "double", number=4.0).result()
    assert (there["twice"], there["t_s"]) == (here["twice"], here["t_s"]) == (8.0, 2.5)
    assert there["process"] != here["process"]


@pytest.mark.parametrize("runner", [Here, None])
def test_what_a_service_does_wrong_is_its_failure(workers: Workers, runner: type[Here] | None) -> None:
    """Wherever it runs: its own errors, wrong fields, and names that nobody has."""
    where = runner() if runner else workers
    assert _failure(_submit(where, "stumble")) == (
        "ServiceBroken",
        "/compute/stumble raised ZeroDivisionError: division by zero",
    )
    assert _failure(_submit(where, "double", nummer=4.0)) == (
        "BadInput",
        "/compute/double takes the fields number; given: nummer",
    )
    assert _failure(_submit(where, "dance"))[0] == "NoSuchService"


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


def test_workers_that_crash_hang_or_hoard_cost_their_own_calls_only(workers: Workers) -> None:
    """Each is told for what it is; another worker takes the place, and the pool goes on."""
    assert _failure(_submit(workers, "crash")) == (
        "WorkerDied",
        "/compute/crash: its worker ended with exit code 3; another has taken its place",
    )
    assert _failure(_submit(workers, "hang", timeout_s=0.5)) == (
        "TookTooLong",
        "/compute/hang was stopped after 0.5 s",
    )
    assert _failure(_submit(workers, "hoard"))[0] == "OutOfMemory"
    assert _submit(workers, "double", number=1.0).result(timeout=120.0)["twice"] == 2.0


def test_a_worker_sees_what_is_meant_for_it(workers: Workers, monkeypatch: pytest.MonkeyPatch) -> None:
    """The variable that its site has; not those of who starts it."""
    monkeypatch.setenv("OTHER_TOKEN", "not for you")
    pool = Workers(WorkerSettings(count=1, environment={"MAP_TOKEN": "s3cret"}))
    seen = [_submit(pool, "see", variable=name).result(timeout=120.0)["value"] for name in ("MAP_TOKEN", "OTHER_TOKEN")]
    pool.close()
    assert seen == ["s3cret", ""]


@pytest.mark.parametrize("file", ["/etc/passwd", str(_SITE / ".." / "objects.owl"), "navMap.yaml"])
@pytest.mark.parametrize("place", ["here", "workers"])
def test_files_of_others_are_refused(package: None, tmp_path: Path, file: str, place: str) -> None:
    """Also where the way to them begins in the site's folder, and wherever the service runs."""
    placed = Placed(ComputeSettings(places={"/compute/nav_map": place}), tmp_path)
    placed.allow(_SITE)
    code, told = _failure(_submit(placed, "nav_map", map_file=file, radius_m=0.35))
    assert (code, f"is not in {_SITE}, where files of this site are" in told) == ("BadInput", True)
    placed.close()


def test_more_calls_than_may_wait_are_refused(package: None) -> None:
    """At once and with the reason; those that were taken go on."""
    pool = Workers(WorkerSettings(count=1, waiting=1))
    taken = [_submit(pool, "double", number=float(n)) for n in range(2)]
    refused = _submit(pool, "double", number=2.0)
    assert refused.done()
    assert _failure(refused) == ("Busy", "/compute/double: 2 calls are open, and no more than 2 may be")
    assert [ended.result(timeout=120.0)["twice"] for ended in taken] == [0.0, 2.0]
    pool.close()


def test_closing_ends_what_runs(package: None) -> None:
    """A call that hangs ends with the reason, and nothing is left running."""
    pool = Workers(WorkerSettings(count=1))
    assert _submit(pool, "double", number=1.0).result(timeout=120.0)["twice"] == 2.0
    hanging = _submit(pool, "hang")
    pool.close()
    assert _failure(hanging) == ("WorkerDied", "/compute/hang was stopped: the workers are closed")


def test_services_run_where_the_settings_say(package: None, tmp_path: Path) -> None:
    """One here, one in a worker, which is not started before it is needed."""
    placed = Placed(ComputeSettings(places={"/compute/see": "workers"}), tmp_path)
    assert _submit(placed, "double", number=2.0).result()["process"] == os.getpid()
    assert _submit(placed, "see", variable="MAP_TOKEN").result(timeout=120.0) == {"value": ""}
    placed.close()
