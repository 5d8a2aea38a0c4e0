"""The rosbridge server without sockets: the exchanges of the protocol, roles, limits, timeouts, throttling."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache, partial

import cbor2
import orjson
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grounding.actions import GoalStatus
from grounding.messages import Twist
from grounding.rosbridge.hub import Hub
from grounding.rosbridge.hub_actions import RunningGoal
from grounding.rosbridge.operations import OPERATIONS, Operation, Status, written
from grounding.rosbridge.types import Types
from grounding.rosbridge.values import default
from kb.clock import SimClock
from kb.errors import ServiceFailed
from tests.grounding.rosbridge.exchanges import EXCHANGES, Exchange, Gets, Leaves, Sends, filled_in, matches
from tests.grounding.rosbridge.hub_client import Client, advance


@pytest.fixture(scope="module")
def types() -> Types:
    """The types, which take a while to read."""
    return Types(2)


@pytest.fixture
def clock() -> SimClock:
    """The time of a hub."""
    return SimClock()


@pytest.mark.parametrize("exchange", EXCHANGES, ids=lambda exchange: f"{'-'.join(exchange.ops)}: {exchange.name}")
def test_exchange(exchange: Exchange, types: Types, clock: SimClock) -> None:
    """The hub answers each exchange of the protocol as it should."""
    hub = Hub(clock, types=types)
    clients = {name: Client(hub, clock) for name in "ABC"}
    saved: dict[str, object] = {}
    for step in exchange.steps:
        client = clients[step.client]
        match step:
            case Sends():
                frame = step.frame
                if frame is None:
                    frame = orjson.dumps(filled_in(step.fields, saved)).decode()
                hub.take(client.session, frame)
            case Gets():
                got, encoding = _passing_over(client, step, saved)
                assert matches(step.fields, written(got), saved), f"expected {step.fields}, got {written(got)}"
                assert encoding == step.encoding
                if step.save is not None:
                    saved[step.save] = getattr(got, "id", None)
            case Leaves():
                client.leave()
    for client in clients.values():
        while client.frames:
            left, _ = client.next()
            assert isinstance(left, Status), left
            assert left.level in ("info", "warning"), left


def _passing_over(client: Client, step: Gets, saved: Mapping[str, object]) -> tuple[Operation, str]:
    """The next operation but for status messages that may come at any time."""
    while True:
        got, encoding = client.next()
        if isinstance(got, Status) and got.level != "error" and not matches(step.fields, written(got), saved):
            continue
        return got, encoding


_STRING = "std_msgs/String"


def _hub(types: Types, clock: SimClock, **options: object) -> Hub:
    return Hub(clock, types=types, **options)  # type: ignore[arg-type]


def _say(client: Client, *texts: str) -> None:
    for text in texts:
        client.send("publish", topic="/chat", msg={"data": text})


def test_a_call_that_is_not_answered_in_time_fails_and_its_late_reply_is_told_to_be_so(
    types: Types, clock: SimClock
) -> None:
    """The caller's own timeout counts, else the hub's."""
    hub = _hub(types, clock, call_timeout_s=60.0)
    caller, provider = Client(hub, clock), Client(hub, clock)
    provider.send("advertise_service", service="/lamp", type="std_srvs/SetBool")
    caller.send("call_service", service="/lamp", id="soon", timeout=2.0)
    caller.send("call_service", service="/lamp", id="late")
    asked = provider.gets("call_service")
    advance(clock, 1.9)
    assert not caller.frames
    advance(clock, 2.0)
    caller.gets("service_response", id="soon", result=False)
    provider.send("service_response", service="/lamp", id=asked["id"], result=True, values={})
    provider.gets("call_service")
    provider.gets("status", level="warning", id=asked["id"])
    advance(clock, 60.0)
    got = caller.gets("service_response", id="late", result=False)
    assert got["values"] == "TimedOut: service /lamp did not answer within 60 s"
    assert hub.services.open_calls == 0


def test_a_function_of_this_process_answers_after_its_latency_or_says_its_failure(
    types: Types, clock: SimClock
) -> None:
    """The class of the failure stands before the reason, for those who map it."""
    hub = _hub(types, clock)

    def drive(request: Mapping[str, object]) -> Mapping[str, object]:
        velocity = request["velocity"]
        assert isinstance(velocity, Twist)
        if velocity.linear.x > 1.0:
            raise ServiceFailed("TooFast", "the limit is 1 m/s")
        return {"speed": velocity.linear.x}

    hub.offer_service("/drive_by", {"velocity": "geometry_msgs/Twist"}, {"speed": "float64"}, drive, 0.5)
    client = Client(hub, clock)
    client.send("call_service", service="/drive_by", id="1", args={"velocity": {"linear": {"x": 0.25}}})
    advance(clock, 0.4)
    assert not client.frames
    advance(clock, 0.5)
    client.gets("service_response", id="1", result=True, values={"speed": 0.25})
    client.send("call_service", service="/drive_by", id="2", args={"velocity": {"linear": {"x": 2}}})
    client.send("call_service", service="/drive_by", id="3", timeout=0.1)
    advance(clock, 2.0)
    client.gets(
        "service_response", id="3", result=False, values="TimedOut: service /drive_by did not answer within 0.1 s"
    )
    client.gets("service_response", id="2", result=False, values="TooFast: the limit is 1 m/s")


def test_a_service_that_answers_with_another_type_is_told_to_its_caller(types: Types, clock: SimClock) -> None:
    """The reply is not sent on as it is."""
    hub = _hub(types, clock)
    hub.services.offer("/broken", "std_srvs/SetBool", lambda _: {"success": "yes"})
    client = Client(hub, clock)
    client.send("call_service", service="/broken", id="1")
    got = client.gets("service_response", id="1", result=False)
    assert got["values"] == "BadReply: /broken: success is 'yes', should be true or false"


def test_throttled_messages_wait_in_a_queue_or_are_lost(types: Types, clock: SimClock) -> None:
    """With a queue the newest are sent one by one at the rate; without, what comes too early is lost."""
    hub = _hub(types, clock)
    speaker, queued, lossy = (Client(hub, clock) for _ in range(3))
    speaker.send("advertise", topic="/chat", type=_STRING)
    queued.send("subscribe", topic="/chat", throttle_rate=100, queue_length=2)
    lossy.send("subscribe", topic="/chat", throttle_rate=100)
    _say(speaker, "a", "b", "c", "d")
    for client in (queued, lossy):
        client.gets("publish", msg={"data": "a"})
        assert not client.frames
    advance(clock, 0.1)
    queued.gets("publish", msg={"data": "c"})
    assert not queued.frames
    _say(speaker, "e")
    lossy.gets("publish", msg={"data": "e"})
    advance(clock, 0.35)
    queued.gets("publish", msg={"data": "d"})
    queued.gets("publish", msg={"data": "e"})
    assert not queued.frames
    assert not lossy.frames


def test_of_several_subscriptions_the_quickest_and_smallest_count(types: Types, clock: SimClock) -> None:
    """The lowest throttle rate and fragment size of those that are left."""
    hub = _hub(types, clock)
    client = Client(hub, clock)
    client.send("subscribe", topic="/chat", type=_STRING, id="slow", throttle_rate=1000)
    client.send("subscribe", topic="/chat", id="quick", fragment_size=20)
    client.send("advertise", topic="/chat", type=_STRING)
    _say(client, "a", "b")
    for text in "ab":
        operation, encoding = client.next()
        assert (written(operation)["msg"], encoding) == ({"data": text}, "fragment")
    client.send("unsubscribe", topic="/chat", id="quick")
    _say(client, "c", "d")
    advance(clock, 5.0)
    _say(client, "e")
    assert [written(client.next()[0])["msg"] for _ in range(2)] == [{"data": "c"}, {"data": "e"}]
    assert not client.frames


def test_topics_of_this_process(types: Types, clock: SimClock) -> None:
    """It publishes, keeps the newest message for who comes later, and hears what clients publish."""
    hub = _hub(types, clock)
    hub.topics.offer("/state", _STRING, latch=True)
    message = default(_STRING, types=types)
    hub.topics.say("/state", message)
    heard: list[object] = []
    end = hub.topics.listen("/chat", _STRING, heard.append)
    client = Client(hub, clock)
    assert not hub.topics.is_heard("/state")
    client.send("subscribe", topic="/state")
    client.gets("publish", topic="/state", msg={"data": ""})
    assert hub.topics.is_heard("/state")
    _say(client, "hello")
    assert [getattr(one, "data", None) for one in heard] == ["hello"]
    end()
    client.send("publish", topic="/chat", msg={"data": "nobody"}, id="p1")
    client.gets("status", id="p1", level="error")
    assert len(heard) == 1


def test_who_leads_a_hub_is_told_who_publishes_and_listens(types: Types, clock: SimClock) -> None:
    """At once, with whether messages are kept; and what it offered no more is gone."""
    hub = _hub(types, clock)
    seen: list[tuple[int, int, bool]] = []

    def look() -> None:
        chats = [topic for topic in hub.topics.told() if topic.name == "/chat"]
        seen.append((len(chats[0].publishers), len(chats[0].subscribers), chats[0].latched) if chats else (0, 0, False))

    hub.topics.changed = look
    client = Client(hub, clock)
    client.send("subscribe", topic="/chat", type="std_msgs/String")
    client.send("advertise", topic="/chat", type="std_msgs/String", latch=True)
    client.send("unsubscribe", topic="/chat")
    client.leave()
    assert seen == [(0, 1, False), (1, 1, True), (1, 0, True), (0, 0, False)]
    hub.topics.offer("/chat", _STRING)
    hub.topics.withdraw("/chat")
    assert "/chat" not in [topic.name for topic in hub.topics.told()]


def test_who_speaks_is_told_when_somebody_begins_to_listen(types: Types, clock: SimClock) -> None:
    """A client, once; or one that was there before the topic was offered."""
    hub, begun = _hub(types, clock), list[str]()
    client, other = Client(hub, clock), Client(hub, clock)
    client.send("subscribe", topic="/early", type=_STRING)
    for topic in ("/early", "/late"):
        hub.topics.offer(topic, _STRING, begun=partial(begun.append, topic))
    assert begun == ["/early"]
    for _ in range(2):
        client.send("subscribe", topic="/late", type=_STRING)
    other.send("subscribe", topic="/late", type=_STRING)
    assert begun == ["/early", "/late", "/late"]
    hub.topics.listen("/late", _STRING, lambda message: None)
    assert begun[3:] == ["/late"]


def test_what_is_there_and_out_of_reach_is_told_with_the_reason(types: Types, clock: SimClock) -> None:
    """In place of the word that there is nothing."""
    hub = _hub(types, clock)
    hub.services.out_of_reach = {"/dock": "there is a service /dock, but it cannot be used"}
    hub.actions.out_of_reach = {"/drive": "there is an action /drive, but it cannot be used"}
    client = Client(hub, clock)
    client.send("call_service", service="dock", id="c1")
    client.gets(
        "service_response", id="c1", result=False, values=f"NoSuchService: {hub.services.out_of_reach['/dock']}"
    )
    client.send("send_action_goal", action="/drive", action_type="example_interfaces/Fibonacci", id="g1")
    client.gets("action_result", id="g1", values=f"NoSuchAction: {hub.actions.out_of_reach['/drive']}")


def test_an_action_of_this_process_gives_feedback_and_one_result(types: Types, clock: SimClock) -> None:
    """What is told after the end is passed over; a cancel reaches who carries it out."""
    hub = _hub(types, clock)
    goals: list[RunningGoal] = []
    hub.actions.offer("/count", "example_interfaces/Fibonacci", goals.append)
    client = Client(hub, clock)
    goal = {"action": "/count", "action_type": "example_interfaces/Fibonacci", "args": {"order": 3}}
    client.send("send_action_goal", id="g1", feedback=True, **goal)
    client.send("send_action_goal", id="g1", **goal)
    got = client.gets("action_result", id="g1", result=False)
    assert got["values"] == "BadRequest: a goal of /count with id g1 has not ended yet"
    goals[0].feed({"sequence": [0, 1]})
    client.gets("action_feedback", id="g1", values={"sequence": [0, 1]})
    goals[0].canceled = lambda: goals[0].end(GoalStatus.CANCELED, {"sequence": [0]})
    client.send("cancel_action_goal", action="/count", id="g1")
    client.gets("action_result", id="g1", status=5, result=True, values={"sequence": [0]})
    goals[0].feed({"sequence": []})
    goals[0].end(GoalStatus.SUCCEEDED, {"sequence": []})
    assert not client.frames
    client.send("send_action_goal", id="g2", **goal)
    goals[1].end(GoalStatus.ABORTED, {}, "Blocked: the door is closed")
    client.gets("action_result", id="g2", status=6, result=False, values="Blocked: the door is closed")


def test_the_goals_of_a_client_that_leaves_are_canceled(types: Types, clock: SimClock) -> None:
    """Nobody would hear of them; the provider's result is then taken without an error."""
    hub = _hub(types, clock)
    sender, provider = Client(hub, clock), Client(hub, clock)
    provider.send("advertise_action", action="/count", type="example_interfaces/Fibonacci")
    sender.send("send_action_goal", action="/count", action_type="example_interfaces/Fibonacci", id="g1")
    goal = provider.gets("send_action_goal")
    sender.leave()
    provider.gets("cancel_action_goal", id=goal["id"])
    provider.send("action_result", action="/count", id=goal["id"], status=5, result=True, values={})
    assert not provider.frames
    assert hub.actions.open_goals == 0


