"""`concertmaster kb check`: are the ontology files of a site right?"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from executive.exit_codes import INTERRUPTED, OK, REFUSED, complain
from executive.kb_commands.options import add_site
from kb.checking import check_folder
from kb.errors import KnowledgeError
from kb.problems import OntologyRejected, Problem, errors, in_order
from kb.revisions import read_revision
from kb.sarif import sarif
from kb.sites import sites_of
from kb.watching import FolderWatch


def add_check(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the command."""
    check = commands.add_parser("check", help="check the ontology files of a site")
    add_site(check)
    check.add_argument("--all-sites", action="store_true", help="check all sites of the folder")
    check.add_argument(
        "--format",
        choices=("text", "json", "sarif"),
        default="text",
        help="text for people, json for scripts, sarif for editors and code hosts (default: %(default)s)",
    )
    check.add_argument("--strict", action="store_true", help="let warnings count as errors")
    check.add_argument("--watch", action="store_true", help="check again whenever a file is saved, until Ctrl-C")
    check.set_defaults(command=_check)


def _check(options: argparse.Namespace) -> int:
    if options.watch:
        return _watch(options)
    problems, told = _problems(options)
    if options.format == "text":
        _tell(problems)
        print(told, end="")
    else:
        document = sarif(problems, Path.cwd()) if options.format == "sarif" else [_as_json(p) for p in problems]
        print(json.dumps(document, indent=2, ensure_ascii=False))
    return REFUSED if (problems if options.strict else errors(problems)) else OK


def _problems(options: argparse.Namespace) -> tuple[list[Problem], str]:
    """What is wrong with the sites asked for and with files of no site; and a line on each site that can be used."""
    folder: Path = options.knowledge
    found = check_folder(folder)
    lines = ""
    sites = sites_of(folder) if options.all_sites else [options.site]
    if not sites:
        raise KnowledgeError(f"there is no site in {folder}; a site called lab is a file sites/lab/lab.owl there")
    for site in sites:
        try:
            revision = read_revision(site, folder)
        except OntologyRejected as rejected:
            found += rejected.problems
            continue
        found += revision.warnings
        count = len(revision.warnings)
        said = f"{count} warning{'s' if count > 1 else ''}" if count else "no problems"
        lines += f"{site}: {len(revision.ontology.files.files)} files, {said}\n"
    return in_order(found), lines


def _watch(options: argparse.Namespace) -> int:
    """Check, and check again whenever something in the folder changes; tell what is new and what is mended."""

    def look() -> tuple[list[Problem], str] | Exception:
        try:
            return _problems(options)
        except (KnowledgeError, OSError) as error:  # a site or file that is away, perhaps while it is saved
            return error

    looks = SimpleQueue[tuple[list[Problem], str] | Exception]()
    watching = FolderWatch(options.knowledge, look, looks.put, at_once=True)
    before: list[Problem] = []
    try:
        while True:
            match looks.get():
                case Exception() as error:
                    complain(f"concertmaster: {error}")
                case (now, told):
                    _tell(p for p in now if _mark(p) not in set(map(_mark, before)))
                    for problem in before:
                        if _mark(problem) not in set(map(_mark, now)):
                            print(f"mended: {problem}")
                    print(told, end="", flush=True)
                    before = now
    except KeyboardInterrupt:
        return INTERRUPTED
    finally:
        watching.close()


def _mark(problem: Problem) -> tuple[object, ...]:
    """A problem is the same on another line."""
    return problem.code, problem.file, problem.entity, problem.message


def _tell(problems: Iterable[Problem]) -> None:
    for problem in problems:
        complain(str(problem))


def _as_json(problem: Problem) -> dict[str, Any]:
    return {
        "file": str(problem.file),
        "line": problem.line,
        "code": problem.code,
        "severity": str(problem.severity),
        "entity": problem.entity,
        "message": problem.message,
    }
