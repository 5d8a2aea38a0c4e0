"""The rosbridge client, against a far end that does what no server should.

What all transports share is in tests/contracts.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import pytest

from grounding.actions import Goal, GoalResult, GoalStatus
from grounding.messages import Twist, Vector3, pose_stamped
from grounding.rosbridge.client import RosbridgeTransport, service_types
from grounding.rosbridge.connection import Endpoint
from grounding.rosbridge.framing import split
from grounding.rosbridge.operations import (
    ActionFeedback,
    ActionResult,
    Advertise,
    AdvertiseService,
    CallService,
    CancelActionGoal,
    Operation,
    Publish,
    SendActionGoal,
    ServiceResponse,
    Status,
    Subscribe,
    UnadvertiseService,
    Unsubscribe,
)
from grounding.rosbridge.types import Types
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import WallClock
from kb.errors import ServiceFailed
from kb.groundings import Field, Grounding
from tests.contracts.far_end import FarEnd
from tests.grounding.rosbridge.exchanges import FROM_SERVER, FromServer

WAIT_S = 20.0
ECHO = {"text": "string"}
TYPES = Types()
SERVICES = {"/echo": TYPES.add_service_of("Echo", ECHO, ECHO)}
FIBONACCI = {"/fibonacci": TYPES.action("example_interfaces/Fibonacci")}
HALVES = split('{"op": "publish", "topic": "/t", "msg": {}}', 25, "a")
ZERO = Vector3(x=0.0, y=0.0, z=0.0)


@dataclass(kw_only=True)
class Ends:
    """Both ends and the clock between them."""

    far: FarEnd
    near: RosbridgeTransport
    clock: WallClock

    def call(self, number: int, *, timeout_s: float = WAIT_S) -> list[ServiceReply]:
        """Call /echo; where the replies will be."""
        replies: list[ServiceReply] = []
        call = ServiceCall(id=number, service="/echo", fields={"text": "hello"}, timeout_s=timeout_s)
        self.near.call(call, replies.append)
        return replies

    def until(self, done: Callable[[], bool]) -> None:
        """Run the clock until something is so that may come about elsewhere."""

        def look_again() -> None:
            if not done():
                self.clock.call_at(self.clock.now_s + 0.005, look_again)

        look_again()
        with _given_up(self.clock):
            assert self.clock.run_until(done)

    def let_all_happen(self) -> None:
        """Until nothing is left to happen: nobody listens any more."""
        with _given_up(self.clock):
            assert not self.clock.run_until(lambda: False)

    def came(self, kind: type[Operation]) -> list[Operation]:
        """What has come to the far end of one kind."""
        return [operation for operation in list(self.far.came) if isinstance(operation, kind)]


@contextmanager
def _given_up(clock: WallClock) -> Iterator[None]:
    """Fail what takes longer than a test may."""
    overdue = threading.Timer(WAIT_S, lambda: clock.post(_give_up))
    overdue.start()
    try:
        yield
    finally:
        overdue.cancel()
        overdue.join()


def _give_up() -> None:
    raise AssertionError("what was waited for does not come")


@pytest.fixture(params=[True, False], ids=["binary", "text"])
def ends(request: pytest.FixtureRequest) -> Iterator[Ends]:
    """Connected, with a service /echo."""
    clock = WallClock()
    with FarEnd(TYPES) as far:
        far.offer("/echo", SERVICES["/echo"], dict)
        endpoint = Endpoint(uri=far.uri, first_delay_s=0.01, longest_delay_s=0.05)
        near = RosbridgeTransport(
            endpoint,
            clock,
            services=SERVICES,
            actions=FIBONACCI,
            types=TYPES,
            binary=request.param,
            rng=np.random.default_rng(1),
        )
        with near:
            assert near.wait_connected(WAIT_S)
            yield Ends(far=far, near=near, clock=clock)


def response(operation: Operation, *, values: object, result: bool = True) -> ServiceResponse:
    """The reply to a call."""
    assert isinstance(operation, CallService)
    return ServiceResponse(service=operation.service, id=operation.id, result=result, values=values)  # type: ignore[arg-type]


# ------------------------------------------------------------------------------------------- calls


def test_a_second_reply_is_dropped_and_counted(ends: Ends) -> None:
    """The first holds."""
    ends.far.answer = lambda call: [response(call, values={"text": text}) for text in ("one", "two")]
    replies = ends.call(1)
    ends.until(lambda: ends.near.dropped.count == 1)
    assert [reply.fields for reply in replies] == [{"text": "one"}]


def test_a_reply_after_the_time_of_its_call_is_dropped_and_counted(ends: Ends) -> None:
    """Nothing is kept of a call whose time is over, and the clock does not wait for it."""
    ends.far.answer = lambda call: []
    replies = ends.call(1, timeout_s=0.05)
    ends.let_all_happen()
    ends.until(lambda: bool(ends.came(CallService)))
    ends.far.send(response(ends.came(CallService)[0], values={"text": "late"}))
    ends.until(lambda: ends.near.dropped.count == 1)
    assert replies == []


def test_replies_that_were_never_asked_for_are_dropped_and_counted(ends: Ends) -> None:
    """With an unknown id, with none, and for unknown services and goals."""
    ends.far.send(
        ServiceResponse(service="/echo", id="call_service:/echo:999", result=True, values={"text": "x"}),
        ServiceResponse(service="/echo", result=True, values={"text": "x"}),
        ServiceResponse(service="/other", id=7, result=False),
        ActionResult(action="/fibonacci", id="goal:3", status=4, result=True, values={}),
        ActionFeedback(action="/fibonacci", id="goal:3", values={}),
        Publish(topic="/nobody/hears", msg={}),
    )
    ends.until(lambda: ends.near.dropped.count == 6)
    replies = ends.call(1)
    ends.until(lambda: bool(replies))
    assert replies[0].fields == {"text": "hello"}


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        ({"text": 5}, "the reply of /echo: text "),
        ({"text": None}, "the reply of /echo: text "),
        ({"text": "hello", "more": 1}, ""),
        ("a text", "the reply of /echo: "),
        ([1, 2, 3], "the reply of /echo: "),
    ],
)
def test_a_reply_of_another_type_is_a_bad_reply(ends: Ends, values: object, problem: str) -> None:
    """With the field; what it holds beyond its type is passed over, as in process."""
    ends.far.answer = lambda call: [response(call, values=values)]
    replies = ends.call(1)
    ends.until(lambda: bool(replies))
    assert replies[0].failure == ("BadReply" if problem else "")
    assert replies[0].reason.startswith(problem)


@pytest.mark.parametrize(
    ("said", "failure", "reason"),
    [
        ("NoPath: there is a wall", "NoPath", "there is a wall"),
        ("Service /echo does not exist", "NoSuchService", "Service /echo does not exist"),
        ("it just did not work", "ServiceError", "it just did not work"),
        (None, "ServiceError", "/echo does not say why"),
        ({"error": 3}, "ServiceError", "{'error': 3}"),
    ],
)
def test_a_failure_has_a_class_and_a_reason(ends: Ends, said: object, failure: str, reason: str) -> None:
    """Ours say both; those of other servers only why."""
    ends.far.answer = lambda call: [response(call, values=said, result=False)]
    replies = ends.call(1)
    ends.until(lambda: bool(replies))
    assert (replies[0].failure, replies[0].reason) == (failure, reason)


def test_a_field_that_is_not_in_the_reply_is_not_made_up(ends: Ends) -> None:
    """Who interprets the reply says that it is missing; a zero would pass for a value."""
    ends.far.answer = lambda call: [response(call, values={})]
    replies = ends.call(1)
    ends.until(lambda: bool(replies))
    assert (replies[0].fields, replies[0].failure) == ({}, "")


def test_an_error_that_names_a_call_ends_it(ends: Ends) -> None:
    """Some servers tell by a status what they do not like about a call."""
    ends.far.answer = lambda call: [Status(level="error", msg="call_service: no such field", id=call.id)]
    replies = ends.call(1)
    ends.until(lambda: bool(replies))
    assert (replies[0].failure, replies[0].reason) == ("ServiceError", "call_service: no such field")


def test_a_value_that_cannot_be_sent_is_told(ends: Ends) -> None:
    """By its field; nothing goes out."""
    replies: list[ServiceReply] = []
    ends.near.call(ServiceCall(id=1, service="/echo", fields={"text": 3}, timeout_s=1.0), replies.append)
    assert replies == []
    ends.until(lambda: bool(replies))
    assert replies[0].failure == "BadRequest"
    assert replies[0].reason.startswith("/echo: text ")
    assert ends.came(CallService) == []


def test_frames_that_cannot_be_read_are_counted_and_harm_nothing(ends: Ends) -> None:
    """Texts, bytes, half fragments, operations with wrong fields."""
    bad: list[str | bytes] = [
        "",
        "{",
        "[1]",
        "null",
        '{"op": "fly"}',
        '{"op": "publish", "topic": 3}',
        b"",
        b"\xff\x00",
        b"\xa1\x62op",
    ]
    ends.far.send(*bad, '{"op": "fragment", "id": "a", "data": "{", "num": 0, "total": 2}')
    ends.until(lambda: ends.near.dropped.count == len(bad))
    assert ends.near.dropped.last
    replies = ends.call(1)
    ends.until(lambda: bool(replies))
    assert replies[0].fields == {"text": "hello"}


def test_who_calls_us_is_answered(ends: Ends) -> None:
    """Never silence: there are no services here."""
    ends.far.send(CallService(service="/ours", id="7"))
    ends.until(lambda: bool(ends.came(ServiceResponse)))
    [answer] = ends.came(ServiceResponse)
    assert isinstance(answer, ServiceResponse)
    assert (answer.id, answer.result, answer.values) == (
        "7",
        False,
        "NoSuchService: there is no service /ours; there is none",
    )


@pytest.mark.parametrize("case", FROM_SERVER, ids=lambda case: case.name)
def test_what_a_server_should_not_send_is_told_and_harms_nothing(ends: Ends, case: FromServer) -> None:
    """Each is dropped with a sentence that says what it was; calls go on as before."""
    ends.far.send(case.frame)
    replies = ends.call(1)
    ends.until(lambda: bool(replies) and ends.near.dropped.count == bool(case.problem))
    assert replies[0].fields == {"text": "hello"}
    assert case.problem in ends.near.dropped.last


def test_a_service_is_offered_to_the_far_end(ends: Ends) -> None:
    """Also after a break; a failure goes out with its code, a bad request is told by its field."""

    def shout(fields: Mapping[str, object]) -> Mapping[str, object]:
        if not fields["text"]:
            raise ServiceFailed("Speechless", "there is nothing to shout")
        return {"text": str(fields["text"]).upper()}

    ends.near.offer("/shout", SERVICES["/echo"], shout)
    ends.until(lambda: len(ends.came(AdvertiseService)) == 1)
    ends.far.break_connections()
    ends.until(lambda: len(ends.came(AdvertiseService)) == 2)
    for number, text in enumerate(("hello", "", 3)):
        ends.far.send(CallService(service="/shout", id=number, args={"text": text}))
    ends.until(lambda: len(ends.came(ServiceResponse)) == 3)
    answers = [(a.result, a.values) for a in ends.came(ServiceResponse) if isinstance(a, ServiceResponse)]
    assert answers == [
        (True, {"text": "HELLO"}),
        (False, "Speechless: there is nothing to shout"),
        (False, "BadRequest: text is 3, should be a text"),
    ]
    ends.near.withdraw("/shout")
    ends.until(lambda: bool(ends.came(UnadvertiseService)))
    ends.let_all_happen()


# ---------------------------------------------------------------------------- connections that break


def test_calls_in_flight_are_lost_with_the_connection_and_the_next_arrive(ends: Ends) -> None:
    """At once, with the reason, in the order of the calls."""
    ends.far.answer = lambda call: []
    lost = [ends.call(number) for number in range(3)]
    ends.until(lambda: len(ends.came(CallService)) == 3)
    ends.far.break_connections()
    ends.until(lambda: all(lost))
    assert [replies[0].failure for replies in lost] == ["Lost"] * 3
    assert lost[0][0].reason.startswith(f"lost the connection to {ends.far.uri}: ")
    ends.far.answer = lambda call: None
    ends.until(lambda: ends.near.connected)
    replies = ends.call(4)
    ends.until(lambda: bool(replies))
    assert replies[0].fields == {"text": "hello"}


def test_half_a_text_is_forgotten_with_its_connection(ends: Ends) -> None:
    """Its other half, in the next session, is the first half of another."""
    received = ends.near.traffic.received
    ends.far.send(HALVES[0])
    ends.until(lambda: ends.near.traffic.received > received)
    ends.far.break_connections()
    ends.until(lambda: not ends.near.connected)
    ends.until(lambda: ends.near.connected)
    ends.far.send(HALVES[1])
    replies = ends.call(1)
    ends.until(lambda: bool(replies))
    assert ends.near.dropped.count == 0


def test_a_call_without_a_connection_is_lost_later(ends: Ends) -> None:
    """Not within the call; the reason is why there is none."""
    ends.near.close()
    ends.until(lambda: not ends.near.connected)
    replies = ends.call(1)
    assert replies == []
    ends.until(lambda: bool(replies))
    assert (replies[0].failure, replies[0].reason) == ("Lost", f"the connection to {ends.far.uri} was closed")
    ends.let_all_happen()


def test_what_was_lost_is_reconciled(ends: Ends) -> None:
    """Who is offered again, who is not; without a connection, nobody."""
    calls = [ServiceCall(id=n, service=name, fields={}, timeout_s=1.0) for n, name in enumerate(("/echo", "/gone"))]
    told: list[Mapping[int, bool | None]] = []
    ends.far.answer = lambda call: [response(call, values={"services": ["/echo", "/rosapi/services"]})]
    ends.near.reconcile(calls, told.append)
    ends.until(lambda: bool(told))
    ends.near.close()
    ends.until(lambda: not ends.near.connected)
    ends.near.reconcile(calls, told.append)
    ends.until(lambda: len(told) == 2)
    assert told == [{0: True, 1: False}, {0: False, 1: False}]


# ------------------------------------------------------------------------------------------ topics


def test_the_newest_message_of_a_topic_is_kept_with_its_age(ends: Ends) -> None:
    """And given to who wants each."""
    taken: list[object] = []
    pose = pose_stamped(1.0, 2.0, 0.5, t_s=3.0)
    heard = ends.near.subscribe("/amigo_1/pose", "geometry_msgs/PoseStamped", taken.append, throttle_s=0.1)
    assert (heard.newest, heard.age_s) == (None, None)
    ends.until(lambda: bool(ends.came(Subscribe)))
    [asked] = ends.came(Subscribe)
    assert isinstance(asked, Subscribe)
    assert (asked.type, asked.throttle_rate, asked.queue_length) == ("geometry_msgs/msg/PoseStamped", 100, 1)
    ends.far.publish("/amigo_1/pose", pose)
    ends.until(lambda: bool(taken))
    assert (heard.newest, taken) == (pose, [pose])
    assert heard.age_s is not None
    assert 0.0 <= heard.age_s < WAIT_S
    ends.near.unsubscribe("/amigo_1/pose")
    ends.until(lambda: bool(ends.came(Unsubscribe)))
    ends.far.publish("/amigo_1/pose", pose)
    ends.until(lambda: ends.near.dropped.count == 1)
    ends.let_all_happen()


def test_of_messages_that_nobody_takes_only_the_newest_stays(ends: Ends) -> None:
    """While the clock does not run; memory does not grow with what comes."""
    taken: list[object] = []
    ends.near.subscribe("/speed", "geometry_msgs/Twist", taken.append)
    ends.until(lambda: bool(ends.came(Subscribe)))
    received = ends.near.traffic.received
    for x in range(1000):
        ends.far.publish("/speed", Twist(linear=Vector3(x=float(x), y=0.0, z=0.0), angular=ZERO))
    assert _comes_to_be(lambda: ends.near.traffic.received == received + 1000)
    ends.until(lambda: len(taken) > 0)
    assert ends.near.traffic.superseded == 999
    [message] = taken
    assert isinstance(message, Twist)
    assert message.linear.x == 999.0


def _comes_to_be(condition: Callable[[], bool]) -> bool:
    """Wait without running the clock until something is so, at most as long as a test may take."""
    never = threading.Event()
    return any(condition() or never.wait(0.005) for _ in range(int(WAIT_S / 0.005)))


def test_a_message_of_another_type_is_not_taken(ends: Ends) -> None:
    """The last good one stays; the problem names the field."""
    heard = ends.near.subscribe("/speed", "geometry_msgs/Twist")
    ends.until(lambda: bool(ends.came(Subscribe)))
    ends.far.send(Publish(topic="/speed", msg={"linear": {"x": "fast"}}))
    ends.until(lambda: bool(heard.problem))
    assert heard.newest is None
    assert heard.problem.startswith("message of /speed: linear.x ")


def test_topics_are_said_again_after_a_break(ends: Ends) -> None:
    """The far end has forgotten them; what is published without a connection is gone, and that is told."""
    heard = ends.near.subscribe("/speed", "geometry_msgs/Twist")
    ends.near.advertise("/goal", "geometry_msgs/PoseStamped", latch=True)
    ends.until(lambda: len(ends.came(Subscribe) + ends.came(Advertise)) == 2)
    ends.far.break_connections()
    ends.until(lambda: not ends.near.connected)
    assert not ends.near.publish("/goal", pose_stamped(0.0, 0.0, 0.0, t_s=0.0))
    ends.until(lambda: len(ends.came(Subscribe) + ends.came(Advertise)) == 4)
    ends.far.publish("/speed", Twist(linear=ZERO, angular=ZERO))
    ends.until(lambda: heard.newest is not None)
    pose = pose_stamped(1.0, 2.0, 3.0, t_s=4.0)
    assert ends.near.publish("/goal", pose)
    ends.until(lambda: bool(ends.came(Publish)))
    [published] = ends.came(Publish)
    assert isinstance(published, Publish)
    assert published.latch


# ----------------------------------------------------------------------------------------- actions


def fibonacci(ends: Ends, number: int, order: int = 5) -> tuple[list[Mapping[str, object]], list[GoalResult]]:
    """Send a goal; where feedback and result will be."""
    feedback: list[Mapping[str, object]] = []
    results: list[GoalResult] = []
    ends.near.send_goal(Goal(id=number, action="/fibonacci", fields={"order": order}), feedback.append, results.append)
    return feedback, results


def test_a_goal_has_feedback_and_one_result(ends: Ends) -> None:
    """What comes afterwards is dropped."""

    def run(goal: Operation) -> list[Operation | str | bytes]:
        assert isinstance(goal, SendActionGoal)
        assert (goal.action_type, goal.args, goal.feedback) == (
            "example_interfaces/action/Fibonacci",
            {"order": 5},
            True,
        )
        assert goal.id is not None
        return [
            ActionFeedback(action=goal.action, id=goal.id, values={"sequence": [0, 1]}),
            ActionResult(action=goal.action, id=goal.id, status=4, result=True, values={"sequence": [0, 1, 1]}),
            ActionResult(action=goal.action, id=goal.id, status=6, result=False, values="late"),
        ]

    ends.far.answer = run
    feedback, results = fibonacci(ends, 1)
    ends.until(lambda: ends.near.dropped.count == 1)
    assert [list(fields["sequence"]) for fields in feedback] == [[0, 1]]  # type: ignore[call-overload]
    [result] = results
    assert (result.goal_id, result.status, result.failure) == (1, GoalStatus.SUCCEEDED, "")
    assert list(result.fields["sequence"]) == [0, 1, 1]  # type: ignore[call-overload]
    ends.let_all_happen()


def test_a_goal_is_canceled_at_the_far_end(ends: Ends) -> None:
    """Canceling asks; the result says what became of it, and may still hold something."""

    def run(operation: Operation) -> list[Operation | str | bytes]:
        if isinstance(operation, CancelActionGoal):
            values = {"sequence": [0]}
            return [ActionResult(action=operation.action, id=operation.id, status=5, result=True, values=values)]
        return []

    ends.far.answer = run
    _, results = fibonacci(ends, 1)
    ends.near.cancel_goal(1)
    ends.near.cancel_goal(2)
    ends.until(lambda: bool(results))
    [result] = results
    assert (result.status, result.failure, list(result.fields["sequence"])) == (GoalStatus.CANCELED, "Canceled", [0])  # type: ignore[call-overload]


@pytest.mark.parametrize(
    ("result", "status", "failure", "reason"),
    [
        ({"status": 6, "result": False, "values": "Stuck: at the door"}, GoalStatus.ABORTED, "Stuck", "at the door"),
        ({"status": 0, "result": False, "values": "no"}, GoalStatus.ABORTED, "ServiceError", "no"),
        (
            {"status": 6, "result": True, "values": {}},
            GoalStatus.ABORTED,
            "GoalFailed",
            "/fibonacci ended with status 6, ABORTED",
        ),
        (
            {"status": 4, "result": True, "values": {"sequence": "x"}},
            GoalStatus.SUCCEEDED,
            "BadReply",
            "the result of /fibonacci: sequence is 'x', should be a list of int32",
        ),
    ],
)
def test_a_goal_that_fails_says_how(
    ends: Ends, result: dict[str, object], status: GoalStatus, failure: str, reason: str
) -> None:
    """By its status, by its text, or by a result that is of another type."""
    ends.far.answer = lambda goal: [ActionResult(action="/fibonacci", id=goal.id, **result)]  # type: ignore[arg-type]
    _, results = fibonacci(ends, 1)
    ends.until(lambda: bool(results))
    assert (results[0].status, results[0].failure, results[0].reason) == (status, failure, reason)


def test_goals_are_lost_with_the_connection(ends: Ends) -> None:
    """What became of them is not known."""
    ends.far.answer = lambda goal: []
    _, results = fibonacci(ends, 1)
    ends.until(lambda: bool(ends.came(SendActionGoal)))
    ends.far.break_connections()
    ends.until(lambda: bool(results))
    assert (results[0].status, results[0].failure) == (GoalStatus.UNKNOWN, "Lost")
    ends.let_all_happen()


def test_an_action_that_is_not_known_is_told(ends: Ends) -> None:
    """Later, with those that are."""
    results: list[GoalResult] = []
    ends.near.send_goal(Goal(id=1, action="/fly", fields={}), lambda fields: None, results.append)
    assert results == []
    ends.until(lambda: bool(results))
    assert results[0].reason == "there is no action /fly; there is /fibonacci"


# ------------------------------------------------------------------------------------------- types


def field(name: str, message_type: str) -> Field:
    """A field of a grounding."""
    return Field(
        name=name,
        message_type=message_type,
        parameter=name,
        of_property=None,
        kind_of=False,
        file=None,
        optional=False,
    )


def test_the_types_of_services_are_made_of_the_fields_of_their_groundings() -> None:
    """One for each robot that offers it."""
    laser = Grounding(
        name="laser_grounding",
        process="Laser",
        service="/{robot}/laser",
        on_robot=True,
        timeout_s=1.0,
        duration_s=0.1,
        request=(),
        reply=(field("scan", "sensor_msgs/LaserScan"),),
    )
    types = Types()
    made = service_types([laser], ["pico_1", "amigo_1"], types)
    assert sorted(made) == ["/amigo_1/laser", "/pico_1/laser"]
    [scan] = types.fields(made["/amigo_1/laser"].reply)
    assert (scan.name, scan.kind) == ("scan", "sensor_msgs/msg/LaserScan")
