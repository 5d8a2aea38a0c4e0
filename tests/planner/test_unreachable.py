"""Robots that do not answer are not planned with."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from executive.shown import lacking
from kb.store import KnowledgeBase
from kb.vocabulary import Property
from planner.explain import Explainer
from planner.plan import Plan, PlanStatus
from planner.planner import Session
from tests.planner.conftest import travel_of
from tests.planner.test_planner import ROBOTS, TIMES, Driver, searched


@pytest.fixture
def knowledge() -> Iterator[KnowledgeBase]:
    """The shipped site, told facts of its own."""
    base = KnowledgeBase("tue_lab")
    yield base
    base.close()


def session_of(base: KnowledgeBase) -> Session:
    """FindEmptyDrink with both robots."""
    snapshot = base.snapshot()
    return Session(f"task@{snapshot.revision}", snapshot, "FindEmptyDrink", {"room": "tue_lab"}, robots=2)


def plan_of(session: Session) -> Plan:
    """Its plan from the beginning."""
    return session.plan(travel_of(TIMES), now_s=0.0)


def test_the_others_do_it_all(knowledge: KnowledgeBase) -> None:
    """Until the robot answers again; why it is not chosen is told."""
    knowledge.tell(Property.IS_REACHABLE, "amigo_1", value=False)
    session = session_of(knowledge)
    plan = plan_of(session)
    assert plan.status is PlanStatus.SOLVED_OPTIMALLY
    assert {robot for robot, _ in searched(plan)} == {"pico_1"}
    explained = Explainer(session, travel_of(TIMES), now_s=0.0).why(plan)
    assert "amigo_1 cannot do" in explained.text
    assert "it does not answer" in explained.text
    knowledge.tell(Property.IS_REACHABLE, "amigo_1", value=True)
    session.observed(Property.IS_REACHABLE, "amigo_1", value=True, now_s=0.0)
    assert {robot for robot, _ in searched(plan_of(session))} == set(ROBOTS)
    session.close()


def test_without_anybody_there_is_no_plan(knowledge: KnowledgeBase) -> None:
    """It is said who does not answer, once for each."""
    for robot in ROBOTS:
        knowledge.tell(Property.IS_REACHABLE, robot, value=False)
    session = session_of(knowledge)
    assert plan_of(session).status is PlanStatus.UNSOLVABLE_PROVEN
    told = lacking(session.exclusions(), knowledge.snapshot())
    assert told == ("amigo_1 does not answer", "pico_1 does not answer")
    session.close()


def test_what_a_robot_was_to_do_later_is_open_again_when_it_is_lost(knowledge: KnowledgeBase) -> None:
    """Also what has not begun: the other robot does it."""
    session = session_of(knowledge)
    plan_of(session)
    driver = Driver(session)
    driver.next_actions()
    driver.run_until(lambda a: a.robot == "amigo_1")
    knowledge.tell(Property.IS_REACHABLE, "amigo_1", value=False)
    assert driver.fail() == "amigo_1"
    plan = session.plan(travel_of(TIMES), now_s=driver.now_s)
    assert [robot for robot, _ in searched(plan)] == ["pico_1", "pico_1"]
    driver.next_actions()
    driver.run()
    assert driver.done
    session.close()
