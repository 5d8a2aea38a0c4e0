"""The benchmark of the cycle holds its bars, as far as they do not depend on the machine."""

import pytest

from tests.benchmarks.cycle import run
from tests.benchmarks.harness import main


def test_the_cycle_closes_at_30_hz_of_simulated_time(capsys: pytest.CaptureFixture[str]) -> None:
    """Both robots, every call decided by the planner; wall time is printed, not judged."""
    assert main("cycle", run, ["--quick", "--check"]) == 0
    assert "times_real_time" in capsys.readouterr().out
