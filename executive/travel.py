"""Travel times for the planner, from the service that the knowledge base names for them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from grounding.ground import field_of_individual, pose_of
from grounding.messages import Float64MultiArray, Path, PoseStamped, header
from grounding.runner import compute
from kb.store import Snapshot
from planner.planner import HERE

PLACES = "places"
"""The field of the request for travel times that holds the places."""


def travel_times(
    robots_to: Mapping[str, Sequence[str]],
    snapshot: Snapshot,
    pose_of_robot: Callable[[str], PoseStamped],
    *,
    t_s: float,
) -> dict[tuple[str, str, str], float]:
    """Seconds by (robot, from, to), from where each robot is and between the locations it may travel to.

    Args:
        robots_to: Locations by robot.
        pose_of_robot: Where a robot believes it is.
        t_s: Time now.

    Raises:
        ServiceFailed: The service cannot tell.
    """
    times: dict[tuple[str, str, str], float] = {}
    [estimate] = snapshot.travel_estimates
    for robot, locations in sorted(robots_to.items()):
        names = [HERE, *sorted(set(locations))]
        poses = [pose_of_robot(robot), *(pose_of(name, snapshot, t_s=t_s) for name in names[1:])]
        fields: dict[str, object] = {PLACES: Path(header=header("map", t_s), poses=poses)}
        for field in estimate.request:
            if field.file is not None:
                fields[field.name] = str(field.file)
            else:
                fields[field.name] = field_of_individual(robot, field, snapshot, process=estimate.service, t_s=t_s)
        reply = compute(estimate.service, fields, t_s=t_s)
        seconds = reply["seconds"]
        assert isinstance(seconds, Float64MultiArray)
        table = seconds.data.reshape(len(names), len(names))
        for row, origin in enumerate(names):
            for column, goal in enumerate(names):
                if goal != HERE and math.isfinite(table[row, column]):
                    times[robot, origin, goal] = float(table[row, column])
    return times
