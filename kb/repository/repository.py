"""The knowledge repository of [RoboEarth] 3.2: recipes, models and maps, kept and shared between sites.

Embedded: a folder with a SQLite file and the contents of files by hash. Versions of items never change.
Several threads and processes may use one repository. Methods take plain values and streams, so that a
service in front of it has nothing to add but its protocol.
"""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import islice
from pathlib import Path
from typing import BinaryIO

from kb.files import SHIPPED
from kb.parsing import header_iri
from kb.problems import OntologyRejected
from kb.repository import access, tables
from kb.repository.access import AccessRefused, Role, User
from kb.repository.blobs import Blobs, Staged, write_hashed
from kb.repository.contents import Contents, check_contents, read_contents, searchable, shipped_iris
from kb.repository.items import (
    BadItem,
    Description,
    Item,
    ItemKind,
    NoSuchItem,
    StoredFile,
    check_description,
    check_paths,
)
from kb.repository.placing import Placed, place_into, place_new

_NEWEST = """retired IS NULL
    AND version = (SELECT max(version) FROM items AS n WHERE n.name = items.name AND n.retired IS NULL)"""

_LONGEST_LOGGED = 1000
_ENTERS_LOGGED = 10_000
"""Of those who were refused entry so many are remembered: strangers must not fill the disk, nor flush out the rest."""

_FORGET_ENTERS = """DELETE FROM log WHERE did = 'enter' AND id <=
    (SELECT id FROM log WHERE did = 'enter' ORDER BY id DESC LIMIT 1 OFFSET ?)"""

OWNER = User(name="owner", owns=True)
"""Whoever can read and write the folder of the repository can do everything anyway."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """How much of an item is taken. Ontologies have a limit of their own, that of kb/parsing.py."""

    item_bytes: int = 2_000_000_000
    files: int = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A line of the log.

    Attributes:
        at: In UTC, as ISO 8601 writes it.
        did: Such as `upload`.
        refused: Why it was not done; empty if it was.
    """

    at: str
    user: str
    did: str
    to_what: str
    refused: str


