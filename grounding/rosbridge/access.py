"""Who may use a rosbridge server, and how: a TOML file.

anybody = "watcher"                  # the role of clients without a token; left out: they may do nothing

[roles.watcher]                      # globs over full names; what is not listed is not allowed
subscribe = ["*"]
call = ["/rosapi/*"]

[roles.executive]
token_variable = "EXECUTIVE_TOKEN"   # of the environment: the token that gives this role
subscribe = ["*"]
publish = ["/amigo_1/*"]
call = ["*"]
act = ["*"]
offer = ["/compute/*"]

[tls]                                # then the address is wss://
certificate_file = "server.pem"      # beside this file
key_file = "server.key"

[limits]                             # of each client, where others than the usual ones shall hold
messages_per_s = 500.0
bytes_per_s = 20000000.0
frame_bytes = 10000000
held = 1000                          # subscriptions, offers, open calls and goals together
clients = 100
"""

from __future__ import annotations

import hashlib
import ssl
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from grounding.rosbridge.framing import Limits
from grounding.rosbridge.policy import Allowance, Policy, Role
from kb.errors import BadFile
from kb.section import Section, read_file

_DEEDS = ("subscribe", "publish", "call", "act", "offer")


class BadAccess(BadFile):
    """A file that says who may use a server is wrong."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """Who may use a server.

    Attributes:
        tls: With the certificate; None for connections in clear.
        clients: At a time.
    """

    policy: Policy = field(default_factory=Policy)
    tls: ssl.SSLContext | None = None
    clients: int = 1000


def read_access(file: Path, environment: Mapping[str, str]) -> Access:
    """Read the file.

    Args:
        environment: The variables that are set.

    Raises:
        BadAccess: It is wrong, names a variable that is not set, or certificates that cannot be read.
    """
    top = read_file(file, BadAccess)
    roles, tokens = dict[str, Role](), dict[str, str]()
    for name, section in top.sections("roles"):
        if section.has("token_variable"):
            variable = section.text("token_variable")
            if not environment.get(variable):
                raise section.fault("token_variable", f"{variable} is not set in the environment")
            digest = hashlib.sha256(environment[variable].encode()).hexdigest()
            if digest in tokens:
                raise section.fault("token_variable", f"{tokens[digest]} has the same token; each role has its own")
            tokens[digest] = name
        roles[name] = Role(name=name, **{deed: section.texts(deed) if section.has(deed) else () for deed in _DEEDS})
        section.end()
    anybody = top.text("anybody", choices=roles) if top.has("anybody") else ""
    tls = _tls(top.section("tls"), file.parent) if top.has("tls") else None
    usual = Access()
    allowance, clients = usual.policy.allowance, usual.clients
    if top.has("limits"):
        allowance, clients = _limits(top.section("limits"), allowance, clients)
    top.end()
    policy = Policy(roles=roles, tokens=tokens, anybody=anybody, allowance=allowance)
    return Access(policy=policy, tls=tls, clients=clients)


def _tls(section: Section, folder: Path) -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    certificate_file, key_file = (folder / section.text(name) for name in ("certificate_file", "key_file"))
    section.end()
    for name, file in (("certificate_file", certificate_file), ("key_file", key_file)):
        if not file.is_file():
            raise section.fault(name, f"there is no file {file}")
    try:
        context.load_cert_chain(certificate_file, key_file)
    except (ssl.SSLError, OSError) as error:
        told = error.strerror or str(error)
        raise section.fault("certificate_file", f"is no certificate in PEM with the key in key_file: {told}") from error
    return context


def _limits(section: Section, usual: Allowance, clients: int) -> tuple[Allowance, int]:
    frame_bytes = section.integer("frame_bytes", low=1) if section.has("frame_bytes") else usual.frame.max_bytes
    allowance = replace(
        usual,
        frame=Limits(max_bytes=frame_bytes),
        messages_per_s=section.number("messages_per_s", low=0.1) if section.has("messages_per_s") else None,
        bytes_per_s=section.number("bytes_per_s", low=1.0) if section.has("bytes_per_s") else None,
        held=section.integer("held", low=1) if section.has("held") else usual.held,
    )
    clients = section.integer("clients", low=1) if section.has("clients") else clients
    section.end()
    return allowance, clients
