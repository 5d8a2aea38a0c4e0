"""What opening a fleet has in common, wherever its robots are: what is given, checked, and recorded first."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from executive.errors import BadRequest
from executive.pace import Pace
from executive.recorder import Recorder
from executive.shell import Shell
from executive.trace import FleetOpened
from executive.travel import PLACES, STARTS
from grounding.actions import Carrier
from grounding.compute.registry import is_compute_service, wrong_fields
from grounding.compute.settings import BadComputeSettings, ComputeSettings
from grounding.errors import GroundingError
from grounding.faults import Fault, FaultyTransport
from grounding.ground import pose_of
from grounding.inprocess import Handler
from grounding.messages import PoseStamped, is_type
from grounding.placed import Placed
from kb.clock import Clock
from kb.groundings import must_offer
from kb.store import KnowledgeBase, Snapshot
from kb.terms import Fluent
from kb.vocabulary import Property


class Robots(Protocol):
    """What has to be ended with a fleet."""

    def close(self) -> None:
        """End it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """What a fleet is opened with, wherever its robots are.

    Attributes:
        knowledge: Folder of ontologies; the shipped ones if None.
        seed: Of all chance; the scenario's if None.
        services: Compute services beside ours, by name; in simulated time, each takes as long as its process says.
        compute: Settings: where compute services run.
        faults: What goes wrong with calls.
    """

    site: str
    knowledge: str | Path | None
    seed: int | None
    trace: Path | None
    services: Mapping[str, Handler]
    compute: Path | None
    faults: Path | None


def begin(
    given: Given,
    base: KnowledgeBase,
    transport: Carrier,
    clock: Clock,
    pace: Pace,
    poses: Mapping[str, PoseStamped],
    placed: Placed,
    *,
    faults: Sequence[Fault],
    seed: int,
    scenario: str = "",
    connect: str = "",
) -> Shell:
    """The executive of a fleet whose parts are there; the first event of its trace tells what it was opened with.

    Args:
        poses: Where each robot is told to stand.
        placed: Where compute services run, also those that planning asks.
        faults: What goes wrong with calls.
        seed: Of all chance.
        scenario: Of simulated robots.
        connect: Where other robots are.
    """
    recorder = Recorder(given.trace)
    chance = np.random.default_rng([seed, _OF_FAULTS])
    shell = Shell(base, FaultyTransport(transport, clock, faults, chance), clock, recorder, pace)
    shell.compute, shell.metrics.known = placed, placed.cache_counts
    for name, pose in poses.items():
        shell.remember(Fluent(Property.HAS_POSE_ESTIMATE, name), pose)
    recorder.record(
        FleetOpened(
            t_s=clock.now_s,
            site=given.site,
            robots=list(poses),
            knowledge=base.snapshot().ontology.files.digest,
            scenario=scenario,
            seed=seed,
            compute=str(given.compute or ""),
            faults=str(given.faults or ""),
            connect=connect,
        )
    )
    return shell


_OF_FAULTS = 1
"""Keeps the chance of faults apart from that of the simulator, which has the same seed."""


def prepare(snapshot: Snapshot, placed: Placed) -> None:
    """Let compute services read what is beside the files of knowledge, and keep what it says is always the same."""
    allow_files(snapshot, placed)
    groundings = snapshot.groundings.values()
    cacheable = {g.service for g in groundings if g.cacheable and g.deterministic and not g.on_robot}
    placed.may_keep(cacheable | {estimate.service for estimate in snapshot.travel_estimates})


def allow_files(snapshot: Snapshot, placed: Placed) -> None:
    """Let compute services read what is beside the files of knowledge, also where it is only planned with."""
    requests = [g.request for g in snapshot.groundings.values()] + [e.request for e in snapshot.travel_estimates]
    for file in {field.file for request in requests for field in request if field.file is not None}:
        placed.allow(file.parent)


def check_kept(snapshot: Snapshot, settings: ComputeSettings, file: Path | None) -> None:
    """Only what is always the same may be kept for later runs.

    Raises:
        BadComputeSettings: Something else is to be kept.
    """
    same = {g.service for g in snapshot.groundings.values() if g.deterministic and not g.on_robot}
    same |= {estimate.service for estimate in snapshot.travel_estimates}
    for service in settings.cache.on_disk:
        if service not in same:
            told = f"no process with isDeterministic true is grounded in {service}, so that its replies cannot be kept"
            raise BadComputeSettings(str(file), "cache.on_disk", told)


def check_groundings(snapshot: Snapshot, offers: Callable[[str], bool], robots: list[str]) -> None:
    """What can be found out before anything moves: services that are not there, fields and types they don't have.

    Args:
        offers: Whether there is a service of this full name.

    Raises:
        GroundingError: Something is not there.
    """
    for grounding in snapshot.groundings.values():
        for field in (*grounding.request, *grounding.reply):
            if not is_type(field.message_type):
                raise GroundingError(grounding.process, field.name, f"there is no ROS type {field.message_type}")
        if grounding.on_robot:
            what = "topic" if grounding.is_topic else "action" if grounding.action_type else "service"
            for robot in robots:
                name = grounding.service.replace("{robot}", robot)
                if must_offer(snapshot.ontology, robot, grounding) and not offers(name):
                    raise GroundingError(grounding.process, grounding.name, f"{robot} offers no {what} {name}")
        elif offers(grounding.service) and not is_compute_service(grounding.service):
            continue  # what fields it takes, only whoever offers it knows
        elif wrong := wrong_fields(grounding.service, {field.name for field in grounding.request}):
            raise GroundingError(grounding.process, grounding.name, wrong)
    for estimate in snapshot.travel_estimates:
        if wrong := wrong_fields(estimate.service, {STARTS, PLACES, *(field.name for field in estimate.request)}):
            raise GroundingError("TravelDuration", estimate.service, wrong)


def start_of(robot: str, snapshot: Snapshot) -> PoseStamped:
    """Where a robot stands at first.

    Raises:
        BadRequest: It is not known.
    """
    place = snapshot.value(Property.LOCATED_AT, robot)
    if place is None:
        told = f"it is not known where {robot} stands; give it locatedAt in the ontology, or start in the scenario"
        raise BadRequest(robot, told)
    return pose_of(str(place), snapshot, t_s=0.0)
