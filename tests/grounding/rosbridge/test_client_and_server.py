"""Our client against our server: what goes beyond the calls that all transports share."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

import numpy as np
import pytest

from grounding.actions import Goal, GoalResult, GoalStatus
from grounding.messages import Twist, Vector3, pose_stamped
from grounding.rosbridge.client import RosbridgeTransport
from grounding.rosbridge.connection import Endpoint
from grounding.rosbridge.hub import Hub
from grounding.rosbridge.hub_actions import RunningGoal
from grounding.rosbridge.policy import Policy, Role
from grounding.rosbridge.server import Server, serve
from grounding.rosbridge.types import Types
from grounding.transport import ServiceCall, ServiceReply
from kb.clock import SimClock, WallClock

WAIT_S = 20.0
TYPES = Types()
ECHO = TYPES.add_service_of("Echo", {"text": "string"}, {"text": "string"})
SERVICES = {"/echo": ECHO, "/silent": ECHO}
ACTIONS = {"/fibonacci": TYPES.action("example_interfaces/Fibonacci")}
ZERO = Vector3(x=0.0, y=0.0, z=0.0)


@contextmanager
def served(*, port: int = 0, policy: Policy | None = None) -> Iterator[tuple[Hub, Server]]:
    """A server with a service /echo."""
    clock = SimClock()
    hub = Hub(clock, types=TYPES, policy=policy)
    hub.services.offer("/echo", ECHO.name, dict)
    with serve(hub, clock, port=port) as server:
        yield hub, server


@contextmanager
def client(
    clock: WallClock, uri: str, *, binary: bool = True, token: str | None = None
) -> Iterator[RosbridgeTransport]:
    """A client that is not yet connected."""
    endpoint = Endpoint(uri=uri, token=token, first_delay_s=0.01, longest_delay_s=0.1)
    rng = np.random.default_rng(1)
    with RosbridgeTransport(
        endpoint, clock, services=SERVICES, actions=ACTIONS, types=TYPES, binary=binary, rng=rng
    ) as made:
        yield made


def run_until(clock: WallClock, done: Callable[[], bool]) -> None:
    """Run the clock until something is so, at most as long as a test may take."""
    overdue = threading.Timer(WAIT_S, lambda: clock.post(_give_up))
    overdue.start()
    stop_listening = clock.listen()
    assert clock.run_until(done)
    stop_listening()
    overdue.cancel()
    overdue.join()


def _give_up() -> None:
    raise AssertionError("what was waited for does not come")


def echo(number: int, service: str = "/echo") -> ServiceCall:
    """A call."""
    return ServiceCall(id=number, service=service, fields={"text": "hello"}, timeout_s=WAIT_S)


@pytest.mark.parametrize("binary", [True, False], ids=["binary", "text"])
def test_a_goal_runs_at_the_server_and_is_canceled(binary: bool) -> None:
    """Feedback, then what it has come to when it is canceled; another one succeeds."""
    running: list[RunningGoal] = []

    def start(goal: RunningGoal) -> None:
        running.append(goal)
        goal.feed({"sequence": np.array([0, 1], np.int32)})
        so_far = {"sequence": np.array([0, 1, 1], np.int32)}
        if goal.fields["order"] == 1:
            goal.end(GoalStatus.SUCCEEDED, so_far)
        goal.canceled = lambda: goal.end(GoalStatus.CANCELED, so_far)

    clock = WallClock()
    feedback: list[Mapping[str, object]] = []
    results: list[GoalResult] = []
    with served() as (hub, server), client(clock, server.uri, binary=binary) as near:
        server.post(lambda: hub.actions.offer("/fibonacci", "example_interfaces/action/Fibonacci", start))
        assert near.wait_connected(WAIT_S)
        near.send_goal(Goal(id=1, action="/fibonacci", fields={"order": 5}), feedback.append, results.append)
        run_until(clock, lambda: bool(feedback))
        assert results == []
        near.cancel_goal(1)
        run_until(clock, lambda: bool(results))
        near.send_goal(Goal(id=2, action="/fibonacci", fields={"order": 1}), feedback.append, results.append)
        run_until(clock, lambda: len(results) == 2)
    assert [list(fields["sequence"]) for fields in feedback] == [[0, 1], [0, 1]]  # type: ignore[call-overload]
    assert [(result.goal_id, result.status, result.failure) for result in results] == [
        (1, GoalStatus.CANCELED, "Canceled"),
        (2, GoalStatus.SUCCEEDED, ""),
    ]
    assert [list(result.fields["sequence"]) for result in results] == [[0, 1, 1]] * 2  # type: ignore[call-overload]


@pytest.mark.parametrize("binary", [True, False], ids=["binary", "text"])
def test_messages_go_from_client_to_client(binary: bool) -> None:
    """As they were sent, latched ones also to who comes later."""
    clock = WallClock()
    pose = pose_stamped(0.1, -2.0, 3.0, t_s=1_700_000_000.123456789, frame_id="map")
    with served() as (_, server), client(clock, server.uri, binary=binary) as one, client(clock, server.uri) as two:
        assert one.wait_connected(WAIT_S)
        assert two.wait_connected(WAIT_S)
        one.advertise("/pose", "geometry_msgs/PoseStamped", latch=True)
        assert one.publish("/pose", pose)
        heard = two.subscribe("/pose", "geometry_msgs/PoseStamped")
        run_until(clock, lambda: heard.newest is not None)
        assert heard.newest == pose


def test_a_service_of_one_client_is_called_by_another() -> None:
    """Through the server."""
    clock = WallClock()
    replies: list[ServiceReply] = []
    with served() as (_, server), client(clock, server.uri) as one, client(clock, server.uri) as two:
        assert one.wait_connected(WAIT_S)
        assert two.wait_connected(WAIT_S)
        one.offer("/silent", ECHO, lambda fields: {"text": str(fields["text"]).upper()})
        told: list[Mapping[int, bool | None]] = []
        while not any(answer[1] for answer in told):
            so_far = len(told)
            two.reconcile([echo(1, "/silent")], told.append)
            run_until(clock, lambda so_far=so_far: len(told) > so_far)  # type: ignore[misc]
        two.call(echo(1, "/silent"), replies.append)
        run_until(clock, lambda: bool(replies))
    assert (replies[0].fields, replies[0].failure) == ({"text": "HELLO"}, "")


def test_after_a_restart_of_the_server_all_goes_on() -> None:
    """What was in flight is lost, and what it went to is asked for; topics are there again."""
    clock = WallClock()
    lost: list[ServiceReply] = []
    told: list[Mapping[int, bool | None]] = []
    with served() as (hub, server):
        hub_posted = threading.Event()
        server.post(lambda: hub.services.offer("/silent", ECHO.name, dict, 1000.0))
        server.post(hub_posted.set)
        assert hub_posted.wait(WAIT_S)
        port = server.port
        with client(clock, server.uri) as near:
            assert near.wait_connected(WAIT_S)
            heard = near.subscribe("/speed", "geometry_msgs/Twist")
            near.call(echo(1, "/silent"), lost.append)
            server.close()
            run_until(clock, lambda: bool(lost))
            assert lost[0].failure == "Lost"
            with served(port=port) as (hub, again):
                assert near.wait_connected(WAIT_S)
                near.reconcile([echo(1, "/silent"), echo(2)], told.append)
                run_until(clock, lambda: bool(told))
                assert told == [{1: False, 2: True}]
                again.post(lambda: hub.topics.offer("/speed", "geometry_msgs/Twist", latch=True))
                again.post(lambda: hub.topics.say("/speed", Twist(linear=ZERO, angular=ZERO)))
                run_until(clock, lambda: heard.newest is not None)


def test_a_token_gives_a_role_and_what_that_may_not_do_is_told() -> None:
    """A wrong token is told as why there is no connection."""
    driver = Role(name="driver", call=("/echo",))
    tokens = {hashlib.sha256(b"key").hexdigest(): "driver"}
    policy = Policy(roles={"driver": driver}, tokens=tokens, anybody="")
    clock = WallClock()
    replies: list[ServiceReply] = []
    with served(policy=policy) as (_, server):
        with client(clock, server.uri, token="key") as near:
            assert near.wait_connected(WAIT_S)
            near.call(echo(1), replies.append)
            near.call(echo(2, "/silent"), replies.append)
            run_until(clock, lambda: len(replies) == 2)
        by_id = {reply.call_id: reply for reply in replies}
        assert by_id[1].fields == {"text": "hello"}
        assert by_id[2].failure not in ("", "ServiceError", "Lost")
        assert "role driver may not call service /silent" in by_id[2].reason
        with client(clock, server.uri, token="wrong") as near:
            run_until(clock, lambda: "401" in near.problem)
            assert not near.connected
