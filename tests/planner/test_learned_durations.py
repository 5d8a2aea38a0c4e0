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
from planner.plan import PlanStatus
from planner.planner import Session
from tests.planner.conftest import travel_of
from tests.planner.test_planner import NAVIGATE_S, SEARCH_S, TIMES

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


def of_amigo(prop: Property, process: str, value: float, place: str = "") -> Refinement:
    """What was learned of amigo_1, everywhere or at a place."""
    return Refinement(
        prop=prop,
        subject=f"{IRI}find_empty_drink.owl#{process}",
        value=value,
        source="",
        robot=f"{IRI}tue_lab.owl#amigo_1",
        place=f"{IRI}tue_lab.owl#{place}" if place else "",
    )


def searches(folder: Path, learned: list[Refinement], robots: int) -> tuple[set[tuple[str, str]], float]:
    """Who is sent where by a proven plan, and how long it takes (s)."""
    write_learned(folder, "tue_lab", learned)
    knowledge = KnowledgeBase("tue_lab", folder)
    session = Session("task", knowledge.snapshot(), "FindEmptyDrink", {"room": "tue_lab"}, robots=robots)
    plan = session.plan(travel_of(TIMES), now_s=0.0)
    session.close()
    knowledge.close()
    assert plan.status is PlanStatus.SOLVED_OPTIMALLY
    sent = {
        (str(step.action.robot), str(step.action.argument("location")))
        for step in plan.steps
        if step.action.process == "Navigate"
    }
    return sent, plan.makespan_s


def test_a_robot_that_is_slow_is_not_sent(tmp_path: Path) -> None:
    """Of two robots one may work: the one that is nearer, unless it looks long, or often in vain."""
    folder = Path(shutil.copytree(SHIPPED, tmp_path / "ontologies"))
    sent, before_s = searches(folder, [], 1)
    assert {robot for robot, _ in sent} == {"amigo_1"}
    for prop, value in ((Property.DURATION_S, 5.0), (Property.SUCCESS_ODDS, 0.01)):
        sent, took_s = searches(folder, [of_amigo(prop, "Detection", value)], 1)
        assert {robot for robot, _ in sent} == {"pico_1"}
        assert took_s == before_s + 2.0


def test_a_robot_is_not_sent_where_it_is_slow(tmp_path: Path) -> None:
    """It is nearer to the coffee table, where it has looked long; each goes to the other table then."""
    folder = Path(shutil.copytree(SHIPPED, tmp_path / "ontologies"))
    sent, _ = searches(folder, [], 2)
    assert sent == {("amigo_1", "at_coffee_table"), ("pico_1", "at_dining_table")}
    there = [of_amigo(Property.DURATION_S, "Detection", 20.0, "at_coffee_table")]
    sent, took_s = searches(folder, there, 2)
    assert sent == {("amigo_1", "at_dining_table"), ("pico_1", "at_coffee_table")}
    assert took_s == 11.0 + NAVIGATE_S + SEARCH_S
    everywhere = [
        of_amigo(Property.DURATION_S, "Detection", 20.0),
        of_amigo(Property.DURATION_S, "Detection", 0.03, "at_coffee_table"),
    ]
    sent, _ = searches(folder, everywhere, 2)
    assert sent == {("amigo_1", "at_coffee_table"), ("pico_1", "at_dining_table")}
