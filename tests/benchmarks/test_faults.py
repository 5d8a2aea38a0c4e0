"""The campaign of faults runs, and what fails once does not end a task."""

from __future__ import annotations

import pytest

from tests.benchmarks.faults import run
from tests.benchmarks.harness import main


@pytest.mark.slow
def test_the_quick_benchmark_holds_its_bars() -> None:
    """One fault of each sort."""
    assert main("faults", run, ["--quick", "--check"]) == 0
