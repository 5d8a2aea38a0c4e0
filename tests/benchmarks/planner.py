"""How fast the planner plans and proves, and how good its plans are, beside those that one would take instead.

The task is to find all empty drinks of a hall, or, coupled, to fetch them too (fleets.py). What is planned is the
process that the ontology's files compile to (fleet_ontology.py). Each run is a process of its own (peers/race.py):
the clock starts when it is loaded, plans count when they are told, and every plan is worked out again by one function,
whoever made it. Ours runs on five instances of each size, of which medians are given; its peers run on the first, each
until its first size without a plan:

- up-aries, flat and hierarchical; up-tamer; both through unified-planning
- GTPyhop, greedy and then by tightening its bound
- plain Golog: the same compiled program and the same semantics, executed depth first, with branch and bound
- a plain OR-tools CP-SAT model, written by hand for this task

`python -m tests.benchmarks.planner --separable` takes half an hour, `--coupled` a quarter; without
either, both are run. Each run is told on standard error as it ends.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from statistics import median

from tests.benchmarks.fleets import OPTIMA_MS, SIZES, draw
from tests.benchmarks.harness import Figure, main
from tests.benchmarks.peers.race import Entrant, Run, run

OURS = Entrant(name="concertmaster", module="concertmaster")
PROLOG_ALONE = Entrant(name="prolog_alone", module="concertmaster", way="prolog")
GTPYHOP = Entrant(name="gtpyhop", module="tasknet")
PEERS = (
    Entrant(name="aries_flat", module="aries", way="flat"),
    Entrant(name="aries_hierarchical", module="aries", way="hierarchical"),
    Entrant(name="tamer", module="tamer"),
    Entrant(name="golog", module="golog"),
    Entrant(name="circuit", module="circuit"),
)
ENTRANTS = {e.name: e for e in (OURS, PROLOG_ALONE, *PEERS, GTPYHOP)}

_OURS = (OURS.name, PROLOG_ALONE.name)
SEEDS = (1, 2, 3, 4, 5)
LIMIT_S, QUICK_LIMIT_S = 60.0, 4.0
MOMENTS_S = (1, 10, 60)
Size = tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Variant:
    """One of the two tasks, with the sizes that are run, and who takes part."""

    name: str
    coupled: bool
    sizes: tuple[Size, ...]
    quick_sizes: tuple[Size, ...]
    prolog_sizes: tuple[Size, ...]
    peers: tuple[Entrant, ...]


VARIANTS = (
    Variant(
        name="separable",
        coupled=False,
        sizes=SIZES,
        quick_sizes=((2, 2), (3, 4)),
        prolog_sizes=((2, 2), (3, 4), (4, 6), (6, 10), (10, 20)),
        peers=(*PEERS, GTPYHOP),
    ),
    Variant(
        name="coupled",
        coupled=True,
        sizes=((2, 2), (4, 6), (10, 20)),
        quick_sizes=((2, 2),),
        prolog_sizes=(),
        peers=PEERS,
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """What of the benchmark is run."""

    variants: tuple[str, ...]
    sizes: tuple[Size, ...] | None
    planners: tuple[str, ...]


ALL = Selection(variants=tuple(v.name for v in VARIANTS), sizes=None, planners=tuple(ENTRANTS))


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A run, and of what."""

    variant: str
    size: Size
    seed: int
    planner: str
    run: Run


def measure(selection: Selection, quick: bool) -> Mapping[str, Figure]:
    """Run what is selected; figures by variant, size and planner (ours without its name)."""
    entries: list[Entry] = []
    for variant in VARIANTS:
        if variant.name in selection.variants:
            entries += _raced(variant, selection, quick)
    figures: dict[str, Figure] = {}
    for key in dict.fromkeys((e.variant, e.size, e.planner) for e in entries):
        runs = [e.run for e in entries if (e.variant, e.size, e.planner) == key]
        (variant_name, (robots, drinks), planner) = key
        prefix = f"{variant_name}_{robots}_{drinks}" + ("" if planner == OURS.name else f"_{planner}")
        of_interest = _figures(runs).items() if planner in _OURS else _of_peers(_figures(runs))
        figures |= {f"{prefix}_{name}": figure for name, figure in of_interest}
    better, wrong = _better_peers(entries), _wrong(entries)
    for text in (*better, *wrong):
        _tell(text)
    return figures | {"peers_better": len(better), "wrong": len(wrong)}


def _raced(variant: Variant, selection: Selection, quick: bool) -> list[Entry]:
    sizes = selection.sizes or (variant.quick_sizes if quick else variant.sizes)
    limit_s = QUICK_LIMIT_S if quick else LIMIT_S
    entries: list[Entry] = []
    for planner in (OURS, PROLOG_ALONE, *variant.peers):
        if planner.name not in selection.planners:
            continue
        is_ours = planner.name in _OURS
        for size in sizes:
            if planner is PROLOG_ALONE and size not in variant.prolog_sizes:
                continue
            for seed in SEEDS[: 1 if quick or not is_ours else None]:
                what = run(planner, draw(*size, seed, coupled=variant.coupled), limit_s=limit_s)
                entries.append(Entry(variant=variant.name, size=size, seed=seed, planner=planner.name, run=what))
                _tell(_row(entries[-1]))
            if not is_ours and not entries[-1].run.plans:
                break
    return entries


