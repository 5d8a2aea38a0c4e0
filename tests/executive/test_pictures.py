"""Pictures of a run: made for any trace, the same bytes every time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib.image
import pytest

from executive.pictures import draw_gantt, draw_top_view
from executive.trace import FactsTold, FleetOpened, PlanMade, ProcessBegun, ProcessEnded, Replanned, TraceEvent
from executive.wiring import site_map
from grounding.messages import OccupancyGrid
from kb.store import Snapshot

Draw = Callable[[Sequence[TraceEvent], Path], None]

OPENED = FleetOpened(t_s=0.0, site="tue_lab", robots=["r1", "r2"], knowledge="", scenario="tue_lab", seed=1)


def plan(t_s: float, *steps: tuple[str, str, float, float]) -> PlanMade:
    """A plan."""
    return PlanMade(
        t_s=t_s, task="one", status="SOLVED_OPTIMALLY", makespan_s=5.0, lower_bound_s=5.0, steps=list(steps), reason=""
    )


def process(kind: type[ProcessBegun | ProcessEnded], t_s: float, name: str, robot: str) -> ProcessBegun | ProcessEnded:
    """The begin or end of a composite process."""
    return kind(t_s=t_s, task="one", process=f"{name}({robot})", robot=robot)


def pose(t_s: float, robot: str, *xyyaw: float) -> FactsTold:
    """Where a robot believes it is."""
    return FactsTold(t_s=t_s, task="one", prop="hasPoseEstimate", subject=robot, value=list(xyyaw))


REPLANNED: list[TraceEvent] = [
    OPENED,
    plan(0.5, ("Navigate(r1)", "r1", 0.5, 4.0), ("Search(r1)", "r1", 4.0, 5.0)),
    process(ProcessBegun, 0.5, "Tidy", "r1"),
    process(ProcessBegun, 0.5, "Navigate", "r1"),
    pose(1.0, "r1", 1.0, 1.0, 0.0),
    pose(2.0, "r1", 2.0, 1.0, 0.5),
    process(ProcessEnded, 2.5, "Navigate", "r1"),
    Replanned(t_s=2.5, task="one", reason="r1 broke"),
    plan(3.0, ("Navigate(r2)", "r2", 3.0, 6.0), ("Search(r2)", "r2", 6.0, 7.0)),
    process(ProcessBegun, 3.0, "Navigate", "r2"),
    pose(4.0, "r2", 8.0, 2.0, 1.5),
    process(ProcessEnded, 6.0, "Navigate", "r2"),
    FactsTold(t_s=7.0, task="one", prop="hasDetectedPosition", subject="can", value=[8.0, 5.5, 0.8]),
    process(ProcessEnded, 7.0, "Tidy", "r1"),
]
TRACES: dict[str, list[TraceEvent]] = {
    "replanned": REPLANNED,
    "cut off": REPLANNED[:9],
    "without a step": [OPENED, plan(0.5)],
    "opened": [OPENED],
    "empty": [],
}


@pytest.fixture(scope="module")
def lab_map(snapshot: Snapshot) -> OccupancyGrid:
    """The map of the shipped site."""
    return site_map(snapshot)


@pytest.fixture(params=["gantt", "top view"])
def draw(request: pytest.FixtureRequest, lab_map: OccupancyGrid) -> Draw:
    """Either picture, drawn from events to a file."""
    return draw_gantt if request.param == "gantt" else lambda events, path: draw_top_view(events, lab_map, path)


@pytest.mark.parametrize("name", TRACES)
def test_any_trace_has_its_picture(tmp_path: Path, draw: Draw, name: str) -> None:
    """A readable PNG, in a folder that is made for it, the same bytes when drawn twice."""
    one, two = tmp_path / "deep" / "one.png", tmp_path / "two.png"
    draw(TRACES[name], one)
    draw(TRACES[name], two)
    height, width, _ = matplotlib.image.imread(one).shape
    assert min(height, width) > 200
    assert one.read_bytes() == two.read_bytes()


def test_the_picture_shows_the_trace(tmp_path: Path, draw: Draw) -> None:
    """What is replanned and done changes the picture."""
    draw(REPLANNED, tmp_path / "whole.png")
    draw(REPLANNED[:2], tmp_path / "begin.png")
    assert (tmp_path / "whole.png").read_bytes() != (tmp_path / "begin.png").read_bytes()
