"""`concertmaster kb diff`: its options; what it does is in executive/task_commands/diff.py, as it opens a fleet."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any


def add_diff(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the command."""
    diff = commands.add_parser("diff", help="tell what is different between two folders of ontologies")
    diff.add_argument("old", type=Path, metavar="OLD", help="folder of ontologies")
    diff.add_argument("new", type=Path, metavar="NEW", help="folder of ontologies")
    diff.add_argument("--site", default="tue_lab", help="name of the site (default: %(default)s)")
    diff.add_argument(
        "--task",
        action="append",
        default=[],
        metavar="'TASK name=value ...'",
        help="tell what it changes for this task, such as 'FindEmptyDrink room=tue_lab'; may be given several times",
    )
    diff.add_argument("--scenario", help="with --task: shipped scenario or TOML file (default: the site's own)")
    diff.add_argument("--json", action="store_true", help="print JSON")
    diff.set_defaults(command="executive.task_commands.diff:diff")
