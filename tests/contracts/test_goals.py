"""What every transport keeps to that carries goals: feedback, one result, cancel, errors."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from functools import partial

import numpy as np
import pytest

from grounding.actions import Carrier, Goal, GoalHandle, GoalResult, GoalStatus
from grounding.faults import FaultyTransport
from grounding.inprocess import InProcessTransport
from grounding.rosbridge.client import RosbridgeTransport
from grounding.rosbridge.connection import Endpoint
from grounding.rosbridge.hub import Hub
from grounding.rosbridge.server import serve
from grounding.rosbridge.types import Types
from grounding.transport import ServiceCall
from kb.clock import Clock, SimClock, WallClock
from kb.errors import ServiceFailed

WAIT_S = 20.0
COUNT = "/count"
TYPE = "example_interfaces/Fibonacci"


class Counter:
    """Counts to what it is asked for, a number in each step; below 0 it refuses, above 9 it fails at 2."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def start(self, goal: GoalHandle) -> None:
        """Begin."""
        order = goal.fields["order"]
        assert isinstance(order, int)
        if order < 0:
            raise ServiceFailed("BadOrder", f"order is {order}, should be 0 or more")
        counted: list[int] = []
        goal.canceled = lambda: goal.end(GoalStatus.CANCELED, {"sequence": list_of(counted)})

        def step() -> None:
            counted.append(len(counted))
            goal.feed({"sequence": list_of(counted)})
            if order == 99 and len(counted) == 2:
                goal.end(GoalStatus.ABORTED, {"sequence": list_of(counted)})
            elif len(counted) == order:
                goal.end(GoalStatus.SUCCEEDED, {"sequence": list_of(counted)})
                goal.end(GoalStatus.ABORTED, {"sequence": list_of([])})
            elif len(counted) < 100:
                self._clock.call_at(self._clock.now_s + 0.02, step)

        self._clock.call_at(self._clock.now_s + 0.02, step)


def list_of(numbers: list[int]) -> np.ndarray:
    """As the message has it."""
    return np.array(numbers, dtype=np.int32)


Setup = tuple[Clock, Carrier]


@contextmanager
def in_process() -> Iterator[Setup]:
    """Actions are functions."""
    clock = SimClock()
    transport = InProcessTransport(clock)
    transport.offer_action(COUNT, Counter(clock).start)
    yield clock, transport


@contextmanager
def with_faults() -> Iterator[Setup]:
    """On the way on which faults happen, but none does."""
    with in_process() as (clock, transport):
        yield clock, FaultyTransport(transport, clock, (), np.random.default_rng(1))


@contextmanager
def rosbridge(*, binary: bool) -> Iterator[Setup]:
    """Actions are behind our server; time is real."""
    served, types, clock = SimClock(), Types(), WallClock()
    hub = Hub(served)
    hub.actions.offer(COUNT, TYPE, Counter(served).start)
    known = {COUNT: types.action(TYPE), "/mount": types.action(TYPE)}
    stuck = threading.Timer(60.0, lambda: clock.post(lambda: pytest.fail("waits for what does not come")))
    with (
        serve(hub, served) as server,
        RosbridgeTransport(
            Endpoint(uri=server.uri),
            clock,
            services={},
            actions=known,
            types=types,
            binary=binary,
            rng=np.random.default_rng(1),
        ) as transport,
    ):
        assert transport.wait_connected(WAIT_S), transport.problem
        stuck.start()
        yield clock, transport
        stuck.cancel()
        stuck.join()


TRANSPORTS: Mapping[str, Callable[[], AbstractContextManager[Setup]]] = {
    "in process": in_process,
    "with faults": with_faults,
    "rosbridge, binary": partial(rosbridge, binary=True),
    "rosbridge, text": partial(rosbridge, binary=False),
}


