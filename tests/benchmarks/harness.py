"""What every benchmark shares: its command line, its table, and the comparison with the bars.

A benchmark is a module `tests/benchmarks/<name>.py` with a function `run(quick)` that measures and
returns figures by name, and ends in `sys.exit(main("<name>", run))`. The bars stand in `bars.toml`:

    [planning]
    makespan_ratio = { at_most = 1.05 }
    solved_fraction = { at_least = 1.0 }
    search_s = { at_most = 2.0, wall = true }   # a bar on wall time, which --quick leaves out
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

Figure = int | float | str
Run = Callable[[bool], Mapping[str, Figure]]

BARS = Path(__file__).with_name("bars.toml")


def main(name: str, run: Run, arguments: Sequence[str] | None = None, *, bars_file: Path = BARS) -> int:
    """Run a benchmark from the command line.

    Args:
        name: Name of the benchmark: its module, and its table in the bars file.
        run: Measures; told whether it has to be quick (a minute, in CI). Figures by name, with units in the names.
        arguments: Command line; that of the process if None.
        bars_file: TOML file of the bars.

    Returns:
        Exit status: 1 if `--check` was asked for and a figure falls short of its bar.
    """
    parser = argparse.ArgumentParser(prog=f"python -m tests.benchmarks.{name}")
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of a table")
    parser.add_argument("--check", action="store_true", help=f"compare with the bars in {bars_file.name}")
    parser.add_argument("--quick", action="store_true", help="a minute-long version, without bars on wall time")
    options = parser.parse_args(arguments)

    figures = run(options.quick)
    print(json.dumps({"benchmark": name, **figures}) if options.json else table(figures))
    if not options.check:
        return 0
    bars = tomllib.loads(bars_file.read_text(encoding="utf-8")).get(name)
    if not bars:
        print(f"{name}: no bars in {bars_file.name}", file=sys.stderr)
        return 1
    shortfall = first_shortfall(figures, bars, quick=options.quick)
    if shortfall:
        print(f"{name}: {shortfall}", file=sys.stderr)
        return 1
    return 0


def first_shortfall(figures: Mapping[str, Figure], bars: Mapping[str, Mapping[str, float]], *, quick: bool) -> str:
    """The first figure, in the order of the bars, that falls short of its bar or is missing; empty if none does."""
    for name, bar in bars.items():
        unknown = set(bar) - {"at_least", "at_most", "wall"}
        if unknown or not {"at_least", "at_most"} & set(bar):
            raise ValueError(f"bar {name}: needs at_least or at_most, may say wall; got {dict(bar)}")
        if quick and bar.get("wall"):
            continue
        figure = figures.get(name)
        if not isinstance(figure, int | float):
            return f"{name} was not measured"
        if not bar.get("at_least", -math.inf) <= figure <= bar.get("at_most", math.inf):
            limits = " and ".join(
                f"{word.replace('_', ' ')} {bar[word]}" for word in ("at_least", "at_most") if word in bar
            )
            return f"{name} is {figure}, not {limits}"
    return ""


def table(figures: Mapping[str, Figure]) -> str:
    """The figures in two columns."""
    width = max(map(len, figures), default=0)
    return "\n".join(f"{name:<{width}}  {_shown(figure)}" for name, figure in figures.items())


def _shown(figure: Figure) -> str:
    return f"{figure:>12.4g}" if isinstance(figure, float) else f"{figure:>12}"
