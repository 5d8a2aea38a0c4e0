"""The command `concertmaster`: what `--help` says.

Exit status: 0 done; 1 the task failed or was canceled; 2 the request or the knowledge is wrong, or no
robot is capable, and nothing was begun; 130 interrupted.
"""

from __future__ import annotations

import argparse
import pkgutil
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from executive.exit_codes import FAILED, INTERRUPTED, OK, REFUSED, complain
from executive.kb_commands.commands import add_kb
from kb.errors import ConcertmasterError
from kb.problems import OntologyRejected
from planner.plan import EFFORT


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    options = make_parser().parse_args(arguments)
    try:
        command: Callable[[argparse.Namespace], int] = options.command
        if isinstance(options.command, str):  # what plans and draws takes two seconds to import
            command = pkgutil.resolve_name(options.command)
        status = command(options)
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

    run = commands.add_parser("run", help="do a task with the simulated fleet of a site, or with robots elsewhere")
    _add_request_or_goal(run)
    run.add_argument("--out", type=Path, help="folder for trace and pictures (default: the next free runs/TASK-N)")
    run.add_argument("--compute", type=Path, help="settings of the compute services (TOML): which run in workers")
    run.add_argument(
        "--connect",
        metavar="WHERE",
        help="robots elsewhere: address of their rosbridge server or ROS 1 master, ros2: for ROS 2, or a file (TOML) "
        "with one for each",
    )
    run.add_argument("--faults", type=Path, help="what goes wrong with calls to services (TOML)")
    run.add_argument(
        "--watch", action="store_true", help="put in force what is saved in the knowledge folder while robots work"
    )
    run.add_argument("--ask", action="store_true", help="ask for help at this terminal where a person may be able to")
    run.add_argument("--verbose", "-v", action="store_true", help="print every action, as `trace` does")
    run.set_defaults(command="executive.task_commands.run:run")

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
    plan.set_defaults(command="executive.task_commands.plan:plan")

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
    explain.set_defaults(command="executive.task_commands.explain:explain")

    trace = commands.add_parser("trace", help="print a trace, or draw it")
    trace.add_argument("file", type=Path, help="a trace.jsonl that `run` wrote")
    trace.add_argument("--gantt", type=_png, metavar="PNG", help="draw who did what when")
    trace.add_argument("--top-view", type=_png, metavar="PNG", help="draw where the robots went")
    trace.add_argument("--mcap", type=Path, metavar="FILE", help="export for Foxglove and other readers of MCAP")
    trace.add_argument(
        "--replay", action="store_true", help="do it again, and tell the first difference if there is one"
    )
    trace.add_argument(
        "--knowledge", type=Path, help="folder of ontologies (default: what is kept beside the trace, else the shipped)"
    )
    trace.set_defaults(command="executive.task_commands.trace:trace")

    simulate = commands.add_parser("simulate", help="serve the simulated fleet of a site over rosbridge")
    _add_simulated(simulate)
    simulate.add_argument("--host", default="127.0.0.1", help="address to listen at (default: %(default)s)")
    simulate.add_argument("--port", type=int, default=9090, help="0 takes any that is free (default: %(default)s)")
    simulate.add_argument("--access", type=Path, metavar="FILE", help="who may connect and do what, and TLS (TOML)")
    simulate.add_argument("--ros1", metavar="URI", help="offer services and topics in ROS 1 too: address of the master")
    simulate.add_argument("--srv", type=Path, metavar="FOLDER", help="write their types there, as a ROS 1 package")
    simulate.set_defaults(command="executive.task_commands.simulate:simulate")

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
    _add_simulated(parser)


def _add_simulated(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--site", default="tue_lab", help="name of the site (default: %(default)s)")
    parser.add_argument("--scenario", help="shipped scenario or TOML file (default: the site's own)")
    parser.add_argument("--knowledge", type=Path, help="folder of ontologies (default: the shipped one)")
    parser.add_argument("--seed", type=int, help="of all chance in the simulator (default: the scenario's)")


def _png(name: str) -> Path:
    if not name.endswith(".png"):
        raise argparse.ArgumentTypeError(f"{name!r} is no picture that can be drawn; give a name that ends in .png")
    return Path(name)


if __name__ == "__main__":
    sys.exit(main())
