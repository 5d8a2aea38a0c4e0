"""The benchmark of the fleet runs; nothing is lost."""

from __future__ import annotations

import pytest

from tests.benchmarks.fleet import run
from tests.benchmarks.harness import main


@pytest.mark.slow
def test_the_quick_benchmark_loses_nothing() -> None:
    """A hundred robots for half a minute: every leg is begun once, ended once, and told of."""
    assert main("fleet", run, ["--quick", "--check"]) == 0
