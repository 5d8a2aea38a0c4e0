"""Results that are kept change what is computed, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from executive import Fleet, TaskStatus
from grounding.caching import CacheCount
from grounding.compute.settings import BadComputeSettings


def _run(settings: Path, trace: Path) -> dict[str, CacheCount]:
    with Fleet.open("tue_lab", compute=settings, trace=trace) as fleet:
        fleet.request("FindEmptyDrink", room="kitchen").wait()
        return dict(fleet.parts.compute.cache_counts())


def test_the_trace_is_the_same_with_a_cold_and_a_warm_cache(tmp_path: Path) -> None:
    """To the byte, under simulated time: a known result takes as long as its process says."""
    settings = tmp_path / "compute.toml"
    on_disk = '["/compute/loc_map", "/compute/nav_map", "/compute/path", "/compute/travel"]'
    settings.write_text(f'[services]\n[cache]\non_disk = {on_disk}\nfolder = "{tmp_path / "kept"}"\n')
    cold = _run(settings, tmp_path / "cold.jsonl")
    warm = _run(settings, tmp_path / "warm.jsonl")
    assert (tmp_path / "warm.jsonl").read_bytes() == (tmp_path / "cold.jsonl").read_bytes()
    assert set(warm) == {"/compute/loc_map", "/compute/nav_map", "/compute/path", "/compute/travel"}
    for service, count in warm.items():
        assert cold[service].misses > 0
        assert count == CacheCount(hits=cold[service].hits + cold[service].misses)


def test_maps_are_computed_once() -> None:
    """However often robots localize with one; where no robot has moved, travel is estimated once too."""
    with Fleet.open("tue_lab") as fleet:
        assert fleet.request("FindEmptyDrink", room="tue_lab", robots=2).wait().status is TaskStatus.COMPLETED
        calls = sum(use.calls for use in fleet.metrics.uses() if use.service == "/compute/loc_map")
        known = fleet.metrics.known()
        assert known["/compute/loc_map"] == CacheCount(hits=calls - 1, misses=1)
        assert known["/compute/loc_map"].hit_rate > 0.99
        before = known["/compute/travel"]
        for _ in range(2):
            fleet.plan("FindEmptyDrink", room="tue_lab", robots=2)
        after = fleet.metrics.known()["/compute/travel"]
        assert after.misses - before.misses == after.hits - before.hits > 0


def test_only_what_is_always_the_same_is_kept_for_later_runs(tmp_path: Path) -> None:
    """By what the ontology says of the process; told before anything runs."""
    settings = tmp_path / "compute.toml"
    settings.write_text('[services]\n[cache]\non_disk = ["/compute/teleport"]\n')
    with pytest.raises(BadComputeSettings, match=r"cache\.on_disk: no process with isDeterministic true is"):
        Fleet.open("tue_lab", compute=settings)
