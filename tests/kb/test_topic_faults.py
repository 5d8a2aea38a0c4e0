"""The corpus of wrong edits, continued: groundings in topics."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.kb.conftest import GROUNDINGS, Edit, dropped, given, link, renamed
from tests.kb.faults import Fault, fault, found, make, told_before_reasoning
from tests.scenarios.laser_topic import ground_laser_in_topic

LASER = "Laser_service"
NAME = "<core:topicName>/{robot}/scan</core:topicName>"


def on_topic(words: str, *edits: Edit, because: str = "") -> Fault:
    """A mistake in knowledge that grounds the laser in a topic."""
    return fault("KB137", GROUNDINGS, LASER, ground_laser_in_topic, *edits, words=words, because=because)


TOPICS = [
    on_topic("topicName|/{robot}/scan", renamed(GROUNDINGS, LASER, NAME, "")),
    on_topic("topicName|/{robot}/scan", renamed(GROUNDINGS, LASER, "/{robot}/scan", "{robot} scan")),
    on_topic("maxAge_s|more than 0", dropped(GROUNDINGS, LASER, "maxAge_s")),
    on_topic("maxAge_s|more than 0", renamed(GROUNDINGS, LASER, ">0.15<", ">0.0<")),
    on_topic("maxAge_s|at most 1e8", renamed(GROUNDINGS, LASER, ">0.15<", ">1e9<")),
    on_topic("exactly one hasReplyField", dropped(GROUNDINGS, LASER, "hasReplyField"), because="KB122"),
    on_topic(
        "hasRequestField|not asked anything",
        given(GROUNDINGS, LASER, link("hasRequestField", GROUNDINGS, "Laser_service_scan")),
    ),
    on_topic(
        "messageType is no message|sensor_msgs/LaserScan",
        renamed(GROUNDINGS, "Laser_service_scan", "sensor_msgs/LaserScan", "float64"),
    ),
]


@pytest.mark.parametrize("case", TOPICS, ids=str)
def test_a_wrong_grounding_in_a_topic_is_refused(case: Fault, folder: Path) -> None:
    """With its code, at its place, in words that help."""
    make([case], folder)
    found([case], folder, told_before_reasoning(folder))
