"""Puts the parts of a simulated fleet together; the one place that names the simulator."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from executive.errors import BadRequest
from executive.live import LiveKnowledge
from executive.opening import Given, Robots, allow_files, begin, check_groundings, check_kept, prepare, start_of
from executive.pace import SIMULATED
from executive.shell import Shell
from executive.simulated_topics import offer_sensors
from grounding.compute.settings import ComputeSettings, read_settings
from grounding.faults import read_faults
from grounding.inprocess import Handler, InProcessTransport, Service
from grounding.messages import OccupancyGrid, PoseStamped, xyyaw
from grounding.own_navigation import Measures, OwnNavigation
from grounding.placed import Placed
from grounding.runner import compute as compute_here
from grounding.runner import compute_services
from kb.clock import Clock, SimClock
from kb.files import SHIPPED
from kb.history import Source, SourceKind
from kb.store import KnowledgeBase, Snapshot
from kb.user_folders import cache_folder
from kb.vocabulary import Kind, Property
from sim.fleet import SimFleet
from sim.scenario import Scenario, builtin_scenarios, load_scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """Everything that an open fleet consists of.

    Attributes:
        transport: What is served in this process.
        robots: How they are reached: the simulator, or connections.
    """

    knowledge: KnowledgeBase
    transport: InProcessTransport
    shell: Shell
    clock: Clock
    robots: Robots
    live: LiveKnowledge
    compute: Placed

    @property
    def simulation(self) -> SimFleet:
        """The simulated fleet, where the robots are simulated here."""
        assert isinstance(self.robots, SimFleet), "the robots are not simulated in this process"
        return self.robots


def open_simulated(given: Given, scenario: str | Path | None) -> Parts:
    """Load the knowledge of a site and start a simulated fleet there.

    Raises:
        ConcertmasterError: The site, its ontology, the scenario or a file is not usable; nothing was started.
    """
    settings = read_settings(given.compute, os.environ) if given.compute else ComputeSettings()
    injected = read_faults(given.faults) if given.faults else ()
    with ExitStack() as on_error:
        base = KnowledgeBase(given.site, Path(given.knowledge or SHIPPED))
        on_error.callback(base.close)
        world = simulated(base, scenario, given.seed)
        on_error.callback(world.fleet.close)
        snapshot, poses, clock, simulation = base.snapshot(), world.poses, world.clock, world.fleet
        check_kept(snapshot, settings, given.compute)
        placed = Placed(settings, cache_folder(os.environ) / "results")
        on_error.callback(placed.close)
        transport = _transport(simulation, poses, snapshot, clock, given.services, placed)
        check_groundings(snapshot, transport.offers, list(poses))
        on_error.pop_all()
    chosen_seed = world.scenario.seed if given.seed is None else given.seed
    shell = begin(
        given,
        base,
        transport,
        clock,
        SIMULATED,
        poses,
        placed,
        faults=injected,
        seed=chosen_seed,
        scenario=str(world.named),
    )
    live = LiveKnowledge(base, shell, SimulatedWorld(transport, clock, frozenset(poses), placed))
    return Parts(
        knowledge=base,
        transport=transport,
        shell=shell,
        clock=clock,
        robots=simulation,
        live=live,
        compute=placed,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulated:
    """A fleet that stands where it is said to."""

    named: str | Path
    scenario: Scenario
    poses: Mapping[str, PoseStamped]
    clock: SimClock
    fleet: SimFleet


def simulated(base: KnowledgeBase, scenario: str | Path | None, seed: int | None) -> Simulated:
    """Start the simulated robots of a site; what the scenario says of where things are is told to the knowledge.

    Raises:
        ConcertmasterError: The scenario or seed is not usable, or the knowledge is of other robots.
    """
    if seed is not None and seed < 0:
        raise BadRequest("seed", f"seed={seed} is no seed; give a whole number from 0")
    named = _scenario_for(base.snapshot().site) if scenario is None else scenario
    world = load_scenario(named)
    _check_names(base.snapshot(), world)
    for name, place in _told(world):
        base.tell(Property.LOCATED_AT, name, place, source=Source(kind=SourceKind.SCENARIO))
    snapshot = base.snapshot()
    poses = {robot.name: start_of(robot.name, snapshot) for robot in world.robots}
    clock = SimClock()
    starts = {name: xyyaw(pose.pose) for name, pose in poses.items()}
    fleet = SimFleet(world, starts=starts, clock=clock, seed=seed)
    return Simulated(named=named, scenario=world, poses=poses, clock=clock, fleet=fleet)


def _transport(
    simulation: SimFleet,
    poses: Mapping[str, PoseStamped],
    snapshot: Snapshot,
    clock: SimClock,
    services: Mapping[str, Handler],
    placed: Placed,
) -> InProcessTransport:
    """All services and actions: those of the robots, and those that compute."""
    transport = InProcessTransport(clock)
    navigations = own_navigations(snapshot, simulation, poses, clock)
    for name, navigation in navigations.items():
        transport.offer_action(name, navigation.start)
    handlers = robot_handlers(simulation, navigations)
    for name, service in simulation.services().items():
        transport.offer(name, Service(handler=handlers[name], latency_s=service.latency_s))
    offer_sensors(transport.topics, clock, list(poses), handlers, simulation.odometry)
    _offer_compute(transport, snapshot, clock, placed)
    durations = {g.service: g.duration_s for g in snapshot.groundings.values()}
    for name, handler in services.items():
        transport.offer(name, Service(handler=handler, latency_s=durations.get(name, 0.0)))
    return transport


def own_navigations(
    snapshot: Snapshot, simulation: SimFleet, poses: Mapping[str, PoseStamped], clock: SimClock
) -> dict[str, OwnNavigation]:
    """What drives the simulated robots by themselves, by the name of its action.

    Maps and measures are those that the loop of services is given; a site that has no such loop has no such navigation.

    Args:
        poses: Where the robots are told to stand.
    """
    fields = {g.service: g.request for g in snapshot.groundings.values()}
    files = {name: f.file for name, request in fields.items() for f in request if f.name == "map_file"}
    loc_map_file, nav_map_file = files.get("/compute/loc_map"), files.get("/compute/nav_map")
    if loc_map_file is None or nav_map_file is None:
        return {}
    told = {f.name: f.of_property for f in fields.get("/compute/vel_cmd", ()) if f.of_property}
    services, found = simulation.services(), dict[str, OwnNavigation]()
    for robot, pose in poses.items():
        known = {name: snapshot.ontology.value(prop, robot) for name, prop in told.items()}
        measures = {name: float(value) for name, value in known.items() if isinstance(value, int | float)}
        if measures:
            found[f"/{robot}/navigate_to_pose"] = OwnNavigation(
                Measures(loc_map_file=loc_map_file, nav_map_file=nav_map_file, **measures),
                clock,
                laser=services[f"/{robot}/laser"].handler,
                base=services[f"/{robot}/base"].handler,
                odometry=partial(simulation.odometry, robot),
                told=pose,
            )
    return found


def robot_handlers(simulation: SimFleet, navigations: Mapping[str, OwnNavigation]) -> dict[str, Handler]:
    """The services of the simulated robots; scans are taken through their navigation, which learns of them."""
    through = {f"{action.rpartition('/')[0]}/laser": navigation.scan for action, navigation in navigations.items()}
    return {name: through.get(name, service.handler) for name, service in simulation.services().items()}


def _offer_compute(transport: InProcessTransport, snapshot: Snapshot, clock: SimClock, placed: Placed) -> None:
    prepare(snapshot, placed)
    groundings = snapshot.groundings.values()
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
        check_groundings(snapshot, self._transport.offers, robots)

    def open_files(self, snapshot: Snapshot) -> None:
        allow_files(snapshot, self._placed)

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


def _told(scenario: Scenario) -> list[tuple[str, str]]:
    """What a scenario says of where things are, over what the ontology says."""
    told = [(robot.name, robot.start) for robot in scenario.robots]
    told += [(thing.name, thing.believed_at) for thing in scenario.objects]
    return [(name, place) for name, place in told if place is not None]


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
