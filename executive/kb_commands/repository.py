"""`concertmaster kb repository`: recipes, models and maps, kept and shared between sites."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import Any

from executive.errors import BadRequest
from executive.exit_codes import OK
from kb.clock import utc_now
from kb.files import SHIPPED
from kb.repository.access import Role, User
from kb.repository.items import Description, Item, ItemKind
from kb.repository.repository import OWNER, Repository
from kb.user_folders import data_folder


def add_repository(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the command."""
    parser = commands.add_parser("repository", help="share recipes, models and maps between sites")
    does = parser.add_subparsers(required=True, metavar="COMMAND")

    upload = _command(does, "upload", "take files in as the next version of an item", _upload)
    upload.add_argument("name", help="namespace/name, such as tue/FindBoth")
    upload.add_argument("files", nargs="+", type=Path, metavar="file", help="files below --knowledge")
    upload.add_argument("--kind", required=True, choices=[str(k) for k in ItemKind], help="what it is")
    upload.add_argument("--knowledge", type=Path, default=SHIPPED, help="folder of ontologies (default: shipped)")
    for option, told in (
        ("--site", "where it was made"),
        ("--author", "who made it"),
        ("--licence", "an SPDX expression, such as Apache-2.0"),
        ("--description", "what it is for"),
    ):
        upload.add_argument(option, default="", help=told)
    upload.add_argument("--tag", action="append", default=[], help="a word to find it by; may be given again")

    search = _command(does, "search", "find items in use", _search)
    search.add_argument("text", nargs="*", help="words, or beginnings of words")
    search.add_argument("--kind", choices=[str(k) for k in ItemKind], help="only items of this kind")
    search.add_argument("--capability", default="", help="only what requires this class of its robots")
    search.add_argument("--site", default="", help="only what was made there")
    search.add_argument("--tag", default="", help="only what has this tag")

    show = _command(does, "show", "tell all about an item", _show)
    show.add_argument("name", help="namespace/name, or namespace/name@version")

    download = _command(does, "download", "put an item and all that it needs into a folder of ontologies", _download)
    download.add_argument("name", help="namespace/name, or namespace/name@version")
    download.add_argument("folder", type=Path, help="new, or a folder of ontologies of yours")

    retire = _command(does, "retire", "have a version not found and taken any more", _retire)
    retire.add_argument("name", help="namespace/name, or namespace/name@version")
    retire.add_argument("--because", required=True, metavar="TEXT", help="why, for those who used it")
    retire.add_argument("--superseded-by", default="", metavar="NAME", help="the item to be used instead")

    restore = _command(does, "restore", "have a retired version used again", _restore)
    restore.add_argument("name", help="namespace/name@version")

    user = _command(does, "user", "take in a user, or give one a new token; prints the token", _user)
    user.add_argument("name", help="of the user")
    user.add_argument("--remove", action="store_true", help="take the user and their roles away instead")

    grant = _command(does, "grant", "give a user a role in a namespace", _grant)
    grant.add_argument("name", help="or 'anyone', who may become a reader")
    grant.add_argument("namespace", help="or '*' for all")
    grant.add_argument("role", choices=[str(r) for r in Role])

    log = _command(does, "log", "print what was done and what was refused, the latest first", _log)
    log.add_argument("--last", type=int, default=20, metavar="N", help="how many lines (default: %(default)s)")

    _command(does, "sweep", "take away contents that no item has, as a killed upload may leave", _sweep)


def _command(does: argparse._SubParsersAction[Any], name: str, told: str, run: object) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = does.add_parser(name, help=told)
    parser.add_argument(
        "--repository", type=Path, help="its folder (default: concertmaster/repository in the user's data)"
    )
    parser.add_argument(
        "--user", help="act as this user, whose token is in CONCERTMASTER_TOKEN (default: as the owner)"
    )
    parser.set_defaults(command=run)
    return parser


def _open(options: argparse.Namespace) -> tuple[Repository, User]:
    repository = Repository(options.repository or data_folder(os.environ) / "repository", utc_now)
    if options.user is None:
        return repository, OWNER
    token = os.environ.get("CONCERTMASTER_TOKEN")
    if token is None:
        raise BadRequest("user", f"--user {options.user} needs the token of {options.user} in CONCERTMASTER_TOKEN")
    return repository, repository.enter(options.user, token)


