"""Who may do what: users, their tokens, and their roles in namespaces.

A token is shown once and kept as a salted hash, so that whoever reads the files of the repository learns none. It is
256 random bits, which nobody can try out, so SHA-256 does: a hash that is slow on purpose would only help who floods
us. A role holds for a namespace, or for all of them (`*`); the user `anyone` stands for everybody.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
import sqlite3
from dataclasses import dataclass
from enum import IntEnum

from kb.errors import ConcertmasterError

ANYONE = "anyone"
EVERYWHERE = "*"
_USER = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.@-]{0,63}")
_SCOPE = re.compile(r"\*|[a-z0-9][a-z0-9_-]{0,63}")
_NOBODY = b"\0" * 32


class Role(IntEnum):
    """What a user may do in a namespace; each role includes those before it."""

    NONE = 0
    READER = 1
    """Search, look at and download."""
    CONTRIBUTOR = 2
    """Upload new items, and new versions of own ones; retire these."""
    CURATOR = 3
    """Upload, retire and restore whatever there is; say who may do what."""

    def __str__(self) -> str:
        return self.name.lower()


class AccessRefused(ConcertmasterError):
    """A user may not do something; nothing was done.

    Attributes:
        user: Who.
        reason: Why not.
    """

    fault = "request"

    def __init__(self, user: str, reason: str) -> None:
        self.user, self.reason = user, reason
        super().__init__(f"{user}: {reason}")


@dataclass(frozen=True, slots=True, kw_only=True)
class User:
    """Somebody who has proven who they are.

    Attributes:
        owns: Whoever holds the files of the repository themselves may do everything.
    """

    name: str
    owns: bool = False


def add_user(db: sqlite3.Connection, name: str) -> str:
    """Take in a user, or give one that there is a new token; returns the token.

    Raises:
        AccessRefused: It is no name for a user.
    """
    if not _USER.fullmatch(name) or name == ANYONE:
        raise AccessRefused(name[:64], "is no name for a user; take letters, digits and _ . @ -")
    token, salt = secrets.token_urlsafe(32), secrets.token_bytes(16)
    db.execute(
        "INSERT OR REPLACE INTO users VALUES (?, ?, ?)",
        (name, salt, _hashed(token, salt)),
    )
    return token


def remove_user(db: sqlite3.Connection, name: str) -> None:
    """Take a user away, with all roles; what they have uploaded stays.

    Raises:
        AccessRefused: There is no such user.
    """
    if not db.execute("DELETE FROM users WHERE name = ?", (name,)).rowcount:
        raise AccessRefused(name[:64], "is no user")
    db.execute("DELETE FROM grants WHERE user = ?", (name,))


def enter(db: sqlite3.Connection, name: str, token: str) -> User:
    """The user whose token this is; it takes as long whether there is such a user or not.

    Raises:
        AccessRefused: There is no such user, or it is not their token.
    """
    known = bool(_USER.fullmatch(name))
    row = db.execute("SELECT salt, hash FROM users WHERE name = ?", (name if known else "",)).fetchone()
    salt, kept = row or (_NOBODY, _NOBODY)
    if not hmac.compare_digest(_hashed(token, salt), kept):
        raise AccessRefused(name[:64], "this user and this token do not belong together")
    return User(name=name)


def grant(db: sqlite3.Connection, name: str, namespace: str, role: Role) -> None:
    """Give a user a role in place of the one they had.

    Raises:
        AccessRefused: There is no such user, or it is no namespace.
    """
    known = db.execute("SELECT 1 FROM users WHERE name = ?", (name,)).fetchone()
    if name != ANYONE and known is None:
        raise AccessRefused(name[:64], "is no user; add them first")
    if not _SCOPE.fullmatch(namespace):
        raise AccessRefused(name, f"{namespace!r} is no namespace; take small letters, digits, _ and -, or * for all")
    if name == ANYONE and role > Role.READER:
        raise AccessRefused(name, f"not everybody can be {role}; give single users that role")
    db.execute("DELETE FROM grants WHERE user = ? AND namespace = ?", (name, namespace))
    if role is not Role.NONE:
        db.execute("INSERT INTO grants VALUES (?, ?, ?)", (name, namespace, int(role)))


def role_of(db: sqlite3.Connection, user: User, namespace: str) -> Role:
    """The greatest role that a user has in a namespace."""
    if user.owns:
        return Role.CURATOR
    [highest] = db.execute(
        "SELECT max(role) FROM grants WHERE user IN (?, ?) AND namespace IN (?, ?)",
        (user.name, ANYONE, namespace, EVERYWHERE),
    ).fetchone()
    return Role(highest or 0)


def require(db: sqlite3.Connection, user: User, namespace: str, role: Role, what: str) -> None:
    """Go on if the user may.

    Args:
        what: They want to do, for the message.

    Raises:
        AccessRefused: They may not.
    """
    held = role_of(db, user, namespace)
    if held < role:
        told = f"is {held} there" if held else "has no role there"
        raise AccessRefused(user.name, f"may not {what}: that takes a {role} of {namespace}, and {user.name} {told}")


def _hashed(token: str, salt: bytes) -> bytes:
    return hashlib.sha256(salt + token.encode(errors="replace")).digest()
