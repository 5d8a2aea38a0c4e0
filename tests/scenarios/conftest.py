"""What scenario tests share: runs of FindEmptyDrink, and the truth to score them by."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from executive import Fleet, TaskResult
from executive.trace import FactsTold, PlanMade
from kb.files import SHIPPED
from kb.vocabulary import Property

ROBOTS = ("amigo_1", "pico_1")


@dataclass
class Scored:
    """A run and how far the robots' beliefs were from the truth of the simulator.

    Attributes:
        errors_m: Distances between believed and true positions, whenever a pose was told.
        errors_rad: The same for headings.
    """

    fleet: Fleet
    result: TaskResult
    errors_m: list[float] = field(default_factory=list)
    errors_rad: list[float] = field(default_factory=list)

    @property
    def plan(self) -> PlanMade:
        """The last plan in the trace."""
        return [event for event in self.fleet.trace if isinstance(event, PlanMade)][-1]

    def searcher(self, drink: str) -> str:
        """The robot that the plan has detect a drink."""
        return next(
            robot for action, robot, *_ in self.plan.steps if action.startswith("Detection") and drink in action
        )


def run_scored(fleet: Fleet, **options: object) -> Scored:
    """Run FindEmptyDrink in an open fleet and score every told pose against the simulator."""
    simulation, told = fleet.parts.simulation, 0
    task = fleet.request("FindEmptyDrink", **{"room": "tue_lab", **options})  # type: ignore[arg-type]
    scored = Scored(fleet=fleet, result=None)  # type: ignore[arg-type]
    result = None
    while result is None:
        truth = {robot: simulation.true_pose(robot) for robot in ROBOTS}
        before_s = fleet.now_s
        result = task.wait_until(before_s + 0.005)
        for event in fleet.trace[told:]:
            if (
                isinstance(event, FactsTold)
                and event.prop == Property.HAS_POSE_ESTIMATE
                and isinstance(event.value, list)
            ):
                x_m, y_m, yaw_rad = event.value
                true_x_m, true_y_m, true_yaw_rad = truth[event.subject]
                scored.errors_m.append(math.hypot(x_m - true_x_m, y_m - true_y_m))
                scored.errors_rad.append(abs(math.remainder(yaw_rad - true_yaw_rad, math.tau)))
        told = len(fleet.trace)
    scored.result = result
    return scored


@pytest.fixture
def knowledge(tmp_path: Path) -> Path:
    """A copy of the shipped ontologies that a test may edit."""
    folder = tmp_path / "ontologies"
    shutil.copytree(SHIPPED, folder)
    return folder


Edit = Callable[[Path, str, str], None]


@pytest.fixture
def edit() -> Edit:
    """A function of (file, old, new) that replaces a text that must be there exactly once."""

    def replace(file: Path, old: str, new: str) -> None:
        text = file.read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{file.name} has {text.count(old)} times: {old}"
        file.write_text(text.replace(old, new), encoding="utf-8")

    return replace


NO_KINECT = """        <rdfs:subClassOf>
            <owl:Restriction>
                <owl:onProperty rdf:resource="http://example.org/concertmaster/core.owl#hasSensor"/>
                <owl:someValuesFrom rdf:resource="http://example.org/concertmaster/core.owl#Kinect"/>
            </owl:Restriction>
        </rdfs:subClassOf>
"""
"""`SubClassOf: hasSensor some Kinect`, as Protégé writes it."""
