"""A campaign of faults: what becomes of a task when a call fails, a service hangs, a robot is lost, a door is closed.

Two tasks, FindEmptyDrink in the lab and a delivery in the ward. Every service that a task uses fails once and hangs
once; every device of a robot is broken for good; every robot is lost, at several times; every compute service is gone
for good, which nobody can get around; the door of the ward is closed, known or not, at several times, also where there
is no way but through it. Each run stands beside the undisturbed one, and beside the same fault with an ontology that
knows of no recovery, which is the baseline.

A task has to be completed as long as a robot that is capable remains, else to end as failed with the true reason:
`right` is the share of runs in which that is so.
"""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from importlib.resources import files
from multiprocessing import get_context
from pathlib import Path

from executive import Fleet, TaskStatus
from executive.trace import RecoveryChosen
from kb.files import SHIPPED
from kb.store import KnowledgeBase
from sim.floor_plan import draw_floor_plans
from sim.world import load_world
from tests.benchmarks.harness import Figure, main

_HANGS_AFTER_S = 600.0
_PROCESSES = 2
_COMPARED = ("completed", "later_by_mean_s")
_WALL = "\n[inner_walls.north]\nx_m = [3.95, 4.05]\ny_m = [6.4, 8.0]\n"
"""Leaves the door of the ward as the only way."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Task:
    """What is asked for.

    Attributes:
        robots: Those of the site.
        lost_at_s: When robots are lost, by what they do then.
        needs: Who cannot be replaced from when on, in seconds: it has what is to be delivered.
        last: Services that are called only then.
    """

    site: str
    process: str
    arguments: dict[str, str]
    robots: tuple[str, ...]
    lost_at_s: Mapping[str, float]
    needs: Mapping[str, float] = field(default_factory=dict)
    last: frozenset[str] = frozenset()


FIND = _Task(
    site="tue_lab",
    process="FindEmptyDrink",
    arguments={"room": "tue_lab"},
    robots=("amigo_1", "pico_1"),
    lost_at_s={"on its way": 1.5, "arrived": 7.7},
)
DELIVER = _Task(
    site="ward",
    process="Deliver",
    arguments={"area": "ward", "thing": "meal_1", "to": "at_bed_1"},
    robots=("porter_1", "runner_1"),
    lost_at_s={"on its way": 1.5, "under load": 9.0},
    needs={"runner_1": 3.0},
    last=frozenset({"/{robot}/unload"}),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Case:
    """A fault.

    Attributes:
        sort: Its row in the table.
        fault: As a file of faults says it.
        culprit: What a true reason names, as a regular expression.
        can_be_done: A capable robot remains.
        shut_s: When somebody closes the door.
        told: It is said at once.
        walled_up: The door is the only way.
    """

    task: _Task
    sort: str
    fault: str = ""
    culprit: str = ""
    can_be_done: bool = True
    shut_s: float | None = None
    told: bool = False
    walled_up: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class _Result:
    """What became of the task."""

    completed: bool
    ended: bool
    right: bool
    took_s: float
    recoveries: int
    reason: str


def run(quick: bool) -> Mapping[str, Figure]:
    """Measure: how many tasks are done all the same, and how much later, by sort of fault."""
    cases = [*_cases(FIND), *_cases(DELIVER), *_doors()]
    if quick:
        cases = [next(case for case in cases if case.sort == sort) for sort in dict.fromkeys(c.sort for c in cases)]
    with tempfile.TemporaryDirectory() as folder:
        stubborn = Path(folder) / "ontologies"
        shutil.copytree(SHIPPED, stubborn)
        _without_recoveries(stubborn / "failures" / "failures.owl")
        with ProcessPoolExecutor(_PROCESSES, mp_context=get_context("spawn")) as pool:
            undisturbed = [_Case(task=task, sort="undisturbed") for task in (FIND, DELIVER)]
            calm = {case.task.site: pool.submit(_do, case, SHIPPED) for case in undisturbed}
            ours = [pool.submit(_do, case, SHIPPED) for case in cases]
            theirs = [pool.submit(_do, case, stubborn) for case in cases]
            undisturbed_s = {site: one.result().took_s for site, one in calm.items()}
            results, baseline = [r.result() for r in ours], [r.result() for r in theirs]
    figures: dict[str, Figure] = {f"{site}_undisturbed_s": took_s for site, took_s in undisturbed_s.items()}
    figures["runs"] = len(results)
    for sort in dict.fromkeys(case.sort for case in cases):
        figures |= {f"{sort}_{name}": figure for name, figure in _row(sort, cases, results, undisturbed_s).items()}
        before = {n: f for n, f in _row(sort, cases, baseline, undisturbed_s).items() if n in _COMPARED}
        figures |= {f"{sort}_{name}_without_recoveries": figure for name, figure in before.items()}
    figures["right"] = sum(r.right for r in results) / len(results)
    figures["hung"] = sum(not r.ended for r in results)
    for case, result in zip(cases, results, strict=True):
        if not result.right:
            print(f"{case.sort}: {_told(case)} ended with: {result.reason or 'nothing'}", file=sys.stderr)
    return figures


def _row(
    sort: str, cases: list[_Case], results: list[_Result], undisturbed_s: Mapping[str, float]
) -> Mapping[str, Figure]:
    own = [(case, result) for case, result in zip(cases, results, strict=True) if case.sort == sort]
    late_s = [result.took_s - undisturbed_s[case.task.site] for case, result in own if result.completed]
    row: dict[str, Figure] = {
        "runs": len(own),
        "completed": sum(result.completed for _, result in own) / len(own),
        "right": sum(result.right for _, result in own) / len(own),
        "recoveries": sum(result.recoveries for _, result in own),
    }
    return row | ({"later_by_mean_s": sum(late_s) / len(late_s), "later_by_most_s": max(late_s)} if late_s else {})


def _told(case: _Case) -> str:
    door = "" if case.shut_s is None else f"door shut at {case.shut_s:g} s{', told' if case.told else ''}"
    return ", ".join(
        part for part in (case.task.process, case.fault, door, "walled up" if case.walled_up else "") if part
    )


def _cases(task: _Task) -> Iterator[_Case]:
    for service, process, on_robot in _services(task):
        for robot in task.robots if on_robot else ("",):
            name = service.replace("{robot}", robot)
            case = _Case(task=task, sort="", culprit=rf"{process}\({robot}")
            for kind, sort in (("fail", "failed_once"), ("hang", "hung_once")):
                yield replace(case, sort=sort, fault=_fault(name, kind, "calls = [1]"))
            if on_robot:
                remains = robot not in task.needs or service not in task.last
                yield replace(case, sort="device_broken", fault=_fault(name, "fail"), can_be_done=remains)
            else:
                fault = _fault(name, "fail", 'code = "ServiceBroken"')
                yield replace(case, sort="service_gone", fault=fault, can_be_done=False)
    for robot in task.robots:
        for from_s in task.lost_at_s.values():
            fault = _fault(f"/{robot}/*", "cut", f"from_s = {from_s}")
            remains = from_s < task.needs.get(robot, _HANGS_AFTER_S)
            yield _Case(task=task, sort="robot_lost", fault=fault, culprit=rf"\({robot}", can_be_done=remains)


def _doors() -> Iterator[_Case]:
    """The door is closed before, while the robot fetches the meal, and when it is on its way to the door."""
    for shut_s in (0.0, 4.0, 8.0):
        for told in (False, True):
            for walled_up in (False, True):
                yield _Case(task=DELIVER, sort="door_closed", shut_s=shut_s, told=told, walled_up=walled_up)


def _services(task: _Task) -> list[tuple[str, str, bool]]:
    """Each service that the task uses, with the process that is grounded in it, and whether robots offer it."""
    knowledge = KnowledgeBase(task.site, SHIPPED)
    snapshot = knowledge.snapshot()
    program = snapshot.program(task.process).text
    knowledge.close()
    return [
        (grounding.service, process, grounding.on_robot)
        for process, grounding in sorted(snapshot.groundings.items())
        if re.search(rf"\b'?{process}'?\(", program)
    ]


def _fault(service: str, kind: str, *more: str) -> str:
    return "\n".join(["[faults.it]", f'service = "{service}"', f'kind = "{kind}"', *more, ""])


def _without_recoveries(failures: Path) -> None:
    text = failures.read_text(encoding="utf-8")
    failures.write_text(re.sub(r'\s*<core:recoveredBy rdf:resource="[^"]*"/>', "", text))


def _do(case: _Case, knowledge: Path) -> _Result:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        faults = folder / "faults.toml"
        faults.write_text(case.fault, encoding="utf-8")
        scenario = None if case.shut_s is None else _shut_door(case, folder)
        if case.walled_up:
            knowledge = _walled_up(knowledge, folder)
        given = faults if case.fault else None
        with Fleet.open(case.task.site, scenario=scenario, knowledge=knowledge, faults=given) as fleet:
            handle = fleet.request(case.task.process, robots=None, **case.task.arguments)
            if case.shut_s is not None and case.told and handle.wait_until(case.shut_s) is None:
                fleet.tell("isOpen", "ward_door", False)
            result = handle.wait_until(_HANGS_AFTER_S)
            recoveries = sum(isinstance(e, RecoveryChosen) and e.recovery != "" for e in fleet.trace)
    completed = result is not None and result.status is TaskStatus.COMPLETED
    told = result is not None and re.search(case.culprit, result.reason) is not None
    return _Result(
        completed=completed,
        ended=result is not None,
        right=completed if case.can_be_done else told and not completed,
        took_s=result.took_s if result else _HANGS_AFTER_S,
        recoveries=recoveries,
        reason=result.reason if result else "",
    )


def _shut_door(case: _Case, folder: Path) -> Path:
    """The scenario in which somebody closes the door."""
    text = files("sim").joinpath("scenarios/ward.toml").read_text(encoding="utf-8")
    if case.walled_up:
        text = text.replace('world = "ward"', 'world = "walled_up.toml"')
    file = folder / "scenario.toml"
    file.write_text(
        f'{text}\n[changes.shut]\nat_s = {case.shut_s}\ndoor = "ward_door"\nopen = false\n', encoding="utf-8"
    )
    return file


def _walled_up(knowledge: Path, folder: Path) -> Path:
    """The knowledge with the maps of a ward whose only way is the door."""
    world = files("sim").joinpath("worlds/ward.toml").read_text(encoding="utf-8")
    (folder / "walled_up.toml").write_text(world + _WALL, encoding="utf-8")
    copy = folder / "ontologies"
    shutil.copytree(knowledge, copy)
    draw_floor_plans(load_world(folder / "walled_up.toml"), copy / "sites" / "ward")
    return copy


if __name__ == "__main__":
    sys.exit(main("faults", run))
