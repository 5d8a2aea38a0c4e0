"""Puts the parts together; the one place that names the simulator."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from executive.errors import BadRequest
from executive.live import LiveKnowledge
from executive.recorder import Recorder
from executive.shell import Shell
from executive.trace import FleetOpened
from executive.travel import PLACES
from grounding.compute.registry import is_compute_service, wrong_fields
from grounding.compute.settings import ComputeSettings, read_settings
from grounding.errors import GroundingError
from grounding.faults import FaultyTransport, read_faults
from grounding.ground import pose_of
from grounding.inprocess import Handler, InProcessTransport, Service
from grounding.messages import OccupancyGrid, PoseStamped, is_type, xyyaw
from grounding.rosbridge.client import service_types
from grounding.rosbridge.hub import Hub
from grounding.rosbridge.server import Server, serve
from grounding.runner import compute as compute_here
from grounding.runner import compute_services
from grounding.workers import Placed
from kb.clock import SimClock
from kb.files import SHIPPED
from kb.history import Source, SourceKind
from kb.store import KnowledgeBase, Snapshot
from kb.terms import Fluent
from kb.vocabulary import Kind, Property
from sim.fleet import SimFleet
from sim.scenario import Scenario, builtin_scenarios, load_scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """Everything that an open fleet consists of."""

    knowledge: KnowledgeBase
    transport: InProcessTransport
    shell: Shell
    clock: SimClock
    simulation: SimFleet
    live: LiveKnowledge
    compute: Placed


def open_simulated(
    site: str,
    *,
    scenario: str | Path | None,
    knowledge: str | Path | None,
    seed: int | None,
    trace: Path | None,
    services: Mapping[str, Handler],
    compute: Path | None,
    faults: Path | None,
) -> Parts:
    """Load the knowledge of a site and start a simulated fleet there.

    Args:
        services: Compute services beside ours, by name; each takes as long as its process says.
        compute: Settings: where compute services run.
        faults: What goes wrong with calls.

    Raises:
        ConcertmasterError: The site, its ontology, the scenario or a file is not usable; nothing was started.
    """
    settings = read_settings(compute, os.environ) if compute else ComputeSettings()
    injected = read_faults(faults) if faults else ()
    with ExitStack() as on_error:
        base = KnowledgeBase(site, Path(knowledge or SHIPPED))
        on_error.callback(base.close)
        simulated = _simulated(base, scenario, seed)
        on_error.callback(simulated.fleet.close)
        snapshot, poses, clock, simulation = base.snapshot(), simulated.poses, simulated.clock, simulated.fleet
        placed = Placed(settings)
        transport = _transport(simulation, snapshot, clock, services, placed)
        _check_groundings(snapshot, transport, list(poses))
        on_error.pop_all()
    chosen_seed = simulated.world.seed if seed is None else seed
    recorder = Recorder(trace)
    chance = np.random.default_rng([chosen_seed, _OF_FAULTS])
    shell = Shell(base, FaultyTransport(transport, clock, injected, chance), clock, recorder)
    for name, pose in poses.items():
        shell.remember(Fluent(Property.HAS_POSE_ESTIMATE, name), pose)
    recorder.record(
        FleetOpened(
            t_s=clock.now_s,
            site=site,
            robots=list(poses),
            knowledge=snapshot.ontology.files.digest,
            scenario=str(simulated.scenario),
            seed=chosen_seed,
            compute=str(compute or ""),
            faults=str(faults or ""),
        )
    )
    live = LiveKnowledge(base, shell, SimulatedWorld(transport, clock, frozenset(poses), placed))
    return Parts(
        knowledge=base,
        transport=transport,
        shell=shell,
        clock=clock,
        simulation=simulation,
        live=live,
        compute=placed,
    )


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
            simulated = _simulated(base, scenario, seed)
            open_parts.callback(simulated.fleet.close)
            groundings = [g for g in base.snapshot().groundings.values() if g.on_robot]
        hub = Hub(simulated.clock)
        services = simulated.fleet.services()
        offered: list[str] = []
        for name, service_type in service_types(groundings, simulated.poses, hub.types).items():
            if name not in services:
                raise BadRequest("scenario", f"no simulated robot offers service {name}, which is grounded")
            hub.services.offer(name, service_type.name, services[name].handler, services[name].latency_s)
            offered.append(name)
        try:
            server = open_parts.enter_context(serve(hub, simulated.clock, host=host, port=port))
        except OSError as error:
            told = error.strerror or str(error)
            raise BadRequest("port", f"{host}:{port} cannot be listened at: {told}; give another --port") from error
        yield server, tuple(sorted(offered))


_LAST_PORT = 65535


@dataclass(frozen=True, slots=True, kw_only=True)
class _Simulated:
    """A fleet that stands where it is said to."""

    scenario: str | Path
    world: Scenario
    poses: Mapping[str, PoseStamped]
    clock: SimClock
    fleet: SimFleet


def _simulated(base: KnowledgeBase, scenario: str | Path | None, seed: int | None) -> _Simulated:
    """Start the simulated robots of a site; what the scenario says of where things are is told to the knowledge."""
    if seed is not None and seed < 0:
        raise BadRequest("seed", f"seed={seed} is no seed; give a whole number from 0")
    named = _scenario_for(base.snapshot().site) if scenario is None else scenario
    world = load_scenario(named)
    _check_names(base.snapshot(), world)
    for name, place in _told(world):
        base.tell(Property.LOCATED_AT, name, place, source=Source(kind=SourceKind.SCENARIO))
    snapshot = base.snapshot()
    poses = {robot.name: _start_of(robot.name, snapshot) for robot in world.robots}
    clock = SimClock()
    starts = {name: xyyaw(pose.pose) for name, pose in poses.items()}
    fleet = SimFleet(world, starts=starts, clock=clock, seed=seed)
    return _Simulated(scenario=named, world=world, poses=poses, clock=clock, fleet=fleet)


_OF_FAULTS = 1
"""Keeps the chance of faults apart from that of the simulator, which has the same seed."""


def _transport(
    simulation: SimFleet, snapshot: Snapshot, clock: SimClock, services: Mapping[str, Handler], placed: Placed
) -> InProcessTransport:
    """All services: those of the robots, and those that compute."""
    transport = InProcessTransport(clock)
    for name, service in simulation.services().items():
        transport.offer(name, Service(handler=service.handler, latency_s=service.latency_s))
    _offer_compute(transport, snapshot, clock, placed)
    durations = {g.service: g.duration_s for g in snapshot.groundings.values()}
    for name, handler in services.items():
        transport.offer(name, Service(handler=handler, latency_s=durations.get(name, 0.0)))
    return transport


def _offer_compute(transport: InProcessTransport, snapshot: Snapshot, clock: SimClock, placed: Placed) -> None:
    groundings = snapshot.groundings.values()
    for file in {field.file for g in groundings for field in g.request if field.file is not None}:
        placed.allow(file.parent)
    durations = {g.service: g.duration_s for g in groundings if not g.on_robot}
    for name, offered in compute_services(clock, durations, placed).items():
        transport.offer(name, offered)


class SimulatedWorld:
    """Whether the simulated robots and the services are as knowledge says; they are there from the beginning."""

    def __init__(self, transport: InProcessTransport, clock: SimClock, robots: frozenset[str], placed: Placed) -> None:
        self._transport, self._clock, self._robots, self._placed = transport, clock, robots, placed

    def check(self, snapshot: Snapshot) -> None:
        robots = snapshot.ontology.individuals(Kind.ROBOT)
        for robot in robots:
            if robot not in self._robots:
                told = f"{robot} is in the files but not in this fleet, whose simulated robots are those that it was "
                told += f"opened with: {', '.join(sorted(self._robots))}"
                raise BadRequest(robot, f"{told}; open a fleet with a scenario that has {robot}, or leave it out")
        _check_groundings(snapshot, self._transport, robots)

    def adapt(self, snapshot: Snapshot) -> None:
        _offer_compute(self._transport, snapshot, self._clock, self._placed)


def site_map(snapshot: Snapshot) -> OccupancyGrid:
    """The map of a site for pictures: the first that a service gives for a file alone."""
    for grounding in snapshot.groundings.values():
        types = [field.message_type for field in grounding.reply]
        files = [field.file for field in grounding.request if field.file is not None]
        if types == [_MAP] and len(files) == len(grounding.request) == 1:
            fields = {grounding.request[0].name: str(files[0])}
            found = compute_here(grounding.service, fields, t_s=0.0)[grounding.reply[0].name]
            assert isinstance(found, OccupancyGrid)
            return found
    raise BadRequest(
        "site", f"no service of site {snapshot.site} gives a map for a file alone, so there is none to draw"
    )


_MAP = "nav_msgs/OccupancyGrid"


def _scenario_for(site: str) -> str:
    """The shipped scenario of a site's own name, else the first that plays there."""
    names = [name for name in builtin_scenarios() if load_scenario(name).site == site]
    if not names:
        raise BadRequest("scenario", f"no shipped scenario plays at {site}; give a scenario file")
    return site if site in names else names[0]