def test_only_the_provider_answers(types: Types, clock: SimClock) -> None:
    """Who guesses the id of a call or goal is told that there is none."""
    hub = _hub(types, clock)
    caller, provider, other = (Client(hub, clock) for _ in range(3))
    provider.send("advertise_service", service="/lamp", type="std_srvs/SetBool")
    provider.send("advertise_action", action="/count", type="example_interfaces/Fibonacci")
    caller.send("call_service", service="/lamp", id="c1")
    caller.send("send_action_goal", action="/count", action_type="example_interfaces/Fibonacci", id="g1", feedback=True)
    call, goal = provider.gets("call_service"), provider.gets("send_action_goal")
    other.send("service_response", service="/lamp", id=call["id"], result=True, values={})
    other.send("action_feedback", action="/count", id=goal["id"], values={})
    other.send("action_result", action="/count", id=goal["id"], status=4, result=True, values={})
    for asked in (call, goal, goal):
        other.gets("status", id=asked["id"])
    assert not caller.frames


def test_who_leaves_is_waited_for_no_more(types: Types, clock: SimClock) -> None:
    """Neither a timeout of its calls nor a message that waits for its time is left behind."""
    hub = _hub(types, clock)
    leaver, provider = Client(hub, clock), Client(hub, clock)
    provider.send("advertise_service", service="/lamp", type="std_srvs/SetBool")
    provider.send("advertise", topic="/chat", type=_STRING)
    leaver.send("call_service", service="/lamp", id="c1")
    leaver.send("subscribe", topic="/chat", throttle_rate=1000, queue_length=5)
    _say(provider, "a", "b")
    leaver.leave()
    assert clock.next_s is None


