"""What can go wrong in the simulator."""

from __future__ import annotations

from kb.errors import BadFile, ServiceFailed


class BadScenario(BadFile):
    """A scenario, world or model file is wrong, or does not fit where the robots are told to stand."""


class ServiceRefused(ServiceFailed):
    """A robot does not do what it is asked, because the request is wrong.

    Args:
        code: `BadRequest` (a field is missing, unknown or has no usable value) or `Closed` (the simulator ended).
        message: What is wrong and what would be right.
    """

    fault = "request"