def _check_groundings(snapshot: Snapshot, transport: InProcessTransport, robots: list[str]) -> None:
    """What can be found out before anything moves: services that are not there, fields and types they don't have."""
    for grounding in snapshot.groundings.values():
        for field in (*grounding.request, *grounding.reply):
            if not is_type(field.message_type):
                raise GroundingError(grounding.process, field.name, f"there is no ROS type {field.message_type}")
        if grounding.on_robot:
            for robot in robots:
                if not transport.offers(name := grounding.service.replace("{robot}", robot)):
                    raise GroundingError(grounding.process, grounding.name, f"{robot} offers no service {name}")
        elif transport.offers(grounding.service) and not is_compute_service(grounding.service):
            continue  # what fields it takes, only whoever offers it knows
        elif wrong := wrong_fields(grounding.service, {field.name for field in grounding.request}):
            raise GroundingError(grounding.process, grounding.name, wrong)
    for estimate in snapshot.travel_estimates:
        if wrong := wrong_fields(estimate.service, {PLACES, *(field.name for field in estimate.request)}):
            raise GroundingError("TravelDuration", estimate.service, wrong)


def _told(scenario: Scenario) -> list[tuple[str, str]]:
    """What a scenario says of where things are, over what the ontology says."""
    told = [(robot.name, robot.start) for robot in scenario.robots]
    told += [(thing.name, thing.believed_at) for thing in scenario.objects]
    return [(name, place) for name, place in told if place is not None]


def _start_of(robot: str, snapshot: Snapshot) -> PoseStamped:
    place = snapshot.value(Property.LOCATED_AT, robot)
    if place is None:
        told = f"it is not known where {robot} stands; give it locatedAt in the ontology, or start in the scenario"
        raise BadRequest(robot, told)
    return pose_of(str(place), snapshot, t_s=0.0)


def _check_names(snapshot: Snapshot, scenario: Scenario) -> None:
    """What a scenario names must be there in the knowledge base, and the other way round."""
    robots, ontology = {robot.name for robot in scenario.robots}, snapshot.ontology
    known = set(ontology.individuals(Kind.ROBOT))
    if robots != known:
        raise BadRequest(
            "scenario",
            f"scenario {scenario.name} has the robots {', '.join(sorted(robots))}, "
            f"site {snapshot.site} has {', '.join(sorted(known))}; they must be the same",
        )
    for name, place in _told(scenario):
        for individual, kind in ((name, None), (place, Kind.LOCATION)):
            if individual not in ontology.kinds or (kind and not ontology.is_a(individual, kind)):
                told = f"is no {kind} of" if kind else "is not known at"
                raise BadRequest("scenario", f"scenario {scenario.name}: {individual} {told} site {snapshot.site}")