class Goals:
    """Sends goals, and takes down what comes of them."""

    def __init__(self, clock: Clock, transport: Carrier) -> None:
        self.clock, self.transport = clock, transport
        self.fed: list[list[int]] = []
        self.results: list[GoalResult] = []
        self.on_feedback: Callable[[], None] = lambda: None

    def send(self, number: int, order: int, action: str = COUNT) -> None:
        """Send one."""
        goal = Goal(id=number, action=action, fields={"order": order})
        self.transport.send_goal(goal, self._feed, self.results.append)
        assert self.results == [], "nothing comes within the call"

    def _feed(self, fields: Mapping[str, object]) -> None:
        assert self.results == [], "feedback comes before the result"
        self.fed.append(sequence(fields))
        self.on_feedback()

    def result(self) -> GoalResult:
        """The one result, after all has happened."""
        assert not self.clock.run_until(lambda: False)
        [result] = self.results
        return result


def sequence(fields: Mapping[str, object]) -> list[int]:
    """The numbers of a result or feedback."""
    found = fields["sequence"]
    assert isinstance(found, np.ndarray)
    return [int(number) for number in found]


@pytest.fixture(params=TRANSPORTS)
def goals(request: pytest.FixtureRequest) -> Iterator[Goals]:
    """Each transport in turn; the tests below hold for all."""
    with TRANSPORTS[request.param]() as (clock, transport):
        yield Goals(clock, transport)


def test_feedback_comes_in_order_and_then_one_result(goals: Goals) -> None:
    """A second result of the same goal is none."""
    goals.send(1, 3)
    result = goals.result()
    assert goals.fed == [[0], [0, 1], [0, 1, 2]]
    assert (result.goal_id, result.status, result.failure, result.reason) == (1, GoalStatus.SUCCEEDED, "", "")
    assert sequence(result.fields) == [0, 1, 2]


def test_a_canceled_goal_has_a_result(goals: Goals) -> None:
    """It tells how far it has come; canceling it again changes nothing."""

    def cancel() -> None:
        if len(goals.fed) == 2:
            goals.transport.cancel_goal(1)

    goals.on_feedback = cancel
    goals.send(1, 50)
    result = goals.result()
    goals.transport.cancel_goal(1)
    assert (result.status, result.failure, result.reason) == (GoalStatus.CANCELED, "Canceled", "/count was canceled")
    assert sequence(result.fields)[:2] == [0, 1]


def test_an_aborted_goal_keeps_what_its_result_tells(goals: Goals) -> None:
    """Codes of failures are there."""
    goals.send(1, 99)
    result = goals.result()
    assert (result.status, result.failure) == (GoalStatus.ABORTED, "GoalFailed")
    assert sequence(result.fields) == [0, 1]


def test_a_goal_that_is_not_begun_says_why(goals: Goals) -> None:
    """By a class of failure, and a sentence."""
    goals.send(1, -1)
    result = goals.result()
    assert (result.status, result.failure) == (GoalStatus.ABORTED, "BadOrder")
    assert result.reason == "order is -1, should be 0 or more"


def test_an_action_that_there_is_not_is_a_failure_that_names_it(goals: Goals) -> None:
    """It comes as any other result."""
    goals.send(1, 3, action="/mount")
    result = goals.result()
    assert result.failure == "NoSuchAction"
    assert result.reason.startswith("there is no action /mount")


def test_what_is_no_open_goal_is_not_canceled(goals: Goals) -> None:
    """Nothing happens."""
    goals.transport.cancel_goal(7)
    goals.send(1, 2)
    assert goals.result().status is GoalStatus.SUCCEEDED


def test_an_action_that_is_there_is_not_said_to_be_gone(goals: Goals) -> None:
    """After a lost goal, its robot counts as back where it is connected, also where actions are not listed."""
    told: list[Mapping[int, bool | None]] = []
    goals.transport.reconcile([ServiceCall(id=1, service=COUNT, fields={}, timeout_s=WAIT_S)], told.append)
    goals.clock.run_until(lambda: bool(told))
    assert told[0][1] is not False
