"""The tests of the benchmarks' harness."""

import json
from pathlib import Path

import pytest

from tests.benchmarks.harness import first_shortfall, main

FIGURES = {"ratio": 1.04, "solved": 10, "search_s": 3.0}


def run(quick: bool) -> dict[str, float]:
    """Figures that stand fast; the harness is what is tested."""
    return FIGURES | {"quick": int(quick)}


@pytest.fixture
def bars(tmp_path: Path) -> Path:
    """Bars of which one, on wall time, is not met."""
    file = tmp_path / "bars.toml"
    file.write_text("[trial]\nratio = {at_most = 1.05}\nsearch_s = {at_most = 2.0, wall = true}\n", encoding="utf-8")
    return file


def test_the_table_is_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    """Without options every figure is shown in a line of its own."""
    assert main("trial", run, []) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split() for line in lines] == [["ratio", "1.04"], ["solved", "10"], ["search_s", "3"], ["quick", "0"]]


def test_json_is_one_object(capsys: pytest.CaptureFixture[str]) -> None:
    """`--json` prints one object with the benchmark's name."""
    assert main("trial", run, ["--json", "--quick"]) == 0
    assert json.loads(capsys.readouterr().out) == {"benchmark": "trial", **FIGURES, "quick": 1}


def test_check_names_the_first_figure_that_falls_short(bars: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`--check` ends with 1 and says which figure, what it is and what it should be."""
    assert main("trial", run, ["--check"], bars_file=bars) == 1
    assert capsys.readouterr().err == "trial: search_s is 3.0, not at most 2.0\n"


def test_quick_leaves_out_bars_on_wall_time(bars: Path) -> None:
    """`--quick` runs anywhere, so its wall times prove nothing."""
    assert main("trial", run, ["--check", "--quick"], bars_file=bars) == 0


def test_a_benchmark_without_bars_fails_its_check(bars: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A check that compares nothing is none."""
    assert main("other", run, ["--check"], bars_file=bars) == 1
    assert "no bars" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("bar", "expected"),
    [
        ({"at_least": 10}, ""),
        ({"at_least": 11}, "solved is 10, not at least 11"),
        ({"at_least": 1, "at_most": 9}, "solved is 10, not at least 1 and at most 9"),
    ],
)
def test_bars_have_two_sides(bar: dict[str, float], expected: str) -> None:
    """A bar is met at its limit and not beyond it."""
    assert first_shortfall(FIGURES, {"solved": bar}, quick=False) == expected


def test_a_figure_that_is_missing_or_not_a_number_falls_short() -> None:
    """Neither a renamed figure nor NaN passes."""
    assert first_shortfall(FIGURES, {"absent": {"at_most": 1}}, quick=False) == "absent was not measured"
    assert first_shortfall({"ratio": float("nan")}, {"ratio": {"at_most": 1}}, quick=False).startswith("ratio is nan")


def test_a_misspelled_bar_is_an_error() -> None:
    """A bar that says nothing does not pass quietly."""
    with pytest.raises(ValueError, match="at_most"):
        first_shortfall(FIGURES, {"solved": {"atleast": 11}}, quick=False)