def _figures(runs: Sequence[Run]) -> dict[str, float]:
    """Medians over the seeds; left out where half of the runs have none."""

    def usual(value: Callable[[Run], float | None]) -> float:
        values = [value(r) for r in runs]
        return median(math.inf if v is None else v for v in values)

    def seconds(ms: float | None) -> float | None:
        return None if ms is None else ms / 1000.0

    medians = {
        "first_s": usual(lambda r: r.first_s),
        "proven_s": usual(lambda r: r.proven_s),
        "makespan_s": usual(lambda r: seconds(r.makespan_ms)),
        "bound_s": usual(lambda r: seconds(r.bound_ms)),
        "gap": usual(lambda r: r.gap),
        "loading_s": usual(lambda r: r.loading_s),
    }
    for moment_s in MOMENTS_S:
        medians[f"after_{moment_s}_s"] = usual(lambda r, t_s=moment_s: seconds(r.after(t_s)))  # type: ignore[misc]
    return {name: value for name, value in medians.items() if value < math.inf}


def _of_peers(figures: Mapping[str, float]) -> list[tuple[str, float]]:
    """Rows on standard error tell the rest."""
    return [(name, figures[name]) for name in ("first_s", "proven_s", "makespan_s") if name in figures]


def _better_peers(entries: Iterable[Entry]) -> list[str]:
    """Where a peer had a better plan than ours at one of the moments, on the instance that both have run."""
    first = [e for e in entries if e.seed == SEEDS[0]]
    ours = {(e.variant, e.size): e.run for e in first if e.planner == OURS.name}
    better = []
    for entry in first:
        mine = ours.get((entry.variant, entry.size))
        if mine is None or entry.planner in _OURS:
            continue
        for moment_s in MOMENTS_S:
            theirs_ms, ours_ms = entry.run.after(moment_s), mine.after(moment_s)
            if theirs_ms is not None and theirs_ms < (math.inf if ours_ms is None else ours_ms):
                found = f"{entry.variant} {entry.size} after {moment_s} s"
                better.append(f"better: {found}: {entry.planner} {theirs_ms} ms, ours {ours_ms} ms")
    return better


def _wrong(entries: Sequence[Entry]) -> list[str]:
    """What a planner said of its plans that is not so, as far as all plans told show; and where ours broke down."""
    wrong = []
    for entry in entries:
        what = f"wrong: {entry.variant} {entry.size} seed {entry.seed}: {entry.planner}"
        wrong += [f"{what}: {fault}" for fault in entry.run.faults]
        if entry.planner in _OURS and entry.run.end.startswith("failed"):
            wrong.append(f"{what}: {entry.run.end}")
        same = (entry.variant, entry.size, entry.seed)
        known = [e.run.makespan_ms for e in entries if (e.variant, e.size, e.seed) == same]
        if entry.variant == "separable" and entry.seed == 1:
            known.append(OPTIMA_MS.get(entry.size))
        least_ms = min((ms for ms in known if ms is not None), default=math.inf)
        if entry.run.bound_ms is not None and entry.run.bound_ms > least_ms:
            wrong.append(
                f"{what}: says that no plan takes less than {entry.run.bound_ms} ms, but one takes {least_ms} ms"
            )
    return wrong


def _row(entry: Entry) -> str:
    r = entry.run

    def at(s: float | None) -> str:
        return "      -" if s is None else f"{s:7.3f}"

    def worth(ms: float | None) -> str:
        return "    -" if ms is None else f"{ms / 1000.0:5.1f}"

    first_ms, best_s = (r.plans[0][1], r.plans[-1][0]) if r.plans else (None, None)
    return (
        f"{entry.variant:<9} {entry.size[0]:>2},{entry.size[1]:<3} seed {entry.seed} {entry.planner:<18} "
        f"first {worth(first_ms)} at {at(r.first_s)}  best {worth(r.makespan_ms)} at {at(best_s)}  "
        f"proven {at(r.proven_s)}  bound {worth(r.bound_ms)}  gap {'   -' if r.gap is None else f'{r.gap:4.0%}'}  "
        f"after 1, 10, 60 s {' '.join(worth(r.after(t_s)) for t_s in MOMENTS_S)}  "
        f"loaded {r.loading_s:4.1f}  cpu {r.cpu_s:5.1f}  {r.end}"
    )


def _tell(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _size(text: str) -> Size:
    robots, _, drinks = text.partition(",")
    return int(robots), int(drinks)


def selected(arguments: Sequence[str]) -> tuple[Selection, list[str]]:
    """What the command line selects, and what of it is the harness's."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.planner", add_help=False)
    which = parser.add_mutually_exclusive_group()
    for variant in VARIANTS:
        which.add_argument(f"--{variant.name}", dest="variants", action="store_const", const=(variant.name,))
    parser.add_argument("--sizes", type=_size, nargs="+", metavar="ROBOTS,DRINKS")
    parser.add_argument("--planners", choices=tuple(ENTRANTS), nargs="+")
    parser.add_argument("--prolog-alone", dest="planners", action="store_const", const=[PROLOG_ALONE.name])
    options, rest = parser.parse_known_args(arguments)
    selection = Selection(
        variants=options.variants or ALL.variants,
        sizes=None if options.sizes is None else tuple(options.sizes),
        planners=tuple(options.planners or ALL.planners),
    )
    return selection, rest


if __name__ == "__main__":
    chosen, others = selected(sys.argv[1:])
    sys.exit(main("planner", partial(measure, chosen), others))
