"""What robots have done, kept to learn from: tries of processes and recoveries, and trips, by trace.

A SQLite file, so that several runs may add to it at once. A trace counts once, however often it is given.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

_WAIT_S = 30.0
_SCHEMA = """
CREATE TABLE IF NOT EXISTS traces (sha256 TEXT PRIMARY KEY, site TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS tries (
    trace TEXT NOT NULL REFERENCES traces, process TEXT NOT NULL, robot TEXT NOT NULL, place TEXT NOT NULL,
    took_ms INTEGER NOT NULL, succeeded INTEGER NOT NULL, count INTEGER NOT NULL
);
CREATE TABLE IF NOT EXISTS trips (
    trace TEXT NOT NULL REFERENCES traces, process TEXT NOT NULL, robot TEXT NOT NULL, place TEXT NOT NULL,
    way_ms INTEGER NOT NULL, took_ms INTEGER NOT NULL
);
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tries:
    """Tries of a process, or of a recovery, that went alike.

    Attributes:
        robot: Who; empty for what needs no robot.
        place: Where it led to or took place: the location that it names, or else where the robot was; empty where
            that is not known.
        took_ms: Each of them.
        count: How many.
    """

    process: str
    robot: str
    place: str
    took_ms: int
    succeeded: bool
    count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Trip:
    """A process with a travel duration that led to its goal.

    Attributes:
        way_ms: Estimated by the service for travel times.
        took_ms: Measured, from its begin to its end.
    """

    process: str
    robot: str
    place: str
    way_ms: int
    took_ms: int


class Experience:
    """A file of tries and trips, by site."""

    def __init__(self, file: Path) -> None:
        """Open a file; where there is none, make one."""
        file.parent.mkdir(parents=True, exist_ok=True)
        self._file = file
        with self._transaction() as db:
            for statement in _SCHEMA.strip().split(";\n"):
                db.execute(statement)

    def add(self, trace: str, site: str, tries: Iterable[Tries], trips: Iterable[Trip]) -> bool:
        """Take in what a trace tells, all or nothing; False if it was there already.

        Args:
            trace: SHA-256 of its bytes.
        """
        with self._transaction() as db:
            if db.execute("SELECT 1 FROM traces WHERE sha256 = ?", (trace,)).fetchone():
                return False
            db.execute("INSERT INTO traces VALUES (?, ?)", (trace, site))
            db.executemany(
                "INSERT INTO tries VALUES (?, ?, ?, ?, ?, ?, ?)",
                [(trace, t.process, t.robot, t.place, t.took_ms, t.succeeded, t.count) for t in tries],
            )
            db.executemany(
                "INSERT INTO trips VALUES (?, ?, ?, ?, ?, ?)",
                [(trace, t.process, t.robot, t.place, t.way_ms, t.took_ms) for t in trips],
            )
        return True

    def traces(self, site: str) -> int:
        """How many traces of a site were taken in."""
        with self._transaction() as db:
            return int(db.execute("SELECT count(*) FROM traces WHERE site = ?", (site,)).fetchone()[0])

    def tries(self, site: str) -> list[Tries]:
        """All tries at a site, sorted; those of all traces that went alike together."""
        with self._transaction() as db:
            rows = db.execute(
                "SELECT process, robot, place, took_ms, succeeded, sum(count) FROM tries"
                " JOIN traces ON sha256 = trace WHERE site = ? GROUP BY 1, 2, 3, 4, 5 ORDER BY 1, 2, 3, 4, 5",
                (site,),
            )
            return [
                Tries(process=p, robot=r, place=at, took_ms=ms, succeeded=bool(ok), count=n)
                for p, r, at, ms, ok, n in rows
            ]

    def trips(self, site: str) -> list[Trip]:
        """All trips at a site, sorted."""
        with self._transaction() as db:
            rows = db.execute(
                "SELECT process, robot, place, way_ms, trips.took_ms FROM trips"
                " JOIN traces ON sha256 = trace WHERE site = ? ORDER BY 1, 2, 3, 4, 5",
                (site,),
            )
            return [Trip(process=p, robot=r, place=at, way_ms=way, took_ms=ms) for p, r, at, way, ms in rows]

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        with closing(sqlite3.connect(self._file, timeout=_WAIT_S, isolation_level=None)) as db:
            db.execute("BEGIN IMMEDIATE")
            try:
                yield db
            except BaseException:
                db.execute("ROLLBACK")
                raise
            db.execute("COMMIT")
