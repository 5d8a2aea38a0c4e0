"""The simulated fleet of a site behind a rosbridge server, without an executive."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

from executive.errors import BadRequest
from executive.wiring import simulated
from grounding.rosbridge.client import service_types
from grounding.rosbridge.hub import Hub
from grounding.rosbridge.server import Server, serve
from kb.files import SHIPPED
from kb.store import KnowledgeBase

_LAST_PORT = 65535


@contextmanager
def serve_simulated(
    site: str,
    *,
    scenario: str | Path | None,
    knowledge: str | Path | None,
    seed: int | None,
    host: str,
    port: int,
) -> Iterator[tuple[Server, tuple[str, ...]]]:
    """Serve the robots of a site over rosbridge, in real time, without an executive.

    The types of a service are those of its grounding; what the simulated robots can do beyond what is grounded has
    none, and is not offered.

    Yields:
        The server, and the names of the services.

    Raises:
        ConcertmasterError: The site, its ontology, the scenario or the address is not usable.
    """
    if not 0 <= port <= _LAST_PORT:
        raise BadRequest("port", f"port {port} is none; give one from 1 to {_LAST_PORT}, or 0 for any that is free")
    with ExitStack() as open_parts:
        with closing(KnowledgeBase(site, Path(knowledge or SHIPPED))) as base:
            world = simulated(base, scenario, seed)
            open_parts.callback(world.fleet.close)
            groundings = [g for g in base.snapshot().groundings.values() if g.on_robot]
        hub = Hub(world.clock)
        services = world.fleet.services()
        offered: list[str] = []
        for name, service_type in service_types(groundings, world.poses, hub.types).items():
            if name not in services:
                raise BadRequest("scenario", f"no simulated robot offers service {name}, which is grounded")
            hub.services.offer(name, service_type.name, services[name].handler, services[name].latency_s)
            offered.append(name)
        try:
            server = open_parts.enter_context(serve(hub, world.clock, host=host, port=port))
        except OSError as error:
            told = error.strerror or str(error)
            raise BadRequest("port", f"{host}:{port} cannot be listened at: {told}; give another --port") from error
        yield server, tuple(sorted(offered))
