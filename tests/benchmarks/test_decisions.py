"""The benchmark of decisions runs, and online planning does not grow."""

from __future__ import annotations

import pytest

from tests.benchmarks.decisions import run
from tests.benchmarks.harness import main


@pytest.mark.slow
def test_the_quick_benchmark_holds_its_bars() -> None:
    """Those that are not about wall time."""
    assert main("decisions", run, ["--quick", "--check"]) == 0
