"""Puts the parts together of a fleet that is elsewhere: robots behind rosbridge servers, in ROS 2 or 1, in real time.

What a robot does is called over its connection; what is computed runs here. Planning and deciding take the time that
they take.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from executive.errors import BadRequest
from executive.live import LiveKnowledge
from executive.opening import Given, allow_files, begin, check_groundings, check_kept, prepare, start_of
from executive.pace import REAL
from executive.wiring import Parts
from grounding.actions import Carrier, Goal, GoalResult
from grounding.compute.settings import ComputeSettings, read_settings
from grounding.faults import read_faults
from grounding.inprocess import InProcessTransport, Service
from grounding.placed import Placed
from grounding.ros1.client import Ros1Transport
from grounding.ros1.node import Master
from grounding.ros2.client import Ros2Transport
from grounding.rosbridge.client import RosbridgeTransport, action_types, service_types
from grounding.rosbridge.endpoints import ROS_2, Reached, reached
from grounding.rosbridge.types import Types
from grounding.runner import ComputeTransport
from grounding.topics import Heard
from grounding.transport import ServiceCall, ServiceReply, Transport
from kb.clock import Callback, WallClock
from kb.errors import ConcertmasterError
from kb.files import SHIPPED
from kb.store import KnowledgeBase, Snapshot
from kb.user_folders import cache_folder
from kb.vocabulary import Kind

_PATIENCE_S = 10.0
"""For a robot to answer when the fleet is opened."""


class NotConnected(ConcertmasterError):
    """A robot cannot be reached."""

    fault = "world"


def open_connected(given: Given, connect: str | Path) -> Parts:
    """Load the knowledge of a site and connect to its robots.

    Args:
        connect: Where they are: the address of a rosbridge server that has them all (`ws://`, `wss://`), that of the
            master of ROS 1 (`http://`), `ros2:` for ROS 2, or a file (see grounding/rosbridge/endpoints.py).

    Raises:
        NotConnected: A robot does not answer.
        ConcertmasterError: The site, its ontology or a file is not usable, or a robot does not offer what is
            grounded. No robot has moved, and no connection is left.
    """
    settings = read_settings(given.compute, os.environ) if given.compute else ComputeSettings()
    injected = read_faults(given.faults) if given.faults else ()
    seed = given.seed or 0
    clock = WallClock()
    with ExitStack() as on_error:
        base = KnowledgeBase(given.site, Path(given.knowledge or SHIPPED))
        on_error.callback(base.close)
        snapshot = base.snapshot()
        names = snapshot.ontology.individuals(Kind.ROBOT)
        poses = {robot: start_of(robot, snapshot) for robot in names}
        robots = ConnectedRobots(snapshot, _where(connect, names), clock, seed)
        on_error.callback(robots.close)
        check_kept(snapshot, settings, given.compute)
        placed = Placed(settings, cache_folder(os.environ) / "results")
        on_error.callback(placed.close)
        own = InProcessTransport(clock)
        for name, handler in given.services.items():
            own.offer(name, Service(handler=handler, latency_s=0.0))
        robots.connect()
        world = _ConnectedWorld(robots, own, placed)
        world.check(snapshot)
        world.adapt(snapshot)
        on_error.pop_all()
    routed = _Routed(robots, own, ComputeTransport(clock, placed))
    shell = begin(given, base, routed, clock, REAL, poses, placed, faults=injected, seed=seed, connect=str(connect))
    live = LiveKnowledge(base, shell, world)
    return Parts(knowledge=base, transport=own, shell=shell, clock=clock, robots=robots, live=live, compute=placed)


_Fields = tuple[tuple[str, str], ...]
_Place = Reached | Master
_Connection = RosbridgeTransport | Ros1Transport


def _where(connect: str | Path, robots: list[str]) -> Mapping[str, _Place]:
    if isinstance(connect, str) and connect.startswith("http://"):
        return dict.fromkeys(robots, Master(uri=connect))
    return reached(connect, robots, os.environ)


class ConnectedRobots:
    """The connections to all robots; those at one address share one."""

    def __init__(self, snapshot: Snapshot, where: Mapping[str, _Place], clock: WallClock, seed: int) -> None:
        self._clock = clock
        self._where = dict(where)
        self._fields = _fields_of_services(snapshot, self.names)
        self._by_service: dict[str, _Connection] = {}
        self._unlisted: set[str] = set()
        self._connections: dict[_Place, _Connection] = {}
        self._offered: dict[_Connection, frozenset[str] | None] = {}
        types, groundings = Types(), [g for g in snapshot.groundings.values() if g.on_robot]
        for number, one in enumerate(dict.fromkeys(self._where.values())):
            services = service_types(groundings, self._at(one), types)
            actions = action_types(groundings, self._at(one), types)
            rng = np.random.default_rng([seed, _OF_DELAYS, number])
            if isinstance(one, Master):
                made: _Connection = Ros1Transport(one, clock, services=services, actions=actions, types=types)
            elif one.endpoint.uri == ROS_2:
                made = Ros2Transport(clock, services=services, actions=actions, types=types, rng=rng)
            else:
                made = RosbridgeTransport(
                    one.endpoint,
                    clock,
                    services=services,
                    actions=actions,
                    types=types,
                    binary=one.binary,
                    rng=rng,
                )
            self._connections[one] = made
            topics = [g.service.replace("{robot}", robot) for g in groundings if g.is_topic for robot in self._at(one)]
            self._by_service |= dict.fromkeys([*services, *actions, *topics], made)
            self._unlisted.update(actions, topics)

    @property
    def names(self) -> list[str]:
        """The robots, by name."""
        return sorted(self._where)

    def connect(self) -> None:
        """Connect to all, and ask what they offer.

        Raises:
            NotConnected: One does not answer.
        """
        for transport in self._connections.values():
            transport.open()
        for one, transport in self._connections.items():
            if not transport.wait_connected(_PATIENCE_S):
                uri, what = (one.uri, "master") if isinstance(one, Master) else (one.endpoint.uri, "rosbridge server")
                told = f"{' and '.join(self._at(one))} cannot be reached at {uri}: {transport.problem}"
                raise NotConnected(f"{told}; is a {what} running there?")
            self._offered[transport] = self._ask(transport)

    def of(self, service: str) -> Carrier | None:
        """What carries the calls to a service of a robot, the goals to an action, or what is said on a topic."""
        return self._by_service.get(service)

    def offers(self, service: str) -> bool:
        """Whether a robot offered a service when it was connected; true if its server could not tell.

        Of actions and topics, none can.
        """
        transport = self._by_service.get(service)
        if transport is None:
            return False
        offered = self._offered[transport]
        return offered is None or service in offered or service in self._unlisted

    def check(self, snapshot: Snapshot) -> None:
        """Whether knowledge is of these robots, and of services with the fields that they have had.

        Raises:
            BadRequest: It is of others.
        """
        for robot in snapshot.ontology.individuals(Kind.ROBOT):
            if robot not in self._where:
                told = f"{robot} is in the files but not in this fleet, whose robots are {', '.join(self.names)}"
                raise BadRequest(robot, f"{told}; connect a fleet to {robot} too, or leave it out")
        for service, fields in _fields_of_services(snapshot, self.names).items():
            if self._fields.get(service) != fields:
                told = f"{service} had other fields, or was not there, when this fleet was connected"
                raise BadRequest(service, f"{told}; open the fleet again")

    def close(self) -> None:
        """End all connections."""
        for transport in self._connections.values():
            transport.close()

    def _at(self, one: _Place) -> list[str]:
        return [robot for robot in self.names if self._where[robot] == one]

    def _ask(self, transport: _Connection) -> frozenset[str] | None:
        """The names of all services at the far end; None if it does not tell, as it runs no rosapi."""
        found: list[frozenset[str] | None] = []
        transport.services(lambda names: found.append(None if names is None else frozenset(names)))
        self._clock.run_until(lambda: bool(found))
        return found[0]


_OF_DELAYS = 2
"""Keeps the chance of delays apart from that of faults."""


def _fields_of_services(snapshot: Snapshot, robots: list[str]) -> dict[str, tuple[_Fields, _Fields]]:
    """The fields of request and reply of each service of the robots, by full name."""
    return {
        grounding.service.replace("{robot}", robot): (
            tuple((field.name, field.message_type) for field in grounding.request),
            tuple((field.name, field.message_type) for field in grounding.reply),
        )
        for grounding in snapshot.groundings.values()
        if grounding.on_robot
        for robot in robots
    }


class _Routed:
    """Each call or goal to where it is answered: a robot, whoever opened the fleet, or our own computations."""

    def __init__(self, robots: ConnectedRobots, own: InProcessTransport, computed: Transport) -> None:
        self._robots, self._own, self._computed = robots, own, computed
        self._carriers: dict[int, Carrier] = {}

    def call(self, call: ServiceCall, deliver: Callable[[ServiceReply], None]) -> None:
        self._of(call).call(call, deliver)

    def reconcile(self, calls: Iterable[ServiceCall], told: Callable[[Mapping[int, bool | None]], None]) -> None:
        for call in calls:
            self._of(call).reconcile([call], told)

    def _of(self, call: ServiceCall) -> Transport:
        own = self._own if self._own.offers(call.service) else self._computed
        return self._robots.of(call.service) or own

    def send_goal(
        self, goal: Goal, feedback: Callable[[Mapping[str, object]], None], done: Callable[[GoalResult], None]
    ) -> None:
        carrier = self._carriers[goal.id] = self._robots.of(goal.action) or self._own

        def ended(result: GoalResult) -> None:
            self._carriers.pop(goal.id, None)
            done(result)

        carrier.send_goal(goal, feedback, ended)

    def cancel_goal(self, goal_id: int) -> None:
        if goal_id in self._carriers:
            self._carriers[goal_id].cancel_goal(goal_id)

    def hear_topic(self, topic: str, message_type: str, heard: Heard) -> Callback:
        return (self._robots.of(topic) or self._own).hear_topic(topic, message_type, heard)


class _ConnectedWorld:
    """Whether the robots and services are as knowledge says."""

    def __init__(self, robots: ConnectedRobots, own: InProcessTransport, placed: Placed) -> None:
        self._robots, self._own, self._placed = robots, own, placed

    def check(self, snapshot: Snapshot) -> None:
        self._robots.check(snapshot)
        check_groundings(snapshot, self._offers, self._robots.names)

    def open_files(self, snapshot: Snapshot) -> None:
        allow_files(snapshot, self._placed)

    def adapt(self, snapshot: Snapshot) -> None:
        prepare(snapshot, self._placed)

    def _offers(self, service: str) -> bool:
        return self._robots.offers(service) or self._own.offers(service)
