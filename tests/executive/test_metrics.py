"""What a fleet's work costs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from executive.cli import main
from executive.metrics import Metrics, Use
from grounding.caching import CacheCount
from grounding.outcome import Outcome, OutcomeStatus
from grounding.transport import ServiceCall

MAP = np.zeros((20, 10), dtype=np.int8)


def ended(status: OutcomeStatus, elapsed_s: float) -> Outcome:
    """An outcome of a call."""
    return Outcome(status=status, failure="", reason="", outputs={}, elapsed_s=elapsed_s)


def test_calls_are_counted_by_service_and_robot() -> None:
    """How many, how many of them failed, bytes each way, time in all and of the longest; and what caches knew."""
    metrics = Metrics()
    asked = ServiceCall(id=1, service="/compute/map", fields={"name": "lab"}, timeout_s=1.0)
    metrics.note(asked, "anna", ended(OutcomeStatus.SUCCEEDED, 0.25), {"map": MAP})
    metrics.note(asked, "anna", ended(OutcomeStatus.SUCCEEDED, 0.5), {"map": MAP})
    metrics.note(asked, "anna", ended(OutcomeStatus.TIMED_OUT, 1.0), {})
    metrics.note(asked, "bert", ended(OutcomeStatus.SUCCEEDED, 0.125), {"map": MAP[:10]})
    anna, bert = metrics.uses()
    assert anna == Use(
        service="/compute/map",
        robot="anna",
        calls=3,
        failed=1,
        request_bytes=9,
        reply_bytes=400,
        time_s=1.75,
        longest_s=1.0,
    )
    assert (bert.robot, bert.reply_bytes) == ("bert", 100)
    metrics.known = lambda: {"/compute/map": CacheCount(hits=3, misses=1), "/compute/path": CacheCount()}
    told = metrics.told()
    assert told["wall_s"] > 0.0
    assert told["cpu_share"] >= 0.0
    assert [use["robot"] for use in told["services"]] == ["anna", "bert"]
    assert told["caches"] == [
        {"service": "/compute/map", "hits": 3, "misses": 1, "hit_rate": 0.75},
        {"service": "/compute/path", "hits": 0, "misses": 0, "hit_rate": 0.0},
    ]


def test_a_run_leaves_its_metrics(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Beside the trace: a localization reads the map and the laser once each."""
    assert main(["run", "Localize", "robot=amigo_1", "area=tue_lab", "--out", str(tmp_path)]) == 0
    assert f"metrics:  {tmp_path / 'metrics.json'}" in capsys.readouterr().out
    metrics = json.loads((tmp_path / "metrics.json").read_text(encoding="utf-8"))
    uses = {use["service"]: use for use in metrics["services"]}
    assert set(uses) == {"/compute/loc_map", "/amigo_1/laser", "/compute/pose"}
    assert {use["robot"] for use in uses.values()} == {"amigo_1"}
    assert uses["/compute/loc_map"]["reply_bytes"] > 30_000
    assert uses["/amigo_1/laser"]["calls"] == 1
    caches = {cache.pop("service"): cache for cache in metrics["caches"]}
    assert caches["/compute/loc_map"] == {"hits": 0, "misses": 1, "hit_rate": 0.0}
