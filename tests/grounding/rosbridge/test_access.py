"""Files that say who may use a server."""

from __future__ import annotations

from pathlib import Path

import pytest

from grounding.rosbridge.access import Access, BadAccess, read_access
from grounding.rosbridge.operations import CallService, Publish, SendActionGoal, Subscribe
from tests.grounding.rosbridge.certificates import self_signed

WATCHER = '[roles.watcher]\nsubscribe = ["*"]\ncall = ["/rosapi/*"]\n'
EXECUTIVE = '[roles.executive]\ntoken_variable = "TOKEN"\npublish = ["/amigo_1/*"]\ncall = ["*"]\n'


def read(folder: Path, text: str) -> Access:
    """What a file of this text says, where one variable is set."""
    file = folder / "access.toml"
    file.write_text(text, encoding="utf-8")
    return read_access(file, {"TOKEN": "hush", "SAME": "hush", "EMPTY": ""})


def test_a_role_may_do_what_is_listed_and_nothing_else(tmp_path: Path) -> None:
    """Clients without a token are of the role that is said, and others of that of their token."""
    policy = read(tmp_path, f'anybody = "watcher"\n{WATCHER}{EXECUTIVE}').policy
    watcher, executive = policy.default_role, policy.role_of_token("hush")
    assert watcher is not None
    assert executive is not None
    call, hear = CallService(service="/amigo_1/base"), Subscribe(topic="/amigo_1/scan")
    say = Publish(topic="/amigo_1/cmd_vel", msg={})
    assert watcher.objection(hear) == ""
    assert watcher.objection(call) == "role watcher may not call service /amigo_1/base; it may: /rosapi/*"
    assert executive.objection(call) == executive.objection(say) == ""
    assert "it may: none" in executive.objection(hear)
    assert "it may: none" in executive.objection(SendActionGoal(action="/amigo_1/go", action_type="x/Y"))
    assert policy.role_of_token("guess") is None


def test_nobody_may_do_anything_without_a_token_where_nothing_is_said(tmp_path: Path) -> None:
    """What is left out is closed; limits are the usual ones."""
    access = read(tmp_path, EXECUTIVE)
    assert access.policy.default_role is None
    assert (access.tls, access.clients, access.policy.allowance) == (None, 1000, Access().policy.allowance)


def test_limits_are_each_client_s(tmp_path: Path) -> None:
    """Those that are given; the others stay."""
    limits = "[limits]\nmessages_per_s = 50\nbytes_per_s = 1e6\nframe_bytes = 2000\nheld = 7\nclients = 3\n"
    access = read(tmp_path, WATCHER + limits)
    allowance = access.policy.allowance
    assert (allowance.messages_per_s, allowance.bytes_per_s, allowance.held) == (50.0, 1e6, 7)
    assert (allowance.frame.max_bytes, access.clients) == (2000, 3)


def test_certificates_are_beside_the_file(tmp_path: Path) -> None:
    """By their names."""
    certificate_file, key_file = self_signed(tmp_path)
    tls = f'[tls]\ncertificate_file = "{certificate_file.name}"\nkey_file = "{key_file.name}"\n'
    assert read(tmp_path, WATCHER + tls).tls is not None


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "roles: missing"),
        (f'anybody = "guest"\n{WATCHER}', "anybody: unknown: 'guest'; known are watcher"),
        ('[roles.watcher]\nlisten = ["*"]\n', "roles.watcher.listen: unknown field"),
        ('[roles.watcher]\nsubscribe = "*"\n', "roles.watcher.subscribe: '.' is not a list of texts"),
        ('[roles.a]\ntoken_variable = "NONE"\n', "roles.a.token_variable: NONE is not set in the environment"),
        ('[roles.a]\ntoken_variable = "EMPTY"\n', "roles.a.token_variable: EMPTY is not set in the environment"),
        (
            EXECUTIVE + '[roles.other]\ntoken_variable = "SAME"\n',
            "roles.other.token_variable: executive has the same token",
        ),
        (WATCHER + '[tls]\ncertificate_file = "no.pem"\nkey_file = "no.key"\n', "tls.certificate_file: there is no"),
        (
            WATCHER + '[tls]\ncertificate_file = "access.toml"\nkey_file = "access.toml"\n',
            "tls.certificate_file: is no certificate in PEM with the key in key_file",
        ),
        (WATCHER + "[limits]\nheld = 0\n", "limits.held: 0 is not a whole number >= 1"),
        ("roles", "is not TOML"),
    ],
)
def test_a_wrong_file_is_refused(text: str, told: str, tmp_path: Path) -> None:
    """With its name, the field, and what would be right."""
    with pytest.raises(BadAccess, match=told) as error:
        read(tmp_path, text)
    assert "access.toml" in str(error.value)
    assert "hush" not in str(error.value)
