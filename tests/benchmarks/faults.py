"""A campaign of faults: what becomes of FindEmptyDrink when a call fails, a service hangs, a robot is lost.

Every service that the task uses fails once and hangs once; every device of a robot is broken for good; every robot is
lost, on its way and where it has arrived; every compute service is gone for good, which nobody can get around. Each run
stands beside the undisturbed one, and beside the same fault with an ontology that knows of no way to try again, as it
was before there were recoveries: that is the baseline.

A task has to be completed as long as a robot that is capable remains, else to end as failed with the true reason.
"""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from executive import Fleet, TaskStatus
from executive.trace import RecoveryChosen
from kb.files import SHIPPED
from kb.store import KnowledgeBase
from tests.benchmarks.harness import Figure, main

_SITE = "tue_lab"
_ROBOTS = ("amigo_1", "pico_1")
_LOST_AT_S = {"on its way": 1.5, "arrived": 7.7}
_HANGS_AFTER_S = 600.0
_PROCESSES = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class _Case:
    """A fault.

    Attributes:
        sort: Its row in the table.
        culprit: What a true reason names, as a regular expression.
        can_be_done: A capable robot remains.
    """

    sort: str
    fault: str
    culprit: str
    can_be_done: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class _Result:
    """What became of the task."""

    sort: str
    completed: bool
    ended: bool
    right: bool
    took_s: float
    retries: int
    reason: str


def run(quick: bool) -> Mapping[str, Figure]:
    """Measure: how many tasks are done all the same, and how much later, by sort of fault."""
    cases = list(_cases())
    if quick:
        cases = [next(case for case in cases if case.sort == sort) for sort in dict.fromkeys(c.sort for c in cases)]
    with tempfile.TemporaryDirectory() as folder:
        stubborn = Path(folder) / "ontologies"
        shutil.copytree(SHIPPED, stubborn)
        _without_recoveries(stubborn / "failures" / "failures.owl")
        with ProcessPoolExecutor(_PROCESSES, mp_context=get_context("spawn")) as pool:
            calm = pool.submit(_do, _Case(sort="undisturbed", fault="", culprit=""), SHIPPED)
            ours = [pool.submit(_do, case, SHIPPED) for case in cases]
            theirs = [pool.submit(_do, case, stubborn) for case in cases]
            undisturbed_s = calm.result().took_s
            results, baseline = [r.result() for r in ours], [r.result() for r in theirs]
    figures: dict[str, Figure] = {"undisturbed_s": undisturbed_s, "runs": len(results)}
    for sort in dict.fromkeys(case.sort for case in cases):
        own = [r for r in results if r.sort == sort]
        before = [r for r in baseline if r.sort == sort]
        late_s = [r.took_s - undisturbed_s for r in own if r.completed]
        late_before_s = [r.took_s - undisturbed_s for r in before if r.completed]
        figures[f"{sort}_runs"] = len(own)
        figures[f"{sort}_completed"] = sum(r.completed for r in own) / len(own)
        figures[f"{sort}_completed_without_retries"] = sum(r.completed for r in before) / len(before)
        if late_s:
            figures[f"{sort}_later_by_mean_s"] = sum(late_s) / len(late_s)
            figures[f"{sort}_later_by_most_s"] = max(late_s)
        if late_before_s:
            figures[f"{sort}_later_by_mean_without_retries_s"] = sum(late_before_s) / len(late_before_s)
        figures[f"{sort}_retries"] = sum(r.retries for r in own)
    figures["right"] = sum(r.right for r in results) / len(results)
    figures["hung"] = sum(not r.ended for r in results)
    for case, result in zip(cases, results, strict=True):
        if not result.right:
            print(f"{case.sort}: {case.fault!r} ended with: {result.reason or 'nothing'}", file=sys.stderr)
    return figures


def _cases() -> Iterator[_Case]:
    for service, process, on_robot in _services():
        for robot in _ROBOTS if on_robot else ("",):
            name = service.replace("{robot}", robot)
            culprit = rf"{process}\({robot}"
            for kind, sort in (("fail", "failed_once"), ("hang", "hung_once")):
                yield _Case(sort=sort, fault=_fault(name, kind, "calls = [1]"), culprit=culprit)
            if on_robot:
                yield _Case(sort="device_broken", fault=_fault(name, "fail"), culprit=culprit)
            else:
                fault = _fault(name, "fail", 'code = "ServiceBroken"')
                yield _Case(sort="service_gone", fault=fault, culprit=culprit, can_be_done=False)
    for robot in _ROBOTS:
        for from_s in _LOST_AT_S.values():
            fault = _fault(f"/{robot}/*", "cut", f"from_s = {from_s}")
            yield _Case(sort="robot_lost", fault=fault, culprit=rf"\({robot}")


def _services() -> list[tuple[str, str, bool]]:
    """Each service that the task uses, with the process that is grounded in it, and whether robots offer it."""
    knowledge = KnowledgeBase(_SITE, SHIPPED)
    snapshot = knowledge.snapshot()
    program = snapshot.program("FindEmptyDrink").text
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
    failures.write_text(re.sub(r'\s*<core:recoveredBy rdf:resource="[^"]*#(retry\w*|look_again)"/>', "", text))


def _do(case: _Case, knowledge: Path) -> _Result:
    with tempfile.TemporaryDirectory() as folder:
        faults = Path(folder) / "faults.toml"
        faults.write_text(case.fault, encoding="utf-8")
        with Fleet.open(_SITE, knowledge=knowledge, faults=faults if case.fault else None) as fleet:
            result = fleet.request("FindEmptyDrink", room=_SITE).wait_until(_HANGS_AFTER_S)
            retries = sum(isinstance(e, RecoveryChosen) and e.recovery != "" for e in fleet.trace)
    completed = result is not None and result.status is TaskStatus.COMPLETED
    told = result is not None and re.search(case.culprit, result.reason) is not None
    return _Result(
        sort=case.sort,
        completed=completed,
        ended=result is not None,
        right=completed if case.can_be_done else told and not completed,
        took_s=result.took_s if result else _HANGS_AFTER_S,
        retries=retries,
        reason=result.reason if result else "",
    )


if __name__ == "__main__":
    sys.exit(main("faults", run))
