"""What was learned reaches the planner and the checker of plans alike."""

from __future__ import annotations

import shutil
from pathlib import Path

from kb.files import SHIPPED
from kb.learned import Refinement, write_learned
from kb.store import KnowledgeBase
from kb.terms import struct
from kb.vocabulary import Property
from planner.checking.demands import Demands
from planner.classical_operators import Facts

IRI = "http://example.org/concertmaster/"


def test_planner_and_checker_are_told_the_same(tmp_path: Path) -> None:
    """Duration and odds of a process, as facts and as demands."""
    folder = Path(shutil.copytree(SHIPPED, tmp_path / "ontologies"))
    learned = [
        Refinement(prop=prop, subject=f"{IRI}find_empty_drink.owl#Kinect", value=value, source="")
        for prop, value in ((Property.DURATION_S, 0.125), (Property.SUCCESS_ODDS, 0.9))
    ]
    write_learned(folder, "tue_lab", learned)
    knowledge = KnowledgeBase("tue_lab", folder)
    snapshot = knowledge.snapshot()
    facts, demand = Facts(snapshot), Demands(snapshot, {}).of("Kinect")
    assert facts.of("duration", "Kinect") == [(struct("fixed", 125),)]
    assert facts.of("odds", "Kinect") == [(0.9,)]
    assert (demand.fixed_ms, demand.odds) == (125, 0.9)
    assert snapshot.groundings["Kinect"].duration_s == 0.125
    knowledge.close()
