from __future__ import annotations

import contextlib
from pathlib import Path
from typing import get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grounding.rosbridge.framing import Decoder
from grounding.rosbridge.operations import (
    ABORTED,
    OPERATIONS,
    ActionResult,
    Advertise,
    AdvertiseAction,
    AdvertiseService,
    BadOperation,
    CallService,
    Fragment,
    Operation,
    Publish,
    SendActionGoal,
    ServiceResponse,
    Status,
    Subscribe,
    read,
    refusal,
    written,
)
from grounding.rosbridge.types import standard
from grounding.rosbridge.values import from_tree
from tests.grounding.rosbridge.exchanges import EXCHANGES, Exchange, Saved, Sends, filled_in

_SENT = [step.fields for exchange in EXCHANGES for step in exchange.steps if isinstance(step, Sends) and step.fields]


class _Ids(dict[str, object]):
    """An id for every name."""

    def __missing__(self, name: str) -> object:
        return f"id of {name}"


def test_the_union_holds_every_operation_of_the_protocol() -> None:
    """The protocol's table has these twenty operations, and each is one class."""
    assert sorted(OPERATIONS) == [
        "action_feedback", "action_result", "advertise", "advertise_action", "advertise_service", "auth",
        "call_service", "cancel_action_goal", "fragment", "png", "publish", "send_action_goal", "service_response",
        "set_level", "status", "subscribe", "unadvertise", "unadvertise_action", "unadvertise_service", "unsubscribe",
    ]  # fmt: skip
    assert len(get_args(Operation)) == len(OPERATIONS)


@pytest.mark.parametrize("op", sorted(OPERATIONS))
def test_every_operation_has_a_valid_and_an_invalid_exchange(op: str) -> None:
    """The table of exchanges leaves out no operation, either way."""
    about = [exchange for exchange in EXCHANGES if op in exchange.ops]
    assert any(exchange.valid for exchange in about)
    assert any(not exchange.valid for exchange in about)


@pytest.mark.parametrize("exchange", [e for e in EXCHANGES if e.valid], ids=lambda e: e.name)
def test_what_valid_exchanges_send_can_be_read_and_written_again(exchange: Exchange) -> None:
    """Reading, writing and reading gives the same operation."""
    for step in exchange.steps:
        if isinstance(step, Sends) and step.fields:
            operation = read(filled_in(step.fields, _Ids()))
            assert read(written(operation)) == operation


@pytest.mark.parametrize("client", ["roslib-2.1.0", "roslibpy-2.1.0"])
def test_all_that_clients_of_others_send_can_be_read(client: str) -> None:
    """What roslib and roslibpy sent in a session with topics, services, actions, rosapi and parameters."""
    recorded = (Path(__file__).parent / "recorded" / f"{client}.jsonl").read_text(encoding="utf-8").splitlines()
    types = standard()
    message_types = {"/cmd_vel": "geometry_msgs/Twist", "/pose": "geometry_msgs/PoseStamped"}
    ops = set()
    for frame in recorded:
        operation = Decoder().feed(frame, 0.0)
        assert operation is not None
        ops.add(operation.OP)
        match operation:
            case Publish(topic=topic, msg=msg):
                assert from_tree(message_types[topic], msg, now_s=0.0) is not None
            case Advertise(type=name) | Subscribe(type=str(name)):
                assert types.message(name)
            case AdvertiseService(type=name):
                assert types.service(name).name.endswith("/SetBool")
            case AdvertiseAction(type=name):
                assert types.action(name).name == name
            case SendActionGoal(action_type=name, args=args):
                assert from_tree(types.action(name).goal, args, now_s=0.0) is not None
            case _:
                pass  # nothing with a type
    everyone = {"set_level", "subscribe", "advertise", "publish", "unadvertise", "advertise_service"}
    assert ops >= everyone | {"call_service", "service_response", "unadvertise_service", "send_action_goal"}
    assert len(recorded) > 30


def test_names_of_exchanges_are_unique_with_what_they_are_about() -> None:
    """A failing exchange can be found by its name."""
    names = [(exchange.name, exchange.ops) for exchange in EXCHANGES]
    assert len(names) == len(set(names))


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({}, "field op is missing"),
        ({"op": None}, "field op is missing"),
        ({"op": 3}, "field op is 3, which is no operation: there are action_feedback, "),
        ({"op": "publish", "topic": "", "msg": {}}, "publish: field topic is '', should be a text that is not empty"),
        ({"op": "publish", "topic": "/a"}, "publish: field msg is missing, should be an object"),
        ({"op": "publish", "topic": "/a", "msg": {}, "id": 1.5}, "publish: field id is 1.5, should be a text or "),
        ({"op": "publish", "topic": "/a", "msg": {}, "id": True}, "publish: field id is true"),
        ({"op": "subscribe", "topic": "/a", "throttle_rate": -1}, "should be a whole number from 0"),
        ({"op": "subscribe", "topic": "/a", "queue_length": 1.5}, "field queue_length is 1.5"),
        ({"op": "subscribe", "topic": "/a", "fragment_size": 0}, "should be a whole number from 1"),
        ({"op": "subscribe", "topic": "/a", "compression": ["png"]}, "is a list, should be one of none, png, cbor"),
        ({"op": "call_service", "service": "/a", "compression": "cbor-raw"}, "should be one of none, png, cbor"),
        ({"op": "call_service", "service": "/a", "timeout": float("nan")}, "timeout is nan, should be a number of s"),
        ({"op": "call_service", "service": "/a", "timeout": 10**400}, "field timeout is a very large number"),
        ({"op": "call_service", "service": "/a", "timeout": 0}, "field timeout is 0"),
        ({"op": "call_service", "service": "#7"}, "field service is ''"),
        ({"op": "action_result", "action": "/a", "result": True}, "field status is missing"),
        ({"op": "action_result", "action": "/a", "result": True, "status": 7}, "field status is 7"),
        ({"op": "fragment", "id": "1", "data": "", "num": 3, "total": 3}, "field num is 3, should be below total, 3"),
        ({"op": "png", "data": "", "num": 0, "total": 1}, "fields id, num and total belong together"),
        ({"op": "png", "data": "", "num": 0, "id": "1"}, "fields id, num and total belong together"),
        ({"op": "status", "level": "x" * 1000, "msg": ""}, "xxx'..., should be one of info, warning, error, none"),
    ],
)  # fmt: skip
def test_wrong_fields_are_told_by_name_and_value(fields: dict[str, object], reason: str) -> None:
    """The reason names the field, what it is, and what it should be."""
    with pytest.raises(BadOperation) as caught:
        read(fields)
    assert reason in caught.value.reason
    assert len(caught.value.reason) < 400


