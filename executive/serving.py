"""The simulated fleet of a site behind a rosbridge server, and in ROS 1, without an executive."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

from executive.errors import BadRequest
from executive.simulated_topics import offer_topics
from executive.wiring import Simulated, own_navigations, robot_handlers, simulated
from grounding.inprocess import Handler
from grounding.own_navigation import OWN_NAVIGATION_TYPE
from grounding.ros1.board import Ros1Board
from grounding.ros1.node import Master, Node
from grounding.ros1.package import write_package
from grounding.ros1.services import Services
from grounding.ros1.wire import Wire
from grounding.rosbridge.access import Access
from grounding.rosbridge.client import service_types
from grounding.rosbridge.hub import Hub
from grounding.rosbridge.server import Server, serve
from grounding.rosbridge.types import ServiceType
from kb.files import SHIPPED
from kb.store import KnowledgeBase

_LAST_PORT = 65535
_MASTER_S = 10.0


@contextmanager
def serve_simulated(
    site: str,
    *,
    scenario: str | Path | None,
    knowledge: str | Path | None,
    seed: int | None,
    host: str,
    port: int,
    master: Master | None = None,
    package: Path | None = None,
    access: Access | None = None,
) -> Iterator[tuple[Server, tuple[str, ...]]]:
    """Serve the robots of a site over rosbridge, in real time, without an executive.

    Beside their services, the robots offer their own navigation as an action, whether the knowledge has a use for it or
    not. The types of a service are those of its grounding; what the simulated robots can do beyond what is grounded has
    none, and is not offered.

    Args:
        master: Of ROS 1; the same services and topics, without actions, are offered there too.
        access: Who may connect and do what; anybody and everything if None.
        package: Folder into which the types of the services are written as a package of ROS 1.

    Yields:
        The server, and the names of the services, actions and topics.

    Raises:
        ConcertmasterError: The site, its ontology, the scenario or the address is not usable, or the master is not
            there.
        OSError: The package cannot be written.
    """
    if not 0 <= port <= _LAST_PORT:
        raise BadRequest("port", f"port {port} is none; give one from 1 to {_LAST_PORT}, or 0 for any that is free")
    allowed = access or Access()
    with ExitStack() as open_parts:
        with closing(KnowledgeBase(site, Path(knowledge or SHIPPED))) as base:
            world = simulated(base, scenario, seed)
            open_parts.callback(world.fleet.close)
            groundings = [g for g in base.snapshot().groundings.values() if g.on_robot]
            navigations = own_navigations(base.snapshot(), world.fleet, world.poses, world.clock)
        hub = Hub(world.clock, policy=allowed.policy)
        services, handlers = world.fleet.services(), robot_handlers(world.fleet, navigations)
        types = service_types(groundings, world.poses, hub.types)
        if package is not None:
            write_package(package, types.values(), Wire(hub.types))
        offered: list[str] = []
        for name, service_type in types.items():
            if name not in services:
                raise BadRequest("scenario", f"no simulated robot offers service {name}, which is grounded")
            hub.services.offer(name, service_type.name, handlers[name], services[name].latency_s)
            offered.append(name)
        for name, navigation in navigations.items():
            hub.actions.offer(name, OWN_NAVIGATION_TYPE, navigation.start)
            offered.append(name)
        offered += offer_topics(hub.topics, world.clock, world.poses, handlers, world.fleet.odometry)
        try:
            server = open_parts.enter_context(
                serve(hub, world.clock, host=host, port=port, tls=allowed.tls, max_sessions=allowed.clients)
            )
        except OSError as error:
            told = error.strerror or str(error)
            raise BadRequest("port", f"{host}:{port} cannot be listened at: {told}; give another --port") from error
        if master is not None:
            open_parts.enter_context(_in_ros_1(master, Wire(hub.types), server, world, types, handlers))
        yield server, tuple(sorted(offered))


@contextmanager
def _in_ros_1(
    master: Master,
    wire: Wire,
    server: Server,
    world: Simulated,
    types: Mapping[str, ServiceType],
    handlers: Mapping[str, Handler],
) -> Iterator[None]:
    """Offer services and topics of the simulated robots in ROS 1, on the thread of the server."""
    node = Node(master, complain=logging.getLogger(__name__).warning)
    offers = Services(node, wire, server.post, world.clock)
    services, there = world.fleet.services(), threading.Event()
    for name, service_type in types.items():
        offers.offer(name, service_type, handlers[name], services[name].latency_s)
    offer_topics(Ros1Board(node, wire, server.post), world.clock, world.poses, handlers, world.fleet.odometry)
    node.do(there.set)
    node.open()
    try:
        if not there.wait(_MASTER_S):
            raise BadRequest("ros1", f"{node.problem}; start one with `rosmaster --core` or `roscore`")
        yield
    finally:
        offers.close()
        node.close()
