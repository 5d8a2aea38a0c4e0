"""The command `concertmaster`: what `--help` says.

Exit status: 0 done; 1 the task failed or was canceled; 2 the request or the knowledge is wrong, or no
robot is capable, and nothing was begun; 130 interrupted.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Self

from executive.errors import BadRequest
from executive.events import TaskStatus
from executive.exit_codes import FAILED, INTERRUPTED, OK, REFUSED, complain
from executive.export import export_mcap
from executive.fleet import Fleet, TaskHandle
from executive.kb_commands.commands import add_kb
from executive.pictures import draw_gantt, draw_top_view
from executive.replay import first_difference, scenario_of
from executive.trace import (
    FleetOpened,
    PlanFailed,
    ProcessBegun,
    ProcessEnded,
    TaskFinished,
    TraceEvent,
    narrate,
    read_trace,
)
from executive.wiring import site_map
from kb.errors import ConcertmasterError
from kb.files import SHIPPED
from kb.problems import OntologyRejected
from kb.store import KnowledgeBase
from planner.answers import Answer, as_data
from planner.classical_goal import GoalPlan
from planner.explain import Explainer
from planner.plan import Plan
from planner.planner import EFFORT

_PROGRESS_EVERY_S = 1.0
_WORTH_A_LINE_S = 0.5


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    options = make_parser().parse_args(arguments)
    try:
        status: int = options.command(options)
    except OntologyRejected as error:
        complain(str(error))
        status = REFUSED
    except ConcertmasterError as error:
        complain(f"concertmaster: {error}")
        status = REFUSED if error.fault in ("request", "knowledge") else FAILED
    except BrokenPipeError:  # the reader of our output has gone: head, less
        sys.stderr.close()
        status = OK
    except OSError as error:  # a file or folder that a person named
        complain(f"concertmaster: {error.filename or ''}: {error.strerror or error}")
        status = REFUSED
    except KeyboardInterrupt:
        complain("concertmaster: interrupted")
        status = INTERRUPTED
    return status


def make_parser() -> argparse.ArgumentParser:
    """The command line: all commands and what they take."""
    parser = argparse.ArgumentParser(
        prog="concertmaster", description="Plan and conduct the work of several robots from a knowledge base."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    run = commands.add_parser("run", help="do a task with the simulated fleet of a site")
    _add_request_or_goal(run)
    run.add_argument("--out", type=Path, help="folder for trace and pictures (default: the next free runs/TASK-N)")
    run.add_argument(
        "--watch", action="store_true", help="put in force what is saved in the knowledge folder while robots work"
    )
    run.add_argument("--verbose", "-v", action="store_true", help="print every action, as `trace` does")
    run.set_defaults(command=_run)

    plan = commands.add_parser("plan", help="plan a task; nothing moves")
    _add_request_or_goal(plan)
    plan.add_argument(
        "--effort",
        type=float,
        default=EFFORT,
        metavar="S",
        help="how long to look for a better plan or a proof, in seconds of computing (default: %(default)s); "
        "Ctrl-C takes the best so far",
    )
    plan.set_defaults(command=_plan)

    explain = commands.add_parser("explain", help="tell why a task is planned so, or what would make it possible")
    _add_request(explain)
    explain.add_argument(
        "--not",
        dest="why_not",
        metavar="WHERE=WHAT",
        help="why not otherwise: drink_1=pico_1 asks for pico_1 at what belongs to drink_1",
    )
    explain.add_argument(
        "--first",
        metavar="ONE=OTHER",
        help="why not the other way round: drink_2=drink_1 asks for drink_2 before drink_1",
    )
    explain.add_argument("--json", action="store_true", help="print the answers as JSON")
    explain.set_defaults(command=_explain)

    trace = commands.add_parser("trace", help="print a trace, or draw it")
    trace.add_argument("file", type=Path, help="a trace.jsonl that `run` wrote")
    trace.add_argument("--gantt", type=_png, metavar="PNG", help="draw who did what when")
    trace.add_argument("--top-view", type=_png, metavar="PNG", help="draw where the robots went")
    trace.add_argument("--mcap", type=Path, metavar="FILE", help="export for Foxglove and other readers of MCAP")
    trace.add_argument(
        "--replay", action="store_true", help="do it again, and tell the first difference if there is one"
    )
    trace.add_argument("--knowledge", type=Path, default=SHIPPED, help="folder of ontologies (default: shipped)")
    trace.set_defaults(command=_trace)

    add_kb(commands)
    return parser


def _add_request_or_goal(parser: argparse.ArgumentParser) -> None:
    asked = parser.add_mutually_exclusive_group(required=True)
    asked.add_argument("task", nargs="?", help="task type, such as FindEmptyDrink")
    asked.add_argument("--goal", help="instead: what shall be true, such as 'locatedAt(amigo_1)=at_bar'")
    _add_arguments(parser)
    parser.add_argument("--store", metavar="NAME", help="keep what leads to the goal as a recipe of this name")
    parser.add_argument(
        "--realizes", metavar="TASK", default="", help="the task type that the recipe is one more way to accomplish"
    )
    parser.add_argument("--folder", type=Path, help="where to keep it: a folder of ontologies (default: --knowledge)")


def _add_request(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("task", help="task type, such as FindEmptyDrink")
    _add_arguments(parser)


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("arguments", nargs="*", metavar="name=value", help="arguments, such as room=tue_lab")
    parser.add_argument("--robots", type=int, help="at most so many robots take part (default: all)")
    parser.add_argument("--site", default="tue_lab", help="name of the site (default: %(default)s)")
    parser.add_argument("--scenario", help="shipped scenario or TOML file (default: the site's own)")
    parser.add_argument("--knowledge", type=Path, help="folder of ontologies (default: the shipped one)")
    parser.add_argument("--seed", type=int, help="of all chance in the simulator (default: the scenario's)")


def _open(options: argparse.Namespace, trace: Path | None) -> Fleet:
    return Fleet.open(
        options.site,
        scenario=scenario_of(options.scenario) if options.scenario else None,
        knowledge=options.knowledge,
        seed=options.seed,
        trace=trace,
    )


def _arguments(options: argparse.Namespace) -> dict[str, str]:
    arguments: dict[str, str] = {}
    for given in options.arguments:
        name, equals, value = given.partition("=")
        if not equals:
            raise BadRequest(given, f"{given!r} is no argument; write name=value, such as room=tue_lab")
        if name == "robots":
            raise BadRequest(name, f"{given!r} is no argument of the task; write --robots {value}")
        if name in arguments:
            raise BadRequest(name, f"{name} is given twice, as {arguments[name]!r} and as {value!r}")
        arguments[name] = value
    return arguments


def _run(options: argparse.Namespace) -> int:
    arguments = _arguments(options)
    _check_goal_options(options)
    out = options.out or _next_free(Path("runs"), options.task or "Goal")
    if out.exists() and not out.is_dir():
        raise BadRequest("out", f"--out {out} is a file; give a folder")
    with _open(options, out / "trace.jsonl") as fleet:
        _check_store(options, fleet)
        if options.goal is None:
            task = fleet.request(options.task, robots=options.robots, **arguments)
        else:
            task = fleet.request_goal(options.goal)
        if options.watch:
            fleet.watch_knowledge()
        teller = _Teller(fleet, verbose=options.verbose)
        try:
            _wait(task, fleet, teller)
        except KeyboardInterrupt:
            task.cancel()
        result = task.wait()
        teller.tell()
        if result.status is TaskStatus.REFUSED:
            complain(f"concertmaster: {task.name} was refused: {result.reason}")
            return REFUSED
        draw_gantt(fleet.trace, out / "gantt.png")
        draw_top_view(fleet.trace, site_map(fleet.parts.knowledge.snapshot()), out / "top_view.png")
    print(f"trace:    {out / 'trace.jsonl'}")
    print(f"Gantt:    {out / 'gantt.png'}")
    print(f"top view: {out / 'top_view.png'}")
    if options.store and result.goal and result.status is TaskStatus.COMPLETED:
        _store(options, fleet, result.goal)
    match result.status:
        case TaskStatus.COMPLETED:
            return OK
        case TaskStatus.CANCELED:
            complain(f"concertmaster: {task.name} {result.status}: {result.reason}")
            return INTERRUPTED
        case _:
            complain(f"concertmaster: {task.name} {result.status}: {result.reason}")
            return FAILED


def _wait(task: TaskHandle, fleet: Fleet, teller: _Teller) -> None:
    while task.wait_until(fleet.now_s + _PROGRESS_EVERY_S) is None:
        teller.tell()


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


def _check_goal_options(options: argparse.Namespace) -> None:
    if options.goal is not None and options.robots is not None:
        raise BadRequest("robots", "all robots may take part in reaching a goal; leave --robots out")
    if options.store and options.goal is None:
        raise BadRequest("store", "--store keeps what leads to a goal; give --goal as well")
    if options.realizes and not options.store:
        raise BadRequest("realizes", "--realizes tells what the recipe of --store is for; give --store NAME as well")
    if options.folder and not options.store:
        raise BadRequest("folder", "--folder tells where --store keeps the recipe; give --store NAME as well")


def _recipes(options: argparse.Namespace) -> Path:
    folder: Path = options.folder or options.knowledge or SHIPPED
    return folder


def _check_store(options: argparse.Namespace, fleet: Fleet) -> None:
    """Before anything moves."""
    if options.store:
        fleet.check_recipe(options.store, _recipes(options), realizes=options.realizes)


def _store(options: argparse.Namespace, fleet: Fleet, plan: GoalPlan) -> None:
    file = fleet.store_recipe(plan, options.store, _recipes(options), realizes=options.realizes)
    print(f"recipe:   {file}")


def _plan_goal(options: argparse.Namespace) -> int:
    with _open(options, None) as fleet:
        _check_store(options, fleet)
        found, plan = fleet.plan_goal(options.goal)
        print(f"{found.status}: {found.reason}")
        if found.program is None:
            return REFUSED
        if plan is not None:
            _print_steps(plan)
        if options.store:
            _store(options, fleet, found)
    return OK


def _plan(options: argparse.Namespace) -> int:
    arguments = _arguments(options)
    _check_goal_options(options)
    if options.goal is not None:
        return _plan_goal(options)
    with _open(options, None) as fleet, _Search() as search:
        plan, lacking = fleet.plan(
            options.task,
            robots=options.robots,
            effort=options.effort,
            stop=search.stopped,
            on_plan=search.tell,
            **arguments,
        )
    print(f"{plan.status}: {plan.reason}")
    _print_steps(plan)
    for sentence in lacking:
        complain(sentence)
    return OK if plan.solved else REFUSED


def _explain(options: argparse.Namespace) -> int:
    arguments = _arguments(options)
    with (
        _open(options, None) as fleet,
        fleet.explaining(options.task, robots=options.robots, **arguments) as (plan, explainer),
    ):
        answers = list(_answers(options, plan, explainer))
    if options.json:
        print(json.dumps([as_data(a) for a in answers], indent=2, ensure_ascii=False))
    else:
        for answer in answers:
            print(answer.text)
    return OK


def _answers(options: argparse.Namespace, plan: Plan, explainer: Explainer) -> Iterator[Answer]:
    if not plan.solved:
        yield explainer.what_would_help()
        return
    if options.why_not is not None:
        yield explainer.why_not(plan, *_pair("--not", options.why_not))
    if options.first is not None:
        yield explainer.why_not_first(plan, *_pair("--first", options.first))
    if options.why_not is None and options.first is None:
        yield explainer.why(plan)


def _pair(option: str, given: str) -> tuple[str, str]:
    one, equals, other = given.rpartition("=")
    if not equals:
        raise BadRequest(option, f"{option} {given} names one thing; name two, such as {option} drink_1=pico_1")
    return one, other


class _Search:
    """A line of progress while a plan is looked for, where somebody is watching; Ctrl-C ends the search."""

    def __init__(self) -> None:
        self._stopped = False
        self._before: Any = None
        self._shown = False

    def __enter__(self) -> Self:
        self._before = signal.signal(signal.SIGINT, self._stop)
        return self

    def __exit__(self, *_: object) -> None:
        signal.signal(signal.SIGINT, self._before)
        if self._shown:
            print(file=sys.stderr)

    def stopped(self) -> bool:
        return self._stopped

    def tell(self, plan: Plan) -> None:
        if plan.solved and sys.stderr.isatty():
            self._shown = True
            told = f"makespan {plan.makespan_s:.2f} s, at least {plan.lower_bound_s:.2f} s ({plan.phase})"
            print(f"\r{told:<78}", end="", file=sys.stderr, flush=True)

    def _stop(self, *_: object) -> None:
        self._stopped = True


def _print_steps(plan: Plan) -> None:
    for step in plan.steps:
        print(f"  [{step.action}] from {step.start_s:.2f} to {step.end_s:.2f}")


def _trace(options: argparse.Namespace) -> int:
    events = list(read_trace(options.file))
    if options.gantt:
        draw_gantt(events, options.gantt)
        print(options.gantt)
    if options.top_view:
        opened = next((e for e in events if isinstance(e, FleetOpened)), None)
        if opened is None:
            raise BadRequest("file", f"{options.file} does not tell the site, so its map is not known")
        knowledge = KnowledgeBase(opened.site, options.knowledge)
        draw_top_view(events, site_map(knowledge.snapshot()), options.top_view)
        knowledge.close()
        print(options.top_view)
    if options.mcap:
        export_mcap(events, options.mcap)
        print(options.mcap)
    if options.replay:
        difference = first_difference(events, options.knowledge)
        print(difference or f"{len(events)} events, all the same")
        return FAILED if difference else OK
    if not options.gantt and not options.top_view and not options.mcap:
        for line in narrate(events):
            print(line)
    return OK


def _png(name: str) -> Path:
    if not name.endswith(".png"):
        raise argparse.ArgumentTypeError(f"{name!r} is no picture that can be drawn; give a name that ends in .png")
    return Path(name)


def _next_free(folder: Path, task: str) -> Path:
    number = 1
    while (folder / f"{task}-{number}").exists():
        number += 1
    return folder / f"{task}-{number}"


if __name__ == "__main__":
    sys.exit(main())