def _named(given: str) -> tuple[str, int | None]:
    name, at, version = given.partition("@")
    if at and not version.isdecimal():
        raise BadRequest("name", f"{given}: a version is a number, such as {name}@1")
    return name, int(version) if at else None


def _upload(options: argparse.Namespace) -> int:
    repository, who = _open(options)
    about = Description(
        name=options.name,
        kind=ItemKind(options.kind),
        site=options.site,
        author=options.author,
        licence=options.licence,
        description=options.description,
        tags=tuple(options.tag),
    )
    with ExitStack() as stack:
        files = {}
        for file in options.files:
            path = file if file.exists() else options.knowledge / file
            if not path.resolve().is_relative_to(options.knowledge.resolve()):
                raise BadRequest("files", f"{file} is not below {options.knowledge}; give the folder by --knowledge")
            place = path.resolve().relative_to(options.knowledge.resolve()).as_posix()
            files[place] = stack.enter_context(path.open("rb"))
        item = repository.upload(who, about, files)
    print(f"{item.id}: {len(item.files)} files, {sum(f.size for f in item.files)} bytes")
    return OK


def _search(options: argparse.Namespace) -> int:
    repository, who = _open(options)
    found = repository.search(
        who,
        " ".join(options.text),
        kind=ItemKind(options.kind) if options.kind else None,
        capability=options.capability,
        site=options.site,
        tag=options.tag,
    )
    for item in found:
        print(f"{item.id}  {item.about.kind}  {item.about.description}".rstrip())
    return OK


def _show(options: argparse.Namespace) -> int:
    repository, who = _open(options)
    name, version = _named(options.name)
    item = repository.item(who, name, version)
    others = [i for i in repository.versions(who, name) if i.version != item.version]
    print("\n".join(_told(item, others)))
    return OK


def _told(item: Item, others: Sequence[Item]) -> list[str]:
    about = {k: v for k, v in asdict(item.about).items() if k not in ("name", "tags") and v}
    rows = [
        *((k, str(v)) for k, v in about.items()),
        ("tags", ", ".join(item.about.tags)),
        ("uploaded", f"{item.created} by {item.uploaded_by}"),
        ("requires", ", ".join(item.capabilities)),
        ("needs", ", ".join(item.needs)),
        ("retired", item.retired or ""),
        ("superseded by", item.superseded_by),
        ("other versions", ", ".join(f"{i.version}{' (retired)' if i.retired is not None else ''}" for i in others)),
    ]
    files = [f"  {f.path}  {f.size}  {f.sha256}" for f in item.files]
    return [item.id, *(f"  {name}: {value}" for name, value in rows if value), *files]


def _download(options: argparse.Namespace) -> int:
    repository, who = _open(options)
    name, version = _named(options.name)
    placed = repository.download(who, name, options.folder, version)
    print(f"{', '.join(placed.items)} into {options.folder}")
    for path in placed.written:
        print(f"  {path}")
    for path in placed.kept:
        print(f"  {path} was there and is as it was")
    return OK


def _retire(options: argparse.Namespace) -> int:
    repository, who = _open(options)
    name, version = _named(options.name)
    item = repository.retire(who, name, options.because, version=version, superseded_by=options.superseded_by)
    print(f"{item.id} is retired: {item.retired}")
    return OK


def _restore(options: argparse.Namespace) -> int:
    repository, who = _open(options)
    name, version = _named(options.name)
    if version is None:
        raise BadRequest("name", f"tell which version of {name} to restore, such as {name}@1")
    print(f"{repository.restore(who, name, version).id} is in use")
    return OK


def _user(options: argparse.Namespace) -> int:
    repository, who = _open(options)
    if options.remove:
        repository.remove_user(who, options.name)
        print(f"{options.name} is no user any more")
    else:
        print(repository.add_user(who, options.name))
    return OK


def _grant(options: argparse.Namespace) -> int:
    repository, who = _open(options)
    repository.grant(who, options.name, options.namespace, Role[options.role.upper()])
    print(f"{options.name} is {options.role} of {options.namespace}")
    return OK


def _log(options: argparse.Namespace) -> int:
    repository, who = _open(options)
    for entry in repository.log(who, options.last):
        outcome = f": refused, {entry.refused}" if entry.refused else ""
        print(f"{entry.at} {entry.user} {entry.did} {entry.to_what}".rstrip() + outcome)
    return OK


def _sweep(options: argparse.Namespace) -> int:
    repository, who = _open(options)
    print(f"{repository.sweep(who)} contents taken away")
    return OK
