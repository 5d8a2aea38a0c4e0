"""How long it takes from a robot's message to an answer of Prolog: row 8 of the benchmark of the knowledge base.

A client publishes where a drink is to a rosbridge server in another process; the client that the knowledge base
listens with gets it from there, tells it, and asks Prolog until the answer is the new place.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
from rosbags.typesys.stores.ros2_humble import std_msgs__msg__String as String

from grounding.rosbridge.client import RosbridgeTransport
from grounding.rosbridge.connection import Endpoint
from grounding.rosbridge.types import Types
from kb.clock import WallClock
from kb.store import KnowledgeBase
from tests.benchmarks.canned import far_end_process

_TOPIC = "/drink_1/place"


def seconds_from_message_to_answer(
    knowledge: KnowledgeBase, places_of_drink_1: Callable[[], Sequence[object]], messages: int
) -> list[float]:
    """For each message the time from publishing it until Prolog answers what it says.

    Args:
        places_of_drink_1: Asks Prolog where `drink_1` is.
    """
    clock, types, spent = WallClock(), Types(), list[float]()
    answers: list[Sequence[object]] = []

    def told(message: object) -> None:
        assert isinstance(message, String)
        knowledge.tell("locatedAt", "drink_1", message.data, t_s=clock.now_s)
        answers.append(places_of_drink_1())

    with far_end_process() as uri, _client(uri, clock, types) as robot, _client(uri, clock, types) as listener:
        assert robot.wait_connected(30.0), robot.problem
        assert listener.wait_connected(30.0), listener.problem
        listener.subscribe(_TOPIC, "std_msgs/String", told)
        robot.advertise(_TOPIC, "std_msgs/String", latch=True)  # who subscribes late hears it too
        for number in range(messages):
            place = ("at_bar", "at_side_table")[number % 2]
            begun = time.perf_counter()
            assert robot.publish(_TOPIC, String(data=place))
            assert clock.run_until(lambda number=number: len(answers) > number)  # type: ignore[misc]
            spent.append(time.perf_counter() - begun)
            assert answers[-1] == [place]
    return spent


def _client(uri: str, clock: WallClock, types: Types) -> RosbridgeTransport:
    rng = np.random.default_rng(1)
    return RosbridgeTransport(Endpoint(uri=uri), clock, services={}, types=types, rng=rng)
