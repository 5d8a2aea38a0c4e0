"""The grounding of a reading, as tests of topics need it."""

from __future__ import annotations

from kb.groundings import Field, Grounding


def topic_grounding(
    message_type: str = "geometry_msgs/PoseStamped", *, output: str = "at", max_age_s: float, timeout_s: float
) -> Grounding:
    """Of a process that has the message of a topic for an output."""
    message = Field(
        name="message",
        message_type=message_type,
        parameter=output,
        of_property=None,
        kind_of=False,
        file=None,
        optional=False,
    )
    return Grounding(
        name="Read_topic",
        process="Read",
        service="/{robot}/topic",
        on_robot=True,
        timeout_s=timeout_s,
        duration_s=0.0,
        request=(),
        reply=(message,),
        max_age_s=max_age_s,
    )