def test_an_error_keeps_what_its_answer_needs() -> None:
    """Operation, id and service of a wrong call are known, so that its caller can be answered."""
    with pytest.raises(BadOperation) as caught:
        read({"op": "call_service", "service": "/lamp", "id": "c1", "args": 3})
    error = caught.value
    assert refusal(error.op, error.id, error.name, error.reason) == ServiceResponse(
        service="/lamp", id="c1", result=False, values="call_service: field args is 3, should be an object or a list"
    )


def test_a_call_is_about_a_service_and_a_goal_about_an_action() -> None:
    """A field of the other kind does not make an answer that nobody waits for."""
    for op, field in (("call_service", "action"), ("send_action_goal", "service")):
        with pytest.raises(BadOperation) as caught:
            read({"op": op, field: "/chat", "id": "c1"})
        error = caught.value
        assert error.name is None
        assert refusal(error.op, error.id, error.name, error.reason) == Status(level="error", msg=error.reason, id="c1")


def test_what_has_no_reply_is_refused_by_a_status() -> None:
    """A status error with the id answers all but calls and goals."""
    assert refusal("publish", "p", None, "no") == Status(level="error", msg="no", id="p")
    assert refusal("call_service", "c", None, "no") == Status(level="error", msg="no", id="c")
    assert refusal("send_action_goal", 3, "/count", "no") == ActionResult(
        action="/count", id=3, status=0, result=False, values="no"
    )


def test_the_old_form_of_a_call_carries_its_id_in_the_name() -> None:
    """`name#id` is a name and an id; an id of its own field wins."""
    assert read({"op": "call_service", "service": "/a#1"}) == CallService(service="/a", id="1")
    assert read({"op": "call_service", "service": "/a#1", "id": "2"}) == CallService(service="/a", id="2")


def test_a_failed_goal_without_a_status_was_aborted() -> None:
    """What roslib 1 sends for a failed goal has no status."""
    result = read({"op": "action_result", "action": "/a", "id": "1", "result": False, "values": {}})
    assert result == ActionResult(action="/a", id="1", result=False, values={}, status=ABORTED)


def test_null_and_unknown_fields_say_nothing() -> None:
    """Some clients (roslibpy) send an id of null; clients of later versions send fields that we do not know."""
    fields = {"op": "subscribe", "topic": "/a", "id": None, "type": None, "qos": {"depth": 3}}
    assert read(fields) == Subscribe(topic="/a")


def test_written_leaves_out_what_says_nothing() -> None:
    """Optional fields with their default are not sent; fields that must be there are, whatever they are."""
    assert written(Publish(topic="/a", msg={})) == {"op": "publish", "topic": "/a", "msg": {}}
    assert written(ServiceResponse(service="/a", result=False)) == {
        "op": "service_response", "service": "/a", "result": False,
    }  # fmt: skip
    assert written(Fragment(id=0, data="", num=0, total=1)) == {
        "op": "fragment", "id": 0, "data": "", "num": 0, "total": 1,
    }  # fmt: skip


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)
_FIELDS = ["id", "topic", "type", "msg", "service", "args", "values", "result", "status", "action", "action_type",
           "level", "data", "num", "total", "compression", "timeout", "fragment_size", "latch"]  # fmt: skip


@settings(deadline=None, derandomize=True)
@given(st.sampled_from(sorted(OPERATIONS)), st.dictionaries(st.sampled_from(_FIELDS), _JSON))
def test_any_fields_are_an_operation_or_a_reason(op: str, fields: dict[str, object]) -> None:
    """Whatever the fields are, reading gives an operation that survives a round trip, or BadOperation."""
    try:
        operation = read({"op": op, **fields})
    except BadOperation:
        return
    assert repr(read(written(operation))) == repr(operation)  # by their text: a NaN in a message equals no other


@settings(deadline=None, derandomize=True)
@given(st.sampled_from(_SENT), st.data())
def test_breaking_a_field_of_a_right_operation_is_noticed_or_harmless(
    fields: dict[str, object], data: st.DataObject
) -> None:
    """Any one field of what the exchanges send, replaced by anything: an operation or BadOperation."""
    broken = filled_in(fields, _Ids())
    broken[data.draw(st.sampled_from(sorted(broken)))] = data.draw(_JSON)
    with contextlib.suppress(BadOperation):
        assert broken.get("op") == read(broken).OP


def test_saved_ids_are_filled_in() -> None:
    """The runner of exchanges puts an id that it got before into what it sends."""
    assert filled_in({"id": Saved("x"), "args": [1]}, {"x": "7"}) == {"id": "7", "args": [1]}
