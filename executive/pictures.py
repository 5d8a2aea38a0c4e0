"""Pictures of a run, drawn from its trace: who did what when, and where the robots went."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from executive.trace import FactsTold, FleetOpened, PlanMade, ProcessBegun, ProcessEnded, TraceEvent
from grounding.messages import OccupancyGrid
from kb.vocabulary import Property

_COLORS = tuple(
    f"tab:{c}" for c in ["blue", "orange", "green", "red", "purple", "brown", "pink", "gray", "olive", "cyan"]
)
_LABEL_FROM_S = 0.4
"""Shorter bars carry no text."""


def draw_gantt(events: Sequence[TraceEvent], path: Path) -> None:
    """Plan above, what happened below, robot by robot, over seconds."""
    robots = _robots(events)
    planned: list[tuple[str, str, float, float]] = []
    for event in events:
        if isinstance(event, PlanMade):  # a new plan takes the place of what the old one had not begun
            planned = [step for step in planned if step[2] < event.t_s]
            planned += [(robot, action, start_s, end_s) for action, robot, start_s, end_s in event.steps]
    actual = _long_processes(events)
    figure = Figure(figsize=(12, 1.2 + 1.1 * max(1, len(robots))), layout="constrained")
    axes = figure.add_subplot()
    names = sorted({_name(action) for _, action, *_ in [*planned, *actual]})
    color = {name: _COLORS[i % len(_COLORS)] for i, name in enumerate(names)}
    for row, robot in enumerate(robots):
        for steps, offset, alpha in ((planned, -0.2, 0.45), (actual, 0.2, 0.9)):
            for who, action, start_s, end_s in steps:
                if who == robot:
                    width_s = end_s - start_s
                    axes.barh(row + offset, width_s, 0.36, start_s, color=color[_name(action)], alpha=alpha)
                    if width_s >= _LABEL_FROM_S:
                        axes.text(start_s + 0.02, row + offset, action, va="center", fontsize=7, clip_on=True)
    axes.set_yticks(range(len(robots)), [f"{robot}\nplan / done" for robot in robots])
    axes.invert_yaxis()
    axes.set_xlabel("time, s")
    figure.legend(
        handles=[Patch(color=color[n], label=n) for n in names], fontsize=7, loc="outside upper right", ncols=8
    )
    _save(figure, path)


def draw_top_view(events: Sequence[TraceEvent], site_map: OccupancyGrid, path: Path) -> None:
    """The map from above, where each robot believed it was along the way, and what was found."""
    figure = Figure(figsize=(9, 7), layout="constrained")
    axes = figure.add_subplot()
    _draw_map(axes, site_map)
    for index, robot in enumerate(_robots(events)):
        told = [e.value for e in events if isinstance(e, FactsTold) and (e.prop, e.subject) == (_POSE, robot)]
        way = np.array([value for value in told if isinstance(value, list)])
        if len(way):
            color = _COLORS[index % len(_COLORS)]
            axes.plot(way[:, 0], way[:, 1], color=color, label=robot)
            axes.plot(way[0, 0], way[0, 1], "o", color=color)
            x_m, y_m, yaw_rad = way[-1]
            axes.quiver(x_m, y_m, np.cos(yaw_rad), np.sin(yaw_rad), color=color, scale=25, width=0.006)
    for event in events:
        if (
            isinstance(event, FactsTold)
            and event.prop == Property.HAS_DETECTED_POSITION
            and isinstance(event.value, list)
        ):
            axes.plot(event.value[0], event.value[1], "*", color="black", markersize=12)
            axes.annotate(event.subject, (event.value[0], event.value[1]), xytext=(6, 6), textcoords="offset points")
    axes.set_aspect("equal")
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    if axes.get_legend_handles_labels()[0]:  # matplotlib warns of a legend without entries
        axes.legend(loc="upper right")
    axes.set_title("where the robots went (o start, > end), and what they found (*)", fontsize=9)
    _save(figure, path)


_POSE = Property.HAS_POSE_ESTIMATE


def _draw_map(axes: Axes, site_map: OccupancyGrid) -> None:
    info = site_map.info
    cells = np.asarray(site_map.data).reshape(info.height, info.width)
    x_m, y_m = info.origin.position.x, info.origin.position.y
    extent = (x_m, x_m + info.width * info.resolution, y_m, y_m + info.height * info.resolution)
    axes.imshow(np.where(cells == 0, 1.0, 0.35), cmap="gray", vmin=0, vmax=1, origin="lower", extent=extent)


def _robots(events: Iterable[TraceEvent]) -> list[str]:
    return next((event.robots for event in events if isinstance(event, FleetOpened)), [])


def _name(action: str) -> str:
    return action.partition("(")[0]


def _long_processes(events: Iterable[TraceEvent]) -> list[tuple[str, str, float, float]]:
    """Composite processes with a robot that took a while, without those that are made of such."""
    begun: dict[tuple[str, str], float] = {}
    found: list[tuple[str, str, float, float]] = []
    for event in events:
        match event:
            case ProcessBegun() if event.robot:
                begun[event.task, event.process] = event.t_s
            case ProcessEnded() if event.robot:
                start_s = begun.pop((event.task, event.process), event.t_s)
                inner = any(who == event.robot and start_s <= from_s for who, _, from_s, _ in found)
                if event.t_s - start_s >= _LABEL_FROM_S and not inner:
                    found.append((event.robot, event.process, start_s, event.t_s))
                elif inner and event.t_s - start_s >= _LABEL_FROM_S:
                    last_s = max(to_s for who, _, _, to_s in found if who == event.robot)
                    found.append((event.robot, event.process, last_s, event.t_s))
            case _:
                pass
    return found


def _save(figure: Figure, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    # No date and no version of the library in the file: the same run gives the same bytes.
    figure.savefig(path, dpi=110, metadata={"Software": None})
