"""`concertmaster kb import`: files of others as ontology files of ours, with a report of what is not the same."""

from __future__ import annotations

import argparse
import json
import re
from pathlib import Path
from typing import Any

from executive.errors import BadRequest
from executive.exit_codes import OK
from kb.files import SHIPPED
from kb.imports.report import Imported
from kb.vocabulary import CORE_IRI

_FORMATS = {
    "owls": "OWL-S 1.1 or 1.2 processes, with their groundings",
    "recipe": "RoboEarth or KnowRob recipes (classes with subAction)",
    "srdl": "an SRDL robot description",
    "urdf": "a URDF robot model, xacro expanded",
}
_FILE = re.compile(r"[A-Za-z][A-Za-z0-9_]*\.owl")


def add_import(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the command."""
    formats = commands.add_parser("import", help="make an ontology file of a file of others")
    each = formats.add_subparsers(required=True, metavar="FORMAT")
    for name, says in _FORMATS.items():
        command = each.add_parser(name, help=says)
        command.add_argument("file", type=Path, help="file to read; what it imports is looked for beside it")
        command.add_argument("--out", type=Path, required=True, metavar="OWL", help="ontology file to write")
        command.add_argument("--force", action="store_true", help="write over a file that is there already")
        command.add_argument("--json", action="store_true", help="print the report as JSON")
        command.set_defaults(command=_import, format=name)


def _import(options: argparse.Namespace) -> int:
    out: Path = options.out
    _check_out(out, force=options.force)
    imported = _imported(options.format, options.file, f"{CORE_IRI.rpartition('/')[0]}/{out.name}")
    with out.open("w" if options.force else "x", encoding="utf-8") as stream:
        stream.write(imported.text)
    if options.json:
        told = [
            {"file": n.file, "line": n.line, "entity": n.entity, "fate": n.fate, "message": n.message}
            for n in imported.notes
        ]
        print(json.dumps(told, indent=2, ensure_ascii=False))
        return OK
    for note in imported.notes:
        print(note)
    print(f"{out}: {len(imported.entities)} entities, {len(imported.notes)} notes; review it, then import it in a site")
    return OK


def _imported(name: str, file: Path, iri: str) -> Imported:
    """Read a file; each format is loaded only when it is asked for."""
    match name:
        case "owls":
            from kb.imports.owls import import_owls as read  # noqa: PLC0415
        case "recipe":
            from kb.imports.recipes import import_recipes as read  # noqa: PLC0415
        case "srdl":
            from kb.imports.srdl import import_srdl as read  # noqa: PLC0415
        case _:
            from kb.imports.urdf import import_urdf as read  # noqa: PLC0415
    return read(file, iri)


def _check_out(out: Path, *, force: bool) -> None:
    """Before anything is read: may the file be written?"""
    if not _FILE.fullmatch(out.name):
        told = "name it with letters, digits and _, and end it with .owl, as its ontology is named for it"
        raise BadRequest("out", f"--out {out}: {told}")
    if not out.parent.is_dir():
        raise BadRequest("out", f"--out {out}: there is no folder {out.parent}; make it first")
    if out.resolve().is_relative_to(SHIPPED):
        raise BadRequest(
            "out", f"--out {out}: the shipped ontologies are not changed; copy them, and write to the copy"
        )
    if out.exists() and not force:
        raise BadRequest("out", f"--out {out}: is there already; choose another name, or --force to write over it")
