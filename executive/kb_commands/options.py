"""What the commands on knowledge have in common."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from kb.files import SHIPPED


def add_site(command: argparse.ArgumentParser) -> None:
    """Let a command be told which knowledge it is about: `--site` and `--knowledge`."""
    command.add_argument("--site", default="tue_lab", help="name of the site (default: %(default)s)")
    command.add_argument(
        "--knowledge", type=Path, default=SHIPPED, help="folder of ontologies (default: the shipped one)"
    )


def data_folder() -> Path:
    """Where what a user gathers is kept, unless they tell another place: as the XDG base directories say."""
    base = os.environ.get("XDG_DATA_HOME")
    return (Path(base) if base else Path.home() / ".local" / "share") / "concertmaster"
