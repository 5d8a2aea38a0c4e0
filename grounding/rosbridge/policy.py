"""Who may do what on a rosbridge server, and how much.

A client is of a role: by a token when it connects, by the operation `auth`, or as anybody. A role lists by globs the
names of topics, services and actions that it may use. What it may not do is answered, never passed over in silence.
"""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

from grounding.rosbridge.framing import Limits
from grounding.rosbridge.operations import (
    Advertise,
    AdvertiseAction,
    AdvertiseService,
    Auth,
    CallService,
    CancelActionGoal,
    Operation,
    Publish,
    SendActionGoal,
    Subscribe,
)

_EVERYTHING = ("*",)
_SKEW_S = 5.0


def resolved(name: str) -> str:
    """The full name of a topic, service or action: clients have no name space, so `chat` is `/chat`."""
    return name if name.startswith("/") else f"/{name}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Role:
    """What clients of a kind may do, by globs over full names, such as `/amigo_*/scan`; `*` also spans slashes.

    Attributes:
        subscribe: Topics that it may listen to.
        publish: Topics on which it may publish.
        call: Services that it may call, those of rosapi included.
        act: Actions to which it may send goals.
        offer: Services and actions that it may offer itself.
    """

    name: str
    subscribe: tuple[str, ...] = _EVERYTHING
    publish: tuple[str, ...] = _EVERYTHING
    call: tuple[str, ...] = _EVERYTHING
    act: tuple[str, ...] = _EVERYTHING
    offer: tuple[str, ...] = _EVERYTHING

    def objection(self, operation: Operation) -> str:
        """Why this role may not do the operation; empty if it may."""
        match operation:
            case Subscribe():
                return self._of(self.subscribe, "listen to topic", operation.topic)
            case Advertise() | Publish():
                return self._of(self.publish, "publish on topic", operation.topic)
            case CallService():
                return self._of(self.call, "call service", operation.service)
            case SendActionGoal() | CancelActionGoal():
                return self._of(self.act, "use action", operation.action)
            case AdvertiseService():
                return self._of(self.offer, "offer service", operation.service)
            case AdvertiseAction():
                return self._of(self.offer, "offer action", operation.action)
            case _:  # ends something of the client's own, or answers what it was asked
                return ""

    def _of(self, globs: tuple[str, ...], deed: str, name: str) -> str:
        if any(fnmatchcase(resolved(name), glob) for glob in globs):
            return ""
        return f"role {self.name} may not {deed} {name}; it may: {', '.join(globs) or 'none'}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Allowance:
    """How much a client may take.

    Attributes:
        frame: Of one frame, and of those that come in fragments.
        messages_per_s: On average; as many may come at once. None: no limit.
        bytes_per_s: Likewise. One frame may be longer: the next has then to wait.
        held: Subscriptions, advertisements, offers, open calls and goals of a client together.
        outbox_bytes: What waits to be sent; topics lose their oldest messages beyond it.
        most_outbox_bytes: Beyond this the connection is closed: the client reads no replies.
    """

    frame: Limits = field(default_factory=Limits)
    messages_per_s: float | None = None
    bytes_per_s: float | None = None
    held: int = 1000
    outbox_bytes: int = 32_000_000
    most_outbox_bytes: int = 128_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Policy:
    """The roles, and who is of which.

    Attributes:
        roles: By their names.
        tokens: Role by the SHA-256, in hexadecimal, of each token: the tokens themselves are kept nowhere.
        secrets: Secret by role, for `auth` as rosauth signs it.
        anybody: Role of clients that do not say who they are; empty if they have to.
    """

    roles: Mapping[str, Role] = field(default_factory=lambda: {"anybody": Role(name="anybody")})
    tokens: Mapping[str, str] = field(default_factory=dict)
    secrets: Mapping[str, str] = field(default_factory=dict)
    anybody: str = "anybody"
    allowance: Allowance = field(default_factory=Allowance)

    def __post_init__(self) -> None:
        named = {*self.tokens.values(), *self.secrets, *([self.anybody] if self.anybody else [])}
        if missing := sorted(named - set(self.roles)):
            raise ValueError(f"there is no role {missing[0]}; there are {', '.join(sorted(self.roles)) or 'none'}")

    @property
    def default_role(self) -> Role | None:
        """Of clients that do not say who they are; None if they have to."""
        return self.roles[self.anybody] if self.anybody else None

    def role_of_token(self, token: str) -> Role | None:
        """The role that a token gives, or None."""
        digest = hashlib.sha256(token.encode()).hexdigest()
        return self.roles[self.tokens[digest]] if digest in self.tokens else None

    def role_of_signature(self, auth: Auth, now_s: float) -> Role | None:
        """The role named `level`, if the operation is signed with its secret and of now, as rosauth does it.

        Who overhears it may use it too within some seconds: this needs TLS, as tokens do.

        Args:
            now_s: Seconds since 1970.
        """
        secret = self.secrets.get(auth.level)
        if secret is None or abs(auth.t - now_s) > _SKEW_S or auth.end < now_s:
            return None
        return self.roles[auth.level] if hmac.compare_digest(signature(secret, auth), auth.mac) else None


def signature(secret: str, auth: Auth) -> str:
    """The field `mac` of `auth`: SHA-512 of the secret and the other fields, times in whole seconds (as rosauth)."""
    fields = (secret, auth.client, auth.dest, auth.rand, int(auth.t), auth.level, int(auth.end))
    return hashlib.sha512("".join(map(str, fields)).encode()).hexdigest()