class Repository:
    """A folder of items. Whoever calls has found out who the user is, by `enter`, or holds the folder (`OWNER`).

    What changes something raises `AccessRefused` where the user may not do it. That, changes and downloads are in the
    log; who only looks around is not, and what somebody may not read is not there for them.
    """

    def __init__(self, folder: Path, now: Callable[[], datetime], *, limits: Limits | None = None) -> None:
        """Open a repository; where there is none, make one.

        Args:
            now: The time, with its zone.
        """
        folder.mkdir(parents=True, exist_ok=True)
        self._file = folder / "repository.sqlite"
        self._now = now
        self._limits = limits or Limits()
        self._blobs = Blobs(folder)
        tables.create(self._file)

    # Users

    def enter(self, name: str, token: str) -> User:
        """The user whose token this is.

        Raises:
            AccessRefused: There is no such user, or it is not their token.
        """
        with self._noting(name[:64], "enter", ""), self._reading() as db:
            return access.enter(db, name, token)

    def add_user(self, who: User, name: str) -> str:
        """Take in a user, or give one a new token; returns the token, which is shown nowhere else."""
        with self._acting(who, "add user", name) as db:
            access.require(db, who, access.EVERYWHERE, Role.CURATOR, "add users")
            return access.add_user(db, name)

    def remove_user(self, who: User, name: str) -> None:
        """Take a user away: their token and their roles; what they have uploaded stays."""
        with self._acting(who, "remove user", name) as db:
            access.require(db, who, access.EVERYWHERE, Role.CURATOR, "remove users")
            access.remove_user(db, name)

    def grant(self, who: User, name: str, namespace: str, role: Role) -> None:
        """Give a user a role in a namespace (`*`: in all); `Role.NONE` takes the one they have away.

        Args:
            name: Of a user, or `anyone`, who may become a reader.
        """
        with self._acting(who, "grant", f"{role} of {namespace} to {name}") as db:
            access.require(db, who, namespace, Role.CURATOR, "say who may do what")
            access.grant(db, name, namespace, role)

    # Items

    def upload(
        self,
        who: User,
        about: Description,
        files: Mapping[str, BinaryIO],
        *,
        sha256: Mapping[str, str] | None = None,
    ) -> Item:
        """Take in an item as its next version, all of it or nothing. It is read and checked before.

        Args:
            files: Streams by path in a folder of ontologies, such as `tasks/find_both.owl`; at least one ontology.
            sha256: What the uploader says that the hashes are, by path.

        Returns:
            The new version; the newest one there is, if that is the same.

        Raises:
            BadItem: Description, paths, sizes or hashes are wrong; it is not of its kind; or it imports, or claims to
                be, what it must not.
            OntologyRejected: An ontology of it is wrong.
        """
        with self._noting(who.name, "upload", about.name):
            check_description(about)
            check_paths(about.name, files)
            if len(files) > self._limits.files:
                raise BadItem(about.name, f"has {len(files)} files; at most {self._limits.files} are taken")
            with self._reading() as db:
                self._require_uploader(db, who, about)
            with self._blobs.staging() as staging:
                own = staging / "own"
                staged = self._receive(about, files, sha256 or {}, own)
                contents = read_contents(about, own, staged)
                with self._reading() as db:
                    needs = self._needed(db, who, about, contents)
                self._add_needed(about, needs, own, set(staged))
                capabilities = check_contents(about, contents, own)
                item = Item(
                    about=replace(about, tags=tuple(sorted(set(about.tags)))),
                    version=0,
                    created=self._time(),
                    uploaded_by=who.name,
                    files=tuple(
                        StoredFile(path=p, sha256=s.sha256, size=s.size, iri=contents.iris.get(p, ""))
                        for p, s in sorted(staged.items())
                    ),
                    needs=tuple(sorted(item.id for item in needs if item.id in self._direct(needs, contents))),
                    capabilities=capabilities,
                )
                return self._insert(who, item, staged, contents.words)

    def search(
        self,
        who: User,
        text: str = "",
        *,
        kind: ItemKind | None = None,
        capability: str = "",
        site: str = "",
        tag: str = "",
        limit: int = 100,
    ) -> list[Item]:
        """The newest version in use of each item that fits all that is asked; by name.

        Args:
            text: Words, or beginnings of words, of names, labels, comments, descriptions and tags.
            capability: That its processes require of a robot.
        """
        conditions, values = [_NEWEST], list[object]()
        if words := text.replace("\0", " ").split():
            conditions.append("id IN (SELECT rowid FROM texts WHERE texts MATCH ?)")
            values.append(" ".join('"' + word.replace('"', '""') + '"*' for word in words))
        for column, value in (("kind", kind.value if kind else ""), ("site", site)):
            if value:
                conditions.append(f"{column} = ?")
                values.append(value)
        for sort, value in (("capability", capability), ("tag", tag)):
            if value:
                conditions.append("id IN (SELECT item FROM words WHERE sort = ? AND word = ?)")
                values += [sort, value]
        with self._reading() as db:
            found = tables.each(db, " AND ".join(conditions), tuple(values))
            return list(islice((item for item in found if self._may_read(db, who, item)), limit))

    def item(self, who: User, name: str, version: int | None = None) -> Item:
        """A version of an item; the newest one in use if none is told.

        Raises:
            NoSuchItem: There is none, or none that the user may read.
        """
        with self._reading() as db:
            return self._item(db, who, name, version)

    def versions(self, who: User, name: str) -> list[Item]:
        """All versions of an item, retired ones too, the newest first.

        Raises:
            NoSuchItem: There is none, or none that the user may read.
        """
        with self._reading() as db:
            found = [i for i in tables.select(db, "name = ?", (name,)) if self._may_read(db, who, i)]
        if not found:
            raise NoSuchItem(f"there is no {name} that {who.name} may read")
        return found

    def with_needed(self, who: User, name: str, version: int | None = None) -> list[Item]:
        """An item, and after it all that it needs, directly or not.

        Raises:
            NoSuchItem: There is none, or one that it needs is none that the user may read.
        """
        with self._reading() as db:
            return self._closure(db, who, [self._item(db, who, name, version)])

    def open_file(self, who: User, name: str, version: int, path: str) -> BinaryIO:
        """A file of an item, to be read piece by piece.

        Raises:
            NoSuchItem: There is none, or none that the user may read.
            RepositoryDamaged: Its content is gone or has changed.
        """
        with self._noting(who.name, "download", f"{name}@{version} {path}"):
            item = self.item(who, name, version)
            file = next((f for f in item.files if f.path == path), None)
            if file is None:
                raise NoSuchItem(f"{item.id} has no file {path}; it has {', '.join(f.path for f in item.files)}")
            stream = self._blobs.open(file.sha256)
            self._note(who.name, "download", f"{item.id} {path}")
            return stream

    def download(self, who: User, name: str, folder: Path, version: int | None = None) -> Placed:
        """Put the files of an item, and of all that it needs, into a folder of ontologies.

        A new folder appears with everything in it, or not at all. Into one that is there, every file comes whole, and
        none if one is in the way; what the item needs and the folder has already, under the same ontology IRI or path,
        stays as it is there.

        Raises:
            NoSuchItem: As for `with_needed`.
            BadItem: A file of the item is in the way of another.
            RepositoryDamaged: A content is gone or has changed.
        """
        with self._noting(who.name, "download", name):
            [asked, *needed] = self.with_needed(who, name, version)
            place = place_into if folder.exists() else place_new
            placed = place(folder, asked, needed, self._blobs)
            self._note(who.name, "download", asked.id)
            return placed

    def retire(self, who: User, name: str, reason: str, *, version: int | None = None, superseded_by: str = "") -> Item:
        """Have a version not found and not taken any more; it can still be read by its number.

        Args:
            version: The newest one in use if none is told.
            superseded_by: The name of the item to be used instead.

        Raises:
            NoSuchItem: There is no such version, or no such item to supersede it.
            BadItem: It is retired already.
        """
        with self._acting(who, "retire", name) as db:
            item = self._item(db, who, name, version)
            self._require_uploader(db, who, item.about)
            if item.retired is not None:
                raise BadItem(item.id, f"is retired already: {item.retired}")
            if superseded_by:
                self._item(db, who, superseded_by, None)
            changed = (reason, superseded_by, item.about.name, item.version)
            db.execute("UPDATE items SET retired = ?, superseded_by = ? WHERE name = ? AND version = ?", changed)
            return self._item(db, who, name, item.version)

    def restore(self, who: User, name: str, version: int) -> Item:
        """Have a retired version used again.

        Raises:
            NoSuchItem: There is no such version.
            BadItem: It is not retired.
        """
        with self._acting(who, "restore", f"{name}@{version}") as db:
            item = self._item(db, who, name, version)
            access.require(db, who, item.about.namespace, Role.CURATOR, f"restore {item.id}")
            if item.retired is None:
                raise BadItem(item.id, "is not retired")
            self._refuse_claimed(db, item)
            db.execute(
                "UPDATE items SET retired = NULL, superseded_by = '' WHERE name = ? AND version = ?",
                (name, version),
            )
            return self._item(db, who, name, version)

    def log(self, who: User, limit: int = 100) -> list[Entry]:
        """What was done and what was refused, the latest first."""
        with self._acting(who, "read log", "") as db:
            access.require(db, who, access.EVERYWHERE, Role.CURATOR, "read the log")
            rows = db.execute("SELECT at, user, did, to_what, refused FROM log ORDER BY id DESC LIMIT ?", (limit,))
            return [Entry(at=a, user=u, did=d, to_what=t, refused=r) for a, u, d, t, r in rows]

    def sweep(self, who: User) -> int:
        """Take away contents that no item has, as a killed upload may leave; returns how many."""
        with self._acting(who, "sweep", "") as db:  # a transaction, so that no upload is about to need one
            access.require(db, who, access.EVERYWHERE, Role.CURATOR, "sweep the contents")
            return self._blobs.drop_all_but(h for (h,) in db.execute("SELECT DISTINCT sha256 FROM files"))

    # Uploading, step by step

    def _require_uploader(self, db: sqlite3.Connection, who: User, about: Description) -> None:
        """New items take a contributor; what there is, whoever uploaded it, or a curator."""
        access.require(db, who, about.namespace, Role.CONTRIBUTOR, f"change {about.name}")
        others = {i.uploaded_by for i in tables.select(db, "name = ?", (about.name,))} - {who.name}
        if others:
            what = f"change {about.name}, which is by {', '.join(sorted(others))}"
            access.require(db, who, about.namespace, Role.CURATOR, what)

    def _receive(
        self, about: Description, files: Mapping[str, BinaryIO], told: Mapping[str, str], folder: Path
    ) -> dict[str, Staged]:
        staged: dict[str, Staged] = {}
        left = self._limits.item_bytes
        for path, stream in files.items():
            staged[path] = write_hashed(stream, folder / path, limit=left, item=about.name)
            left -= staged[path].size
            if told.get(path, staged[path].sha256) != staged[path].sha256:
                came = f"it came as {staged[path].sha256}"
                raise BadItem(about.name, f"{path} should have the hash {told[path]}, but {came}; upload it again")
        return staged

    def _needed(self, db: sqlite3.Connection, who: User, about: Description, contents: Contents) -> list[Item]:
        """The items that have the ontologies which are imported, and what they need in turn."""
        direct: list[Item] = []
        for iri in sorted(contents.imports):
            having = "retired IS NULL AND name <> ? AND id IN (SELECT item FROM files WHERE iri = ?)"
            found = [i for i in tables.select(db, having, (about.name, iri)) if self._may_read(db, who, i)]
            if found:
                direct.append(found[0])
            elif iri not in shipped_iris():
                where = "neither among its files nor in the repository (as far as you may read), nor shipped"
                raise BadItem(about.name, f"imports {iri}, which is {where}; upload that first, or with it")
        return [i for i in self._closure(db, who, direct) if i.about.name != about.name]

    def _direct(self, needs: list[Item], contents: Contents) -> set[str]:
        return {item.id for item in needs if any(f.iri in contents.imports for f in item.files)}

    def _add_needed(self, about: Description, needs: list[Item], folder: Path, own: set[str]) -> None:
        """Beside the item's own files, those of what it imports, so that they can be checked together."""
        for item in needs:
            for file in item.files:
                if file.path in own:
                    raise BadItem(about.name, f"has the file {file.path}, and so has {item.id}, which it imports")
                if not (folder / file.path).exists():
                    (folder / file.path).parent.mkdir(parents=True, exist_ok=True)
                    self._blobs.copy(file.sha256, folder / file.path)
        self._add_shipped(needs, folder)

    def _add_shipped(self, needs: list[Item], folder: Path) -> None:
        present = {iri for path in folder.rglob("*.owl") if (iri := header_iri(path))}
        for path in sorted(SHIPPED.rglob("*.owl")):
            if header_iri(path) not in present and path.stem not in {"core"}:
                target = folder / "shipped" / path.relative_to(SHIPPED)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(path, target)

    def _insert(self, who: User, item: Item, staged: Mapping[str, Staged], words: str) -> Item:
        about = item.about
        with self._acting(who, "upload", about.name, refusals=False) as db:
            self._require_uploader(db, who, about)
            newest = self._newest(db, about.name)
            is_new = newest is None or (newest.about, newest.files) != (about, item.files)
            if is_new:
                self._refuse_claimed(db, item)
            for content in staged.values():
                self._blobs.keep(content)
            if newest is not None and not is_new:
                return newest
            [last] = db.execute("SELECT max(version) FROM items WHERE name = ?", (about.name,)).fetchone()
            item = replace(item, version=(last or 0) + 1)
            text = searchable(" ".join((about.name, about.description, about.site, about.author, *about.tags)))
            tables.insert(db, item, f"{text} {words}")
            return item

    def _refuse_claimed(self, db: sqlite3.Connection, item: Item) -> None:
        for file in item.files:
            having = "retired IS NULL AND name <> ? AND id IN (SELECT item FROM files WHERE iri = ?)"
            others = tables.select(db, having, (item.about.name, file.iri)) if file.iri else []
            if others:
                told = f"claims to be {file.iri}, as {others[0].about.name} does; import that, or take another IRI"
                raise BadItem(item.about.name, f"{file.path} {told}")

    # Looking up

    def _item(self, db: sqlite3.Connection, who: User, name: str, version: int | None) -> Item:
        asked = "name = ? AND (version = ? OR (? IS NULL AND retired IS NULL))"
        for item in tables.select(db, asked, (name, version, version)):
            if self._may_read(db, who, item):
                return item
        retired = [i for i in tables.select(db, "name = ?", (name,)) if self._may_read(db, who, i)]
        if retired and version is None:
            instead = f"; take {retired[0].superseded_by} instead" if retired[0].superseded_by else ""
            raise NoSuchItem(f"all versions of {name} are retired, the last as: {retired[0].retired}{instead}")
        number = "" if version is None else f"@{version}"
        raise NoSuchItem(f"there is no {name}{number} that {who.name} may read")

    def _newest(self, db: sqlite3.Connection, name: str) -> Item | None:
        found = tables.select(db, "name = ? AND retired IS NULL", (name,), "LIMIT 1")
        return found[0] if found else None

    def _closure(self, db: sqlite3.Connection, who: User, items: list[Item]) -> list[Item]:
        """Items and all that they need; of two versions of one item, the newer."""
        found = {item.about.name: item for item in items}
        todo = list(items)
        while todo:
            for needed in todo.pop(0).needs:
                name, _, version = needed.rpartition("@")
                if name not in found or found[name].version < int(version):
                    found[name] = self._item(db, who, name, int(version))
                    todo.append(found[name])
        return list(found.values())

    def _may_read(self, db: sqlite3.Connection, who: User, item: Item) -> bool:
        return access.role_of(db, who, item.about.namespace) >= Role.READER

    # Transactions and the log

    def _reading(self) -> AbstractContextManager[sqlite3.Connection]:
        return tables.transaction(self._file)

    @contextmanager
    def _acting(self, who: User, did: str, to_what: str, *, refusals: bool = True) -> Iterator[sqlite3.Connection]:
        """A transaction that ends with a line in the log."""
        with self._noting(who.name, did, to_what, refusals=refusals), tables.transaction(self._file, write=True) as db:
            yield db
            self._add_entry(db, who.name, did, to_what, "")

    @contextmanager
    def _noting(self, user: str, did: str, to_what: str, *, refusals: bool = True) -> Iterator[None]:
        """What is refused is noted, with the reason."""
        try:
            yield
        except (AccessRefused, BadItem, NoSuchItem, OntologyRejected) as error:
            if refusals:
                self._note(user, did, to_what, str(error))
            raise

    def _note(self, user: str, did: str, to_what: str, refused: str = "") -> None:
        with tables.transaction(self._file, write=True) as db:
            self._add_entry(db, user, did, to_what, refused)

    def _add_entry(self, db: sqlite3.Connection, user: str, did: str, to_what: str, refused: str) -> None:
        texts = [text.encode(errors="replace").decode()[:_LONGEST_LOGGED] for text in (user, did, to_what, refused)]
        db.execute("INSERT INTO log (at, user, did, to_what, refused) VALUES (?, ?, ?, ?, ?)", (self._time(), *texts))
        if did == "enter":
            db.execute(_FORGET_ENTERS, (_ENTERS_LOGGED,))

    def _time(self) -> str:
        return self._now().isoformat(timespec="seconds")
