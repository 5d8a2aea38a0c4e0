"""Errors of the planner."""

from __future__ import annotations

from kb.errors import InternalError


class InvalidPlan(InternalError):
    """The independent checker does not accept a plan that the planner made.

    Attributes:
        violations: What is wrong with it, one sentence each.
    """

    def __init__(self, violations: list[str]) -> None:
        self.violations = violations
        super().__init__("the plan does not stand up to the checker: " + "; ".join(violations))
