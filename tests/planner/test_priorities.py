"""Several requests at once over one fleet: none delays a more important one, and all are done."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from kb.store import Snapshot
from planner.plan import Plan, PlanStatus
from planner.planner import Session
from planner.progress import Ended
from tests.planner.conftest import random_times, travel_of
from tests.planner.test_planner import LAB_PLACES, ROBOTS, TIMES, Driver

FIND = "FindEmptyDrink"


def end_s(plan: Plan, frame: str) -> float:
    """When the last step of a request ends, from when the plan is made; 0 if it has none."""
    ends = [s.end_s for s in plan.steps if s.action.id.startswith(f"{frame}/")]
    return max(ends, default=plan.made_at_s) - plan.made_at_s


@pytest.mark.parametrize(("priority", "first"), [(5, "urgent"), (-5, "usual")])
def test_the_more_important_request_ends_as_soon_as_if_it_were_alone(
    larger_lab: Callable[[int, int], Snapshot], priority: int, first: str
) -> None:
    """Two requests for the same robots, in random worlds (in which a detour for the other may even save time)."""
    snapshot = larger_lab(2, 4)
    rng = np.random.default_rng(priority + 10)
    rooms = {"usual": "kitchen", "urgent": "living_room"}
    for _ in range(5):
        times = travel_of(random_times(rng, snapshot.ontology.individuals("Robot"), LAB_PLACES, 1.0))
        alone = Session("alone", snapshot, FIND, {"room": rooms[first]}, robots=2)
        least_s = alone.plan(times, now_s=0.0).makespan_s
        alone.close()
        both = Session("usual", snapshot, FIND, {"room": rooms["usual"]}, robots=2)
        both.add_request("urgent", FIND, {"room": rooms["urgent"]}, priority=priority, now_s=0.0)
        plan = both.plan(times, now_s=0.0)
        both.close()
        assert plan.status is PlanStatus.SOLVED_OPTIMALLY
        assert end_s(plan, first) <= least_s + 1e-6
        assert end_s(plan, "usual") > 0.0
        assert end_s(plan, "urgent") > 0.0


def test_requests_of_one_priority_are_planned_for_the_least_time_of_all(tue_lab: Snapshot) -> None:
    """One drink each: both robots work at once."""
    session = Session("one", tue_lab, FIND, {"room": "kitchen"}, robots=2)
    session.add_request("two", FIND, {"room": "living_room"}, priority=0, now_s=0.0)
    plan = session.plan(travel_of(TIMES), now_s=0.0)
    whole = Session("whole", tue_lab, FIND, {"room": "tue_lab"}, robots=2)
    assert plan.makespan_s == whole.plan(travel_of(TIMES), now_s=0.0).makespan_s
    session.close()
    whole.close()


def test_a_request_that_comes_while_another_is_underway_is_done_too(tue_lab: Snapshot) -> None:
    """What is running goes on; both requests end."""
    session = Session("first", tue_lab, FIND, {"room": "kitchen"}, robots=2)
    session.plan(travel_of(TIMES), now_s=0.0)
    driver = Driver(session)
    driver.take(session.next_actions(now_s=0.0))
    running = list(driver.running)
    added = session.add_request("second", FIND, {"room": "living_room"}, priority=1, now_s=0.0)
    assert added.replan
    plan = session.plan(travel_of(TIMES), now_s=0.0)
    assert plan.solved
    driver.take(session.next_actions(now_s=0.0))
    assert driver.running[: len(running)] == running
    driver.run()
    ended = {e.action.id for e in driver.events if isinstance(e, Ended)}
    assert {"first/task", "second/task"} <= ended
    assert driver.done
    assert {a.robot for a in driver.started} <= set(ROBOTS)
    session.close()
