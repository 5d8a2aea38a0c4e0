"""How much time the executive's own thinking takes."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Pace:
    """How much time thinking takes beside what the clock sees of it.

    Attributes:
        planning_s: To make a plan.
        deciding_s: For each decision of what may start now.
    """

    planning_s: float
    deciding_s: float


SIMULATED = Pace(planning_s=0.5, deciding_s=0.001)
"""Simulated time stands still meanwhile. A plan takes about 0.3 s on two slow cores, most of it travel times."""

REAL = Pace(planning_s=0.0, deciding_s=0.0)
"""A real clock goes on by itself."""
