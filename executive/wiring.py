"""Puts the parts together; the one place that names the simulator."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from executive.errors import BadRequest
from executive.recorder import Recorder
from executive.shell import Shell
from executive.trace import FleetOpened
from grounding.ground import pose_of
from grounding.inprocess import InProcessTransport, Service
from grounding.messages import OccupancyGrid, xyyaw
from grounding.runner import compute, compute_services
from kb.clock import SimClock
from kb.files import SHIPPED
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


def open_simulated(
    site: str, *, scenario: str | Path | None, knowledge: Path | None, seed: int | None, trace: Path | None
) -> Parts:
    """Load the knowledge of a site and start a simulated fleet there.

    Raises:
        ConcertmasterError: The site, its ontology or the scenario is not usable; nothing was started.
    """
    base = KnowledgeBase(site, knowledge or SHIPPED)
    try:
        named = _scenario_for(site) if scenario is None else scenario
        world = load_scenario(named)
        _check_names(base.snapshot(), world)
        for robot in world.robots:
            base.tell(Property.LOCATED_AT, robot.name, robot.start)
        for thing in world.objects:
            base.tell(Property.LOCATED_AT, thing.name, thing.believed_at)
        snapshot = base.snapshot()
        clock = SimClock()
        starts = {robot.name: xyyaw(pose_of(robot.start, snapshot, t_s=0.0).pose) for robot in world.robots}
        simulation = SimFleet(world, starts=starts, clock=clock, seed=seed)
    except Exception:
        base.close()
        raise
    transport = InProcessTransport(clock)
    for name, service in simulation.services().items():
        transport.offer(name, Service(handler=service.handler, latency_s=service.latency_s))
    durations = {g.service: g.duration_s for g in snapshot.groundings.values() if not g.on_robot}
    for name, offered in compute_services(clock, durations).items():
        transport.offer(name, offered)
    recorder = Recorder(trace)
    shell = Shell(base, transport, clock, recorder)
    for robot in world.robots:
        shell.remember(Fluent(Property.HAS_POSE_ESTIMATE, robot.name), pose_of(robot.start, snapshot, t_s=0.0))
    recorder.record(
        FleetOpened(
            t_s=clock.now_s,
            site=site,
            robots=[robot.name for robot in world.robots],
            knowledge=snapshot.ontology.files.digest,
            scenario=str(named),
            seed=world.seed if seed is None else seed,
        )
    )
    return Parts(knowledge=base, transport=transport, shell=shell, clock=clock, simulation=simulation)


def site_map(snapshot: Snapshot) -> OccupancyGrid:
    """The map of a site for pictures: the first that a service gives for a file alone."""
    for grounding in snapshot.groundings.values():
        types = [field.message_type for field in grounding.reply]
        files = [field.file for field in grounding.request if field.file is not None]
        if types == [_MAP] and len(files) == len(grounding.request) == 1:
            fields = {grounding.request[0].name: str(files[0])}
            found = compute(grounding.service, fields, t_s=0.0)[grounding.reply[0].name]
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
    places = [(r.name, r.start) for r in scenario.robots] + [(o.name, o.believed_at) for o in scenario.objects]
    for name, place in places:
        for individual, kind in ((name, None), (place, Kind.LOCATION)):
            if individual not in ontology.kinds or (kind and not ontology.is_a(individual, kind)):
                told = f"is no {kind} of" if kind else "is not known at"
                raise BadRequest("scenario", f"scenario {scenario.name}: {individual} {told} site {snapshot.site}")
