"""Plain Golog: the program of the ontology, executed depth first in SWI-Prolog (depth_first.pl)."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import IO

from kb.store import KnowledgeBase
from kb.terms import Term, render, struct
from planner.network import Travel
from tests.benchmarks.fleet_ontology import ROOM, SITE, task, write_ontologies
from tests.benchmarks.fleets import Instance, place_names, robot_name, travel_times
from tests.benchmarks.peers.processes import acts
from tests.benchmarks.peers.report import Report, Solve, take_part

_ROOT = Path(__file__).resolve().parents[3]
_ALIASES = {"kb_rules": _ROOT / "kb" / "rules", "planner_golog": _ROOT / "planner" / "golog"}


def prepare(instance: Instance, way: str) -> Solve:
    """Load and compile the ontology, start SWI-Prolog and have it load the facts."""
    with tempfile.TemporaryDirectory() as folder:
        write_ontologies(instance, Path(folder) / "ontologies")
        knowledge = KnowledgeBase(SITE, Path(folder) / "ontologies")
        snapshot = knowledge.snapshot()
        facts = snapshot.compiler.facts(snapshot.revision)
        goals = place_names(instance)[instance.robots :]  # no robot goes back to its dock
        travel = travel_times(instance)([robot_name(r) for r in range(instance.robots)], goals)
        head = struct(task(instance), ROOM)
        request = struct("request", snapshot.revision, head, instance.robots, _tables(travel))
        knowledge.close()
        file = Path(folder) / "request.pl"
        file.write_text(f"{render(struct('facts', facts))}.\n{render(request)}.\n", encoding="utf-8")
        swipl = _swipl(file)
        assert swipl.stdin is not None
        assert swipl.stdout is not None
        stdin, stdout = swipl.stdin, swipl.stdout
        if "loaded" not in (first := stdout.readline()):
            raise RuntimeError(f"SWI-Prolog did not load the program, and said {first!r}")
    return lambda report: _solve(report, stdin, stdout)


def _solve(report: Report, stdin: IO[str], stdout: IO[str]) -> None:
    stdin.write("go.\n")
    stdin.flush()
    for line in stdout:
        answer = json.loads(line)
        if "proven" in answer:
            report.proven()
            return
        report.plan(acts((start, name, *arguments[:2]) for start, name, *arguments in answer["steps"]))
    report.note("SWI-Prolog ended: out of memory")


def _swipl(file: Path) -> subprocess.Popen[str]:
    # Where `make setup` had to unpack SWI-Prolog, its command is beside Python's.
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)))
    command = [shutil.which("swipl", path=path) or "swipl", "-q", "-g", "main", "-t", "halt"]
    for alias, folder in _ALIASES.items():
        command += ["-p", f"{alias}={folder}"]
    command += [str(Path(__file__).with_name("depth_first.pl")), "--", str(file)]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def _tables(travel: Travel) -> Term:
    robots: list[Term] = [
        struct("robot", name, profile + 1, [int(ms) for ms in travel.here[name]])
        for name, profile in travel.profile.items()
    ]
    matrices: list[Term] = [[[int(ms) for ms in row] for row in table] for table in travel.between]
    return struct("tables", list(travel.places), robots, matrices)


if __name__ == "__main__":
    take_part(prepare)
