"""`concertmaster run`: do a task, tell how it goes, and keep trace and pictures."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from executive.errors import BadRequest
from executive.events import TaskStatus
from executive.exit_codes import FAILED, INTERRUPTED, OK, REFUSED, complain
from executive.fleet import Fleet, TaskHandle
from executive.pictures import draw_gantt, draw_top_view
from executive.task_commands.asked import arguments_of, check_goal_options, check_store, open_fleet, store
from executive.task_commands.terminal import PersonAtTerminal
from executive.trace import PlanFailed, ProcessBegun, ProcessEnded, TaskFinished, TraceEvent, narrate
from executive.wiring import site_map

_PROGRESS_EVERY_S = 1.0
_WORTH_A_LINE_S = 0.5


def run(options: argparse.Namespace) -> int:
    """Do it; the exit status."""
    arguments = arguments_of(options)
    check_goal_options(options)
    out = options.out or _next_free(Path("runs"), options.task or "Goal")
    if out.exists() and not out.is_dir():
        raise BadRequest("out", f"--out {out} is a file; give a folder")
    files = {"compute": options.compute, "faults": options.faults, "connect": options.connect}
    with open_fleet(options, out / "trace.jsonl", **files) as fleet:
        check_store(options, fleet)
        if options.goal is None:
            task = fleet.request(options.task, robots=options.robots, **arguments)
        else:
            task = fleet.request_goal(options.goal)
        if options.watch:
            fleet.watch_knowledge()
        person = PersonAtTerminal(fleet, is_live=options.connect is not None) if options.ask else None
        teller = _Teller(fleet, verbose=options.verbose)
        try:
            _wait(task, fleet, teller, person)
        except KeyboardInterrupt:
            task.cancel()
        result = task.wait()
        teller.tell()
        if result.status is TaskStatus.REFUSED:
            complain(f"concertmaster: {task.name} was refused: {result.reason}")
            return REFUSED
        metrics = fleet.metrics.told()
        (out / "metrics.json").write_text(json.dumps(metrics, indent=1) + "\n", encoding="utf-8")
        draw_gantt(fleet.trace, out / "gantt.png")
        draw_top_view(fleet.trace, site_map(fleet.parts.knowledge.snapshot()), out / "top_view.png")
    print(f"trace:    {out / 'trace.jsonl'}")
    print(f"Gantt:    {out / 'gantt.png'}")
    print(f"top view: {out / 'top_view.png'}")
    print(f"metrics:  {out / 'metrics.json'}")
    if options.store and result.goal and result.status is TaskStatus.COMPLETED:
        store(options, fleet, result.goal)
    match result.status:
        case TaskStatus.COMPLETED:
            return OK
        case TaskStatus.CANCELED:
            complain(f"concertmaster: {task.name} {result.status}: {result.reason}")
            return INTERRUPTED
        case _:
            complain(f"concertmaster: {task.name} {result.status}: {result.reason}")
            return FAILED


def _wait(task: TaskHandle, fleet: Fleet, teller: _Teller, person: PersonAtTerminal | None) -> None:
    while task.wait_until(fleet.now_s + _PROGRESS_EVERY_S) is None:
        teller.tell()
        if person:
            person.take_answers()


class _Teller:
    """Prints what has happened since it last did."""

    def __init__(self, fleet: Fleet, *, verbose: bool) -> None:
        self._fleet = fleet
        self._verbose = verbose
        self._told = 0
        self._begun: dict[tuple[str, str], float] = {}

    def tell(self) -> None:
        events = self._fleet.trace[self._told :]
        self._told += len(events)
        for line in narrate(events) if self._verbose else self._briefly(events):
            print(line, flush=True)

    def _briefly(self, events: Sequence[TraceEvent]) -> Sequence[str]:
        """Without the actions, but with the composite processes that take a while."""
        lines: list[str] = []
        for event in events:
            match event:
                case ProcessBegun():
                    self._begun[event.task, event.process] = event.t_s
                case ProcessEnded():
                    took_s = event.t_s - self._begun.get((event.task, event.process), event.t_s)
                    if took_s >= _WORTH_A_LINE_S:
                        lines.append(f"done [{event.process}] at time {event.t_s:.2f}, after {took_s:.2f} s")
                case PlanFailed():
                    pass  # the end of the task tells why
                case TaskFinished() if event.status != TaskStatus.COMPLETED:
                    pass  # told at the end, where errors go
                case _:
                    lines += (line for line in narrate([event]) if not line.startswith("do ["))
        return lines


def _next_free(folder: Path, task: str) -> Path:
    number = 1
    while (folder / f"{task}-{number}").exists():
        number += 1
    return folder / f"{task}-{number}"
