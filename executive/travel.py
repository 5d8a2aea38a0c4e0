"""Travel times for the planner, from the service that the knowledge base names for them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from grounding.ground import field_of_individual, pose_of
from grounding.messages import Float64MultiArray, Path, PoseStamped, header, stamp_of
from grounding.runner import Runner
from kb.store import Snapshot
from kb.vocabulary import Property
from planner.network import NO_WAY, Milliseconds, Travel

STARTS, PLACES = "starts", "places"
"""The fields of the request for travel times that hold where robots are, and the places."""

_MS_PER_S = 1000
_PATIENCE_S = 600.0
"""Only an estimate that hangs for good is to be stopped: without it there is no plan."""


def travel_times(
    robots: Sequence[str],
    places: Sequence[str],
    snapshot: Snapshot,
    pose_of_robot: Callable[[str], PoseStamped],
    runner: Runner,
    *,
    t_s: float,
) -> Travel:
    """How long robots travel, from where each is and between places. Robots that travel alike are asked for at once.

    What the service estimates counts `travelFactor` times, if a robot has one.

    Args:
        pose_of_robot: Where a robot believes it is.
        runner: Where the service runs, or its reply to an equal request is known.
        t_s: Time now.

    Raises:
        ServiceFailed: The service cannot tell.
    """
    if not snapshot.travel_estimates:  # nothing in this knowledge base travels
        return Travel(places=(), profile={}, between=(), here={})
    [estimate] = snapshot.travel_estimates
    alike: dict[tuple[object, ...], list[str]] = {}
    for robot in robots:
        fields = (
            str(f.file)
            if f.file is not None
            else field_of_individual(robot, f, snapshot, process=estimate.service, t_s=t_s)
            for f in estimate.request
        )
        stated = snapshot.ontology.value(Property.TRAVEL_FACTOR, robot)
        alike.setdefault((1.0 if stated is None else stated, *fields), []).append(robot)
    poses = [pose_of(place, snapshot, t_s=t_s) for place in places]
    profile: dict[str, int] = {}
    between: list[Milliseconds] = []
    here: dict[str, Milliseconds] = {}
    for (factor, *values), group in alike.items():
        assert isinstance(factor, int | float)
        request: dict[str, object] = dict(zip((f.name for f in estimate.request), values, strict=True))
        request[STARTS] = Path(header=header("map", t_s), poses=[_now(pose_of_robot(robot), t_s) for robot in group])
        request[PLACES] = Path(header=header("map", t_s), poses=poses)
        seconds = runner.submit(estimate.service, request, t_s=t_s, timeout_s=_PATIENCE_S).result()["seconds"]
        assert isinstance(seconds, Float64MultiArray)
        table = _milliseconds(seconds, (len(group) + len(places), len(places)), factor)
        for number, robot in enumerate(group):
            profile[robot] = len(between)
            here[robot] = table[number]
        between.append(table[len(group) :])
    return Travel(places=tuple(places), profile=profile, between=tuple(between), here=here)


def _now(pose: PoseStamped, t_s: float) -> PoseStamped:
    """A pose as that of now: where a robot stands still, requests are equal, whenever it was measured."""
    return replace(pose, header=replace(pose.header, stamp=stamp_of(t_s)))


def _milliseconds(seconds: Float64MultiArray, shape: tuple[int, int], factor: float) -> Milliseconds:
    table = np.asarray(seconds.data, dtype=float).reshape(shape)
    reached = np.isfinite(table)
    milliseconds: Milliseconds = np.full(table.shape, NO_WAY, dtype=np.int64)
    milliseconds[reached] = np.rint(table[reached] * (factor * _MS_PER_S)).astype(np.int64)
    return milliseconds
