"""The benchmark of the knowledge base runs, and what it finds is right."""

from __future__ import annotations

import pytest

from tests.benchmarks.harness import main
from tests.benchmarks.kb import run


@pytest.mark.slow
def test_the_quick_benchmark_holds_its_bars() -> None:
    """Those that are not about wall time."""
    assert main("kb", run, ["--quick", "--check"]) == 0
