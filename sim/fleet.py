"""The simulated fleet: what the executive's wiring sees of the simulator.

    with SimFleet(scenario, starts={"amigo_1": (1.0, 1.0, 0.8)}, clock=clock) as fleet:
        services = fleet.services()       # "/amigo_1/laser" and so on

The fleet follows the clock: before the time becomes t, all steps that end by t are done. Same scenario, seed and
calls give the same result bit for bit; every robot and sensor draws its own errors, so that calls to one robot do
not change what another one meets.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import as_file, files
from types import TracebackType
from typing import Self

import numpy as np

from grounding.messages import Odometry, Twist
from kb.clock import SimClock
from sim.doors import Door
from sim.errors import BadScenario, ServiceRefused
from sim.handling import REACH_M, Cargo, Thing
from sim.physics import Physics
from sim.robot import Base, Pose2
from sim.scenario import DoorChange, ObjectChange, RobotSetup, Scenario
from sim.sensors import Camera, Laser
from sim.world import Box, Point3

STEPS_PER_S = 240
_STEP_S = 1.0 / STEPS_PER_S
_SLACK_S = 1e-9  # a step that ends this little after the time asked for is still done: rounding

_LASER_LATENCY_S = 0.008
_BASE_LATENCY_S = 0.004
_KINECT_LATENCY_S = 0.08
_LOAD_LATENCY_S = 3.0
_SEE_DOOR_LATENCY_S = 0.1

_DOOR_SEEN_M = 4.0

_FLOOR_THICKNESS_M = 0.1

Reply = Mapping[str, object]
Handler = Callable[[Mapping[str, object]], Reply]


@dataclass(frozen=True, slots=True, kw_only=True)
class SimService:
    """A service of a robot.

    `handler` takes the fields of the request and gives those of the reply, as of the clock's present time; it
    raises `ServiceRefused` if the request is wrong. Who carries the reply delivers it `latency_s` later.
    """

    handler: Handler
    latency_s: float


class SimFleet:
    """Robots, rooms and objects of a scenario, in motion.

    Args:
        scenario: What there is.
        starts: For each robot of the scenario where it is told to stand: x, y (m), yaw (rad) in map. Where it truly
            stands differs by its placement error.
        clock: The time, which the fleet follows from now on.
        seed: Of all chance; that of the scenario if None.

    Raises:
        BadScenario: `starts` names other robots than the scenario, or a robot would stand in something.
    """

    def __init__(
        self, scenario: Scenario, *, starts: Mapping[str, Pose2], clock: SimClock, seed: int | None = None
    ) -> None:
        names = sorted(robot.name for robot in scenario.robots)
        if sorted(starts) != names:
            problem = f"starts are given for {', '.join(sorted(starts)) or 'none'}; needed for {', '.join(names)}"
            raise BadScenario(scenario.file, "robots", problem)
        self._clock = clock
        self._start_s = clock.now_s
        self._steps = 0
        self._collisions = 0
        self._open = True
        self._physics = Physics(_STEP_S)
        try:
            self._doors = {setup.name: Door(setup, self._physics) for setup in scenario.world.doors}
            self._things = self._furnish(scenario)
            seeds = np.random.SeedSequence(scenario.seed if seed is None else seed).spawn(len(names))
            setups = {robot.name: robot for robot in scenario.robots}
            self._bases: dict[str, Base] = {}
            self._cargos: dict[str, Cargo] = {}
            self._services: dict[str, SimService] = {}
            for name, robot_seed in zip(names, seeds, strict=True):
                self._add_robot(scenario, setups[name], starts[name], robot_seed)
            for name in names:
                self._check_free(scenario, name)
        except BadScenario:
            self._physics.close()
            raise
        clock.follow(self._advance_to)
        for change in scenario.changes:
            clock.call_at(self._start_s + change.at_s, functools.partial(self._change, change))

    def services(self) -> Mapping[str, SimService]:
        """The services of all robots by name: `/<robot>/laser`, `base`, `kinect`, `load`, `unload`, and for doors."""
        return dict(self._services)

    def odometry(self, robot: str) -> Odometry:
        """What the wheels of a robot tell now, as programs on board see it."""
        return self._bases[robot].odometry(self._clock.now_s)

    def true_pose(self, robot: str) -> Pose2:
        """Where a robot truly is: x, y (m), yaw (rad) in map. For tests and scoring only."""
        return self._bases[robot].pose

    def true_position(self, thing: str) -> Point3:
        """Where the bottom center of an object truly is (map, m). For tests and scoring only."""
        return self._things[thing].position

    def door_is_open(self, door: str) -> bool:
        """Whether a door is all open. For tests and scoring only."""
        return self._doors[door].is_open

    @property
    def collisions(self) -> int:
        """How many steps so far had a robot touch something. For tests and scoring only."""
        return self._collisions

    def close(self) -> None:
        """Free the world; the services refuse from now on, and the clock may go on."""
        if self._open:
            self._open = False
            self._physics.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _furnish(self, scenario: Scenario) -> dict[str, Thing]:
        """Add floor, walls, furniture and objects; gives the objects."""
        world = scenario.world
        low, high = (0.0, 0.0, -_FLOOR_THICKNESS_M), (*world.size_m, 0.0)
        self._physics.add_floor(Box(low=low, high=high, color=world.floor_color))
        for box in world.boxes:
            self._physics.add_box(box)
        things = {}
        for thing in scenario.objects:
            model = thing.model
            body = self._physics.add_cylinder(thing.position, model.radius_m, model.height_m, model.color)
            things[thing.name] = Thing(model=model, body=body, position=thing.position)
        return things

    def _add_robot(self, scenario: Scenario, setup: RobotSetup, told: Pose2, seed: np.random.SeedSequence) -> None:
        """Add a robot with its sensors and services. Each of its errors has its own source of chance."""
        name, physics = setup.name, self._physics
        placement, odometry, laser_noise, camera_noise = (np.random.default_rng(child) for child in seed.spawn(4))
        with as_file(files("sim") / "models" / setup.model.urdf) as urdf:
            body = physics.add_robot(str(urdf))
        laser_mount, camera_mount = physics.mount(body, "laser"), physics.mount(body, "camera")
        off_x, off_y, off_yaw = placement.standard_normal(3).tolist()
        placed_at = (
            told[0] + setup.placement_error_m * off_x,
            told[1] + setup.placement_error_m * off_y,
            math.remainder(told[2] + setup.placement_error_rad * off_yaw, math.tau),
        )
        base = Base(name, setup.model, physics, body, placed_at, _STEP_S, odometry)
        radius_m = physics.footprint_radius_m(body)
        laser = Laser(physics, base, laser_mount, radius_m, f"{name}/laser", laser_noise)
        camera = Camera(physics, base, camera_mount, f"{name}/camera", camera_noise)

        def answer_laser(request: Mapping[str, object]) -> Reply:
            self._check_request(f"/{name}/laser", request, {})
            return {"scan": laser.scan(self._clock.now_s)}

        def answer_base(request: Mapping[str, object]) -> Reply:
            self._check_request(f"/{name}/base", request, {"velocity": Twist})
            velocity = request["velocity"]
            assert isinstance(velocity, Twist)
            base.command(velocity, self._clock.now_s)
            return {"odometry": base.odometry(self._clock.now_s)}

        def answer_kinect(request: Mapping[str, object]) -> Reply:
            self._check_request(f"/{name}/kinect", request, {})
            color, depth, camera_info = camera.take(self._clock.now_s)
            return {"color": color, "depth": depth, "camera_info": camera_info}

        def answer_load(request: Mapping[str, object]) -> Reply:
            self._check_request(f"/{name}/load", request, {"object": str})
            taken = [cargo.held for cargo in self._cargos.values()]
            self._cargos[name].load(str(request["object"]), taken, self._clock.now_s)
            return {}

        def answer_unload(request: Mapping[str, object]) -> Reply:
            self._check_request(f"/{name}/unload", request, {})
            self._cargos[name].unload(self._clock.now_s)
            return {}

        self._bases[name] = base
        self._cargos[name] = Cargo(name, base, physics, scenario.world, self._things)
        self._services[f"/{name}/laser"] = SimService(handler=answer_laser, latency_s=_LASER_LATENCY_S)
        self._services[f"/{name}/base"] = SimService(handler=answer_base, latency_s=_BASE_LATENCY_S)
        self._services[f"/{name}/kinect"] = SimService(handler=answer_kinect, latency_s=_KINECT_LATENCY_S)
        self._services[f"/{name}/load"] = SimService(handler=answer_load, latency_s=_LOAD_LATENCY_S)
        self._services[f"/{name}/unload"] = SimService(handler=answer_unload, latency_s=_LOAD_LATENCY_S)
        if self._doors:
            self._add_door_services(name, base)

    def _add_door_services(self, name: str, base: Base) -> None:
        """A robot sees the doors that are near, and opens and closes those within its reach."""

        def answer_see(request: Mapping[str, object]) -> Reply:
            door = self._door_near(f"/{name}/see_door", request, base, _DOOR_SEEN_M)
            return {"is_open": door.is_open}

        def answer_slide(service: str, to_open: bool, request: Mapping[str, object]) -> Reply:
            self._door_near(service, request, base, REACH_M).slide(to_open=to_open)
            return {}

        slowest_s = max(door.travel_s for door in self._doors.values())
        self._services[f"/{name}/see_door"] = SimService(handler=answer_see, latency_s=_SEE_DOOR_LATENCY_S)
        for verb, to_open in (("open", True), ("close", False)):
            service = f"/{name}/{verb}_door"
            answer = functools.partial(answer_slide, service, to_open)
            self._services[service] = SimService(handler=answer, latency_s=slowest_s)

    def _door_near(self, service: str, request: Mapping[str, object], base: Base, reach_m: float) -> Door:
        self._check_request(service, request, {"door": str})
        name = str(request["door"])
        if name not in self._doors:
            known = ", ".join(sorted(self._doors))
            raise ServiceRefused("BadRequest", f"{service}: there is no door {name}; there is {known}")
        away_m = self._doors[name].distance_m(*base.pose[:2])
        if away_m > reach_m:
            problem = f"{name} is {away_m:.2f} m away; the reach is {reach_m:g} m"
            raise ServiceRefused("OutOfReach", f"{service}: {problem}")
        return self._doors[name]

    def _change(self, change: DoorChange | ObjectChange) -> None:
        """What the scenario says somebody does now."""
        if not self._open:
            return
        match change:
            case DoorChange():
                self._doors[change.door].slide(to_open=change.to_open)
            case ObjectChange():
                for cargo in self._cargos.values():
                    cargo.give_away(change.thing)
                thing = self._things[change.thing]
                thing.put(self._physics, change.position)

    def _check_free(self, scenario: Scenario, name: str) -> None:
        base = self._bases[name]
        if self._physics.overlaps(base.body):
            x, y, _ = base.pose
            problem = f"the robot would stand in something at ({x:.2f}, {y:.2f}); start it on free floor"
            raise BadScenario(scenario.file, f"robots.{name}.start", problem)

    def _check_request(self, service: str, request: Mapping[str, object], fields: Mapping[str, type]) -> None:
        """Refuse if the simulator ended, or a field is missing, unknown or of the wrong type."""
        if not self._open:
            raise ServiceRefused("Closed", f"{service}: the simulator has ended")
        if set(request) != set(fields):
            given, needed = ", ".join(sorted(request)) or "none", ", ".join(sorted(fields)) or "none"
            raise ServiceRefused("BadRequest", f"{service}: fields given: {given}; needed: {needed}")
        for key, kind in fields.items():
            if not isinstance(request[key], kind):
                problem = f"is {type(request[key]).__name__}; needed is {kind.__name__}"
                raise ServiceRefused("BadRequest", f"{service}: field {key} {problem}")

    def _advance_to(self, t_s: float) -> None:
        """Do all steps that end by `t_s`."""
        while self._open and self._start_s + (self._steps + 1) * _STEP_S <= t_s + _SLACK_S:
            step_start_s = self._start_s + self._steps * _STEP_S
            for base in self._bases.values():
                base.drive(step_start_s)
            self._physics.step()
            for base in self._bases.values():
                base.sense()
            for cargo in self._cargos.values():
                cargo.ride()
            for door in self._doors.values():
                door.advance(_STEP_S, [base.body for base in self._bases.values()])
            self._collisions += any(self._physics.touches(base.body) for base in self._bases.values())
            self._steps += 1
