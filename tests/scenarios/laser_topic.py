"""Knowledge in which the laser is read from a topic rather than from a service."""

from __future__ import annotations

from pathlib import Path

_BASE = "http://example.org/concertmaster"
_DOUBLE = 'rdf:datatype="http://www.w3.org/2001/XMLSchema#double"'


def ground_laser_in_topic(knowledge: Path, *, max_age_s: float = 0.15, timeout_s: float = 1.0) -> None:
    """Let a copy of the shipped ontologies say that scans are those of `/{robot}/scan`."""
    file = knowledge / "tasks" / "groundings.owl"
    before, head, rest = file.read_text(encoding="utf-8").partition(
        f'<owl:NamedIndividual rdf:about="{_BASE}/groundings.owl#Laser_service">'
    )
    laser, end, after = rest.partition("</owl:NamedIndividual>")
    for old, new in (
        ("core.owl#RobotGrounding", "core.owl#TopicGrounding"),
        (
            "<core:serviceName>/{robot}/laser</core:serviceName>",
            f"<core:topicName>/{{robot}}/scan</core:topicName>\n"
            f"        <core:maxAge_s {_DOUBLE}>{max_age_s}</core:maxAge_s>",
        ),
        (f"<core:timeout_s {_DOUBLE}>1.0<", f"<core:timeout_s {_DOUBLE}>{timeout_s}<"),
    ):
        assert laser.count(old) == 1, old
        laser = laser.replace(old, new)
    file.write_text(before + head + laser + end + after, encoding="utf-8")