def test_a_kept_message_comes_once_and_goes_with_its_publisher(types: Types, clock: SimClock) -> None:
    """A second subscription does not bring it again; when nobody publishes any more it is gone."""
    hub = _hub(types, clock)
    speaker, listener, late = (Client(hub, clock) for _ in range(3))
    speaker.send("advertise", topic="/chat", type=_STRING, latch=True)
    _say(speaker, "kept")
    listener.send("subscribe", topic="/chat", id="s1")
    listener.send("subscribe", topic="/chat", id="s2")
    listener.gets("publish", msg={"data": "kept"})
    assert not listener.frames
    speaker.leave()
    late.send("subscribe", topic="/chat")
    assert not late.frames


def test_who_sends_cbor_gets_cbor(types: Types, clock: SimClock) -> None:
    """Replies and calls, but not where JSON's compressions are asked for."""
    client = Client(_hub(types, clock), clock)
    for compression, expected in (("none", "cbor"), ("png", "png")):
        call = {"op": "call_service", "service": "/rosapi/get_time", "compression": compression}
        client.hub.take(client.session, cbor2.dumps(call))
        assert client.next()[1] == expected


_NAMES = st.sampled_from(["/chat", "/lamp", "/count", "/rosapi/topics", "", "x"])
_TYPES = st.sampled_from([_STRING, "std_srvs/SetBool", "example_interfaces/Fibonacci", "no/Such", ""])
_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)
_FIELDS = st.fixed_dictionaries(
    {"op": st.sampled_from(sorted(OPERATIONS))},
    optional={
        "id": st.sampled_from(["1", "2", 3]),
        "topic": _NAMES,
        "service": _NAMES,
        "action": _NAMES,
        "type": _TYPES,
        "action_type": _TYPES,
        "msg": st.just({"data": "x"}) | _JSON,
        "args": st.just({"data": True}) | st.just({"order": 2}) | _JSON,
        "values": _JSON,
        "result": st.booleans() | _JSON,
        "status": st.integers(0, 7) | _JSON,
        "compression": st.sampled_from(["none", "png", "cbor", "cbor-raw", "zip"]),
        "throttle_rate": st.integers(-1, 100),
        "queue_length": st.integers(-1, 3),
        "fragment_size": st.integers(0, 50),
        "feedback": st.booleans(),
        "latch": st.booleans(),
        "level": st.sampled_from(["info", "warning", "error", "none"]),
        "timeout": st.floats(),
        "data": st.text(max_size=5),
        "num": st.integers(-1, 2),
        "total": st.integers(-1, 2),
    },
)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 2), _FIELDS | st.just("leaves")), max_size=25))
def test_whatever_clients_do_calls_and_goals_are_answered_once_and_nothing_is_left(
    deeds: list[tuple[int, dict[str, object] | str]],
) -> None:
    """No frame breaks the hub; each call and goal gets one answer; who leaves leaves nothing behind."""
    clock = SimClock()
    hub = Hub(clock, types=_fuzz_types(), call_timeout_s=1.0)
    clients = [Client(hub, clock) for _ in range(3)]
    before = (hub.topics.told(), hub.services.told(), hub.actions.told())
    asked = [0, 0, 0]
    for who, deed in deeds:
        if isinstance(deed, str):
            clients[who].leave()
        elif clients[who].session.open:
            hub.take(clients[who].session, json.dumps(deed))
            asked[who] += deed["op"] == "call_service" and bool(deed.get("service"))
    advance(clock, 10.0)
    for client, number in zip(clients, asked, strict=True):
        answers = [fields for fields in _all(client) if fields["op"] == "service_response"]
        assert len(answers) == number or not client.session.open
        client.leave()
    assert hub.services.open_calls == 0
    assert (hub.topics.told(), hub.services.told(), hub.actions.told()) == before
    advance(clock, 1000.0)


@cache
def _fuzz_types() -> Types:
    return Types(2)


def _all(client: Client) -> list[dict[str, object]]:
    """The operations that a client got, fragments put together."""
    got = []
    while client.frames:
        operation = client.decoder.feed(client.frames.popleft(), 0.0)
        if operation is not None:
            got.append(written(operation))
    return got
