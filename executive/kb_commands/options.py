"""What the commands on knowledge have in common."""

from __future__ import annotations

import argparse
from pathlib import Path

from kb.files import SHIPPED


def add_site(command: argparse.ArgumentParser) -> None:
    """Let a command be told which knowledge it is about: `--site` and `--knowledge`."""
    command.add_argument("--site", default="tue_lab", help="name of the site (default: %(default)s)")
    command.add_argument(
        "--knowledge", type=Path, default=SHIPPED, help="folder of ontologies (default: the shipped one)"
    )
