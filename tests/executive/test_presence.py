"""Robots that are lost, and come back."""

from __future__ import annotations

import numpy as np

from executive.presence import Presence
from grounding.faults import Fault, FaultKind, FaultyTransport
from grounding.inprocess import InProcessTransport, Service
from grounding.transport import ServiceCall
from kb.clock import SimClock

CUT = Fault(service="/r1/*", kind=FaultKind.CUT, from_s=1.0, until_s=4.5)


def call(number: int, robot: str) -> ServiceCall:
    """One that was lost."""
    return ServiceCall(id=number, service=f"/{robot}/laser", fields={}, timeout_s=1.0)


def run_until(clock: SimClock, t_s: float) -> None:
    """Let everything happen until then."""
    clock.call_at(t_s, lambda: None)
    clock.run_until(lambda: clock.now_s >= t_s)


def test_a_robot_that_was_cut_off_is_back_when_it_answers_again() -> None:
    """It is asked every second, however many of its calls were lost, and told once; the next time it is asked anew."""
    clock, told = SimClock(), list[tuple[str, float]]()
    robots = InProcessTransport(clock)
    for robot in ("r1", "r2"):
        robots.offer(f"/{robot}/laser", Service(handler=lambda fields: {}, latency_s=0.0))
    faulty = FaultyTransport(robots, clock, [CUT], np.random.default_rng(1))
    presence = Presence(faulty, clock, lambda fact: told.append((fact.subject, clock.now_s)))
    run_until(clock, 2.0)
    presence.lose("r1", call(1, "r1"))
    presence.lose("r1", call(2, "r1"))
    presence.lose("r2", call(3, "r2"))
    run_until(clock, 10.0)
    assert told == [("r2", 3.0), ("r1", 5.0)]
    presence.lose("r1", call(4, "r1"))
    run_until(clock, 20.0)
    assert told[2:] == [("r1", 11.0)]
