"""Who may do what on a rosbridge server, and how much: roles, signatures, limits."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest

from grounding.actions import GoalStatus
from grounding.rosbridge import hub_topics
from grounding.rosbridge.hub import AUTH_WAIT_S, Hub
from grounding.rosbridge.operations import Auth, written
from grounding.rosbridge.policy import Allowance, Policy, Role, signature
from grounding.rosbridge.types import Types
from kb.clock import SimClock
from tests.grounding.rosbridge.hub_client import Client, advance


@pytest.fixture(scope="module")
def types() -> Types:
    """The types, which take a while to read."""
    return Types(2)


@pytest.fixture
def clock() -> SimClock:
    """The time of a hub."""
    return SimClock()


_STRING = "std_msgs/String"


def _hub(types: Types, clock: SimClock, **options: object) -> Hub:
    return Hub(clock, types=types, **options)  # type: ignore[arg-type]


def _say(client: Client, *texts: str) -> None:
    for text in texts:
        client.send("publish", topic="/chat", msg={"data": text})


@pytest.mark.parametrize(
    ("op", "fields", "answer"),
    [
        ("subscribe", {"topic": "/secret", "type": _STRING}, "may not listen to topic /secret; it may: /amigo_*"),
        ("publish", {"topic": "/amigo_1/x", "msg": {}}, "may not publish on topic /amigo_1/x; it may: none"),
        ("advertise", {"topic": "amigo_1/x", "type": _STRING}, "may not publish on topic amigo_1/x"),
        ("call_service", {"service": "/pico_1/base"}, "may not call service /pico_1/base; it may: /amigo_*"),
        ("advertise_service", {"service": "/s", "type": "std_srvs/Empty"}, "may not offer service /s"),
        ("advertise_action", {"action": "/a", "type": "example_interfaces/Fibonacci"}, "may not offer action /a"),
        (
            "send_action_goal",
            {"action": "/a", "action_type": "example_interfaces/Fibonacci"},
            "may not use action /a; it may: none",
        ),
    ],
)
def test_what_a_role_may_not_do_is_answered(
    op: str, fields: dict[str, object], answer: str, types: Types, clock: SimClock
) -> None:
    """The answer is the one that its sender waits for, with the id and the reason."""
    role = Role(name="guest", subscribe=("/amigo_*",), publish=(), call=("/amigo_*",), act=(), offer=())
    client = Client(_hub(types, clock), clock, role)
    client.send(op, id="x", **fields)
    got = written(client.next()[0])
    assert got["id"] == "x"
    assert f"NotAllowed: role guest {answer}" in str(got.get("values", got.get("msg")))
    assert got.get("result", False) is False
    client.send("call_service", service="amigo_1/laser", id="y")  # allowed, though there is none
    assert "NoSuchService" in str(client.gets("service_response", id="y")["values"])


def test_auth_is_signed_of_now_and_in_time(types: Types, clock: SimClock) -> None:
    """A right signature gives the role of its level; a wrong one ends the connection, so does silence."""
    now = datetime(2026, 1, 1, tzinfo=UTC)
    policy = Policy(roles={"pilot": Role(name="pilot")}, secrets={"pilot": "hush"}, anybody="")
    hub = _hub(types, clock, policy=policy, calendar=lambda: now)
    fields = {"client": "c", "dest": "d", "rand": "r", "t": int(now.timestamp()), "level": "pilot"}
    fields["end"] = int(now.timestamp()) + 60
    mac = signature("hush", Auth(mac="", **fields))  # type: ignore[arg-type]
    right, wrong, silent = (Client(hub, clock) for _ in range(3))
    right.send("call_service", service="/rosapi/get_time", id="0")
    right.gets("service_response", id="0", result=False)
    right.send("auth", mac=mac, **fields)
    right.send("call_service", service="/rosapi/get_time", id="1")
    right.gets("service_response", id="1", result=True)
    wrong.send("auth", mac=mac[:-1] + ("0" if mac[-1] != "0" else "1"), **fields)
    assert wrong.closed == "auth failed"
    for field, seconds in (("t", -60), ("end", -1)):
        late = Client(hub, clock)
        past = {**fields, field: int(now.timestamp()) + seconds}
        late.send("auth", mac=signature("hush", Auth(mac="", **past)), **past)  # type: ignore[arg-type]
        assert late.closed == "auth failed"
    advance(clock, AUTH_WAIT_S)
    assert silent.closed.startswith("did not say within 10 s")
    assert not right.closed


def test_a_policy_names_only_roles_that_there_are() -> None:
    """A slip in a name is told when the policy is made."""
    with pytest.raises(ValueError, match="there is no role pilto; there are pilot"):
        Policy(roles={"pilot": Role(name="pilot")}, tokens={"00": "pilto"}, anybody="")


def test_more_messages_than_allowed_are_refused_until_time_has_passed(types: Types, clock: SimClock) -> None:
    """The call over the limit is answered; a second later the next is done."""
    policy = Policy(allowance=Allowance(messages_per_s=2.0))
    client = Client(_hub(types, clock, policy=policy), clock)
    for number in range(3):
        client.send("call_service", service="/rosapi/get_time", id=number)
    client.gets("service_response", id=0, result=True)
    client.gets("service_response", id=1, result=True)
    got = client.gets("service_response", id=2, result=False)
    assert got["values"] == "TooManyRequests: more than 2 messages/s come from /client_1"
    advance(clock, 1.0)
    client.send("call_service", service="/rosapi/get_time", id=3)
    client.gets("service_response", id=3, result=True)


def test_more_bytes_than_allowed_are_refused(types: Types, clock: SimClock) -> None:
    """A long frame is taken, and the next ones wait for it."""
    policy = Policy(allowance=Allowance(bytes_per_s=1000.0))
    client = Client(_hub(types, clock, policy=policy), clock)
    client.send("status", level="info", msg="x" * 1500)
    client.send("call_service", service="/rosapi/get_time", id=1)
    client.gets("service_response", id=1, result=False)
    advance(clock, 1.0)
    client.send("call_service", service="/rosapi/get_time", id=2)
    client.gets("service_response", id=2, result=True)


def test_a_client_holds_no_more_than_allowed(types: Types, clock: SimClock) -> None:
    """Subscriptions, offers and open calls count together; what ends is free again."""
    policy = Policy(allowance=Allowance(held=3))
    hub = _hub(types, clock, policy=policy)
    client = Client(hub, clock)
    client.send("advertise_service", service="/lamp", type="std_srvs/SetBool")
    client.send("subscribe", topic="/chat", type=_STRING, id="s1")
    client.send("call_service", service="/lamp", id="c1")
    asked = client.gets("call_service")
    client.send("subscribe", topic="/chat", id="s2")
    assert str(client.gets("status", level="error", id="s2")["msg"]).startswith("TooManyRequests")
    client.send("service_response", service="/lamp", id=asked["id"], result=True, values={})
    client.gets("service_response", id="c1")
    client.send("subscribe", topic="/chat", id="s2")
    assert not client.frames


def test_messages_that_wait_for_their_time_take_bounded_memory(types: Types, clock: SimClock) -> None:
    """However long the queue that is asked for, the oldest give way."""
    policy = Policy(allowance=Allowance(outbox_bytes=20_000))
    hub = _hub(types, clock, policy=policy)
    client = Client(hub, clock)
    for topic in ("/a", "/b"):
        client.send("advertise", topic=topic, type=_STRING)
        client.send("subscribe", topic=topic, throttle_rate=10_000, queue_length=1_000_000)
    for number in range(100):
        for topic in ("/a", "/b"):
            client.send("publish", topic=topic, msg={"data": f"{number}:" + "x" * 1000})
        assert client.session.throttled_bytes <= 20_000
    client.frames.clear()
    advance(clock, 1000.0)
    last = [written(client.next()[0]) for _ in range(len(client.frames))]
    assert 2 <= len(last) <= 20
    assert any(str(fields["msg"]).startswith("{'data': '99:") for fields in last)
    assert client.session.throttled_bytes == 0


def test_kept_messages_and_names_take_bounded_memory(
    types: Types, clock: SimClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Latched messages beyond the limit are refused, so are names and ids of excessive length."""
    monkeypatch.setattr(hub_topics, "_MOST_LATCHED_BYTES", 1000)
    client = Client(_hub(types, clock), clock)
    for topic in ("/a", "/b"):
        client.send("advertise", topic=topic, type=_STRING, latch=True)
        client.send("publish", topic=topic, msg={"data": "x" * 600}, id=topic)
    assert str(client.gets("status", id="/b")["msg"]).startswith("TooMuch: kept messages hold")
    client.send("publish", topic="/a", msg={"data": "y" * 600})  # takes the place of the first
    client.send("unadvertise", topic="/a")
    client.send("publish", topic="/b", msg={"data": "x" * 600})
    assert not client.frames
    client.send("advertise", topic="/" + "c" * 1000, type=_STRING)
    assert "field topic has 1001 characters, 1000 are allowed" in str(client.gets("status")["msg"])


def test_what_has_ended_counts_no_more(types: Types, clock: SimClock) -> None:
    """Calls, goals and subscriptions one after the other need room for one."""
    hub = _hub(types, clock, policy=Policy(allowance=Allowance(held=1)))
    hub.actions.offer(
        "/count", "example_interfaces/Fibonacci", lambda goal: goal.end(GoalStatus.SUCCEEDED, {"sequence": [1]})
    )
    client = Client(hub, clock)
    for number in range(3):
        client.send("call_service", service="/rosapi/get_time", id=number)
        client.gets("service_response", id=number, result=True)
        client.send("send_action_goal", action="/count", action_type="example_interfaces/Fibonacci", id=number)
        client.gets("action_result", id=number, result=True, values={"sequence": [1]})
        client.send("subscribe", topic="/rosout", id=number)
        client.send("unsubscribe", topic="/rosout", id=number)
        client.send("advertise", topic="/chat", type=_STRING)
        client.send("unadvertise", topic="/chat")
        client.send("advertise_service", service="/lamp", type="std_srvs/Empty")
        client.send("unadvertise_service", service="/lamp")
        client.send("advertise_action", action="/fib", type="example_interfaces/Fibonacci")
        client.send("unadvertise_action", action="/fib")
        assert not client.frames
