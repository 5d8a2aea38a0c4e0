"""The tables of the repository, in SQLite: rows <-> values. Whoever calls has opened a transaction."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from kb.repository.items import BadItem, Description, Item, ItemKind, StoredFile

_WAIT_S = 30.0
_FORMAT = 1
_SCHEMA = """
CREATE TABLE items (
    id INTEGER PRIMARY KEY, name TEXT NOT NULL, version INTEGER NOT NULL, kind TEXT NOT NULL, site TEXT NOT NULL,
    author TEXT NOT NULL, licence TEXT NOT NULL, description TEXT NOT NULL, created TEXT NOT NULL,
    uploaded_by TEXT NOT NULL, retired TEXT, superseded_by TEXT NOT NULL DEFAULT '', UNIQUE (name, version)
);
CREATE TABLE files (
    item INTEGER NOT NULL REFERENCES items, path TEXT NOT NULL, sha256 TEXT NOT NULL, size INTEGER NOT NULL,
    iri TEXT NOT NULL, PRIMARY KEY (item, path)
);
CREATE INDEX files_by_iri ON files (iri);
CREATE TABLE words (item INTEGER NOT NULL REFERENCES items, sort TEXT NOT NULL, word TEXT NOT NULL);
CREATE INDEX words_by_item ON words (item);
CREATE VIRTUAL TABLE texts USING fts5 (text);
CREATE TABLE users (name TEXT PRIMARY KEY, salt BLOB NOT NULL, hash BLOB NOT NULL);
CREATE TABLE grants (user TEXT NOT NULL, namespace TEXT NOT NULL, role INTEGER NOT NULL, PRIMARY KEY (user, namespace));
CREATE TABLE log (
    id INTEGER PRIMARY KEY, at TEXT NOT NULL, user TEXT NOT NULL, did TEXT NOT NULL, to_what TEXT NOT NULL,
    refused TEXT NOT NULL
);
"""


@contextmanager
def transaction(file: Path, *, write: bool = False) -> Iterator[sqlite3.Connection]:
    """A connection with a transaction: done whole at the end, or undone where an error leaves it.

    Writers wait for one another, also in other processes; readers never wait.
    """
    with closing(sqlite3.connect(file, timeout=_WAIT_S, isolation_level=None)) as db:
        db.execute("PRAGMA foreign_keys = ON")
        db.execute("PRAGMA synchronous = FULL")
        db.execute("BEGIN IMMEDIATE" if write else "BEGIN")
        try:
            yield db
        except UnicodeEncodeError as error:
            db.execute("ROLLBACK")
            raise BadItem(repr(error.object)[:64], "is no text: it holds half of a pair of surrogates") from error
        except BaseException:
            db.execute("ROLLBACK")
            raise
        db.execute("COMMIT")


def create(file: Path) -> None:
    """Make the tables where there are none."""
    with closing(sqlite3.connect(file, timeout=_WAIT_S, isolation_level=None)) as db:
        db.execute("PRAGMA journal_mode = WAL")
    with transaction(file, write=True) as db:
        [found] = db.execute("PRAGMA user_version").fetchone()
        if found == _FORMAT:
            return
        for statement in _SCHEMA.split(";\n"):
            db.execute(statement)
        db.execute(f"PRAGMA user_version = {_FORMAT}")


def insert(db: sqlite3.Connection, item: Item, text: str) -> None:
    """Add a version of an item.

    Args:
        text: What it is found by.
    """
    about = item.about
    values = (
        *(about.name, item.version, about.kind.value, about.site, about.author, about.licence, about.description),
        *(item.created, item.uploaded_by),
    )
    columns = "name, version, kind, site, author, licence, description, created, uploaded_by"
    row = db.execute(f"INSERT INTO items ({columns}) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", values).lastrowid
    db.executemany(
        "INSERT INTO files VALUES (?, ?, ?, ?, ?)", [(row, f.path, f.sha256, f.size, f.iri) for f in item.files]
    )
    sorts = (("tag", about.tags), ("needs", item.needs), ("capability", item.capabilities))
    words = [(row, sort, word) for sort, group in sorts for word in group]
    db.executemany("INSERT INTO words VALUES (?, ?, ?)", words)
    db.execute("INSERT INTO texts (rowid, text) VALUES (?, ?)", (row, text))


def select(db: sqlite3.Connection, where: str, values: tuple[object, ...], rest: str = "") -> list[Item]:
    """Items, by a condition on columns; sorted by name, then from the newest version to the oldest."""
    return list(each(db, where, values, rest))


def each(db: sqlite3.Connection, where: str, values: tuple[object, ...], rest: str = "") -> Iterator[Item]:
    """As `select`, but each item is read when it is asked for."""
    rows = db.execute(
        "SELECT id, name, kind, site, author, licence, description, version, created, uploaded_by, retired,"
        f" superseded_by FROM items WHERE {where} ORDER BY name, version DESC {rest}",
        values,
    ).fetchall()
    for row in rows:
        yield _item(db, row)


def _item(db: sqlite3.Connection, row: tuple[object, ...]) -> Item:
    key, name, kind, site, author, licence, description, version, created, uploaded_by, retired, superseded_by = row
    words: dict[str, list[str]] = {}
    for sort, word in db.execute("SELECT sort, word FROM words WHERE item = ? ORDER BY word", (key,)):
        words.setdefault(sort, []).append(word)
    files = db.execute("SELECT path, sha256, size, iri FROM files WHERE item = ? ORDER BY path", (key,))
    return Item(
        about=Description(
            name=str(name),
            kind=ItemKind(str(kind)),
            site=str(site),
            author=str(author),
            licence=str(licence),
            description=str(description),
            tags=tuple(words.get("tag", ())),
        ),
        version=int(str(version)),
        created=str(created),
        uploaded_by=str(uploaded_by),
        files=tuple(StoredFile(path=p, sha256=h, size=s, iri=i) for p, h, s, i in files),
        needs=tuple(words.get("needs", ())),
        capabilities=tuple(words.get("capability", ())),
        retired=None if retired is None else str(retired),
        superseded_by=str(superseded_by),
    )
